use nalgebra::{DMatrix, DVector};
use units::Approach;

use super::super::rig::{Noise, Screw, UM, dense, every, row, with_lead};
use super::*;
use crate::significance::student_limit;

fn numbers(fitted: &Fitted) -> Vec<u32> {
    fitted.model.harmonics.iter().map(|it| it.number).collect()
}

#[track_caller]
fn check_says(result: Result<Fitted, FitError>, says: &str) {
    let message = result.unwrap_err().to_string();
    assert!(message.contains(says), "{message}");
}

#[test]
fn data_without_noise_give_the_truth_and_no_harmonic() {
    let rows = Screw::PLAIN.measured(&dense(), 2, 0.0, &mut Noise(0));
    let fitted = fit(&rows, &with_lead()).unwrap();
    let model = &fitted.model;
    assert!((model.slope * 1e3 - 0.6).abs() < 1e-9);
    assert!((model.lost_motion.um() - 2.3).abs() < 1e-9);
    assert!((model.offset.um() - 0.3).abs() < 1e-9);
    assert_eq!(numbers(&fitted), []);
    assert!(fitted.residual.um() < 1e-9);
}

#[test]
fn periodic_terms_are_recovered_with_amplitude_and_phase() {
    let screw = Screw::with_waves(&[(1, 0.8, 0.4), (3, 0.25, -1.0)]);
    let rows = screw.measured(&dense(), 4, 0.1, &mut Noise(5));
    let fitted = fit(&rows, &with_lead()).unwrap();
    assert_eq!(numbers(&fitted), [1, 3]);
    for (i, (_, amplitude, phase)) in screw.waves.iter().enumerate() {
        let harmonic = fitted.model.harmonics[i];
        let [u_sine, u_cosine, u_amplitude] = fitted.model.u_harmonic(i).unwrap();
        let sine = (harmonic.sine.um() - amplitude * phase.cos()) / u_sine.um();
        let cosine = (harmonic.cosine.um() - amplitude * phase.sin()) / u_cosine.um();
        let size = (harmonic.amplitude().um() - amplitude) / u_amplitude.um();
        assert!(sine.abs() < 3.5 && cosine.abs() < 3.5 && size.abs() < 3.5);
        assert!(u_amplitude.um() < 0.02);
    }
    assert!((fitted.residual.um() - 0.1).abs() < 0.02);
    for mm in every(-7.0, 0.37, 40) {
        for approach in [Approach::Forward, Approach::Reverse] {
            let seen = fitted.model.predict(Metres::from_mm(mm), approach);
            let off = seen.deviation.um() - screw.deviation_um(mm, approach);
            assert!(off.abs() < 4.5 * seen.standard_uncertainty.unwrap().um());
        }
    }
}

/// Seeds 0 to 1999 at a level of 5 %: how often any of four harmonics is found where none is.
#[test]
fn false_harmonics_are_as_rare_as_the_level_says() {
    let options = FitOptions {
        significance: 0.05,
        ..with_lead()
    };
    let found = (0..2000)
        .filter(|&seed| {
            let rows = Screw::PLAIN.measured(&dense(), 2, 0.3, &mut Noise(seed));
            !fit(&rows, &options).unwrap().model.harmonics.is_empty()
        })
        .count();
    // Four tests at a fourth of the level: 4.9 %, with a standard deviation of 9.7 in 2000.
    assert!((68..=128).contains(&found), "{found} of 2000");
}

/// Seeds 0 to 199: a first harmonic of one scatter and a fourth of half of it are both found in ten repetitions of
/// 24 strokes, and nothing else is more often than the level allows.
#[test]
fn harmonics_that_are_there_are_found() {
    let screw = Screw::with_waves(&[(1, 0.3, 1.0), (4, 0.15, 2.0)]);
    let (mut both, mut others) = (0, 0);
    for seed in 0..200 {
        let rows = screw.measured(&dense(), 10, 0.3, &mut Noise(seed));
        let found = numbers(&fit(&rows, &with_lead()).unwrap());
        both += usize::from(found.contains(&1) && found.contains(&4));
        others += usize::from(found.contains(&2) || found.contains(&3));
    }
    assert!(both >= 190, "{both} of 200");
    assert!(others <= 6, "{others} of 200");
}

