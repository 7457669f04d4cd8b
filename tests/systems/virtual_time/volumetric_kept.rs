//! What three axes are to keep although it deviates, and the roll of a slide.

use core::time::Duration;

use compensator::volumetric::Axis;
use compensator::volumetric::online::{Memories, StateMap};
use tests::Edit;
use tests::volume::{Off, Volume, beyond, calm, good, largest, percentile_95, size, spread};
use truestage::volumetric::{MemoryName, VolumetricState};
use units::{Metres, Time};

/// The tool of the shipped machine, and of its emulation.
const TOOL: &str = "tool_offset_mm = [0.0, 0.0, -100.0]";

/// When what is deliberate begins.
const BEGINS_S: f64 = 360.0;

/// With its errors known and the detectors' references taken.
fn known(seed: u64, machine: impl Fn(String) -> String, deliberate: &str, own: &str) -> Volume {
    let emulated = |text: String| {
        text.edit(deliberate, own)
            .edit("deliberate_from_h = 0.0", "deliberate_from_h = 0.1")
            .edit(TOOL, &machine(TOOL.to_owned()))
    };
    let mut volume = Volume::zeroed(seed, |text| calm(machine(text)), emulated);
    volume.know_errors();
    let store = volume.bench.store.clone();
    good(volume.work().reference(&store));
    volume
}

fn idle_until(volume: &mut Volume, seconds: f64) {
    let machine = &mut volume.bench.machine;
    let pause = Time::from_seconds(seconds).since(machine.now());
    if pause > Duration::from_secs(1) {
        good(machine.idle(pause));
    }
}

/// What the deliberate part does to the tool at these places.
fn deliberate(volume: &Volume, places: &[[f64; 3]]) -> Vec<Off> {
    volume.truth(|truth| {
        let before = truth.at(Time::from_seconds(BEGINS_S - 1e-3));
        let after = truth.at(Time::from_seconds(BEGINS_S + 1e-3));
        let one = |mm: &[f64; 3]| {
            let scales = mm.map(Metres::from_mm);
            let (before, after) = (before.deviation_for(scales), after.deviation_for(scales));
            core::array::from_fn(|k| after[k] - before[k])
        };
        places.iter().map(one).collect()
    })
}

/// The x guide bows by 15 um, and its slide pitches along: the first memory lets the tool follow.
#[test]
fn a_bow_that_a_machine_was_built_with_is_kept() {
    let same = |text: String| text;
    let bow = "deliberate_bow_um = 15.0";
    let mut volume = known(1, same, "deliberate_bow_um = 0.0", bow);
    assert!(volume.bench.machine.now() < Time::from_seconds(BEGINS_S));
    idle_until(&mut volume, BEGINS_S + 5.0);
    let places: Vec<[f64; 3]> = (0..=10)
        .map(|n| [f64::from(n) * 50.0, 200.0, 150.0])
        .collect();
    let expected = deliberate(&volume, &places);
    assert!(expected.iter().any(|it| it[2] > Metres::from_um(14.9)));
    let (mut mover, _) = volume.corrected();
    let without = volume.visit(&mut mover, &places, &mut Vec::new());
    volume.remember_bow(Metres::from_um(15.0));
    let (mut mover, _) = volume.corrected();
    let with = volume.visit(&mut mover, &places, &mut Vec::new());
    let (without, with) = (beyond(&without, &expected), beyond(&with, &expected));
    eprintln!(
        "{:.2} um without, {:.2} um with",
        largest(&without).um(),
        largest(&with).um()
    );
    assert!(largest(&without) > Metres::from_um(10.0));
    assert!(
        largest(&with) <= Metres::from_um(1.0),
        "{} um",
        largest(&with).um()
    );
}

