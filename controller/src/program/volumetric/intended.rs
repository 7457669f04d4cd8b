//! What a verb is going to do with three axes.

use compensator::volumetric::identify::Purpose;
use machine::records::Store;
use units::{Metres, Several, Short};

use crate::Failure;
use crate::config::Loaded;
use crate::program::intended::{Intent, Step, calibration, nowhere};
use crate::program::volumetric::verbs::{targets, warm_up_of};
use crate::program::{CalibrateArgs, MoveArgs, VerifyArgs};
use crate::volumetric::calibrate::plan::volume_plan;
use crate::volumetric::calibrate::require_all_certified;
use crate::volumetric::motion::require_measured;
use crate::volumetric::{GEOMETRY, VolumeAxisName, VolumetricConfig, VolumetricFailure};

/// What all three axes are called together.
const WHOLE: &str = "x, y, z";

/// Words that three axes have no use for.
pub(crate) fn refuse(intent: Intent<'_>) -> Result<(), Failure> {
    match intent {
        Intent::Zero(_) => Ok(()),
        Intent::Calibrate(args) => made_anew(args),
        Intent::Verify(args) => read_anew(args),
        Intent::Move(args) => {
            args.without_way()?;
            args.without_approach()?;
            args.without_beyond()?;
            args.without_align()
        }
    }
}

fn made_anew(args: &CalibrateArgs) -> Result<(), Failure> {
    args.readings.refuse()?;
    if args.accept_drift {
        return Err(Failure::Usage {
            what: "a calibration of three axes is not judged by its closure".into(),
            help: "start it again without --accept-drift".into(),
        });
    }
    warm_up_of(args).map(drop)
}

fn read_anew(args: &VerifyArgs) -> Result<(), Failure> {
    args.readings.refuse()?;
    if args.resume.is_some() {
        return Err(Failure::Usage {
            what: "a verification of three axes cannot be resumed".into(),
            help: "it is one line: start it again".into(),
        });
    }
    Ok(())
}

pub(crate) fn intended(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
) -> Result<Vec<Step>, Failure> {
    let Some(volume) = &loaded.config.volumetric else {
        return Ok(Vec::new());
    };
    if let (Intent::Calibrate(_) | Intent::Verify(_), Some(own)) = (intent, &volume.calibrate) {
        require_all_certified(&loaded.config, &own.instrument)?;
    }
    let mut steps = vec![zeroed(volume)];
    if !matches!(intent, Intent::Zero(_)) {
        steps.push(calibration(loaded, (WHOLE, GEOMETRY), intent)?);
    }
    match intent {
        Intent::Zero(_) => {}
        Intent::Calibrate(args) => {
            steps.push(calibrated(volume, args)?);
            if args.verify {
                steps.push(verified(volume)?);
            }
        }
        Intent::Verify(args) => {
            let step = verified(volume)?;
            if !args.uncompensated && store.active(GEOMETRY)?.current.is_none() {
                return Err(VolumetricFailure::NoGeometry.into());
            }
            steps.push(step);
        }
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

fn calibrated(volume: &VolumetricConfig, args: &CalibrateArgs) -> Result<Step, Failure> {
    let (_, lines) = volume_plan(volume, args.warm_up_min.is_some(), Vec::new())?;
    // Rolls are read by the machine's own detectors, where it has them.
    let own = lines
        .iter()
        .filter(|it| matches!(it.purpose, Purpose::Roll(_)));
    let instrument = volume.calibrate.as_ref().map(|it| it.instrument.as_str());
    let mut text = format!(
        "the references of the detectors, then {} that somebody sets {} up for, one after the other",
        Several((lines.len() - own.count()) as u64, "line"),
        instrument.unwrap_or_default(),
    );
    if let Some(minutes) = args.warm_up_min {
        text += &format!(
            "; {} min to and fro to warm up before the last of them",
            Short(minutes)
        );
    }
    text += &format!("; {}", args.then());
    Ok(Step::new("calibrate", WHOLE, text))
}

fn verified(volume: &VolumetricConfig) -> Result<Step, Failure> {
    let section = "verify";
    let own = volume.verify.as_ref();
    let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
    let place = |mm: [f64; 3]| mm.map(|it| Short(it).to_string()).join(", ");
    let text = format!(
        "{} on the line from ({}) to ({}) mm; tolerance {} µm",
        Several(own.points, "place"),
        place(own.from_mm),
        place(own.to_mm),
        Short(own.limit_um),
    );
    Ok(Step::new("verify", WHOLE, text))
}

fn moved(
    loaded: &Loaded,
    store: &Store,
    volume: &VolumetricConfig,
    args: &MoveArgs,
) -> Result<Step, Failure> {
    let compensated = !args.agreed.uncompensated;
    if compensated {
        require_measured(store)?;
    }
    let target = targets(args)?.from(volume.zero.index_mm.map(Metres::from_mm));
    let mut machine = nowhere::machine(loaded);
    machine.volumetric()?.check_target(target, compensated)?;
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
