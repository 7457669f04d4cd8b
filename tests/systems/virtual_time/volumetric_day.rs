//! Eight hours of a machine that warms up, pauses and works, corrected while it works.
//!
//! Between short stretches of work the machine idles without SYNC, so that hours pass in seconds.

use core::time::Duration;

use tests::volume::{Off, Volume, good, percentile_95, spread};
use units::{Metres, Time};

/// When work begins, and how long it goes on.
const DAY_H: f64 = 8.0;

/// Heartbeats so rare that hours without SYNC cost little.
fn calm(text: String) -> String {
    text.replace("heartbeat_ms = 50", "heartbeat_ms = 2000")
        .replace("heartbeat_producer_ms = 50", "heartbeat_producer_ms = 2000")
        .replace(
            "heartbeat_consumer_ms = 150",
            "heartbeat_consumer_ms = 7000",
        )
        .replace("watch_master_ms = 500", "watch_master_ms = 7000")
}

/// What one day came to.
#[derive(Default)]
struct Day {
    /// At each stretch of work, 95 % of places all over the volume: hour, found, by the tables of
    /// the morning, corrected while it works.
    curve: Vec<(f64, Metres, Metres, Metres)>,
    /// How far places went from where they were in the morning.
    drifted: Metres,
    /// At standstill, everywhere, all day.
    at_rest: Vec<Off>,
    /// At set-points on the way.
    along: Vec<Off>,
}

fn day(seed: u64, stretches: u32, places: u32) -> Day {
    let mut volume = Volume::zeroed(seed, calm, |text| {
        text.replace(
            "bow_um_per_k = 4.0",
            &format!(
                "bow_um_per_k = {}",
                std::env::var("BOW").unwrap_or("4.0".into())
            ),
        )
    });
    volume.know_errors();
    good(
        volume
            .bench
            .machine
            .reference_volumetric(&volume.bench.store),
    );
    let (mut mover, state) = volume.corrected();
    let everywhere = spread(0, 200);
    let morning = volume.uncorrected(&everywhere);
    let mut day = Day::default();
    for stretch in 0..=stretches {
        let hour = DAY_H * f64::from(stretch) / f64::from(stretches);
        let now = volume.bench.machine.now();
        let pause = Time::from_seconds(hour * 3600.0).since(now);
        if pause > Duration::from_secs(1) {
            good(volume.bench.machine.idle(pause));
            good(volume.bench.machine.correct_volume(&mut mover, true));
        }
        let here = spread(200 + stretch * places, places);
        let errors = volume.visit(&mut mover, &here, &mut day.along);
        if std::env::var("LOOK").is_ok() {
            for mm in [
                [0.0, 0.0, 100.0],
                [500.0, 0.0, 100.0],
                [0.0, 400.0, 100.0],
                [0.0, 0.0, 300.0],
                [250.0, 0.0, 100.0],
            ] {
                let target = tests::volume::point_mm(mm);
                let live = good(volume.bench.machine.drive_to(
                    &mut mover,
                    target,
                    tests::volume::STAND,
                ));
                let off = volume
                    .off(target)
                    .map(|it| (it.um() * 100.0).round() / 100.0);
                let tables =
                    volume.by_tables(&[mm], &state)[0].map(|it| (it.um() * 100.0).round() / 100.0);
                eprintln!(
                    "  at {mm:?}: off {off:?}, by tables {tables:?}, u {:?} {:?}",
                    [0, 1, 2].map(|k| live.uncertainty[k].um()),
                    live.validity
                );
            }
        }
        let found = volume.uncorrected(&everywhere);
        let pairs = found.iter().zip(&morning);
        let drifted: Vec<Off> = pairs
            .map(|(now, then)| core::array::from_fn(|k| now[k] - then[k]))
            .collect();
        day.drifted = day.drifted.max(percentile_95(&drifted));
        let tables = percentile_95(&volume.by_tables(&everywhere, &state));
        let live = percentile_95(&errors);
        day.curve.push((hour, percentile_95(&found), tables, live));
        day.at_rest.extend(errors);
    }
    day
}

impl Day {
    fn tell(&self, seed: u64) {
        for (hour, found, tables, live) in &self.curve {
            let [found, tables, live] = [found, tables, live].map(|it| it.um());
            eprintln!(
                "seed {seed}, {hour:.2} h: {found:.2} found, {tables:.2} by tables, {live:.2} um live"
            );
        }
        eprintln!(
            "seed {seed}: {:.2} um at rest, {:.2} um on the way ({} places), drifted by {:.2} um",
            percentile_95(&self.at_rest).um(),
            percentile_95(&self.along).um(),
            self.along.len(),
            self.drifted.um()
        );
    }
}

#[test]
fn a_machine_that_drifts_for_eight_hours_keeps_its_tool_on_the_path() {
    let day = day(1, 16, 5);
    day.tell(1);
    assert!(percentile_95(&day.at_rest) <= Metres::from_um(2.0));
}
