//! Whole cycles of whole machines, on every bus and in virtual time.

mod linear;
mod virtual_time;
