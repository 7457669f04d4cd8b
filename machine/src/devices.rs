//! The devices of a machine by number: linear axes, rotary axes, analog modules, instruments,
//! cameras.

use std::collections::BTreeMap;

use drivers::device::{
    AnalogInput, Axis, Device, DisplacementInstrument, Identity, PoseInstrument, RotaryAxis,
    ServoDrive,
};
use units::Time;
use wire::Port;

use crate::failure::Failure;
use crate::machine::Machine;
use crate::unit::Unit;

/// Any device, with its port.
pub(crate) struct UnitMut<'a> {
    pub(crate) port: Port,
    pub(crate) device: &'a mut dyn Device,
}

macro_rules! as_device {
    ($($kind:path),*) => {$(
        impl Unit<dyn $kind> {
            fn as_device(&mut self) -> UnitMut<'_> {
                UnitMut {
                    port: self.port,
                    device: &mut *self.device,
                }
            }
        }
    )*};
}

as_device!(
    Axis,
    RotaryAxis,
    AnalogInput,
    DisplacementInstrument,
    PoseInstrument
);

impl Machine {
    /// Lets `act` see every device and its port, in the order of their numbers.
    pub(crate) fn each_device(&mut self, mut act: impl FnMut(Port, &mut dyn Device)) {
        for unit in &mut self.axes {
            act(unit.port, &mut *unit.device);
        }
        for unit in &mut self.rotaries {
            act(unit.port, &mut *unit.device);
        }
        for unit in &mut self.analogs {
            act(unit.port, &mut *unit.device);
        }
        for unit in &mut self.instruments {
            act(unit.port, &mut *unit.device);
        }
        for camera in &mut self.cameras {
            act(camera.unit.port, &mut *camera.unit.device);
        }
    }

    /// When the first deadline of any device is.
    pub(crate) fn next_device_deadline(&self) -> Time {
        let deadlines = self.devices().map(|(_, device)| device.poll_timeout());
        deadlines.fold(Time::NEVER, Time::min)
    }

    /// Every device with its name.
    fn devices(&self) -> impl Iterator<Item = (&String, &dyn Device)> {
        let axes = self.axes.iter().map(|it| (&it.name, &*it.device as _));
        let rotaries = self.rotaries.iter().map(|it| (&it.name, &*it.device as _));
        let analogs = self.analogs.iter().map(|it| (&it.name, &*it.device as _));
        let instruments = self.instruments.iter();
        let instruments = instruments.map(|it| (&it.name, &*it.device as _));
        let cameras = self.cameras.iter().map(|it| &it.unit);
        let cameras = cameras.map(|it| (&it.name, &*it.device as _));
        let machines_own = axes.chain(rotaries).chain(analogs);
        machines_own.chain(instruments).chain(cameras)
    }

    /// The names of all devices: axes, rotary axes, analog modules, instruments and cameras.
    pub fn device_names(&self) -> Vec<String> {
        self.devices().map(|(name, _)| name.clone()).collect()
    }

    /// What every device said it is, by its name in the configuration.
    pub fn identities(&self) -> BTreeMap<String, Identity> {
        self.devices()
            .filter_map(|(name, device)| Some((name.clone(), device.identity()?)))
            .collect()
    }

    /// What the device `name` said it is; `None` when it has not said that, or there is no such
    /// device.
    pub fn identity(&self, name: &str) -> Option<Identity> {
        let (_, device) = self.devices().find(|(own, _)| *own == name)?;
        device.identity()
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
        self.instrument_device(self.instruments.len()) + self.cameras.len()
    }

    pub(crate) fn device_name(&self, at: usize) -> String {
        let (name, _) = self.devices().nth(at).expect("a device has a number");
        name.clone()
    }

    /// Device number `at`, in the order of [`Machine::device_names`].
    pub(crate) fn device_mut(&mut self, at: usize) -> UnitMut<'_> {
        let (axes, drives) = (self.axes.len(), self.drive_count());
        let machines_own = drives + self.analogs.len();
        let instruments = machines_own + self.instruments.len();
        if at < axes {
            self.axes[at].as_device()
        } else if at < drives {
            self.rotaries[at - axes].as_device()
        } else if at < machines_own {
            self.analogs[at - drives].as_device()
        } else if at < instruments {
            self.instruments[at - machines_own].as_device()
        } else {
            self.cameras[at - instruments].unit.as_device()
        }
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

    /// The number, among all devices, of instrument number `at`.
    pub(crate) fn instrument_device(&self, at: usize) -> usize {
        self.drive_count() + self.analogs.len() + at
    }
}
