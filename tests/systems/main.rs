//! Whole cycles of whole machines, on every bus and in virtual time.

mod engine;
mod linear;
mod one_log;
mod platform;
mod rotary;
mod virtual_time;
