//! Did the instrument's count slip during one of two runs over the same places?
//!
//! A counter of half wavelengths that misses one stays off by a whole number of them. The stage's own
//! deviation drops out of the change from run to run; what is left is the scatter of two readings, what
//! drifts, and the slip: a step of a whole number of counts that stays. It is a test, not a threshold:
//!
//! - The changes, in the order of time, are fitted by a straight line (drift), and by a line with a step
//!   after each reading in turn. The step that explains most is compared with what is left by Fisher's F,
//!   so that a stage that repeats badly is judged by its own scatter. With the chance of one step
//!   multiplied by the number of places (Bonferroni), noise makes a step in at most
//!   1/[`SLIP_FALSE_ALARMS`] of the comparisons.
//! - The step must explain more than its rivals of as few parameters: one reading that is off, and a drift
//!   that bends (a cubic). It must still be there when the lost motion may have changed, which between the
//!   turns looks like it.
//! - Both sides of it must scatter alike, but for chance. Where its shorter side has nothing but readings
//!   after a turn of the stage, the other readings after a turn must scatter like the rest, too: a servo
//!   that overshoots takes up lost motion now from one side, now from the other.
//! - Its size must be a whole number of counts, as well as it is known.
//! - On either side of it are at least two readings: of a single one nobody can tell whether it is
//!   itself off.
//! - What was read between the runs belongs to both, as the end of one and the start of the other. A count
//!   that slips among these readings changes all of them but the first ones and the last ones.
//!
//! Absent: two slips in one comparison; a step that is no whole number of counts.

use core::ops::Range;

use units::{Approach, Metres};

use crate::least_squares::{LeastSquaresError, powers, solve};
use crate::significance::f_tail;

/// The largest share of comparisons of sound runs in which a slip is seen.
pub const SLIP_FALSE_ALARMS: f64 = 5e-5;

/// Readings that there must be on either side of a slip.
const READINGS: usize = 2;

/// So many standard uncertainties a step may be from a whole number of counts.
pub(super) const COVERAGE: f64 = 4.0;

/// The share of slips that are passed over because some readings scatter more by chance.
const UNLIKE: f64 = 1e-4;

/// How often a lost motion that changed between the runs is taken for a slip, when it changed by a whole number
/// of counts, which is seldom enough. In a run of 11 targets both ways, less would hide one in six counts that
/// slip at the turn and show against the lost motion in two readings of the datum only.
const LOST_MOTION: f64 = 1e-2;

/// How well the length of a count is known: it changes with the air by 3e-4.
pub(super) const COUNT_LENGTH: f64 = 1e-3;

/// Of fewer readings nothing can be said.
const READINGS_MIN: usize = 8;

/// Drift, in the simplest way, and in one with a parameter more than a line with a step.
const LINE: usize = 1;
const CUBIC: usize = 3;

/// What the instrument reads at one place more in the later run than in the earlier one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// By how much.
    pub size: Metres,
    /// From which side the stage had come.
    pub approach: Approach,
    /// Whether the stage had just changed its direction of travel.
    pub is_after_turn: bool,
}

/// A count that slipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slip {
    /// The first change that shows it.
    pub at: usize,
    /// By how many counts the instrument reads more from there on, in the run in which it slipped.
    pub counts: i64,
    /// Whether the earlier run is the one in which it slipped, or at the end of which.
    pub is_in_the_earlier_run: bool,
}

/// The slip in `readings` (one for each reading, in the order of time), if there is one; `count` is the length
/// of one count. The last `shared` readings of the earlier run are also the first ones of the later run.
///
/// Of fewer than eight readings nothing can be said.
pub fn find_slip(readings: &[Change], shared: usize, count: Metres) -> Option<Slip> {
    let changes: Vec<f64> = readings.iter().map(|it| it.size.value()).collect();
    let size = changes.len();
    if size < READINGS_MIN {
        return None;
    }
    let drift = Sound::drifting(size, LINE);
    let shifted = places(size, shared).map(|shifted| Stepped::new(&drift, &changes, shifted));
    let step = strongest(shifted)?;
    // NaN, too, is no slip.
    let is_real = step.chance() * (size as f64) < SLIP_FALSE_ALARMS;
    if !is_real || !beats_its_rivals(&step, &drift, &changes) {
        return None;
    }
    let step = Stepped::new(&drift.with_lost_motion(readings), &changes, step.shifted);
    if step.chance() > LOST_MOTION || !step.sides_agree() || !step.turns_agree(readings) {
        return None;
    }
    let counts = step.whole_counts(count).filter(|it| *it != 0)?;
    Some(step.as_slip(counts, &changes))
}

