use super::*;
use crate::hall_zero::rig::{Noise, Passed as Stage};

const STAGE: Stage = Stage {
    noise_mv: 0.2,
    repeatability_nm: 25.0,
    lost_motion_um: 1.0,
    zero_um: 0.0,
};

#[test]
fn lost_motion_is_told_and_has_no_part_in_the_origin() {
    for lost_motion_um in [0.0, 4.0, 20.0] {
        let stage = Stage {
            lost_motion_um,
            ..STAGE
        };
        let passes = stage.passes(6, &mut Noise(3));
        let zero = refine_passes(&passes, &RefineOptions::default()).unwrap();
        let told = zero.passes.unwrap();
        let off = told.lost_motion - Metres::from_um(lost_motion_um);
        assert!(off.abs() < Metres::from_um(0.15), "{told:?}");
        assert!(zero.origin.abs() < Metres::from_um(0.15), "{zero:?}");
        assert_eq!(told.degrees_of_freedom, 4);
    }
}

/// Noise of the sensors in millivolts, what the stage repeats to in nanometres, lost motion in micrometres.
const SORTS: [(f64, f64, f64); 6] = [
    (0.2, 25.0, 1.0),
    (0.02, 25.0, 1.0),
    (0.01, 10.0, 0.0),
    (0.02, 1000.0, 4.0),
    (0.5, 300.0, 20.0),
    (0.2, 0.0, 0.0),
];

/// Of `count` stages of each sort none is refused, and the origin lies within twice the stated uncertainty as
/// often as that promises, by sort and over all, give or take 3.7 standard uncertainties of what is counted.
fn judge_stages(seed: u64, count: u32) {
    let mut noise = Noise(seed);
    let is_right = |share: f64, count: u32| {
        let chance = 3.7 * (0.0455 * 0.9545 / f64::from(count)).sqrt();
        (0.9545 - chance..=0.9545 + chance).contains(&share)
    };
    let mut all = 0.0;
    for (noise_mv, repeatability_nm, lost_motion_um) in SORTS {
        let stage = Stage {
            noise_mv,
            repeatability_nm,
            lost_motion_um,
            zero_um: 0.0,
        };
        let (mut covered, mut squares) = (0, 0.0);
        for _ in 0..count {
            let passes = stage.passes(6, &mut noise);
            let zero = refine_passes(&passes, &RefineOptions::default());
            let zero = zero.unwrap_or_else(|error| panic!("{noise_mv} mV: {error}"));
            let ratio = zero.origin / zero.standard_uncertainty;
            covered += usize::from(ratio.abs() <= 2.0);
            squares += ratio * ratio;
        }
        let share = covered as f64 / f64::from(count);
        let square = squares / f64::from(count);
        println!("{noise_mv} mV, {repeatability_nm} nm: within 2u {share}, mean square {square}");
        assert!(is_right(share, count), "{share}");
        all += share / SORTS.len() as f64;
    }
    println!("all: within 2u {all}");
    assert!(is_right(all, count * SORTS.len() as u32), "{all}");
}

#[test]
fn sound_stages_are_not_blamed_and_their_uncertainty_is_whole() {
    judge_stages(17, 80);
}

#[test]
#[ignore = "a count of a minute"]
fn sound_stages_counted_over_many() {
    judge_stages(2_024, 4000);
}

#[test]
fn one_direction_alone_says_nothing_of_lost_motion() {
    let mut all = STAGE.passes(6, &mut Noise(5));
    all.retain(|it| it.approach == Approach::Forward);
    let error = refine_passes(&all, &RefineOptions::default()).unwrap_err();
    let expected = RefineError::TooFewPasses {
        approach: Approach::Reverse,
        seen: 0,
    };
    assert_eq!(error, expected);
}

#[test]
fn interference_within_a_pass_is_refused() {
    let mut all = STAGE.passes(6, &mut Noise(6));
    for (at, point) in all[3].points.iter_mut().enumerate() {
        point.slope += Volts(3e-3 * (at as f64 * 0.9).sin());
    }
    let error = refine_passes(&all, &RefineOptions::default()).unwrap_err();
    assert!(matches!(error, RefineError::LackOfFit { .. }), "{error}");
}

#[test]
fn a_sweep_is_parted_where_it_turns_and_not_where_it_trembles() {
    let place = |um: f64| HallPoint {
        position: Metres::from_um(um),
        peak: Volts(1.0),
        slope: Volts(1.0),
    };
    let places = [
        0.0, -1.0, 20.0, 19.0, 60.0, 100.0, 99.0, 50.0, 51.0, 0.0, 40.0, 90.0,
    ];
    let sweep = HallSeries::new(places.map(place).to_vec()).unwrap();
    let parts = Pass::all_of(&sweep);
    let seen: Vec<_> = parts
        .iter()
        .map(|it| (it.approach, it.points.len()))
        .collect();
    let expected = [
        (Approach::Forward, 6),
        (Approach::Reverse, 5),
        (Approach::Forward, 3),
    ];
    assert_eq!(seen, expected);
    assert_eq!(parts[1].points[0].position, Metres::from_um(100.0));
    let standing = HallSeries::new(vec![place(1.0); 3]).unwrap();
    assert_eq!(Pass::all_of(&standing).len(), 1);
}
