//! The loop's decisions, period by period, in virtual time.

use core::time::Duration;

use compensator::apply::Alarm;
use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared, Time};

use super::account::{Command, Heard, Trouble};
use super::*;

const PERIOD: Duration = Duration::from_millis(2);
const T: f64 = 2e-3;
/// Speed and acceleration of the axes of these tests.
const SPEED: f64 = 0.2;
const ACCELERATION: f64 = 2.0;
const JERK: f64 = 100.0;

fn limits() -> AxisLimits {
    AxisLimits {
        min: Metres::from_mm(-10.0),
        max: Metres::from_mm(60.0),
        speed: MetresPerSecond(SPEED),
        move_speed: MetresPerSecond(SPEED),
        acceleration: MetresPerSecondSquared(ACCELERATION),
        jerk: MetresPerSecondCubed(JERK),
        deviation: Metres::from_um(50.0),
    }
}

/// An engine of two axes whose drives are as many periods behind as drives are.
struct Bench {
    engine: Engine,
    desk: Desk,
    now: Time,
    sent: Vec<PerAxis<Metres>>,
    /// Axes that do not answer.
    deaf: PerAxis<bool>,
    /// Added to what an axis shows.
    astray: PerAxis<Metres>,
}

impl Bench {
    fn new() -> Self {
        Self::with(Box::new(NoCorrection))
    }

    fn with(correction: Box<dyn Correction>) -> Self {
        Self::of(limits(), correction)
    }

    /// Whose moves are a tenth as fast as its paths may be.
    fn slow() -> Self {
        let move_speed = MetresPerSecond(0.1 * SPEED);
        let limits = AxisLimits {
            move_speed,
            ..limits()
        };
        Self::of(limits, Box::new(NoCorrection))
    }

    fn of(limits: AxisLimits, correction: Box<dyn Correction>) -> Self {
        let of_correction = [CorrectionLimits {
            size: Metres::from_um(30.0),
            rate: MetresPerSecond(1e-3),
        }; AXES_MAX];
        let names = ["x", "y"].map(str::to_owned).to_vec();
        let limits = [limits; AXES_MAX];
        let (mut engine, desk) =
            Engine::assemble(names, PERIOD, limits, &of_correction, correction);
        engine.core.begin([Metres::ZERO; AXES_MAX]);
        Self {
            engine,
            desk,
            now: Time::ZERO,
            sent: vec![[Metres::ZERO; AXES_MAX]; 2],
            deaf: [false; AXES_MAX],
            astray: [Metres::ZERO; AXES_MAX],
        }
    }

    /// The drives answer where they were sent two periods ago.
    fn heard(&self) -> PerAxis<Option<Metres>> {
        let shown = self.sent[self.sent.len() - 2];
        core::array::from_fn(|axis| (!self.deaf[axis]).then_some(shown[axis] + self.astray[axis]))
    }

    fn period(&mut self) -> Result<(), Trouble> {
        self.now += PERIOD;
        let heard = Heard {
            now: self.now,
            actual: self.heard(),
            channels: &[],
            temperatures: &[],
            spots: &[],
        };
        let set_point = self.engine.core.step(&heard)?;
        self.sent.push(set_point);
        Ok(())
    }

    fn periods(&mut self, count: usize) {
        for _ in 0..count {
            self.period().unwrap();
        }
    }

    #[track_caller]
    fn until_rest(&mut self) -> Cause {
        for _ in 0..20_000 {
            self.period().unwrap();
            self.desk.live();
            if let Some(cause) = self.engine.core.ended() {
                return cause;
            }
        }
        panic!("never at rest: {:?}", self.engine.state());
    }

    fn last(&self, axis: usize) -> Metres {
        self.sent[self.sent.len() - 1][axis]
    }

