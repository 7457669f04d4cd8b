//! Which axis stands on which: the kinematic chain from the workpiece to the tool.

use core::fmt;
use core::str::FromStr;

use units::Metres;

use crate::volumetric::{Axis, Point};

/// A chain of three linear axes, written like `XFYZ`.
///
/// Read from the workpiece to the tool: axes before `F` (the foundation) carry the workpiece,
/// the one next to `F` standing on it; axes after `F` carry the tool, again the one next to `F`
/// standing on the foundation. `FXYZ` is a gantry that does everything, `XFYZ` a bed that moves
/// under a column. The notation is that of H. Schwenke et al., "Geometric error measurement and
/// compensation of machines: an update", CIRP Annals 57 (2008).
///
/// # Example
///
/// ```
/// use compensator::volumetric::Axis;
/// use compensator::volumetric::model::Chain;
///
/// let table_below: Chain = "XFYZ".parse()?;
/// assert!(table_below.carries_workpiece(Axis::X));
/// assert_eq!(table_below.sense(Axis::X), -1.0, "the tool goes the other way");
/// assert!(table_below.is_on_lever(Axis::Y, Axis::Z), "z hangs on y");
/// assert!("XYZ".parse::<Chain>().is_err(), "no foundation");
/// # Ok::<(), compensator::volumetric::model::ChainError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chain {
    /// From the workpiece to the tool.
    axes: [Axis; 3],
    /// How many of them carry the workpiece.
    workpiece: usize,
}

/// A text that is no chain.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "kinematic chain `{seen}`: each of X, Y, Z and F is needed once, from the workpiece to the \
     tool, F being the foundation: `FXYZ`, `XFYZ`"
)]
pub struct ChainError {
    /// The text.
    pub seen: String,
}

impl FromStr for Chain {
    type Err = ChainError;

    fn from_str(text: &str) -> Result<Self, ChainError> {
        let wrong = || ChainError {
            seen: text.to_owned(),
        };
        let workpiece = text.find('F').ok_or_else(wrong)?;
        let letters: Vec<char> = text.chars().filter(|it| *it != 'F').collect();
        let axis = |letter: &char| match letter {
            'X' => Some(Axis::X),
            'Y' => Some(Axis::Y),
            'Z' => Some(Axis::Z),
            _ => None,
        };
        let axes: Option<Vec<Axis>> = letters.iter().map(axis).collect();
        let axes: [Axis; 3] = axes.and_then(|it| it.try_into().ok()).ok_or_else(wrong)?;
        let each_once = Axis::ALL.iter().all(|it| axes.contains(it));
        if text.len() == 4 && each_once {
            Ok(Self { axes, workpiece })
        } else {
            Err(wrong())
        }
    }
}

impl fmt::Display for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, axis) in self.axes.iter().enumerate() {
            if at == self.workpiece {
                f.write_str("F")?;
            }
            f.write_str(match axis {
                Axis::X => "X",
                Axis::Y => "Y",
                Axis::Z => "Z",
            })?;
        }
        if self.workpiece == 3 {
            f.write_str("F")?;
        }
        Ok(())
    }
}

impl Chain {
    /// All that there are.
    pub fn all() -> impl Iterator<Item = Self> {
        let orders = Axis::ALL.into_iter().flat_map(|first| {
            let [second, third] = first.others();
            [[first, second, third], [first, third, second]]
        });
        orders.flat_map(|axes| (0..=3).map(move |workpiece| Self { axes, workpiece }))
    }

    /// The axes from the workpiece to the tool.
    pub fn axes(&self) -> [Axis; 3] {
        self.axes
    }

    /// Whether `axis` carries the workpiece.
    pub fn carries_workpiece(&self, axis: Axis) -> bool {
        self.place(axis) < self.workpiece
    }

    /// Which way the tool goes, seen from the workpiece, when the slide of `axis` strays or turns
    /// by one: the other way (−1) where the slide carries the workpiece, else with it (1).
    pub fn sense(&self, axis: Axis) -> f64 {
        if self.carries_workpiece(axis) {
            -1.0
        } else {
            1.0
        }
    }

    /// Whether a tilt of `axis` acts on the position of `other` as on a lever: when `other` is
    /// nearer to the tool. A slide that carries the workpiece also moves under the tool itself.
    pub fn is_on_lever(&self, axis: Axis, other: Axis) -> bool {
        let (own, its) = (self.place(axis), self.place(other));
        its > own || (its == own && self.carries_workpiece(axis))
    }

    /// Where the point that is `tool` from the tool's zero stands in the frame of the slide of
    /// `axis`, at the command `at`: what a tilt of the slide acts on.
    pub fn lever(&self, axis: Axis, at: Point, tool: Point) -> Point {
        let carried = |other: Axis| {
            if self.is_on_lever(axis, other) {
                at.along(other)
            } else {
                Metres::ZERO
            }
        };
        tool + Point::new(carried(Axis::X), carried(Axis::Y), carried(Axis::Z))
    }

    fn place(&self, axis: Axis) -> usize {
        let place = self.axes.iter().position(|it| *it == axis);
        place.expect("a chain has every axis")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_are_read_and_written_alike_and_others_are_refused() {
        for text in ["FXYZ", "XFYZ", "YXFZ", "ZYXF", "XFZY"] {
            let chain: Chain = text.parse().unwrap();
            assert_eq!(chain.to_string(), text);
        }
        for text in ["XYZ", "FXYX", "FXYZF", "xfyz", "FXY", "FXÿZ", "", "FFXYZ"] {
            assert!(text.parse::<Chain>().is_err(), "{text}");
        }
    }

    #[test]
    fn there_are_24_chains() {
        let mut all: Vec<String> = Chain::all().map(|it| it.to_string()).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 24);
    }

    #[test]
    fn levers_are_what_stands_nearer_to_the_tool() {
        let chain: Chain = "XFYZ".parse().unwrap();
        assert!(chain.carries_workpiece(Axis::X) && !chain.carries_workpiece(Axis::Y));
        assert!(chain.is_on_lever(Axis::X, Axis::X));
        assert!(chain.is_on_lever(Axis::X, Axis::Z));
        assert!(!chain.is_on_lever(Axis::Y, Axis::Y));
        assert!(chain.is_on_lever(Axis::Y, Axis::Z));
        assert!(!chain.is_on_lever(Axis::Z, Axis::Y));
        let (at, tool) = (
            Point::from_mm(1.0, 2.0, 4.0),
            Point::from_mm(8.0, 16.0, 32.0),
        );
        let levers = Axis::ALL.map(|it| chain.lever(it, at, tool));
        assert_eq!(levers[0], Point::from_mm(9.0, 18.0, 36.0));
        assert_eq!(levers[1], Point::from_mm(8.0, 16.0, 36.0));
        assert_eq!(levers[2], tool);
    }
}