/// The first part is made as the machine is after an hour, which is not right; the others are made
/// like it although the machine goes on. Without the memory they are right, and unlike it.
#[test]
fn fifty_parts_are_made_like_the_first_while_the_machine_drifts() {
    let same = |text: String| text;
    let none = "deliberate_bow_um = 0.0";
    let mut volume = known(1, same, none, none);
    idle_until(&mut volume, 3600.0);
    let store = volume.bench.store.clone();
    let places = spread(40, 2);
    let everywhere = spread(0, 100);
    let morning = volume.uncorrected(&everywhere);
    let (mut mover, part) = good(volume.work().first_part(&store));
    good(volume.work().correct(&mut mover, true));
    part.recorder.listen();
    let first = volume.visit(&mut mover, &places, &mut Vec::new());
    good(volume.work().keep_part(&store, mover, part));
    let (mut mover, state) = volume.corrected();
    assert!(state.memories.first.is_none() && state.memories.second.is_some());
    let mut worst = Metres(0.0);
    let mut unlike = Vec::new();
    for part in 2..=50 {
        idle_until(&mut volume, 3600.0 + f64::from(part) * 500.0);
        good(volume.work().correct(&mut mover, true));
        let errors = volume.visit(&mut mover, &places, &mut Vec::new());
        worst = worst.max(largest(&beyond(&errors, &first)));
        if [2, 50].contains(&part) {
            let forgetful = VolumetricState {
                memories: Memories::default(),
                ..state.clone()
            };
            let (mut without, _) = volume.corrected_by(forgetful);
            let errors = volume.visit(&mut without, &places, &mut Vec::new());
            assert!(largest(&errors) < Metres::from_um(2.0), "{errors:?}");
            unlike.push(largest(&beyond(&errors, &first)));
        }
    }
    let drifted = percentile_95(&beyond(&volume.uncorrected(&everywhere), &morning));
    eprintln!(
        "the first part is {:.2} um off, the others {:.2} um from it, {:.2} and {:.2} um without the \
         memory; the machine drifted by {:.2} um",
        largest(&first).um(),
        worst.um(),
        unlike[0].um(),
        unlike[1].um(),
        drifted.um()
    );
    let several = Metres::from_um(3.0);
    assert!(largest(&first) > several, "{} um", largest(&first).um());
    assert!(drifted > Metres::from_um(5.0), "{} um", drifted.um());
    assert!(worst <= Metres::from_um(1.0), "{} um", worst.um());
    assert!(unlike.iter().all(|it| *it > several), "{unlike:?}");
}

fn refusal(volume: &mut Volume) -> String {
    let store = volume.bench.store.clone();
    let stored = volume.work().state(&store);
    stored.unwrap_err().to_string()
}

/// In the middle of x, across it.
fn kept(map: &StateMap) -> [Metres; 2] {
    map.at(Axis::X, Metres::from_mm(250.0))
}

/// Whoever does what he is told to is not told it again.
#[test]
fn what_is_said_of_memories_that_do_not_belong_together_helps() {
    let same = |text: String| text;
    let mut volume = Volume::zeroed(1, calm, same);
    volume.know_errors();
    let store = volume.bench.store.clone();
    let refused = volume.work().record_memory(&store, MemoryName::First);
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("`truestage reference`"), "{refused}");
    good(volume.work().reference(&store));
    let record = |volume: &mut Volume, memory| {
        let recorded = volume.work().record_memory(&store, memory);
        good(recorded)
    };
    // References that were taken again.
    record(&mut volume, MemoryName::First);
    good(volume.work().reference(&store));
    let refused = refusal(&mut volume);
    let told = "`truestage memory record --memory first`";
    assert!(refused.contains(told), "{refused}");
    let again = record(&mut volume, MemoryName::First);
    assert!(
        kept(&again.map)
            .iter()
            .all(|it| it.abs() < Metres::from_um(1.0))
    );
    assert!(good(volume.work().state(&store)).is_some());
    let cleared = volume.work().clear_memory(&store, MemoryName::First);
    assert_eq!(good(cleared), (Some(again.id), None));
    idle_until(&mut volume, 2.0 * 3600.0);
    // All of it is in the second before there is a first.
    let all = record(&mut volume, MemoryName::Second);
    assert!(
        kept(&all.map)
            .iter()
            .any(|it| it.abs() > Metres::from_um(3.0))
    );
    let first = record(&mut volume, MemoryName::First);
    assert_eq!(first.foreign.as_ref(), Some(&all.id));
    let refused = refusal(&mut volume);
    assert!(refused.contains(&all.id[..12]), "{refused}");
    let told = "`truestage memory record --memory second`";
    assert!(refused.contains(told), "{refused}");
    let beyond = record(&mut volume, MemoryName::Second);
    assert_eq!(beyond.foreign, None);
    let stored = good(volume.work().state(&store));
    let (state, _) = stored.expect("it was stored");
    let both = state.memories.kept(Axis::X, Metres::from_mm(250.0));
    for (both, all) in both.into_iter().zip(kept(&all.map)) {
        assert!((both - all).abs() < Metres::from_um(0.5), "{both:?}");
    }
    // Without its first the second would keep less than there was.
    let machine = &mut volume.bench.machine;
    let cleared = good(
        machine
            .volumetric()
            .unwrap()
            .clear_memory(&store, MemoryName::First),
    );
    assert_eq!(cleared, (Some(first.id), Some(beyond.id.clone())));
    let refused = refusal(&mut volume);
    assert!(refused.contains("but none is in use"), "{refused}");
    let told = "`truestage memory clear --memory second`";
    assert!(refused.contains(told), "{refused}");
    let machine = &mut volume.bench.machine;
    let cleared = good(
        machine
            .volumetric()
            .unwrap()
            .clear_memory(&store, MemoryName::Second),
    );
    assert_eq!(cleared, (Some(beyond.id), None));
    assert!(good(volume.work().state(&store)).is_some());
}

