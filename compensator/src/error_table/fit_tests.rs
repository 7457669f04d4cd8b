use super::*;
use crate::error_table::Measurement;
use crate::noise::Noise;

fn truth_um(mm: f64, approach: Approach) -> f64 {
    let lost = if approach == Approach::Reverse {
        1.8
    } else {
        0.0
    };
    8.0 * (mm / 17.0).sin() + lost
}

/// 21 targets every 3 mm, `runs` runs both ways; `um(run, approach, mm)` is added in µm.
fn series(runs: u32, mut um: impl FnMut(u32, Approach, f64) -> f64) -> LinearSeries {
    let mut measurements = Vec::new();
    for run in 1..=runs {
        for (approach, order) in [
            (Approach::Forward, (0..=20).collect::<Vec<i32>>()),
            (Approach::Reverse, (0..=20).rev().collect()),
        ] {
            for i in order {
                let mm = f64::from(i) * 3.0;
                let deviation = truth_um(mm, approach) + um(run, approach, mm);
                let target = Metres::from_mm(mm);
                let measured = target + Metres::from_um(deviation);
                measurements.push(Measurement {
                    run,
                    approach,
                    target,
                    measured,
                });
            }
        }
    }
    LinearSeries::new(measurements).unwrap()
}

fn check_um(seen: Metres, expected_um: f64, tolerance_um: f64) {
    assert!(
        (seen.um() - expected_um).abs() <= tolerance_um,
        "{} um",
        seen.um()
    );
}

#[test]
fn noiseless_runs_give_the_truth_at_every_node() {
    let fitted = analyse(&series(3, |_, _, _| 0.0), &FitOptions::default()).unwrap();
    for node in fitted.table.nodes() {
        let mm = node.position.mm();
        check_um(node.forward.unwrap(), truth_um(mm, Approach::Forward), 1e-9);
        check_um(node.reverse.unwrap(), truth_um(mm, Approach::Reverse), 1e-9);
    }
    check_um(fitted.table.lost_motion().unwrap().mean, 1.8, 1e-9);
    assert!(fitted.robust.outliers.is_empty());
}

/// Two runs of ±0.5 µm: s = √(2·0.25/1) = 0.7071 at every node, u = s/√2 = 0.5, and with an
/// instrument of 1.2 µm √(0.25 + 1.44) = 1.3 µm.
#[test]
fn the_uncertainty_of_a_node_is_scatter_over_root_n_with_the_instruments() {
    let data = series(2, |run, _, _| if run == 1 { 0.5 } else { -0.5 });
    for scatter in [NodeScatter::Pooled, NodeScatter::PerNode] {
        let options = FitOptions {
            scatter,
            u_instrument: Metres::from_um(1.2),
            ..Default::default()
        };
        let table = fit(&data, &options).unwrap();
        check_um(table.nodes()[7].u_forward.unwrap(), 1.3, 1e-6);
        check_um(table.nodes()[7].u_reverse.unwrap(), 1.3, 1e-6);
    }
}

#[test]
fn the_stated_uncertainty_of_the_nodes_is_the_real_one() {
    let (mut chi, mut count) = (0.0, 0.0);
    for seed in 0..40 {
        let mut noise = Noise(seed);
        let data = series(5, |_, _, _| 0.3 * noise.normal());
        for node in fit(&data, &FitOptions::default()).unwrap().nodes() {
            let error =
                node.forward.unwrap().um() - truth_um(node.position.mm(), Approach::Forward);
            chi += (error / node.u_forward.unwrap().um()).powi(2);
            count += 1.0;
        }
    }
    assert!((chi / count - 1.0).abs() < 0.1, "chi²/n = {}", chi / count);
}

#[test]
fn five_percent_outliers_are_named_and_do_not_move_the_table() {
    let mut noise = Noise(7);
    let mut wild = Vec::new();
    let data = series(5, |run, approach, mm| {
        let base = 0.1 * noise.normal();
        if noise.uniform() < 0.05 {
            wild.push((run, approach, mm));
            base + if noise.uniform() < 0.5 { 5.0 } else { -4.0 }
        } else {
            base
        }
    });
    let fitted = analyse(&data, &FitOptions::default()).unwrap();
    let named: Vec<(u32, Approach, f64)> = fitted
        .robust
        .outliers
        .iter()
        .map(|o| (o.run, o.approach, (o.target.mm() / 3.0).round() * 3.0))
        .collect();
    assert!(wild.len() > 5);
    assert_eq!(named, wild);
    for node in fitted.table.nodes() {
        check_um(
            node.forward.unwrap(),
            truth_um(node.position.mm(), Approach::Forward),
            0.25,
        );
    }
}

