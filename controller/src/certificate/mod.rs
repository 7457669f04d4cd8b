//! Certificates of what measures: a laser, its sensors, a scale, a thermometer. They are read with the configuration
//! that names them; what they certify corrects readings, and is how uncertain these are then.
//!
//! Source: Physikalisch-Technische Bundesanstalt, DCC schema 3 (`https://ptb.de/dcc`), D-SI 2 (`https://ptb.de/si`), and the
//! basic refTypes of good practice; VIM 2.16, 2.53: error = measured - reference, correction = -error.
//!
//! | file | what |
//! |---|---|
//! | `config` | the keys of a certificate in a machine's file |
//! | `xml` | a tree of elements, within limits |
//! | `unit`, `values` | D-SI: units, numbers and their uncertainties |
//! | `dcc` | who certifies what, when, and for how long |
//! | `result` | which result is meant, as a value or a table of corrections |
//! | `measurand` | what can be certified, and what of that can be |
//! | `table` | corrections by readings |
//! | `standing` | whether it holds on a day |
//! | `record` | what of it is kept with what was measured, and shown |
//! | `read` | the certificates of a machine, read and judged |
//!
//! Absent: signatures are not checked (nobody's key is known here); covariances between results.

mod config;
mod dcc;
mod measurand;
mod read;
mod record;
mod result;
mod standing;
mod table;
mod unit;
mod values;
mod xml;

pub(crate) use config::CertificateConfig;
pub(crate) use measurand::Measurand;
pub(crate) use read::{Named, read, today};
#[cfg(feature = "program")]
pub(crate) use record::shown;
pub(crate) use standing::Standing;
#[cfg(test)]
pub(crate) use table::Point;
pub(crate) use table::{Certified, Figures};

/// Why a certificate cannot be used, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Unfit {
    pub(crate) cause: String,
    pub(crate) help: String,
}

fn unfit<T>(cause: impl Into<String>, help: impl Into<String>) -> Result<T, Unfit> {
    Err(Unfit {
        cause: cause.into(),
        help: help.into(),
    })
}
