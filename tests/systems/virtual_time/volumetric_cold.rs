//! A calibration without warm lines, of a machine that goes on warming up while its lines are read.

use tests::Edit;
use tests::volume::{Frame, GEOMETRY, Volume, good, percentile_95, spread};
use truestage::volumetric::GeometryContent;
use truestage::volumetric::WarmUp;
use units::Metres;

/// Hardly any gradient and films, but scales that become a kelvin and more warmer meanwhile.
fn warming(text: String) -> String {
    let mut text = text;
    for (from, to) in [
        ("scale_warming_k = 2.5", "scale_warming_k = 4.0"),
        (
            "scale_time_constant_min = 60.0",
            "scale_time_constant_min = 6.0",
        ),
        ("\ngradient_k = 1.2", "\ngradient_k = 0.05"),
        ("gradient_of_air = 0.3", "gradient_of_air = 0.02"),
        ("\nfilm_um = 7.0", "\nfilm_um = 0.5"),
    ] {
        text = text.edit(from, to);
    }
    text
}

/// What the configuration knows of warmth is taken off where it is read, and what it does not know
/// is told. Left in, a kelvin between an axis's line and the diagonals is 7 um on 0.7 m.
#[test]
fn warmth_while_lines_are_read_does_not_get_into_the_errors() {
    let mut volume = Volume::zeroed(5, |text| text, warming);
    let store = volume.bench.store.clone();
    let mut hand = volume.bench.emulated.clone();
    let cold = volume.truth(|truth| truth.scale_temperature(0));
    let machine = &mut volume.bench.machine;
    let made = good(
        machine
            .volumetric()
            .unwrap()
            .calibrate(&store, WarmUp::None, None, &mut hand),
    );
    let warmer = volume.truth(|truth| truth.scale_temperature(0)) - cold;
    assert!(warmer.value() > 0.7, "{warmer}");
    assert_eq!(made.unknown.bends.len(), 3, "nobody knows how guides bend");
    assert!(made.found.bends.is_empty() && made.unknown.without_effect.is_empty());
    let id = store.active(GEOMETRY).expect("it can be read").current;
    let record = store.load::<GeometryContent>(id.as_ref().expect("it is in use"));
    let record = record.expect("it can be read");
    let geometry = record.content;
    assert_eq!(geometry.unknown.bends, [['x', 'z'], ['y', 'z'], ['z', 'y']]);
    let places = spread(0, 30);
    let (mut mover, _) = volume.corrected();
    let errors = volume.visit(&mut mover, &places, &mut Vec::new());
    let left = percentile_95(&Frame::of(&places, &errors).all_seen(&places, &errors));
    let birge = made.found.birge_ratio;
    eprintln!("{warmer} warmer, {} um left, birge {birge:?}", left.um());
    assert!(left < Metres::from_um(2.0), "{} um", left.um());
}
