//! The table's physics, without any bus.

use core::f64::consts::TAU;
use core::time::Duration;

use units::{Radians, Time};

use crate::node::cia402_drive::{RotaryDriveConfig, TouchProbeConfig};
use crate::plant::config::PlantConfig;
use crate::plant::table::config::TableConfig;
use crate::plant::{Plant, ProbeEdge, Servo};

fn plant_of(change: impl FnOnce(&mut TableConfig), seed: u64) -> Plant {
    let mut table = TableConfig::default();
    change(&mut table);
    let config = PlantConfig {
        table: Some(table),
        ..PlantConfig::default()
    };
    Plant::new(&config, seed)
}

fn arcsec(radians: f64) -> f64 {
    Radians(radians).arcsec()
}

/// Turns by `angle` at `speed` (radians, per second) from where it is, with ramps of half a
/// second; the edges on the way.
fn turn(plant: &mut Plant, now: &mut Time, angle: f64, speed: f64) -> Vec<ProbeEdge> {
    const RAMP_S: f64 = 0.5;
    let truth = plant.truth().table().unwrap();
    let start = (truth.reading() - truth.count_zero()).value();
    let duration_s = angle.abs() / speed + RAMP_S;
    // How far a speed that rises to 1 in the ramp has come.
    let risen = |s: f64| match s {
        s if s <= 0.0 => 0.0,
        s if s < RAMP_S => s * s / (2.0 * RAMP_S),
        s => s - RAMP_S / 2.0,
    };
    let mut edges = Vec::new();
    for ms in 0..(duration_s * 1e3) as u32 + 500 {
        let s = f64::from(ms) * 1e-3;
        let way = speed * (risen(s) - risen(s - (duration_s - RAMP_S)));
        let demand = start + angle.signum() * way;
        plant.set_servo(0, Servo::Follow { demand });
        *now += Duration::from_millis(1);
        plant.advance(*now);
        edges.extend(std::iter::from_fn(|| plant.probe_edge(0)));
    }
    edges
}

#[test]
fn the_shipped_file_says_what_the_defaults_are() {
    let text = include_str!("../../../../configs/emulated/rotary.toml");
    let machine = crate::config::MachineConfig::parse(text).unwrap();
    assert_eq!(machine.plant.table, Some(TableConfig::default()));
    let crate::config::DeviceConfig::Cia402Drive(drive) = &machine.nodes[0].device else {
        panic!("the first node is the drive");
    };
    assert_eq!(drive.rotary, Some(RotaryDriveConfig::default()));
    assert_eq!(drive.touch_probe, Some(TouchProbeConfig::default()));
}

#[test]
fn what_no_table_can_be_is_refused() {
    let text = include_str!("../../../../configs/emulated/rotary.toml");
    for (from, to, key) in [
        ("lines = 360", "lines = 0", "lines"),
        ("lines = 360", "lines = 36000", "half the line spacing"),
        (
            "[plant.table.motion]",
            "[plant.platform]\n[plant.table.motion]",
            "platform and table and volumetric",
        ),
        (
            "counts_per_turn = 129600000\nupper",
            "counts_per_turn = 1000\nupper",
            "counts_per_turn",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let refused = crate::config::MachineConfig::parse(&text.replace(from, to));
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains(key), "{refused}");
    }
}

#[test]
fn the_encoder_and_the_plate_err_by_as_much_as_configured() {
    for seed in 1..=5 {
        let plant = plant_of(|_| {}, seed);
        let truth = plant.truth().table().unwrap();
        let peak = |errors: &mut dyn Iterator<Item = f64>| {
            errors.fold(0.0, |peak: f64, error| peak.max(error.abs()))
        };
        let mut table = (0..3600).map(|n| {
            let at = Radians(TAU * f64::from(n) / 3600.0);
            truth.encoder_error(at).arcsec()
        });
        let peak_arcsec = peak(&mut table);
        assert!((9.99..10.01).contains(&peak_arcsec), "{peak_arcsec}");
        let mut lines = (0..truth.lines()).map(|line| truth.line_error(line).arcsec());
        let peak_arcsec = peak(&mut lines);
        assert!((29.99..30.01).contains(&peak_arcsec), "{peak_arcsec}");
    }
}

