//! A CiA 404 module: which inputs carry what, and how finely they are read.

use drivers::device::cia404::{Cia404Settings, InputSettings, Quantity};
use units::portable::powi;

use super::{CHECKED, module_settings};
use crate::config::{AnalogConfig, CanBus, Cia404Config};
use machine::Patience;

/// What 16 bits reach in volts when a count is a millivolt.
const REACH_V: f64 = 32.767;
/// The finest resolution asked for: a microvolt.
const DIGITS_MAX: u8 = 3;

/// The digits behind the point of a millivolt with which `full_scale_v` can still be told: as many
/// as fit. `None` when not even whole millivolts reach that far.
pub(crate) fn voltage_digits(full_scale_v: f64) -> Option<u8> {
    let fits = |digits: &u8| full_scale_v * powi(10.0, i32::from(*digits)) <= REACH_V;
    (0..=DIGITS_MAX).rev().find(fits)
}

/// A CiA 404 module, as its driver is told; the configuration has been checked.
///
/// # Panics
/// With a range that is not to be told, or more inputs than a module has.
pub fn cia404_settings(
    analog: &AnalogConfig,
    module: &Cia404Config,
    bus: &CanBus,
    patience: Patience,
) -> Cia404Settings {
    let common = module_settings(&module.node, bus, patience);
    let voltages = analog.channels.iter().zip(&analog.full_scale_v);
    let voltages = voltages.map(|(channel, full_scale_v)| InputSettings {
        input: channel + 1,
        quantity: Quantity::Voltage,
        decimal_digits: voltage_digits(*full_scale_v).expect(CHECKED),
    });
    let sensors = module.temperature_channels.iter();
    let sensors = sensors.map(|channel| InputSettings::pt100(channel + 1));
    let inputs: Vec<_> = voltages.chain(sensors).collect();
    Cia404Settings::new(common, &inputs, module.every_syncs).expect(CHECKED)
}

#[cfg(test)]
mod tests {
    use super::voltage_digits;

    /// 3.2767 V in tenths of millivolts, 0.32767 V in hundredths, 32.767 V in whole ones.
    #[test]
    fn a_voltage_is_read_as_finely_as_its_range_lets() {
        for (full_scale_v, digits) in [
            (3.2, Some(1)),
            (3.3, Some(0)),
            (0.3, Some(2)),
            (0.001, Some(3)),
            (32.0, Some(0)),
            (33.0, None),
        ] {
            assert_eq!(voltage_digits(full_scale_v), digits, "{full_scale_v} V");
        }
    }
}
