//! What a verb is going to do with three axes.

use machine::records::Store;
use units::{Metres, Several, Short};

use crate::Failure;
use crate::config::Loaded;
use crate::program::intended::{Intent, Step, calibration, nowhere};
use crate::program::volumetric::verbs::{never_measured, refuse_unreachable, targets};
use crate::program::{CalibrateArgs, MoveArgs};
use crate::volumetric::calibrate::plan::volume_plan;
use crate::volumetric::{GEOMETRY, VolumeAxisName, VolumetricConfig};

/// What all three axes are called together.
const WHOLE: &str = "x, y, z";

pub(crate) fn intended(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
) -> Result<Vec<Step>, Failure> {
    let Some(volume) = &loaded.config.volumetric else {
        return Ok(Vec::new());
    };
    let mut steps = vec![zeroed(volume)];
    if !matches!(intent, Intent::Zero(_)) {
        steps.push(calibration(store, (WHOLE, GEOMETRY), intent)?);
    }
    match intent {
        Intent::Zero(_) => {}
        Intent::Calibrate(args) => steps.extend(calibrated(volume, args)?),
        Intent::Verify(_) => steps.extend(verified(volume)),
        Intent::Move(args) => steps.push(moved(loaded, store, volume, args)?),
    }
    Ok(steps)
}

fn zeroed(volume: &VolumetricConfig) -> Step {
    let order = volume.zero.order.map(|it| match it {
        VolumeAxisName::X => "x",
        VolumeAxisName::Y => "y",
        VolumeAxisName::Z => "z",
    });
    let text = format!(
        "{}, each to its negative limit switch at {} mm/s and the first index pulse off it",
        order.join(", then "),
        Short(volume.zero.search_speed_mm_per_s)
    );
    Step::new("zero", WHOLE, text)
}

/// `None` for three axes that are not configured for it, which the verb refuses.
fn calibrated(volume: &VolumetricConfig, args: &CalibrateArgs) -> Result<Option<Step>, Failure> {
    let Some(own) = &volume.calibrate else {
        return Ok(None);
    };
    let (plan, _) = volume_plan(volume, args.warm_up_min.is_some(), Vec::new())?;
    let mut text = format!(
        "the references of the detectors, then {} that somebody sets {} up for, one after the other",
        Several(plan.lines.len() as u64, "line"),
        own.instrument,
    );
    if let Some(minutes) = args.warm_up_min {
        text += &format!(
            "; {} min to and fro to warm up before the last of them",
            Short(minutes)
        );
    }
    text += "; what was found is stored and used from then on";
    Ok(Some(Step::new("calibrate", WHOLE, text)))
}

/// Likewise.
fn verified(volume: &VolumetricConfig) -> Option<Step> {
    let own = volume.verify.as_ref()?;
    let place = |mm: [f64; 3]| mm.map(|it| Short(it).to_string()).join(", ");
    let text = format!(
        "{} on the line from ({}) to ({}) mm; tolerance {} µm",
        Several(own.points, "place"),
        place(own.from_mm),
        place(own.to_mm),
        Short(own.limit_um),
    );
    Some(Step::new("verify", WHOLE, text))
}

fn moved(
    loaded: &Loaded,
    store: &Store,
    volume: &VolumetricConfig,
    args: &MoveArgs,
) -> Result<Step, Failure> {
    let compensated = !args.agreed.uncompensated;
    if compensated && store.active(GEOMETRY)?.current.is_none() {
        return Err(never_measured());
    }
    let target = targets(args)?.from(volume.zero.index_mm.map(Metres::from_mm));
    let mut machine = nowhere::machine(loaded);
    refuse_unreachable(&mut machine, target, compensated)?;
    let at = [("x", target.x), ("y", target.y), ("z", target.z)];
    let at = at.map(|(axis, it)| format!("{axis} = {} mm", Short(it.mm())));
    let axes = volume
        .axes
        .iter()
        .filter_map(|it| loaded.config.axis.get(it));
    let speed = axes
        .map(|it| it.motion.speed_mm_per_s)
        .fold(f64::INFINITY, f64::min);
    let text = format!("to {}, at {} mm/s", at.join(", "), Short(speed));
    Ok(Step::new("move", WHOLE, text))
}
