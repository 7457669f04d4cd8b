//! Whole cycles of whole machines.

mod linear;
