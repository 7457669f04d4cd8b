//! The verbs of the cycle on an alignment platform (system S1).

use serde_json::{Value, json};

use crate::jogging::Jogged;
use crate::platform::calibrate::PlatformCalibrated;
use crate::platform::verify::{Aligned, PlatformVerified};
use crate::platform::zero::PlatformZeroed;
use crate::platform::{PlatformMoved, Pose, PoseJog, PoseMoved};
use crate::ports::Use;
use crate::program::jogs::Jog;
use crate::program::json as to_json;
use crate::program::output::{Ended, Output, with_counters};
use crate::program::platform::fit::outlier_lines;
use crate::program::platform::target::asked;
use crate::program::platform::uncertainty;
use crate::program::session::Session;
use crate::program::text::verdict;
use crate::program::tried::{Made, tried, used};
use crate::program::{AxisArgs, CalibrateArgs, MachineArgs, MoveArgs, VerifyArgs};
use crate::runs::Told;
use crate::{Failure, Machine};
use machine::records::Store;

/// Starts the platform, zeroes it, runs `procedure`, switches off.
fn with_zeroed_platform<R>(
    args: &MachineArgs,
    verb: &str,
    output: Output,
    procedure: impl FnOnce(&mut Machine, &Store) -> Result<R, Failure>,
) -> Result<(R, Value), Failure> {
    let session = Session::open(args, verb, Use::Measurement, output)?;
    zeroed_platform(
        session,
        |_| Ok(()),
        |machine, store, ()| procedure(machine, store),
    )
}

/// The same on a machine that is connected; `prepare` is done before anything moves.
fn zeroed_platform<P, R>(
    mut session: Session,
    prepare: impl FnOnce(&mut Machine) -> Result<P, Failure>,
    procedure: impl FnOnce(&mut Machine, &Store, P) -> Result<R, Failure>,
) -> Result<(R, Value), Failure> {
    let store = session.store.clone();
    session.machine.guarded(|machine| {
        machine.start()?;
        let prepared = prepare(machine)?;
        machine.platform()?.zero(&store)?;
        let result = procedure(machine, &store, prepared)?;
        machine.shut_down()?;
        Ok((result, to_json::counters(&machine.devices().counters())))
    })
}

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    let mut session = Session::open(&args.machine, "zero", Use::Measurement, output)?;
    let store = session.store.clone();
    let (found, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        let zeroed = machine.platform()?.zero(&store)?;
        machine.shut_down()?;
        Ok((zeroed, to_json::counters(&machine.devices().counters())))
    })?;
    output.told(zeroed(&found), counters)
}

pub(super) fn zeroed(zeroed: &PlatformZeroed) -> Told {
    let text = format!(
        "platform: zero found; the camera sees it at {}\nrecorded in {}",
        pose_text(zeroed.datum),
        zeroed.journal.display()
    );
    let value = json!({"datum": pose_value(zeroed.datum), "journal": zeroed.journal});
    Told { text, value }
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    let mut made = None;
    let run = |machine: &mut Machine, store: &Store| {
        let options = args.options(None);
        let calibrated = machine.platform()?.calibrate_by(store, &options)?;
        made = Some(Made {
            told: Told {
                text: calibrated_text(&calibrated),
                value: calibrated_value(&calibrated),
            },
            store: store.clone(),
            group: "platform".into(),
            stored: calibrated.stored(),
        });
        if !args.verify {
            return Ok(None);
        }
        let verified = machine.platform()?.verify(store, true)?;
        Ok(Some((
            verified_as(&verified, true),
            verified.out_of_tolerance(),
        )))
    };
    let ended = with_zeroed_platform(&args.axis.machine, "calibrate", output, run);
    tried(made, ended, args, output)
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    let compensated = !args.uncompensated;
    let run = |machine: &mut Machine, store: &Store| {
        if compensated {
            machine.platform()?.load_active(store)?;
        }
        machine.platform()?.verify(store, compensated)
    };
    let (verified, counters) = with_zeroed_platform(&args.axis.machine, "verify", output, run)?;
    let told = verified_as(&verified, compensated);
    match verified.out_of_tolerance().filter(|_| compensated) {
        None => output.told(told, counters),
        Some(failure) => {
            output.bad_result(&told.text, with_counters(told.value, counters), failure)
        }
    }
}

