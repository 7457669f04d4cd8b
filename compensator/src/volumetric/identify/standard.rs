//! Which lines to measure along so that nothing of the machine stays unseen.
//!
//! Source: ISO 230-1 and 230-6 for what linear, straightness and angular optics and diagonals tell;
//! which of them are needed together follows from the model. Along every axis its positioning, two
//! straightnesses and two tilts are read as they are. Its roll is read where there is a detector or
//! level for it, and otherwise told by how a straightness differs on a second line at the end of a
//! lever. Both lines are aligned by hand, which hides what of the roll grows evenly: that, and the
//! squarenesses, are left for diagonals, which need no direction other than their own.
//!
//! | name here | optics |
//! |---|---|
//! | [`Optics::Linear`] | linear interferometer and retroreflector, along the line |
//! | [`Optics::Straightness`] | straightness prism and mirror, or a straight edge |
//! | [`Optics::Angle`] | angular optics or autocollimator; level or roll detectors about the axis |
//!
//! Absent: lines that save time where less than everything is needed, and both approaches.

use core::fmt;

use units::{Metres, Radians};

use super::diagonals::{body_diagonals, direction, face_diagonals};
use super::{Alignment, FunctionPlan, Plan, Reading, RunSetup, SquarenessName, ThermalPlan};
use crate::volumetric::function::Shape;
use crate::volumetric::model::{Chain, ErrorName};
use crate::volumetric::{Axis, Point, Volume};

/// What is set up on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optics {
    /// Reads displacements along the line.
    Linear,
    /// Reads displacements along a direction across the line.
    Straightness(Axis),
    /// Reads rotations about a direction.
    Angle(Axis),
}

/// What a line is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The positioning error of an axis; repeated warm, the expansion of its scale.
    Positioning(Axis),
    /// A straightness: of an axis, along a direction.
    Straightness(Axis, Axis),
    /// A tilt: of an axis, about a direction across it; repeated warm, how its guide bends.
    Tilt(Axis, Axis),
    /// The roll of an axis, by a detector or level.
    Roll(Axis),
    /// The roll of an axis, by how its straightness differs on a lever.
    RollOnLever(Axis),
    /// The roll of an axis as far as it grows evenly, by the diagonals of a face on a lever.
    EvenRollOnLever(Axis),
    /// The squarenesses, and rolls as far as they grow evenly.
    Squarenesses,
}

impl fmt::Display for Purpose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positioning(axis) => {
                write!(f, "positioning of {axis}; warm: expansion of its scale")
            }
            Self::Straightness(axis, along) => write!(f, "straightness of {axis} along {along}"),
            Self::Tilt(axis, about) => {
                write!(
                    f,
                    "tilt of {axis} about {about}; warm: bending of its guide"
                )
            }
            Self::Roll(axis) => write!(f, "roll of {axis}, read directly"),
            Self::RollOnLever(axis) => {
                write!(
                    f,
                    "roll of {axis}, by its straightness at the end of a lever"
                )
            }
            Self::EvenRollOnLever(axis) => {
                write!(f, "roll of {axis} as far as it grows evenly along the axis")
            }
            Self::Squarenesses => {
                f.write_str("squarenesses, and rolls as far as they grow evenly along their axes")
            }
        }
    }
}

/// One set-up of an instrument: a line from one place to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardLine {
    /// Where it begins.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
    /// The offset of the point that is measured.
    pub tool: Point,
    /// What is set up.
    pub optics: Optics,
    /// What for.
    pub purpose: Purpose,
}

impl StandardLine {
    /// `count` places at even distances along it, at least 2.
    pub fn points(&self, count: usize) -> Vec<Point> {
        let last = count.max(2) - 1;
        let way = (self.to - self.from).array();
        let at = |n: usize| {
            let share = n as f64 / last as f64;
            self.from + Point::of(way.map(|it| it * share))
        };
        (0..=last).map(at).collect()
    }

    /// Whether it is measured again when the machine is warm, for thermal coefficients.
    pub fn is_for_warmth(&self) -> bool {
        matches!(self.purpose, Purpose::Positioning(_) | Purpose::Tilt(..))
    }

    /// What was read on it: metres or radians by its optics, with their standard uncertainty.
    pub fn reading(&self, deviation: f64, u: f64) -> Reading {
        let length = |along: [f64; 3]| Reading::Length {
            along,
            deviation: Metres(deviation),
            u: Metres(u),
        };
        match self.optics {
            Optics::Linear => length(direction(&[self.from, self.to]).unwrap_or([0.0; 3])),
            Optics::Straightness(along) => length(core::array::from_fn(|k| {
                f64::from(u8::from(k == along.index()))
            })),
            Optics::Angle(about) => Reading::Angle {
                about,
                deviation: Radians(deviation),
                u: Radians(u),
            },
        }
    }
}

/// Lines that together see a machine, and what they do not see of it.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardDesign {
    /// The lines, in an order in which each set-up follows from the one before.
    pub lines: Vec<StandardLine>,
    /// Errors that move nothing with the tools given, and that no line sees.
    pub without_effect: Vec<ErrorName>,
    chain: Chain,
    volume: Volume,
}

