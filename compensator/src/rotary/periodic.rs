//! The deviation of a rotary axis between the lines, and the command that undoes it.
//!
//! A table holds the deviation (actual − target) at N equal steps of the circle; between them it
//! is a trigonometric polynomial through all of them (band-limited) or straight lines. The
//! polynomial is evaluated on a finer circle once, with two Fourier transforms, and made of cubics
//! with its values and slopes there, so that a call costs the same for any number of lines. Such a
//! cubic of width h is nowhere further from the polynomial than h⁴/384 · max|E⁗|, and
//! max|E⁗| ≤ Σ k⁴a_k over its amplitudes: [`PeriodicCompensation::interpolation_error`].
//!
//! actual(c) = c + deviation(c) rises everywhere when |d deviation/dc| < 1, which is judged by
//! the closed-form extremes of every cubic; then one command reaches each target, on any turn.
//!
//! Absent: a rate limit (the axis's own is far below what these slopes ask for); both approaches
//! apart (a table turns on a bearing, not on a screw).

use core::f64::consts::TAU;

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use units::Radians;
use units::portable::powi;

use crate::error_table::Curve;
use crate::interpolation::Segment;

/// Cubics for each line at least and at most; as many as make the polynomial exact to
/// [`ERROR_WANTED`].
const REFINEMENTS: [usize; 4] = [4, 8, 16, 32];

/// No more cubics than this for one table.
const PIECES_MAX: usize = 1 << 18;

/// 1 µas: a thousandth of what the best instruments tell.
const ERROR_WANTED: f64 = 5e-12;

/// How the deviation between two lines is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PeriodicInterpolation {
    /// The trigonometric polynomial through all lines: right for errors without harmonics above
    /// half the number of lines.
    BandLimited,
    /// Straight lines.
    Linear,
}

/// What a correction may do at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeriodicLimits {
    /// Largest magnitude of the deviation corrected.
    pub size: Radians,
    /// Largest |d deviation/dθ|, dimensionless, below 1.
    pub slope: f64,
}

/// Why deviations do not form a table, or a table cannot be used to compensate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PeriodicError {
    /// Fewer than two lines.
    #[error("rotary error table: {seen} line(s); at least 2 are needed")]
    TooFewLines {
        /// Lines given.
        seen: usize,
    },
    /// Another number of uncertainties than of deviations.
    #[error("rotary error table: {seen} uncertainties for {lines} lines")]
    Uncertainties {
        /// Uncertainties given.
        seen: usize,
        /// Lines given.
        lines: usize,
    },
    /// A NaN, an infinity or a negative uncertainty.
    #[error("rotary error table, line {line}: a value is not finite or an uncertainty is negative")]
    NotFinite {
        /// Which line.
        line: usize,
    },
    /// A limit that is not positive and finite, or a slope limit of 1 and more.
    #[error(
        "rotary compensation: the limits are {:.3} arcsec and a slope of {slope}; both must be \
         positive, the slope below 1", size.arcsec(), slope = units::Short(*slope))]
    Limits {
        /// The limit of size.
        size: Radians,
        /// The limit of slope.
        slope: f64,
    },
    /// A deviation larger than the limit.
    #[error(
        "rotary compensation: the deviation near {:.4} degrees is {:.3} arcsec, the limit {:.3} \
         arcsec; another unit, or the table of another axis?",
        position.value().to_degrees(), seen.arcsec(), limit.arcsec()
    )]
    TooLarge {
        /// Where.
        position: Radians,
        /// The deviation.
        seen: Radians,
        /// The limit.
        limit: Radians,
    },
    /// A slope above the limit.
    #[error(
        "rotary compensation: near {:.4} degrees the deviation has a slope of {:.3} arcsec per \
         degree, the limit is {:.3}",
        position.value().to_degrees(), seen * 3600.0, limit * 3600.0
    )]
    TooSteep {
        /// Where.
        position: Radians,
        /// The largest magnitude of the slope there.
        seen: f64,
        /// The limit.
        limit: f64,
    },
    /// A slope of 1 or more: several commands, or none, reach a target.
    #[error(
        "rotary compensation: near {:.4} degrees the deviation has a slope of {seen:.3}; from 1 \
         on the correction has no unique inverse", position.value().to_degrees()
    )]
    NotInvertible {
        /// Where.
        position: Radians,
        /// The largest magnitude of the slope there.
        seen: f64,
    },
}

