//! What a move is asked for with.

use clap::{Args, ValueEnum};

use crate::program::{AskArgs, MachineArgs};
use crate::{Agreed, Failure};

/// Which way round a rotary axis goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum WayName {
    /// Less than half a turn.
    Shortest,
    /// With growing angles, less than a turn.
    Forward,
    /// With falling angles, less than a turn.
    Reverse,
    /// As many turns as the angle says, from the zero.
    Turns,
}

/// From which side a linear axis arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ApproachName {
    /// With growing positions.
    Forward,
    /// With falling positions.
    Reverse,
}

impl From<ApproachName> for units::Approach {
    fn from(name: ApproachName) -> Self {
        match name {
            ApproachName::Forward => Self::Forward,
            ApproachName::Reverse => Self::Reverse,
        }
    }
}

/// A move that is asked for.
#[derive(Clone, Debug, Args)]
pub(crate) struct MoveArgs {
    #[command(flatten)]
    pub(crate) machine: MachineArgs,
    /// Where to: `x=12.5mm`, `x=-300um`; a platform also `theta=20arcsec`, a rotary axis `c=90deg`.
    #[arg(value_name = "AXIS=PLACE")]
    pub(crate) targets: Vec<String>,
    /// Keep moving a platform until the image agrees.
    #[arg(long)]
    pub(crate) align: bool,
    /// Which way round a rotary axis goes; the shortest when not given.
    #[arg(long, value_enum)]
    pub(crate) way: Option<WayName>,
    /// From which side a linear axis arrives; as its configuration has it when not given.
    #[arg(long, value_enum, value_name = "SIDE")]
    pub(crate) approach: Option<ApproachName>,
    #[command(flatten)]
    pub(crate) agreed: AgreedArgs,
    #[command(flatten)]
    pub(crate) ask: AskArgs,
}

/// What is agreed to in so many words: what nothing corrects does not move unasked.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct AgreedArgs {
    /// Go by the encoders alone: where nothing is calibrated, or without what is.
    #[arg(long)]
    pub(crate) uncompensated: bool,
    /// Go beyond the calibrated range of a linear axis, where its deviation was never measured.
    #[arg(long)]
    pub(crate) beyond: bool,
}

impl AgreedArgs {
    pub(crate) const fn agreed(self) -> Agreed {
        Agreed {
            uncompensated: self.uncompensated,
            beyond: self.beyond,
        }
    }
}

impl MoveArgs {
    /// `truestage move x=12.5mm` means `./machine.toml`, as with every verb.
    pub(crate) fn settle(mut self) -> Self {
        let first = self.machine.config.to_string_lossy();
        if first.contains('=') && !self.machine.config.exists() {
            self.targets.insert(0, first.into_owned());
            self.machine.config = "machine.toml".into();
        }
        self
    }

    /// The axes that it names.
    pub(crate) fn named(&self) -> impl Iterator<Item = &str> {
        let targets = self.targets.iter();
        targets.filter_map(|it| Some(it.split_once('=')?.0))
    }

    /// # Errors
    /// When it names an axis twice: which place is meant is not known.
    pub(crate) fn each_once(&self) -> Result<(), Failure> {
        let names: Vec<&str> = self.named().collect();
        let twice = (1..names.len()).find(|at| names[..*at].contains(&names[*at]));
        twice.map_or(Ok(()), |at| {
            Err(Failure::Usage {
                what: format!("`{}` is named twice", names[at]),
                help: "name each axis once".into(),
            })
        })
    }

    /// # Errors
    /// When it agrees to go beyond a calibration that has no end, or cannot be left.
    pub(crate) fn without_beyond(&self) -> Result<(), Failure> {
        only_for("--beyond", "linear axes", self.agreed.beyond)
    }

    /// # Errors
    /// When it says which way round what does not turn.
    pub(crate) fn without_way(&self) -> Result<(), Failure> {
        only_for("--way", "rotary axes", self.way.is_some())
    }

    /// # Errors
    /// When it says from which side what goes its own way arrives.
    pub(crate) fn without_approach(&self) -> Result<(), Failure> {
        only_for("--approach", "linear axes", self.approach.is_some())
    }

    /// # Errors
    /// When it shall align what no camera sees.
    pub(crate) fn without_align(&self) -> Result<(), Failure> {
        only_for("--align", "platforms, which a camera sees", self.align)
    }
}

/// Refuses `option`, when it `is_given`, for a machine of another kind.
pub(crate) fn only_for(option: &str, kind: &str, is_given: bool) -> Result<(), Failure> {
    match is_given {
        false => Ok(()),
        true => Err(Failure::Usage {
            what: format!("{option} is for {kind}"),
            help: "leave it out".into(),
        }),
    }
}
