//! Calibrations of a rotary table that make it worse, and such as do not: what is used afterwards, and what is told.

use tests::{Bench, Edit, Hand};
use truestage::for_tests::{RotaryCalibrated, RotaryVerified};
use truestage::rotary::{RotaryContent, RotaryFailure};
use truestage::{CalibrateOptions, Failure};

use super::rotary::{hand_of, started};

const AXIS: &str = "c";

/// The patent's two placements: nothing is left over by which a plate that was turned wrongly would show.
fn two_placements(text: String) -> String {
    text.edit("placements = 4 ", "offsets = [0, 1] ")
        .edit("optimise = ", "# ")
        .edit("amplification_limit = 3.0", "amplification_limit = 100.0")
        .edit("tolerance_arcsec = 0.3", "tolerance_arcsec = 3.0")
}

/// What `calibrate --verify` does.
fn calibrate_and_verify(
    bench: &mut Bench,
    hand: &mut Hand<'_>,
) -> (RotaryCalibrated, Result<RotaryVerified, Failure>) {
    let store = bench.store.clone();
    let mut made = None;
    let verified = bench.machine.guarded(|machine| {
        let options = CalibrateOptions::default();
        made = Some(machine.rotary(AXIS)?.calibrate(&store, &options, hand)?);
        machine.rotary(AXIS)?.verify(&store, true, hand)
    });
    let made = made.unwrap_or_else(|| panic!("it was not calibrated: {verified:?}"));
    (made, verified)
}

fn in_use(bench: &Bench) -> Option<String> {
    bench.store.active(AXIS).expect("a pointer").current
}

#[track_caller]
fn check_worse(failure: &Failure, words: &[&str]) {
    let of_table = failure.of_kind();
    assert!(
        matches!(of_table, Some(RotaryFailure::MadeWorse { .. })),
        "{failure}"
    );
    assert_eq!(failure.exit_code(), 5);
    let told = failure.to_string();
    for word in words {
        assert!(told.contains(word), "`{word}` is not in: {told}");
    }
}

/// The second time the plate is turned by a line the wrong way: its errors come out as the table's.
#[test]
fn a_calibration_that_makes_the_table_worse_is_not_used_and_the_good_one_before_is() {
    for seed in [71, 72, 73] {
        let mut bench = Bench::rotary(seed, two_placements, |text| text);
        started(&mut bench);
        let mut hand = hand_of(&bench.emulated).mistaken(5, -2.0).mistaken(6, 2.0);
        let (good, verified) = calibrate_and_verify(&mut bench, &mut hand);
        let verified = verified.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        assert!(verified.is_within_tolerance(), "seed {seed}: {verified:?}");
        assert_eq!(
            in_use(&bench).as_ref(),
            Some(&good.id),
            "a good one is used"
        );

        let (bad, verified) = calibrate_and_verify(&mut bench, &mut hand);
        let failure = verified.expect_err("it is worse");
        println!("seed {seed}: {failure}");
        check_worse(
            &failure,
            &[
                &bad.id[..12],
                "MAKES THE TABLE WORSE",
                "the axis has no such deviations",
                "turned the other way",
                &good.id[..12],
            ],
        );
        assert_eq!(in_use(&bench).as_ref(), Some(&good.id), "seed {seed}");
        assert_eq!(bench.store.list().expect("a folder").len(), 2);
        // And it is as good as it was.
        started(&mut bench);
        let store = bench.store.clone();
        let machine = &mut bench.machine;
        let loaded = machine.rotary(AXIS).unwrap().load_active(&store).unwrap();
        assert_eq!(loaded, Some(good.id));
        let again = machine
            .rotary(AXIS)
            .unwrap()
            .verify(&store, true, &mut hand);
        let again = again.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        assert!(again.is_within_tolerance(), "seed {seed}: {again:?}");
    }
}

/// As somebody imports it whose other program has the other sign: the plate is known rightly.
#[test]
fn a_table_with_the_other_sign_is_found_out_wherever_the_plate_is_put() {
    for (seed, offset) in [(74, "200.5"), (75, "40.0"), (76, "90.25")] {
        let placed = format!("offset_lines = {offset}");
        let at = |text: String| text.edit("offset_lines = 200.5", &placed);
        let mut bench = Bench::rotary(seed, at, |text| text);
        started(&mut bench);
        let mut hand = hand_of(&bench.emulated);
        let (good, verified) = calibrate_and_verify(&mut bench, &mut hand);
        verified.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        let store = bench.store.clone();
        let mut record = store
            .load::<RotaryContent>(&good.id)
            .expect("it was stored");
        for error in &mut record.content.table_error_rad {
            *error = -*error;
        }
        let wrong = store.save(&record).expect("there is room");
        store.activate(AXIS, &wrong).expect("there is room");
        let failure = bench
            .machine
            .guarded(|machine| {
                machine.rotary(AXIS)?.load_active(&store)?;
                machine.rotary(AXIS)?.verify(&store, true, &mut hand)
            })
            .expect_err("it is worse");
        println!("seed {seed}: {failure}");
        check_worse(&failure, &["its SIGN is wrong", &good.id[..12]]);
        assert_eq!(in_use(&bench), Some(good.id), "seed {seed}");
    }
}

#[test]
fn a_first_calibration_that_makes_the_table_worse_leaves_none_in_use() {
    let mut bench = Bench::rotary(77, two_placements, |text| text);
    started(&mut bench);
    let mut hand = hand_of(&bench.emulated).mistaken(2, -2.0).mistaken(3, 2.0);
    let (_, verified) = calibrate_and_verify(&mut bench, &mut hand);
    let failure = verified.expect_err("it is worse");
    check_worse(&failure, &["no calibration now"]);
    assert_eq!(in_use(&bench), None);
    let compensation = bench.machine.rotary(AXIS).unwrap();
    assert!(compensation.compensation().is_none());
}