/// A command or target that is no angle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("rotary compensation: {seen} rad is not a usable angle", seen = units::Short(*seen))]
pub struct NotAnAngle {
    /// What was asked for: a NaN or an infinity.
    pub seen: f64,
}

/// The deviations of a rotary axis at equal steps of the circle, line n at n/N of a turn.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicTable {
    deviations: Vec<Radians>,
    uncertainties: Option<Vec<Radians>>,
}

impl PeriodicTable {
    /// Checks deviations (actual − target) and their standard uncertainties, where known.
    ///
    /// # Errors
    /// When there are fewer than two, numbers differ, or a value is not finite.
    pub fn new(
        deviations: Vec<Radians>,
        uncertainties: Option<Vec<Radians>>,
    ) -> Result<Self, PeriodicError> {
        let lines = deviations.len();
        if lines < 2 {
            return Err(PeriodicError::TooFewLines { seen: lines });
        }
        let seen = uncertainties.as_ref().map_or(lines, Vec::len);
        if seen != lines {
            return Err(PeriodicError::Uncertainties { seen, lines });
        }
        let sound = |line: usize| {
            let u = uncertainties.as_ref().map_or(Radians::ZERO, |it| it[line]);
            deviations[line].is_finite() && u.is_finite() && u >= Radians::ZERO
        };
        match (0..lines).find(|line| !sound(*line)) {
            Some(line) => Err(PeriodicError::NotFinite { line }),
            None => Ok(Self {
                deviations,
                uncertainties,
            }),
        }
    }

    /// Deviation (actual − target) at each line.
    pub fn deviations(&self) -> &[Radians] {
        &self.deviations
    }

    /// Standard uncertainty of each, where known.
    pub fn uncertainties(&self) -> Option<&[Radians]> {
        self.uncertainties.as_deref()
    }

    /// The larger second difference of a line and the next one: what bends between them.
    pub(super) fn bend(&self, line: usize) -> f64 {
        let lines = self.deviations.len();
        let at = |line: usize| self.deviations[line % lines].value();
        let own = |line: usize| (at(line + lines - 1) - 2.0 * at(line) + at(line + 1)).abs();
        own(line).max(own(line + 1))
    }
}

/// A table made ready to be applied: no allocation and a constant time per call.
///
/// # Example
///
/// ```
/// use compensator::rotary::{
///     PeriodicCompensation, PeriodicInterpolation, PeriodicLimits, PeriodicTable,
/// };
/// use units::Radians;
///
/// // An error of 6″ once a turn, known at 36 lines.
/// let error = |angle: f64| Radians::from_arcsec(6.0 * angle.to_radians().cos());
/// let table = PeriodicTable::new((0..36).map(|line| error(10.0 * f64::from(line))).collect(), None)?;
/// let limits = PeriodicLimits { size: Radians::from_arcsec(60.0), slope: 0.05 };
/// let made = PeriodicCompensation::new(table, PeriodicInterpolation::BandLimited, limits)?;
/// let target = Radians::from_degrees(725.0);
/// let command = made.set_point(target)?;
/// let reached = command + made.deviation(command)?;
/// assert!((reached - target).arcsec().abs() < 1e-6, "on any turn");
/// assert!((made.deviation(Radians::from_degrees(5.0))? - error(5.0)).arcsec().abs() < 2e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct PeriodicCompensation {
    table: PeriodicTable,
    interpolation: PeriodicInterpolation,
    limits: PeriodicLimits,
    curve: Curve,
    /// Deviation at 0, where actual enters the turn.
    seam: f64,
    largest: f64,
    steepest: f64,
    interpolation_error: f64,
}

