//! Which of the planned unknowns the readings determine.

use core::fmt;

use nalgebra::DMatrix;

use super::Unknown;
use super::design::Design;

/// Below this share of the largest singular value (columns scaled to unit length) a combination
/// counts as not seen: its uncertainty would be 10⁷ times that of the best one.
const SEEN_SHARE: f64 = 1e-7;

/// An error is named when it has at least this part in an unseen combination.
const NAMED_SHARE: f64 = 1e-3;

/// Which combinations of errors the readings do not determine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observability {
    /// Each of them by what takes part in it, in the order of the plan.
    pub unseen: Vec<Vec<Unknown>>,
    /// The largest ratio of uncertainties between combinations that are seen: the condition
    /// number of the scaled problem.
    pub condition: f64,
}

impl Observability {
    /// Whether everything planned is told.
    pub fn is_complete(&self) -> bool {
        self.unseen.is_empty()
    }

    /// Whether nothing unseen concerns `unknown`.
    pub fn sees(&self, unknown: Unknown) -> bool {
        !self.unseen.iter().any(|it| it.contains(&unknown))
    }
}

impl fmt::Display for Observability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut said: Vec<(&Vec<Unknown>, usize)> = Vec::new();
        for direction in &self.unseen {
            match said.iter_mut().find(|(names, _)| *names == direction) {
                Some((_, count)) => *count += 1,
                None => said.push((direction, 1)),
            }
        }
        for (at, (names, count)) in said.iter().enumerate() {
            if at > 0 {
                f.write_str("; ")?;
            }
            for (at, name) in names.iter().enumerate() {
                if at > 0 {
                    f.write_str(" / ")?;
                }
                name.fmt(f)?;
            }
            if *count > 1 {
                write!(f, " ({count} combinations)")?;
            }
        }
        Ok(())
    }
}

pub(super) fn observe(design: &Design) -> Observability {
    let columns = design.columns();
    let rows = design.values.len();
    let mut matrix = DMatrix::from_row_slice(rows, columns, &design.rows);
    for mut column in matrix.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column.unscale_mut(length);
        }
    }
    // With fewer rows than columns, rows of zeros make what is missing visible.
    let square = if rows > columns {
        matrix.qr().r()
    } else {
        matrix.resize_vertically(columns, 0.0)
    };
    let svd = square.svd(false, true);
    let right = svd.v_t.expect("it was asked for");
    let largest = svd.singular_values.max();
    let is_seen = |at: usize| svd.singular_values[at] > SEEN_SHARE * largest;
    let seen = (0..columns).filter(|at| is_seen(*at));
    let least = seen
        .map(|at| svd.singular_values[at])
        .fold(largest, f64::min);
    let hidden: Vec<usize> = (0..columns).filter(|at| !is_seen(*at)).collect();
    let directions = sparse(right.select_rows(&hidden));
    let unseen = directions.row_iter().map(|direction| {
        let strongest = direction.amax();
        let mut names = Vec::new();
        for (share, unknown) in direction.iter().zip(&design.unknowns) {
            if share.abs() > NAMED_SHARE * strongest && !names.contains(unknown) {
                names.push(*unknown);
            }
        }
        names
    });
    Observability {
        unseen: unseen.collect(),
        condition: largest / least,
    }
}

/// The same combinations, each with as few errors as elimination makes possible: every one
/// has a column of its own in which the others are zero.
fn sparse(mut rows: DMatrix<f64>) -> DMatrix<f64> {
    let (count, columns) = rows.shape();
    let mut free: Vec<usize> = (0..count).collect();
    for _ in 0..count {
        let places = free
            .iter()
            .flat_map(|row| (0..columns).map(|column| (*row, column)));
        let strength = |place: &(usize, usize)| rows[*place].abs();
        let Some(pivot) = places.max_by(|a, b| strength(a).total_cmp(&strength(b))) else {
            break;
        };
        let value = rows[pivot];
        if value == 0.0 {
            break;
        }
        free.retain(|row| *row != pivot.0);
        let own = rows.row(pivot.0) / value;
        for row in 0..count {
            let factor = if row == pivot.0 {
                0.0
            } else {
                rows[(row, pivot.1)]
            };
            let reduced = rows.row(row) - &own * factor;
            rows.set_row(row, &reduced);
        }
        rows.set_row(pivot.0, &own);
    }
    rows
}
