use super::*;
use crate::hall_zero::rig::{Noise, Passed};
use crate::hall_zero::{Flank, Passes, RefineOptions, refine_passes};
use units::Volts;

const DISTANCE_MM: f64 = 400.0;

/// A zero point, so far known.
fn side(origin_um: f64, of_origin_nm: f64) -> ZeroEstimate {
    let flank = Flank {
        position: Metres::ZERO,
        standard_uncertainty: Metres::ZERO,
        slope_v_per_m: 1e3,
        slope_sensor: Volts::ZERO,
    };
    ZeroEstimate {
        origin: Metres::from_um(origin_um),
        standard_uncertainty: Metres(of_origin_nm * 1e-9),
        p0_patent: None,
        peak_max: Volts::ZERO,
        level: Volts::ZERO,
        left: flank,
        right: flank,
        mid_voltage: Volts::ZERO,
        centre_slope_v_per_m: 1e3,
        noise_peak: Volts::ZERO,
        noise_slope: Volts::ZERO,
        residual_rms_peak: Volts::ZERO,
        residual_rms_slope: Volts::ZERO,
        points: 0,
        outlier_share: 0.0,
        lag_samples: None,
        passes: Some(Passes {
            lost_motion: Metres::ZERO,
            scatter: Metres(of_origin_nm * 1e-9),
            of_origin: Metres(of_origin_nm * 1e-9),
            degrees_of_freedom: 4,
        }),
    }
}

fn base(u_mm: f64) -> Base {
    Base {
        distance: Metres::from_mm(DISTANCE_MM),
        standard_uncertainty: Metres::from_mm(u_mm),
        scale: 0.0,
    }
}

#[test]
fn the_side_whose_zero_point_lies_further_back_is_ahead() {
    let turned = rotation(&side(-10.0, 20.0), &side(30.0, 20.0), base(0.0));
    assert!((turned.angle.value() * 1e6 - 100.0).abs() < 1e-9);
    let the_other_way = rotation(&side(30.0, 20.0), &side(-10.0, 20.0), base(0.0));
    assert_eq!(the_other_way.angle.value(), -turned.angle.value());
}

/// By hand: 20 nm twice are 28.28 nm with eight degrees of freedom, whose t at 4.55 % is 2.366.
#[test]
fn both_sides_are_known_better_than_each_and_the_distance_counts_with_the_angle() {
    let turned = rotation(&side(0.0, 20.0), &side(0.0, 20.0), base(0.1));
    assert!((turned.degrees_of_freedom.unwrap() - 8.0).abs() < 1e-9);
    let u_nm = turned.standard_uncertainty.value() * DISTANCE_MM * 1e6;
    assert!((u_nm - 28.284 * 2.366 / 2.0).abs() < 0.02, "{u_nm} nm");
    // 0.1 mm of 400 mm, of an angle of 1 mrad, are 0.25 µrad.
    let turned = rotation(&side(0.0, 0.0), &side(400.0, 0.0), base(0.1));
    assert_eq!(turned.degrees_of_freedom, None);
    let u_urad = turned.standard_uncertainty.value() * 1e6;
    assert!((u_urad - 0.25).abs() < 1e-9, "{u_urad} urad");
}

/// By hand: 1000 ppm of 30 µm and of 40 µm are 30 nm and 40 nm, together 50 nm.
#[test]
fn encoders_that_err_count_with_how_far_each_side_is_from_its_zero_point() {
    let by_encoders = Base {
        scale: 1e-3,
        ..base(0.0)
    };
    let turned = rotation(&side(-30.0, 0.0), &side(40.0, 0.0), by_encoders);
    let u_nm = turned.standard_uncertainty.value() * DISTANCE_MM * 1e6;
    assert!((u_nm - 50.0).abs() < 1e-6, "{u_nm} nm");
}

/// Noise of the sensors and repeatability of each side, nanometres; the angle, microradians.
const SORTS: [([f64; 2], [f64; 2], f64); 5] = [
    ([0.2, 0.2], [25.0, 25.0], 100.0),
    ([0.02, 0.5], [25.0, 25.0], -50.0),
    ([0.2, 0.2], [10.0, 500.0], 200.0),
    ([0.02, 0.02], [1000.0, 1000.0], 0.0),
    ([0.2, 0.2], [25.0, 25.0], 500.0),
];

/// The angle lies within twice its stated uncertainty as often as that promises, by sort, give or take 3.7
/// standard uncertainties of the count.
fn judge_gantries(seed: u64, count: u32) {
    let mut noise = Noise(seed);
    for (noise_mv, repeatability_nm, angle_urad) in SORTS {
        let (mut covered, mut squares) = (0, 0.0);
        for _ in 0..count {
            let u_mm = 0.1;
            let true_mm = DISTANCE_MM + u_mm * noise.normal();
            let mut found = |at: usize, zero_um: f64| {
                let passed = Passed {
                    noise_mv: noise_mv[at],
                    repeatability_nm: repeatability_nm[at],
                    lost_motion_um: 1.0,
                    zero_um,
                };
                let passes = passed.passes(6, &mut noise);
                refine_passes(&passes, &RefineOptions::default()).unwrap()
            };
            // Micrometres are microradians times metres.
            let apart_um = angle_urad * true_mm * 1e-3;
            let (ahead, other) = (found(0, -apart_um / 8.0), found(1, apart_um * 7.0 / 8.0));
            let turned = rotation(&ahead, &other, base(u_mm));
            let off = turned.angle.value() - angle_urad * 1e-6;
            let ratio = off / turned.standard_uncertainty.value();
            covered += usize::from(ratio.abs() <= 2.0);
            squares += ratio * ratio;
        }
        let share = covered as f64 / f64::from(count);
        println!(
            "{noise_mv:?} mV, {repeatability_nm:?} nm, {angle_urad} urad: within 2u {share}, mean square {}",
            squares / f64::from(count)
        );
        let chance = 3.7 * (0.0455 * 0.9545 / f64::from(count)).sqrt();
        assert!(
            (0.9545 - chance..=0.975 + chance).contains(&share),
            "{share}"
        );
    }
}

#[test]
fn an_angle_lies_within_what_it_states() {
    judge_gantries(31, 80);
}

#[test]
#[ignore = "a count of a minute"]
fn angles_counted_over_many() {
    judge_gantries(3_031, 4000);
}
