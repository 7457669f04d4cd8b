//! Reading a job: syntax, structure, then sense on its machine; nothing is opened for it.

use core::time::Duration;

use units::{Metres, Short, Volts};

use super::config::{GoOnConfig, JobConfig, JobPointConfig};
use super::{GoOn, Job, JobInput, JobPoint};
use crate::config::judge::{Finding, Judge};
use crate::config::{AxisConfig, ConfigError, MachineConfig, read};
use crate::hardware::analog::{channels_of, check_input};

/// So many points a job has at most, and an interval makes of one.
const POINTS_MAX: usize = 100_000;

impl Job {
    /// Reads and judges a job for the machine of `config`; `file` is the file's name in findings.
    ///
    /// # Errors
    /// When it is no TOML, has unknown or missing keys, or asks for something that this machine cannot do; every
    /// finding names line and column.
    pub fn parse(text: &str, file: &str, config: &MachineConfig) -> Result<Self, ConfigError> {
        let own: JobConfig = read(text, file, |job| judge(job, config))?;
        Ok(job_of(&own, config))
    }
}

fn judge(job: &JobConfig, config: &MachineConfig) -> Vec<Finding> {
    let mut findings = Vec::new();
    let Some(axis) = axis_of(job, config, &mut findings) else {
        return findings;
    };
    let mut judge = Judge::at(String::new(), &mut findings);
    if let Some(end) = job.end_mm {
        within_limits(&mut judge, axis, "end_mm", end);
    }
    if let Some(go_on) = &job.go_on {
        judge_go_on(&mut Judge::at("go_on".into(), &mut findings), config, go_on);
    }
    for (number, point) in job.point.iter().enumerate() {
        let judge = &mut Judge::at(format!("point.{number}"), &mut findings);
        judge_point(judge, axis, point);
        if let Some(go_on) = &point.go_on {
            let place = format!("point.{number}.go_on");
            judge_go_on(&mut Judge::at(place, &mut findings), config, go_on);
        }
    }
    let count: usize = job.point.iter().map(count_of).sum();
    if count > POINTS_MAX {
        let mut judge = Judge::at(String::new(), &mut findings);
        judge.say(
            "point",
            format!("{count} points"),
            format!("give at most {POINTS_MAX}"),
        );
    }
    findings
}

fn axis_of<'a>(
    job: &JobConfig,
    config: &'a MachineConfig,
    findings: &mut Vec<Finding>,
) -> Option<&'a AxisConfig> {
    let mut judge = Judge::at(String::new(), findings);
    judge.known_to_machine("axis", &job.axis, &config.axis, "axis");
    let axis = config.axis.get(&job.axis)?;
    let whole = [
        (config.platform.is_some(), "a platform"),
        (
            config.volumetric.is_some(),
            "three axes that are moved together",
        ),
    ];
    if let Some((_, whole)) = whole.into_iter().find(|(is_part, _)| *is_part) {
        judge.say(
            "axis",
            format!("`{}` is part of {whole}", job.axis),
            "a job is for an axis that is moved by itself",
        );
        return None;
    }
    if axis.compensation.is_none() {
        judge.say(
            "axis",
            format!(
                "`{}` has no [axis.{}.compensation]: nothing could correct it",
                job.axis, job.axis
            ),
            "add the section to the machine's configuration, and calibrate",
        );
    }
    Some(axis)
}

fn within_limits(judge: &mut Judge<'_>, axis: &AxisConfig, key: &str, seen: f64) {
    let (least, most) = (axis.motion.soft_min_mm, axis.motion.soft_max_mm);
    if !(least..=most).contains(&seen) {
        judge.say(
            key,
            format!("{} mm is outside the soft limits", Short(seen)),
            format!("stay within {} to {} mm", Short(least), Short(most)),
        );
    }
}

fn count_of(point: &JobPointConfig) -> usize {
    point.count.unwrap_or(1) as usize
}

fn judge_point(judge: &mut Judge<'_>, axis: &AxisConfig, point: &JobPointConfig) {
    within_limits(judge, axis, "position_mm", point.position_mm);
    match (point.interval_mm, point.count) {
        (None, None) => {}
        (Some(interval), Some(count)) if interval != 0.0 => {
            let last = point.position_mm + interval * f64::from(count - 1);
            within_limits(judge, axis, "interval_mm", last);
        }
        (Some(_), Some(_)) => judge.say(
            "interval_mm",
            "0 mm makes no other point",
            "leave `interval_mm` and `count` out, or give `repetitions`",
        ),
        (Some(_), None) => judge.say("interval_mm", "of how many points?", "give `count`, too"),
        (None, Some(_)) => judge.say("count", "at which interval?", "give `interval_mm`, too"),
    }
}

