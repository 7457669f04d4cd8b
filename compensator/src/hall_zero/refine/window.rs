//! One sensor's curve in one window: good samples, polynomial, value, slope, uncertainty.

use units::{Metres, Volts};

use super::{RefineError, RefineOptions, Sensor};
use crate::hall_zero::HallPoint;
use crate::least_squares::{self, LeastSquaresError, powers};
use crate::uncertainty::{mean, of_rounding, reduced_chi_square_limit, robust_sigma};

/// The samples with their travel per sample, and the noise of both sensors.
pub(super) struct Data<'a> {
    points: &'a [HallPoint],
    /// Mean of the steps before and after each sample, metres.
    travel: Vec<f64>,
    pub(super) noise_peak: f64,
    pub(super) noise_slope: f64,
}

impl<'a> Data<'a> {
    pub(super) fn new(points: &'a [HallPoint]) -> Result<Self, RefineError> {
        let finite =
            |p: &HallPoint| p.position.is_finite() && p.peak.is_finite() && p.slope.is_finite();
        if let Some(index) = points.iter().position(|p| !finite(p)) {
            return Err(RefineError::NotFinite { index });
        }
        let last = points.len().saturating_sub(1);
        let travel = (0..points.len())
            .map(|i| {
                let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
                let steps = (b - a).max(1) as f64;
                (points[b].position - points[a].position).value() / steps
            })
            .collect();
        let noise =
            |voltage| neighbour_noise(points, voltage).max(converter_noise(points, voltage));
        let noise_peak = noise(|p| p.peak.value());
        let noise_slope = noise(|p| p.slope.value());
        Ok(Self {
            points,
            travel,
            noise_peak,
            noise_slope,
        })
    }

    /// Fits one sensor in windows around several places, with one degree for all of them.
    ///
    /// What a polynomial of too low a degree leaves is the same on both flanks and cancels in
    /// their mean; that would be lost if each window chose for itself.
    pub(super) fn windows<const N: usize>(
        &self,
        sensor: Sensor,
        around: [f64; N],
        half_window: f64,
        options: &RefineOptions,
    ) -> Result<[Window; N], RefineError> {
        let noise = match sensor {
            Sensor::Peak => self.noise_peak,
            Sensor::Slope => self.noise_slope,
        };
        let mut rows = Vec::with_capacity(N);
        let mut degree = options.degree_min;
        for place in around {
            let window = self.rows(sensor, place, half_window, options)?;
            degree = degree.max(needed_degree(&window, options).map_err(at(place))?);
            rows.push(window);
        }
        let mut rows = rows.into_iter();
        around
            .map(|place| {
                let Rows {
                    rows,
                    left_out,
                    with_lag,
                } = rows
                    .next()
                    .expect("one set of rows was pushed for each place");
                let fit = fit_rows(&rows, degree, with_lag).map_err(at(place))?;
                let sigma = fit.residual_sd().unwrap_or(0.0);
                if noise > 0.0 && sigma > options.excess_max * noise {
                    let (residual, noise) = (Volts(sigma), Volts(noise));
                    let around = Metres(place);
                    return Err(RefineError::LackOfFit {
                        sensor,
                        around,
                        residual,
                        noise,
                    });
                }
                Ok(Window {
                    around: place,
                    half_window,
                    degree,
                    with_lag,
                    sigma,
                    left_out,
                    fit,
                })
            })
            .into_iter()
            .collect::<Result<Vec<Window>, RefineError>>()
            .map(|windows| match windows.try_into() {
                Ok(windows) => windows,
                Err(_) => unreachable!("there is one window for each place"),
            })
    }

    /// The good samples of one sensor in one window.
    fn rows(
        &self,
        sensor: Sensor,
        around: f64,
        half_window: f64,
        options: &RefineOptions,
    ) -> Result<Rows, RefineError> {
        let mut rows: Vec<Row> = (self.points.iter().zip(&self.travel))
            .map(|(p, travel)| Row {
                z: (p.position.value() - around) / half_window,
                travel: *travel,
                weight: 1.0,
                voltage: match sensor {
                    Sensor::Peak => p.peak.value(),
                    Sensor::Slope => p.slope.value(),
                },
            })
            .filter(|row| row.z.abs() <= 1.0)
            .collect();
        let (seen, needed) = (rows.len(), options.samples_min());
        if seen < needed {
            return Err(RefineError::TooFewSamples {
                around: Metres(around),
                seen,
                needed,
            });
        }
        drop_outliers(&mut rows, options);
        let with_lag = shows_lag(&rows);
        Ok(Rows {
            left_out: seen - rows.len(),
            with_lag,
            rows,
        })
    }
}

