//! Motions of a rotary table: the contract is that of every motion.

use service::{
    AxisState, Code, Coordinate, MotionState, MoveRequest, RunKind, RunState, StopMode, WayName,
};
use tests::ROTARY;
use units::{Radians, RadiansPerSecond};

use super::questions::{Hand, few_placements};
use super::{Bed, SEED, anna, bert, each, to, zeroed};
use crate::stage::Stage;

pub(super) fn turned(degrees: f64) -> MoveRequest {
    MoveRequest {
        uncompensated: true,
        ..corrected(degrees)
    }
}

fn corrected(degrees: f64) -> MoveRequest {
    MoveRequest::of("c", Radians::from_degrees(degrees))
}

pub(super) fn with_table(body: impl Fn(&Bed<'_>)) {
    let new =
        |rig, folder: &std::path::Path| Stage::new(rig, (ROTARY, SEED), folder, few_placements);
    each(new, zeroed(body));
}

impl Bed<'_> {
    /// Where the motion `request` ends, in degrees.
    pub(super) fn turns_to(&self, request: &MoveRequest) -> f64 {
        let view = self.ended(&self.begin(request));
        assert_eq!(view.state, MotionState::Done, "{view:?}");
        let position = view.axes["c"].position.clone().expect("it is there");
        assert_eq!(position.unit, "deg");
        position.value
    }
}

#[test]
fn a_table_turns_the_way_that_is_asked_for_and_counts_its_turns() {
    with_table(|bed| {
        let near = |seen: f64, expected: f64| assert!((seen - expected).abs() < 1e-3, "{seen}");
        near(bed.turns_to(&turned(350.0)), -10.0);
        let way = |way, degrees| MoveRequest {
            way: Some(way),
            ..turned(degrees)
        };
        near(bed.turns_to(&way(WayName::Forward, 340.0)), 340.0);
        near(bed.turns_to(&way(WayName::Reverse, 350.0)), -10.0);
        near(bed.turns_to(&way(WayName::Turns, 370.0)), 370.0);
        // There already.
        near(bed.turns_to(&turned(370.0)), 370.0);
        let axis = bed.client.axis("c").unwrap();
        assert_eq!(axis.target.unwrap().unit, "deg");
        assert_eq!(axis.state, AxisState::Standstill);
    });
}

#[test]
fn a_turn_is_refused_where_nothing_corrects_it_or_it_is_no_angle_and_a_stop_names_who() {
    with_table(|bed| {
        let refused = bed.refused(&corrected(10.0), Code::Calibration);
        assert!(refused.to_string().contains("uncompensated"), "{refused}");
        let refused = bed.refused(&to("c", 12.5), Code::NotOffered);
        assert!(refused.to_string().contains("`targets.c`"), "{refused}");
        let fast = MoveRequest {
            speed: Some(units::MetresPerSecond(1e-3).into()),
            ..turned(10.0)
        };
        let refused = bed.refused(&fast, Code::NotOffered);
        assert!(
            refused.to_string().contains("`speed`: axis c turns"),
            "{refused}"
        );
        let id = bed.begin(&MoveRequest {
            way: Some(WayName::Turns),
            ..turned(3600.0)
        });
        while bed.encoder_mm("c") < 5.0 {
            bed.let_time_pass(0.02);
        }
        let busy = bed.refused(&turned(0.0), Code::AxisBusy);
        assert!(busy.to_string().contains(&id), "{busy}");
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(view.stopped.unwrap().by, "bert");
        let axis = bed.client.axis("c").unwrap();
        assert_eq!((axis.state, axis.homed), (AxisState::Standstill, true));
        bed.client.power(&anna(), "c", false).unwrap();
        bed.refused(&turned(0.0), Code::AxisDisabled);
    });
}

#[test]
fn a_table_turns_as_slowly_as_it_is_asked_to() {
    with_table(|bed| {
        let slow = MoveRequest {
            speed: Some(RadiansPerSecond(5.0_f64.to_radians()).into()),
            ..turned(90.0)
        };
        let from = bed.encoder_mm("c");
        let id = bed.begin(&slow);
        bed.let_time_pass(1.0);
        // At its usual speed of 30 degrees per second it would be 25 and more.
        let so_far = bed.encoder_mm("c") - from;
        assert!((3.0..=6.0).contains(&so_far), "{so_far} degrees in 1 s");
        assert_eq!(bed.now(&id).state, MotionState::Moving);
    });
}

#[test]
fn a_calibrated_table_is_corrected_and_says_how_uncertain_that_is() {
    with_table(|bed| {
        let id = bed.run_of(RunKind::Calibrate);
        assert_eq!(Hand::new(bed).does_all(&id).state, RunState::Done);
        let request = corrected(123.4);
        let Coordinate::Angle(_) = request.targets["c"] else {
            panic!("an angle");
        };
        let made = bed
            .client
            .axis("c")
            .unwrap()
            .calibration
            .expect("it is in use");
        let none = bed.client.rollback(&anna(), "c").unwrap_err();
        assert_eq!(none.code, Code::NoSuchCalibration, "{none}");
        bed.client.activate(&anna(), &made[..12]).unwrap();
        let view = bed.ended(&bed.begin(&request));
        let leg = &view.axes["c"];
        assert_eq!(
            (view.state, leg.corrected.as_str()),
            (MotionState::Done, "yes")
        );
        let u = leg.standard_uncertainty.clone().expect("it is known");
        assert_eq!(u.unit, "arcsec");
        let [position, encoder] =
            [&leg.position, &leg.encoder].map(|it| it.as_ref().unwrap().value);
        // Turns count on.
        let [position, encoder] = [position, encoder].map(|it| it.rem_euclid(360.0));
        // A table off by arcseconds: the point is where it was sent, the encoder elsewhere.
        assert!((position - 123.4).abs() * 3600.0 < 0.5, "{position}");
        assert!((encoder - 123.4).abs() * 3600.0 > 0.05, "{encoder}");
    });
}

#[test]
fn turns_without_end_are_refused_and_the_table_goes_on_as_it_was() {
    with_table(|bed| {
        for degrees in [1e7, -1e12, 1e300] {
            let far = MoveRequest {
                way: Some(WayName::Turns),
                ..turned(degrees)
            };
            let refused = bed.refused(&far, Code::Refused);
            assert!(refused.to_string().contains("24 h"), "{refused}");
        }
        assert!((bed.turns_to(&turned(10.0)) - 10.0).abs() < 0.01);
    });
}
