//! Whether what is said about a rotary axis makes sense.

use compensator::rotary::{SAMPLES_MIN, WIDTHS_APART};
use units::{Radians, Short};

use super::line_speed;
use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::config::validate::drive::check_axis_name;
use crate::hardware::analog::check_input;
use crate::rotary::{PositionRangeName, RotaryCalibrateConfig, RotaryConfig, RotaryVerifyConfig};

pub(crate) fn check_rotaries(config: &MachineConfig, findings: &mut Vec<Finding>) {
    for (name, rotary) in &config.rotary {
        check_axis_name(findings, "rotary", name);
        let judge = &mut Judge::at(format!("rotary.{name}"), findings);
        if config.axis.contains_key(name) {
            judge.say(
                "",
                format!("there is an axis `{name}` too"),
                "give one of them another name",
            );
        }
        check_drive(judge, config, rotary);
        check_range(judge, rotary);
        if let Some(zero) = &rotary.zero {
            let judge = &mut Judge::at(format!("rotary.{name}.zero"), findings);
            let speed = zero.index_speed_deg_per_s;
            let most = (rotary.speed_max_deg_per_s, SPEED_MAX);
            judge.up_to("index_speed_deg_per_s", speed, most);
        }
        check_signal(name, config, rotary, findings);
        check_cycle(name, config, rotary, findings);
    }
}

/// Calibration, verification, compensation.
fn check_cycle(
    name: &str,
    config: &MachineConfig,
    rotary: &RotaryConfig,
    findings: &mut Vec<Finding>,
) {
    let mut design = None;
    if let Some(run) = &rotary.calibrate {
        check_reader(name, rotary, run, findings);
        let judge = &mut Judge::at(format!("rotary.{name}.calibrate"), findings);
        for (section, is_there) in [
            ("zero", rotary.zero.is_some()),
            ("compensation", rotary.compensation.is_some()),
        ] {
            if !is_there {
                let help =
                    format!("add [rotary.{name}.{section}], or remove [rotary.{name}.calibrate]");
                judge.say("", format!("needs the section `{section}`"), help);
            }
        }
        check_run(judge, config, rotary, run);
        design = check_placements(judge, run);
    }
    if let Some(verify) = &rotary.verify {
        let judge = &mut Judge::at(format!("rotary.{name}.verify"), findings);
        match (&rotary.calibrate, design) {
            (None, _) => judge.say(
                "",
                "needs the section `calibrate`, which says what the plate is",
                format!("add [rotary.{name}.calibrate], or leave the verification out"),
            ),
            (Some(run), design) => check_verify(judge, run, design.unwrap_or_default(), verify),
        }
    }
}

/// What reads the lines: a detector or a person.
fn check_reader(
    name: &str,
    rotary: &RotaryConfig,
    run: &RotaryCalibrateConfig,
    findings: &mut Vec<Finding>,
) {
    let readers = [
        ("line_detector", rotary.line_detector.is_some()),
        ("line_signal", rotary.line_signal.is_some()),
        ("sighting", rotary.sighting.is_some()),
    ];
    let there: Vec<_> = readers.iter().filter(|it| it.1).map(|it| it.0).collect();
    let judge = &mut Judge::at(format!("rotary.{name}.calibrate"), findings);
    match there.as_slice() {
        [] => judge.say(
            "",
            "needs the section `line_detector`, `line_signal` or `sighting`, which reads the lines",
            format!(
                "add [rotary.{name}.line_detector] or [rotary.{name}.line_signal], or [rotary.{name}.sighting] \
                 where a person reads them, or remove [rotary.{name}.calibrate]"
            ),
        ),
        [_] => {}
        [first, others @ ..] => judge.say(
            "",
            format!(
                "has `{first}` and `{}`, and only one of them can read the lines",
                others.join("` and `")
            ),
            format!("remove [rotary.{name}.{}]", others.join(&format!("] or [rotary.{name}."))),
        ),
    }
    let spacing = Radians::TURN.arcsec() / f64::from(run.lines);
    if let Some(sighting) = &rotary.sighting {
        let most = spacing / 4.0;
        if sighting.range_arcsec > most {
            let judge = &mut Judge::at(format!("rotary.{name}.sighting"), findings);
            judge.say(
                "range_arcsec",
                format!(
                    "{} is more than a quarter of the spacing of {} lines: one could be taken for another",
                    sighting.range_arcsec, run.lines
                ),
                format!("give at most {most:.3}"),
            );
        }
    }
}

