//! Why an emulated machine cannot be brought up.

use mock_bus::config::ConfigError;
use mock_bus::runner::RunError;

/// Why an emulated machine cannot be brought up.
#[derive(Debug, thiserror::Error)]
pub enum EmulatedError {
    /// Its description is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// It has no port of a name that the machine's configuration uses.
    #[error("the emulated machine has no bus or line `{name}`; it has {known}")]
    NoPort {
        /// What the configuration names.
        name: String,
        /// What there is.
        known: String,
    },
    /// Pseudo-terminals or threads cannot be had, or the machine's thread has ended.
    #[error(transparent)]
    Run(#[from] RunError),
}

impl EmulatedError {
    /// As [`crate::Failure::exit_code`].
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Config(_) | Self::NoPort { .. } => 2,
            Self::Run(_) => 4,
        }
    }
}