    /// The greatest speed, acceleration and jerk of all set-points, by differences.
    fn greatest(&self, axis: usize) -> (f64, f64, f64) {
        let differences = |values: &[f64]| -> Vec<f64> {
            values.windows(2).map(|it| (it[1] - it[0]) / T).collect()
        };
        let greatest = |values: &[f64]| values.iter().fold(0.0, |most: f64, it| most.max(it.abs()));
        let positions: Vec<f64> = self.sent.iter().map(|it| it[axis].value()).collect();
        let speeds = differences(&positions);
        let accelerations = differences(&speeds);
        let jerks = differences(&accelerations);
        (
            greatest(&speeds),
            greatest(&accelerations),
            greatest(&jerks),
        )
    }

    /// What a drive sees never exceeds the limits.
    #[track_caller]
    fn check_smooth(&self) {
        for axis in 0..2 {
            let (speed, acceleration, jerk) = self.greatest(axis);
            assert!(speed <= SPEED * 1.02, "axis {axis}: {speed} m/s");
            assert!(
                acceleration <= ACCELERATION * 1.02,
                "axis {axis}: {acceleration} m/s²"
            );
            assert!(jerk <= JERK * 1.02, "axis {axis}: {jerk} m/s³");
        }
    }
}

fn mm(x: f64, y: f64) -> [Metres; 2] {
    [Metres::from_mm(x), Metres::from_mm(y)]
}

/// A circle of 20 mm, begun and ended slowly: the angle runs as the integral of sin².
fn circle(periods: u32) -> impl Iterator<Item = [Metres; 2]> {
    use std::f64::consts::TAU;
    (0..=periods).map(move |at| {
        let u = f64::from(at) / f64::from(periods);
        let angle = TAU * u - (TAU * u).sin();
        mm(20.0 - 10.0 * angle.cos(), 20.0 + 10.0 * angle.sin())
    })
}

/// A watcher who comes by once in a while finds what is, the end included; one who follows misses
/// only what came after his line was full.
#[test]
fn who_looks_seldom_sees_the_newest_period() {
    let mut bench = Bench::new();
    bench.periods(2 * QUEUE_LIVE);
    assert_eq!(bench.desk.live().map(|it| it.at), Some(bench.now));
    assert!(bench.desk.next_live().is_none());
    bench.periods(1);
    let next = bench.desk.next_live();
    assert_eq!(next.map(|it| it.at), Some(bench.now));
    bench.desk.move_to(&[Metres::from_mm(50.0); 2]).unwrap();
    bench.periods(2 * QUEUE_LIVE);
    bench.desk.stop().unwrap();
    while bench.engine.core.ended().is_none() {
        bench.period().unwrap();
    }
    let last = bench.desk.live().map(|it| it.state);
    assert_eq!(last, Some(State::Stopped(Cause::Asked)));
}

#[test]
fn a_path_is_approached_followed_to_the_point_and_ends_at_rest() {
    let mut bench = Bench::new();
    let points: Vec<_> = circle(480).collect();
    for point in &points {
        bench.desk.path.push(point).unwrap();
    }
    bench.desk.path.finish().unwrap();
    assert_eq!(bench.until_rest(), Cause::PathDone);
    bench.check_smooth();
    let begin = bench
        .sent
        .iter()
        .position(|it| it[..2] == points[0])
        .unwrap();
    let driven: Vec<_> = bench.sent[begin..]
        .iter()
        .map(|it| [it[0], it[1]])
        .collect();
    // Every point, once, in order.
    let mut at = 0;
    for point in &points {
        at += driven[at..]
            .iter()
            .position(|it| it == point)
            .expect("no point is left out");
    }
    assert_eq!(
        bench.desk.live().unwrap().state,
        State::Stopped(Cause::PathDone)
    );
    assert_eq!(bench.desk.path.push(&points[0]), Err(PushError::Finished));
}

#[test]
fn a_queue_that_runs_dry_stops_all_axes_together_within_their_limits() {
    let mut bench = Bench::new();
    for point in circle(480).take(240) {
        bench.desk.path.push(&point).unwrap();
    }
    assert_eq!(bench.until_rest(), Cause::RanDry);
    bench.check_smooth();
    let (x, y) = (bench.last(0), bench.last(1));
    bench.periods(5);
    assert_eq!((bench.last(0), bench.last(1)), (x, y));
}

