//! What the loop has heard of one SYNC: the drives' answers, and the newest sample of every
//! channel and thermometer.

use drivers::device::AxisReading;
use units::Time;

use super::account::Heard;
use super::seats::Seats;
use super::{AXES_MAX, Channel, ThermometerSample};
use crate::devices::Devices;

/// The newest sample of drive number `at`, if it came after the SYNC.
pub(super) fn answer(devices: &Devices, at: usize, synced: Time) -> Option<AxisReading> {
    let reading = devices.axes[at].device.reading()?;
    (reading.at >= synced).then_some(reading)
}

pub(super) fn heard<'a>(
    devices: &Devices,
    seats: &'a mut Seats,
    now: Time,
    synced: Time,
) -> Heard<'a> {
    let mut actual = [None; AXES_MAX];
    for (actual, at) in actual.iter_mut().zip(&seats.drive[..seats.count]) {
        let reading = answer(devices, *at, synced);
        *actual = reading.map(|it| it.position);
    }
    devices.hear_channels(&mut seats.channels);
    devices.hear_temperatures(&mut seats.temperatures);
    devices.hear_spots(&mut seats.spots);
    Heard {
        now,
        actual,
        channels: &seats.channels,
        temperatures: &seats.temperatures,
        spots: &seats.spots,
    }
}

impl Devices {
    /// Puts the newest sample of each analog channel into its place, in the order of the
    /// modules' names.
    pub fn hear_channels(&self, channels: &mut [Option<Channel>]) {
        // A module without a sample keeps its places: its channels would else be taken for
        // those of the next one. What it said last stays, as old as it is.
        let mut first = 0;
        for analog in &self.analogs {
            let own = channels.iter_mut().skip(first);
            first += analog.device.channels();
            let Some(sample) = analog.device.reading() else {
                continue;
            };
            let values = sample.volts.iter().zip(&sample.saturated);
            for (place, (volts, saturated)) in own.zip(values) {
                *place = Some(Channel {
                    at: sample.at,
                    volts: *volts,
                    saturated: *saturated,
                });
            }
        }
    }

    /// Likewise of the thermometers.
    pub fn hear_temperatures(&self, temperatures: &mut [Option<ThermometerSample>]) {
        let modules = self.analogs.iter();
        let mut first = 0;
        for module in modules.filter_map(|it| it.device.thermometers()) {
            let own = temperatures.iter_mut().skip(first);
            first += module.sensors();
            let Some(sample) = module.temperatures() else {
                continue;
            };
            for (place, celsius) in own.zip(&sample.celsius) {
                *place = Some(ThermometerSample {
                    at: sample.at,
                    celsius: *celsius,
                });
            }
        }
    }
}
