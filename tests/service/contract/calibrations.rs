//! Which calibration corrects motions: chosen while the stage stands, without moving it.

use std::path::Path;

use service::{
    ChosenView, Code, MachineState, MotionState, MoveRequest, RunKind, RunRequest, RunState,
};
use tests::volume::{GEOMETRY, REFERENCES, Volume, good, quick};
use tests::{UVW, VOLUMETRIC};
use units::Metres;

use super::together::{few_strokes, off_um, pose};
use super::{Bed, SEED, anna, compensated, each_here, slowly, to, with_zeroed_stage, zeroed};
use crate::client::PATIENCE;
use crate::stage::Stage;

const SCREWS: [&str; 3] = ["u", "v", "w"];
const AXES: [&str; 3] = ["x", "y", "z"];
const FIRST_MEMORY: &str = "volume-first-memory";

impl Bed<'_> {
    pub(super) fn calibrates(&self) -> String {
        let request = RunRequest::of(RunKind::Calibrate, None);
        let id = self.client.plan(&anna(), &request);
        let run = id.and_then(|id| self.client.run(&id, PATIENCE));
        let run = run.unwrap_or_else(|problem| panic!("{problem}"));
        assert_eq!(run.state, RunState::Done, "{run:?}");
        self.in_use().expect("it was activated")
    }

    fn in_use(&self) -> Option<String> {
        self.in_use_of("x")
    }

    fn in_use_of(&self, axis: &str) -> Option<String> {
        self.client.axis(axis).unwrap().calibration
    }

    /// Where the encoders of these axes are does not change meanwhile.
    fn without_a_move<R>(&self, axes: [&str; 3], work: impl FnOnce() -> R) -> R {
        let before = axes.map(|it| self.encoder_mm(it));
        let result = work();
        self.let_time_pass(0.2);
        for (axis, before) in axes.iter().zip(before) {
            let moved_um = (self.encoder_mm(axis) - before) * 1e3;
            assert!(moved_um.abs() < 0.2, "{axis} moved by {moved_um} µm");
        }
        result
    }
}

/// What is in use now, by its name in the store.
fn changed(chosen: &ChosenView) -> Vec<(&str, Option<&str>, bool)> {
    let changes = chosen.changes.iter();
    let changes = changes.map(|it| (it.of.as_str(), it.id.as_deref(), it.is_earlier));
    changes.collect()
}

#[test]
fn an_earlier_calibration_is_used_again_without_a_move_and_the_newer_one_after_it() {
    with_zeroed_stage(|bed| {
        assert!(bed.client.calibrations().is_empty());
        let nothing = bed.client.rollback(&anna(), "x").unwrap_err();
        assert!(nothing.detail().contains("earlier"), "{nothing}");
        let first = bed.calibrates();
        let second = bed.calibrates();
        assert_ne!(first, second);
        let used = |id: &str| {
            let list = bed.client.calibrations();
            let active: Vec<_> = list.iter().filter(|it| it.active).collect();
            assert!(list.len() == 2 && active.len() == 1, "{list:?}");
            assert!(active[0].id == *id && active[0].axis == "x", "{list:?}");
            assert_eq!(bed.in_use().as_deref(), Some(id));
        };
        used(&second);
        let stands = bed.stage.true_mm();
        bed.client.rollback(&anna(), "x").unwrap();
        used(&first);
        bed.client.activate(&anna(), &second[..8]).unwrap();
        used(&second);
        let moved_um = (bed.stage.true_mm() - stands) * 1e3;
        assert!(moved_um.abs() < 0.2, "{moved_um} um");
        let id = bed.begin(&compensated("x", 12.5));
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Done);
        assert_eq!(view.axes["x"].corrected, "yes");
    });
}

#[test]
fn a_calibration_is_refused_where_it_cannot_be_used() {
    with_zeroed_stage(|bed| {
        let first = bed.calibrates();
        let unknown = bed.client.activate(&anna(), "0123").unwrap_err();
        assert!(unknown.detail().contains("0123"), "{unknown}");
        let other = bed.client.rollback(&anna(), "q").unwrap_err();
        assert_eq!(other.code, Code::NoSuchAxis);
        let moving = bed.begin(&slowly("x", 30.0));
        bed.under_way(&moving);
        let busy = bed.client.activate(&anna(), &first).unwrap_err();
        assert_eq!(busy.code, Code::AxisBusy, "{busy}");
        assert_eq!(bed.in_use(), Some(first.clone()));
    });
}

