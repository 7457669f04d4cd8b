use units::{Celsius, Pascals, Radians, RelativeHumidity};

use super::*;
use crate::air::EQUATION_STANDARD_UNCERTAINTY;
use crate::error_table::{FitOptions, LinearSeries, Measurement, analyse};
use crate::length_correction::{
    Cosine, Environment, EnvironmentUncertainty, LengthCorrection, MaterialExpansion, Settings,
};
use crate::noise::Noise;

const WAVELENGTH: Metres = Metres(632.991e-9);

fn settings() -> Settings {
    Settings {
        air: true,
        vacuum_wavelength: WAVELENGTH,
        u_relative_wavelength: 2e-8,
        co2_umol_per_mol: 450.0,
        material_expansion: Some(MaterialExpansion {
            per_kelvin: 11.5e-6,
            u_per_kelvin: 1.15e-6,
        }),
        dead_path: None,
        cosine: Some(Cosine {
            angle: Radians(0.0),
            u_angle: Radians(0.2e-3),
        }),
        u_environment: EnvironmentUncertainty {
            air_temperature: Celsius(0.1),
            pressure: Pascals(20.0),
            humidity: RelativeHumidity(0.03),
            material_temperature: Celsius(0.1),
            co2_umol_per_mol: 100.0,
        },
    }
}

/// The shipped stage's climate.
fn environment(stage_c: f64) -> Environment {
    Environment {
        air_temperature: Celsius(21.3),
        pressure: Pascals(100_200.0),
        humidity: RelativeHumidity(0.46),
        material_temperature: Celsius(stage_c),
    }
}

fn circumstances(environment: &Environment) -> Circumstances {
    let correction = LengthCorrection::new(settings(), environment).unwrap();
    let lines = correction.contributions(environment).unwrap();
    Circumstances {
        instrument: Metres(20e-9),
        closure: Metres(0.0),
        zero: (Metres(30e-9), Some(9.0)),
        short_period: Metres(0.0),
        interpolation: Interpolation::MonotoneCubic,
        corrections: lines.into_iter().map(|(_, it)| it).collect(),
    }
}

fn series(rows: impl IntoIterator<Item = (u32, Approach, f64, f64)>) -> LinearSeries {
    let rows = rows
        .into_iter()
        .map(|(run, approach, x, deviation)| Measurement {
            run,
            approach,
            target: Metres(x),
            measured: Metres(x + deviation),
        });
    LinearSeries::new(rows.collect()).unwrap()
}

/// Positions 0, 3 … 60 mm, three runs, `deviation` and a scatter of exactly ± 25 nm.
fn fitted(deviation: impl Fn(f64) -> f64) -> Fitted {
    let sides = [Approach::Forward, Approach::Reverse];
    let rows = (1..=3_u32).flat_map(|run| sides.map(|it| (run, it)));
    let rows = rows.flat_map(|(run, side)| {
        let places: Vec<u32> = match side {
            Approach::Forward => (0..=20).collect(),
            Approach::Reverse => (0..=20).rev().collect(),
        };
        places.into_iter().map(move |at| (run, side, at))
    });
    let rows = rows.map(|(run, side, at)| {
        // −25, 0, 25 nm in an order that is another one at the next position: no trend of the runs.
        let scatter = 25e-9 * (f64::from((run + at) % 3) - 1.0);
        let x = f64::from(at) * 3e-3;
        (run, side, x, deviation(x) + scatter)
    });
    analyse(&series(rows), &FitOptions::default()).unwrap()
}

fn share(budget: &AxisBudget, name: &str, mm: f64) -> f64 {
    let line = budget.contributions().iter().find(|it| it.name == name);
    line.unwrap_or_else(|| panic!("no {name}"))
        .share(Metres::from_mm(mm))
        .nm()
}

