//! What an operator is asked to set up before a line is measured.

use compensator::volumetric::identify::direction;
use compensator::volumetric::{Axis, Point};

use crate::failure::Failure;

/// What a line is measured with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineOptics {
    /// Displacement of the tool along the line.
    Linear,
    /// Its displacement in a direction across the line.
    Straightness {
        /// Which direction.
        across: Axis,
    },
    /// Its tilt, right-handed, about a direction across the line.
    Angular {
        /// Which direction.
        about: Axis,
    },
}

impl LineOptics {
    /// The direction that must lie across the line.
    pub const fn side(self) -> Option<Axis> {
        match self {
            Self::Linear => None,
            Self::Straightness { across } => Some(across),
            Self::Angular { about } => Some(about),
        }
    }
}

/// A line that is asked for: from start to end in machine coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineTask {
    /// With what it is measured.
    pub optics: LineOptics,
    /// Where the machine stands while it is set up, and where readings are zero.
    pub start: Point,
    /// Where it ends.
    pub end: Point,
    /// The place of the moving optic with all axes at 0, from the machine's zero: as the tool's.
    pub tool: Point,
    /// Which line, from 1, of how many.
    pub step: (usize, usize),
}

/// How far from square to the line a direction across it may be (its cosine).
const SQUARE: f64 = 1e-6;

impl LineTask {
    /// The direction of the line, of length 1; `None` when it has none, or when what is measured
    /// across it is not across it.
    pub fn direction(&self) -> Option<[f64; 3]> {
        let along = direction(&[self.start, self.end])?;
        let side = self.optics.side();
        let is_across = |axis: Axis| along[axis.index()].abs() < SQUARE;
        side.is_none_or(is_across).then_some(along)
    }

    /// For the person.
    pub fn text(&self) -> String {
        let (number, of) = self.step;
        let what = match self.optics {
            LineOptics::Linear => "linear optics, reflector".to_owned(),
            LineOptics::Straightness { across } => {
                format!("straightness optics that see {across}, prism")
            }
            LineOptics::Angular { about } => {
                format!("angular optics that see tilts about {about}, reflector")
            }
        };
        format!(
            "line {number} of {of}: {what} on the tool side at offset {}; beam from {} (where the \
             machine stands now) to {}",
            millimetres(self.tool),
            millimetres(self.start),
            millimetres(self.end),
        )
    }
}

fn millimetres(point: Point) -> String {
    let [x, y, z] = [point.x, point.y, point.z].map(|it| it.mm());
    // A minus before a zero would puzzle a reader.
    let [x, y, z] = [x, y, z].map(|mm| if mm == 0.0 { 0.0 } else { mm });
    format!("({x:.3}, {y:.3}, {z:.3}) mm")
}

/// Who sets up lines. The machine keeps running while it waits: it asks once, and then repeatedly
/// whether it has been done. The axes are switched off meanwhile, which is not a safe stop.
pub trait LineOperator {
    /// Asks for a line.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure>;

    /// Whether it is set up.
    ///
    /// # Errors
    /// When it will not be any more.
    fn is_set_up(&mut self) -> Result<bool, Failure>;

    /// Tells that the interferometer is not needed any more.
    ///
    /// # Errors
    /// When nobody can be told.
    fn pack_up(&mut self) -> Result<(), Failure>;

    /// Tells what needs no answer, where somebody reads it.
    fn tell(&mut self, text: &str) {
        let _ = text;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(optics: LineOptics, end: Point) -> LineTask {
        LineTask {
            optics,
            start: Point::from_mm(0.0, 200.0, 150.0),
            end,
            tool: Point::from_mm(0.0, 0.0, -100.0),
            step: (3, 12),
        }
    }

    #[test]
    fn a_person_is_told_what_to_mount_where_and_where_the_beam_goes() {
        let end = Point::from_mm(500.0, 200.0, 150.0);
        let text = |optics| task(optics, end).text();
        let linear = text(LineOptics::Linear);
        assert_eq!(
            linear,
            "line 3 of 12: linear optics, reflector on the tool side at offset \
             (0.000, 0.000, -100.000) mm; beam from (0.000, 200.000, 150.000) mm (where the \
             machine stands now) to (500.000, 200.000, 150.000) mm"
        );
        let across = text(LineOptics::Straightness { across: Axis::Z });
        assert!(across.contains("straightness optics that see z, prism on"));
        let about = text(LineOptics::Angular { about: Axis::Y });
        assert!(about.contains("angular optics that see tilts about y, reflector on"));
    }

    #[test]
    fn a_line_has_a_direction_that_its_optics_look_across() {
        let along_x = Point::from_mm(500.0, 200.0, 150.0);
        let across = |across| LineOptics::Straightness { across };
        let direction = |optics, end| task(optics, end).direction();
        assert_eq!(direction(across(Axis::Z), along_x), Some([1.0, 0.0, 0.0]));
        assert_eq!(direction(across(Axis::X), along_x), None);
        let about = LineOptics::Angular { about: Axis::X };
        assert_eq!(direction(about, along_x), None);
        let face = Point::from_mm(300.0, 600.0, 150.0);
        let slanting = direction(LineOptics::Linear, face).expect("it has one");
        let expected = [0.6, 0.8, 0.0];
        assert!((0..3).all(|k| (slanting[k] - expected[k]).abs() < 1e-12));
        assert!(direction(across(Axis::Z), face).is_some());
        let nowhere = Point::from_mm(0.0, 200.0, 150.0);
        assert_eq!(direction(LineOptics::Linear, nowhere), None);
    }
}
