//! Jogs: an axis runs as long as somebody says so.

use core::ops::RangeInclusive;
use core::time::Duration;

use service::{AxisState, Code, JogRequest, MotionState, MoveRequest, Speed, StopMode, WayName};
use tests::{Edit, ROTARY};
use units::{AxisSpeed, MetresPerSecond, Radians, RadiansPerSecond};

use super::together::with_platform;
use super::turns::{turned, with_table};
use super::{Bed, SEED, anna, bert, each_here, slowly, to, with_stage, with_zeroed_stage, zeroed};
use crate::stage::Stage;

/// So much passes for each request by the machine's clock, however slow it is on the wall.
const OFTEN: Duration = Duration::from_millis(8);

fn jog(mm_per_s: f64) -> JogRequest {
    JogRequest {
        axis: "x".into(),
        speed: MetresPerSecond(mm_per_s * 1e-3).into(),
    }
}

fn turning(deg_per_s: f64) -> JogRequest {
    JogRequest {
        axis: "c".into(),
        speed: RadiansPerSecond(deg_per_s.to_radians()).into(),
    }
}

/// Of a platform.
fn part(name: &str, speed: impl Into<AxisSpeed>) -> JogRequest {
    JogRequest {
        axis: name.into(),
        speed: Speed::from(speed),
    }
}

const fn mm_per_s(speed: f64) -> MetresPerSecond {
    MetresPerSecond(speed * 1e-3)
}

const fn arcsec_per_s(speed: f64) -> RadiansPerSecond {
    RadiansPerSecond(Radians::from_arcsec(speed).value())
}

impl Bed<'_> {
    fn jogs(&self, request: &JogRequest) -> String {
        let jogs = self.client.jog(&anna(), request);
        jogs.unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// Jogs an axis that stands at `from` for a second, and then says nothing more of it: it goes so far in that second,
    /// and so far afterwards, in the axis's unit.
    fn stops_when_nobody_renews(
        &self,
        request: &JogRequest,
        from: f64,
        (in_a_second, afterwards): (RangeInclusive<f64>, RangeInclusive<f64>),
    ) {
        let name = request.axis.as_str();
        // Five times as long as an axis runs without being told so.
        let id = self.keeps_jogging(request, 1.0);
        let axis = self.client.axis(name).unwrap();
        assert_eq!(axis.state, AxisState::ContinuousMotion);
        assert_eq!(self.now(&id).state, MotionState::Moving);
        let so_far = self.encoder_mm(name) - from;
        assert!(in_a_second.contains(&so_far), "{so_far} in 1 s");
        self.lets_go();
        let view = self.ended(&id);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(view.stopped.unwrap().by, "the dead-man of anna");
        // 200 ms after the last word, and slowing down.
        let on = self.encoder_mm(name) - from - so_far;
        assert!(afterwards.contains(&on), "{on} without a word");
        let stands = self.client.axis(name).unwrap().state;
        assert_eq!(stands, AxisState::Standstill, "it stays enabled");
    }

    /// Renews a jog for so long by the machine's clock.
    fn keeps_jogging(&self, request: &JogRequest, seconds: f64) -> String {
        self.stage.gate.limit(OFTEN);
        let begun = self.client.machine().clock_s;
        let mut id = self.jogs(request);
        while self.client.machine().clock_s - begun < seconds {
            id = self.jogs(request);
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
        bed.stops_when_nobody_renews(&jog(2.0), from, (1.5..=2.2, 0.0..=0.6));
    });
}

#[test]
fn a_speed_of_zero_ends_a_jog_and_the_other_way_begins_another_one() {
    with_zeroed_stage(|bed| {
        let first = bed.keeps_jogging(&jog(2.0), 0.3);
        let back = bed.keeps_jogging(&jog(-2.0), 0.3);
        assert_ne!(first, back);
        assert_eq!(bed.jogs(&jog(0.0)), back);
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
        let id = bed.keeps_jogging(&jog(5.0), 0.5);
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
        bed.client.stop(&anna(), StopMode::Controlled).unwrap();
        bed.ended(&moving);
        let here = bed.encoder_mm("x");
        let round = JogRequest {
            axis: "x".into(),
            ..turning(5.0)
        };
        let round = bed.client.jog(&anna(), &round).unwrap_err();
        assert_eq!(round.code, Code::NotOffered);
        assert!(round.to_string().contains("\"2mm/s\""), "{round}");
        bed.let_time_pass(0.3);
        assert!((bed.encoder_mm("x") - here).abs() < 1e-3, "it moved");
    });
}

#[test]
fn a_table_is_jogged_across_its_seam_as_long_as_that_is_renewed() {
    with_table(|bed| {
        let from = bed.turns_to(&turned(-5.0));
        bed.stops_when_nobody_renews(&turning(20.0), from, (15.0..=22.0, 0.0..=7.0));
    });
}

