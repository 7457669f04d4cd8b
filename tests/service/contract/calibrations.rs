//! Which calibration corrects motions: chosen while the stage stands, without moving it.

use service::{Code, MotionState, RunKind, RunRequest, RunState};

use super::{Bed, anna, compensated, slowly, with_zeroed_stage};
use crate::client::PATIENCE;

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
        self.client.axis("x").unwrap().calibration
    }
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
