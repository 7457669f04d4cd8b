//! Jogs: an axis runs as long as somebody says so.

use core::time::Duration;

use service::{AxisState, Code, JogRequest, MotionState, Speed};
use units::MetresPerSecond;

use super::{Bed, anna, bert, slowly, to, with_stage, with_zeroed_stage};

/// So much passes for each request by the machine's clock, however slow it is on the wall.
const OFTEN: Duration = Duration::from_millis(8);

fn jog(mm_per_s: f64) -> JogRequest {
    JogRequest {
        axis: "x".into(),
        speed: Speed(MetresPerSecond(mm_per_s * 1e-3)),
    }
}

impl Bed<'_> {
    fn jogs(&self, mm_per_s: f64) -> String {
        let jogs = self.client.jog(&anna(), &jog(mm_per_s));
        jogs.unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// Renews a jog for so long by the machine's clock.
    fn keeps_jogging(&self, mm_per_s: f64, seconds: f64) -> String {
        self.stage.gate.limit(OFTEN);
        let begun = self.client.machine().clock_s;
        let mut id = self.jogs(mm_per_s);
        while self.client.machine().clock_s - begun < seconds {
            id = self.jogs(mm_per_s);
        }
        id
    }

    fn lets_go(&self) {
        self.stage.gate.lift_limit();
    }
}

#[test]
fn a_jog_runs_as_long_as_it_is_renewed_and_stops_when_nobody_renews_it() {
    with_zeroed_stage(|bed| {
        let from = bed.encoder_mm("x");
        // Five times as long as an axis runs without being told so.
        let id = bed.keeps_jogging(2.0, 1.0);
        let axis = bed.client.axis("x").unwrap();
        assert_eq!(axis.state, AxisState::ContinuousMotion);
        assert_eq!(bed.now(&id).state, MotionState::Moving);
        let so_far = bed.encoder_mm("x") - from;
        assert!((1.5..=2.2).contains(&so_far), "{so_far} mm in 1 s");
        bed.lets_go();
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(view.stopped.unwrap().by, "the dead-man of anna");
        // 200 ms after the last word, and slowing down.
        let on = bed.encoder_mm("x") - from - so_far;
        assert!((0.0..=0.6).contains(&on), "{on} mm without a word");
        assert_eq!(
            bed.client.axis("x").unwrap().state,
            AxisState::Standstill,
            "it stays enabled"
        );
    });
}

#[test]
fn a_speed_of_zero_ends_a_jog_and_the_other_way_begins_another_one() {
    with_zeroed_stage(|bed| {
        let first = bed.keeps_jogging(2.0, 0.3);
        let back = bed.keeps_jogging(-2.0, 0.3);
        assert_ne!(first, back);
        assert_eq!(bed.jogs(0.0), back);
        bed.lets_go();
        let view = bed.ended(&first);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        let view = bed.ended(&back);
        assert_eq!(view.stopped.unwrap().by, "anna");
        let nothing = bed.client.jog(&anna(), &jog(0.0)).unwrap_err();
        assert_eq!(nothing.code, Code::NoSuchMotion);
        let next = bed.begin(&to("x", 1.0));
        assert_eq!(bed.ended(&next).state, MotionState::Done);
    });
}

#[test]
fn a_jog_ends_at_the_soft_limit() {
    with_zeroed_stage(|bed| {
        let limit = bed.client.axis("x").unwrap().soft_max.unwrap().value;
        let near = bed.begin(&to("x", limit - 0.5));
        assert_eq!(bed.ended(&near).state, MotionState::Done);
        let id = bed.keeps_jogging(5.0, 0.5);
        bed.lets_go();
        assert_eq!(bed.ended(&id).state, MotionState::Done);
        assert!((bed.encoder_mm("x") - limit).abs() < 1e-3);
        assert!(
            bed.stage.true_mm() < limit + 0.02,
            "it stands before the end"
        );
    });
}

#[test]
fn what_must_not_move_is_not_jogged() {
    with_stage(|bed| {
        let refused = |code: Code| {
            let problem = bed.client.jog(&bert(), &jog(2.0)).unwrap_err();
            assert_eq!(problem.code, code, "{problem}");
        };
        refused(Code::NotZeroed);
        bed.client.zero(&anna(), None);
        bed.client.power(&anna(), "x", false).unwrap();
        refused(Code::AxisDisabled);
        bed.client.power(&anna(), "x", true).unwrap();
        let moving = bed.begin(&slowly("x", 30.0));
        bed.under_way(&moving);
        refused(Code::AxisBusy);
        assert_eq!(bed.now(&moving).state, MotionState::Moving, "it goes on");
        let unknown = JogRequest {
            axis: "q".into(),
            ..jog(1.0)
        };
        let unknown = bed.client.jog(&anna(), &unknown).unwrap_err();
        assert_eq!(unknown.code, Code::NoSuchAxis);
    });
}
