use machine::engine::{CHANNELS_MAX, Channel};

use super::*;
use crate::config::parse;
use crate::volumetric::{BeamRecord, FunctionRecord};

const CONFIG: &str = include_str!("../../../../configs/machines/volumetric.toml");

/// Four quadrants with 2 V each, and so much of it moved to the positive side of the first direction.
fn quadrants(moved: f64) -> [f64; 4] {
    [2.0 + moved, 2.0 - moved, 2.0 - moved, 2.0 + moved]
}

struct Bench {
    sights: Sights,
    channels: [Option<Channel>; CHANNELS_MAX],
}

impl Bench {
    fn new(references: Option<&BeamReferencesContent>) -> Self {
        let config = parse(CONFIG, "m.toml").unwrap().config;
        Self {
            sights: Sights::new(&config, references).unwrap(),
            channels: [None; CHANNELS_MAX],
        }
    }

    /// A sample at `ms`: what x's slide shows, 2 V on every other input.
    fn sample(&mut self, ms: f64, x_slide: [f64; 4]) {
        let at = Time::from_seconds(ms * 1e-3);
        for (place, channel) in self.channels.iter_mut().enumerate() {
            let volts = match place {
                0..4 => x_slide[place],
                4..24 => 2.0,
                _ => 0.0,
            };
            *channel = Some(Channel {
                at,
                volts: Volts(volts),
                saturated: false,
            });
        }
        self.hear(ms);
    }

    fn hear(&mut self, ms: f64) {
        self.sights.hear(&Observed {
            now: Time::from_seconds(ms * 1e-3),
            nominal: &[],
            actual: &[],
            channels: &self.channels,
            temperatures: &[],
            spots: &[],
        });
    }

    /// Of x's slide.
    fn look(&mut self, ms: f64) -> Sight {
        self.sights.look(Time::from_seconds(ms * 1e-3)).remove(0)
    }
}

/// 626.66 um for the ratio 1, negative on the slide.
#[test]
fn a_reading_is_the_mean_of_the_samples_since_the_last_look() {
    let mut bench = Bench::new(None);
    for (n, moved) in [0.1, 0.3, 0.2].into_iter().enumerate() {
        bench.sample(20.0 * n as f64, quadrants(moved));
        // The engine hears a sample at each SYNC until the next one comes.
        bench.hear(20.0 * n as f64 + 2.0);
    }
    let sight = bench.look(50.0);
    assert_eq!((&*sight.name, sight.trouble), ("x slide", None));
    assert_eq!(sight.light, Some(Volts(8.0)));
    let first = &sight.readings[0];
    let um = Metres(first.value.unwrap()).um();
    assert!((um + 62.666).abs() < 1e-9, "{um}");
    assert_eq!(first.along, Some(Axis::Y));
    assert!((Metres(first.field.1).um() - 187.998).abs() < 1e-9);
    assert_eq!(first.off_reference(), None, "there is none");
    bench.sample(60.0, quadrants(0.0));
    let again = bench.look(70.0);
    assert_eq!(
        again.readings[0].value,
        Some(0.0),
        "what was before is over"
    );
}

/// A step that no slide can make is no trouble while somebody turns the adjuster.
#[test]
fn a_beam_may_be_anywhere_and_is_told_to_be_blocked_beside_or_old() {
    let mut bench = Bench::new(None);
    bench.sample(0.0, quadrants(0.0));
    bench.sample(20.0, quadrants(0.5));
    assert_eq!(bench.look(20.0).trouble, None);
    bench.sample(40.0, quadrants(0.9));
    let beside = bench.look(40.0);
    assert!(
        matches!(beside.trouble, Some(Trouble::Beside { .. })),
        "{beside:?}"
    );
    let first = &beside.readings[0];
    assert_eq!(first.value, None);
    assert!((Metres(first.nearest.unwrap()).um() + 187.998).abs() < 1e-9);
    bench.sample(60.0, [0.01; 4]);
    let blocked = bench.look(60.0);
    assert!(matches!(blocked.trouble, Some(Trouble::Blocked { .. })));
    assert_eq!(blocked.readings[0].nearest, None);
    bench.sample(80.0, [3.3, 2.0, 2.0, 2.0]);
    assert!(matches!(
        bench.look(80.0).trouble,
        Some(Trouble::Saturated { .. })
    ));
    bench.sample(100.0, quadrants(0.0));
    assert_eq!(bench.look(150.0).trouble, None);
    let old = bench.look(201.0);
    assert!(
        matches!(old.trouble, Some(Trouble::Stale { .. })),
        "{old:?}"
    );
    assert_eq!(old.readings[0].value, None);
    let mut never = Bench::new(None);
    assert!(matches!(
        never.look(0.0).trouble,
        Some(Trouble::Stale { .. })
    ));
}

#[test]
fn the_way_to_the_nearest_reference_along_the_travel_is_told() {
    let function = |low: f64, high: f64| FunctionRecord {
        positions_m: vec![0.0, 0.5],
        values_si: vec![low, high],
        ..FunctionRecord::default()
    };
    let references = BeamReferencesContent {
        beams: vec![BeamRecord {
            axis: 'x',
            slider: [function(-10e-6, 10e-6), function(5e-6, 8e-6)],
            end_m: Some([3e-6, 0.0]),
            drift: None,
            wandered_m: None,
        }],
        ..BeamReferencesContent::default()
    };
    let mut bench = Bench::new(Some(&references));
    bench.sample(0.0, quadrants(0.2));
    let all = bench.sights.look(Time::ZERO);
    let off = |sight: usize, reading: usize| {
        let off = all[sight].readings[reading].off_reference();
        off.map(|it| (it * 1e9).round() / 1e3)
    };
    assert_eq!(off(0, 0), Some(-52.666), "-62.666 is below -10");
    assert_eq!(off(0, 1), Some(-5.0), "0 is below 5");
    assert_eq!((off(1, 0), off(1, 1)), (Some(-3.0), Some(0.0)));
    assert_eq!(off(2, 0), None, "y has no references");
    let names: Vec<&str> = all.iter().map(|it| &*it.name).collect();
    let expected = [
        "x slide", "x end", "y slide", "y end", "z slide", "z end", "x roll",
    ];
    assert_eq!(names, expected);
}
