//! The rig: one emulated machine on the bus that `RIG` names, for tests that run the same on
//! every bus.
//!
//! `RIG` unset: in this process (virtual time) and on pseudo-terminals. `RIG=vcan`: on the
//! SocketCAN interface `vcan0`, serial lines still on pseudo-terminals.

pub mod apart;
pub mod certificate;
mod coverage;
pub mod cycles;
mod desk;
mod emulator;
pub mod flood;
mod four_screws;
mod group;
mod hand;
mod interface;
pub mod json_schema;
mod line_signal;
mod many;
mod not_run;
mod plant_trace;
mod pose_judge;
mod random;
mod rig;
mod shipped;
mod slcan_hub;
pub mod specimens;
mod spot_cameras;
mod stand;
pub mod stream;
pub mod volume;
mod whole;

pub use coverage::Coverage;
pub use desk::{Desk, cia402_settings};
pub use emulator::{Emulator, INTERFACE, Setup};
pub use four_screws::{four_cyclic_axes, with_fourth_drive, with_fourth_screw};
pub use group::{Group, Start};
pub use hand::Hand;
pub use interface::{Interface, run};
pub use line_signal::{with_emulated_line_signal, with_few_lines};
pub use many::{judged_of_each, of_each};
pub use not_run::{left_out, not_run};
pub use plant_trace::PlantTrace;
pub use pose_judge::{EDGE, PoseJudge, true_pose};
pub use random::{normal, random, seeds};
pub use rig::{Bench, Rig, machine_config, rigs, shipped_config, vcan_is_native};
pub use shipped::*;
pub use slcan_hub::SlcanHub;
pub use spot_cameras::with_emulated_spot_cameras;
pub use stand::{Stand, on_every_rig};
pub use truestage::for_tests::{Edit, with_spot_cameras};
pub use whole::in_every_run;
