//! Paths that the axes of a group follow together.

use core::fmt;
use core::time::Duration;
use std::sync::Arc;

use machine::engine::{CsvPath, Join};
use machine::records::Store;
use units::Metres;

use crate::failure::Failure;

/// A path that was judged, and can be followed to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedPath {
    /// What is driven, one point for each period.
    pub path: Arc<CsvPath>,
    /// How far that is.
    pub travel: Metres,
    /// How long it takes.
    pub takes: Duration,
}

impl JudgedPath {
    pub(crate) fn new(path: CsvPath, period: Duration) -> Self {
        let steps = path.points.windows(2).map(|pair| {
            let axes = pair[0].iter().zip(&pair[1]);
            let squares = axes.map(|(from, to)| {
                let step = (*to - *from).value();
                step * step
            });
            squares.sum::<f64>().sqrt()
        });
        let travel = Metres(steps.sum());
        let periods = path.points.len().saturating_sub(1) as f64;
        Self {
            travel,
            takes: period.mul_f64(periods),
            path: Arc::new(path),
        }
    }
}

type Judging = dyn Fn(&Store, (&str, Option<Join>), bool) -> Result<JudgedPath, Failure> + Send;

/// Judges paths, on whatever thread that is done: long ones take seconds.
pub struct PathJudge(Box<Judging>);

impl PathJudge {
    pub(crate) fn new(
        judging: impl Fn(&Store, (&str, Option<Join>), bool) -> Result<JudgedPath, Failure>
        + Send
        + 'static,
    ) -> Self {
        Self(Box::new(judging))
    }

    /// Judges the path with these `rows`, point by point as it will be driven, corrected by what is in `store` or not. Without
    /// a `join` they are joined as they say themselves.
    ///
    /// # Errors
    /// It is to be corrected, and nothing was measured; the first row and column that cannot be read, or the first point that cannot be driven.
    pub fn judge(
        &self,
        store: &Store,
        (rows, join): (&str, Option<Join>),
        is_corrected: bool,
    ) -> Result<JudgedPath, Failure> {
        (self.0)(store, (rows, join), is_corrected)
    }
}

impl fmt::Debug for PathJudge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PathJudge")
    }
}
