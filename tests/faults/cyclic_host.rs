//! What happens to the computer while an axis follows a path (classes 7, 39, 40), and axes that
//! still move when one is to be followed.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use machine::StopRequest;
use machine::engine::Cause;
use machine::engine::EngineFailure;
use tests::{Bench, Edit};
use truestage::Failure;
use units::Metres;

use crate::scene::{PERIOD, Phase, STOPPING, Scene, Wanted, check, cyclic, follow, shortened};
use crate::witness::{Testimony, Witnessed};

fn following() -> Scene {
    Scene::during(Phase::Follow).after_ms(1_700)
}

/// One SYNC is missed and the drives bear it: what was queued is dropped, not replayed.
#[test]
fn a_computer_that_is_held_up_for_a_moment_stops_in_a_controlled_way() {
    let span = PERIOD.mul_f64(2.2);
    let played = following().stall(span).play();
    played.result.as_ref().unwrap();
    assert!(played.seen().has_stalled());
    assert_eq!(played.cause, Some(Cause::Overrun { periods: 1 }));
    // 200 mm/s at 5 m/s² and 100 m/s³.
    let at_rest = played.seen().moved_last(played.due).unwrap();
    let limit = played.due + PERIOD + span + 4 * STOPPING;
    assert!(at_rest <= limit, "{:?}", at_rest - played.due);
    let quick = |word: u16| word & 0x06 == 0x02;
    let seen = played.seen();
    let early = |(at, word): &(_, u16)| *at < at_rest && quick(*word);
    assert_eq!(seen.controlwords().find(early), None);
}

/// Three quarters of a period late: the next SYNC keeps its distance, and the path goes on.
#[test]
fn a_sync_that_leaves_late_is_not_followed_at_once_by_the_next() {
    let played = following().stall(PERIOD.mul_f64(1.75)).play();
    played.result.as_ref().unwrap();
    assert!(played.seen().has_stalled());
    assert_eq!(played.cause, Some(Cause::PathDone));
    let seen = played.seen();
    let syncs = seen.sent.iter();
    let syncs = syncs.filter(|(_, it)| it.standard_id() == Some(0x080));
    let times: Vec<_> = syncs.map(|(at, _)| *at).collect();
    let gaps = times.windows(2).map(|it| it[1] - it[0]);
    let (least, most) = (gaps.clone().min().unwrap(), gaps.max().unwrap());
    assert!(least > PERIOD.mul_f64(0.9), "{least:?}");
    assert!(most > PERIOD.mul_f64(1.7), "{most:?}");
}

/// Longer than the drives bear: they stop themselves, and the computer is named, not the drives.
#[test]
fn a_computer_that_is_held_up_for_long_is_named_as_the_cause() {
    for ms in [50, 1_000, 5_000] {
        let span = Duration::from_millis(ms);
        let scene = following().stall(span);
        let wanted = Wanted {
            cause: |it| {
                matches!(
                    it,
                    Failure::Machine(machine::Failure::Engine(EngineFailure::HeldUp { .. }))
                )
            },
            words: &["the computer was held up", "x:"],
            within: span + PERIOD * 4,
            // By itself, long before.
            rest: PERIOD * 4 + STOPPING,
        };
        let played = check(scene, &wanted);
        assert!(played.seen().has_stalled());
    }
}

#[test]
fn set_points_that_the_port_does_not_take_stop_the_drive() {
    let wanted = Wanted {
        cause: |it| {
            matches!(
                it,
                Failure::Machine(machine::Failure::Engine(EngineFailure::NotSent { .. }))
            )
        },
        words: &["x:", "txqueuelen", "before their SYNC"],
        within: PERIOD * 2,
        rest: PERIOD * 4 + STOPPING,
    };
    // Not even the quick stop gets out: the drive stops when no SYNC comes any more.
    let played = check(following().full(0x201), &wanted);
    assert!(played.seen().refused > 0);
}

#[test]
fn a_drive_whose_controller_is_killed_stops_by_itself() {
    let played = following().killed().play();
    assert!(matches!(
        played.result,
        Err(Failure::Machine(machine::Failure::Interrupted))
    ));
    let last = played.seen().sent.last().map(|(at, _)| *at).unwrap();
    assert!(last <= played.due);
    // Two and a half periods without SYNC, then its own quick stop.
    played.is_safe(PERIOD * 4 + STOPPING);
}

/// A machine whose axis is under way to `target` at 5 mm/s, and nobody waits for it.
fn under_way(target: Metres) -> Bench {
    let slow = |text: String| {
        cyclic(shortened(text)).edit("\nspeed_mm_per_s = 200.0", "\nspeed_mm_per_s = 5.0")
    };
    let seen = Rc::new(RefCell::new(Testimony::default()));
    let witness = Rc::clone(&seen);
    let wrap = |inner| Box::new(Witnessed::new(inner, witness)) as Box<_>;
    let mut bench = Bench::wrapped(1, slow, |text| text, wrap);
    let machine = &mut bench.machine;
    machine.start().unwrap();
    machine.linear("x").unwrap().zero(&bench.store).unwrap();
    let request = machine.stop_request();
    let soon = machine.now() + Duration::from_millis(300);
    seen.borrow_mut()
        .plan(soon, Box::new(move |_| request.stop()));
    let moved = machine.linear("x").unwrap().move_to(target);
    assert!(
        matches!(moved, Err(Failure::Machine(machine::Failure::Interrupted))),
        "{moved:?}"
    );
    machine.share_stop_request(&StopRequest::default());
    bench
}

#[test]
fn an_axis_that_still_moves_is_waited_for() {
    let mut bench = under_way(Metres::from_mm(8.0));
    let begun = bench.machine.now();
    assert_eq!(follow(&mut bench.machine).unwrap(), Cause::PathDone);
    // 8 mm at 5 mm/s less 0.3 s, then four seconds of path.
    let took = bench.machine.now() - begun;
    assert!(took > Duration::from_secs(5), "{took:?}");
    // And at once again, from where the path ended.
    assert_eq!(follow(&mut bench.machine).unwrap(), Cause::PathDone);
}

#[test]
fn an_axis_that_never_rests_is_named_and_nothing_is_begun() {
    let mut bench = under_way(Metres::from_mm(60.0));
    let failure = follow(&mut bench.machine).unwrap_err();
    let EngineFailure::NotAtRest { axis, waited } = (match &failure {
        Failure::Machine(machine::Failure::Engine(failure)) => failure.clone(),
        other => panic!("{other}"),
    }) else {
        panic!("{failure}")
    };
    assert_eq!(axis, "x");
    assert!(waited >= Duration::from_secs(5), "{waited:?}");
    assert!(failure.to_string().contains("still moving"), "{failure}");
}
