//! Three axes of another kind than the shipped ones, calibrated and corrected alike.

use core::time::Duration;

use tests::Edit;
use tests::volume::{Frame, TRAVEL_MM, Volume, calm, good, percentile_95, spread};
use truestage::volumetric::WarmUp;
use units::Metres;

/// Where the volume begins.
const LOW_MM: [f64; 3] = [0.0, 100.0, 50.0];
/// How long the machine becomes warm for its warm lines, and before it works.
const WARM_UP: Duration = Duration::from_secs(2 * 3600);

/// A table under a column, its volume away from the axes' zeros.
fn table_under_a_column(text: String) -> String {
    calm(text)
        .edit("chain = \"FXYZ\" ", "chain = \"XFYZ\" ")
        .edit("low_mm = [0.0, 0.0, 0.0]", &format!("low_mm = {LOW_MM:?}"))
        .edit(
            "from_mm = [0.0, 0.0, 150.0]",
            "from_mm = [0.0, 100.0, 150.0]",
        )
}

/// `count` places of that volume.
fn places(first: u32, count: u32) -> Vec<[f64; 3]> {
    let inside = |mm: [f64; 3]| {
        core::array::from_fn(|k| LOW_MM[k] + mm[k] / TRAVEL_MM[k] * (TRAVEL_MM[k] - LOW_MM[k]))
    };
    spread(first, count).into_iter().map(inside).collect()
}

/// The table's own detectors tell where it strays and how it rolls: the tool sees the opposite.
/// Where the other axes are at is no lever of the table's detector.
#[test]
fn a_table_under_a_column_is_calibrated_and_corrected_away_from_zero_too() {
    let zeroed = || {
        Volume::zeroed(3, table_under_a_column, |text| {
            text.edit("chain = \"FXYZ\" ", "chain = \"XFYZ\" ")
        })
    };
    let mut volume = zeroed();
    assert_eq!(volume.work().config().chain, "XFYZ");
    let store = volume.bench.store.clone();
    let mut hand = volume.bench.emulated.clone();
    let machine = &mut volume.bench.machine;
    good(
        machine
            .volumetric()
            .unwrap()
            .calibrate(&store, WarmUp::Idle(WARM_UP), None, &mut hand),
    );

    let mut later = zeroed();
    later.inherit(&volume);
    let (mut mover, state) = later.corrected();
    let everywhere = places(0, 100);
    let frame = Frame::of(&everywhere, &later.by_tables(&everywhere, &state));
    let mut left = Vec::new();
    for first in [100, 110] {
        let here = places(first, 10);
        let off = later.visit(&mut mover, &here, &mut Vec::new());
        left.push(percentile_95(&frame.all_seen(&here, &off)));
        good(later.bench.machine.idle(WARM_UP));
        good(
            later
                .bench
                .machine
                .volumetric()
                .unwrap()
                .correct(&mut mover, true),
        );
    }
    let found = percentile_95(&later.uncorrected(&everywhere));
    let tables = later.by_tables(&everywhere, &state);
    let tables = percentile_95(&frame.all_seen(&everywhere, &tables));
    let [cold, warm] = [left[0], left[1]].map(Metres::um);
    println!(
        "{} um found, {} by tables, {cold} cold, {warm} um warm",
        found.um(),
        tables.um()
    );
    assert!(
        found.um() >= 15.0 && tables.um() >= 5.0,
        "{found:?} {tables:?}"
    );
    assert!(cold <= 2.0 && warm <= 2.0, "{cold} um cold, {warm} um warm");
}

/// Whoever states the order of the axes wrongly gets no calibration: the readings contradict one another. Here the machine
/// is another one than usual; machines as usual of which another order is stated are in `volumetric_cause`.
#[test]
fn a_chain_that_is_stated_wrongly_is_never_stored() {
    let built = |text: String| text.edit("chain = \"FXYZ\" ", "chain = \"XFYZ\" ");
    let mut volume = Volume::zeroed(2, calm, built);
    let store = volume.bench.store.clone();
    let mut hand = volume.bench.emulated.clone();
    let mut work = volume.bench.machine.volumetric().unwrap();
    let made = work.calibrate(&store, WarmUp::Idle(WARM_UP), None, &mut hand);
    let text = made.err().map(|failure| failure.to_string());
    let text = text.expect("a table under the column was stored as one that is fixed");
    assert!(text.contains("nothing was stored"), "{text}");
    assert!(text.contains("scatter"), "{text}");
}
