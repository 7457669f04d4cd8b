//! What a verb is going to do with an alignment platform.

use machine::records::Store;
use units::{Several, Short};

use crate::Failure;
use crate::config::Loaded;
use crate::platform::{PlatformConfig, PlatformFailure};
use crate::program::intended::{Intent, Step, calibration, nowhere};
use crate::program::platform::target::asked;
use crate::program::{AxisArgs, CalibrateArgs, MoveArgs};

/// What all screws are called together.
const WHOLE: &str = "platform";

/// Words that a platform has no use for.
pub(crate) fn refuse(intent: Intent<'_>) -> Result<(), Failure> {
    match intent {
        Intent::Zero(args) => whole_only(&args.axis),
        Intent::Calibrate(args) => {
            args.readings.refuse()?;
            whole_only(&args.axis)?;
            never_resumed(args.resume.is_some())?;
            never_drifted(args.accept_drift)
        }
        Intent::Verify(args) => {
            args.readings.refuse()?;
            whole_only(&args.axis)?;
            never_resumed(args.resume.is_some())
        }
        Intent::Move(args) => {
            args.without_way()?;
            args.without_approach()?;
            args.without_beyond()
        }
    }
}

/// A platform's screws are zeroed, calibrated and verified together.
fn whole_only(args: &AxisArgs) -> Result<(), Failure> {
    let Some(axis) = &args.axis else {
        return Ok(());
    };
    Err(Failure::Usage {
        what: format!("{axis} is part of a platform, whose screws only work together"),
        help: "leave --axis out: the command is for all of them".into(),
    })
}

fn never_resumed(resume: bool) -> Result<(), Failure> {
    if !resume {
        return Ok(());
    }
    Err(Failure::Usage {
        what: "a platform's run cannot be resumed".into(),
        help: "it takes minutes: start it again".into(),
    })
}

fn never_drifted(accept_drift: bool) -> Result<(), Failure> {
    if !accept_drift {
        return Ok(());
    }
    Err(Failure::Usage {
        what: "a platform that has drifted cannot be calibrated".into(),
        help: "leave --accept-drift out; wait until the temperature has settled".into(),
    })
}

pub(crate) fn intended(
    loaded: &Loaded,
    store: &Store,
    intent: Intent<'_>,
) -> Result<Vec<Step>, Failure> {
    let Some(platform) = &loaded.config.platform else {
        return Ok(Vec::new());
    };
    let mut steps = vec![zeroed(platform)];
    if !matches!(intent, Intent::Zero(_)) {
        for screw in &platform.actuator {
            steps.push(calibration(loaded, (&screw.axis, &screw.axis), intent)?);
        }
    }
    match intent {
        Intent::Zero(_) => {}
        Intent::Calibrate(args) => {
            steps.push(calibrated(platform, args)?);
            if args.verify {
                steps.push(verified(platform)?);
            }
        }
        Intent::Verify(args) => {
            let step = verified(platform)?;
            if !args.uncompensated {
                let mut machine = nowhere::machine(loaded);
                machine.platform()?.require_calibrations(store)?;
            }
            steps.push(step);
        }
        Intent::Move(args) => steps.push(moved(loaded, store, platform, args)?),
    }
    Ok(steps)
}

fn zeroed(platform: &PlatformConfig) -> Step {
    let screws = platform.actuator.iter().map(|it| it.axis.as_str());
    let screws: Vec<&str> = screws.collect();
    let text = format!(
        "{} one after the other to its negative limit switch at {} mm/s and the first index pulse off it, then \
         all to pose zero, where the camera looks",
        screws.join(", "),
        Short(platform.zero.search_speed_mm_per_s)
    );
    Step::new("zero", WHOLE, text)
}

fn missing(section: &'static str) -> Failure {
    PlatformFailure::NotConfigured { section }.into()
}

fn calibrated(platform: &PlatformConfig, args: &CalibrateArgs) -> Result<Step, Failure> {
    let own = platform.calibrate.as_ref();
    let own = own.ok_or_else(|| missing("calibrate"))?;
    let strokes = platform.actuator.iter().map(|screw| {
        let strokes = own.strokes_of(screw);
        let count = strokes.targets().len() as u64;
        let (first, last) = (Short(strokes.first_mm), Short(strokes.last_mm));
        let count = Several(count, "stroke");
        format!("{} at {count} from {first} to {last} mm", screw.axis)
    });
    let strokes: Vec<String> = strokes.collect();
    let text = format!(
        "{}, {} from each side, seen by {}; {}",
        strokes.join(", "),
        Several(own.runs, "time"),
        platform.camera,
        args.then(),
    );
    Ok(Step::new("calibrate", WHOLE, text))
}

fn verified(platform: &PlatformConfig) -> Result<Step, Failure> {
    let own = platform.verify.as_ref();
    let own = own.ok_or_else(|| missing("verify"))?;
    let text = format!(
        "{} within ±{} mm in x, ±{} mm in y and ±{}°, seen by {}; tolerance {} µm",
        Several(own.poses, "pose"),
        Short(platform.x_max_mm),
        Short(platform.y_max_mm),
        Short(platform.theta_max_deg),
        platform.camera,
        Short(own.tolerance_um),
    );
    Ok(Step::new("verify", WHOLE, text))
}

fn moved(
    loaded: &Loaded,
    store: &Store,
    platform: &PlatformConfig,
    args: &MoveArgs,
) -> Result<Step, Failure> {
    let asked = asked(args)?;
    let mut machine = nowhere::machine(loaded);
    machine.platform()?.check_asked(store, &asked)?;
    let mut text = format!(
        "to {}, the screw with the longest way at {} mm/s",
        args.targets.join(" "),
        Short(platform.speed_mm_per_s)
    );
    let unnamed = asked.named.unnamed();
    if !unnamed.is_empty() {
        text += &format!(
            "; {} stay where the camera sees them before the zero",
            unnamed.join(" and ")
        );
    }
    if args.align {
        text += "; then on until the image agrees";
    }
    Ok(Step::new("move", WHOLE, text))
}
