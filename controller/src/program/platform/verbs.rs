//! The verbs of the cycle on an alignment platform (system S1).

use serde_json::{Value, json};

use crate::platform::calibrate::PlatformCalibrated;
use crate::platform::verify::{Aligned, PlatformVerified};
use crate::platform::{PlatformFailure, Pose, PoseMoved};
use crate::ports::Use;
use crate::program::json as to_json;
use crate::program::output::{Ended, Output};
use crate::program::platform::fit::outlier_lines;
use crate::program::session::Session;
use crate::program::{AxisArgs, CalibrateArgs, MachineArgs, MoveArgs, VerifyArgs};
use crate::{Failure, Machine};
use machine::records::Store;
use units::text::{angle, length};

/// Starts the platform, zeroes it, runs `procedure`, switches off; what `possible` refuses, before
/// anything is sent.
fn with_zeroed_platform<R>(
    args: &MachineArgs,
    verb: &str,
    output: Output,
    possible: impl FnOnce(&mut Machine) -> Result<(), Failure>,
    procedure: impl FnOnce(&mut Machine, &Store) -> Result<R, Failure>,
) -> Result<(R, Value), Failure> {
    let mut session = Session::open(args, verb, Use::Measurement, output)?;
    possible(&mut session.machine)?;
    let store = session.store.clone();
    session.machine.guarded(|machine| {
        machine.start()?;
        machine.platform()?.zero(&store)?;
        let result = procedure(machine, &store)?;
        machine.shut_down()?;
        Ok((result, to_json::counters(&machine.devices().counters())))
    })
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

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    whole_only(args)?;
    let mut session = Session::open(&args.machine, "zero", Use::Measurement, output)?;
    let store = session.store.clone();
    let zeroed = session.machine.guarded(|machine| {
        machine.start()?;
        let zeroed = machine.platform()?.zero(&store)?;
        machine.shut_down()?;
        Ok(zeroed)
    })?;
    let text = format!(
        "platform: zero found; the camera sees it at {}\nrecorded in {}",
        pose_text(zeroed.datum),
        zeroed.journal.display()
    );
    let value = json!({"datum": pose_value(zeroed.datum), "journal": zeroed.journal});
    output.result(&text, &value)
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    args.readings.refuse()?;
    whole_only(&args.axis)?;
    never_resumed(args.resume.is_some())?;
    if args.accept_drift {
        return Err(Failure::Usage {
            what: "a platform that has drifted cannot be calibrated".into(),
            help: "leave --accept-drift out; wait until the temperature has settled, or raise \
                   closure_limit_um"
                .into(),
        });
    }
    let run = |machine: &mut Machine, store: &Store| machine.platform()?.calibrate(store);
    let (calibrated, counters) =
        with_zeroed_platform(&args.axis.machine, "calibrate", output, |_| Ok(()), run)?;
    let mut value = calibrated_value(&calibrated);
    value["counters"] = counters;
    output.result(&calibrated_text(&calibrated), &value)
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    args.readings.refuse()?;
    whole_only(&args.axis)?;
    never_resumed(args.resume.is_some())?;
    let compensated = !args.uncompensated;
    let run = |machine: &mut Machine, store: &Store| {
        if compensated {
            machine.platform()?.load_active(store)?;
        }
        machine.platform()?.verify(store, compensated)
    };
    let (verified, counters) =
        with_zeroed_platform(&args.axis.machine, "verify", output, |_| Ok(()), run)?;
    let title = if compensated { "as left" } else { "as found" };
    let mut value = json!({title.replace(' ', "_"): verified_value(&verified)});
    value["counters"] = counters;
    let text = verified_text(title, &verified);
    if compensated && !verified.is_within_tolerance() {
        return output.bad_result(&text, value, out_of_tolerance(&verified));
    }
    output.result(&text, &value)
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    args.without_way()?;
    let target = target_pose(&args.targets)?;
    let possible = |machine: &mut Machine| {
        machine.platform()?.check_pose(target)?;
        if args.align {
            machine.platform()?.check_alignable()?;
        }
        Ok(())
    };
    let run = |machine: &mut Machine, store: &Store| {
        let calibrations = machine.platform()?.load_active(store)?;
        let aligned = args
            .align
            .then(|| machine.platform()?.align(target))
            .transpose()?;
        let moved = match aligned {
            None => Some(machine.platform()?.move_to(target)?),
            Some(_) => None,
        };
        Ok((
            calibrations,
            moved,
            aligned,
            machine.platform()?.measure_pose()?,
        ))
    };
    let ((calibrations, moved, aligned, seen), counters) =
        with_zeroed_platform(&args.machine, "move", output, possible, run)?;
    let calibrated = calibrations.iter().all(|(_, id)| id.is_some());
    let mut text = format!(
        "platform: target {}, the camera sees it at {}",
        pose_text(target),
        pose_text(seen)
    );
    text += if calibrated {
        ""
    } else {
        "\nNOT CORRECTED: not every screw is calibrated; run `truestage calibrate`"
    };
    text += &moved.as_ref().map_or(String::new(), moved_text);
    text += &aligned.as_ref().map_or(String::new(), aligned_text);
    let value = json!({
        "target": pose_value(target),
        "seen": pose_value(seen),
        "calibrations": calibrations,
        "corrected": calibrated,
        "move": moved.as_ref().map(moved_value),
        "alignment": aligned.as_ref().map(aligned_value),
        "counters": counters,
    });
    output.result(&text, &value)
}