/// Of `seeds` sound series of all sizes (2 to 41 positions, 2 to 10 runs, scatter 5 to 1000 nm, both sides or
/// one), how many lose a point.
fn sound_that_lose_a_point(seeds: core::ops::Range<u64>) -> usize {
    let loses = |seed: &u64| {
        let mut noise = Noise(0x0071_1E45 ^ (seed << 20));
        let mut among =
            |low: u32, high: u32| low + (noise.uniform() * f64::from(high - low + 1)) as u32;
        let (positions, runs, sides) = (among(2, 41), among(2, 10), among(1, 2));
        let scatter = 5e-9 * 200.0_f64.powf(noise.uniform());
        let both = [Approach::Forward, Approach::Reverse];
        let mut measurements = Vec::new();
        for run in 1..=runs {
            let offset = scatter * noise.normal();
            for approach in &both[..sides as usize] {
                let order: Vec<u32> = match approach {
                    Approach::Forward => (0..positions).collect(),
                    Approach::Reverse => (0..positions).rev().collect(),
                };
                measurements.extend(order.into_iter().map(|at| {
                    let target = Metres::from_mm(3.0 * f64::from(at));
                    Measurement {
                        run,
                        approach: *approach,
                        target,
                        measured: target + Metres(offset + scatter * noise.normal()),
                    }
                }));
            }
        }
        let series = LinearSeries::new(measurements).unwrap();
        analyse(&series, &FitOptions::default()).map_or(true, |it| !it.robust.outliers.is_empty())
    };
    seeds.filter(loses).count()
}

/// Of 300 series at 1e-4 each two lose a point once in 2 000 times.
#[test]
fn sound_series_of_all_sizes_lose_no_point() {
    let lost = sound_that_lose_a_point(50_000..50_300);
    assert!(lost <= 1, "{lost} of 300");
}

/// Of 20 000 at 1e-4 each more than eight lose a point once in 4 000 times (binomial).
#[test]
#[ignore = "20 000 series"]
fn sound_series_counted_over_many() {
    let lost = sound_that_lose_a_point(0..20_000);
    println!("{lost} of 20000 sound series lost a point");
    assert!(lost <= 8, "{lost} of 20000");
}

#[test]
fn more_than_a_fifth_of_outliers_aborts() {
    let mut noise = Noise(3);
    let data = series(5, |_, _, _| {
        let wild = if noise.uniform() < 0.27 {
            30.0 * noise.uniform() + 10.0
        } else {
            0.0
        };
        0.05 * noise.normal() + wild
    });
    let error = analyse(&data, &FitOptions::default()).unwrap_err();
    assert!(matches!(error, FitError::TooManyOutliers { .. }), "{error}");
    assert!(error.to_string().contains("measure again"), "{error}");
}

#[test]
fn thermal_drift_shows_as_closure_and_can_be_limited_or_removed() {
    let data = series(5, |run, _, _| 0.7 * f64::from(run));
    let fitted = analyse(&data, &FitOptions::default()).unwrap();
    check_um(fitted.drift.closure.unwrap(), 2.8, 1e-9);
    assert_eq!(fitted.drift.runs.len(), 5);
    let limited = FitOptions {
        closure_max: Some(Metres::from_um(1.0)),
        ..Default::default()
    };
    assert!(matches!(
        analyse(&data, &limited),
        Err(FitError::Closure { .. })
    ));
    let removed = FitOptions {
        remove_drift: true,
        ..Default::default()
    };
    let fitted = analyse(&data, &removed).unwrap();
    check_um(fitted.s_forward.unwrap(), 0.0, 1e-6);
}

#[test]
fn one_approach_alone_gives_a_table_that_knows_only_that() {
    let both = series(3, |_, _, _| 0.0);
    let forward = both
        .measurements()
        .iter()
        .copied()
        .filter(|m| m.approach == Approach::Forward);
    let table = fit(
        &LinearSeries::new(forward.collect()).unwrap(),
        &FitOptions::default(),
    )
    .unwrap();
    assert!(table.knows(Approach::Forward) && !table.knows(Approach::Reverse));
    assert_eq!(table.lost_motion(), None);
}

#[test]
fn a_target_missing_from_one_side_is_named() {
    let both = series(2, |_, _, _| 0.0);
    let gone = Metres::from_mm(30.0);
    let kept = both
        .measurements()
        .iter()
        .copied()
        .filter(|m| !(m.approach == Approach::Reverse && m.target == gone));
    let data = LinearSeries::new(kept.collect()).unwrap();
    let error = fit(&data, &FitOptions::default()).unwrap_err();
    assert_eq!(
        error,
        FitError::MissingTarget {
            target: gone,
            approach: Approach::Reverse
        }
    );
}

#[test]
fn a_single_run_has_no_scatter_and_says_so() {
    let fitted = analyse(&series(1, |_, _, _| 0.0), &FitOptions::default()).unwrap();
    assert_eq!(fitted.s_forward, None);
    assert_eq!(fitted.table.nodes()[3].u_forward, None);
    let per_node = FitOptions {
        scatter: NodeScatter::PerNode,
        ..Default::default()
    };
    assert!(matches!(
        fit(&series(1, |_, _, _| 0.0), &per_node),
        Err(FitError::TooFewRuns { .. })
    ));
}