#[test]
fn a_stop_that_is_asked_for_drops_what_waits() {
    let mut bench = Bench::new();
    circle(480).for_each(|point| bench.desk.path.push(&point).unwrap());
    bench.periods(200);
    while bench.engine.state() != State::Following {
        bench.periods(1);
    }
    bench.periods(100);
    assert!(bench.desk.path.room() < 512);
    bench.desk.stop().unwrap();
    assert_eq!(bench.until_rest(), Cause::Asked);
    assert_eq!(bench.desk.path.room(), 512, "the queue is empty");
    bench.check_smooth();
}

#[test]
fn an_overrun_stops_and_replays_nothing() {
    let mut bench = Bench::new();
    circle(480).for_each(|point| bench.desk.path.push(&point).unwrap());
    while bench.engine.state() != State::Following {
        bench.periods(1);
    }
    bench.periods(200);
    bench.engine.core.overrun(3).unwrap();
    assert_eq!(bench.until_rest(), Cause::Overrun { periods: 3 });
    bench.check_smooth();
    assert_eq!(bench.desk.path.room(), 512);
}

#[test]
fn whoever_writes_may_die() {
    let mut bench = Bench::new();
    circle(480)
        .take(200)
        .for_each(|point| bench.desk.path.push(&point).unwrap());
    let other = Bench::new();
    drop(core::mem::replace(&mut bench.desk, other.desk));
    assert_eq!(bench.until_rest(), Cause::HostGone);
    bench.check_smooth();
    let mut waiting = Bench::new();
    drop(core::mem::replace(&mut waiting.desk, Bench::new().desk));
    waiting.period().unwrap();
    assert_eq!(waiting.engine.core.ended(), Some(Cause::HostGone));
}

#[test]
fn moves_are_planned_anew_on_the_fly_without_a_step() {
    let mut bench = Bench::new();
    bench.desk.move_to(&mm(50.0, 5.0)).unwrap();
    bench.periods(120);
    bench.desk.move_to(&mm(-5.0, 30.0)).unwrap();
    bench.periods(700);
    assert_eq!(bench.engine.state(), State::Holding);
    assert_eq!([bench.last(0), bench.last(1)], mm(-5.0, 30.0));
    bench.check_smooth();
    let (speed, acceleration, _) = bench.greatest(0);
    assert!(
        speed > 0.98 * SPEED && acceleration > 0.98 * ACCELERATION,
        "time-optimal"
    );
    let error = bench.desk.move_to(&mm(0.0, 60.001)).unwrap_err();
    assert!(error.to_string().contains("60.001"), "{error}");
}

/// The greatest speed of the set-points of axis 0 from `begin` to `end`, by differences.
fn greatest_speed(bench: &Bench, begin: usize, end: usize) -> f64 {
    let sent = bench.sent[begin..end].windows(2);
    let speeds = sent.map(|pair| (pair[1][0] - pair[0][0]).value().abs() / T);
    speeds.fold(0.0, f64::max)
}

#[test]
fn moves_and_run_ups_keep_the_speed_of_moves() {
    let mut bench = Bench::slow();
    bench.desk.move_to(&mm(20.0, 0.0)).unwrap();
    bench.periods(800);
    assert_eq!(bench.last(0), Metres::from_mm(20.0));
    circle(480).for_each(|point| bench.desk.path.push(&point).unwrap());
    bench.desk.path.finish().unwrap();
    while bench.engine.state() != State::Following {
        bench.periods(1);
    }
    let begun = bench.sent.len();
    assert_eq!(bench.until_rest(), Cause::PathDone);
    bench.check_smooth();
    let moved = greatest_speed(&bench, 0, begun);
    assert!((0.098..=0.1001).contains(&(moved / SPEED)), "{moved} m/s");
    let driven = greatest_speed(&bench, begun, bench.sent.len());
    assert!(driven > 0.5 * SPEED, "a path is faster: {driven} m/s");
}