fn moved_text(moved: &PoseMoved) -> String {
    let set_points = moved
        .set_points
        .iter()
        .map(|(axis, at)| format!("{axis} {:.6} mm", at.mm()))
        .collect::<Vec<_>>();
    let skew = moved.skew.map_or(String::new(), |it| {
        format!("; started within {:.3} ms", it.as_secs_f64() * 1e3)
    });
    let mut text = format!("\nscrews: {}{skew}", set_points.join(", "));
    for it in &moved.taken_up {
        let doubt = it.standard_uncertainty.map_or(String::new(), |u| {
            format!(" (standard uncertainty of its place {:.3} µm)", u.um())
        });
        text += &format!("\nplay of {} taken up first{doubt}", it.axis);
    }
    if let Some(u) = moved.standard_uncertainty {
        text += &format!(
            "\nstandard uncertainty of the screws' places {:.3} µm",
            u.um()
        );
    }
    text
}

fn moved_value(moved: &PoseMoved) -> Value {
    let set_points: Vec<_> = moved
        .set_points
        .iter()
        .map(|(axis, at)| json!({"axis": axis, "set_point_mm": at.mm()}))
        .collect();
    let taken_up: Vec<_> = moved
        .taken_up
        .iter()
        .map(|it| {
            let u = it.standard_uncertainty.map(to_json::um);
            json!({"axis": it.axis, "standard_uncertainty_um": u})
        })
        .collect();
    json!({
        "screws": set_points,
        "skew_ms": moved.skew.map(|it| it.as_secs_f64() * 1e3),
        "standard_uncertainty_um": moved.standard_uncertainty.map(to_json::um),
        "taken_up": taken_up,
    })
}

fn aligned_text(aligned: &Aligned) -> String {
    format!(
        "\naligned in {} moves: {:.3} µm off after the first (open loop), {:.3} µm now",
        aligned.moves,
        aligned.open_loop.um(),
        aligned.left.um()
    )
}

fn aligned_value(aligned: &Aligned) -> Value {
    json!({
        "moves": aligned.moves,
        "open_loop_um": to_json::um(aligned.open_loop),
        "left_um": to_json::um(aligned.left),
    })
}

pub(crate) fn calibrated_text(calibrated: &PlatformCalibrated) -> String {
    let mut text = format!(
        "every screw calibrated and activated; closure {:.3} µm\npoints in {}",
        calibrated.closure.um(),
        calibrated.journal.display()
    );
    for screw in &calibrated.screws {
        let model = &screw.model;
        text += &format!(
            "\n  {}  slope {:+.3} µm/mm, lost motion {:.3} µm, {} periodic term(s)  {}",
            screw.axis,
            model.slope * 1e3,
            model.lost_motion.um(),
            model.harmonics.len(),
            &screw.id[..12]
        );
        text += &outlier_lines(&screw.outliers, &[]);
    }
    text
}

