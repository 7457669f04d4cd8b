use super::*;
use crate::hall_zero::rig::{Magnets, Noise, sweep};

#[test]
fn a_sweep_measured_elsewhere_gives_the_origin_with_an_honest_uncertainty() {
    let (mut squares, mut chi) = (0.0, 0.0);
    let runs = 60;
    for seed in 0..runs {
        let mut noise = Noise(seed * 77 + 5);
        let magnets = Magnets::drifted(&mut noise, 0.0);
        let points = sweep(&magnets, &mut noise, 1.0, 4);
        let zero = fit_hall(&HallSeries::new(points).unwrap()).unwrap();
        squares += zero.origin.value().powi(2);
        chi += (zero.origin / zero.standard_uncertainty).powi(2);
    }
    let (rms, chi) = ((squares / runs as f64).sqrt(), chi / runs as f64);
    println!("sweep: {:.1} nm rms, chi²/n {chi:.2}", rms * 1e9);
    assert!(rms < 30e-9, "{:.1} nm", rms * 1e9);
    assert!((0.6..1.5).contains(&chi), "chi²/n = {chi}");
}

#[test]
fn the_noise_found_from_neighbours_is_the_real_one() {
    let mut noise = Noise(9);
    let points = sweep(&Magnets::IDEAL, &mut noise, 1.0, 2);
    let zero = refine(&points, &RefineOptions::default()).unwrap();
    assert!(
        (zero.noise_peak.value() / 0.2e-3 - 1.0).abs() < 0.1,
        "{zero:?}"
    );
    assert!(
        (zero.residual_rms_slope.value() / 0.2e-3 - 1.0).abs() < 0.15,
        "{zero:?}"
    );
    assert!((zero.mid_voltage.value() - 2.5).abs() < 1e-3);
}

#[test]
fn noiseless_curves_give_the_origin_to_a_nanometre() {
    let points: Vec<HallPoint> = sweep(&Magnets::IDEAL, &mut Noise(1), 1.0, 2)
        .into_iter()
        .map(|p| {
            let [v1, v2] = Magnets::IDEAL.volts(p.position.mm());
            HallPoint {
                position: p.position,
                peak: Volts(v1),
                slope: Volts(v2),
            }
        })
        .collect();
    let options = RefineOptions {
        excess_max: f64::INFINITY,
        ..Default::default()
    };
    let zero = refine(&points, &options).unwrap();
    assert!(zero.origin.abs().nm() < 1.0, "{} nm", zero.origin.nm());
}

#[test]
fn a_sweep_in_one_direction_says_that_it_cannot_see_a_lag() {
    let mut noise = Noise(11);
    let points = sweep(&Magnets::IDEAL, &mut noise, 1.0, 1);
    let zero = refine(&points, &RefineOptions::default()).unwrap();
    assert_eq!(zero.lag_samples, None);
}

#[test]
fn wild_samples_are_left_out_and_counted_and_too_many_refused() {
    let spoiled = |share: f64| {
        let mut noise = Noise(13);
        let mut points = sweep(&Magnets::IDEAL, &mut noise, 1.0, 4);
        for p in &mut points {
            if noise.uniform() < share {
                p.peak += Volts(0.05 + 0.1 * noise.uniform());
                p.slope += Volts(0.05 + 0.1 * noise.uniform());
            }
        }
        refine(&points, &RefineOptions::default())
    };
    let zero = spoiled(0.05).unwrap();
    assert!((zero.outlier_share - 0.05).abs() < 0.02, "{zero:?}");
    assert!(zero.origin.abs().nm() < 100.0, "{} nm", zero.origin.nm());
    assert!(matches!(
        spoiled(0.3),
        Err(RefineError::TooManyOutliers { .. })
    ));
}

fn check_refused(change: impl Fn(&mut HallPoint), says: &str) {
    let mut noise = Noise(17);
    let mut points = sweep(&Magnets::IDEAL, &mut noise, 1.0, 2);
    points.iter_mut().for_each(change);
    let error = refine(&points, &RefineOptions::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains(says), "{error}");
}

#[test]
fn what_is_not_a_pair_of_hall_curves_is_refused_with_the_reason() {
    check_refused(|p| core::mem::swap(&mut p.peak, &mut p.slope), "swapped");
    check_refused(|p| p.peak = Volts(5.0) - p.peak, "inverted or swapped");
    check_refused(|p| p.slope = Volts(2.5), "does not pass");
    check_refused(|p| p.peak = Volts(f64::NAN), "sample 0 is not finite");
    check_refused(
        |p| p.peak += Volts(5e-3 * (p.position.value() * 2.0e5).sin()),
        "off any smooth curve",
    );
}

#[test]
fn a_sweep_that_misses_a_flank_or_has_few_samples_is_refused() {
    let mut noise = Noise(19);
    let all = sweep(&Magnets::IDEAL, &mut noise, 1.0, 2);
    let options = RefineOptions {
        level: Level::BelowPeak(Volts(0.4)),
        ..Default::default()
    };
    let part: Vec<HallPoint> = all
        .iter()
        .copied()
        .filter(|p| p.position.value() < 0.2e-3)
        .collect();
    assert!(matches!(
        refine(&part, &options),
        Err(RefineError::FlankNotCovered {
            side: Side::Right,
            ..
        })
    ));
    let few: Vec<HallPoint> = all.iter().copied().step_by(40).collect();
    assert!(matches!(
        refine(&few, &options),
        Err(RefineError::TooFewSamples { .. })
    ));
    assert!(refine(&[], &options).is_err());
    assert!(refine(&all[..1], &options).is_err());
}

#[test]
fn one_threshold_moves_with_the_offset_where_the_pair_does_not() {
    let mut noise = Noise(23);
    let magnets = Magnets {
        offset: [2.0, 2.6],
        ..Magnets::IDEAL
    };
    let points = sweep(&magnets, &mut noise, 1.0, 2);
    let single = single_threshold_zero(&points, Volts(2.5), Metres(50e-6)).unwrap();
    let pair = refine(&points, &RefineOptions::default()).unwrap().origin;
    assert!(single.um() < -50.0, "{} um", single.um());
    assert!(pair.abs().um() < 0.1);
}