fn at(place: f64) -> impl Fn(LeastSquaresError) -> RefineError {
    move |source| RefineError::Fit {
        around: Metres(place),
        source,
    }
}

/// The lowest degree that the highest one does not improve by more than chance would.
fn needed_degree(window: &Rows, options: &RefineOptions) -> Result<usize, LeastSquaresError> {
    let squares = |degree| {
        let fit = fit_rows(&window.rows, degree, window.with_lag)?;
        let sum = fit.squares();
        Ok((sum, fit.degrees_of_freedom))
    };
    let (best, freedom) = squares(options.degree_max)?;
    let variance = best / freedom.max(1) as f64;
    for degree in options.degree_min..options.degree_max {
        let more = options.degree_max - degree;
        let improvement = squares(degree)?.0 - best;
        if improvement <= variance * more as f64 * reduced_chi_square_limit(more, 2.0) {
            return Ok(degree);
        }
    }
    Ok(options.degree_max)
}

/// The noise of a single sample from how far it lies from the line between its neighbours.
///
/// The median ignores the few samples where the axis turned or the curve bends; in a sparse
/// sweep the bend counts as noise, which only makes the check of fit milder.
fn neighbour_noise(points: &[HallPoint], voltage: fn(&HallPoint) -> f64) -> f64 {
    let residuals: Vec<f64> = points
        .windows(3)
        .map(|w| {
            let whole = (w[2].position - w[0].position).value();
            let share = (w[1].position - w[0].position).value() / whole;
            // Standing still, the share is noise of the encoder: the plain mean is right there.
            let share = if (0.2..=0.8).contains(&share) {
                share
            } else {
                0.5
            };
            let line = voltage(&w[0]) * (1.0 - share) + voltage(&w[2]) * share;
            let spread = 1.0 + share * share + (1.0 - share) * (1.0 - share);
            (voltage(&w[1]) - line) / spread.sqrt()
        })
        .collect();
    robust_sigma(&residuals).unwrap_or(0.0)
}

/// What the steps of a converter add to the noise: where it is quieter than its step, neighbours are equal
/// and say nothing. The step is the smallest difference of two samples.
fn converter_noise(points: &[HallPoint], voltage: fn(&HallPoint) -> f64) -> f64 {
    let differences = points
        .windows(2)
        .map(|w| (voltage(&w[1]) - voltage(&w[0])).abs());
    let step = differences
        .filter(|it| *it > 0.0)
        .fold(f64::INFINITY, f64::min);
    if step.is_finite() {
        of_rounding(step)
    } else {
        0.0
    }
}

/// The samples of one window.
struct Rows {
    rows: Vec<Row>,
    left_out: usize,
    with_lag: bool,
}

struct Row {
    /// Position in the window, −1 to 1.
    z: f64,
    travel: f64,
    voltage: f64,
    /// Square root of the statistical weight; 1 but while outliers are sought.
    weight: f64,
}

/// Whether the window was passed in both directions, so that a lag shows.
fn shows_lag(rows: &[Row]) -> bool {
    let forward = rows
        .iter()
        .filter(|r| r.travel > 0.0)
        .map(|r| r.travel)
        .sum::<f64>();
    let reverse = -rows
        .iter()
        .filter(|r| r.travel < 0.0)
        .map(|r| r.travel)
        .sum::<f64>();
    forward.min(reverse) > 0.1 * forward.max(reverse)
}

fn fit_rows(
    rows: &[Row],
    degree: usize,
    with_lag: bool,
) -> Result<least_squares::Fit, LeastSquaresError> {
    let columns = degree + 1 + usize::from(with_lag);
    let design: Vec<f64> = rows
        .iter()
        .flat_map(|r| {
            powers(r.z, degree)
                .chain(with_lag.then_some(r.travel))
                .map(|x| x * r.weight)
        })
        .collect();
    let voltages: Vec<f64> = rows.iter().map(|r| r.voltage * r.weight).collect();
    least_squares::solve(&design, columns, &voltages)
}

