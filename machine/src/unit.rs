//! A device of a machine.

use wire::Port;

/// A device with its name and its port.
pub struct Unit<D: ?Sized> {
    /// Its name in the configuration.
    pub name: String,
    /// The bus or line that it is on.
    pub port: Port,
    /// Its driver.
    pub device: Box<D>,
}
