//! What all demonstrations share: what they are asked, the machine that is shown, power cycles, the page.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use machine::records::JournalHeader;
use serde_json::Value;
use units::Time;

use super::emulation::Emulation;
use crate::emulated::HallDrift;
use crate::program::output::{Ended, Output};
use crate::{Failure, Machine};
use machine::records::Store;

/// How long the mains stays off, and what the drives take to boot, in machine time.
const POWER_OFF: Duration = Duration::from_millis(800);

/// How it is shown.
#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The emulated stage's errors, noise and drift; the same seed is the same stage.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Run the emulated machine in real time, this many times as fast (10, say), to watch it;
    /// without this option time passes as fast as the computer allows. Not for three axes.
    #[arg(long, value_name = "FACTOR")]
    pub(crate) speed: Option<f64>,
    /// Emulate in this process, without terminals: the same frames and figures, sooner. Three axes
    /// always are.
    #[arg(long, conflicts_with = "speed")]
    pub(crate) in_process: bool,
    /// How often the power is cycled.
    #[arg(long, default_value_t = 3)]
    pub(crate) power_cycles: u64,
    /// Where calibrations, runs and the report go; the configuration's folder if not given.
    #[arg(long)]
    pub(crate) data_dir: Option<PathBuf>,
}

/// A machine that can be shown.
pub(crate) struct Demo {
    /// What it is called on the command line.
    pub(crate) name: &'static str,
    /// What it is, for whoever asks for help.
    pub(crate) help: &'static str,
    /// Where its configuration ships, that configuration, and what it is emulated from.
    pub(crate) files: [&'static str; 3],
    pub(crate) show: Show,
}

/// Who shows it.
pub(crate) enum Show {
    /// On a stand, behind terminals or in this process.
    OnStand(fn(&mut Stand, &DemoArgs, Output) -> Result<Shown, Failure>),
    /// From beginning to end in virtual time.
    Alone(fn(&Demo, &DemoArgs, Output) -> Ended),
}

/// The files of the machine that ships as this name.
macro_rules! shipped {
    ($name:literal) => {
        [
            concat!("configs/machines/", $name, ".toml"),
            include_str!(concat!("../../../../configs/machines/", $name, ".toml")),
            include_str!(concat!("../../../../configs/emulated/", $name, ".toml")),
        ]
    };
}
pub(crate) use shipped;

/// A machine to show, and its emulation.
pub(crate) struct Stand {
    pub(crate) machine: Machine,
    pub(crate) store: Store,
    pub(crate) emulated: Emulation,
    pub(crate) started: Instant,
}

/// Switches the machine off and everything's power off and on, `drift` meanwhile, and starts again.
pub(crate) fn power_cycle(
    machine: &mut Machine,
    emulated: &Emulation,
    drift: HallDrift,
) -> Result<(), Failure> {
    machine.shut_down()?;
    emulated.power_cycle(drift)?;
    let back = machine.now() + POWER_OFF;
    machine.run_until(back)?;
    machine.start()
}

/// Writes the page of a demonstration whose run begins with `header`, and says where.
pub(crate) fn write_page(
    store: &Store,
    header: &JournalHeader,
    html: &str,
) -> Result<PathBuf, Failure> {
    let stamp = header.started.replace([':', '-'], "");
    let path = store.reports().join(format!("{stamp}-demo.html"));
    store.write_report(&path, html)?;
    Ok(path)
}

/// What was shown.
pub(crate) struct Shown {
    pub(crate) text: String,
    pub(crate) value: Value,
    /// What is out of tolerance, if anything is.
    pub(crate) bad: Option<Failure>,
}

/// The last line of every demonstration: how long it took, and how long the machine lived.
pub(crate) fn took(wall: Duration, lived: Time) -> String {
    format!(
        "took {:.1} s, in which {:.0} s passed on the emulated machine",
        wall.as_secs_f64(),
        lived.seconds()
    )
}
