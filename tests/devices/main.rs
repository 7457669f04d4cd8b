//! Each device's driver against its emulation, the same on every bus.

mod amplifiers;
mod analog;
mod camera;
mod drive;
mod interferometer;
mod rotary;
mod screw;