#[test]
fn a_move_off_a_faster_path_stops_first() {
    let mut bench = Bench::slow();
    circle(480).for_each(|point| bench.desk.path.push(&point).unwrap());
    while bench.engine.state() != State::Following {
        bench.periods(1);
    }
    bench.periods(200);
    let begun = bench.sent.len();
    bench.desk.move_to(&mm(0.0, 0.0)).unwrap();
    bench.periods(1500);
    bench.check_smooth();
    assert_eq!([bench.last(0), bench.last(1)], mm(0.0, 0.0));
    assert!(greatest_speed(&bench, begun, begun + 10) > 0.5 * SPEED);
    let moved = greatest_speed(&bench, begun + 150, bench.sent.len());
    assert!(moved <= 0.1001 * SPEED, "{moved} m/s");
}

#[test]
fn a_move_keeps_the_speed_that_is_asked_for_along_its_line() {
    let mut bench = Bench::slow();
    let speed = MetresPerSecond(0.05 * SPEED);
    bench
        .desk
        .move_within(&mm(20.0, 20.0), Some(speed))
        .unwrap();
    bench.periods(1500);
    assert_eq!([bench.last(0), bench.last(1)], mm(20.0, 20.0));
    let each = greatest_speed(&bench, 0, bench.sent.len());
    let along = each * core::f64::consts::SQRT_2;
    assert!((0.049..=0.0501).contains(&(along / SPEED)), "{along} m/s");
    // The next one that names none is as fast as moves are.
    bench.desk.move_to(&mm(0.0, 20.0)).unwrap();
    let begun = bench.sent.len();
    bench.periods(800);
    let moved = greatest_speed(&bench, begun, bench.sent.len());
    assert!((0.098..=0.1001).contains(&(moved / SPEED)), "{moved} m/s");
}

#[test]
fn a_move_from_rest_is_a_straight_line() {
    let mut bench = Bench::new();
    bench.desk.move_to(&mm(40.0, 10.0)).unwrap();
    bench.periods(400);
    for set_point in &bench.sent {
        let off = set_point[0].value() - 4.0 * set_point[1].value();
        assert!(off.abs() < 1e-9, "{off}");
    }
}

#[test]
fn a_move_puts_an_end_to_a_path_and_its_rest_is_never_driven() {
    let mut bench = Bench::new();
    let points: Vec<_> = circle(480).collect();
    points[..300]
        .iter()
        .for_each(|point| bench.desk.path.push(point).unwrap());
    while bench.engine.state() != State::Following {
        bench.periods(1);
    }
    bench.periods(100);
    bench.desk.move_to(&mm(0.0, 0.0)).unwrap();
    bench.periods(10);
    points[300..]
        .iter()
        .for_each(|point| bench.desk.path.push(point).unwrap());
    bench.periods(600);
    assert_eq!(bench.engine.state(), State::Holding);
    assert_eq!([bench.last(0), bench.last(1)], mm(0.0, 0.0));
    bench.check_smooth();
}

/// From 10 to 15 mm, from rest to rest.
fn line(periods: u32) -> impl Iterator<Item = [Metres; 2]> {
    use std::f64::consts::TAU;
    (0..=periods).map(move |at| {
        let u = f64::from(at) / f64::from(periods);
        mm(10.0 + 5.0 * (u - (TAU * u).sin() / TAU), 20.0)
    })
}