#[test]
fn a_table_turns_back_from_rest_and_a_speed_of_zero_ends_that_in_any_unit() {
    with_table(|bed| {
        let zero = JogRequest {
            axis: "c".into(),
            ..jog(0.0)
        };
        let nothing = bed.client.jog(&anna(), &zero).unwrap_err();
        assert_eq!(nothing.code, Code::NoSuchMotion);
        let along = JogRequest {
            axis: "c".into(),
            ..jog(2.0)
        };
        let along = bed.client.jog(&anna(), &along).unwrap_err();
        assert_eq!(along.code, Code::NotOffered);
        assert!(along.to_string().contains("2 mm/s"), "{along}");
        assert!(along.to_string().contains("\"5deg/s\""), "{along}");
        bed.let_time_pass(0.2);
        let here = bed.encoder_mm("c");

        let first = bed.keeps_jogging(&turning(20.0), 0.3);
        // Faster than it usually turns.
        let back = bed.keeps_jogging(&turning(-170.0), 1.0);
        assert_ne!(first, back);
        assert_eq!(bed.jogs(&zero), back);
        bed.lets_go();
        let view = bed.ended(&first);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(bed.ended(&back).stopped.unwrap().by, "anna");
        let turned_back = here - bed.encoder_mm("c");
        assert!((10.0..=32.0).contains(&turned_back), "{turned_back}");
        bed.client.power(&anna(), "c", false).unwrap();
        let off = bed.client.jog(&anna(), &turning(5.0)).unwrap_err();
        assert_eq!(off.code, Code::AxisDisabled);
    });
}

/// Where the drive's register ends, at 2^31 counts of which a turn has 129 600 000.
const LAST_DEG: f64 = 5965.232;

#[test]
fn a_table_whose_drive_counts_on_is_jogged_to_its_last_count_and_back() {
    let counts_on = |text: String| {
        text.edit("\"to_last_count\"   #", "\"counts_on\"   #")
            .edit("\nspeed_deg_per_s = 30.0", "\nspeed_deg_per_s = 180.0")
    };
    let new = |rig, folder: &std::path::Path| Stage::new(rig, (ROTARY, SEED), folder, counts_on);
    let body = |bed: &Bed<'_>| {
        let near = MoveRequest {
            way: Some(WayName::Turns),
            ..turned(LAST_DEG - 20.0)
        };
        bed.turns_to(&near);
        let id = bed.keeps_jogging(&turning(100.0), 0.6);
        bed.lets_go();
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Done, "{view:?}");
        let short = LAST_DEG - bed.encoder_mm("c");
        // By its following error limit.
        assert!((600.0 / 3600.0 - 0.001..0.2).contains(&short), "{short}");
        let again = bed.jogs(&turning(100.0));
        assert_eq!(bed.ended(&again).state, MotionState::Done);
        let back = bed.keeps_jogging(&turning(-100.0), 0.6);
        bed.lets_go();
        assert_eq!(bed.ended(&back).state, MotionState::Stopped);
        let back = LAST_DEG - bed.encoder_mm("c");
        assert!((20.0..90.0).contains(&back), "{back}");
    };
    each_here(new, zeroed(body));
}

#[test]
fn a_platform_is_jogged_along_and_turned_as_long_as_that_is_renewed() {
    with_platform(|bed| {
        let from = bed.screws_mm();
        let moved = || {
            let to = bed.screws_mm();
            [0, 1, 2].map(|at| to[at] - from[at])
        };
        let id = bed.keeps_jogging(&part("x", mm_per_s(0.5)), 1.5);
        for screw in ["u", "v"] {
            let state = bed.client.axis(screw).unwrap().state;
            assert_eq!(state, AxisState::ContinuousMotion, "{screw}");
        }
        assert_eq!(bed.now(&id).state, MotionState::Moving);
        bed.lets_go();
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(view.stopped.clone().unwrap().by, "the dead-man of anna");
        let [u, v, w] = moved();
        assert!((0.4..=0.95).contains(&u), "{u} mm in 1.5 s, and 0.2 s more");
        assert!((u - v).abs() < 0.01 && w.abs() < 0.002, "{u}, {v}, {w} mm");
        let stands = view.axes["x"].encoder.clone().expect("it is known");
        assert!((stands.value - u).abs() < 0.01, "{view:?}");

        // The other way, from rest, and about its middle.
        let first = bed.keeps_jogging(&part("theta", arcsec_per_s(300.0)), 1.0);
        let back = bed.keeps_jogging(&part("theta", arcsec_per_s(-300.0)), 2.0);
        assert_ne!(first, back);
        assert_eq!(bed.jogs(&part("x", mm_per_s(0.0))), back);
        bed.lets_go();
        assert_eq!(bed.ended(&first).state, MotionState::Stopped);
        let view = bed.ended(&back);
        assert_eq!(view.stopped.clone().unwrap().by, "anna");
        let turned = view.axes["theta"].encoder.clone().expect("it is known");
        assert_eq!(turned.unit, "deg");
        assert!(
            (-700.0..=-20.0).contains(&(turned.value * 3600.0)),
            "{view:?}"
        );
        let [u_now, v_now, _] = moved();
        assert!(
            ((u_now - u) + (v_now - v)).abs() < 0.02,
            "it turns where it is"
        );
        assert_eq!(
            bed.client.axis("w").unwrap().state,
            AxisState::Standstill,
            "it stays enabled"
        );
    });
}