/// Rounds of reweighting before outliers are judged.
const ROUNDS: usize = 12;

/// Leaves out samples far from the polynomial of the highest degree.
///
/// A plain fit is bent by the wild samples themselves; weights of 1/|residual| make it the one
/// of least absolute residuals, which does not follow them while they are a minority.
fn drop_outliers(rows: &mut Vec<Row>, options: &RefineOptions) {
    let with_lag = shows_lag(rows);
    let mut sigma = 0.0;
    let mut residuals = Vec::new();
    for _ in 0..ROUNDS {
        let Ok(fit) = fit_rows(rows, options.degree_max, with_lag) else {
            break;
        };
        residuals = fit
            .residuals
            .iter()
            .zip(&*rows)
            .map(|(r, row)| r / row.weight)
            .collect();
        sigma = robust_sigma(&residuals).unwrap_or(0.0);
        if sigma == 0.0 {
            break;
        }
        for (row, residual) in rows.iter_mut().zip(&residuals) {
            row.weight = (sigma / residual.abs().max(sigma)).sqrt();
        }
    }
    let limit = if sigma > 0.0 {
        options.outlier_threshold * sigma
    } else {
        f64::INFINITY
    };
    let mut kept = residuals.into_iter().map(|r: f64| r.abs() <= limit);
    rows.retain(|_| kept.next().unwrap_or(true));
    rows.iter_mut().for_each(|row| row.weight = 1.0);
}

/// One sensor's polynomial in one window.
pub(super) struct Window {
    around: f64,
    half_window: f64,
    degree: usize,
    with_lag: bool,
    sigma: f64,
    pub(super) left_out: usize,
    fit: least_squares::Fit,
}

impl Window {
    /// Observation minus polynomial of every sample used, in volts.
    pub(super) fn residuals(&self) -> &[f64] {
        &self.fit.residuals
    }

    fn z(&self, x: f64) -> f64 {
        (x - self.around) / self.half_window
    }

    pub(super) fn value(&self, x: f64) -> f64 {
        powers(self.z(x), self.degree)
            .zip(&self.fit.coefficients)
            .map(|(p, c)| p * c)
            .sum()
    }

    pub(super) fn slope(&self, x: f64) -> f64 {
        let z = self.z(x);
        let powers: Vec<f64> = powers(z, self.degree).collect();
        (1..=self.degree)
            .map(|k| k as f64 * powers[k - 1] * self.fit.coefficients[k])
            .sum::<f64>()
            / self.half_window
    }

    /// Standard uncertainty of the voltage at `x`, at standstill.
    pub(super) fn standard_uncertainty(&self, x: f64) -> f64 {
        let gradient: Vec<f64> = powers(self.z(x), self.degree)
            .chain(self.with_lag.then_some(0.0))
            .collect();
        self.fit.variance(&gradient, self.sigma).sqrt()
    }

    /// Where the polynomial reaches `level`: Newton from the centre, inside the window.
    pub(super) fn solve(&self, sensor: Sensor, level: f64) -> Result<f64, RefineError> {
        let mut x = self.around;
        for _ in 0..30 {
            let step = (self.value(x) - level) / self.slope(x);
            x -= step;
            let inside = self.z(x).abs() <= 1.0;
            if !inside {
                break;
            }
            if step.abs() < 1e-15 {
                return Ok(x);
            }
        }
        let (level, around) = (Volts(level), Metres(self.around));
        Err(RefineError::NoCrossing {
            sensor,
            level,
            around,
        })
    }
}

/// The mean lag of the fits that show one: V(x − travel·lag) ≈ V(x) − V'·travel·lag.
pub(super) fn lag(fits: &[&Window]) -> Option<f64> {
    let lags: Option<Vec<f64>> = fits
        .iter()
        .map(|w| {
            let coefficient = w.fit.coefficients[w.degree + 1..].first()?;
            Some(-coefficient / w.slope(w.around))
        })
        .collect();
    mean(&lags?)
}