#[test]
fn a_turn_passes_every_line_once_in_both_directions() {
    let mut plant = plant_of(|_| {}, 3);
    let mut now = Time::ZERO;
    for direction in [1.0, -1.0] {
        let edges = turn(&mut plant, &mut now, direction * TAU, 1.0);
        let rising = edges.iter().filter(|edge| edge.rising).count();
        // One more where the start lies on the edge of a line.
        assert!((360..=361).contains(&rising), "{rising}");
        assert_eq!(edges.iter().filter(|edge| !edge.rising).count(), rising);
        assert!(edges.is_sorted_by_key(|edge| edge.at));
    }
}

/// Each edge's reading minus the true angle of its line minus the encoder's error there.
fn edge_errors(plant: &Plant, edges: &[ProbeEdge]) -> Vec<f64> {
    let truth = plant.truth().table().unwrap();
    let lines = truth.lines();
    edges
        .iter()
        .filter(|edge| edge.rising)
        .map(|edge| {
            let counted = edge.count as f64 * truth.resolution().value();
            let reading = truth.count_zero().value() + counted;
            let angle = reading - truth.encoder_error(Radians(reading)).value();
            (0..lines)
                .map(|line| {
                    let off = angle - truth.line_angle(line).value();
                    off - TAU * (off / TAU).round()
                })
                .min_by(|a, b| a.abs().total_cmp(&b.abs()))
                .unwrap()
        })
        .collect()
}

#[test]
fn an_edge_is_where_its_line_is_within_noise_and_latency() {
    let mut plant = plant_of(|_| {}, 4);
    let mut now = Time::ZERO;
    let mut means = Vec::new();
    for direction in [1.0, -1.0] {
        let edges = turn(&mut plant, &mut now, direction * TAU, 1.0);
        // Without the ramps.
        let errors = edge_errors(&plant, &edges[80..640]);
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let square = |error: &f64| (error - mean).powi(2);
        let deviation = (errors.iter().map(square).sum::<f64>() / errors.len() as f64).sqrt();
        assert!(
            (0.045..0.056).contains(&arcsec(deviation)),
            "{}",
            arcsec(deviation)
        );
        means.push(arcsec(mean));
    }
    // 2 µs at 1 rad/s, to either side.
    assert!((means[0] - 0.4125).abs() < 0.02, "{means:?}");
    assert!((means[1] + 0.4125).abs() < 0.02, "{means:?}");
}

#[test]
fn a_turned_plate_shifts_its_lines_by_whole_spacings_and_a_little() {
    let mut plant = plant_of(|_| {}, 5);
    let before = plant.truth().table().unwrap().line_angle(10);
    let (_, off_before) = plant.truth().table().unwrap().placement();
    plant.turn_plate(7.0);
    let truth = plant.truth().table().unwrap();
    let (lines, off) = truth.placement();
    assert_eq!(lines, 7);
    assert_ne!(off, off_before);
    assert!(off.abs().arcsec() <= 60.0);
    let shift = truth.line_angle(10) - before - (off - off_before);
    assert!((shift.degrees() - 7.0).abs() < 1e-9);
}

#[test]
fn half_a_line_is_a_turn_too_and_turns_add_up() {
    let mut plant = plant_of(|table| table.plate.placement_error_arcsec = 0.0, 5);
    let before = plant.truth().table().unwrap().line_angle(10);
    for expected in [7.5, 15.0, -1.25] {
        let turned = (plant.truth().table().unwrap().line_angle(10) - before).degrees();
        plant.turn_plate(expected - turned);
        let turned = plant.truth().table().unwrap().line_angle(10) - before;
        assert!((turned.degrees() - expected).abs() < 1e-9, "{turned:?}");
    }
}

#[test]
fn the_hand_turns_the_plate_when_it_was_read_and_the_drive_is_off() {
    let mut plant = plant_of(|table| table.plate.hand_lines = vec![73.0, -2.0], 5);
    let placement = |plant: &Plant| plant.truth().table().unwrap().placement().0;
    let mut now = Time::ZERO;
    let twice = 2.0 * TAU;
    for (angle, expected) in [
        (TAU, 0),
        (twice, 73),
        (TAU, 73),
        (-twice, 71),
        (twice, 71),
        (twice, 71),
    ] {
        turn(&mut plant, &mut now, angle, 4.0);
        plant.set_servo(0, Servo::Off);
        assert_eq!(placement(&plant), expected);
    }
}

