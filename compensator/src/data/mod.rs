//! Data files: one reader of CSV tables below all of them.
//!
//! Whoever holds a series knows that every number is finite and every point in its place; nothing is
//! guessed or repaired. Each kind's file is read beside its mathematics:
//! [`LinearSeries`](crate::error_table::LinearSeries), [`HallSeries`](crate::hall_zero::HallSeries),
//! [`StrokeSeries`](crate::screw::StrokeSeries), [`RotarySeries`](crate::rotary::RotarySeries),
//! [`VolumeSeries`](crate::volumetric::VolumeSeries), [`StateSeries`](crate::volumetric::StateSeries) and
//! [`ReferenceSeries`](crate::volumetric::ReferenceSeries).
//!
//! Source: the data file formats of the project's design.
//!
//! Absent: files (text comes in, text goes out), unit conversion of foreign formats.

mod fault;
mod table;

pub use fault::{DataError, Fault};
pub(crate) use table::{Format, Table};