/// 11.5e-6/K · 0.1 K · 60 mm = 69 nm; 1.15e-6/K · 0.8 K · 60 mm = 55.2 nm, at 26 °C 414 nm.
#[test]
fn the_share_of_temperature_and_expansion_is_that_of_the_last_position() {
    let fitted = fitted(|_| 0.0);
    let at = |stage_c| budget(&fitted, circumstances(&environment(stage_c))).unwrap();
    for (stage_c, name, expected_nm) in [
        (20.8, "material temperature", 69.0),
        (20.8, "coefficient of expansion", 55.2),
        (26.0, "coefficient of expansion", 414.0),
    ] {
        let seen = share(&at(stage_c), name, 60.0);
        assert!((seen - expected_nm).abs() < 0.1, "{name}: {seen}");
    }
    let u = |mm: f64| {
        let combined = at(20.8).at(Metres::from_mm(mm), Approach::Forward);
        combined.unwrap().standard_uncertainty.nm()
    };
    // 25/√3, 25, 20, 20 and 30 nm: hypotenuse 50.2 nm; with 69, 55.2 and air 101.9 nm.
    assert!((u(0.0) - 50.2).abs() < 0.5, "{}", u(0.0));
    assert!((u(60.0) - 102.4).abs() < 1.0, "{}", u(60.0));
}

/// A parabola of 1 µm in 30 mm: 10 nm between neighbours of 3 mm; half-way a straight line misses a
/// quarter of that.
#[test]
fn the_curve_between_positions_is_judged_by_positions_left_out() {
    let fitted = fitted(|x| 1e-6 * (x / 0.03) * (x / 0.03));
    let mut known = circumstances(&environment(20.0));
    known.interpolation = Interpolation::Linear;
    let budget = budget(&fitted, known).unwrap();
    let curve = budget.contributions().iter().find(|it| it.name == CURVE);
    // The scatter of three equal triples averages out, so that what is taken off is too much.
    let noise = 1.5 * 25.0 * 25.0 / 3.0;
    let expected = (100.0_f64 - noise).max(0.0).sqrt();
    assert!((curve.unwrap().value * 1e9 - expected).abs() < 1.0);
}

#[test]
fn drift_shows_in_the_runs_or_in_the_closure() {
    let fitted = fitted(|_| 0.0);
    let mut known = circumstances(&environment(20.0));
    let drift = |known: &Circumstances| share(&budget(&fitted, known.clone()).unwrap(), DRIFT, 0.0);
    // Two stops of 25 nm differ by 35 nm; three times that is noise.
    known.closure = Metres(100e-9);
    assert!(drift(&known) < 1.0, "{}", drift(&known));
    known.closure = Metres(-500e-9);
    let expected = (500.0_f64 * 500.0 - 9.0 * 2.0 * 625.0).sqrt();
    assert!((drift(&known) - expected).abs() < 0.1, "{}", drift(&known));
}

#[test]
fn a_stop_has_its_own_scatter_and_the_zero_of_today() {
    let fitted = fitted(|_| 0.0);
    let calibrated = budget(&fitted, circumstances(&environment(20.8))).unwrap();
    let today = budget_of_stops(&calibrated, Some((Metres(40e-9), None)), None).unwrap();
    let variance = |it: &AxisBudget| {
        let u = it.at(Metres::ZERO, Approach::Reverse).unwrap();
        let nm = u.standard_uncertainty.nm();
        nm * nm
    };
    // Errors of short period at the stop, and at the position when it was read.
    let short = circumstances(&environment(20.8)).short_period.nm();
    let more = 40.0 * 40.0 - 30.0 * 30.0 + 25.0 * 25.0 + 2.0 * short * short;
    assert!((variance(&today) - variance(&calibrated) - more).abs() < 1e-6);
    let lost_motion = Some(Metres(600e-9));
    let unlike = budget_of_stops(&calibrated, Some((Metres(40e-9), None)), lost_motion).unwrap();
    // 600²/3.
    assert!((variance(&unlike) - variance(&today) - 120_000.0).abs() < 1e-6);
}

