use core::num::NonZeroU32;
use core::time::Duration;

use proptest::prelude::*;
use units::{Celsius, Metres, MetresPerSecond, Radians, Time, Volts};

use super::*;
use crate::volumetric::function::{Function, Shape};
use crate::volumetric::{Axis, Point, Volume};

const UM: f64 = 1e-6;

fn um(um: f64) -> Metres {
    Metres::from_um(um)
}

fn ms(ms: u64) -> Time {
    Time::ZERO + Duration::from_millis(ms)
}

fn millis(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

#[track_caller]
fn check_um(seen: Metres, expected: f64) {
    assert!((seen.um() - expected).abs() < 1e-9, "{} um", seen.um());
}

fn detector(layout: Layout) -> BeamDetector {
    let curve = || RatioCurve::straight(Metres::from_mm(1.0), 0.8).unwrap();
    BeamDetector::new(BeamDetectorSettings {
        layout,
        dark: [Volts::ZERO; 4],
        gain: [1.0; 4],
        saturation: Volts(9.9),
        intensity_min: Volts(2.0),
        intensity_max: Volts(20.0),
        age_max: millis(10),
        speed_max: MetresPerSecond(1e-3),
        noise_max: um(5.0),
        stuck_samples: None,
        curves: [curve(), curve()],
    })
    .unwrap()
}

fn read(detector: &mut BeamDetector, at: u64, channels: [f64; 4]) -> Result<[Metres; 2], Trouble> {
    let sample = Sample {
        channels: channels.map(Volts),
        at: ms(at),
    };
    detector.read(ms(at), Some(&sample))
}

/// Lateral: (3 − 1)/4 = 1/2 and 0. Quadrants 1, 2, 3, 4: (1 + 4 − 2 − 3)/10 = 0,
/// (1 + 2 − 3 − 4)/10 = −2/5. One is a millimetre.
#[test]
fn the_place_is_the_calibrated_ratio_of_the_channels() {
    let seen = read(&mut detector(Layout::Lateral), 0, [3.0, 1.0, 2.0, 2.0]).unwrap();
    check_um(seen[0], 500.0);
    check_um(seen[1], 0.0);
    let seen = read(&mut detector(Layout::Quadrants), 0, [1.0, 2.0, 3.0, 4.0]).unwrap();
    check_um(seen[0], 0.0);
    check_um(seen[1], -400.0);
}

/// Ratios 0.9 and 0 of a field up to 0.8; two thirds of the light taken away; a channel at its rail.
#[test]
fn whoever_adjusts_a_beam_sees_the_light_and_which_way_to_go() {
    let detector = detector(Layout::Lateral);
    for (low, high) in detector.field() {
        check_um(low, -800.0);
        check_um(high, 800.0);
    }
    assert_eq!(detector.middle(), [um(0.0); 2]);
    let look = |channels: [f64; 4]| detector.look(&channels.map(Volts));
    let good = look([3.0, 1.0, 2.0, 2.0]);
    assert_eq!(good.light, Volts(8.0));
    assert_eq!(good.place.ok(), good.nearest);
    let beside = look([3.8, 0.2, 2.0, 2.0]);
    assert!(matches!(beside.place, Err(Trouble::Beside { .. })));
    check_um(beside.nearest.unwrap()[0], 800.0);
    check_um(beside.nearest.unwrap()[1], 0.0);
    let blocked = look([0.3, 0.1, 0.2, 0.2]);
    assert!(matches!(blocked.place, Err(Trouble::Blocked { .. })));
    assert_eq!(blocked.nearest, None, "noise has no place");
    let bright = look([9.95, 5.0, 7.0, 7.0]);
    assert!(matches!(bright.place, Err(Trouble::Saturated { .. })));
    assert!(bright.nearest.unwrap()[0] > Metres::ZERO);
    assert_eq!(look([f64::NAN; 4]).nearest, None);
}

/// Dark 0.5 V everywhere, the first channel half as sensitive: (2·1.5 − 1)/4 = 1/2 again.
#[test]
fn dark_values_and_gains_are_taken_out_and_intensity_does_not_matter() {
    let mut settings = detector(Layout::Lateral).settings();
    settings.dark = [Volts(0.5); 4];
    settings.gain = [2.0, 1.0, 1.0, 1.0];
    let mut detector = BeamDetector::new(settings).unwrap();
    let dim = read(&mut detector, 0, [2.0, 1.5, 2.5, 2.5]).unwrap();
    let bright = read(&mut detector, 1, [3.5, 2.5, 4.5, 4.5]).unwrap();
    check_um(dim[0], 500.0);
    check_um(bright[0], 500.0);
}

#[test]
fn every_trouble_of_a_beam_is_told_from_the_others() {
    let fresh = || detector(Layout::Lateral);
    let seen = read(&mut fresh(), 0, [0.4, 0.4, 0.5, 0.5]);
    assert!(matches!(seen, Err(Trouble::Blocked { .. })), "{seen:?}");
    // One pair in the dark alone is no beam either.
    let seen = read(&mut fresh(), 0, [0.1, 0.1, 3.0, 3.0]);
    assert!(matches!(seen, Err(Trouble::Blocked { .. })), "{seen:?}");
    let seen = read(&mut fresh(), 0, [9.95, 3.0, 3.0, 3.0]);
    assert!(matches!(seen, Err(Trouble::Saturated { .. })), "{seen:?}");
    let seen = read(&mut fresh(), 0, [9.0, 9.0, 9.0, 9.0]);
    assert!(matches!(seen, Err(Trouble::Saturated { .. })), "{seen:?}");
    let seen = read(&mut fresh(), 0, [9.0, 0.1, 3.0, 3.0]);
    assert!(matches!(seen, Err(Trouble::Beside { .. })), "{seen:?}");
    let seen = read(&mut fresh(), 0, [f64::NAN, 1.0, 3.0, 3.0]);
    assert!(matches!(seen, Err(Trouble::Implausible { .. })), "{seen:?}");
    let sample = Sample {
        channels: [Volts(2.0); 4],
        at: ms(0),
    };
    let seen = fresh().read(ms(11), Some(&sample));
    let limit = millis(10);
    assert_eq!(
        seen,
        Err(Trouble::Stale {
            seen: millis(11),
            limit
        })
    );
    let seen = fresh().read(ms(11), None);
    assert!(matches!(seen, Err(Trouble::Stale { .. })), "{seen:?}");
}

/// 1 mm/s and 5 µm of noise: after 10 ms 15 µm are possible, after 0.5 s 505 µm.
#[test]
fn a_place_that_nothing_can_reach_in_the_time_is_a_jump_until_the_time_has_passed() {
    let mut detector = detector(Layout::Lateral);
    read(&mut detector, 0, [2.0; 4]).unwrap();
    let near = read(&mut detector, 10, [2.02, 1.98, 2.0, 2.0]).unwrap();
    check_um(near[0], 10.0);
    let far = read(&mut detector, 20, [2.1, 1.9, 2.0, 2.0]);
    assert!(matches!(far, Err(Trouble::Jumped { .. })), "{far:?}");
    let later = read(&mut detector, 60, [2.1, 1.9, 2.0, 2.0]).unwrap();
    check_um(later[0], 50.0);
}

/// The others tremble on; the same sample read again is no further one.
#[test]
fn a_channel_that_gives_exactly_the_same_again_and_again_is_stuck_until_it_changes() {
    let mut settings = detector(Layout::Lateral).settings();
    settings.stuck_samples = NonZeroU32::new(4);
    let mut detector = BeamDetector::new(settings).unwrap();
    let trembling = |at: u64| 2.0 + if at.is_multiple_of(2) { 1e-4 } else { -1e-4 };
    let mut sample = |at: u64, third: f64| {
        let other = trembling(at);
        let channels = [other, -other + 4.0, third, other];
        for _ in 0..10 {
            read(&mut detector, at, channels).ok();
        }
        read(&mut detector, at, channels)
    };
    for at in 0..3 {
        sample(at, 2.0).unwrap();
    }
    for at in 3..6 {
        let seen = sample(at, 2.0);
        let Err(trouble @ Trouble::Stuck { input: 2, .. }) = seen else {
            panic!("{seen:?}")
        };
        let text = "its input 3 is stuck: exactly 2e0 (SI units) 4 times in a row";
        assert_eq!(trouble.to_string(), text);
    }
    sample(6, 2.0001).unwrap();
    // Darkness stands still as well, and says more.
    for at in 7..20 {
        let seen = read(&mut detector, at, [0.0; 4]);
        assert!(matches!(seen, Err(Trouble::Blocked { .. })), "{seen:?}");
    }
}

#[test]
fn a_detector_without_an_intensity_window_is_refused() {
    let mut settings = detector(Layout::Lateral).settings();
    settings.intensity_max = settings.intensity_min;
    let seen = BeamDetector::new(settings).map(|_| ());
    assert!(
        matches!(seen, Err(SettingsError::Intensity { .. })),
        "{seen:?}"
    );
}

#[test]
fn a_temperature_that_cannot_be_is_not_believed() {
    let mut channel = TemperatureChannel::new(TemperatureSettings {
        low: Celsius(10.0),
        high: Celsius(40.0),
        rate_max: 0.1,
        noise_max: 0.05,
        age_max: Duration::from_secs(2),
        stuck_samples: NonZeroU32::new(3),
    });
    let at = |seconds: u64, value: f64| Some((ms(1000 * seconds), Celsius(value)));
    assert_eq!(channel.read(ms(0), at(0, 20.0)), Ok(Celsius(20.0)));
    assert_eq!(channel.read(ms(1000), at(1, 20.1)), Ok(Celsius(20.1)));
    let jump = channel.read(ms(2000), at(2, 21.0));
    assert!(matches!(jump, Err(Trouble::Jumped { .. })), "{jump:?}");
    let broken = channel.read(ms(3000), at(3, -273.0));
    assert!(
        matches!(broken, Err(Trouble::Implausible { .. })),
        "{broken:?}"
    );
    let nan = channel.read(ms(3000), at(3, f64::NAN));
    assert!(matches!(nan, Err(Trouble::Implausible { .. })), "{nan:?}");
    for second in 4..6 {
        let again = channel.read(ms(1000 * second), at(second, 20.1));
        assert_eq!(again, Ok(Celsius(20.1)));
    }
    let stuck = channel.read(ms(6000), at(6, 20.1));
    assert!(matches!(stuck, Err(Trouble::Stuck { .. })), "{stuck:?}");
    let old = channel.read(ms(9000), at(3, 20.1));
    assert!(matches!(old, Err(Trouble::Stale { .. })), "{old:?}");
}

fn line(from: f64, to: f64) -> Function<Metres> {
    Function::new(
        &[Metres(0.0), Metres(1.0)],
        &[um(from), um(to)],
        Shape::Linear,
    )
    .unwrap()
}

/// Reference at 0.25 m: 1 µm and 20 µm. Read 4 and 18: D = 3 and −2. The beam has moved by
/// 8 and −4 µm at the end: a quarter of it at a quarter of the way, all of it when it translates.
#[test]
fn a_displacement_is_reading_less_reference_plus_the_beams_own_share() {
    let reference = |drift| {
        BeamReference::new(
            [line(0.0, 4.0), line(20.0, 20.0)],
            [um(2.0), um(1.0)],
            drift,
        )
    };
    let displacement = |drift| {
        let reference = reference(drift).unwrap();
        let shift = reference.beam_shift([um(10.0), um(-3.0)]);
        reference.displacement(Metres(0.25), [um(4.0), um(18.0)], shift)
    };
    let (source, end) = (Metres(0.0), Metres(1.0));
    let pivoting = displacement(BeamDrift::Pivoting { source, end });
    check_um(pivoting[0], 3.0 + 2.0);
    check_um(pivoting[1], -2.0 - 1.0);
    let translating = displacement(BeamDrift::Translating);
    check_um(translating[0], 3.0 + 8.0);
    check_um(translating[1], -2.0 - 4.0);
    let translation = 0.5;
    let mixed = displacement(BeamDrift::Mixed {
        source,
        end,
        translation,
    });
    check_um(mixed[0], 3.0 + 5.0);
    let nowhere = reference(BeamDrift::Pivoting {
        source,
        end: source,
    })
    .map(|_| ());
    assert_eq!(
        nowhere,
        Err(DriftError::NoLength {
            beam: source,
            end: source
        })
    );
    let share = reference(BeamDrift::Mixed {
        source,
        end,
        translation: 1.5,
    })
    .map(|_| ());
    assert_eq!(share, Err(DriftError::Share { seen: 1.5 }));
}

/// D_y(x) 16, D_z(x) 32, D_x(y) 1, D_z(y) 2, D_x(z) 4, D_y(z) 8: E = (5, 24, 34) µm.
#[test]
fn errors_are_the_patents_sums_and_influences_weigh_them() {
    let state = MovingState {
        sideways: [[um(16.0), um(32.0)], [um(1.0), um(2.0)], [um(4.0), um(8.0)]],
        roll: [Radians::ZERO; 3],
    };
    let at = Point::from_mm(500.0, 500.0, 0.0);
    let mut influences = Influences::default();
    let plain = influences.errors(at, &state);
    check_um(plain.x, 5.0);
    check_um(plain.y, 24.0);
    check_um(plain.z, 34.0);
    // F_xy falls from 1 to 0 along y and doubles along x up to 1 m: 1/2 · 3/2 at half-way.
    let fall = Function::new(
        &[Metres(0.0), Metres(1.0)],
        &[Metres(1.0), Metres(0.0)],
        Shape::Linear,
    );
    let rise = Function::new(
        &[Metres(0.0), Metres(1.0)],
        &[Metres(1.0), Metres(2.0)],
        Shape::Linear,
    );
    influences.of[1][0].along = [Some(rise.unwrap()), Some(fall.unwrap()), None];
    check_um(influences.errors(at, &state).x, 4.0 + 0.75);
}

/// h = 10 mm, L = 100 mm, φ = 45°: tan α = 0.01 belongs to X = −0.8 mm, because
/// 80·10⁻⁴ + (X − 80)·0.01 − X = 0; then y₁ + y₂ = (0.2 + 0.8)/0.99 mm.
#[test]
fn the_roll_of_a_hand_worked_case_is_met() {
    let optics = RollOptics::new(
        Metres::from_mm(10.0),
        Metres::from_mm(100.0),
        Radians::from_degrees(45.0),
        Radians(0.05),
    )
    .unwrap();
    let roll = optics
        .solve(Metres::from_mm(-0.5), Metres::from_mm(-0.3))
        .unwrap();
    assert!((roll.angle.value().tan() - 0.01).abs() < 1e-15);
    assert!((roll.first.mm() - 0.6 / 0.99).abs() < 1e-12);
    assert!((roll.second.mm() - 0.4 / 0.99).abs() < 1e-12);
    assert_eq!(
        optics.solve(Metres(0.0), Metres(0.0)).unwrap(),
        Roll::default()
    );
    let wild = optics.solve(Metres::from_mm(50.0), Metres::from_mm(50.0));
    assert!(matches!(wild, Err(RollError::NoRoll { .. })), "{wild:?}");
    let nan = optics.solve(Metres(f64::NAN), Metres(0.0));
    assert!(matches!(nan, Err(RollError::NoRoll { .. })), "{nan:?}");
}

/// With 2h = L·tan φ every roll leaves the sum of the readings alone to first order.
#[test]
fn an_arrangement_that_cannot_see_a_roll_is_refused() {
    let seen = RollOptics::new(
        Metres::from_mm(50.0),
        Metres::from_mm(100.0),
        Radians::from_degrees(45.0),
        Radians(0.01),
    );
    assert!(matches!(seen, Err(RollError::Geometry { .. })), "{seen:?}");
}

fn settings(reaction: Reaction) -> FeedSettings {
    FeedSettings {
        patience: millis(2),
        reaction,
        blend: millis(10),
        confirm: 1,
        smoothing: Duration::ZERO,
        repeats: 1,
    }
}

fn feed(reaction: Reaction) -> Feed<Metres, 1> {
    Feed::new(settings(reaction))
}

const BLOCKED: Trouble = Trouble::Blocked {
    seen: Volts(0.0),
    limit: Volts(2.0),
};

/// 10 µm wanted at once, blended over 10 ms; then it follows without delay.
#[test]
fn a_detector_that_comes_is_blended_to_and_then_followed() {
    let mut feed = feed(Reaction::Hold);
    check_um(feed.advance(ms(0), Err(BLOCKED))[0], 0.0);
    assert_eq!(feed.status(), FeedStatus::Waiting(Some(BLOCKED)));
    check_um(feed.advance(ms(1), Ok([um(10.0)]))[0], 0.0);
    check_um(feed.advance(ms(6), Ok([um(10.0)]))[0], 5.0);
    check_um(feed.advance(ms(11), Ok([um(10.0)]))[0], 10.0);
    check_um(feed.advance(ms(12), Ok([um(11.0)]))[0], 11.0);
}

#[test]
fn a_blocked_beam_is_tolerated_and_then_held_faded_or_stops_the_machine() {
    for reaction in [Reaction::Hold, Reaction::FadeOut(millis(8)), Reaction::Stop] {
        let mut feed = feed(reaction);
        feed.advance(ms(0), Ok([um(8.0)]));
        feed.advance(ms(10), Ok([um(8.0)]));
        check_um(feed.advance(ms(11), Err(BLOCKED))[0], 8.0);
        assert_eq!(feed.status(), FeedStatus::Tolerated(BLOCKED));
        check_um(feed.advance(ms(13), Err(BLOCKED))[0], 8.0);
        let later = feed.advance(ms(17), Err(BLOCKED))[0];
        match reaction {
            Reaction::Hold => {
                assert_eq!(feed.status(), FeedStatus::Held(BLOCKED));
                check_um(later, 8.0);
            }
            Reaction::FadeOut(_) => {
                assert_eq!(feed.status(), FeedStatus::Faded(BLOCKED));
                check_um(later, 4.0);
                // It returns with another value while it still fades: from what was given last.
                check_um(feed.advance(ms(19), Ok([um(22.0)]))[0], 4.0);
                check_um(feed.advance(ms(24), Ok([um(22.0)]))[0], 13.0);
                check_um(feed.advance(ms(29), Ok([um(22.0)]))[0], 22.0);
            }
            Reaction::Stop => {
                assert_eq!(feed.status(), FeedStatus::Stop(BLOCKED));
                check_um(later, 8.0);
            }
        }
    }
}

/// Blocked from the beginning; what comes and goes before it is believed is trouble as well.
#[test]
fn a_detector_that_was_never_believed_is_not_waited_for_for_ever() {
    let cases = [
        (Reaction::Hold, FeedStatus::Waiting(Some(BLOCKED))),
        (Reaction::FadeOut(millis(8)), FeedStatus::Faded(BLOCKED)),
        (Reaction::Stop, FeedStatus::Stop(BLOCKED)),
    ];
    for (reaction, beyond) in cases {
        let mut feed = Feed::new(FeedSettings {
            confirm: 2,
            ..settings(reaction)
        });
        let mut check = |at: u64, seen, status| {
            check_um(feed.advance(ms(at), seen)[0], 0.0);
            assert_eq!(feed.status(), status);
        };
        check(5, Err(BLOCKED), FeedStatus::Waiting(Some(BLOCKED)));
        check(6, Ok([um(3.0)]), FeedStatus::Waiting(Some(BLOCKED)));
        check(7, Err(BLOCKED), beyond);
        check(8, Err(BLOCKED), beyond);
        check(9, Ok([um(3.0)]), beyond);
        check(10, Ok([um(3.0)]), FeedStatus::Good);
        check_um(feed.advance(ms(20), Ok([um(3.0)]))[0], 3.0);
    }
}

#[test]
fn a_feed_that_takes_over_goes_on_and_blends_to_what_it_wants() {
    let mut before = feed(Reaction::Hold);
    before.advance(ms(0), Ok([um(8.0)]));
    before.advance(ms(20), Ok([um(8.0)]));
    let mut after = feed(Reaction::Hold);
    after.take_over(&before);
    assert_eq!(after.status(), FeedStatus::Good);
    check_um(after.advance(ms(21), Ok([um(-2.0)]))[0], 8.0);
    check_um(after.advance(ms(26), Ok([um(-2.0)]))[0], 3.0);
    let mut shifted = feed(Reaction::Hold);
    shifted.take_over(&before);
    shifted.shift([um(100.0)]);
    check_um(shifted.advance(ms(21), Err(BLOCKED))[0], 108.0);
}

#[test]
fn a_reference_that_is_exchanged_is_blended_to() {
    let mut feed = feed(Reaction::Hold);
    feed.advance(ms(0), Ok([um(8.0)]));
    feed.advance(ms(20), Ok([um(8.0)]));
    feed.expect_jump();
    check_um(feed.advance(ms(21), Ok([um(-2.0)]))[0], 8.0);
    check_um(feed.advance(ms(26), Ok([um(-2.0)]))[0], 3.0);
    check_um(feed.advance(ms(31), Ok([um(-2.0)]))[0], -2.0);
}

#[test]
fn switching_off_fades_and_switching_on_blends() {
    let mut feed = feed(Reaction::Hold);
    feed.advance(ms(0), Ok([um(8.0)]));
    feed.advance(ms(20), Ok([um(8.0)]));
    feed.disable(ms(20), millis(4));
    assert_eq!(feed.status(), FeedStatus::Off);
    check_um(feed.advance(ms(22), Ok([um(8.0)]))[0], 4.0);
    check_um(feed.advance(ms(24), Ok([um(8.0)]))[0], 0.0);
    feed.enable();
    check_um(feed.advance(ms(30), Ok([um(8.0)]))[0], 0.0);
    check_um(feed.advance(ms(35), Ok([um(8.0)]))[0], 4.0);
}

/// A step of 6 um under a low pass of 100 ms: after one time constant 2.2 um are not there yet, and
/// that is said; noise of a tenth of a micrometre is next to nothing.
#[test]
fn what_smoothing_lags_behind_counts_and_noise_does_not() {
    let mut feed = Feed::<Metres, 1>::new(FeedSettings {
        blend: Duration::ZERO,
        smoothing: millis(100),
        ..settings(Reaction::Hold)
    });
    let noisy =
        |at: u64, value: f64| Ok([um(value + if at.is_multiple_of(2) { 0.1 } else { -0.1 })]);
    for at in 0..1000 {
        feed.advance(ms(at), noisy(at, 0.0));
    }
    assert!(feed.left() < um(0.02), "{}", feed.left());
    for at in 1000..1100 {
        feed.advance(ms(at), noisy(at, 6.0));
    }
    let behind = um(6.0) - feed.values()[0];
    assert!(
        behind > um(2.0) && feed.left() > behind * 0.9,
        "{behind} {}",
        feed.left()
    );
    for at in 1100..2500 {
        feed.advance(ms(at), noisy(at, 6.0));
    }
    assert!(feed.left() < um(0.02), "{}", feed.left());
}

/// Time constant 3 ms, samples each millisecond: a step of 8 µm is followed by a quarter of
/// what is left each time.
#[test]
fn noise_is_smoothed_and_confirmation_waited_for() {
    let mut feed = Feed::new(FeedSettings {
        patience: Duration::ZERO,
        reaction: Reaction::Hold,
        blend: Duration::ZERO,
        confirm: 2,
        smoothing: millis(3),
        repeats: 1,
    });
    check_um(feed.advance(ms(0), Ok([um(5.0)]))[0], 0.0);
    check_um(feed.advance(ms(1), Ok([um(0.0)]))[0], 0.0);
    assert_eq!(feed.status(), FeedStatus::Good);
    check_um(feed.advance(ms(2), Ok([um(8.0)]))[0], 2.0);
    check_um(feed.advance(ms(3), Ok([um(8.0)]))[0], 3.5);
    let nan = feed.advance(ms(4), Ok([Metres(f64::NAN)]))[0];
    check_um(nan, 3.5);
    assert!(matches!(feed.status(), FeedStatus::Held(_)));
}

fn recorder(spacing_mm: f64) -> StateRecorder {
    let volume = Volume::new(Point::ZERO, Point::from_mm(100.0, 100.0, 100.0)).unwrap();
    let settings = RecorderSettings {
        spacing: Metres::from_mm(spacing_mm),
        gap_max: Metres::from_mm(25.0),
    };
    StateRecorder::new(&volume, settings).unwrap()
}

/// A bow that was built in stays; what comes on top is the error.
#[test]
fn the_first_memory_keeps_what_was_built_in() {
    let bow = |x: f64| um(15.0 * 4.0 * x * (1.0 - x));
    let nodes: Vec<Metres> = (0..=20).map(|k| Metres(f64::from(k) / 20.0)).collect();
    let values: Vec<Metres> = nodes.iter().map(|x| bow(x.value())).collect();
    let function = Function::new(&nodes, &values, Shape::Spline).unwrap();
    let mut memories = Memories::default();
    let nothing = memories.error(Axis::X, Metres(0.5), [um(15.0), um(1.0)]);
    check_um(nothing[0], 15.0);
    let mut first = StateMap::default();
    first.of[0] = Some([function, line(0.0, 0.0)]);
    memories.first = Some(first);
    let error = memories.error(Axis::X, Metres(0.33), [bow(0.33) + um(2.0), um(1.0)]);
    check_um(error[0], 2.0);
    check_um(error[1], 1.0);
    check_um(
        memories.error(Axis::Y, Metres(0.33), [um(3.0), um(0.0)])[0],
        3.0,
    );
}

/// The first part was made while the slider strayed by 5 µm + 20 µm/m, of which 1 µm was
/// compensated and 2 µm are the first memory's.
#[test]
fn the_second_memory_keeps_what_the_first_part_was_made_with() {
    let mut recorder = recorder(5.0);
    let strayed = |x: f64| um(5.0 + 20.0 * x);
    for k in 0..=300 {
        let x = 0.1 * f64::from(k) / 300.0;
        let left = strayed(x) - um(1.0) - um(2.0);
        recorder.record(Axis::X, Metres(x), [left, um(-1.0)]);
    }
    recorder.record(Axis::X, Metres(0.05), [Metres(f64::NAN); 2]);
    recorder.record(Axis::X, Metres(7.0), [um(99.0); 2]);
    let (second, coverage) = recorder.finish().unwrap();
    let mut first = StateMap::default();
    first.of[0] = Some([line(2.0, 2.0), line(0.0, 0.0)]);
    let memories = Memories {
        first: Some(first),
        second: Some(second),
    };
    // Later parts: what is left is what was left of the first one, 1 µm less than strayed.
    let later = memories.error(Axis::X, Metres(0.0625), [strayed(0.0625), um(-1.0)]);
    check_um(later[0], 1.0);
    check_um(later[1], 0.0);
    let (from, to) = coverage[0].unwrap();
    assert!(from.mm() < 5.0 && to.mm() > 95.0);
    assert_eq!(coverage[1], None);
}

fn roll_of(arcsec: f64) -> Function<Radians> {
    let nodes = [Metres(0.0), Metres(0.1)];
    Function::new(&nodes, &[Radians::from_arcsec(arcsec); 2], Shape::Linear).unwrap()
}

/// 6 arcsec, of which the first memory keeps 2: a first part that is made with all of it is met again.
#[test]
fn memories_keep_the_roll_as_they_keep_displacements() {
    let arcsec = Radians::from_arcsec;
    let mut first = StateMap::default();
    first.roll[1] = Some(roll_of(2.0));
    let mut memories = Memories {
        first: Some(first),
        second: None,
    };
    let mut recorder = recorder(5.0);
    for k in 0..=100 {
        let at = Metres(0.1 * f64::from(k) / 100.0);
        let beyond = memories.roll_beyond_first(Axis::Y, at, arcsec(6.0));
        recorder.record_roll(Axis::Y, at, beyond);
    }
    let (second, covers) = recorder.finish().unwrap();
    assert!(
        covers[1].is_some() && second.of[1].is_none(),
        "the roll alone is a state"
    );
    memories.second = Some(second);
    let kept = memories.kept_roll(Axis::Y, Metres(0.04)).arcsec();
    assert!((kept - 6.0).abs() < 1e-9, "{kept}");
    assert_eq!(memories.kept_roll(Axis::X, Metres(0.04)), Radians::ZERO);
}

/// 1 arcsec of reference, 2 that are kept, 3 beyond: 3 are compensated, and the slide's detectors sit on 5.
#[test]
fn a_roll_is_compensated_beyond_what_is_kept_and_seen_whole() {
    let arcsec = Radians::from_arcsec;
    let mut first = StateMap::default();
    first.roll[0] = Some(roll_of(2.0));
    let memories = Memories {
        first: Some(first),
        second: None,
    };
    let check = |seen: Radians, expected: f64| {
        let seen = seen.arcsec();
        assert!(
            (seen - expected).abs() < 1e-9,
            "{seen}, expected {expected}"
        );
    };
    let feed = || Feed::new(settings(Reaction::FadeOut(millis(10))));
    let mut monitor = RollMonitor::new(Axis::X, roll_of(1.0), feed());
    let mut left = monitor.clone();
    left.leave(ms(0));
    let read = |monitor: &mut RollMonitor, at: u64, seen| {
        monitor.advance(ms(at), Metres(0.05), seen, &memories)
    };
    for at in 0..=20 {
        read(&mut monitor, at, Ok(arcsec(6.0)));
        read(&mut left, at, Ok(arcsec(6.0)));
    }
    check(read(&mut monitor, 21, Ok(arcsec(6.0))), 3.0);
    check(monitor.whole(), 5.0);
    check(monitor.uncompensated().unwrap(), 2.0);
    assert_eq!(monitor.status(), FeedStatus::Good);
    // Left as it is, and known all the same.
    check(read(&mut left, 21, Ok(arcsec(6.0))), 0.0);
    check(left.whole(), 5.0);
    check(left.uncompensated().unwrap(), 5.0);
    // Detectors that fail: what is kept is still taken to be there.
    for at in 22..60 {
        read(&mut monitor, at, Err(BLOCKED));
    }
    check(monitor.whole(), 2.0);
    assert_eq!(monitor.uncompensated(), None);
}

#[test]
fn a_first_part_that_left_a_stretch_out_or_was_never_made_is_refused() {
    assert_eq!(recorder(5.0).finish().map(|_| ()), Err(MemoryError::Empty));
    let mut recorder = recorder(5.0);
    for x in [0.001, 0.010, 0.060] {
        recorder.record(Axis::Y, Metres(x), [um(1.0); 2]);
    }
    let seen = recorder.finish().map(|_| ());
    assert!(
        matches!(seen, Err(MemoryError::Gap { axis: Axis::Y, .. })),
        "{seen:?}"
    );
    recorder.clear();
    recorder.record(Axis::Y, Metres(0.02), [um(3.0); 2]);
    let (map, _) = recorder.finish().unwrap();
    check_um(map.at(Axis::Y, Metres(0.08))[0], 3.0);
}

#[test]
fn an_offset_is_minus_the_deviation_within_its_limits() {
    let mut offset = Offset::new(OffsetLimits {
        size: um(10.0),
        rate: MetresPerSecond(1e-3),
        slope: 1e-3,
    });
    let deviation = Point::new(um(4.0), um(-4.0), um(30.0));
    offset.enable();
    let start = offset.advance(ms(0), Point::ZERO, deviation);
    assert_eq!(start, Point::ZERO);
    let soon = offset.advance(ms(1), Point::from_mm(1.0, 0.0, 0.0), deviation);
    check_um(soon.x, -2.0);
    check_um(soon.y, 2.0);
    let later = offset.advance(ms(50), Point::from_mm(1.0, 0.0, 0.0), deviation);
    check_um(later.x, -4.0);
    check_um(later.z, -10.0);
    assert!(matches!(offset.alarm(), Some((Axis::Z, _))));
    offset.disable();
    check_um(
        offset
            .advance(ms(51), Point::from_mm(1.0, 0.0, 0.0), deviation)
            .x,
        -3.0,
    );
}

proptest! {
    /// Forward by the equations as the patent prints them, back by the closed form.
    #[test]
    fn the_closed_form_undoes_the_patents_equations(
        t in -0.01_f64..0.01,
        share in -1.0_f64..1.0,
        h_mm in -30.0_f64..30.0,
        degrees in 20.0_f64..60.0,
    ) {
        let (h, base, f) = (h_mm * 1e-3, 0.1, degrees.to_radians().tan());
        prop_assume!((2.0 * h - base * f).abs() > 0.02);
        let sum = t * base / (1.0 - t * f);
        let y = [sum / 2.0 + share * 1e-4, sum / 2.0 - share * 1e-4];
        let x = y.map(|y| Metres(h * t - y * (f - t)));
        let optics = RollOptics::new(
            Metres(h), Metres(base), Radians::from_degrees(degrees), Radians(0.02),
        ).unwrap();
        let roll = optics.solve(x[0], x[1]).unwrap();
        prop_assert!((roll.angle.value().tan() - t).abs() < 1e-14);
        prop_assert!((roll.first.value() - y[0]).abs() < 1e-14);
        prop_assert!((roll.second.value() - y[1]).abs() < 1e-14);
    }

    /// A surface v + u·t and beams u = ±L/2 + v·f, as a drawing has them: y₁ and y₂ are the roll and the shift again.
    #[test]
    fn the_offsets_of_a_rigid_slide_say_no_more_than_its_roll_and_its_shift(
        t in -0.01_f64..0.01,
        shift_um in -100.0_f64..100.0,
        degrees in 20.0_f64..60.0,
    ) {
        let (h, base, f, v) = (0.02, 0.1, degrees.to_radians().tan(), shift_um * 1e-6);
        prop_assume!((2.0 * h - base * f).abs() > 0.01);
        let meets = |side: f64| (v + side * t) / (1.0 - t * f);
        let y = [meets(base / 2.0), -meets(-base / 2.0)];
        let x = y.map(|y| Metres((h + y) * t - y * f));
        let optics = RollOptics::new(
            Metres(h), Metres(base), Radians::from_degrees(degrees), Radians(0.02),
        ).unwrap();
        let roll = optics.solve(x[0], x[1]).unwrap();
        let own = roll.angle.value().tan();
        prop_assert!((own - t).abs() < 1e-12);
        let shift = (roll.first - roll.second).value() * (1.0 - own * f) / 2.0;
        prop_assert!((shift - v).abs() < 1e-12, "{shift} {v}");
        let sum = (roll.first + roll.second).value();
        prop_assert!((sum - base * own / (1.0 - own * f)).abs() < 1e-12);
    }

    /// Whatever a detector does, the value given out moves no faster than the fastest of the
    /// blends and the detector itself.
    #[test]
    fn no_sequence_of_troubles_makes_a_jump(
        events in prop::collection::vec((0_u8..6, -20.0_f64..20.0), 1..200),
        fade in 5_u64..50,
    ) {
        let mut feed = feed(Reaction::FadeOut(millis(fade)));
        let (mut last, mut now, mut value) = (0.0_f64, 0_u64, 0.0);
        for (kind, number) in events {
            now += 1;
            match kind {
                0 => feed.disable(ms(now), millis(fade)),
                1 => feed.enable(),
                2 => { value = number; feed.expect_jump(); }
                _ => {}
            }
            let measured = if kind == 3 { Err(BLOCKED) } else { Ok([um(value)]) };
            let seen = feed.advance(ms(now), measured)[0].um();
            // At most 40 µm are blended, in 5 ms or more.
            prop_assert!((seen - last).abs() <= 40.0 / 5.0 + 1e-9, "{last} to {seen}");
            last = seen;
        }
        prop_assert!(last.abs() <= 20.0 * (1.0 + UM));
    }
}