#[test]
fn another_path_follows_the_first_and_one_that_was_stopped() {
    let mut bench = Bench::new();
    let go = |bench: &mut Bench| {
        line(200).for_each(|point| bench.desk.path.push(&point).unwrap());
        bench.desk.path.finish().unwrap();
    };
    let again = |bench: &mut Bench| {
        let here = bench.sent[bench.sent.len() - 1];
        bench.engine.core.begin(here);
        here
    };
    go(&mut bench);
    bench.desk.path.begin().unwrap();
    go(&mut bench);
    for _ in 0..2 {
        assert_eq!(bench.until_rest(), Cause::PathDone);
        // A stop from the last point, which is one of no time.
        let off = (bench.last(0) - Metres::from_mm(15.0)).abs();
        assert!(off < Metres(1e-10), "{off}");
        again(&mut bench);
    }
    // One that is stopped: what its writer still writes of it is not driven, and said.
    bench.desk.path.begin().unwrap();
    for point in line(200).take(100) {
        bench.desk.path.push(&point).unwrap();
    }
    assert_eq!(bench.until_rest(), Cause::RanDry);
    let stopped = again(&mut bench);
    for point in line(200).skip(100) {
        bench.desk.path.push(&point).unwrap();
    }
    bench.desk.path.finish().unwrap();
    assert_eq!(bench.until_rest(), Cause::GivenUp);
    assert_eq!(again(&mut bench), stopped);
    bench.desk.path.begin().unwrap();
    go(&mut bench);
    assert_eq!(bench.until_rest(), Cause::PathDone);
    bench.check_smooth();
}

#[test]
fn a_target_without_a_way_stops_the_axes() {
    let mut bench = Bench::new();
    bench.desk.move_to(&mm(50.0, 5.0)).unwrap();
    bench.periods(60);
    // Past the desk, which would have refused it.
    let mut beyond = [Metres::ZERO; AXES_MAX];
    beyond[1] = Metres::from_mm(99.0);
    bench.desk.order(Command::MoveTo(beyond, None)).unwrap();
    assert_eq!(bench.until_rest(), Cause::PathRefused { axis: 1 });
    bench.check_smooth();
    assert!(bench.last(0) < Metres::from_mm(40.0));
}

#[test]
fn one_lost_sample_is_held_and_three_are_not_safe() {
    let mut bench = Bench::new();
    bench.periods(3);
    bench.deaf[1] = true;
    bench.periods(2);
    bench.deaf[1] = false;
    bench.periods(1);
    assert_eq!(bench.engine.counts().missing, 2);
    bench.deaf[1] = true;
    bench.periods(2);
    assert_eq!(
        bench.period(),
        Err(Trouble::Missing {
            axis: 1,
            periods: 3
        })
    );
}

#[test]
fn an_axis_away_from_its_set_points_is_not_safe_at_the_second_sample() {
    let mut bench = Bench::new();
    bench.desk.move_to(&mm(50.0, 0.0)).unwrap();
    bench.periods(100);
    bench.astray[0] = Metres::from_um(49.0);
    bench.periods(20);
    bench.astray[0] = Metres::from_mm(-3.0);
    bench.periods(1);
    let trouble = bench.period().unwrap_err();
    let Trouble::Deviates {
        axis: 0,
        lag,
        limit,
    } = trouble
    else {
        panic!("{trouble:?}")
    };
    assert!(lag > limit && limit == Metres::from_um(50.0));
}

#[track_caller]
fn check_refused(points: impl IntoIterator<Item = [Metres; 2]>, what: &str) {
    let mut bench = Bench::new();
    for point in points {
        match bench.desk.path.push(&point) {
            Ok(()) => {}
            Err(PushError::Refused(error)) => {
                assert!(error.to_string().contains(what), "{error}");
                return;
            }
            Err(other) => panic!("{other}"),
        }
    }
    panic!("taken");
}

#[test]
fn a_point_that_cannot_be_driven_is_refused_with_its_place() {
    check_refused(
        [mm(61.0, 0.0)],
        "axis x: 61.000000 mm is outside the soft limits",
    );
    check_refused([mm(f64::NAN, 0.0)], "not a number");
    check_refused(
        [mm(0.0, 0.0), mm(0.0, 1.0)],
        "point 2 (at 0.0020 s), axis y: 500.000 mm/s, the limit is 200.000",
    );
    check_refused([mm(0.0, 0.0), mm(0.0, 0.3)], "mm/s²");
    check_refused([mm(0.0, 0.0), mm(0.0, 0.007)], "mm/s³");
    // Speeding up smoothly towards the limit: refused while a stop is still possible.
    let ramp = (0..2000).map(|at| {
        let t = f64::from(at) * T;
        mm(50.0 + 0.5 * 500.0 * t * t * (t / 0.2).min(1.0), 0.0)
    });
    check_refused(ramp, "a stop from here would end at");
}