impl PeriodicCompensation {
    /// Proves that `table` can be undone within `limits` and prepares it.
    ///
    /// # Errors
    /// When a limit is no limit, or the interpolated deviation exceeds one anywhere; with the
    /// place, value and limit.
    pub fn new(
        table: PeriodicTable,
        interpolation: PeriodicInterpolation,
        limits: PeriodicLimits,
    ) -> Result<Self, PeriodicError> {
        let PeriodicLimits { size, slope } = limits;
        if !(size > Radians::ZERO && size.is_finite() && slope > 0.0 && slope < 1.0) {
            return Err(PeriodicError::Limits { size, slope });
        }
        let values: Vec<f64> = table.deviations.iter().map(|it| it.value()).collect();
        let (pieces, interpolation_error) = match interpolation {
            PeriodicInterpolation::BandLimited => band_limited(&values),
            PeriodicInterpolation::Linear => (straight(&values), 0.0),
        };
        let largest = extreme(&pieces, Segment::largest);
        let steepest = extreme(&pieces, Segment::steepest);
        check(largest, steepest, &limits)?;
        Ok(Self {
            table,
            interpolation,
            limits,
            curve: Curve::new(&pieces, values[0], values[0], false),
            seam: values[0],
            largest: largest.1,
            steepest: steepest.1,
            interpolation_error,
        })
    }

    /// The deviation (actual − command) expected for a command, on any turn.
    ///
    /// # Errors
    /// When the command is a NaN or infinite.
    pub fn deviation(&self, command: Radians) -> Result<Radians, NotAnAngle> {
        let within = within_turn(command, 0.0)?;
        Ok(Radians(self.curve.deviation(within)))
    }

    /// The command for which command + deviation(command) = `target`, exactly, on any turn.
    ///
    /// # Errors
    /// When the target is a NaN or infinite.
    pub fn set_point(&self, target: Radians) -> Result<Radians, NotAnAngle> {
        // The correction, not the command, is taken from the turn: it keeps its digits then.
        let within = within_turn(target, self.seam)?;
        Ok(target + Radians(self.curve.command(within) - within))
    }

    /// The standard uncertainty of the deviation at a command; `None` when the table has none.
    ///
    /// Between two lines it is the root of the linear mean of both variances: exact for a
    /// band-limited deviation whose harmonics are uncertain independently and alike round the
    /// circle, and never too small for straight lines, however the lines depend on each other.
    /// For these what a parabola with the second differences at hand would do between the lines
    /// is added.
    ///
    /// # Errors
    /// When the command is a NaN or infinite.
    pub fn standard_uncertainty(&self, command: Radians) -> Result<Option<Radians>, NotAnAngle> {
        let within = within_turn(command, 0.0)?;
        let Some(uncertainties) = &self.table.uncertainties else {
            return Ok(None);
        };
        let lines = uncertainties.len();
        let place = within / TAU * lines as f64;
        let line = (place as usize).min(lines - 1);
        let part = (place - line as f64).clamp(0.0, 1.0);
        let square = |at: usize| powi(uncertainties[at % lines].value(), 2);
        let own = square(line) * (1.0 - part) + square(line + 1) * part;
        let bent = match self.interpolation {
            PeriodicInterpolation::BandLimited => 0.0,
            PeriodicInterpolation::Linear => part * (1.0 - part) / 2.0 * self.table.bend(line),
        };
        Ok(Some(Radians((own + bent * bent).sqrt())))
    }

    /// The table this was made from.
    pub fn table(&self) -> &PeriodicTable {
        &self.table
    }

    /// The interpolation in use.
    pub fn interpolation(&self) -> PeriodicInterpolation {
        self.interpolation
    }

    /// The limits it was checked against.
    pub fn limits(&self) -> PeriodicLimits {
        self.limits
    }

    /// The largest magnitude of the deviation anywhere.
    pub fn largest(&self) -> Radians {
        Radians(self.largest)
    }

    /// The largest magnitude of d deviation/dθ anywhere, dimensionless.
    pub fn steepest_slope(&self) -> f64 {
        self.steepest
    }

    /// How far the deviation used may be from the trigonometric polynomial, proven; 0 for
    /// straight lines.
    pub fn interpolation_error(&self) -> Radians {
        Radians(self.interpolation_error)
    }
}