#[test]
fn one_run_says_nothing_of_its_scatter() {
    let rows = [
        (1, Approach::Forward, 0.0, 0.0),
        (1, Approach::Forward, 0.01, 0.0),
    ];
    let fitted = analyse(&series(rows), &FitOptions::default()).unwrap();
    let error = budget(&fitted, circumstances(&environment(20.0))).unwrap_err();
    assert!(
        error.to_string().contains("measure at least two runs"),
        "{error}"
    );
}

/// A stage, its surroundings and its instrument, all of them drawn; every error from the distribution that
/// the budget states for it.
struct Drawn {
    noise: Noise,
    truth: Environment,
    sensed: Environment,
    per_kelvin: f64,
    scale: f64,
    angle: f64,
    scatter: f64,
    runs: u32,
    positions: Vec<f64>,
    waves: [(f64, f64, f64); 4],
    lost_motion: f64,
}

impl Drawn {
    fn new(seed: u64) -> Self {
        let mut noise = Noise(seed);
        let (s, u) = (settings(), settings().u_environment);
        let mut around = |middle: f64, half: f64| middle + noise.within(half);
        let truth = Environment {
            air_temperature: Celsius(around(21.0, 4.0)),
            pressure: Pascals(around(98_000.0, 4_000.0)),
            humidity: RelativeHumidity(around(0.45, 0.2)),
            material_temperature: Celsius(around(21.0, 4.0)),
        };
        let scatter = 5e-9 * units::portable::exp(noise.uniform() * 3.5);
        let runs = 2 + (noise.uniform() * 4.0) as u32;
        let count = 5 + (noise.uniform() * 8.0) as u32;
        let length = 0.02 + 0.08 * noise.uniform();
        let sensed = Environment {
            air_temperature: truth.air_temperature + u.air_temperature * noise.normal(),
            pressure: truth.pressure + u.pressure * noise.normal(),
            humidity: truth.humidity + u.humidity * noise.normal(),
            material_temperature: truth.material_temperature
                + u.material_temperature * noise.normal(),
        };
        let material = s.material_expansion.unwrap();
        let wave = |order: u32, noise: &mut Noise| {
            let order = f64::from(order);
            let phase = noise.within(core::f64::consts::PI);
            (5e-6 / order * noise.uniform(), 3.0 * order / length, phase)
        };
        Self {
            truth,
            sensed,
            per_kelvin: material.per_kelvin + material.u_per_kelvin * noise.normal(),
            scale: s.u_relative_wavelength * noise.normal()
                + EQUATION_STANDARD_UNCERTAINTY * noise.normal()
                + 1.45e-10 * u.co2_umol_per_mol * noise.normal(),
            angle: s.cosine.unwrap().u_angle.value() * noise.normal(),
            scatter,
            runs,
            positions: (0..count)
                .map(|at| length * f64::from(at) / f64::from(count - 1))
                .collect(),
            waves: [1, 2, 3, 4].map(|order| wave(order, &mut noise)),
            lost_motion: 2e-6 * noise.uniform(),
            noise,
        }
    }

    fn deviation(&self, x: f64, approach: Approach) -> f64 {
        let waves = self.waves.iter();
        let curve: f64 = waves
            .map(|(size, per_m, phase)| {
                let sin = units::portable::sin;
                size * (sin(per_m * x + phase) - sin(*phase))
            })
            .sum();
        curve + 0.5 * self.lost_motion * (1.0 - approach.sign())
    }

    /// What the instrument makes of the true length `m` at 20 °C.
    fn read(&self, m: f64, correction: &LengthCorrection) -> f64 {
        let excess = self.truth.material_temperature.value() - 20.0;
        let grown = m * (1.0 + self.per_kelvin * excess);
        let index = crate::air::refractive_index(
            WAVELENGTH,
            self.truth.air_temperature,
            self.truth.pressure,
            self.truth.humidity,
            450.0,
        );
        let along = grown * units::portable::cos(self.angle);
        let optical = Metres(along * index.unwrap() * (1.0 + self.scale));
        let corrected = correction.correct(optical, &self.sensed).unwrap();
        corrected.displacement.value()
    }

