//! Tables of other controls: a calibration written so that another control compensates by it, and such a table taken
//! as a calibration of a linear axis.
//!
//! Sources: each format's file names its own. [decision 0045](../../../../docs/decisions/0045-tables-of-other-controls.md)
//! says which formats are not written, and why.

mod correction;
mod csv;
pub(crate) mod dcc;
pub(crate) mod export;
mod exported;
mod format;
pub(crate) mod import;
mod lines;
mod linuxcnc;
mod pmac;
mod sinumerik;
