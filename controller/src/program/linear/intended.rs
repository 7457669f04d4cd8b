//! What a verb is going to do with linear axes.

use machine::Stage;
use machine::records::Store;
use units::{Approach, Metres, Several, Short, ShortSpan};

use crate::Failure;
use crate::config::{AxisConfig, Loaded};
use crate::linear::run_plan::{plan_of, speed_of};
use crate::linear::settings::require_within;
use crate::linear::stored::stored_course;
use crate::linear::zero::require_alone;
use crate::linear::{Corrected, ZeroConfig};
use crate::program::AxisArgs;
use crate::program::intended::{Intent, Step, calibration};
use crate::program::linear::gantry;
use crate::program::linear::verbs::require_active;
use crate::program::session::choose_axis;
use crate::program::targets::axis_targets;
use crate::run::{missing, require_certified};

/// Words that linear axes have no use for.
pub(crate) fn refuse(intent: Intent<'_>) -> Result<(), Failure> {
    match intent {
        Intent::Zero(_) => Ok(()),
        Intent::Calibrate(args) => args.readings.refuse(),
        Intent::Verify(args) => args.readings.refuse(),
        Intent::Move(args) => {
            args.without_way()?;
            args.without_align()
        }
    }
}

pub(crate) fn intended(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
) -> Result<Vec<Step>, Failure> {
    match intent {
        Intent::Zero(args) => zeroed(loaded, &args.axis),
        Intent::Calibrate(args) => measured(loaded, store, intent, (&args.axis, Stage::Calibrate)),
        Intent::Verify(args) => measured(loaded, store, intent, (&args.axis, Stage::Verify)),
        Intent::Move(args) => {
            let mut steps = Vec::new();
            for (axis, target) in axis_targets(args)? {
                require_within(&loaded.config, &axis, target)?;
                require_alone(&loaded.config, &axis)?;
                let of_axis = &loaded.config.axis[&axis];
                steps.push(zero_of(&axis, of_axis)?);
                steps.push(calibration(loaded, (&axis, &axis), intent)?);
                let corrected = match args.agreed.uncompensated {
                    true => Corrected::No,
                    false => stored_corrected(loaded, store, (&axis, target))?,
                };
                corrected.require(&axis, target, args.agreed.agreed())?;
                let way = (target, args.approach.map(Approach::from));
                steps.push(moved(&axis, of_axis, (way, corrected)));
            }
            Ok(steps)
        }
    }
}

/// What the calibration in use corrects at a target.
fn stored_corrected(
    loaded: &Loaded,
    store: &Store,
    (axis, target): (&str, Metres),
) -> Result<Corrected, Failure> {
    let course = stored_course((&loaded.config, &loaded.hash), axis, store)?;
    Ok(course.map_or(Corrected::No, |(_, course)| course.corrected(target)))
}

fn moved(
    axis: &str,
    of_axis: &AxisConfig,
    ((target, approach), corrected): ((Metres, Option<Approach>), Corrected),
) -> Step {
    let arrives = match approach {
        None => "",
        Some(Approach::Forward) => ", arriving forward",
        Some(Approach::Reverse) => ", arriving in reverse",
    };
    let text = format!(
        "to {} mm{arrives}, at {} mm/s{}",
        Short(target.mm()),
        Short(of_axis.motion.speed_mm_per_s),
        warning(corrected)
    );
    Step::new("move", axis, text)
}

fn warning(corrected: Corrected) -> String {
    match corrected {
        Corrected::Within => String::new(),
        Corrected::No => {
            "; NOT CORRECTED: by its encoder alone, and off by the deviation of the stage there"
                .into()
        }
        Corrected::Held { first, last } | Corrected::Fading { first, last, .. } => format!(
            "; BEYOND THE CALIBRATED RANGE of {} to {} mm, where the deviation of the stage was never measured",
            Short(first.mm()),
            Short(last.mm())
        ),
    }
}

