//! The commands as a user runs them: `mock-bus` in one process, `truestage` in others.

mod interrupted;
mod programs;
mod screw;
mod verbs;