#[test]
fn the_screws_of_a_platform_go_back_together_and_one_by_one_without_a_move() {
    let new = |rig, folder: &Path| Stage::new(rig, (UVW, SEED), folder, few_strokes);
    let body = |bed: &Bed<'_>| {
        let calibrates = || {
            let made = bed
                .client
                .run(&bed.run_of(RunKind::Calibrate), PATIENCE)
                .unwrap();
            assert_eq!(made.state, RunState::Done, "{made:?}");
            SCREWS.map(|it| bed.in_use_of(it).expect("it was activated"))
        };
        let first = calibrates();
        let never = bed.client.rollback(&anna(), "platform").unwrap_err();
        assert_eq!(never.code, Code::NoSuchCalibration, "{never}");
        let second = calibrates();
        assert!(first.iter().zip(&second).all(|(a, b)| a != b));

        let back = bed.without_a_move(SCREWS, || bed.client.rollback(&anna(), "platform"));
        let back = back.unwrap();
        let expected = SCREWS
            .iter()
            .zip(&first)
            .map(|(it, id)| (*it, Some(id.as_str()), true));
        assert_eq!(changed(&back), expected.collect::<Vec<_>>());
        assert_eq!(back.axes.len(), 3);
        assert_eq!(SCREWS.map(|it| bed.in_use_of(it)), first.clone().map(Some));
        let one = bed.without_a_move(SCREWS, || bed.client.activate(&anna(), &second[1][..10]));
        assert_eq!(
            changed(&one.unwrap()),
            [("v", Some(second[1].as_str()), false)]
        );
        let one = bed.client.rollback(&anna(), "v").unwrap();
        assert_eq!(changed(&one), [("v", Some(first[1].as_str()), true)]);

        let corrected = MoveRequest {
            uncompensated: false,
            ..pose(0.5, -0.3, 100.0)
        };
        let id = bed.begin(&corrected);
        bed.let_time_pass(0.05);
        let busy = bed.client.activate(&anna(), &second[0]).unwrap_err();
        assert_eq!(busy.code, Code::AxisBusy, "{busy}");
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Done, "{view:?}");
        assert_eq!(view.axes["x"].corrected, "yes");
        let x = view.axes["x"].position.as_ref().expect("it was seen").value;
        assert!((x - 0.5).abs() < 0.002, "{view:?}");
    };
    each_here(new, zeroed(body));
}

/// What a machine of three axes has used, one after the other.
struct Known {
    /// Errors, and nothing that counts from them.
    alone: String,
    /// Errors, references and the first memory.
    older: [String; 3],
    newer: [String; 3],
}

impl Known {
    fn of(before: &mut Volume) -> Self {
        let store = before.bench.store.clone();
        let alone = before.know_errors();
        let mut known = || {
            good(before.work().zero());
            let geometry = before.know_errors();
            good(before.work().reference(&store));
            before.remember_bow(Metres::from_um(0.01));
            let current = |pointer| {
                let active = good(store.active(pointer));
                active.current.expect("it was activated")
            };
            [geometry, current(REFERENCES), current(FIRST_MEMORY)]
        };
        let known = Self {
            alone,
            older: known(),
            newer: known(),
        };
        let mut all = vec![known.alone.clone()];
        all.extend(known.older.iter().chain(&known.newer).cloned());
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 7, "each is another one");
        known
    }
}

#[test]
fn the_errors_of_three_axes_are_chosen_with_what_counts_from_them_or_not_at_all() {
    let mut before = Volume::zeroed(SEED, quick, |text| text);
    let known = Known::of(&mut before);
    let new = |rig, folder: &Path| {
        before.bequeath(&folder.join("volumetric"));
        Stage::new(rig, (VOLUMETRIC, SEED), folder, quick)
    };
    each_here(
        new,
        zeroed(|bed: &Bed<'_>| {
            are_chosen_together(bed, &known);
            are_refused(bed, &known);
        }),
    );
}

fn all_of(names: &[String; 3], are_earlier: bool) -> Vec<(&'static str, Option<&str>, bool)> {
    let names = [GEOMETRY, REFERENCES, FIRST_MEMORY].into_iter().zip(names);
    let all = names.map(|(of, id)| (of, Some(id.as_str()), are_earlier));
    all.collect()
}

fn are_chosen_together(bed: &Bed<'_>, known: &Known) {
    let goes_right = || {
        let view = bed.ended(&bed.begin(&compensated("x", 60.0)));
        assert_eq!(view.state, MotionState::Done, "{view:?}");
        let view = bed.ended(&bed.begin(&compensated("x", 40.0)));
        let rest = ["y", "z"].map(|it| view.axes[it].target.value);
        let off = off_um(bed, [40.0, rest[0], rest[1]]);
        assert!(off.iter().all(|it| it.abs() < 1.5), "{off:?}");
    };
    assert_eq!(bed.in_use_of("y"), Some(known.newer[0].clone()));
    goes_right();
    let back = bed.without_a_move(AXES, || bed.client.rollback(&anna(), GEOMETRY));
    assert_eq!(changed(&back.unwrap()), all_of(&known.older, true));
    for axis in AXES {
        assert_eq!(bed.in_use_of(axis), Some(known.older[0].clone()));
    }
    goes_right();
    let again = bed.without_a_move(AXES, || bed.client.activate(&anna(), &known.newer[0]));
    assert_eq!(changed(&again.unwrap()), all_of(&known.newer, false));
    goes_right();
}

fn are_refused(bed: &Bed<'_>, known: &Known) {
    let refused = |id: &str, words: &str| {
        let problem = bed.client.activate(&anna(), id).unwrap_err();
        assert!(problem.to_string().contains(words), "{problem}");
        assert_eq!(bed.in_use_of("z"), Some(known.newer[0].clone()));
    };
    // Nothing was read by its detectors: nothing could be corrected.
    refused(&known.alone, "reference");
    // What counts from other errors.
    refused(&known.older[1], "count from the calibration");
    refused(&known.older[2], "counts from");
    let id = bed.begin(&to("z", 100.0));
    bed.let_time_pass(0.05);
    let busy = bed.client.rollback(&anna(), GEOMETRY).unwrap_err();
    assert_eq!(busy.code, Code::AxisBusy, "{busy}");
    assert_eq!(bed.ended(&id).state, MotionState::Done);
    assert_eq!(bed.client.machine().state, MachineState::Running);
}
