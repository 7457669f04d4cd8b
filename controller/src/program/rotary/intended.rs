//! What a verb is going to do with rotary axes.

use machine::records::Store;
use units::{Several, Short};

use crate::Failure;
use crate::config::Loaded;
use crate::program::intended::{Intent, Step, calibration};
use crate::program::rotary::targets::{named_way, targets, to};
use crate::program::session::choose_axis;
use crate::program::{AxisArgs, MoveArgs};
use crate::rotary::{DirectionName, RotaryConfig};

pub(crate) fn intended(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
) -> Result<Vec<Step>, Failure> {
    let of_one = |args: &AxisArgs, run: fn(&str, &RotaryConfig) -> Option<Step>| {
        let axis = choose_axis(loaded.config.rotary.keys().cloned().collect(), args)?;
        let of_axis = &loaded.config.rotary[&axis];
        let mut steps: Vec<Step> = zero_of(&axis, of_axis).into_iter().collect();
        if !matches!(intent, Intent::Zero(_)) {
            steps.push(calibration(store, (&axis, &axis), intent)?);
        }
        steps.extend(run(&axis, of_axis));
        Ok(steps)
    };
    match intent {
        Intent::Zero(args) => of_one(&args.axis, |_, _| None),
        Intent::Calibrate(args) => of_one(&args.axis, calibrated),
        Intent::Verify(args) => of_one(&args.axis, verified),
        Intent::Move(args) => moved(loaded, store, intent, args),
    }
}

/// The way to the zero; `None` for an axis that is not configured for one, which its verb refuses.
fn zero_of(axis: &str, of_axis: &RotaryConfig) -> Option<Step> {
    let own = of_axis.zero.as_ref()?;
    let direction = match own.index_direction {
        DirectionName::Forward => "forward",
        DirectionName::Reverse => "in reverse",
    };
    let text = format!(
        "{direction} to the encoder's index mark at {}°/s, up to one turn",
        Short(own.index_speed_deg_per_s)
    );
    Some(Step::new("zero", axis, text))
}

fn calibrated(axis: &str, of_axis: &RotaryConfig) -> Option<Step> {
    let own = of_axis.calibrate.as_ref()?;
    let design = own.design().ok()?;
    let by = match of_axis.has_detector() {
        true => format!(
            "{} in each direction at {}°/s",
            Several(own.passes, "sweep"),
            Short(own.speed_deg_per_s.unwrap_or(of_axis.speed_deg_per_s))
        ),
        false => "read by a person, line by line".to_owned(),
    };
    let text = format!(
        "plate {} of {} lines at the offsets {:?}, to which somebody turns it: {by}; what was found is stored and \
         used from then on",
        own.plate,
        own.lines,
        design.offsets(),
    );
    Some(Step::new("calibrate", axis, text))
}

fn verified(axis: &str, of_axis: &RotaryConfig) -> Option<Step> {
    let (own, plate) = (of_axis.verify.as_ref()?, of_axis.calibrate.as_ref()?);
    let text = format!(
        "plate {} at the offset {}, to which somebody turns it; tolerance {}″",
        plate.plate,
        Short(own.offset_lines),
        Short(own.tolerance_arcsec),
    );
    Some(Step::new("verify", axis, text))
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
        steps.extend(zero_of(&axis, of_axis));
        if !args.agreed.uncompensated && store.active(&axis)?.current.is_none() {
            return Err(Failure::not_calibrated(&axis));
        }
        steps.push(calibration(store, (&axis, &axis), intent)?);
        let text = format!(
            "{}, at {}°/s",
            to(angle, way),
            Short(of_axis.speed_deg_per_s)
        );
        steps.push(Step::new("move", &axis, text));
    }
    Ok(steps)
}
