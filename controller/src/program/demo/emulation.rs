//! The emulated machine that a demonstration shows: behind real terminals, or in this process.

use drivers::transport::Transport;
use machine::Patience;

use crate::config::MachineConfig;
use crate::emulated::{Emulated, EmulatedError, EmulatedOnPtys, HallDrift};
use crate::{Failure, ports};

/// One seed gives one log, whichever it is.
pub(crate) enum Emulation {
    OnPtys(Box<EmulatedOnPtys>),
    InProcess(Emulated),
}

impl Emulation {
    /// The controller's end of every bus and line, and how patient it must be with the machine.
    ///
    /// # Errors
    /// When the machine lacks a port, or one cannot be opened.
    pub(crate) fn connect(
        &self,
        config: &MachineConfig,
    ) -> Result<(Box<dyn Transport>, Patience), Failure> {
        match self {
            Self::InProcess(emulated) => Ok((Box::new(emulated.transport()), Patience::NONE)),
            Self::OnPtys(emulated) => {
                let pace = emulated.pace("truestage demo")?;
                let patience = pace.patience();
                let overrides = emulated.overrides(config)?;
                let transport = ports::open(config, &overrides, ports::Use::Measurement, pace)?;
                Ok((Box::new(transport), patience))
            }
        }
    }

    /// A line for each port.
    pub(crate) fn description(&self) -> Vec<String> {
        match self {
            Self::OnPtys(emulated) => emulated.description(),
            Self::InProcess(_) => vec!["in this process, without ports".to_owned()],
        }
    }

    /// As [`EmulatedOnPtys::power_cycle`].
    pub(crate) fn power_cycle(&self, drift: HallDrift) -> Result<(), EmulatedError> {
        match self {
            Self::OnPtys(emulated) => emulated.power_cycle(drift),
            Self::InProcess(emulated) => {
                emulated.power_cycle(drift);
                Ok(())
            }
        }
    }

    /// As [`EmulatedOnPtys::turn_plate`].
    pub(crate) fn turn_plate(&self, lines: f64) -> Result<(), EmulatedError> {
        match self {
            Self::OnPtys(emulated) => emulated.turn_plate(lines),
            Self::InProcess(emulated) => {
                emulated.turn_plate(lines);
                Ok(())
            }
        }
    }
}