/// What the mean square of an estimate's error is in units of its uncertainty, which was widened for so many
/// degrees of freedom.
fn mean_square(freedom: usize) -> f64 {
    let (freedom, widened) = (freedom as f64, student_limit(0.0455, freedom) / 2.0);
    freedom / (freedom - 2.0) / (widened * widened)
}

/// Seeds 0 to 499: the mean of (estimate − truth)ᵀ covariance⁻¹ (estimate − truth)/p is within three standard
/// deviations of what it should be, and so is the mean square of each parameter alone.
#[test]
fn the_covariance_is_honest() {
    let screw = Screw::with_waves(&[(1, 1.0, 0.7)]);
    let (sin, cos) = 0.7_f64.sin_cos();
    let truth = [0.3 * UM, 0.6e-3, 2.3 * UM, cos * UM, sin * UM];
    let options = FitOptions {
        harmonics_max: 1,
        ..with_lead()
    };
    let runs = 500;
    let (mut together, mut alone, mut freedom) = (0.0, [0.0; 5], [0, 0]);
    for seed in 0..runs {
        let rows = screw.measured(&dense(), 2, 0.3, &mut Noise(9000 + seed));
        let fitted = fit(&rows, &options).unwrap();
        let m = &fitted.model;
        let wave = m.harmonics[0];
        let seen = [
            m.offset.value(),
            m.slope,
            m.lost_motion.value(),
            wave.sine.value(),
            wave.cosine.value(),
        ];
        let off = DVector::from_iterator(5, seen.iter().zip(truth).map(|(s, t)| s - t));
        let covariance = DMatrix::from_row_slice(5, 5, m.covariance.as_ref().unwrap());
        let whitened = covariance.clone().cholesky().unwrap().solve(&off);
        together += off.dot(&whitened) / 5.0;
        for i in 0..5 {
            alone[i] += off[i] * off[i] / covariance[(i, i)];
        }
        freedom = [fitted.degrees_of_freedom, fitted.degrees_of_freedom_within];
    }
    assert_eq!(freedom, [20, 23]);
    let count = runs as f64;
    let expected = mean_square(20);
    // Chi² of five has the variance 2/5 of its mean of 1, chi² of one 2; of uncertain scatter a little more.
    let mean = together / count;
    assert!(
        (mean - expected).abs() < 3.0 * (0.56 / count).sqrt(),
        "{mean} instead of {expected}"
    );
    for square in alone {
        let mean = square / count;
        assert!(
            (mean - expected).abs() < 3.0 * (2.8 / count).sqrt(),
            "{mean} instead of {expected}"
        );
    }
}

/// Seeds 0 to 299: the lost motion of 30 rows forward and 6 in reverse, strokes shared unevenly.
#[test]
fn unequal_repeats_bias_nothing_and_their_uncertainty_is_honest() {
    let (mut within, mut sum) = (0, 0.0);
    for seed in 0..300 {
        let mut noise = Noise(500 + seed);
        let mut rows = Screw::PLAIN.measured(&every(0.5, 0.5, 3), 2, 0.3, &mut noise);
        rows.extend((0..24).map(|_| {
            let um = Screw::PLAIN.deviation_um(1.5, Approach::Forward) + 0.3 * noise.normal();
            row(Approach::Forward, 1500.0, um)
        }));
        let model = fit(&rows, &FitOptions::default()).unwrap().model;
        let (off, u) = (model.lost_motion.um() - 2.3, model.u_lost_motion().unwrap());
        within += usize::from(off.abs() <= 2.0 * u.um());
        sum += off;
    }
    // 0.3 µm·√(1/10 + 1/6) is what any one is off by, at the best; 95.45 % of 300 are 286, give or take 3.6.
    assert!((sum / 300.0).abs() < 3.0 * 0.2 / 300.0_f64.sqrt(), "{sum}");
    assert!((275..=299).contains(&within), "{within} of 300");
}

