//! The devices of a machine, by name and by number: linear axes, rotary axes, analog modules,
//! instruments, cameras.

use std::collections::BTreeMap;

use drivers::device::{
    AnalogInput, Axis, AxisReading, Device, DisplacementInstrument, Identity, LineUse,
    PoseInstrument, RotaryAxis, ServoDrive,
};
use units::{Approach, Radians, Time};
use wire::cia402::PowerState;
use wire::{Payload, Port, Ports};

use crate::failure::Failure;
use crate::lookout::Lookout;
use crate::parts::Camera;
use crate::unit::Unit;

/// The devices of a machine. Their numbers are those of the lists one after the other.
pub struct Devices {
    pub(crate) axes: Vec<Unit<dyn Axis>>,
    pub(crate) rotaries: Vec<Unit<dyn RotaryAxis>>,
    pub(crate) analogs: Vec<Unit<dyn AnalogInput>>,
    pub(crate) instruments: Vec<Unit<dyn DisplacementInstrument>>,
    pub(crate) cameras: Vec<Camera>,
    /// By the numbers of the cameras.
    pub(crate) lookouts: Vec<Lookout>,
}

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

impl Devices {
    /// Lets `act` see every device and its port, in the order of their numbers.
    pub(crate) fn each(&mut self, mut act: impl FnMut(Port, &mut dyn Device)) {
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
    pub(crate) fn next_deadline(&self) -> Time {
        let deadlines = self.named().map(|(_, device)| device.poll_timeout());
        deadlines.fold(Time::NEVER, Time::min)
    }

    /// The lines on which nobody waits for anything just now.
    pub(crate) fn unhurried_ports(&self) -> Ports {
        let (mut unhurried, mut awaited) = (Ports::NONE, Ports::NONE);
        for unit in &self.instruments {
            let ports = if unit.device.is_unhurried() {
                &mut unhurried
            } else {
                &mut awaited
            };
            ports.insert(unit.port);
        }
        let analogs = self.analogs.iter().map(|it| it.port);
        let cameras = self.cameras.iter().map(|it| it.unit.port);
        let axes = self.axes.iter().map(|it| it.port);
        let rotaries = self.rotaries.iter().map(|it| it.port);
        let others = axes.chain(rotaries).chain(analogs).chain(cameras);
        others.for_each(|port| awaited.insert(port));
        unhurried.without(awaited)
    }

    /// Every device with its name.
    fn named(&self) -> impl Iterator<Item = (&String, &dyn Device)> {
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
    pub fn names(&self) -> Vec<String> {
        self.named().map(|(name, _)| name.clone()).collect()
    }

    /// What every device said it is, by its name in the configuration.
    pub fn identities(&self) -> BTreeMap<String, Identity> {
        self.named()
            .filter_map(|(name, device)| Some((name.clone(), device.identity()?)))
            .collect()
    }

    /// What the device `name` said it is; `None` when it has not said that, or there is no such
    /// device.
    pub fn identity(&self, name: &str) -> Option<Identity> {
        let (_, device) = self.named().find(|(own, _)| *own == name)?;
        device.identity()
    }

    /// Counters of every device: dropped, late, mismatched and the like.
    pub fn counters(&self) -> Vec<(String, &'static str, u64)> {
        self.named()
            .flat_map(|(name, device)| {
                let counters = device.counters().into_iter();
                counters.map(move |(what, count)| (name.clone(), what, count))
            })
            .collect()
    }

    pub(crate) fn count(&self) -> usize {
        self.instrument_device(self.instruments.len()) + self.cameras.len()
    }

    pub(crate) fn name(&self, at: usize) -> String {
        let (name, _) = self.named().nth(at).expect("a device has a number");
        name.clone()
    }

    /// Device number `at`, in the order of [`Devices::names`].
    pub(crate) fn unit_mut(&mut self, at: usize) -> UnitMut<'_> {
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

    /// Whether drive number `at` has been enabled since the start, or says that it is.
    pub(crate) fn may_move(&self, at: usize) -> bool {
        let drive = self.drive(at);
        let is_on = matches!(
            drive.power_state(),
            Some(PowerState::OperationEnabled | PowerState::QuickStopActive)
        );
        drive.was_enabled() || is_on
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
        let names = names_of(&self.axes).chain(names_of(&self.rotaries));
        place_of_axis(axis, names)
    }

    /// The number of a named linear axis.
    pub(crate) fn axis_index(&self, axis: &str) -> Result<usize, Failure> {
        place_of_axis(axis, names_of(&self.axes))
    }

    /// The number of a named rotary axis among those.
    pub(crate) fn rotary_index(&self, axis: &str) -> Result<usize, Failure> {
        place_of_axis(axis, names_of(&self.rotaries))
    }

    /// The number of a named instrument among those.
    pub(crate) fn instrument_index(&self, name: &str) -> Result<usize, Failure> {
        place_of(name, "instrument", names_of(&self.instruments))
    }

    /// The number of a named image controller among those.
    pub(crate) fn camera_index(&self, name: &str) -> Result<usize, Failure> {
        place_of(name, "camera", self.names_of_cameras())
    }

    /// The number, among all devices, of instrument number `at`.
    pub(crate) fn instrument_device(&self, at: usize) -> usize {
        self.drive_count() + self.analogs.len() + at
    }

    /// The number, among all devices, of camera number `at`.
    pub(crate) fn camera_device(&self, at: usize) -> usize {
        self.instrument_device(self.instruments.len()) + at
    }

    /// The names of the linear axes.
    pub fn axis_names(&self) -> Vec<String> {
        names_of(&self.axes).cloned().collect()
    }

    /// The names of the rotary axes.
    pub fn rotary_names(&self) -> Vec<String> {
        names_of(&self.rotaries).cloned().collect()
    }

    /// The names of the image controllers.
    pub fn camera_names(&self) -> Vec<String> {
        self.names_of_cameras().cloned().collect()
    }

    fn names_of_cameras(&self) -> impl Iterator<Item = &String> + Clone {
        self.cameras.iter().map(|it| &it.unit.name)
    }

    /// The newest sample of the rotary axis `axis`; its position counts on over the turns.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn rotary_reading(&self, axis: &str) -> Result<Option<AxisReading<Radians>>, Failure> {
        Ok(self.rotaries[self.rotary_index(axis)?].device.reading())
    }

    /// The last position in this direction that the rotary axis `axis` can be sent to from where it is, as its drive
    /// counts; `None` before its first sample.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn rotary_last_position(
        &self,
        axis: &str,
        way: Approach,
    ) -> Result<Option<Radians>, Failure> {
        let at = self.rotary_index(axis)?;
        Ok(self.rotaries[at].device.last_position(way))
    }