fn judge_go_on(judge: &mut Judge<'_>, config: &MachineConfig, go_on: &GoOnConfig) {
    let ways = [
        go_on.after_s.is_some(),
        go_on.operator.is_some(),
        go_on.analog.is_some(),
    ];
    if ways.into_iter().filter(|it| *it).count() != 1 {
        judge.say(
            "",
            "it is not said when to go on, or in several ways",
            "give one of `after_s`, `operator` and `analog`",
        );
        return;
    }
    if go_on
        .operator
        .as_ref()
        .is_some_and(|it| it.trim().is_empty())
    {
        judge.say("operator", "is empty", "say what the operator shall do");
    }
    let of_input = [
        ("channel", go_on.channel.is_some()),
        ("above_v", go_on.above_v.is_some()),
        ("below_v", go_on.below_v.is_some()),
        ("within_s", go_on.within_s.is_some()),
    ];
    match &go_on.analog {
        Some(module) => judge_input(judge, config, (module, go_on)),
        None => {
            for (key, _) in of_input.into_iter().filter(|(_, is_there)| *is_there) {
                judge.say(key, "belongs to an input", "give `analog`, or leave it out");
            }
        }
    }
}

fn judge_input(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    (module, go_on): (&str, &GoOnConfig),
) {
    match (go_on.channel, config.analog.get(module)) {
        (Some(channel), _) => check_input(judge, &config.analog, (module, channel)),
        (None, Some(analog)) => judge.say(
            "",
            "which channel?",
            format!("give `channel`: {}", channels_of(analog)),
        ),
        (None, None) => judge.known_to_machine("analog", module, &config.analog, "analog"),
    }
    let levels: Vec<f64> = [go_on.above_v, go_on.below_v]
        .into_iter()
        .flatten()
        .collect();
    match levels.as_slice() {
        [level] if level.is_finite() => {}
        [_] => judge.say("", "a level that is no number", "give volts"),
        _ => judge.say("", "at which voltage?", "give `above_v` or `below_v`"),
    }
    if go_on.within_s.is_none() {
        judge.say(
            "",
            "how long is the input waited for?",
            "give `within_s`: an input that never comes must not hold the machine for ever",
        );
    }
}

/// What was judged, in SI units.
fn job_of(own: &JobConfig, config: &MachineConfig) -> Job {
    let mut points = Vec::new();
    for it in &own.point {
        let go_on = it.go_on.as_ref().or(own.go_on.as_ref());
        let go_on = go_on.map_or(GoOn::After(Duration::ZERO), |it| go_on_of(it, config));
        for number in 0..count_of(it) {
            let default = format!("P{}", points.len() + 1);
            let name = match (&it.name, count_of(it)) {
                (None, _) => default,
                (Some(name), 1) => name.clone(),
                (Some(name), _) => format!("{name} {}", number + 1),
            };
            let on = it.interval_mm.unwrap_or(0.0) * number as f64;
            points.push(JobPoint {
                name,
                target: Metres::from_mm(it.position_mm + on),
                go_on: go_on.clone(),
            });
        }
    }
    Job {
        axis: own.axis.clone(),
        points,
        repetitions: own.repetitions,
        settle: Duration::from_millis(own.settle_ms.into()),
        end: own.end_mm.map(Metres::from_mm),
    }
}