#[test]
fn from_every_point_that_was_taken_a_stop_stays_within_the_limits() {
    let mut bench = Bench::new();
    let mut taken = 0;
    // A path that runs into its limit.
    for at in 0..500 {
        let t = f64::from(at) * T;
        let u = (t / 0.3).min(1.0);
        let x = 30.0 + 45.0 * (u * u * u - u * u * u * u / 2.0) + 150.0 * (t - 0.3).max(0.0);
        match bench.desk.path.push(&mm(x, 0.0)) {
            Ok(()) => taken += 1,
            Err(error) => {
                assert!(error.to_string().contains("stop from here"), "{error}");
                break;
            }
        }
    }
    assert!(taken > 50, "{taken}");
    assert_eq!(bench.until_rest(), Cause::RanDry);
    assert!(bench.last(0) <= Metres::from_mm(60.0) && bench.last(0) > Metres::from_mm(55.0));
}

/// Says what it is told.
struct Said(Corrected);

impl Correction for Said {
    fn correct(&mut self, _observed: &Observed<'_>) -> Corrected {
        self.0
    }
}

fn said(um: f64, validity: Validity) -> Box<dyn Correction> {
    let mut corrected = Corrected {
        validity,
        ..Corrected::default()
    };
    corrected.offset[0] = Metres::from_um(um);
    corrected.uncertainty[0] = Metres::from_um(0.3);
    Box::new(Said(corrected))
}

/// 1 mm/s over 2 ms.
const SLEW_UM: f64 = 2.0;

#[test]
fn a_correction_never_steps_the_set_point() {
    let mut bench = Bench::with(said(10.0, Validity::Valid));
    bench.periods(3);
    assert_eq!(bench.last(0), Metres::ZERO, "switched off");
    bench.desk.correct(true).unwrap();
    bench.periods(20);
    assert_eq!(bench.last(0), Metres::from_um(10.0));
    bench.desk.swap(said(-8.0, Validity::Valid)).unwrap();
    bench.periods(20);
    assert_eq!(bench.last(0), Metres::from_um(-8.0));
    bench.desk.swap(said(500.0, Validity::Valid)).unwrap();
    bench.periods(40);
    assert_eq!(bench.last(0), Metres::from_um(30.0), "the size is limited");
    let alarm = bench.desk.live().unwrap().alarms[0];
    assert!(matches!(alarm, Some(Alarm::Size { .. })), "{alarm:?}");
    bench.desk.swap(said(5.0, Validity::Hold)).unwrap();
    bench.periods(5);
    assert!(bench.last(0) <= Metres::from_um(30.0));
    bench.desk.swap(said(5.0, Validity::Valid)).unwrap();
    bench.periods(20);
    assert_eq!(bench.last(0), Metres::from_um(5.0));
    let live = bench.desk.live().unwrap();
    assert_eq!(live.uncertainty[0], Metres::from_um(0.3));
    assert!(live.corrected && live.offset[0] == Metres::from_um(5.0));
    bench.desk.swap(said(5.0, Validity::FadeOut)).unwrap();
    bench.periods(20);
    assert_eq!(bench.last(0), Metres::ZERO);
    let u = bench.desk.live().unwrap().uncertainty[0];
    assert!(u.value().is_nan(), "{u} of what nobody knows");
    for step in bench.sent.windows(2) {
        let um = (step[1][0] - step[0][0]).um().abs();
        assert!(um <= SLEW_UM + 1e-9, "{um} um in one period");
    }
    assert!(bench.engine.counts().corrections_limited > 0);
}

