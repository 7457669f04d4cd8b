use super::*;
use crate::linear::HeldEntry;
use crate::store::test_run::{hash, header};
use crate::store::{EnvironmentRecord, Journal, read_journal};
use std::fs;

fn point(run: u32) -> LinearEntry {
    LinearEntry::Point(PointEntry {
        run,
        approach: '+',
        target_m: 0.003,
        set_point_m: 0.003,
        encoder_m: 0.003,
        measured_m: 0.003_001,
        scatter_m: 1e-9,
        at_s: 1.5,
        environment: EnvironmentRecord::default(),
    })
}

fn write_points(journal: &mut Journal<LinearLog>, run: u32) {
    for _ in 0..4 {
        journal.write(&point(run)).unwrap();
    }
}

/// One whole run of the header's two targets.
fn write_run(journal: &mut Journal<LinearLog>, run: u32) {
    write_points(journal, run);
    let closure_m = 1e-8;
    journal
        .write(&LinearEntry::Closed(ClosureEntry {
            run,
            start_m: 0.0,
            closure_m,
        }))
        .unwrap();
}

#[test]
fn a_run_whose_datum_was_not_measured_again_is_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::create(folder.path(), &header()).unwrap();
    write_run(&mut journal, 1);
    write_points(&mut journal, 2);
    let (_, read) = Journal::<LinearLog>::resume(journal.path(), &header(), &hash()).unwrap();
    assert!(read.log.points.iter().all(|point| point.run == 1));
    assert_eq!((read.log.points.len(), read.log.closures.len()), (4, 1));
}

#[test]
fn resuming_cuts_the_torn_line_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::create(folder.path(), &header()).unwrap();
    write_run(&mut journal, 1);
    let path = journal.path().to_owned();
    let mut bytes = fs::read(&path).unwrap();
    bytes.extend_from_slice(b"1234abcd {\"entry\":\"poi");
    fs::write(&path, &bytes).unwrap();
    let (mut journal, read) = Journal::<LinearLog>::resume(&path, &header(), &hash()).unwrap();
    assert!(read.torn);
    assert_eq!(read.log.points.len(), 4);
    write_run(&mut journal, 2);
    journal.complete().unwrap();
    let read = read_journal::<LinearLog>(&path).unwrap();
    assert_eq!(
        (read.log.points.len(), read.complete, read.torn),
        (8, true, false)
    );
}

#[test]
fn a_run_cut_short_counts_once_however_often_it_is_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::create(folder.path(), &header()).unwrap();
    write_run(&mut journal, 1);
    journal.write(&point(2)).unwrap();
    let path = journal.path().to_owned();
    let (mut journal, read) = Journal::<LinearLog>::resume(&path, &header(), &hash()).unwrap();
    assert_eq!(read.log.points.len(), 4);
    write_run(&mut journal, 2);
    let (_, read) = Journal::<LinearLog>::resume(&path, &header(), &hash()).unwrap();
    let runs: Vec<_> = read.log.points.iter().map(|point| point.run).collect();
    assert_eq!(runs, [1, 1, 1, 1, 2, 2, 2, 2]);
    assert_eq!(
        read_journal::<LinearLog>(&path).unwrap().log.points,
        read.log.points
    );
}

fn sweep(slope_v: Vec<f64>) -> LinearEntry {
    let held = HeldEntry {
        position_m: 0.0,
        peak_v: 1.6,
        slope_v: 0.0,
    };
    LinearEntry::HallSweep(HallSweepEntry {
        positions_m: vec![-1e-3, 1e-3],
        peak_v: vec![0.6, 0.6],
        slope_v,
        peak_m: 0.0,
        peak_max_v: 1.6,
        g1: held,
        g2: held,
        p0: held,
    })
}

fn zero() -> LinearEntry {
    LinearEntry::Zero(ZeroEntry {
        origin_m: 1e-6,
        standard_uncertainty_m: 1e-8,
        patent_p0_m: 1e-6,
        peak_max_v: 1.6,
        mid_v: 0.0,
        at_s: 1.5,
        budget: None,
    })
}

#[test]
fn a_sweep_has_a_voltage_of_each_sensor_at_each_place() {
    let judged = |entry: LinearEntry| LinearLog::default().judge(&header(), &entry);
    assert!(judged(sweep(vec![-1.3, 1.3])).is_ok());
    assert!(judged(sweep(vec![-1.3])).is_err());
    assert!(judged(sweep(vec![-1.3, f64::NAN])).is_err());
}

#[test]
fn a_sweep_belongs_to_the_zero_that_follows_it_and_to_no_other() {
    let read = || sweep(vec![-1.3, 1.3]);
    let mut log = LinearLog::default();
    // An earlier program journalled a zero without its sweep; another broke off between the two.
    for entry in [zero(), read(), read(), zero(), zero()] {
        log.take(entry);
    }
    let led_to: Vec<_> = log.sweeps.iter().map(|it| it.led_to).collect();
    assert_eq!((led_to, log.zeros.len()), (vec![None, Some(1)], 3));
}