/// An error of each stroke's own, ten times the repeatability, of both sides together and of each by itself: it is
/// told apart from the noise, and the lost motion keeps the smaller uncertainty only when the sides share it.
#[test]
fn errors_that_repeat_at_a_stroke_do_not_count_as_averaged_out() {
    for shared in [true, false] {
        let mut within = 0;
        for seed in 0..100 {
            let mut noise = Noise(70_000 + seed);
            let mut rows = Screw::PLAIN.measured(&dense(), 10, 0.03, &mut noise);
            let own: Vec<f64> = (0..48).map(|_| 0.3 * noise.normal()).collect();
            for (i, it) in rows.iter_mut().enumerate() {
                it.deviation += Metres::from_um(own[if shared { i % 24 } else { i % 48 }]);
            }
            let fitted = fit(&rows, &with_lead()).unwrap();
            let Scatter {
                stroke,
                side,
                repeatability,
            } = fitted.scatter;
            let large = if shared { stroke } else { side };
            assert!((0.15..0.5).contains(&large.um()), "{large:?}");
            assert!(!shared || side.um() < 0.03, "{side:?}");
            assert!((repeatability.um() - 0.03).abs() < 0.005);
            let u = fitted.model.u_lost_motion().unwrap().um();
            assert_eq!(u < 0.01, shared, "{u}");
            assert_eq!(
                fitted.lack_of_fit.is_some_and(|it| it.p_value < 1e-6),
                shared
            );
            let off = fitted.model.slope - 0.6e-3;
            within += usize::from(off.abs() <= 2.0 * fitted.model.u_slope().unwrap());
        }
        assert!((89..=100).contains(&within), "{within} of 100");
    }
}

/// Two strokes have a slope and a lost motion, and nothing to judge the slope by.
#[test]
fn what_two_strokes_cannot_tell_has_no_uncertainty() {
    let rows = Screw::PLAIN.measured(&[0.5, 1.5], 20, 0.1, &mut Noise(4));
    let fitted = fit(&rows, &FitOptions::default()).unwrap();
    assert!((fitted.model.slope * 1e3 - 0.6).abs() < 0.2);
    assert_eq!(
        (fitted.model.u_slope(), fitted.degrees_of_freedom),
        (None, 0)
    );
    assert!((fitted.model.scatter.unwrap().um() - 0.1).abs() < 0.03);
}

/// A harmonic that the model lacks shows in the slope as the leak says, and the longer the strokes the less.
#[test]
fn what_a_missing_harmonic_does_to_the_slope_is_said() {
    let mut before = f64::INFINITY;
    for turns in [1.0, 3.0, 9.0] {
        let strokes = every(0.0, turns * 2.0 / 24.0, 24);
        let options = FitOptions {
            harmonics_max: 1,
            significance: 1e-300,
            ..with_lead()
        };
        let slope = |phase: f64| {
            let screw = Screw::with_waves(&[(1, 1.0, phase)]);
            let fitted = fit(&screw.measured(&strokes, 1, 0.0, &mut Noise(0)), &options).unwrap();
            assert_eq!(numbers(&fitted), []);
            (fitted.model.slope - 0.6e-3, fitted.leaks[0])
        };
        let phases = every(0.0, 0.1, 63);
        let worst = phases
            .iter()
            .fold(0.0, |most: f64, it| most.max(slope(*it).0.abs()));
        let leak = slope(0.0).1;
        assert_eq!(leak.number, 1);
        let expected = leak.slope_per_amplitude * UM;
        assert!((worst / expected - 1.0).abs() < 0.01, "{worst} {expected}");
        assert!(expected < before);
        before = expected;
    }
}

