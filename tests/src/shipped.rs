//! The machines that ship.

/// The shipped configuration of the linear machine.
pub const MACHINE: &str = include_str!("../../configs/machines/linear.toml");
/// The shipped description of its emulation.
pub const EMULATED: &str = include_str!("../../configs/emulated/linear.toml");

/// A machine that ships: its configuration and the description of its emulation.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// What the controller is told.
    pub machine: &'static str,
    /// What is emulated.
    pub emulated: &'static str,
}

/// The linear machine.
pub const LINEAR: Shipped = Shipped {
    machine: MACHINE,
    emulated: EMULATED,
};

/// The alignment platform.
pub const UVW: Shipped = Shipped {
    machine: include_str!("../../configs/machines/uvw.toml"),
    emulated: include_str!("../../configs/emulated/uvw.toml"),
};

/// The rotary table.
pub const ROTARY: Shipped = Shipped {
    machine: include_str!("../../configs/machines/rotary.toml"),
    emulated: include_str!("../../configs/emulated/rotary.toml"),
};

/// The alignment platform with amplifiers on a serial line in place of drives on CAN.
pub const UVW_COPLEY: Shipped = Shipped {
    machine: include_str!("../../configs/machines/uvw-copley.toml"),
    emulated: include_str!("../../configs/emulated/uvw-copley.toml"),
};

/// One stage with a linear motor and two Hall sensors on either side.
pub const GANTRY: Shipped = Shipped {
    machine: include_str!("../../configs/machines/gantry.toml"),
    emulated: include_str!("../../configs/emulated/gantry.toml"),
};

/// Three axes corrected throughout their volume.
pub const VOLUMETRIC: Shipped = Shipped {
    machine: include_str!("../../configs/machines/volumetric.toml"),
    emulated: include_str!("../../configs/emulated/volumetric.toml"),
};