pub(super) fn verified_as(verified: &PlatformVerified, compensated: bool) -> Told {
    let title = if compensated { "as left" } else { "as found" };
    Told {
        text: verified_text(title, verified),
        value: json!({title.replace(' ', "_"): verified_value(verified)}),
    }
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    let asked = asked(args)?;
    let mut session = Session::open(&args.machine, "move", Use::Measurement, output)?;
    let store = session.store.clone();
    session.machine.platform()?.check_asked(&store, &asked)?;
    let look = |machine: &mut Machine| machine.platform()?.look_for(&asked);
    let run = |machine: &mut Machine, store: &Store, before: Option<Pose>| {
        machine.platform()?.move_asked(store, &asked, before)
    };
    let (it, counters) = zeroed_platform(session, look, run)?;
    output.told(moved(&it), counters)
}

pub(super) fn moved(it: &PlatformMoved) -> Told {
    let mut text = format!(
        "platform: target {}, the camera sees it at {}",
        pose_text(it.target),
        pose_text(it.seen)
    );
    if !it.unnamed.is_empty() {
        let unnamed = it.unnamed.join(" and ");
        text +=
            &format!("\n{unnamed}, which nobody named: where the camera saw the platform before");
    }
    if it.calibrations.is_empty() {
        text += "\nNOT CORRECTED: the screws went by their encoders alone";
    }
    text += &it.moved.as_ref().map_or(String::new(), moved_text);
    text += &it.aligned.as_ref().map_or(String::new(), aligned_text);
    let value = json!({
        "target": pose_value(it.target),
        "unnamed": it.unnamed,
        "seen": pose_value(it.seen),
        "calibrations": it.calibrations,
        "corrected": !it.calibrations.is_empty(),
        "move": it.moved.as_ref().map(moved_value),
        "alignment": it.aligned.as_ref().map(aligned_value),
    });
    Told { text, value }
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
            format!(" (its place: U = {:.3} µm, k = 2)", 2.0 * u.um())
        });
        text += &format!("\nplay of {} taken up first{doubt}", it.axis);
    }
    if let Some(u) = moved.standard_uncertainty() {
        text += &format!("\nplaces of the screws: U = {:.3} µm (k = 2)", 2.0 * u.um());
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
        "standard_uncertainty_um": moved.standard_uncertainty().map(to_json::um),
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
        "{}; closure {:.3} µm\npoints in {}",
        used("every screw calibrated,", calibrated.is_in_use),
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
        if let Some(worst) = uncertainty::worst(&screw.content) {
            text += &format!("\n    {}", worst.sentence());
        }
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
                "uncertainty": uncertainty::value(&screw.content),
                "outliers": crate::program::platform::json::outliers(&screw.outliers, &[]),
                "harmonics": screw.model.harmonics.iter().map(|it| it.number).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "screws": screws,
        "in_use": calibrated.is_in_use,
        "closure_um": to_json::um(calibrated.closure),
        "journal": calibrated.journal,
    })
}

pub(crate) fn verified_text(title: &str, verified: &PlatformVerified) -> String {
    let skew = verified.skew_max_s.map_or(String::new(), |it| {
        format!("; screws started within {:.3} ms", it * 1e3)
    });
    let verdict = verdict(
        &format!("{title}: largest error {:.3} µm", verified.largest.um()),
        &format!("{:.3} µm", verified.tolerance.um()),
        verified.is_within_tolerance(),
    );
    format!(
        "{verdict}\nrms {:.3} µm over {} poses{skew}\nposes in {}",
        verified.rms.um(),
        verified.poses.len(),
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

pub(crate) fn check_jog(machine: &mut Machine, jog: &Jog) -> Result<(), Failure> {
    let pose_jog = PoseJog::new(&jog.axis, jog.speed)?;
    machine.platform()?.check_jog(pose_jog)
}

pub(crate) fn jog(machine: &mut Machine, store: &Store, jog: &Jog) -> Result<Jogged, Failure> {
    let pose_jog = PoseJog::new(&jog.axis, jog.speed)?;
    machine.start()?;
    machine.platform()?.zero(store)?;
    machine.platform()?.jog(pose_jog, jog.duration)
}
