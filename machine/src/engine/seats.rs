//! Where the engine's axes are among the machine's devices.

use compensator::volumetric::online::Spot;
use wire::Port;

use super::{
    AXES_MAX, CHANNELS_MAX, Channel, Engine, PerAxis, SPOTS_MAX, THERMOMETERS_MAX,
    ThermometerSample,
};
use crate::failure::Failure;
use crate::machine::Machine;

/// Where the engine's axes are among the machine's devices.
pub(super) struct Seats {
    pub(super) count: usize,
    /// By the engine's order of axes, the number of the drive.
    pub(super) drive: PerAxis<usize>,
    /// The buses that carry SYNC.
    pub(super) buses: Vec<Port>,
    pub(super) channels: [Option<Channel>; CHANNELS_MAX],
    pub(super) temperatures: [Option<ThermometerSample>; THERMOMETERS_MAX],
    pub(super) spots: [Option<Spot>; SPOTS_MAX],
}

impl Seats {
    pub(super) fn of(engine: &Engine, machine: &Machine) -> Result<Self, Failure> {
        let mut drive = [0; AXES_MAX];
        for (at, axis) in engine.axes.iter().enumerate() {
            drive[at] = machine.devices.axis_index(axis)?;
        }
        Ok(Self {
            count: engine.axes.len(),
            drive,
            buses: machine.ports.buses.iter().map(|it| it.port).collect(),
            channels: [None; CHANNELS_MAX],
            temperatures: [None; THERMOMETERS_MAX],
            spots: [None; SPOTS_MAX],
        })
    }

    /// The numbers of the drives.
    pub(super) fn drives(&self) -> &[usize] {
        &self.drive[..self.count]
    }
}
