//! What an image controller is asked, and how its silence or refusal is told.

use wire::in_sight::{ACQUIRE, Cell, Command};

/// What is being asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// `GF`: the fence.
    Job,
    /// `GI`, and `GF` behind it: where the information ends.
    Info,
    /// `SO1`.
    Online,
    /// `GV` before the first picture: how many there have been.
    Count,
    /// `SW8`.
    Picture,
    /// `GV` after a picture.
    Result,
}

impl Question {
    pub(super) const fn awaited(self) -> &'static str {
        match self {
            Self::Job => "the answer to GF (active job)",
            Self::Info => "the answer to GI (system information)",
            Self::Online => "the answer to SO1 (go online)",
            Self::Count => "the answer to GV (count of pictures)",
            Self::Picture => "the answer to SW8 (take a picture)",
            Self::Result => "the answer to GV (result of the picture)",
        }
    }

    /// What is refused when this is.
    pub(super) const fn step(self) -> &'static str {
        match self {
            Self::Job => "naming its active job",
            Self::Info => "naming itself",
            Self::Online => "going online",
            Self::Picture => "taking a picture",
            Self::Count | Self::Result => "showing the result cell",
        }
    }

    /// The command that asks it; `cell` is the one that holds the result.
    pub(super) const fn command(self, cell: Cell) -> Command {
        match self {
            Self::Job => Command::GetFile,
            Self::Info => Command::GetInfo,
            Self::Online => Command::SetOnline(true),
            Self::Picture => Command::SetEventAndWait(ACQUIRE),
            Self::Count | Self::Result => Command::GetValue(cell),
        }
    }
}
