//! How references were given that nobody read.

use serde::{Deserialize, Serialize};

/// How references were given beforehand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GivenName {
    /// A value at each of several positions.
    Table,
    /// Polynomials of the position.
    Functions,
}

impl GivenName {
    /// As it is said to an operator.
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Table => "a table",
            Self::Functions => "functions",
        }
    }
}