    /// (table − truth)/u at one position that chance chooses; `None` where the readings were refused.
    fn judge(mut self, drift: f64) -> Option<f64> {
        let known = circumstances(&self.sensed);
        let correction = LengthCorrection::new(settings(), &self.sensed).unwrap();
        // The datum is a stop like any other, read like any other; and the zero lies elsewhere.
        let datum = self.scatter * self.noise.normal() - 20e-9 * self.noise.normal();
        let zero = known.zero.0.value() * self.noise.normal();
        let mut rows = Vec::new();
        let own: Vec<[f64; 2]> = self
            .positions
            .iter()
            .map(|_| [0; 2].map(|_| 20e-9 * self.noise.normal()))
            .collect();
        for run in 1..=self.runs {
            let moved = drift * (f64::from(run) - 0.5) / f64::from(self.runs);
            for (side, approach) in [Approach::Forward, Approach::Reverse]
                .into_iter()
                .enumerate()
            {
                let mut places: Vec<usize> = (0..self.positions.len()).collect();
                if approach == Approach::Reverse {
                    places.reverse();
                }
                for at in places {
                    let x = self.positions[at];
                    let stop = self.scatter * self.noise.normal();
                    let is = x + self.deviation(x, approach) + stop + moved - datum;
                    let seen = self.read(is, &correction) + own[at][side];
                    rows.push((run, approach, x, seen - x));
                }
            }
        }
        let fitted = analyse(&series(rows), &FitOptions::default()).ok()?;
        let budget = budget(&fitted, known).unwrap();
        let at = ((self.noise.uniform() * self.positions.len() as f64) as usize)
            .min(self.positions.len() - 1);
        let approach = if self.noise.uniform() < 0.5 {
            Approach::Forward
        } else {
            Approach::Reverse
        };
        let table = stated(&fitted.table, &budget);
        let node = table.nodes()[at];
        let truth = self.deviation(self.positions[at], approach) + zero;
        let u = node.standard_uncertainty(approach).unwrap().value();
        Some((node.deviation(approach).unwrap().value() - truth) / u)
    }
}

/// Share within 2u and mean of the squares, over stages of `seeds`.
fn coverage(seeds: core::ops::Range<u64>, drift: f64) -> (f64, f64) {
    let drawn = seeds.end - seeds.start;
    let judged: Vec<f64> = seeds
        .filter_map(|seed| {
            let drift = drift * Noise(seed ^ 0xD01F).normal();
            Drawn::new(seed).judge(drift)
        })
        .collect();
    let count = judged.len() as f64;
    let within = judged.iter().filter(|z| z.abs() <= 2.0).count() as f64;
    let squares: f64 = judged.iter().map(|z| z * z).sum();
    let (share, chi2) = (within / count, squares / count);
    println!("{count} of {drawn} stages, drift {drift:e}: {share:.4} within 2u, chi2 {chi2:.3}");
    assert!(
        count >= 0.99 * drawn as f64,
        "the outlier guard refuses too many"
    );
    (share, chi2)
}

/// A right share of 0.95 leaves 0.93 to 0.975 of 1500 stages once in 3000 times (binomial), and a mean
/// square of 1 leaves 0.9 to 1.15 once in 300 times at the lower end; the seeds are nobody's choice.
#[test]
fn the_truth_lies_within_two_standard_uncertainties_as_often_as_it_should() {
    let (share, chi2) = coverage(31_000..32_500, 0.0);
    assert!((0.93..=0.975).contains(&share), "{share}");
    assert!((0.9..=1.15).contains(&chi2), "{chi2}");
}

#[test]
#[ignore = "many stages: for whoever wants the rates"]
fn the_coverage_of_many_stages() {
    for drift in [0.0, 30e-9, 100e-9] {
        let (share, chi2) = coverage(1_000_000..1_020_000, drift);
        assert!((0.93..=0.975).contains(&share), "{share}");
        assert!((0.9..=1.15).contains(&chi2), "{chi2}");
    }
}
