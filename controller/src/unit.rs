//! A device of a machine.

use wire::Port;

/// A device with its name and its port.
pub(crate) struct Unit<D: ?Sized> {
    pub(crate) name: String,
    pub(crate) port: Port,
    pub(crate) device: Box<D>,
}