#[test]
fn what_is_not_observable_is_named() {
    let forward: Vec<Stroke> = every(0.5, 0.5, 5)
        .iter()
        .map(|mm| row(Approach::Forward, mm * 1e3, 0.6 * mm))
        .collect();
    check_says(
        fit(&forward, &with_lead()),
        "only approach `+` was measured, so the lost motion is not observable",
    );
    // Forward at one stroke, in reverse at another: a slope or a lost motion?
    let mut apart = vec![row(Approach::Forward, 500.0, 1.0); 5];
    apart.extend([row(Approach::Reverse, 1500.0, 3.0); 5]);
    check_says(
        fit(&apart, &FitOptions::default()),
        "distinguish lost motion from slope",
    );
    // The patent's own strokes: 0.5, 1 and 1.5 mm at a lead of 2 mm.
    let both = |strokes: &[f64]| Screw::PLAIN.measured(strokes, 6, 0.1, &mut Noise(1));
    let patent = both(&every(0.5, 0.5, 3));
    check_says(
        fit(&patent, &with_lead()),
        "the strokes stand at 3 place(s) of the 2 mm lead, so its periodic error is not observable",
    );
    assert!(fit(&patent, &FitOptions::default()).is_ok());
    // Whole turns show nothing of the turn.
    check_says(
        fit(&both(&every(0.0, 2.0, 8)), &with_lead()),
        "at 1 place(s)",
    );
    // A tenth of a turn looks like a straight line.
    check_says(
        fit(&both(&every(0.0, 0.02, 11)), &with_lead()),
        "not observable",
    );
}

#[test]
fn harmonics_that_look_like_lower_ones_are_not_looked_for() {
    // Four places of the turn: the second has no sine there, the third looks like the first.
    let screw = Screw::with_waves(&[(1, 0.8, 0.4)]);
    let rows = screw.measured(&every(0.0, 0.5, 16), 4, 0.1, &mut Noise(3));
    let fitted = fit(&rows, &with_lead()).unwrap();
    assert_eq!(numbers(&fitted), [1]);
    assert_eq!(fitted.unobservable, [2, 3, 4]);
    assert_eq!(fitted.tests.len(), 1);
}

#[test]
fn few_strokes_test_fewer_harmonics_and_too_few_are_refused() {
    let screw = Screw::with_waves(&[(1, 5.0, 0.4)]);
    let measured = |count: u32| screw.measured(&every(0.0, 0.55, count), 1, 0.01, &mut Noise(3));
    let fitted = fit(&measured(7), &with_lead()).unwrap();
    assert_eq!(fitted.tests.len(), 1);
    assert!(fitted.unobservable.contains(&4));
    check_says(
        fit(&measured(4), &with_lead()),
        "a periodic error of 4 different strokes leave none from which to judge",
    );
    let three = [
        row(Approach::Forward, 500.0, 1.0),
        row(Approach::Forward, 1500.0, 2.0),
        row(Approach::Reverse, 500.0, 3.0),
    ];
    check_says(
        fit(&three, &FitOptions::default()),
        "3 rows for a model of 3 parameters",
    );
}

#[test]
fn options_and_values_that_are_none_are_refused() {
    let rows = Screw::PLAIN.measured(&dense(), 1, 0.1, &mut Noise(1));
    for significance in [0.0, 1.0, f64::NAN] {
        let options = FitOptions {
            significance,
            ..with_lead()
        };
        check_says(fit(&rows, &options), "significance level");
    }
    for lead in [0.0, -2.0, f64::NAN] {
        let options = FitOptions {
            lead: Some(Metres::from_mm(lead)),
            ..FitOptions::default()
        };
        check_says(fit(&rows, &options), "the lead is");
    }
    let mut wild = rows.clone();
    wild[3].deviation = Metres(f64::NAN);
    check_says(fit(&wild, &with_lead()), "observation 3 is not finite");
}