#[test]
fn a_jog_of_a_platform_ends_at_the_end_of_its_reach_from_which_it_goes_back() {
    with_platform(|bed| {
        let ends = |request: &JogRequest, seconds: f64| {
            let id = bed.keeps_jogging(request, seconds);
            bed.lets_go();
            let view = bed.ended(&id);
            let at = view.axes[&request.axis].encoder.clone();
            (view.state, at.expect("it is known").value)
        };
        let on = part("x", mm_per_s(20.0));
        for _ in 0..2 {
            let (state, x) = ends(&on, 1.0);
            assert_eq!(state, MotionState::Done);
            assert!((1.4995..=1.5).contains(&x), "{x} mm");
        }
        // Still there along x.
        let (state, y) = ends(&part("y", mm_per_s(-20.0)), 1.0);
        assert_eq!(state, MotionState::Done);
        assert!((-1.5..=-1.4995).contains(&y), "{y} mm");
        let (state, turned) = ends(&part("theta", arcsec_per_s(3600.0)), 1.5);
        assert_eq!(state, MotionState::Done);
        assert!((0.499..=0.5).contains(&turned), "{turned} degrees");
        let (_, x) = ends(&part("x", mm_per_s(-2.0)), 0.5);
        assert!((-1.0..1.4).contains(&x), "{x} mm");
        // A motion goes on from there.
        let middle = bed.begin(&super::together::pose(0.0, 0.0, 0.0));
        assert_eq!(bed.ended(&middle).state, MotionState::Done);
    });
}

#[test]
fn what_a_platform_cannot_do_is_not_jogged() {
    with_platform(|bed| {
        let here = bed.screws_mm();
        let refused = |request: &JogRequest, code: Code, said: &str| {
            let problem = bed.client.jog(&bert(), request).unwrap_err();
            assert_eq!(problem.code, code, "{problem}");
            assert!(problem.to_string().contains(said), "{problem}");
        };
        refused(&part("x", arcsec_per_s(5.0)), Code::NotOffered, "\"2mm/s\"");
        refused(
            &part("theta", mm_per_s(1.0)),
            Code::NotOffered,
            "\"5deg/s\"",
        );
        refused(&part("u", mm_per_s(1.0)), Code::NotOffered, "theta");
        refused(&part("z", mm_per_s(1.0)), Code::NoSuchAxis, "z");
        refused(
            &part("x", mm_per_s(0.0)),
            Code::NoSuchMotion,
            "x is not jogged",
        );
        bed.client.power(&anna(), "w", false).unwrap();
        refused(&part("x", mm_per_s(1.0)), Code::AxisDisabled, "w");
        bed.client.power(&anna(), "w", true).unwrap();
        bed.let_time_pass(0.3);
        for (before, after) in here.into_iter().zip(bed.screws_mm()) {
            assert!((after - before).abs() < 1e-3, "a screw moved");
        }
        let moving = bed.begin(&super::together::pose(1.0, 1.0, 0.0));
        refused(&part("x", mm_per_s(1.0)), Code::AxisBusy, &moving);
        bed.ended(&moving);
    });
}

/// A held key asks again and again: it must not undo a stop, and a renewal that came too late must not begin anew.
#[test]
fn a_jog_that_was_ended_does_not_begin_again_until_its_key_is_let_go() {
    with_zeroed_stage(|bed| {
        let begins_again = |by: &str| {
            let id = bed.jogs(&jog(2.0));
            assert_eq!(bed.now(&id).state, MotionState::Moving, "after {by}");
            bed.client.stop(&anna(), StopMode::Controlled).unwrap();
            bed.ended(&id);
            bed.let_time_pass(0.5);
        };
        for (name, ends) in [
            (
                "a stop",
                &(|| drop(bed.client.stop(&bert(), StopMode::Controlled))) as &dyn Fn(),
            ),
            ("a late renewal", &|| bed.let_time_pass(0.25)),
        ] {
            let id = bed.keeps_jogging(&jog(2.0), 0.3);
            ends();
            while bed.now(&id).state != MotionState::Stopped {
                bed.let_time_pass(0.01);
            }
            let here = bed.encoder_mm("x");
            for _ in 0..10 {
                let held = bed.client.jog(&anna(), &jog(2.0)).unwrap_err();
                assert!(held.to_string().contains("let go of it"), "{held}");
                bed.let_time_pass(0.15);
            }
            assert!(
                (bed.encoder_mm("x") - here).abs() < 1e-3,
                "it moved after {name}"
            );
            bed.let_time_pass(0.5);
            begins_again(name);
        }
        bed.lets_go();
    });
}

