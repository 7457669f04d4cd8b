//! Whole cycles of whole machines, in virtual time.

mod linear;
mod linear_zero;