/// `angle` less whole turns: from `start` to `start` + one turn.
fn within_turn(angle: Radians, start: f64) -> Result<f64, NotAnAngle> {
    let seen = angle.value();
    if !seen.is_finite() {
        return Err(NotAnAngle { seen });
    }
    let turns = ((seen - start) / TAU).floor();
    let within = seen - turns * TAU;
    // Rounding may leave it a hair outside.
    Ok(within.clamp(start, start + TAU))
}

/// The largest `figure` of any piece, and where that piece begins.
fn extreme(pieces: &[Segment], figure: impl Fn(&Segment) -> f64) -> (Radians, f64) {
    let each = pieces.iter().map(|piece| (piece.start, figure(piece)));
    let largest = each.max_by(|a, b| a.1.total_cmp(&b.1));
    let (start, figure) = largest.expect("two lines have pieces between them");
    (Radians(start), figure)
}

fn check(
    largest: (Radians, f64),
    steepest: (Radians, f64),
    limits: &PeriodicLimits,
) -> Result<(), PeriodicError> {
    let (position, seen) = steepest;
    if seen >= 1.0 {
        return Err(PeriodicError::NotInvertible { position, seen });
    }
    if seen > limits.slope {
        let limit = limits.slope;
        return Err(PeriodicError::TooSteep {
            position,
            seen,
            limit,
        });
    }
    let (position, seen) = (largest.0, Radians(largest.1));
    if seen > limits.size {
        let limit = limits.size;
        return Err(PeriodicError::TooLarge {
            position,
            seen,
            limit,
        });
    }
    Ok(())
}

fn straight(values: &[f64]) -> Vec<Segment> {
    let lines = values.len();
    let place = |line: usize| TAU * line as f64 / lines as f64;
    let value = |line: usize| values[line % lines];
    (0..lines)
        .map(|at| Segment::line(place(at), value(at), place(at + 1), value(at + 1)))
        .collect()
}

/// Cubics that follow the trigonometric polynomial through `values`, and how closely.
fn band_limited(values: &[f64]) -> (Vec<Segment>, f64) {
    let lines = values.len();
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(lines);
    let mut spectrum = forward.make_output_vec();
    let transformed = forward.process(&mut values.to_vec(), &mut spectrum);
    transformed.expect("the lengths are the planner's");
    spectrum.iter_mut().for_each(|it| *it /= lines as f64);
    if lines.is_multiple_of(2) {
        // Half of it belongs to the negative frequency, which a longer spectrum has apart.
        spectrum[lines / 2] *= 0.5;
    }
    let harmonics = || spectrum.iter().enumerate().skip(1);
    let fourth: f64 = harmonics()
        .map(|(k, it)| 2.0 * it.norm() * powi(k as f64, 4))
        .sum();
    let error = |refinement: usize| powi(TAU / (refinement * lines) as f64, 4) / 384.0 * fourth;
    let allowed = |it: &&usize| **it == REFINEMENTS[0] || **it * lines <= PIECES_MAX;
    let possible = || REFINEMENTS.iter().filter(allowed);
    let wanted = possible().find(|it| error(**it) <= ERROR_WANTED);
    let refinement = *wanted
        .or(possible().next_back())
        .expect("the first is possible");
    let count = refinement * lines;
    let mut finer = |factor: &dyn Fn(usize) -> Complex<f64>| {
        let inverse = planner.plan_fft_inverse(count);
        let mut padded = inverse.make_input_vec();
        for (k, (to, from)) in padded.iter_mut().zip(&spectrum).enumerate() {
            *to = *from * factor(k);
        }
        let mut output = inverse.make_output_vec();
        let transformed = inverse.process(&mut padded, &mut output);
        transformed.expect("a real signal has real ends of its spectrum");
        output
    };
    let value = finer(&|_| Complex::new(1.0, 0.0));
    let slope = finer(&|k| Complex::new(0.0, k as f64));
    let place = |at: usize| TAU * at as f64 / count as f64;
    let piece = |at: usize| {
        let next = (at + 1) % count;
        let (start, end) = (place(at), place(at + 1));
        Segment::hermite(start, value[at], slope[at], end, value[next], slope[next])
    };
    ((0..count).map(piece).collect(), error(refinement))
}

#[cfg(test)]
#[path = "periodic_tests.rs"]
mod tests;
