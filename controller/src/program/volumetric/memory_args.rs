//! What is said to do with the state memories of three axes.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use crate::program::MachineArgs;

/// What is done with the state memories of three axes.
#[derive(Debug, Subcommand)]
pub(crate) enum MemoryCommand {
    /// Zero, then record the present state at stops along each axis, before parts are made: from now
    /// on all parts are made with it. Nothing is corrected while it is recorded, so it is not the state
    /// in which an earlier part was made; `run --first-part` records that.
    Record(MemoryArgs),
    /// Keep a designed shape, from a file, as the state in which the machine was built (first). Nothing
    /// moves, and the machine may be off.
    Import(ImportArgs),
    /// Forget a recorded state; parts are no longer made with it. Nothing moves.
    Clear(MemoryArgs),
}

/// A designed shape, and of which machine.
#[derive(Clone, Debug, Args)]
pub(crate) struct ImportArgs {
    /// The machine's configuration.
    pub(crate) config: PathBuf,
    /// Columns axis,along,position_mm,displacement_um: by how much the slide of an axis is to be displaced
    /// along a direction across it, counted from the references of the detectors in use. With rolls the columns are
    /// axis,along,position_mm,value,unit: unit is um, or arcsec where along is roll.
    pub(crate) file: PathBuf,
    /// Only the first: the second is the state of a part.
    #[arg(long, value_enum, default_value_t = MemoryChoice::First)]
    pub(crate) memory: MemoryChoice,
}

/// Which memory, of which machine.
#[derive(Clone, Debug, Args)]
pub(crate) struct MemoryArgs {
    #[command(flatten)]
    pub(crate) machine: MachineArgs,
    /// The state in which the machine was built (first), or the state beyond it in which all parts
    /// are to be made (second).
    #[arg(long, value_enum, default_value_t = MemoryChoice::Second)]
    pub(crate) memory: MemoryChoice,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MemoryChoice {
    First,
    Second,
}

impl From<MemoryChoice> for crate::volumetric::MemoryName {
    fn from(choice: MemoryChoice) -> Self {
        match choice {
            MemoryChoice::First => Self::First,
            MemoryChoice::Second => Self::Second,
        }
    }
}