/// Which readings of `size` a slip may shift: all from one on, or, when it came among the shared ones, all but
/// the first and the last of these.
fn places(size: usize, shared: usize) -> impl Iterator<Item = Range<usize>> {
    let within = (READINGS..=size - READINGS).map(move |at| at..size);
    let among = (1..shared).map(move |at| at..size - (shared - at));
    within.chain(among)
}

/// Whether the step explains more than any single reading that is off, and than a drift that bends.
fn beats_its_rivals(step: &Stepped, drift: &Sound, changes: &[f64]) -> bool {
    let size = changes.len();
    let rest = drift.without(changes.to_vec());
    let spikes = (0..size).map(|at| Explained::new(drift, &rest, spike(size, at)));
    let cubic = Sound::drifting(size, CUBIC);
    let bent = squares(&cubic.without(changes.to_vec())) / (size - cubic.0.len()) as f64;
    spikes.map(|it| it.squares()).fold(0.0, f64::max) < step.column.squares()
        && step.variance < bent
}

/// What a sound stage does and a shift of some readings, fitted to the changes.
struct Stepped {
    shifted: Range<usize>,
    column: Explained,
    left: Vec<f64>,
    variance: f64,
    freedom: usize,
}

impl Stepped {
    fn new(sound: &Sound, changes: &[f64], shifted: Range<usize>) -> Self {
        let rest = sound.without(changes.to_vec());
        let column = Explained::new(sound, &rest, step(changes.len(), &shifted));
        let left = column.without(&rest);
        let freedom = changes.len() - sound.0.len() - 1;
        Self {
            shifted,
            variance: (squares(&left) / freedom as f64).max(f64::MIN_POSITIVE),
            column,
            left,
            freedom,
        }
    }

    /// In which run it slipped: in the one whose readings are not what they are in the other. What slipped
    /// between the runs is told with the earlier one.
    fn as_slip(&self, counts: i64, changes: &[f64]) -> Slip {
        let at = self.shifted.start;
        let (before, after) = changes.split_at(at);
        let is_between = self.shifted.end < changes.len();
        let is_undone = !is_between && mean(after).abs() < mean(before).abs();
        Slip {
            at,
            counts: if is_undone { -counts } else { counts },
            is_in_the_earlier_run: is_between || is_undone,
        }
    }

    /// With which probability noise makes such a step in this place.
    fn chance(&self) -> f64 {
        f_tail(self.column.squares() / self.variance, 1, self.freedom)
    }

    /// Its size in counts, if that is a whole number of them as well as it is known.
    fn whole_counts(&self, count: Metres) -> Option<i64> {
        let counts = self.column.size() / count.value();
        let uncertainty = (self.variance / self.column.length).sqrt() / count.value();
        let whole = counts.round();
        let is_whole =
            (counts - whole).abs() <= COVERAGE * uncertainty + COUNT_LENGTH * whole.abs();
        is_whole.then_some(whole as i64)
    }

    /// Whether what is left of the shorter side is like that of the longer one: a count that slips shifts
    /// every reading by the same. Where readings scatter more by themselves, they are no evidence of it.
    fn sides_agree(&self) -> bool {
        let (short, long) = self.sides();
        let left =
            |places: &[usize]| -> Vec<f64> { places.iter().map(|it| self.left[*it]).collect() };
        scatter_alike(&left(&short), &left(&long))
    }

    /// Whether the readings after a turn are evidence of a step that nothing but such readings shows: not
    /// when the other ones are off what the readings between the turns let expect.
    fn turns_agree(&self, readings: &[Change]) -> bool {
        let (short, long) = self.sides();
        if !short.iter().all(|it| readings[*it].is_after_turn) {
            return true;
        }
        let is_between = |it: &usize| !readings[*it].is_after_turn;
        let (between, turns): (Vec<usize>, Vec<usize>) = long.into_iter().partition(is_between);
        let Ok(expected) = Expected::new(readings, &between) else {
            return true;
        };
        let off = |places: &[usize]| -> Vec<f64> {
            places
                .iter()
                .map(|it| expected.off(readings, *it))
                .collect()
        };
        scatter_alike(&off(&turns), &off(&between))
    }

    /// The places of the readings that it shifts and of the others, the fewer ones first.
    fn sides(&self) -> (Vec<usize>, Vec<usize>) {
        let places = 0..self.left.len();
        let (shifted, others): (Vec<usize>, Vec<usize>) =
            places.partition(|it| self.shifted.contains(it));
        if others.len() <= shifted.len() {
            (others, shifted)
        } else {
            (shifted, others)
        }
    }
}