/// 5 arcsec on a tool of 200 mm: 4.8 um.
#[test]
fn a_roll_is_corrected_at_a_long_tool() {
    let long = |text: String| text.edit(TOOL, "tool_offset_mm = [0.0, 0.0, -200.0]");
    let roll = "deliberate_roll_arcsec = 5.0";
    let mut volume = known(1, long, "deliberate_roll_arcsec = 0.0", roll);
    let places: Vec<[f64; 3]> = (1..=5).map(|n| [f64::from(n) * 90.0, 0.0, 0.0]).collect();
    let expected = deliberate(&volume, &places);
    assert!(
        expected
            .iter()
            .all(|it| (size(*it).um() - 4.85).abs() < 0.05),
        "{expected:?}"
    );
    let (mut mover, _) = volume.corrected();
    let before = volume.visit(&mut mover, &places, &mut Vec::new());
    assert!(volume.bench.machine.now() < Time::from_seconds(BEGINS_S));
    idle_until(&mut volume, BEGINS_S + 5.0);
    good(volume.work().correct(&mut mover, true));
    let after = volume.visit(&mut mover, &places, &mut Vec::new());
    let left = beyond(&after, &before);
    eprintln!(
        "{:.3} um left of {:.3} um",
        largest(&left).um(),
        largest(&expected).um()
    );
    assert!(
        largest(&left) <= largest(&expected) * 0.1,
        "{} um",
        largest(&left).um()
    );
}

/// What is left of a deliberate roll at a long tool once `keep` has made a memory of it, and the roll itself.
fn left_of_a_kept_roll(keep: impl Fn(&mut Volume)) -> (Vec<Off>, Vec<Off>) {
    let long = |text: String| text.edit(TOOL, "tool_offset_mm = [0.0, 0.0, -200.0]");
    let roll = "deliberate_roll_arcsec = 5.0";
    let mut volume = known(1, long, "deliberate_roll_arcsec = 0.0", roll);
    let places: Vec<[f64; 3]> = (1..=5).map(|n| [f64::from(n) * 90.0, 0.0, 0.0]).collect();
    let expected = deliberate(&volume, &places);
    let (mut mover, _) = volume.corrected();
    let before = volume.visit(&mut mover, &places, &mut Vec::new());
    assert!(volume.bench.machine.now() < Time::from_seconds(BEGINS_S));
    idle_until(&mut volume, BEGINS_S + 5.0);
    keep(&mut volume);
    let (mover, mut state) = volume.corrected();
    drop(mover);
    // A memory that was recorded also keeps by how much the slides had drifted aside by then.
    for map in [&mut state.memories.first, &mut state.memories.second] {
        map.iter_mut().for_each(|it| it.of = Default::default());
    }
    let (mut mover, state) = volume.corrected_by(state);
    let kept = state.memories.kept_roll(Axis::X, Metres::from_mm(250.0));
    assert!(
        (kept.arcsec() - 5.0).abs() < 0.3,
        "{} arcsec",
        kept.arcsec()
    );
    let after = volume.visit(&mut mover, &places, &mut Vec::new());
    (beyond(&after, &before), expected)
}

/// 5 arcsec on a tool of 200 mm, 4.8 um, that belong to the machine, or to the first part: the tool follows.
#[test]
fn a_roll_that_is_kept_is_not_corrected() {
    let designed = "axis,along,position_mm,value,unit\nx,roll,0,5,arcsec\nx,roll,500,5,arcsec\n";
    let import = |volume: &mut Volume| volume.remember(designed);
    let record = |volume: &mut Volume| {
        let store = volume.bench.store.clone();
        let recorded = volume.work().record_memory(&store, MemoryName::Second);
        assert!(good(recorded).map.roll[0].is_some());
    };
    let ways: [&dyn Fn(&mut Volume); 2] = [&import, &record];
    for keep in ways {
        let (left, expected) = left_of_a_kept_roll(keep);
        let off = largest(&beyond(&left, &expected));
        eprintln!("{:.3} um off {:.3} um", off.um(), largest(&expected).um());
        assert!(largest(&expected) > Metres::from_um(4.0));
        assert!(off <= largest(&expected) * 0.1, "{} um", off.um());
    }
}