/// The lines to measure a machine along, for tools like `tools`: the first is where the reflector
/// is put wherever nothing else is said, at least one is needed. `roll_is_read`: by axis, whether
/// its roll is read by a detector or level.
pub fn standard_design(
    chain: Chain,
    volume: &Volume,
    tools: &[Point],
    roll_is_read: [bool; 3],
) -> StandardDesign {
    let tool = tools.first().copied().unwrap_or(Point::ZERO);
    let mut design = StandardDesign {
        lines: Vec::new(),
        without_effect: Vec::new(),
        chain,
        volume: *volume,
    };
    for axis in Axis::ALL {
        design.add(
            axis,
            Point::ZERO,
            tool,
            Optics::Linear,
            Purpose::Positioning(axis),
        );
    }
    for axis in Axis::ALL {
        for along in axis.others() {
            let (optics, purpose) = (
                Optics::Straightness(along),
                Purpose::Straightness(axis, along),
            );
            design.add(axis, Point::ZERO, tool, optics, purpose);
        }
    }
    for axis in Axis::ALL {
        for about in axis.others() {
            let (optics, purpose) = (Optics::Angle(about), Purpose::Tilt(axis, about));
            design.add(axis, Point::ZERO, tool, optics, purpose);
        }
        if roll_is_read[axis.index()] {
            let (optics, purpose) = (Optics::Angle(axis), Purpose::Roll(axis));
            design.add(axis, Point::ZERO, tool, optics, purpose);
        }
    }
    design.add_diagonals(&body_diagonals(volume, 2), tool, Purpose::Squarenesses);
    for axis in Axis::ALL {
        if !roll_is_read[axis.index()] {
            design.add_roll(axis, tools, tool);
        }
    }
    design
}

impl StandardDesign {
    /// What is to be found by it: nodes at even distances, `nodes` by axis, drawn by `shape`
    /// between them; run n is line n.
    pub fn plan(&self, nodes: [usize; 3], zero: Point, shape: Shape) -> Plan {
        let functions = self.names().map(|name| {
            let (ErrorName::Along(axis, _) | ErrorName::About(axis, _)) = name;
            let (low, high) = (
                self.volume.low().along(axis),
                self.volume.high().along(axis),
            );
            let last = nodes[axis.index()].max(2) - 1;
            // Rounding must not leave the volume's end uncovered.
            let node = |n: usize| match n {
                n if n == last => high,
                n => low + (high - low) * (n as f64 / last as f64),
            };
            FunctionPlan {
                name,
                nodes: (0..=last).map(node).collect(),
            }
        });
        let setup = |(angle, line): (usize, &StandardLine)| RunSetup {
            offset: true,
            alignment: matches!(line.optics, Optics::Straightness(_))
                .then_some(Alignment { angle, factor: 1.0 }),
        };
        Plan {
            chain: self.chain,
            functions: functions.collect(),
            shape,
            squarenesses: SquarenessName::ALL.to_vec(),
            runs: self.lines.iter().enumerate().map(setup).collect(),
            zero,
            thermal: ThermalPlan::default(),
        }
    }

    /// The error functions it sees.
    pub fn names(&self) -> impl Iterator<Item = ErrorName> {
        let pairs = Axis::ALL
            .into_iter()
            .flat_map(|axis| Axis::ALL.map(|it| (axis, it)));
        let names =
            pairs.flat_map(|(axis, it)| [ErrorName::Along(axis, it), ErrorName::About(axis, it)]);
        names.filter(|it| !self.without_effect.contains(it))
    }

    /// A line along an axis at the low ends of the others, moved by `shift`.
    fn add(&mut self, axis: Axis, shift: Point, tool: Point, optics: Optics, purpose: Purpose) {
        let (low, high) = (self.volume.low(), self.volume.high());
        let mut end = low.array();
        end[axis.index()] = high.along(axis).value();
        self.lines.push(StandardLine {
            from: low + shift,
            to: Point::of(end) + shift,
            tool,
            optics,
            purpose,
        });
    }

    fn add_diagonals(&mut self, diagonals: &[Vec<Point>], tool: Point, purpose: Purpose) {
        for it in diagonals {
            self.lines.push(StandardLine {
                from: it[0],
                to: it[it.len() - 1],
                tool,
                optics: Optics::Linear,
                purpose,
            });
        }
    }

    /// A roll that nothing reads, on a lever of the machine's own or of another tool.
    fn add_roll(&mut self, axis: Axis, tools: &[Point], tool: Point) {
        let others = axis.others();
        let across = |it: &Point| others.map(|k| (*it - tool).along(k).abs());
        let own = others
            .into_iter()
            .find(|it| self.chain.is_on_lever(axis, *it));
        let longest = tools.iter().max_by(|a, b| {
            let length = |it: &Point| {
                across(it)
                    .map(Metres::value)
                    .into_iter()
                    .fold(0.0, f64::max)
            };
            length(a).total_cmp(&length(b))
        });
        let lever_of_tool = longest.filter(|it| across(it) != [Metres::ZERO; 2]);
        let (lever, shift, tool) = match (own, lever_of_tool) {
            (Some(lever), _) => {
                let mut shift = [0.0; 3];
                let span = self.volume.high() - self.volume.low();
                shift[lever.index()] = span.along(lever).value();
                (lever, Point::of(shift), tool)
            }
            (None, Some(longest)) => {
                let [first, second] = across(longest);
                let lever = if first >= second {
                    others[0]
                } else {
                    others[1]
                };
                (lever, Point::ZERO, *longest)
            }
            (None, None) => {
                self.without_effect.push(ErrorName::About(axis, axis));
                return;
            }
        };
        let sideways = if others[0] == lever {
            others[1]
        } else {
            others[0]
        };
        let optics = Optics::Straightness(sideways);
        self.add(axis, shift, tool, optics, Purpose::RollOnLever(axis));
        let levers = others.map(|it| self.chain.is_on_lever(axis, it));
        if levers != [true, false] && levers != [false, true] {
            // With one lever of the machine's own the body diagonals tell the rest.
            let face = face_diagonals(&self.volume, lever, 2);
            let face = face.map(|it| it.into_iter().map(|at| at + shift).collect());
            self.add_diagonals(&face, tool, Purpose::EvenRollOnLever(axis));
        }
    }
}
