//! Three axes corrected throughout their volume while they work, judged by the plant's truth.

use tests::volume::{Volume, good, percentile_95, spread};
use units::Metres;

#[test]
fn three_axes_start_with_all_their_modules_and_find_their_zero() {
    let mut volume = Volume::zeroed(1, |text| text, |text| text);
    for (axis, at_mm) in [("x", 30.0), ("y", 20.0), ("z", 10.0)] {
        good(
            volume
                .bench
                .machine
                .linear(axis)
                .unwrap()
                .move_to(Metres::from_mm(at_mm)),
        );
    }
    let scales = volume.truth(|truth| truth.scales());
    for (scale, at_mm) in scales.into_iter().zip([30.0, 20.0, 10.0]) {
        let off = scale - Metres::from_mm(at_mm);
        assert!(off.abs() < Metres::from_um(0.3), "{} um", off.um());
    }
}

#[test]
fn a_machine_calibrated_just_now_puts_its_tool_where_the_path_says() {
    let mut volume = Volume::zeroed(1, |text| text, |text| text);
    volume.know_errors();
    let store = volume.bench.store.clone();
    good(volume.work().reference(&store));
    let places = spread(0, 20);
    let found = percentile_95(&volume.uncorrected(&places));
    let (mut mover, _) = volume.corrected();
    // One axis alone reaches its full speed.
    let corners = [[0.0; 3], [500.0, 0.0, 0.0], [500.0, 400.0, 0.0], [0.0; 3]];
    volume.visit(&mut mover, &corners, &mut Vec::new());
    let left = percentile_95(&volume.visit(&mut mover, &places, &mut Vec::new()));
    eprintln!("{} um found, {} um left", found.um(), left.um());
    assert!(found > Metres::from_um(15.0), "{} um", found.um());
    assert!(left < Metres::from_um(1.0), "{} um", left.um());
}

/// Each of the records that belong together is refused by name when the others are not in use.
#[test]
fn references_and_memories_of_other_errors_are_refused() {
    let mut volume = Volume::zeroed(1, |text| text, |text| text);
    let store = volume.bench.store.clone();
    let machine = &mut volume.bench.machine;
    assert!(good(machine.volumetric().unwrap().state(&store)).is_none());
    let refused = machine.volumetric().unwrap().reference(&store).unwrap_err();
    assert!(refused.to_string().contains("never measured"), "{refused}");
    let first = volume.know_errors();
    good(volume.work().reference(&store));
    volume.remember_bow(Metres::from_um(15.0));
    let (_, records) = good(volume.work().state(&store)).expect("it is stored");
    assert_eq!(records.geometry, first);
    assert!(records.references.is_some() && records.first_memory.is_some());
    // The machine is warmer now: other errors, other references.
    let second = volume.know_errors();
    assert_ne!(first, second);
    let refused = volume.work().state(&store).unwrap_err();
    let text = refused.to_string();
    assert!(
        text.contains(&first[..12]) && text.contains(&second[..12]),
        "{text}"
    );
    assert!(text.contains("truestage reference"), "{text}");
    assert_eq!(refused.exit_code(), 3);
    good(volume.work().reference(&store));
    let refused = volume.work().state(&store).unwrap_err();
    assert!(
        refused.to_string().contains("truestage memory clear"),
        "{refused}"
    );
    let cleared = volume
        .work()
        .clear_memory(&store, truestage::volumetric::MemoryName::First);
    assert_eq!(good(cleared), (records.first_memory, None));
    assert!(good(volume.work().state(&store)).is_some());
}

#[test]
fn the_pinned_log_of_three_axes_is_that_of_every_computer() {
    super::pinned::check("volumetric");
}
