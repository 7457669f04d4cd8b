use super::*;
use crate::store::test_run::{hash, header};
use crate::store::{Journal, read_journal};

#[test]
fn of_a_plate_whole_placements_are_kept_that_lay_where_they_should() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::<PlateLog>::create(folder.path(), &header()).unwrap();
    let sweep = |offset| {
        PlateEntry::Sweep(SweepEntry {
            offset,
            pass: 1,
            approach: '+',
            deviations_rad: vec![None; 360],
            ..SweepEntry::default()
        })
    };
    let plan = PlatePlanEntry {
        plate: "p".into(),
        lines: 360,
        offsets: vec![0.0, 73.0, 162.0],
        passes: 1,
        speed_rad_per_s: 1.0,
        sighted: None,
    };
    let placed = |offset| {
        PlateEntry::Placed(PlacementEntry {
            offset,
            closure_rad: 0.0,
            at_s: 0.0,
        })
    };
    for entry in [
        PlateEntry::PlatePlan(plan),
        sweep(0.0),
        sweep(0.0),
        placed(0.0),
        sweep(73.0),
        placed(73.0),
    ] {
        journal.write(&entry).unwrap();
    }
    journal
        .write(&PlateEntry::Misplaced { offset: 73.0 })
        .unwrap();
    journal.write(&sweep(162.0)).unwrap();
    let path = journal.path().to_owned();
    let (mut journal, read) = Journal::<PlateLog>::resume(&path, &header(), &hash()).unwrap();
    assert_eq!((read.log.sweeps.len(), read.log.placements.len()), (2, 1));
    journal.write(&sweep(73.0)).unwrap();
    journal.write(&placed(73.0)).unwrap();
    let read = read_journal::<PlateLog>(&path).unwrap();
    assert_eq!((read.log.sweeps.len(), read.log.placements.len()), (3, 2));
}