#[test]
fn a_smudged_line_gives_no_edge_and_a_scratched_one_two() {
    let mut plant = plant_of(|table| table.plate.smudged_lines = vec![200], 6);
    plant.set_line_scratched(100, true);
    plant.set_line_smudged(20, true);
    plant.set_line_smudged(200, false);
    let mut now = Time::ZERO;
    let edges = turn(&mut plant, &mut now, TAU * 1.001, 0.5);
    let truth = plant.truth().table().unwrap();
    let near = |line: usize| {
        edges
            .iter()
            .filter(|edge| edge.rising)
            .filter(|edge| {
                let counted = edge.count as f64 * truth.resolution().value();
                let off = truth.count_zero().value() + counted - truth.line_angle(line).value();
                (off - TAU * (off / TAU).round()).abs() < truth.line_angle(1).value().abs() / 4.0
            })
            .count()
    };
    assert_eq!((near(20), near(100), near(200)), (0, 2, 1));
}

#[test]
fn the_index_mark_stays_where_it_is_over_a_power_cycle() {
    let mut plant = plant_of(|_| {}, 7);
    let mut now = Time::ZERO;
    let mut marks = Vec::new();
    for _ in 0..3 {
        let _ = turn(&mut plant, &mut now, TAU, 2.0);
        let pulse = plant.index_pulse(0).unwrap();
        let truth = plant.truth().table().unwrap();
        let mark = truth.count_zero().value() + pulse.count as f64 * truth.resolution().value();
        marks.push(arcsec(mark - TAU * (mark / TAU).round()));
        plant.encoder_power(0, false);
        plant.power_cycle(crate::plant::HallDrift::default());
        now += Duration::from_secs(1);
        plant.advance(now);
        plant.encoder_power(0, true);
        assert_eq!(plant.index_pulse(0), None);
        assert_eq!(plant.encoder_counts(0), 0);
    }
    assert!(marks.iter().all(|mark| mark.abs() < 0.05), "{marks:?}");
}

#[test]
fn the_same_seed_gives_the_same_edges_however_often_somebody_looks() {
    let run = |every: u32| {
        let mut plant = plant_of(|_| {}, 8);
        let mut now = Time::ZERO;
        let mut edges = Vec::new();
        for ms in 0..2000_u32 {
            let demand = f64::from(ms) * 1e-3;
            plant.set_servo(0, Servo::Follow { demand });
            for _ in 0..every {
                now += Duration::from_millis(1) / every;
                plant.advance(now);
                edges.extend(std::iter::from_fn(|| plant.probe_edge(0)));
            }
        }
        edges
    };
    let once = run(1);
    assert!(once.len() > 100);
    assert_eq!(once, run(4));
}

#[test]
fn a_person_reads_a_line_where_it_is_whether_or_not_the_table_is_turned_to_it() {
    let mut plant = plant_of(|table| table.microscope.noise_arcsec = 0.0, 5);
    for line in [0, 1, 100, 359] {
        let seen = plant.sight_line(line);
        let table = plant.truth().table().unwrap();
        let angle = table.line_angle(line as usize);
        let shown = seen.angle.unwrap();
        // Where the table is when the encoder shows that.
        let there = shown - table.encoder_error(shown) - angle;
        assert!(
            arcsec((there - there.whole_turns()).value()).abs() < 0.02,
            "line {line}"
        );
        let away = angle - table.angle();
        let away = away - away.whole_turns();
        let is_near = away.value().abs() < TAU / 720.0;
        assert_eq!(seen.to_line.is_some(), is_near, "line {line}");
        if let Some(to_line) = seen.to_line {
            assert!(arcsec((to_line - away).value()).abs() < 1e-6, "line {line}");
        }
    }
}

#[test]
fn what_a_person_reads_scatters_as_it_is_said_and_smudged_lines_are_not_read() {
    let mut plant = plant_of(|table| table.microscope.noise_arcsec = 0.5, 6);
    let seen: Vec<f64> = (0..400)
        .map(|_| plant.sight_line(17).angle.unwrap().arcsec())
        .collect();
    let mean = seen.iter().sum::<f64>() / 400.0;
    let variance = seen.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / 399.0;
    // Four standard deviations of the scatter of 400 values.
    assert!(
        (variance.sqrt() - 0.5).abs() < 4.0 * 0.5 / 800.0_f64.sqrt(),
        "{variance}"
    );
    plant.set_line_smudged(17, true);
    assert_eq!(plant.sight_line(17), crate::plant::Sight::default());
}