fn strongest(steps: impl Iterator<Item = Stepped>) -> Option<Stepped> {
    steps.max_by(|a, b| a.column.squares().total_cmp(&b.column.squares()))
}

/// Whether `some` are larger than `others`, of which three numbers were fitted, by no more than noise often
/// makes them.
fn scatter_alike(some: &[f64], others: &[f64]) -> bool {
    let freedom = others.len().saturating_sub(LINE + 2).max(1);
    let ratio = (squares(some) / some.len().max(1) as f64) / (squares(others) / freedom as f64);
    f_tail(ratio, some.len(), freedom) > UNLIKE
}

/// Drift and a change of lost motion, fitted to some readings.
struct Expected(Vec<f64>);

impl Expected {
    fn new(readings: &[Change], places: &[usize]) -> Result<Self, LeastSquaresError> {
        let design: Vec<f64> = places
            .iter()
            .flat_map(|it| Self::row(readings, *it))
            .collect();
        let seen: Vec<f64> = places.iter().map(|it| readings[*it].size.value()).collect();
        let columns = Self::row(readings, 0).len();
        Ok(Self(solve(&design, columns, &seen)?.coefficients))
    }

    fn row(readings: &[Change], place: usize) -> [f64; LINE + 2] {
        [
            1.0,
            place as f64 / readings.len() as f64,
            side(&readings[place]),
        ]
    }

    /// By how much the reading at `place` is off it.
    fn off(&self, readings: &[Change], place: usize) -> f64 {
        readings[place].size.value() - dot(&Self::row(readings, place), &self.0)
    }
}

fn side(it: &Change) -> f64 {
    match it.approach {
        Approach::Forward => 1.0,
        Approach::Reverse => -1.0,
    }
}

/// What a sound stage does from run to run, as orthogonal columns of unit length.
#[derive(Clone)]
struct Sound(Vec<Vec<f64>>);

impl Sound {
    /// Its readings drift, as a polynomial of the time.
    fn drifting(size: usize, degree: usize) -> Self {
        let middle = (size - 1) as f64 / 2.0;
        let x = |at: usize| (at as f64 - middle) / middle;
        let mut all = Self(Vec::new());
        for degree in 0..=degree {
            let powers = (0..size).filter_map(|at| powers(x(at), degree).last());
            all.push(powers.collect());
        }
        all
    }

    /// Its lost motion changes, too.
    fn with_lost_motion(&self, readings: &[Change]) -> Self {
        let mut all = self.clone();
        all.push(readings.iter().map(side).collect());
        all
    }

    /// With one more column, unless it says nothing new: of runs in one direction lost motion does not show.
    fn push(&mut self, column: Vec<f64>) {
        let mut rest = self.without(column);
        let length = squares(&rest).sqrt();
        if length > 1e-6 {
            rest.iter_mut().for_each(|it| *it /= length);
            self.0.push(rest);
        }
    }

    /// What they leave of `values`.
    fn without(&self, mut values: Vec<f64>) -> Vec<f64> {
        for column in &self.0 {
            let share = dot(column, &values);
            for (value, it) in values.iter_mut().zip(column) {
                *value -= share * it;
            }
        }
        values
    }
}

/// What one more column explains.
struct Explained {
    /// The column without what a sound stage does, and its squared length.
    column: Vec<f64>,
    length: f64,
    product: f64,
}

impl Explained {
    fn new(sound: &Sound, rest: &[f64], column: Vec<f64>) -> Self {
        let column = sound.without(column);
        Self {
            product: dot(&column, rest),
            length: squares(&column),
            column,
        }
    }

    /// By how much the sum of squares becomes less.
    fn squares(&self) -> f64 {
        self.product * self.product / self.length
    }

    /// Its coefficient.
    fn size(&self) -> f64 {
        self.product / self.length
    }

    /// What it leaves of `rest`.
    fn without(&self, rest: &[f64]) -> Vec<f64> {
        let pairs = rest.iter().zip(&self.column);
        pairs.map(|(rest, it)| rest - self.size() * it).collect()
    }
}

fn step(size: usize, shifted: &Range<usize>) -> Vec<f64> {
    let is_shifted = |it: usize| f64::from(u8::from(shifted.contains(&it)));
    (0..size).map(is_shifted).collect()
}

fn spike(size: usize, at: usize) -> Vec<f64> {
    (0..size).map(|it| f64::from(u8::from(it == at))).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn squares(values: &[f64]) -> f64 {
    dot(values, values)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
#[path = "slip_tests.rs"]
mod tests;