/// The input that a detector's voltage comes from, and what of it is a line.
fn check_signal(
    name: &str,
    config: &MachineConfig,
    rotary: &RotaryConfig,
    findings: &mut Vec<Finding>,
) {
    let Some(signal) = &rotary.line_signal else {
        return;
    };
    let judge = &mut Judge::at(format!("rotary.{name}.line_signal"), findings);
    check_input(judge, &config.analog, (&signal.analog, signal.channel));
    let module = config.analog.get(&signal.analog);
    if module.is_some_and(|it| it.node().map(|node| &node.bus) != Some(&rotary.node.bus)) {
        judge.say(
            "analog",
            format!(
                "`{}` is not on the bus of the drive, `{}`: its voltages are not sampled with the angle",
                signal.analog, rotary.node.bus
            ),
            format!("give an analog module on `{}`", rotary.node.bus),
        );
    }
    let place = signal.place(config);
    let full_scale = place.and_then(|at| module?.full_scale_v.get(at).copied());
    if let Some(most) = full_scale.filter(|most| signal.level_v.abs() >= *most) {
        judge.say(
            "level_v",
            format!(
                "{} is not below the largest voltage of the input, {most}",
                signal.level_v
            ),
            "give half of the height of a line",
        );
    }
    if let Some(run) = &rotary.calibrate {
        let most = Radians::TURN.arcsec() / f64::from(run.lines) / WIDTHS_APART;
        if signal.width_arcsec > most {
            judge.say(
                "width_arcsec",
                format!(
                    "{} is more than a quarter of the spacing of {} lines: they run into each other",
                    signal.width_arcsec, run.lines
                ),
                format!("give at most {most:.3}"),
            );
        }
    }
}

fn check_run(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    rotary: &RotaryConfig,
    run: &RotaryCalibrateConfig,
) {
    if run.plate.trim().is_empty() {
        let help = "give the serial number on the plate: a resumed run and a verification need \
                    the same one";
        judge.say("plate", "is empty", help);
    }
    let speed = run.speed_deg_per_s.unwrap_or(rotary.speed_deg_per_s);
    let most = (rotary.speed_max_deg_per_s, SPEED_MAX);
    judge.up_to("speed_deg_per_s", speed, most);
    if let Some(signal) = &rotary.line_signal {
        let fits = signal.speed_max(config, rotary);
        if let Some(fits) = fits.filter(|fits| speed > *fits) {
            judge.say(
                "speed_deg_per_s",
                format!(
                    "a line of {} arcsec passes too fast at {speed}°/s to be sampled {SAMPLES_MIN} times",
                    signal.width_arcsec
                ),
                format!("give at most {}", floored(fits)),
            );
        }
    }
    let bus = config.can.get(&rotary.node.bus);
    let Some(bus) = bus.filter(|_| rotary.line_detector.is_some()) else {
        return;
    };
    let fits = line_speed::speed_max(run.lines, bus.sync_period_ms);
    if speed > fits {
        judge.say(
            "speed_deg_per_s",
            format!(
                "{} lines pass too fast at {speed}°/s for each to be read with SYNC every {} ms",
                run.lines, bus.sync_period_ms
            ),
            format!("give at most {fits:.3}, or shorten sync_period_ms"),
        );
    }
}

/// To three digits behind the point, and never more than it is.
fn floored(speed: f64) -> f64 {
    (speed * 1e3).floor() / 1e3
}

/// The offsets, when they are of use.
fn check_placements(judge: &mut Judge<'_>, run: &RotaryCalibrateConfig) -> Option<Vec<usize>> {
    if !(12..=100_000).contains(&run.lines) {
        return None;
    }
    if run.offsets.is_some() == run.placements.is_some() {
        judge.say(
            "offsets",
            "either `offsets` or `placements` says how the plate is placed",
            "give `placements = 4` to have the offsets planned, or `offsets = [0, 1, …]`",
        );
        return None;
    }
    if run.optimise.is_some() && run.offsets.is_some() {
        let help = "leave one of them out";
        judge.say("optimise", "`offsets` leave nothing to optimise", help);
    }
    match run.design() {
        Ok(design) => Some(design.offsets().to_vec()),
        Err(error) => {
            let key = if run.offsets.is_some() {
                "offsets"
            } else {
                "placements"
            };
            let help = "give two or more, fewer than `lines`; `truestage plan rotary` shows what each arrangement gives";
            judge.say(key, error.to_string(), help);
            None
        }
    }
}

