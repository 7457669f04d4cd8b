//! A day of parts on an emulated slider: a bow that was built in, heat, a beam that wanders, noise.

use core::time::Duration;

use units::{Metres, MetresPerSecond, Time, Volts};

use super::*;
use crate::volumetric::function::{Function, Shape};
use crate::volumetric::{Axis, Point, Volume};

const TRAVEL_M: f64 = 0.6;
const SOURCE_M: f64 = -0.1;
const END_M: f64 = 0.7;
const SPEED: f64 = 0.1;
const CYCLE: f64 = 0.01;
const PARTS: u32 = 50;

fn um(um: f64) -> Metres {
    Metres::from_um(um)
}

/// −1 to 1.
fn even(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn detector() -> BeamDetector {
    let curve = || RatioCurve::straight(Metres::from_mm(1.0), 0.8).unwrap();
    BeamDetector::new(BeamDetectorSettings {
        layout: Layout::Lateral,
        dark: [Volts::ZERO; 4],
        gain: [1.0; 4],
        saturation: Volts(9.9),
        intensity_min: Volts(2.0),
        intensity_max: Volts(20.0),
        age_max: Duration::from_millis(50),
        speed_max: MetresPerSecond(1e-3),
        noise_max: um(5.0),
        stuck_samples: None,
        curves: [curve(), curve()],
    })
    .unwrap()
}

/// What a lateral detector of ±1 mm gives for a place: 4 V a pair.
fn sample(at: Time, place_um: [f64; 2]) -> Sample {
    let [p, q] = place_um.map(|it| it * 1e-3);
    let channels = [1.0 + p, 1.0 - p, 1.0 + q, 1.0 - q].map(|it| Volts(2.0 * it));
    Sample { channels, at }
}

fn settings() -> FeedSettings {
    FeedSettings {
        patience: Duration::from_millis(20),
        reaction: Reaction::Hold,
        blend: Duration::from_secs(1),
        confirm: 3,
        smoothing: Duration::from_millis(100),
        repeats: 1,
    }
}

/// The x axis, its truth and its monitor. Only y is looked at.
struct Bench {
    monitor: AxisMonitor,
    memories: Memories,
    state: u64,
    seconds: f64,
}

/// 15 µm in the middle, by design.
fn bow_um(x: f64) -> f64 {
    60.0 * x / TRAVEL_M * (1.0 - x / TRAVEL_M)
}

impl Bench {
    fn new(seed: u64) -> Self {
        let zero = || Function::constant(Metres(0.0), Metres(TRAVEL_M), Metres::ZERO).unwrap();
        let drift = BeamDrift::Pivoting {
            source: Metres(SOURCE_M),
            end: Metres(END_M),
        };
        let reference = BeamReference::new([zero(), zero()], [Metres::ZERO; 2], drift).unwrap();
        let end = EndOfTravel {
            detector: detector().into(),
            feed: Feed::new(settings()),
        };
        let feed = Feed::new(settings());
        Self {
            monitor: AxisMonitor::new(Axis::X, detector().into(), Some(end), reference, feed),
            memories: Memories::default(),
            state: seed,
            seconds: 0.0,
        }
    }

    /// Where the slider really is in y: its bow, and heat that bends it by 18 µm over 8 hours.
    fn true_um(&self, x: f64) -> f64 {
        let hours = self.seconds / 3600.0;
        let heat = 18.0 * (1.0 - (-hours / 3.0).exp());
        bow_um(x) + heat * ((x / TRAVEL_M).powi(2) - 0.3)
    }

    /// How far the beam has wandered at x: ±25 µm at the end.
    fn beam_um(&self, x: f64) -> f64 {
        let at_end = 25.0 * (self.seconds / 5000.0).sin();
        at_end * (x - SOURCE_M) / (END_M - SOURCE_M)
    }

    /// One cycle at x; what is to be compensated in y.
    fn cycle(&mut self, x: f64, blocked: bool) -> f64 {
        self.seconds += CYCLE;
        let now = Time::from_seconds(self.seconds);
        // Even noise of ±0.35 µm has a standard deviation of 0.2 µm.
        let noise = 0.35 * even(&mut self.state);
        let seen = self.true_um(x) - self.beam_um(x) + noise;
        let mut slider = sample(now, [seen, 0.0]);
        if blocked {
            slider.channels = [Volts(0.01); 4];
        }
        let noise = 0.35 * even(&mut self.state);
        let end = sample(now, [self.beam_um(END_M) + noise, 0.0]);
        let (slider, end) = (Shown::from(slider), Shown::from(end));
        self.monitor.advance(
            now,
            Metres(x),
            (Some(&slider), Some(&end)),
            [Metres(0.0); 2],
            &self.memories,
        )[0]
        .um()
    }

    /// Standing at the start, then there and back once; calls `see` with x and what is left in
    /// y when the compensation is applied.
    fn part(&mut self, mut see: impl FnMut(&Self, f64, f64, f64)) {
        for _ in 0..300 {
            self.cycle(0.0, false);
        }
        let steps = (TRAVEL_M / SPEED / CYCLE) as usize;
        for n in 0..2 * steps {
            let way = n.min(2 * steps - n) as f64;
            let x = way * SPEED * CYCLE;
            let error = self.cycle(x, false);
            see(self, x, self.true_um(x), error);
        }
        // The other parts follow over the day.
        self.seconds += 8.0 * 3600.0 / f64::from(PARTS);
    }
}

/// However often it is heard: three pictures are needed, and what they show is not smoothed between them.
#[test]
fn a_picture_counts_once() {
    let camera = SpotCamera::new(SpotSettings {
        field: [(um(-200.0), um(200.0)); 2],
        age_max: Duration::from_millis(400),
        speed_max: MetresPerSecond(1e-3),
        noise_max: um(5.0),
    });
    let zero = || Function::constant(Metres(0.0), Metres(TRAVEL_M), Metres::ZERO).unwrap();
    let drift = BeamDrift::Translating;
    let reference = BeamReference::new([zero(), zero()], [Metres::ZERO; 2], drift).unwrap();
    let (eye, feed) = (Eye::Camera(camera.unwrap()), Feed::new(settings()));
    let mut monitor = AxisMonitor::new(Axis::X, eye, None, reference, feed);
    let memories = Memories::default();
    // A picture every 70 ms, heard every 10 ms.
    let mut hear = |cycle: u32, seen_um: f64| {
        let at = |cycle: u32| Time::from_seconds(f64::from(cycle) * CYCLE);
        let (place, asked) = (Ok([um(seen_um), um(0.0)]), at(cycle / 7 * 7));
        let shown = Shown::Camera(Spot { at: asked, place });
        let none = [Metres(0.0); 2];
        let given = monitor.advance(
            at(cycle + 1),
            Metres(0.1),
            (Some(&shown), None),
            none,
            &memories,
        );
        (given[0].um(), monitor.status().0)
    };
    for cycle in 7..21 {
        let (given, status) = hear(cycle, 10.0);
        assert_eq!((given, status), (0.0, FeedStatus::Waiting(None)), "{cycle}");
    }
    for cycle in 21..140 {
        assert_eq!(hear(cycle, 10.0).1, FeedStatus::Good, "{cycle}");
    }
    // By one picture 70 ms later with a time constant of 100 ms: 7/17 of the way, and no more until the next one.
    for cycle in 140..147 {
        let (given, _) = hear(cycle, 12.0);
        assert!(
            (given - 10.0 - 2.0 * 7.0 / 17.0).abs() < 1e-9,
            "{cycle}: {given}"
        );
    }
    assert!(hear(147, 12.0).0 > 11.2);
}

#[test]
fn a_bow_that_was_built_in_is_kept_while_heat_is_compensated() {
    for seed in 0..3 {
        let mut bench = Bench::new(seed);
        let nodes: Vec<Metres> = (0..=30).map(|n| Metres(0.02 * f64::from(n))).collect();
        let bow: Vec<Metres> = nodes.iter().map(|x| um(bow_um(x.value()))).collect();
        let bow = Function::new(&nodes, &bow, Shape::Spline).unwrap();
        let none = Function::constant(Metres(0.0), Metres(1.0), Metres::ZERO).unwrap();
        let mut first = StateMap::default();
        first.of[0] = Some([bow, none]);
        bench.memories.first = Some(first);
        let (mut worst, mut without) = (0.0_f64, 0.0_f64);
        for _ in 0..PARTS {
            bench.part(|_, x, slider, error| {
                worst = worst.max((slider - error - bow_um(x)).abs());
                without = without.max((slider - bow_um(x)).abs());
            });
        }
        assert!(worst < 1.0, "seed {seed}: {worst} um");
        assert!(without > 10.0, "nothing drifted: {without} um");
    }
}

#[test]
fn later_parts_repeat_the_first_one_while_the_machine_drifts() {
    for seed in 10..13 {
        let mut bench = Bench::new(seed);
        let high = Point::new(Metres(TRAVEL_M), Metres(TRAVEL_M), Metres(TRAVEL_M));
        let settings = RecorderSettings {
            spacing: Metres::from_mm(5.0),
            gap_max: Metres::from_mm(20.0),
        };
        let mut recorder =
            StateRecorder::new(&Volume::new(Point::ZERO, high).unwrap(), settings).unwrap();
        // The first part is made as the machine is: its surface is the slider's way.
        let mut surface = Vec::new();
        bench.part(|bench, x, slider, _| {
            recorder.record(Axis::X, Metres(x), bench.monitor.displacement().unwrap());
            surface.push(slider);
        });
        bench.memories.second = Some(recorder.finish().unwrap().0);
        bench.monitor.expect_jump();
        let (mut worst, mut without) = (0.0_f64, 0.0_f64);
        for _ in 1..PARTS {
            let mut first = surface.iter();
            bench.part(|_, _, slider, error| {
                let first = first.next().unwrap();
                worst = worst.max((slider - error - first).abs());
                without = without.max((slider - first).abs());
            });
        }
        assert!(worst < 1.0, "seed {seed}: {worst} um");
        assert!(without > 10.0, "nothing drifted: {without} um");
    }
}

/// The beam is cut for a second in the middle of a part: what is given out stays and returns
/// without a step larger than the noise and the slope of the bow make anyway.
#[test]
fn a_hand_in_the_beam_makes_no_step() {
    let mut bench = Bench::new(99);
    bench.part(|_, _, _, _| {});
    bench.seconds += 7200.0;
    for _ in 0..300 {
        bench.cycle(0.0, false);
    }
    let (mut last, mut held, mut largest) = (None, false, 0.0_f64);
    for n in 0..500 {
        let blocked = (200..300).contains(&n);
        let error = bench.cycle(SPEED * CYCLE * f64::from(n), blocked);
        held |= matches!(
            bench.monitor.status().0,
            FeedStatus::Held(Trouble::Blocked { .. })
        );
        if let Some(before) = last.replace(error) {
            largest = largest.max((error - before).abs());
        }
    }
    assert!(held, "the beam was never seen to be blocked");
    // 1 mm a cycle on a bow of 100 µm/m at most is 0.1 µm, the noise a tenth of ±0.7 µm, the
    // blend of 10 µm over a second 0.1 µm.
    assert!(largest < 0.4, "{largest} um");
    assert_eq!(bench.monitor.status().0, FeedStatus::Good);
}
