use super::*;
use crate::error_table::Node;
use crate::noise::Noise;

/// A table of both approaches, from deviations in micrometres.
fn table(positions_mm: &[f64], forward: &[f64], reverse: &[f64]) -> ErrorTable {
    let nodes = positions_mm.iter().zip(forward).zip(reverse);
    let nodes = nodes.map(|((mm, forward), reverse)| Node {
        position: Metres::from_mm(*mm),
        forward: Some(Metres::from_um(*forward)),
        reverse: Some(Metres::from_um(*reverse)),
        u_forward: None,
        u_reverse: None,
    });
    ErrorTable::new(nodes.collect()).unwrap()
}

/// Positions every 3 mm, a curve of ±`um` with waves of 60 to 24 mm, noise of `noise_um`.
fn stage(seed: u64, count: usize, um: f64, noise_um: f64) -> (Vec<f64>, [Vec<f64>; 2]) {
    let mut chance = Noise(seed);
    let waves: Vec<(f64, f64, f64)> = [60.0, 40.0, 30.0, 24.0]
        .into_iter()
        .map(|mm| (um * chance.uniform() * mm / 60.0, mm, chance.uniform()))
        .collect();
    let positions: Vec<f64> = (0..count).map(|it| it as f64 * 3.0).collect();
    let curve = |x: &f64| -> f64 {
        let wave = |(um, mm, phase): &(f64, f64, f64)| {
            um * (core::f64::consts::TAU * (x / mm + phase)).sin()
        };
        waves.iter().map(wave).sum()
    };
    let sides = [0.5, -0.5].map(|half_lost| {
        let noisy = |x| curve(x) + half_lost + noise_um * chance.normal();
        positions.iter().map(noisy).collect()
    });
    (positions, sides)
}

fn judged(positions: &[f64], sides: &[Vec<f64>; 2]) -> Result<Option<Metres>, StandOff> {
    table(positions, &sides[0], &sides[1]).judge_neighbours(Metres::ZERO)
}

/// Two-sided values as any table of Student's distribution has them.
#[test]
fn the_limit_is_students() {
    for (chance, freedom, expected) in [(1e-3, 4, 8.610), (1e-3, 10, 4.587), (0.05, 30, 2.042)] {
        let seen = student_limit(chance, freedom);
        assert!((seen - expected).abs() < 1e-3, "{seen} for {expected}");
    }
}

/// On an even grid the weights are the binomial ones; a cubic leaves nothing on any grid.
#[test]
fn the_differences_leave_nothing_of_a_cubic() {
    let even = weights(&[0.0, 1.0, 2.0, 3.0, 4.0]);
    let length = 70.0_f64.sqrt();
    for (seen, expected) in even.iter().zip([1.0, -4.0, 6.0, -4.0, 1.0]) {
        assert!((seen - expected / length).abs() < 1e-12);
    }
    let grid = [0.0, 3.0, 4.0, 9.5, 11.0];
    let cubic: Vec<f64> = grid.iter().map(|x| 2.0 - x + x * x * x / 50.0).collect();
    assert!(dot(&cubic, &weights(&grid)).abs() < 1e-12);
}

#[test]
fn stages_of_any_size_and_noise_are_believed_as_they_are() {
    let mut refused = 0;
    for seed in 0..2000 {
        let mut chance = Noise(seed);
        let um = 0.1 * 1000.0_f64.powf(chance.uniform());
        let noise = um * 1e-3 * 1000.0_f64.powf(chance.uniform());
        let count = 7 + (chance.uniform() * 40.0) as usize;
        let (positions, sides) = stage(seed, count, um, noise);
        refused += u32::from(judged(&positions, &sides).is_err());
    }
    assert!(refused <= 4, "{refused} of 2000");
}

#[test]
fn a_position_that_is_wrong_is_named_with_its_error_wherever_it_is() {
    for seed in 0..40 {
        let wrong = 2 + seed as usize % 17;
        let (positions, mut sides) = stage(seed, 21, 8.0, 0.02);
        let noticed = judged(&positions, &sides).unwrap().unwrap();
        assert!(noticed < Metres::from_um(2.0), "{} um", noticed.um());
        let error_um = 1.5 * noticed.um();
        sides.iter_mut().for_each(|side| side[wrong] += error_um);
        let found = judged(&positions, &sides).unwrap_err();
        assert_eq!(found.position, Metres::from_mm(positions[wrong]), "{found}");
        assert!(
            (found.seen.um() - error_um).abs() < 0.3 * error_um,
            "{found}"
        );
    }
}

#[test]
fn two_positions_that_are_wrong_do_not_hide_each_other() {
    for (a, b, seed) in [(3, 4, 1), (5, 15, 2), (8, 10, 3), (6, 9, 4), (2, 18, 5)] {
        let (positions, mut sides) = stage(seed, 21, 8.0, 0.02);
        sides[0][a] += 20.0;
        sides[0][b] -= 20.0;
        assert!(judged(&positions, &sides).is_err(), "{a} and {b}");
    }
}

#[test]
fn a_step_that_stays_is_noticed_like_a_position() {
    let (positions, mut sides) = stage(7, 21, 8.0, 0.02);
    for side in &mut sides {
        side[11..].iter_mut().for_each(|it| *it += 3.0);
    }
    let found = judged(&positions, &sides).unwrap_err();
    assert!((27.0..=39.0).contains(&found.position.mm()), "{found}");
}

#[test]
fn what_is_harmless_is_believed_and_a_short_table_is_not_judged() {
    let (positions, mut sides) = stage(3, 21, 2.0, 0.01);
    sides[1][9] += 4.0;
    let found = judged(&positions, &sides).unwrap_err();
    assert_eq!(found.approach, Approach::Reverse);
    let table_of = |sides: &[Vec<f64>; 2]| table(&positions, &sides[0], &sides[1]);
    let believed = table_of(&sides).judge_neighbours(found.seen.abs() * 1.01);
    assert!(believed.is_ok(), "{believed:?}");
    let (positions, sides) = stage(3, 3, 2.0, 0.01);
    assert_eq!(judged(&positions, &sides), Ok(None));
}

#[test]
fn noiseless_lines_and_tables_of_zeros_are_believed() {
    let positions: Vec<f64> = (0..21).map(|it| f64::from(it) * 3.0).collect();
    let zeros = vec![0.0; 21];
    assert!(judged(&positions, &[zeros.clone(), zeros]).is_ok());
    let line: Vec<f64> = positions.iter().map(|x| 0.3 * x - 4.0).collect();
    let table = table(&positions, &line, &line);
    assert!(table.judge_neighbours(Metres(1e-9)).is_ok());
}

#[test]
fn the_refusal_says_where_how_much_and_what_would_be_believed() {
    let (positions, mut sides) = stage(1, 21, 0.5, 0.01);
    sides[0][12] += 5.0;
    let text = judged(&positions, &sides).unwrap_err().to_string();
    for part in [
        "at 36.000 mm (approach `+`)",
        "through its neighbours from",
        "is plausible",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}
