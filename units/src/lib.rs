//! SI quantities, encoder counts and monotonic time.
//!
//! Every public signature of truestage speaks these types; micrometres, millimetres and
//! arc-seconds exist only where a person writes or reads them (configuration, data files,
//! screen). The package depends on no other of truestage's, so that everybody
//! may import it.
//!
//! # Example
//!
//! Quantities of different kinds do not mix, and units stand in the names of what makes and shows them.
//!
//! ```
//! use units::{Metres, MetresPerSecond, Time};
//!
//! let way = Metres::from_mm(12.5) - Metres::from_um(3.0);
//! assert_eq!(format!("{:.3}", way.mm()), "12.497");
//! let took = Time::from_seconds(2.0).since(Time::from_seconds(1.5));
//! let speed = MetresPerSecond(way.value() / took.as_secs_f64());
//! assert!(speed < MetresPerSecond(0.025));
//! ```

mod axis_speed;
mod coordinate;
mod counts;
pub mod portable;
mod quantity;
mod short;
pub mod text;
mod time;

pub use axis_speed::AxisSpeed;
pub use coordinate::{Coordinate, LengthOrAngle};
pub use counts::{Counts, Scale};
pub use quantity::{
    Celsius, Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared, Pascals,
    Quantity, Radians, RadiansPerSecond, RadiansPerSecondSquared, RelativeHumidity, Volts,
};
pub use short::{Several, Short, ShortSpan};
pub use time::Time;

/// The direction from which a target is reached.
///
/// ISO 230-2 writes it ↑ and ↓; data files write it `+` and `-`.
///
/// # Example
///
/// ```
/// use units::{Approach, Metres};
///
/// let approach = Approach::of_move(Metres(0.2), Metres(0.1));
/// assert_eq!(approach.map(Approach::symbol), Some('-'));
/// assert_eq!(Approach::of_move(Metres(0.1), Metres(0.1)), None, "no move at all");
/// assert_eq!(Approach::Reverse.sign(), -1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Approach {
    /// Coordinates increase on the way to the target (↑, `+`).
    Forward,
    /// Coordinates decrease on the way to the target (↓, `-`).
    Reverse,
}

impl Approach {
    /// The approach of a move from `start` to `end`, or `None` when they are equal.
    pub fn of_move<Q: Coordinate>(start: Q, end: Q) -> Option<Self> {
        if end > start {
            Some(Self::Forward)
        } else if end < start {
            Some(Self::Reverse)
        } else {
            None
        }
    }

    /// The other one.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Forward => Self::Reverse,
            Self::Reverse => Self::Forward,
        }
    }

    /// `+1.0` for forward, `-1.0` for reverse.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Reverse => -1.0,
        }
    }

    /// The character data files use: `+` or `-`.
    pub const fn symbol(self) -> char {
        match self {
            Self::Forward => '+',
            Self::Reverse => '-',
        }
    }
}