fn go_on_of(own: &GoOnConfig, config: &MachineConfig) -> GoOn {
    if let Some(text) = &own.operator {
        return GoOn::Operator(text.clone());
    }
    let seconds = |it: Option<f64>| Duration::from_secs_f64(it.unwrap_or(0.0));
    let Some(module) = &own.analog else {
        return GoOn::After(seconds(own.after_s));
    };
    let channel = own.channel.unwrap_or(0);
    let channels = config.analog.get(module).map_or(&[][..], |it| &it.channels);
    GoOn::Input(JobInput {
        module: module.clone(),
        channel,
        place: channels.iter().position(|it| *it == channel).unwrap_or(0),
        level: Volts(own.above_v.or(own.below_v).unwrap_or(0.0)),
        above: own.above_v.is_some(),
        within: seconds(own.within_s),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");
    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");
    const JOB: &str = include_str!("../../../../configs/jobs/linear.toml");

    fn read(text: &str, machine: &str) -> Result<Job, ConfigError> {
        let config = crate::config::parse(machine, "m.toml").unwrap().config;
        Job::parse(text, "job.toml", &config)
    }

    #[test]
    fn the_shipped_job_is_sound() {
        let job = read(JOB, LINEAR).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((job.axis.as_str(), job.repetitions), ("x", 2));
        let names: Vec<&str> = job.points.iter().map(|it| it.name.as_str()).collect();
        assert_eq!(names[0], "load");
        assert!(names.contains(&"hole 3"), "{names:?}");
        assert!(job.needs_operator());
    }

    /// What is changed into what, where it is found, and what is said.
    #[track_caller]
    fn check(text: &str, machine: &str, line: usize, parts: [&str; 2]) {
        let said = read(text, machine).unwrap_err().to_string();
        let begins = format!("job.toml:{line}:");
        let found = said.contains(&begins) && parts.iter().all(|it| said.contains(it));
        assert!(found, "{begins} {parts:?} in: {said}");
    }

    const SMALL: &str = "schema_version = 1\naxis = \"x\"\nrepetitions = 3\n[go_on]\nafter_s = 0.5\n[[point]]\n\
                         position_mm = 5.0\n[[point]]\nposition_mm = 10.0\ngo_on = { analog = \"hall\", channel = 1, \
                         above_v = 1.0, within_s = 2.0 }\n";

    #[test]
    fn what_is_not_said_stands_for_what_is_usual() {
        let job = read(SMALL, LINEAR).unwrap();
        assert_eq!(job.points[0].go_on, GoOn::After(Duration::from_millis(500)));
        let GoOn::Input(input) = &job.points[1].go_on else {
            panic!("{:?}", job.points[1])
        };
        assert_eq!(input.text(), "input 1 of hall above 1.000 V");
        assert!(
            input.is_met(Volts(1.1)) && !input.is_met(Volts(1.0)) && !input.is_met(Volts(f64::NAN))
        );
        assert_eq!((input.place, job.stops(), job.end), (1, 6, None));
    }

    /// What is changed into what, on which line that is found, and what is said.
    type Bad = (&'static str, &'static str, usize, [&'static str; 2]);
    const BAD: &[Bad] = &[
        (
            "repetitions",
            "repetition",
            3,
            ["repetition", "did you mean `repetitions`?"],
        ),
        (
            "repetitions = 3",
            "repetitions = 0",
            3,
            ["0 is impossible", "give 1 to 10000"],
        ),
        (
            "axis = \"x\"",
            "axis = \"y\"",
            2,
            ["no linear axis `y`", "known: x"],
        ),
        (
            "position_mm = 5.0",
            "position_mm = 99",
            7,
            ["99 mm is outside", "-3 to 63 mm"],
        ),
        (
            "position_mm = 5.0",
            "position_mm = nan",
            7,
            ["NaN is impossible", "give a number"],
        ),
        (
            "position_mm = 5.0",
            "position_mm = 5.0\ncount = 3",
            8,
            ["at which interval", "interval_mm"],
        ),
        (
            "position_mm = 5.0",
            "position_mm = 5.0\ninterval_mm = 30.0\ncount = 3",
            8,
            ["65 mm is outside", "-3 to 63 mm"],
        ),
        (
            "position_mm = 5.0",
            "position_mm = 5.0\ninterval_mm = 0.0\ncount = 3",
            8,
            ["0 mm makes", "repetitions"],
        ),
        (
            "after_s = 0.5",
            "after_s = -1",
            5,
            ["-1 is impossible", "0 to 86400"],
        ),
        (
            "after_s = 0.5",
            "after_s = 0.5\noperator = \"look\"",
            4,
            ["in several ways", "one of"],
        ),
        (
            "after_s = 0.5",
            "within_s = 0.5",
            4,
            ["not said when", "one of"],
        ),
        (
            "channel = 1",
            "channel = 7",
            10,
            ["does not read channel 7", "known: 0, 1"],
        ),
        (
            "analog = \"hall\"",
            "analog = \"hull\"",
            10,
            ["no analog module `hull`", "Known: hall"],
        ),
        (", within_s = 2.0", "", 10, ["how long", "within_s"]),
        ("above_v = 1.0, ", "", 10, ["at which voltage", "above_v"]),
        ("[[point]]\nposition_mm = 5.0\n", "point = 3\n", 6, ["", ""]),
    ];

    #[test]
    fn a_bad_job_is_refused_with_line_key_what_was_expected_and_what_was_seen() {
        for (from, to, line, parts) in BAD {
            check(&SMALL.edit_first(from, to), LINEAR, *line, *parts);
        }
        let of_a_platform = SMALL.edit_first("axis = \"x\"", "axis = \"u\"");
        check(
            &of_a_platform,
            UVW,
            2,
            ["`u` is part of a platform", "moved by itself"],
        );
    }
}
