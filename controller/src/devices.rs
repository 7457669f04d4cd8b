//! The devices of a machine by number: linear axes, rotary axes, analog modules, instruments.

use std::collections::BTreeMap;

use drivers::device::{Device, Identity, ServoDrive};
use drivers::transport::Port;

use crate::failure::Failure;
use crate::machine::{Machine, Unit};

/// Any device, with its port.
pub(crate) struct UnitMut<'a> {
    pub(crate) port: Port,
    pub(crate) device: &'a mut dyn Device,
}

impl Machine {
    /// Every device with its name.
    fn devices(&self) -> impl Iterator<Item = (&String, &dyn Device)> {
        let axes = self.axes.iter();
        let axes = axes.map(|unit| (&unit.name, &*unit.device as &dyn Device));
        let rotaries = self.rotaries.iter();
        let rotaries = rotaries.map(|unit| (&unit.name, &*unit.device as &dyn Device));
        let analogs = self.analogs.iter();
        let analogs = analogs.map(|unit| (&unit.name, &*unit.device as &dyn Device));
        let instruments = self.instruments.iter();
        let instruments = instruments.map(|unit| (&unit.name, &*unit.device as &dyn Device));
        axes.chain(rotaries).chain(analogs).chain(instruments)
    }

    /// The names of all devices: axes, then rotary axes, then analog modules, then instruments.
    pub fn device_names(&self) -> Vec<String> {
        self.devices().map(|(name, _)| name.clone()).collect()
    }

    /// What every device said it is, by its name in the configuration.
    pub fn identities(&self) -> BTreeMap<String, Identity> {
        self.devices()
            .filter_map(|(name, device)| Some((name.clone(), device.identity()?)))
            .collect()
    }

    /// Counters of every device: dropped, late, mismatched and the like.
    pub fn counters(&self) -> Vec<(String, &'static str, u64)> {
        self.devices()
            .flat_map(|(name, device)| {
                let counters = device.counters().into_iter();
                counters.map(move |(what, count)| (name.clone(), what, count))
            })
            .collect()
    }

    pub(crate) fn device_count(&self) -> usize {
        self.instrument_device(self.instruments.len())
    }

    pub(crate) fn device_name(&self, at: usize) -> String {
        self.device_names().swap_remove(at)
    }

    /// Device number `at`.
    pub(crate) fn device_mut(&mut self, at: usize) -> UnitMut<'_> {
        fn with_port<D: ?Sized>(unit: &mut Unit<D>) -> (Port, &mut D) {
            (unit.port, &mut *unit.device)
        }
        let (axes, drives) = (self.axes.len(), self.drive_count());
        let machine_devices = drives + self.analogs.len();
        let (port, device): (Port, &mut dyn Device) = if at < axes {
            let (port, device) = with_port(&mut self.axes[at]);
            (port, device)
        } else if at < drives {
            let (port, device) = with_port(&mut self.rotaries[at - axes]);
            (port, device)
        } else if at < machine_devices {
            let (port, device) = with_port(&mut self.analogs[at - drives]);
            (port, device)
        } else {
            let (port, device) = with_port(&mut self.instruments[at - machine_devices]);
            (port, device)
        };
        UnitMut { port, device }
    }

    /// How many of the devices, the first ones, are drives.
    pub(crate) fn drive_count(&self) -> usize {
        self.axes.len() + self.rotaries.len()
    }

    /// Drive number `at`, whatever it moves.
    pub(crate) fn drive(&self, at: usize) -> &dyn ServoDrive {
        match at.checked_sub(self.axes.len()) {
            None => &*self.axes[at].device,
            Some(at) => &*self.rotaries[at].device,
        }
    }

    /// The same, to be told something.
    pub(crate) fn drive_mut(&mut self, at: usize) -> &mut dyn ServoDrive {
        match at.checked_sub(self.axes.len()) {
            None => &mut *self.axes[at].device,
            Some(at) => &mut *self.rotaries[at].device,
        }
    }

    /// The number of a named axis, linear or rotary.
    pub(crate) fn drive_index(&self, axis: &str) -> Result<usize, Failure> {
        let mut names = self.device_names();
        names.truncate(self.drive_count());
        let at = names.iter().position(|name| name == axis);
        at.ok_or_else(|| Failure::NoSuchAxis {
            axis: axis.to_owned(),
            known: names.join(", "),
        })
    }

    /// The number of a named instrument among all devices.
    pub(crate) fn instrument_index(&self, name: &str) -> usize {
        self.instruments
            .iter()
            .position(|unit| unit.name == name)
            .expect("the configuration was checked: references exist")
    }

    /// The number of a named analog module among those.
    pub(crate) fn analog_index(&self, name: &str) -> usize {
        self.analogs
            .iter()
            .position(|unit| unit.name == name)
            .expect("the configuration was checked: references exist")
    }

    /// The number, among all devices, of instrument number `at`.
    pub(crate) fn instrument_device(&self, at: usize) -> usize {
        self.drive_count() + self.analogs.len() + at
    }
}