pub(crate) fn calibrated_value(calibrated: &PlatformCalibrated) -> Value {
    let screws: Vec<_> = calibrated
        .screws
        .iter()
        .map(|screw| {
            json!({
                "axis": screw.axis,
                "calibration": screw.id,
                "strokes": screw.strokes,
                "slope_um_per_mm": screw.model.slope * 1e3,
                "lost_motion_um": to_json::um(screw.model.lost_motion),
                "lost_motion_um_u": screw.model.u_lost_motion().map(to_json::um),
                "scatter_um": screw.model.scatter.map(to_json::um),
                "outliers": crate::program::platform::json::outliers(&screw.outliers, &[]),
                "harmonics": screw.model.harmonics.iter().map(|it| it.number).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "screws": screws,
        "closure_um": to_json::um(calibrated.closure),
        "journal": calibrated.journal,
    })
}

pub(crate) fn verified_text(title: &str, verified: &PlatformVerified) -> String {
    let skew = verified.skew_max_s.map_or(String::new(), |it| {
        format!("; screws started within {:.3} ms", it * 1e3)
    });
    format!(
        "{title}: largest error {:.3} µm, rms {:.3} µm over {} poses (tolerance {:.3} µm){skew}\n\
         poses in {}",
        verified.largest.um(),
        verified.rms.um(),
        verified.poses.len(),
        verified.tolerance.um(),
        verified.journal.display()
    )
}

pub(crate) fn verified_value(verified: &PlatformVerified) -> Value {
    let poses: Vec<_> = verified
        .poses
        .iter()
        .map(|it| {
            json!({
                "target": pose_value(it.target),
                "seen": pose_value(it.seen),
                "error_um": to_json::um(it.error),
                "skew_ms": it.skew_s.map(|it| it * 1e3),
            })
        })
        .collect();
    json!({
        "largest_um": to_json::um(verified.largest),
        "rms_um": to_json::um(verified.rms),
        "tolerance_um": to_json::um(verified.tolerance),
        "within_tolerance": verified.is_within_tolerance(),
        "skew_max_ms": verified.skew_max_s.map(|it| it * 1e3),
        "poses": poses,
        "journal": verified.journal,
    })
}

pub(crate) fn out_of_tolerance(verified: &PlatformVerified) -> Failure {
    let (seen, limit) = (verified.largest, verified.tolerance);
    PlatformFailure::OutOfTolerance { seen, limit }.into()
}

fn pose_text(pose: Pose) -> String {
    format!(
        "x = {:.6} mm, y = {:.6} mm, theta = {:.3} arcsec",
        pose.x.mm(),
        pose.y.mm(),
        pose.angle.arcsec()
    )
}

fn pose_value(pose: Pose) -> Value {
    json!({
        "x_mm": pose.x.mm(),
        "y_mm": pose.y.mm(),
        "theta_arcsec": pose.angle.arcsec(),
    })
}

/// `x=1mm y=-0.5mm theta=20arcsec`: what is not named is zero.
fn target_pose(words: &[String]) -> Result<Pose, Failure> {
    if words.is_empty() {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write x=1mm y=-0.5mm theta=20arcsec; what is not named is zero".into(),
        });
    }
    let mut pose = Pose::default();
    let mut named = Vec::new();
    for word in words {
        let usage = || Failure::Usage {
            what: format!("`{word}` is not part of a pose"),
            help: "write x=1mm, y=-300um, theta=20arcsec or theta=0.5deg, each once".into(),
        };
        let (name, value) = word.split_once('=').ok_or_else(usage)?;
        if named.contains(&name) {
            return Err(usage());
        }
        match name {
            "x" => pose.x = length(value).ok_or_else(usage)?,
            "y" => pose.y = length(value).ok_or_else(usage)?,
            "theta" => pose.angle = angle(value).ok_or_else(usage)?,
            _ => return Err(usage()),
        }
        named.push(name);
    }
    Ok(pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use units::Metres;

    fn parsed(words: &[&str]) -> Result<Pose, Failure> {
        let words: Vec<_> = words.iter().map(|it| (*it).to_owned()).collect();
        target_pose(&words)
    }

    #[test]
    fn a_pose_is_named_part_by_part_with_units() {
        let pose = parsed(&["x=1mm", "theta=-0.5deg"]).unwrap();
        assert_eq!((pose.x, pose.y), (Metres(1e-3), Metres::ZERO));
        assert!((pose.angle.value() + 0.5_f64.to_radians()).abs() < 1e-15);
        let arcsec = parsed(&["theta=20arcsec"]).unwrap().angle.arcsec();
        assert!((arcsec - 20.0).abs() < 1e-9);
        for words in [
            &["x=1"][..],
            &["z=1mm"],
            &["x=1mm", "x=2mm"],
            &["theta=1mm"],
            &["x=nanmm"],
            &[],
        ] {
            assert!(parsed(words).is_err(), "{words:?}");
        }
    }
}