    /// The driver of `instrument`.
    ///
    /// # Errors
    /// When there is no such instrument.
    pub fn instrument(&self, instrument: &str) -> Result<&dyn DisplacementInstrument, Failure> {
        Ok(&*self.instruments[self.instrument_index(instrument)?].device)
    }

    /// The driver of the analog module `module`.
    ///
    /// # Errors
    /// When there is no such module.
    pub fn analog(&self, module: &str) -> Result<&dyn AnalogInput, Failure> {
        let at = place_of(module, "analog module", names_of(&self.analogs))?;
        Ok(&*self.analogs[at].device)
    }

    /// The drivers of all analog modules, in the order of their names.
    pub fn analogs(&self) -> impl Iterator<Item = &dyn AnalogInput> {
        self.analogs.iter().map(|unit| &*unit.device as _)
    }

    /// The first linear axis or module without a sample newer than `resumed`.
    pub(crate) fn silent_since(&self, resumed: Time) -> Option<String> {
        let is_old = |at: Option<Time>| at.is_none_or(|at| at <= resumed);
        let axis = self
            .axes
            .iter()
            .find(|it| is_old(it.device.reading().map(|it| it.at)));
        let module = || {
            let modules = self.analogs.iter();
            let mut silent = modules.filter(|it| is_old(it.device.last_sample()));
            silent.next().map(|it| it.name.clone())
        };
        axis.map(|it| it.name.clone()).or_else(module)
    }

    /// What device number `at` wants to send, when it has its turn.
    pub(crate) fn next_payload(&mut self, at: usize) -> Option<(Port, Payload)> {
        let unit = self.unit_mut(at);
        let (port, own) = (unit.port, unit.device.line_use());
        if own == LineUse::Unshared {
            return unit.device.poll_transmit().map(|payload| (port, payload));
        }
        if !self.may_speak(at, port, own) {
            return None;
        }
        let payload = self.unit_mut(at).device.poll_transmit()?;
        Some((port, payload))
    }

    /// Whether device number `at` has its turn on a line that it shares.
    fn may_speak(&mut self, at: usize, port: Port, own: LineUse) -> bool {
        let others: Vec<_> = (0..self.count())
            .filter(|other| *other != at)
            .filter_map(|other| {
                let unit = self.unit_mut(other);
                (unit.port == port).then(|| (unit.device.line_use(), other < at))
            })
            .collect();
        own.may_speak(others)
    }
}

fn names_of<D: ?Sized>(units: &[Unit<D>]) -> impl Iterator<Item = &String> + Clone {
    units.iter().map(|unit| &unit.name)
}

/// Procedures ask at each of their samples: names are copied for a failure only.
fn place_of_axis<'n>(
    axis: &str,
    names: impl Iterator<Item = &'n String> + Clone,
) -> Result<usize, Failure> {
    let place = names.clone().position(|name| name == axis);
    place.ok_or_else(|| Failure::NoSuchAxis {
        axis: axis.to_owned(),
        known: joined(names),
    })
}

fn place_of<'n>(
    name: &str,
    what: &'static str,
    names: impl Iterator<Item = &'n String> + Clone,
) -> Result<usize, Failure> {
    let place = names.clone().position(|it| it == name);
    place.ok_or_else(|| Failure::NoSuchDevice {
        what,
        name: name.to_owned(),
        known: joined(names),
    })
}

fn joined<'n>(names: impl Iterator<Item = &'n String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}
