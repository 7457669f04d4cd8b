//! Errors of three axes that make them worse, and such as do not: what is used afterwards, and what is told.

use tests::volume::{GEOMETRY, REFERENCES, Volume, calm, good};
use truestage::Failure;
use truestage::volumetric::{GeometryContent, VerifyBy};

/// What is used of the errors and of the references.
fn in_use(volume: &Volume) -> [Option<String>; 2] {
    let pointer = |name| good(volume.bench.store.active(name)).current;
    [GEOMETRY, REFERENCES].map(pointer)
}

/// Whether the line is within its tolerance, corrected by everything that is stored.
fn verify(volume: &mut Volume) -> Result<bool, Failure> {
    let store = volume.bench.store.clone();
    let mut hand = volume.bench.emulated.clone();
    let by = VerifyBy::Everything;
    let verified = volume.work().verify(&store, by, &mut hand)?;
    Ok(verified.is_within_tolerance())
}

/// The errors called `id` with the other sign, as somebody imports them whose other program has it, in use.
fn use_reversed(volume: &mut Volume, id: &str) -> String {
    let store = volume.bench.store.clone();
    let mut record = good(store.load::<GeometryContent>(id));
    let content = &mut record.content;
    let functions = content.functions.iter_mut();
    for value in functions.flat_map(|it| &mut it.values_si) {
        *value = -*value;
    }
    content.squareness_rad = content.squareness_rad.map(|it| -it);
    let wrong = good(store.save(&record));
    good(store.activate(GEOMETRY, &wrong));
    good(volume.work().reference(&store));
    wrong
}

#[track_caller]
fn check_worse(failure: &Failure, words: &[&str]) {
    assert!(matches!(failure, Failure::MadeWorse { .. }), "{failure}");
    assert_eq!(failure.exit_code(), 5);
    let told = failure.to_string();
    println!("{told}");
    for word in words {
        assert!(told.contains(word), "`{word}` is not in: {told}");
    }
}

#[test]
fn good_errors_stay_and_such_as_make_it_worse_give_way_to_them_with_their_references() {
    let mut volume = Volume::zeroed(18, calm, |text| text);
    let right = volume.know_errors();
    let store = volume.bench.store.clone();
    good(volume.work().reference(&store));
    let before = in_use(&volume);
    assert!(
        good(verify(&mut volume)),
        "good ones are within the tolerance"
    );
    assert_eq!(in_use(&volume), before);
    let wrong = use_reversed(&mut volume, &right);
    let failure = verify(&mut volume).expect_err("it is worse");
    check_worse(
        &failure,
        &[
            &wrong[..12],
            "its SIGN is wrong",
            &right[..12],
            "is in use again",
        ],
    );
    assert_eq!(in_use(&volume), before);
    assert!(good(verify(&mut volume)), "and is as good as it was");
}

#[test]
fn errors_that_are_the_first_and_make_it_worse_leave_nothing_in_use() {
    let mut volume = Volume::zeroed(19, calm, |text| text);
    let right = volume.know_errors();
    good(volume.bench.store.retire(GEOMETRY));
    assert_eq!(in_use(&volume), [None, None]);
    use_reversed(&mut volume, &right);
    let failure = verify(&mut volume).expect_err("it is worse");
    check_worse(&failure, &["its SIGN is wrong", "no calibration now"]);
    assert_eq!(in_use(&volume), [None, None]);
}