fn check_verify(
    judge: &mut Judge<'_>,
    run: &RotaryCalibrateConfig,
    offsets: Vec<usize>,
    verify: &RotaryVerifyConfig,
) {
    let offset = verify.offset_lines;
    if !(0.0..f64::from(run.lines)).contains(&offset) {
        let cause = format!("{} is impossible", Short(offset));
        let help = format!("give 0 or more, and less than {} (`lines`)", run.lines);
        judge.say("offset_lines", cause, help);
    }
    let quarters = offset * 4.0;
    if quarters != quarters.round() {
        let help = "give whole lines, halves or quarters: 200, 200.5, 200.25";
        judge.say("offset_lines", format!("{offset} is hard to set"), help);
    }
    if offsets.iter().any(|used| *used as f64 == offset) {
        judge.say(
            "offset_lines",
            format!("the plate lies there in the calibration already (offsets {offsets:?})"),
            "give another number; half a line beyond a whole one shows the places between lines",
        );
    }
}

/// The key that bounds each speed.
const SPEED_MAX: &str = "speed_max_deg_per_s";

/// Positions of 32 bits.
const REGISTER: u64 = 1 << 32;

fn check_drive(judge: &mut Judge<'_>, config: &MachineConfig, rotary: &RotaryConfig) {
    let speed_max = rotary.speed_max_deg_per_s;
    let most = (speed_max, SPEED_MAX);
    judge.up_to("speed_deg_per_s", rotary.speed_deg_per_s, most);
    if let Some(kept) = &rotary.kept_zero {
        kept.check(judge);
        if kept.is_absolute() {
            judge.say(
                "kept_zero.by",
                "is for an axis that is homed where it stands, and a table is homed on its encoder's index mark",
                "take another proof, or remove it",
            );
        }
        if rotary.position_range == PositionRangeName::CountsOn
            && !REGISTER.is_multiple_of(u64::from(rotary.counts_per_turn.max(1)))
        {
            judge.say(
                "kept_zero",
                "is not possible where the drive counts on: where its 32 bits are full, it begins anew within a turn, and \
                 nobody sees after a start how often it has",
                "let the position wrap at a turn (`position_range`), or remove it",
            );
        }
    }
    check_following_error(judge, rotary);
    if let Some(limit) = rotary.hold_limit_arcsec {
        let window = ("position_window_arcsec", rotary.position_window_arcsec);
        judge.at_least("hold_limit_arcsec", limit, window);
    }
    rotary.node.check(judge, &config.can);
}

/// The drive holds it in counts: less than one is 0, and every move ends with an error then.
fn check_following_error(judge: &mut Judge<'_>, rotary: &RotaryConfig) {
    let limit = rotary.following_error_limit_arcsec;
    let count = Radians::TURN.arcsec() / f64::from(rotary.counts_per_turn.max(1));
    if limit > 0.0 && limit < count {
        judge.say(
            "following_error_limit_arcsec",
            format!(
                "{}″ are less than one count of {}″, and a drive holds it in whole counts",
                Short(limit),
                Short(count)
            ),
            "give what a move may lag behind, hundreds of counts or more",
        );
    }
}

/// What the drive's 32 bits can hold.
fn check_range(judge: &mut Judge<'_>, rotary: &RotaryConfig) {
    const REGISTER: f64 = i32::MAX as f64;
    let counts = f64::from(rotary.counts_per_turn);
    let fastest = [
        ("speed_max_deg_per_s", rotary.speed_max_deg_per_s),
        ("acceleration_deg_per_s2", rotary.acceleration_deg_per_s2),
        (
            "quick_stop_deceleration_deg_per_s2",
            rotary.quick_stop_deceleration_deg_per_s2,
        ),
    ];
    for (key, value) in fastest {
        let needed = value * counts / 360.0;
        if needed > REGISTER {
            judge.say(
                key,
                format!("{value} is {needed:.0} counts, a drive has 2147483647"),
                format!("give at most {:.0}", REGISTER * 360.0 / counts),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::config::validate::told::check;

    #[test]
    fn a_following_error_of_less_than_a_count_is_refused() {
        let rotary = include_str!("../../../configs/machines/rotary.toml");
        let (from, to) = ("limit_arcsec = 600.0", "limit_arcsec = 0.006");
        let key = "rotary.c.following_error_limit_arcsec";
        check(
            rotary,
            from,
            to,
            key,
            "0.006″ are less than one count of 0.01″",
        );
    }
}
