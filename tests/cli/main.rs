//! The commands as a user runs them: `mock-bus` in one process, `truestage` in others.

mod align;
mod alone;
mod calibrations;
mod demo;
mod example;
mod examples;
mod gantry;
mod intended;
mod interrupted;
mod job;
mod jog;
mod killed;
mod manager;
mod monitor;
mod network;
mod platform;
mod programs;
mod rotary;
mod screw;
mod serve;
mod soak;
mod table;
mod verbs;
mod volumetric;
mod volumetric_live;
mod zero_plan;
