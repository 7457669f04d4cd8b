//! Why a configuration does not describe a machine.

use std::path::PathBuf;

/// Why a configuration does not describe a machine.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file is not TOML of this form.
    #[error("{0}")]
    Syntax(#[from] toml::de::Error),
    /// Two ports or two nodes have the same name.
    #[error("the name \"{name}\" is given twice")]
    NameTwice {
        /// Which name.
        name: String,
    },
    /// A port is named that is not there.
    #[error("{user} is on port \"{port}\", which is not among the ports")]
    NoPort {
        /// Who names it.
        user: String,
        /// What it names.
        port: String,
    },
    /// A node is named that is not there.
    #[error("a fault names node \"{node}\", which is not among the nodes")]
    NoNode {
        /// What it names.
        node: String,
    },
    /// A CAN device on a serial line, or the reverse.
    #[error("{user} does not fit port \"{port}\": one is CAN, the other serial")]
    WrongKind {
        /// Which node or fault.
        user: String,
        /// Which port.
        port: String,
    },
    /// A number that cannot be.
    #[error("{key} = {seen}; expected {expected}")]
    Value {
        /// Which key.
        key: &'static str,
        /// What it was.
        seen: f64,
        /// What it may be.
        expected: &'static str,
    },
}

/// Refuses what is not more than 0.
pub(crate) fn positive(key: &'static str, seen: f64) -> Result<(), ConfigError> {
    if seen.is_finite() && seen > 0.0 {
        return Ok(());
    }
    Err(ConfigError::Value {
        key,
        seen,
        expected: "a positive number",
    })
}
