//! Moves of a group's axes as one, for whoever keeps a machine.

use core::fmt;

use machine::records::Store;
use units::{AxisSpeed, Metres, Radians};

use super::teller::{Teller, Told};
use crate::agreed::Agreed;
use crate::connected::Machine;
use crate::failure::Failure;

/// A place: along a way, or round a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Along a way.
    Length(Metres),
    /// Round a turn.
    Angle(Radians),
}

/// A part of where a group is: one of its axes, or a coordinate of the body that they move.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is called in a target.
    pub name: String,
    /// Whether it is an angle.
    pub turns: bool,
}

impl Part {
    /// A length.
    pub(crate) fn of_length(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            turns: false,
        }
    }
}

/// A move of a group that is asked for. Parts that are not named stay where they are.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupMove {
    /// Where to, part by part.
    pub targets: Vec<(String, Place)>,
    /// What whoever asks agrees to.
    pub agreed: Agreed,
    /// The greatest speed, along the way or of the turn; each axis goes no faster than it usually does either.
    pub speed: Option<AxisSpeed>,
    /// Go on moving until what sees the body sees it there.
    pub align: bool,
    /// Runs on towards its only target at this speed, which says with its sign which way, until somebody stops it: a
    /// jog, by the encoders alone.
    pub jog: Option<AxisSpeed>,
}

impl GroupMove {
    /// Where the part `name` is to go, where that is said.
    pub(crate) fn target(&self, name: &str) -> Option<Place> {
        let mut targets = self.targets.iter();
        targets.find(|it| it.0 == name).map(|it| it.1)
    }

    /// Likewise of a part that is a length.
    pub(crate) fn length(&self, name: &str) -> Option<Metres> {
        match self.target(name) {
            Some(Place::Length(it)) => Some(it),
            Some(Place::Angle(_)) | None => None,
        }
    }

    /// Likewise of a part that is an angle.
    pub(crate) fn angle(&self, name: &str) -> Option<Radians> {
        match self.target(name) {
            Some(Place::Angle(it)) => Some(it),
            Some(Place::Length(_)) | None => None,
        }
    }
}

/// Where a part of a group is after a move that was made to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct PartMoved {
    /// Its name.
    pub name: String,
    /// Where it was told to be.
    pub target: Place,
    /// What its drive was sent, where it has one.
    pub set_point: Option<Place>,
    /// Where it is, by everything that is known.
    pub position: Option<Place>,
    /// How uncertain that is; `None` where nobody knows it.
    pub standard_uncertainty: Option<Place>,
}

/// A move of a group that was made to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupMoved {
    /// Each part.
    pub parts: Vec<PartMoved>,
    /// The same, as the command line prints it.
    pub told: Option<Told>,
}

/// A move of a group that was not made to its end.
#[derive(Debug)]
pub(crate) enum NotMoved {
    /// Nothing was sent to an axis: all of them are as they were, and supervised.
    Before(Failure),
    /// Its axes may have been sent something, or one of them failed.
    UnderWay(Failure),
}

/// Whatever does not say that nothing was sent.
impl From<Failure> for NotMoved {
    fn from(failure: Failure) -> Self {
        Self::UnderWay(failure)
    }
}

/// What a kind can tell of its moves without asking a device.
pub(crate) trait Judging {
    fn judge(&self, machine: &machine::Machine, asked: &GroupMove) -> Result<(), Failure>;

    /// Where a jog of `part` ends by itself; `None` where none is offered.
    fn end_of_jog(
        &self,
        _machine: &machine::Machine,
        _part: &str,
        _speed: AxisSpeed,
    ) -> Result<Option<Place>, Failure> {
        Ok(None)
    }

    /// Where the encoders have each part that is not an axis by itself.
    fn standing(&self, _machine: &machine::Machine) -> Result<Vec<(String, Place)>, Failure> {
        Ok(Vec::new())
    }
}

impl<F: Fn(&machine::Machine, &GroupMove) -> Result<(), Failure>> Judging for F {
    fn judge(&self, machine: &machine::Machine, asked: &GroupMove) -> Result<(), Failure> {
        self(machine, asked)
    }
}

/// Says of a move of a group whether it can be made, as far as that can be told without asking a device.
pub struct Judge(Box<dyn Judging>);

impl Judge {
    pub(crate) fn new(
        judging: impl Fn(&machine::Machine, &GroupMove) -> Result<(), Failure> + 'static,
    ) -> Self {
        Self::by(judging)
    }

    pub(crate) fn by(judging: impl Judging + 'static) -> Self {
        Self(Box::new(judging))
    }

    /// Whether `asked` can be made.
    ///
    /// # Errors
    /// Why not.
    pub fn judge(&self, machine: &machine::Machine, asked: &GroupMove) -> Result<(), Failure> {
        self.0.judge(machine, asked)
    }

    /// Where a jog of `part` at `speed` ends when nobody stops it; `None` where the group is not jogged as one.
    ///
    /// # Errors
    /// When there is no such part, or it does not move in what `speed` says.
    pub fn end_of_jog(
        &self,
        machine: &machine::Machine,
        part: &str,
        speed: AxisSpeed,
    ) -> Result<Option<Place>, Failure> {
        self.0.end_of_jog(machine, part, speed)
    }

    /// Where the encoders have each part that is not an axis by itself.
    ///
    /// # Errors
    /// When they are nowhere.
    pub fn standing(&self, machine: &machine::Machine) -> Result<Vec<(String, Place)>, Failure> {
        self.0.standing(machine)
    }
}

impl fmt::Debug for Judge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Judge")
    }
}

/// How a kind moves a group as one.
#[derive(Debug)]
pub(crate) struct GroupMoves {
    /// Judges moves by what is stored now.
    pub(crate) judge: fn(&mut Machine, &Store) -> Result<Judge, Failure>,
    /// Makes one, by the procedure that the verb uses.
    pub(crate) perform:
        fn(&mut Machine, &Store, &GroupMove, Option<&Teller>) -> Result<GroupMoved, NotMoved>,
}