fn zeroed(loaded: &Loaded, args: &AxisArgs) -> Result<Vec<Step>, Failure> {
    let config = &loaded.config;
    let Some(gantry) = gantry::asked_for(config, args.axis.as_deref()) else {
        let axis = choose_axis(config.axis.keys().cloned().collect(), args)?;
        require_alone(config, &axis)?;
        return Ok(vec![zero_of(&axis, &config.axis[&axis])?]);
    };
    let sides = &config.gantry[&gantry].axes;
    let together = format!(
        "{} and {} together to their negative limit switches and on to their nominal zeros",
        sides[0], sides[1]
    );
    let mut steps = vec![Step::new("zero", &gantry, together)];
    for side in sides {
        let own = zero_config(side, &config.axis[side])?;
        steps.push(Step::new("zero", side, search_of(own)));
    }
    Ok(steps)
}

fn zero_config<'a>(axis: &str, of_axis: &'a AxisConfig) -> Result<&'a ZeroConfig, Failure> {
    of_axis.zero.as_ref().ok_or_else(|| missing(axis, "zero"))
}

/// The way to the zero.
fn zero_of(axis: &str, of_axis: &AxisConfig) -> Result<Step, Failure> {
    let own = zero_config(axis, of_axis)?;
    let text = format!(
        "to its negative limit switch at {} mm/s, on to its nominal zero {} mm from there, then {}",
        Short(own.reference_speed_mm_per_s),
        Short(-own.negative_limit_mm),
        search_of(own)
    );
    Ok(Step::new("zero", axis, text))
}

fn search_of(own: &ZeroConfig) -> String {
    format!(
        "to and fro past two Hall sensors at {} mm/s, no farther than {} mm",
        Short(own.search_speed_mm_per_s),
        Short(own.search_limit_mm),
    )
}

fn measured(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
    (args, stage): (&AxisArgs, Stage),
) -> Result<Vec<Step>, Failure> {
    let axis = choose_axis(loaded.config.axis.keys().cloned().collect(), args)?;
    if stage == Stage::Verify && !intent.is_uncompensated() {
        require_active(store, &axis)?;
    }
    require_alone(&loaded.config, &axis)?;
    let of_axis = &loaded.config.axis[&axis];
    if let Some(plan) = plan_of(of_axis, stage) {
        require_certified(&loaded.config, &format!("instrument.{}.", plan.instrument))?;
    }
    let mut steps = vec![zero_of(&axis, of_axis)?];
    steps.push(calibration(loaded, (&axis, &axis), intent)?);
    let (then, is_verified) = match intent {
        Intent::Calibrate(args) if args.no_activate => {
            ("; what was found is stored, and not used", false)
        }
        Intent::Calibrate(args) => (
            "; what was found is stored and used from then on",
            args.verify,
        ),
        Intent::Zero(_) | Intent::Verify(_) | Intent::Move(_) => ("", false),
    };
    steps.push(run_of(&axis, of_axis, stage, then)?);
    if is_verified {
        steps.push(run_of(&axis, of_axis, Stage::Verify, "")?);
    }
    Ok(steps)
}

/// The measuring run.
fn run_of(axis: &str, of_axis: &AxisConfig, stage: Stage, then: &str) -> Result<Step, Failure> {
    let section = match stage {
        Stage::Calibrate => "calibrate",
        _ => "verify",
    };
    let plan = plan_of(of_axis, stage).ok_or_else(|| missing(axis, section))?;
    let speed = speed_of(of_axis);
    let planned = plan.planned(speed);
    let ends = [plan.targets.first(), plan.targets.last()];
    let [first, last] = ends.map(|it| it.copied().unwrap_or_default());
    let mut text = format!(
        "{} from {} to {} mm, {} from each side, read by {}: {} m at {} mm/s, {} at least",
        Several(plan.targets.len() as u64, "position"),
        Short(first.mm()),
        Short(last.mm()),
        Several(plan.runs, "time"),
        plan.instrument,
        Short(planned.travel.value()),
        Short(of_axis.motion.speed_mm_per_s),
        ShortSpan(planned.at_least),
    );
    let tolerance = of_axis.verify.as_ref().map(|it| it.accuracy_tolerance_um);
    text += &match (stage, tolerance) {
        (Stage::Verify, Some(it)) => format!("; tolerance {} µm", Short(it)),
        _ => then.to_owned(),
    };
    Ok(Step::new(section, axis, text))
}
