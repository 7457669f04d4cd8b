use super::super::fit::{Fitted, fit};
use super::super::rig::{Noise, Screw, dense, row, with_lead};
use super::*;

fn wavy(repeats: usize, noise: &mut Noise) -> Vec<Stroke> {
    Screw::with_waves(&[(1, 0.6, 0.4)]).measured(&dense(), repeats, 0.1, noise)
}

/// The fit of `strokes` names exactly the rows `expected`, and is that of the others.
#[track_caller]
fn check_left_out(strokes: &[Stroke], expected: &[usize]) -> Fitted {
    let fitted = fit(strokes, &with_lead()).unwrap();
    let seen: Vec<usize> = fitted.outliers.iter().map(|it| it.index).collect();
    assert_eq!(seen, expected);
    for it in &fitted.outliers {
        assert_eq!(it.stroke, strokes[it.index]);
    }
    let rows = strokes.iter().enumerate();
    let others = rows.filter(|(index, _)| !expected.contains(index));
    let others: Vec<Stroke> = others.map(|(_, it)| *it).collect();
    assert_eq!(fitted.model, fit(&others, &with_lead()).unwrap().model);
    fitted
}

#[test]
fn a_row_that_its_repetitions_contradict_is_named_and_left_out() {
    let mut strokes = wavy(10, &mut Noise(1));
    strokes[17].deviation += Metres::from_um(2.0);
    strokes[401].deviation -= Metres::from_um(1.5);
    let fitted = check_left_out(&strokes, &[17, 401]);
    let residuals: Vec<f64> = fitted.outliers.iter().map(|it| it.residual.um()).collect();
    assert!((residuals[0] - 2.0).abs() < 0.5 && (residuals[1] + 1.5).abs() < 0.5);
}

#[test]
fn without_repetitions_the_model_of_the_others_tells() {
    for repeats in [1, 2] {
        let mut strokes = wavy(repeats, &mut Noise(7));
        strokes[5].deviation += Metres::from_um(1.6);
        strokes[30].deviation -= Metres::from_um(30.0);
        check_left_out(&strokes, &[5, 30]);
    }
}

#[test]
fn an_error_that_repeats_belongs_to_the_screw() {
    for repeats in [1, 2, 5] {
        let mut strokes = wavy(repeats, &mut Noise(3));
        let bent = strokes[11].stroke;
        for it in strokes.iter_mut().filter(|it| it.stroke == bent) {
            it.deviation += Metres::from_um(3.0);
        }
        check_left_out(&strokes, &[]);
    }
}

#[test]
fn clean_data_have_no_outliers_whatever_their_digits() {
    for seed in 0..300 {
        let repeats = 1 + seed as usize % 4;
        let strokes = wavy(repeats, &mut Noise(seed));
        let fitted = fit(&strokes, &with_lead()).unwrap();
        assert_eq!(fitted.outliers, [], "seed {seed}");
        let mut coarse = strokes;
        for it in &mut coarse {
            it.deviation = Metres::from_um((it.deviation.um() * 5.0).round() / 5.0);
        }
        let fitted = fit(&coarse, &with_lead()).unwrap();
        assert_eq!(fitted.outliers, [], "seed {seed}, steps of 0.2 µm");
    }
}

#[test]
fn few_rows_are_all_taken_because_nobody_can_judge() {
    let mut strokes = Vec::new();
    for approach in [Approach::Forward, Approach::Reverse] {
        for (um, deviation) in [(500.0, 2.0), (1000.0, 2.2), (1500.0, 2.6)] {
            strokes.push(row(approach, um, deviation));
        }
    }
    strokes[2].deviation = Metres::from_um(90.0);
    let options = FitOptions::default();
    assert_eq!(fit(&strokes, &options).unwrap().outliers, []);
}

#[test]
fn when_a_quarter_does_not_belong_nothing_is_estimated() {
    let mut noise = Noise(9);
    let mut strokes = wavy(10, &mut noise);
    for it in &mut strokes {
        if noise.uniform() < 0.25 {
            it.deviation += Metres::from_um(5.0 + noise.within(3.0));
        }
    }
    let message = fit(&strokes, &with_lead()).unwrap_err().to_string();
    assert!(message.contains("more than 20 %"), "{message}");
}
