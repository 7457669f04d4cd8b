//! What a verb is going to do with rotary axes.

use machine::records::Store;
use units::{Several, Short};

use crate::Failure;
use crate::config::Loaded;
use crate::program::intended::{Intent, Step, calibration};
use crate::program::rotary::readings::{ReadBy, axis_of};
use crate::program::rotary::targets::{named_way, targets, to};
use crate::program::{AxisArgs, MoveArgs};
use crate::rotary::{DirectionName, RotaryConfig};
use crate::run::missing;

/// Words that rotary axes have no use for.
pub(crate) fn refuse(intent: Intent<'_>) -> Result<(), Failure> {
    match intent {
        Intent::Zero(_) | Intent::Verify(_) | Intent::Calibrate(_) => Ok(()),
        Intent::Move(args) => {
            args.without_beyond()?;
            args.without_approach()?;
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
        Intent::Zero(args) => {
            let axis = axis_of(loaded, &args.axis)?;
            Ok(vec![zero_of(&axis, &loaded.config.rotary[&axis])?])
        }
        Intent::Calibrate(args) => {
            let read_by = ReadBy::of(&args.axis, &args.readings)?;
            let mut steps = measured(loaded, intent, (&args.axis, read_by), calibrated)?;
            if let Some(step) = steps.last_mut() {
                step.say(args.then());
            }
            if args.verify {
                let axis = axis_of(loaded, &args.axis)?;
                steps.push(verified(&axis, &loaded.config.rotary[&axis])?);
            }
            Ok(steps)
        }
        Intent::Verify(args) => {
            let read_by = ReadBy::of(&args.axis, &args.readings)?;
            measured(loaded, intent, (&args.axis, read_by), verified)
        }
        Intent::Move(args) => moved(loaded, store, intent, args),
    }
}

/// A plate that a person reads by himself needs no machine: nothing is driven then.
fn measured(
    loaded: &Loaded,
    intent: Intent<'_>,
    (args, read_by): (&AxisArgs, ReadBy),
    run: fn(&str, &RotaryConfig) -> Result<Step, Failure>,
) -> Result<Vec<Step>, Failure> {
    let axis = axis_of(loaded, args)?;
    let of_axis = &loaded.config.rotary[&axis];
    let zero = match read_by {
        ReadBy::Alone => None,
        ReadBy::Detector | ReadBy::Driven => Some(zero_of(&axis, of_axis)?),
    };
    let calibration = calibration(loaded, (&axis, &axis), intent)?;
    let run = run(&axis, of_axis)?;
    Ok(zero.into_iter().chain([calibration, run]).collect())
}

/// The way to the zero.
fn zero_of(axis: &str, of_axis: &RotaryConfig) -> Result<Step, Failure> {
    let own = of_axis.zero.as_ref();
    let own = own.ok_or_else(|| missing(axis, "zero"))?;
    let direction = match own.index_direction {
        DirectionName::Forward => "forward",
        DirectionName::Reverse => "in reverse",
    };
    let text = format!(
        "{direction} to the encoder's index mark at {}°/s, up to one turn",
        Short(own.index_speed_deg_per_s)
    );
    Ok(Step::new("zero", axis, text))
}

fn calibrated(axis: &str, of_axis: &RotaryConfig) -> Result<Step, Failure> {
    let own = of_axis.calibrate.as_ref();
    let own = own.ok_or_else(|| missing(axis, "calibrate"))?;
    // The file was judged: it can be planned.
    let offsets = own
        .design()
        .map_or_else(|_| Vec::new(), |it| it.offsets().to_vec());
    let by = match of_axis.has_detector() {
        true => format!(
            "{} in each direction at {}°/s",
            Several(own.passes, "sweep"),
            Short(own.speed_deg_per_s.unwrap_or(of_axis.speed_deg_per_s))
        ),
        false => "read by a person, line by line".to_owned(),
    };
    let text = format!(
        "plate {} of {} lines at the offsets {:?}, to which somebody turns it: {by}",
        own.plate, own.lines, offsets,
    );
    Ok(Step::new("calibrate", axis, text))
}

fn verified(axis: &str, of_axis: &RotaryConfig) -> Result<Step, Failure> {
    let (own, plate) = (of_axis.verify.as_ref(), of_axis.calibrate.as_ref());
    let own = own.ok_or_else(|| missing(axis, "verify"))?;
    let plate = plate.ok_or_else(|| missing(axis, "calibrate"))?;
    let text = format!(
        "plate {} at the offset {}, to which somebody turns it; tolerance {}″",
        plate.plate,
        Short(own.offset_lines),
        Short(own.tolerance_arcsec),
    );
    Ok(Step::new("verify", axis, text))
}

fn moved(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
    args: &MoveArgs,
) -> Result<Vec<Step>, Failure> {
    let way = named_way(args);
    let mut steps = Vec::new();
    for (axis, angle) in targets(args)? {
        let of_axis = loaded.config.rotary.get(&axis).ok_or_else(|| {
            let known: Vec<&str> = loaded.config.rotary.keys().map(String::as_str).collect();
            Failure::Machine(machine::Failure::NoSuchAxis {
                axis: axis.clone(),
                known: known.join(", "),
            })
        })?;
        steps.push(zero_of(&axis, of_axis)?);
        if !args.agreed.uncompensated && store.active(&axis)?.current.is_none() {
            return Err(Failure::not_calibrated(&axis));
        }
        steps.push(calibration(loaded, (&axis, &axis), intent)?);
        let text = format!(
            "{}, at {}°/s",
            to(angle, way),
            Short(of_axis.speed_deg_per_s)
        );
        steps.push(Step::new("move", &axis, text));
    }
    Ok(steps)
}
