//! What a verb is going to do with an alignment platform.

use machine::records::Store;
use units::{Several, Short};

use crate::Failure;
use crate::config::Loaded;
use crate::platform::PlatformConfig;
use crate::program::MoveArgs;
use crate::program::intended::{Intent, Step, calibration, nowhere};
use crate::program::platform::target::NamedPose;
use crate::program::platform::verbs::refuse_impossible;

/// What all screws are called together.
const WHOLE: &str = "platform";

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
            steps.push(calibration(store, (&screw.axis, &screw.axis), intent)?);
        }
    }
    match intent {
        Intent::Zero(_) => {}
        Intent::Calibrate(_) => steps.extend(calibrated(platform)),
        Intent::Verify(_) => steps.extend(verified(platform)),
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

/// `None` for a platform that is not configured for it, which the verb refuses.
fn calibrated(platform: &PlatformConfig) -> Option<Step> {
    let own = platform.calibrate.as_ref()?;
    let strokes = platform.actuator.iter().map(|screw| {
        let strokes = own.strokes_of(screw);
        let count = strokes.targets().len() as u64;
        let (first, last) = (Short(strokes.first_mm), Short(strokes.last_mm));
        let count = Several(count, "stroke");
        format!("{} at {count} from {first} to {last} mm", screw.axis)
    });
    let strokes: Vec<String> = strokes.collect();
    let text = format!(
        "{}, {} from each side, seen by {}; what was found is stored and used from then on",
        strokes.join(", "),
        Several(own.runs, "time"),
        platform.camera,
    );
    Some(Step::new("calibrate", WHOLE, text))
}

/// Likewise.
fn verified(platform: &PlatformConfig) -> Option<Step> {
    let own = platform.verify.as_ref()?;
    let text = format!(
        "{} within ±{} mm in x, ±{} mm in y and ±{}°, seen by {}; tolerance {} µm",
        Several(own.poses, "pose"),
        Short(platform.x_max_mm),
        Short(platform.y_max_mm),
        Short(platform.theta_max_deg),
        platform.camera,
        Short(own.tolerance_um),
    );
    Some(Step::new("verify", WHOLE, text))
}

fn moved(
    loaded: &Loaded,
    store: &Store,
    platform: &PlatformConfig,
    args: &MoveArgs,
) -> Result<Step, Failure> {
    let named = NamedPose::parse(&args.targets)?;
    let compensated = !args.agreed.uncompensated;
    let mut machine = nowhere::machine(loaded);
    refuse_impossible((&mut machine, store), named, (args.align, compensated))?;
    let mut text = format!(
        "to {}, the screw with the longest way at {} mm/s",
        args.targets.join(" "),
        Short(platform.speed_mm_per_s)
    );
    let unnamed = named.unnamed();
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