#[test]
fn a_correction_that_is_no_number_stops_the_machine() {
    let mut bench = Bench::with(said(10.0, Validity::Valid));
    bench.desk.correct(true).unwrap();
    bench.desk.move_to(&mm(20.0, 0.0)).unwrap();
    bench.periods(60);
    bench.desk.swap(said(f64::NAN, Validity::Valid)).unwrap();
    let cause = bench.until_rest();
    assert!(cause.to_string().contains("not a number"), "{cause}");
    let live = bench.desk.live().unwrap();
    assert_eq!(live.offset[0], Metres::from_um(10.0), "held meanwhile");
}

#[test]
fn a_pause_between_two_motions_is_not_worth_a_step() {
    let mut bench = Bench::with(said(25.0, Validity::Valid));
    bench.periods(3);
    for on in [true, false] {
        bench.now += Duration::from_secs(10);
        bench.engine.core.begin(bench.sent[bench.sent.len() - 1]);
        bench.desk.correct(on).unwrap();
        bench.periods(8);
        // Held up in the middle of it.
        bench.now += Duration::from_secs(1);
        bench.periods(20);
        let all = if on {
            Metres::from_um(25.0)
        } else {
            Metres::ZERO
        };
        assert_eq!(bench.last(0), all);
    }
    for step in bench.sent.windows(2) {
        let um = (step[1][0] - step[0][0]).um().abs();
        assert!(um <= SLEW_UM + 1e-9, "{um} um in one period");
    }
    assert_eq!(bench.engine.counts().corrections_limited, 0, "announced");
}

#[test]
fn a_correction_that_must_not_be_missing_stops_the_machine() {
    let mut bench = Bench::with(said(0.0, Validity::Stop("beam x blocked")));
    bench.periods(3);
    assert_eq!(bench.engine.state(), State::Holding, "switched off");
    bench.desk.correct(true).unwrap();
    bench.desk.move_to(&mm(20.0, 0.0)).unwrap();
    let cause = bench.until_rest();
    assert_eq!(
        cause.to_string(),
        "the correction failed: beam x blocked; all axes were stopped together"
    );
}

#[test]
fn a_correction_never_leads_out_of_the_soft_limits() {
    let mut bench = Bench::with(said(10.0, Validity::Valid));
    bench.desk.correct(true).unwrap();
    bench.desk.move_to(&mm(60.0, 0.0)).unwrap();
    bench.periods(500);
    assert_eq!(bench.last(0), Metres::from_mm(60.0));
    assert!(bench.engine.counts().clamped > 0);
}

#[test]
fn a_full_queue_says_so_and_takes_the_point_later() {
    let mut bench = Bench::new();
    let mut points = circle(2_000);
    let refused = points
        .find(|point| bench.desk.path.push(point).is_err())
        .unwrap();
    assert_eq!(bench.desk.path.push(&refused), Err(PushError::Full));
    while bench.engine.state() != State::Following {
        bench.periods(1);
    }
    bench.periods(1);
    assert_eq!(bench.desk.path.push(&refused), Ok(()));
    let error = bench.desk.path.push(&[Metres::ZERO]).unwrap_err();
    assert_eq!(
        error,
        PushError::WrongAxes {
            expected: 2,
            seen: 1
        }
    );
}

#[test]
fn a_path_is_written_as_there_is_room_and_finished_behind_its_last_point() {
    let mut bench = Bench::new();
    let mut points = circle(800).map(|point| point.to_vec());
    assert_eq!(bench.desk.path.write(&mut points), Ok(false));
    let mut written = false;
    for _ in 0..2_000 {
        bench.period().unwrap();
        written = bench.desk.path.write(&mut points).unwrap();
        if bench.engine.core.ended().is_some() {
            break;
        }
    }
    assert!(written);
    assert_eq!(bench.engine.core.ended(), Some(Cause::PathDone));
    assert_eq!(bench.desk.path.write(&mut points), Ok(true));
}

/// A program that was built without optimisation copies them again and again while it makes them, in threads
/// with a stack of 2 MB.
#[test]
fn an_engine_and_its_desk_are_small_enough_to_be_moved_about() {
    assert!(size_of::<super::Engine>() < 16_384);
    assert!(size_of::<super::Desk>() < 16_384);
}
