//! Eight hours of a machine that warms up, pauses and works, corrected while it works.
//!
//! Between short stretches of work the machine idles without SYNC, so that hours pass in seconds.

use core::time::Duration;
use std::time::Instant;

use tests::volume::{Frame, Off, Volume, calm, good, percentile_95, spread};
use truestage::cycle::volumetric::WarmUp;
use units::{Metres, Time};

/// How long the day is.
const DAY_H: f64 = 8.0;

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

/// A day of a machine whose errors are known perfectly in the morning.
fn day_of_known(seed: u64, stretches: u32, places: u32) -> Day {
    let mut volume = Volume::zeroed(seed, calm, |text| text);
    volume.know_errors();
    let store = volume.bench.store.clone();
    good(volume.bench.machine.reference_volumetric(&store));
    work(&mut volume, stretches, places)
}

/// Another day of a machine that was calibrated by its own procedure, cold and warm.
fn day_of_calibrated(seed: u64, stretches: u32, places: u32) -> Day {
    let mut volume = Volume::zeroed(seed, calm, |text| text);
    let store = volume.bench.store.clone();
    let mut hand = volume.bench.emulated.clone();
    let warm_up = WarmUp::Idle(Duration::from_secs(2 * 3600));
    let begun = Instant::now();
    let made = volume
        .bench
        .machine
        .calibrate_volumetric(&store, warm_up, None, &mut hand);
    let made = good(made);
    eprintln!(
        "seed {seed}: {} lines, birge {:?}, {} dof, u {:.3} um, at {:.2} h, {:?}",
        made.lines,
        made.found.birge_ratio,
        made.found.degrees_of_freedom,
        made.u_max.um(),
        volume.bench.machine.now().seconds() / 3600.0,
        begun.elapsed(),
    );
    for it in &made.found.bends {
        eprintln!(
            "  bend of {}: {:.3} um/K, u {:.3}",
            it.plan.axis,
            it.bow.um(),
            it.u.um()
        );
    }
    for it in &made.found.expansions {
        let (value, u) = (it.per_kelvin * 1e6, it.u * 1e6);
        eprintln!("  scale of {}: {value:.3} ppm/K, u {u:.3}", it.plan.axis);
    }
    let mut later = Volume::zeroed(seed, calm, |text| text);
    later.inherit(&volume);
    work(&mut later, stretches, places)
}

fn work(volume: &mut Volume, stretches: u32, places: u32) -> Day {
    let (mut mover, state) = volume.corrected();
    let everywhere = spread(0, 200);
    let morning = volume.uncorrected(&everywhere);
    // The frame that the tables count in, as it is in the morning and stays.
    let frame = Frame::of(&everywhere, &volume.by_tables(&everywhere, &state));
    let mut day = Day::default();
    let mut along = Vec::new();
    for stretch in 0..=stretches {
        let hour = DAY_H * f64::from(stretch) / f64::from(stretches);
        if idle_until(volume, hour) {
            good(volume.bench.machine.correct_volume(&mut mover, true));
        }
        let here = spread(200 + stretch * places, places);
        let errors = volume.visit(&mut mover, &here, &mut along);
        let errors = frame.all_seen(&here, &errors);
        let found = volume.uncorrected(&everywhere);
        let pairs = found.iter().zip(&morning);
        let drifted: Vec<Off> = pairs
            .map(|(now, then)| core::array::from_fn(|k| now[k] - then[k]))
            .collect();
        day.drifted = day.drifted.max(percentile_95(&drifted));
        let tables = volume.by_tables(&everywhere, &state);
        let tables = percentile_95(&frame.all_seen(&everywhere, &tables));
        let live = percentile_95(&errors);
        day.curve.push((hour, percentile_95(&found), tables, live));
        day.at_rest.extend(errors);
    }
    let along = along.iter().map(|(mm, off)| frame.seen(*mm, *off));
    day.along = along.collect();
    day
}

/// Lets the machine idle until the hour, if that is to come; says whether it did.
fn idle_until(volume: &mut Volume, hour: f64) -> bool {
    let machine = &mut volume.bench.machine;
    let pause = Time::from_seconds(hour * 3600.0).since(machine.now());
    let long = pause > Duration::from_secs(1);
    if long {
        good(machine.idle(pause));
    }
    long
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

/// What a day must come to.
#[track_caller]
fn judge(seed: u64, day: &Day) {
    day.tell(seed);
    let um = |it: Metres| it.um();
    let found = day.curve.iter().map(|it| um(it.1)).fold(f64::MAX, f64::min);
    let (drifted, left) = (um(day.drifted), um(percentile_95(&day.at_rest)));
    let along = um(percentile_95(&day.along));
    let (_, _, tables, _) = day.curve[day.curve.len() - 1];
    assert!(
        found >= 30.0 && drifted >= 10.0,
        "{found} um, drifts by {drifted} um"
    );
    assert!(
        left <= 2.0 && along <= 2.0,
        "{left} um at rest, {along} um on the way"
    );
    assert!(
        um(tables) >= 5.0,
        "without detectors it drifts out: {} um",
        um(tables)
    );
}

#[test]
fn a_machine_that_drifts_for_eight_hours_keeps_its_tool_on_the_path() {
    for seed in 1..=2 {
        judge(seed, &day_of_known(seed, 8, 5));
    }
}

#[test]
fn a_machine_calibrated_by_itself_keeps_its_tool_on_the_path_another_day() {
    judge(1, &day_of_calibrated(1, 8, 5));
}

/// 4500 places at standstill, more on the way:
/// `cargo test --release -p tests --test systems twenty -- --ignored --nocapture`.
#[test]
#[ignore = "a quarter of an hour"]
fn twenty_machines_calibrated_by_themselves_keep_their_tools_on_the_path() {
    let days: Vec<Day> = (1..=20)
        .map(|seed| {
            let day = day_of_calibrated(seed, 8, 25);
            day.tell(seed);
            day
        })
        .collect();
    for (seed, day) in (1..).zip(&days) {
        judge(seed, day);
    }
}
