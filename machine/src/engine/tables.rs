//! The active calibration of each axis as a correction of its cyclic set-points (system S3).
//!
//! The set-point is the exact inverse, as that of a profile move: the command whose expected
//! position is the one that the path wants, for the direction that the path goes. Where the path
//! turns round, the lost motion is slewed in by the engine; an axis without a calibration stays
//! uncorrected.

use compensator::apply::ApproachTracker;
use compensator::error_table::{Compensation, ErrorTable};
use units::{Approach, Metres};

use super::{AXES_MAX, Corrected, Correction, Observed, Validity};

/// Corrects each axis by its own table.
///
/// # Example
///
/// ```
/// use compensator::error_table::{
///     Compensation, EndPolicy, ErrorTable, Interpolation, Limits, Node,
/// };
/// use machine::engine::{Correction, Observed, TableCorrection};
/// use units::{Metres, MetresPerSecond, Time};
///
/// let nodes = [(0.0, 0.0), (10.0, 10.0)].map(|(mm, um)| Node {
///     position: Metres::from_mm(mm),
///     forward: Some(Metres::from_um(um)),
///     reverse: None,
///     u_forward: Some(Metres::from_um(0.5)),
///     u_reverse: None,
/// });
/// let (size, rate) = (Metres::from_um(50.0), MetresPerSecond(1.0));
/// let limits = Limits { size, slope: 0.01, rate };
/// let table = ErrorTable::new(nodes.to_vec())?;
/// let table = Compensation::new(table, Interpolation::Linear, limits, EndPolicy::Hold)?;
/// let place = [Metres::from_mm(5.005)];
/// let said = TableCorrection::new([Some(table)]).correct(&Observed {
///     now: Time::ZERO,
///     nominal: &place,
///     actual: &place,
///     spots: &[],
///     channels: &[],
///     temperatures: &[],
/// });
/// assert!((said.offset[0].um() + 5.0).abs() < 1e-6, "5 mm brings it to 5.005 mm");
/// assert!((said.uncertainty[0].um() - 0.5).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct TableCorrection {
    axes: Vec<Option<AxisTable>>,
}

#[derive(Clone, Debug)]
struct AxisTable {
    table: Compensation,
    approach: ApproachTracker,
}

impl TableCorrection {
    /// One table, or none, for each axis of the engine, in their order; more than
    /// [`AXES_MAX`] are not looked at.
    pub fn new(tables: impl IntoIterator<Item = Option<Compensation>>) -> Self {
        let of_axis = |table: Option<Compensation>| {
            table.map(|table| AxisTable {
                table,
                approach: ApproachTracker::new(),
            })
        };
        Self {
            axes: tables.into_iter().take(AXES_MAX).map(of_axis).collect(),
        }
    }
}

impl Correction for TableCorrection {
    fn correct(&mut self, observed: &Observed<'_>) -> Corrected {
        let mut said = Corrected::default();
        for (axis, (own, nominal)) in self.axes.iter_mut().zip(observed.nominal).enumerate() {
            let Some(own) = own else {
                continue;
            };
            let approach = own.approach.update(*nominal).unwrap_or(Approach::Forward);
            let Ok(set_point) = own.table.set_point(*nominal, approach) else {
                said.validity = Validity::Stop("the path leaves the calibrated range of an axis");
                continue;
            };
            said.offset[axis] = set_point - *nominal;
            said.uncertainty[axis] = uncertainty(own.table.table(), *nominal, approach);
        }
        said
    }
}

/// The standard uncertainty of the deviation at `position`: in a straight line between nodes,
/// that of the end node outside; infinite where none is known.
fn uncertainty(table: &ErrorTable, position: Metres, approach: Approach) -> Metres {
    let nodes = table.nodes();
    let above = nodes.partition_point(|node| node.position < position);
    let at = |index: usize| {
        let known = nodes[index].standard_uncertainty(approach);
        known.unwrap_or(Metres(f64::INFINITY))
    };
    if above == 0 {
        return at(0);
    }
    if above == nodes.len() {
        return at(above - 1);
    }
    let (low, high) = (&nodes[above - 1], &nodes[above]);
    let share = (position - low.position) / (high.position - low.position);
    at(above - 1) * (1.0 - share) + at(above) * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use compensator::error_table::{EndPolicy, Interpolation, Limits, Node};
    use units::{MetresPerSecond, Time};

    fn table(ends: EndPolicy) -> Compensation {
        let node = |mm: f64, forward_um: f64, u_nm: f64| Node {
            position: Metres::from_mm(mm),
            forward: Some(Metres::from_um(forward_um)),
            reverse: Some(Metres::from_um(forward_um + 3.0)),
            u_forward: Some(Metres::from_um(u_nm * 1e-3)),
            u_reverse: None,
        };
        let limits = Limits {
            size: Metres::from_um(50.0),
            slope: 0.01,
            rate: MetresPerSecond(1.0),
        };
        let nodes = vec![node(0.0, 2.0, 10.0), node(10.0, 4.0, 30.0)];
        let table = ErrorTable::new(nodes).unwrap();
        Compensation::new(table, Interpolation::Linear, limits, ends).unwrap()
    }

    fn said(correction: &mut TableCorrection, mm: [f64; 2]) -> Corrected {
        let nominal = mm.map(Metres::from_mm);
        correction.correct(&Observed {
            now: Time::ZERO,
            nominal: &nominal,
            actual: &nominal,
            spots: &[],
            channels: &[],
            temperatures: &[],
        })
    }

    #[track_caller]
    fn check_um(seen: Metres, um: f64) {
        assert!((seen.um() - um).abs() < 1e-9, "{} um, not {um}", seen.um());
    }

    #[test]
    fn the_set_point_is_the_inverse_for_the_direction_of_the_path() {
        let mut correction = TableCorrection::new([Some(table(EndPolicy::Hold)), None]);
        said(&mut correction, [4.0, 1.0]);
        let forward = said(&mut correction, [5.0, 2.0]);
        // c + 2 um + 0.0002 c = 5 mm.
        check_um(forward.offset[0], (5000.0 - 2.0) / 1.0002 - 5000.0);
        check_um(forward.uncertainty[0], 0.020);
        check_um(forward.offset[1], 0.0);
        let reverse = said(&mut correction, [4.0, 1.0]);
        check_um(reverse.offset[0], (4000.0 - 5.0) / 1.0002 - 4000.0);
        assert_eq!(reverse.uncertainty[0].value(), f64::INFINITY);
        // Standing still changes nothing.
        assert_eq!(said(&mut correction, [4.0, 1.0]), reverse);
        said(&mut correction, [4.1, 1.0]);
        check_um(said(&mut correction, [12.0, 1.0]).uncertainty[0], 0.030);
        assert_eq!(reverse.validity, Validity::Valid);
    }

    #[test]
    fn outside_the_calibrated_range_nothing_is_corrected_silently() {
        let mut correction = TableCorrection::new([Some(table(EndPolicy::Refuse))]);
        assert_eq!(said(&mut correction, [9.0, 0.0]).validity, Validity::Valid);
        let beyond = said(&mut correction, [11.0, 0.0]);
        assert!(matches!(beyond.validity, Validity::Stop(_)), "{beyond:?}");
    }
}