#[test]
fn a_second_person_is_refused_while_the_first_one_jogs() {
    with_zeroed_stage(|bed| {
        bed.stage.gate.limit(OFTEN);
        let id = bed.jogs(&jog(20.0));
        let mut last = bed.encoder_mm("x");
        for at in 0..60 {
            assert_eq!(bed.jogs(&jog(20.0)), id, "it goes on");
            for speed in [-20.0, 20.0, 5.0] {
                let problem = bed.client.jog(&bert(), &jog(speed)).unwrap_err();
                assert_eq!(problem.code, Code::AxisBusy, "{problem}");
                let said = problem.to_string();
                for word in ["jogged by anna", "20.000 mm/s", "since 20", &id] {
                    assert!(said.contains(word), "{word}: {said}");
                }
            }
            let here = bed.encoder_mm("x");
            assert!(here >= last, "round {at}: {here} mm after {last} mm");
            last = here;
        }
        assert!(last > 2.0, "{last} mm");
        // Anybody may end it.
        let ended = bed
            .client
            .jog(&bert(), &jog(0.0))
            .expect("an end is never refused");
        assert_eq!(ended, id);
        assert_eq!(bed.ended(&id).stopped.expect("it was ended").by, "bert");
        // Then the axis is free for whoever asks.
        let back = bed
            .client
            .jog(&bert(), &jog(-20.0))
            .expect("the axis is free");
        assert_ne!(back, id);
        bed.lets_go();
        bed.ended(&back);
    });
}

#[test]
fn two_keys_under_one_name_stop_the_jog() {
    with_zeroed_stage(|bed| {
        let middle = bed.begin(&to("x", 20.0));
        assert_eq!(bed.ended(&middle).state, MotionState::Done);
        bed.stage.gate.limit(OFTEN);
        let first = bed.jogs(&jog(20.0));
        let second = bed.jogs(&jog(-20.0));
        let conflict = bed.client.jog(&anna(), &jog(20.0)).unwrap_err();
        assert_eq!(conflict.code, Code::AxisBusy, "{conflict}");
        assert!(
            conflict.to_string().contains("different speeds"),
            "{conflict}"
        );
        // As long as both are held, nothing begins again.
        let asks = |rounds: u32| {
            for at in 0..rounds {
                let speed = if at % 2 == 0 { -20.0 } else { 20.0 };
                bed.client.jog(&anna(), &jog(speed)).unwrap_err();
            }
        };
        asks(50);
        let here = bed.encoder_mm("x");
        asks(50);
        let moved = bed.encoder_mm("x") - here;
        assert!(moved.abs() < 1e-3, "{moved} mm");
        for id in [&first, &second] {
            assert_eq!(bed.now(id).state, MotionState::Stopped, "{id}");
        }
        bed.lets_go();
        bed.let_time_pass(0.5);
        let again = bed.jogs(&jog(-20.0));
        assert_eq!(bed.ended(&again).state, MotionState::Stopped);
    });
}

#[test]
fn the_holder_of_the_lease_jogs_instead_of_others() {
    with_zeroed_stage(|bed| {
        let middle = bed.begin(&to("x", 20.0));
        assert_eq!(bed.ended(&middle).state, MotionState::Done);
        bed.stage.gate.limit(OFTEN);
        let id = bed.jogs(&jog(5.0));
        let lease = service::LeaseRequest {
            name: "bert".into(),
            seconds: 60,
            force: false,
        };
        let leased = bed.client.lease(&bert(), &lease).expect("nobody has it");
        let holder = service::Caller {
            lease: Some(leased.token),
            ..bert()
        };
        let next = bed
            .client
            .jog(&holder, &jog(-5.0))
            .expect("the lease is his");
        let refused = bed.client.jog(&anna(), &jog(5.0)).unwrap_err();
        assert_eq!(refused.code, Code::Leased, "{refused}");
        assert_eq!(bed.ended(&id).stopped.expect("it gave way").by, "bert");
        bed.lets_go();
        assert_eq!(bed.ended(&next).state, MotionState::Stopped);
        bed.client.release(&holder).expect("it is his");
    });
}
