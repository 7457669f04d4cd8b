//! Roll detectors on each of three slides: what they see of a roll is corrected, and belongs to a memory, on every one.

use core::time::Duration;

use compensator::volumetric::Axis;
use tests::Edit;
use tests::volume::{Off, Volume, calm, good, largest};
use truestage::for_tests::with_three_rolls;
use truestage::volumetric::MemoryName;
use units::{Metres, Time};

/// The tool of the shipped machine and of its emulation, and one on which each roll has a lever.
const TOOL: &str = "tool_offset_mm = [0.0, 0.0, -100.0]";
const ON_LEVERS: &str = "tool_offset_mm = [200.0, 0.0, -150.0]";
/// When what is deliberate begins.
const BEGINS_S: f64 = 360.0;
/// The further module's emulation, before the interferometer's.
const NODE: &str = r#"
[[nodes]]
name = "roll_more"
port = "can0"
[nodes.device]
kind = "cia404_analog"
node_id = 15
identity = { vendor_id = 0x7FF, product_code = 0x40_0004, revision = 0x1_0000, serial_number = 4015 }
plant_channels = [32, 33, 34, 35, 26, 27, 28, 29]
full_scale_v = 5.0
resolution_bits = 16

# In its case until"#;

/// The machine with detectors on x, y and z.
pub(super) fn three_rolls(text: &str) -> String {
    with_three_rolls(text).edit(TOOL, ON_LEVERS)
}

/// What emulates them.
pub(super) fn emulated_three_rolls(text: &str) -> String {
    let more_axes = "\naxis = 0\nfurther_axes = [1, 2]\ndistance_mm";
    text.edit("\naxis = 0\ndistance_mm", more_axes)
        .edit("\n# In its case until", NODE)
        .edit(TOOL, ON_LEVERS)
}

/// With its errors known and the detectors' references taken; the slide of `axis` rolls by 5 arcsec from then on.
fn known(axis: Axis) -> Volume {
    let emulated = |text: String| {
        let which = format!("deliberate_roll_axis = {}", axis.index());
        let roll = format!("deliberate_roll_arcsec = 5.0\n{which}");
        emulated_three_rolls(&text)
            .edit("deliberate_roll_arcsec = 0.0", &roll)
            .edit("deliberate_from_h = 0.0", "deliberate_from_h = 0.1")
    };
    let mut volume = Volume::zeroed(1, |text| calm(three_rolls(&text)), emulated);
    volume.know_errors();
    let store = volume.bench.store.clone();
    good(volume.work().reference(&store));
    volume
}

fn between(after: &[Off], before: &[Off]) -> Vec<Off> {
    let pairs = after.iter().zip(before);
    pairs
        .map(|(a, b)| core::array::from_fn(|k| a[k] - b[k]))
        .collect()
}

/// What the deliberate roll does to the tool at these places.
fn deliberate(volume: &Volume, places: &[[f64; 3]]) -> Vec<Off> {
    volume.truth(|truth| {
        let at = |seconds: f64| {
            let then = truth.at(Time::from_seconds(seconds));
            let one = |mm: &[f64; 3]| then.deviation_for(mm.map(Metres::from_mm));
            places.iter().map(one).collect::<Vec<Off>>()
        };
        between(&at(BEGINS_S + 1e-3), &at(BEGINS_S - 1e-3))
    })
}

/// Levers of 200 and 150 mm: 4.8 um and more at the tool.
#[test]
fn a_roll_of_any_slide_is_corrected_and_kept_by_a_memory() {
    for axis in [Axis::Y, Axis::Z] {
        let mut volume = known(axis);
        let places: Vec<[f64; 3]> = (1..=3).map(|n| [f64::from(n) * 90.0; 3]).collect();
        let expected = deliberate(&volume, &places);
        let size = largest(&expected);
        assert!(size > Metres::from_um(4.0), "{axis}: {} um", size.um());
        let (mut mover, state) = volume.corrected();
        assert!(state.rolls.iter().all(Option::is_some));
        let before = volume.visit(&mut mover, &places, &mut Vec::new());
        let now = volume.bench.machine.now();
        assert!(now < Time::from_seconds(BEGINS_S));
        let pause = Time::from_seconds(BEGINS_S + 5.0).since(now);
        assert!(pause > Duration::ZERO);
        good(volume.bench.machine.idle(pause));
        good(volume.work().correct(&mut mover, true));
        let after = volume.visit(&mut mover, &places, &mut Vec::new());
        let left = largest(&between(&after, &before));
        drop(mover);

        let store = volume.bench.store.clone();
        let recorded = good(volume.work().record_memory(&store, MemoryName::Second));
        let rolls = recorded.map.roll.iter().filter(|it| it.is_some());
        assert_eq!(rolls.count(), 3);
        // It also keeps by how much the slides had drifted aside by then.
        let (mover, mut state) = volume.corrected();
        drop(mover);
        let second = &mut state.memories.second;
        second.iter_mut().for_each(|it| it.of = Default::default());
        let (mut mover, _) = volume.corrected_by(state);
        let kept = volume.visit(&mut mover, &places, &mut Vec::new());
        let off = largest(&between(&between(&kept, &before), &expected));
        eprintln!(
            "{axis}: {:.3} um left of {:.3} um, {:.3} um off it when it is kept",
            left.um(),
            size.um(),
            off.um()
        );
        assert!(left <= size * 0.1, "{axis}: {} um left", left.um());
        assert!(off <= size * 0.1, "{axis}: {} um off", off.um());
    }
}
