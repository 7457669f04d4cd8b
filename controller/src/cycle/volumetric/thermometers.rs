//! Thermometers on their way into the correction. Those that make one effect between them share
//! their trouble: when one of them says nothing, all of them hold, fade or stop, and they come back
//! together. One of a pair that fades alone would leave a gradient that is none.

use compensator::volumetric::model::{Thermal, ThermalChannel};
use compensator::volumetric::online::{Feed, FeedStatus, TemperatureChannel, Trouble};
use units::{Celsius, Time};

use super::VolumetricFailure;
use super::inputs::{confirmed_by_samples, place_of_temperature};
use crate::assemble::{feed_settings, temperature_settings};
use crate::config::{FeedConfig, MachineConfig, TemperatureConfig};
use crate::engine::{Observed, ThermometerSample};

/// What is read of a thermometer at a moment: when its sample came, and what it said.
fn newest(seen: &[Option<ThermometerSample>], place: usize) -> Option<(Time, Celsius)> {
    let newest = seen.get(place).copied().flatten();
    newest.map(|it| (it.at, it.celsius.unwrap_or(Celsius(f64::NAN))))
}

/// A thermometer that is believed only while it shows what can be.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    place: usize,
    channel: TemperatureChannel,
}

impl Reader {
    pub(super) fn new(config: &MachineConfig, temperature: &TemperatureConfig) -> Self {
        Self {
            place: place_of_temperature(config, &temperature.analog, temperature.channel),
            channel: TemperatureChannel::new(temperature_settings(temperature)),
        }
    }

    /// The temperature at `now` by the newest samples of all thermometers.
    pub(super) fn read(
        &mut self,
        now: Time,
        seen: &[Option<ThermometerSample>],
    ) -> Result<Celsius, Trouble> {
        self.channel.read(now, newest(seen, self.place))
    }
}

#[derive(Clone, Debug)]
struct Thermometer {
    reader: Reader,
    feed: Feed<Celsius, 1>,
    read: Result<Celsius, Trouble>,
    /// The first of those that share their trouble with it.
    group: usize,
}

/// All thermometers of a machine.
#[derive(Clone, Debug)]
pub(super) struct Thermometers {
    each: Vec<Thermometer>,
    channels: Vec<ThermalChannel>,
    shown: Vec<Celsius>,
    u_kelvin: Vec<f64>,
}

impl Thermometers {
    /// Those of the configuration, whose channels in the model are those of `thermal`.
    pub(super) fn new(
        config: &MachineConfig,
        own: &[TemperatureConfig],
        feed: &FeedConfig,
        thermal: &Thermal,
    ) -> Self {
        let groups = thermal.groups();
        // The slowest of a group to be believed tells when all of it are.
        let settings = |group: usize| {
            let members = own.iter().zip(&groups).filter(|(_, it)| **it == group);
            let feeds = members.map(|(it, _)| confirmed_by_samples(config, feed, &it.analog));
            let slowest = feeds.max_by_key(|it| it.confirm);
            feed_settings(&slowest.unwrap_or_else(|| feed.clone()))
        };
        let each = own.iter().zip(&groups).map(|(it, group)| Thermometer {
            reader: Reader::new(config, it),
            feed: Feed::new(settings(*group)),
            read: Ok(Celsius(f64::NAN)),
            group: *group,
        });
        Self {
            each: each.collect(),
            channels: thermal.channels.clone(),
            shown: thermal.channels.iter().map(|it| it.reference).collect(),
            u_kelvin: thermal.channels.iter().map(|it| it.u).collect(),
        }
    }

    /// The temperatures to reckon with: the references until there is something better.
    pub(super) fn advance(&mut self, observed: &Observed<'_>) -> &[Celsius] {
        for it in &mut self.each {
            it.read = it.reader.read(observed.now, observed.temperatures);
        }
        for at in 0..self.each.len() {
            let reference = self.channels[at].reference;
            let above = match self.trouble_of(self.each[at].group) {
                Some(trouble) => Err(trouble),
                None => self.each[at].read.map(|it| [it - reference]),
            };
            let above = self.each[at].feed.advance(observed.now, above)[0];
            self.shown[at] = reference + above;
            self.u_kelvin[at] = self.u_of(at);
        }
        &self.shown
    }

    fn trouble_of(&self, group: usize) -> Option<Trouble> {
        let mut members = self.each.iter().filter(|it| it.group == group);
        members.find_map(|it| it.read.err())
    }

    /// Of a temperature that nobody sees nothing is known but what is permitted; one that blends in
    /// is off by what is left of that.
    fn u_of(&self, at: usize) -> f64 {
        let (channel, feed) = (&self.channels[at], &self.each[at].feed);
        if feed.status() == FeedStatus::Good {
            return channel.u.hypot(feed.left().value());
        }
        let shown = self.shown[at];
        let farthest = (channel.high - shown)
            .value()
            .max((shown - channel.low).value());
        farthest / 3.0_f64.sqrt()
    }

    /// Its standard uncertainties, in kelvin.
    pub(super) fn u_kelvin(&self) -> &[f64] {
        &self.u_kelvin
    }

    /// Goes on with what the same thermometers showed `before`, whatever that counted from.
    pub(super) fn take_over(&mut self, before: &Self) {
        for (at, own) in self.each.iter_mut().enumerate() {
            let mut known = before.each.iter().zip(&before.channels);
            let same = known.find(|(it, _)| it.reader.place == own.reader.place);
            let Some((same, channel)) = same else {
                continue;
            };
            own.feed.take_over(&same.feed);
            let reference = self.channels[at].reference;
            own.feed.shift([channel.reference - reference]);
        }
    }

    pub(super) fn statuses(&self) -> impl Iterator<Item = FeedStatus> {
        self.each.iter().map(|it| it.feed.status())
    }
}

/// Means of what thermometers show, of samples that can be believed alone.
#[derive(Clone, Debug)]
pub(super) struct Thermometry {
    readers: Vec<Reader>,
    sums: Vec<f64>,
    count: u32,
}

impl Thermometry {
    /// Of the thermometers `own`; nothing was seen yet.
    pub(super) fn new(config: &MachineConfig, own: &[TemperatureConfig]) -> Self {
        Self {
            readers: own.iter().map(|it| Reader::new(config, it)).collect(),
            sums: vec![0.0; own.len()],
            count: 0,
        }
    }

    /// Takes one sample of each at `now`.
    ///
    /// # Errors
    /// When one of them says nothing to be relied upon: nobody would see it in a mean.
    pub(super) fn add(
        &mut self,
        now: Time,
        seen: &[Option<ThermometerSample>],
    ) -> Result<(), VolumetricFailure> {
        let each = self.readers.iter_mut().zip(&mut self.sums).enumerate();
        for (index, (reader, sum)) in each {
            let celsius = reader.read(now, seen);
            let celsius =
                celsius.map_err(|source| VolumetricFailure::NoTemperature { index, source })?;
            *sum += celsius.value();
        }
        self.count += 1;
        Ok(())
    }

    /// Whether nothing was taken since the means were.
    pub(super) const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The means of what was taken; the next begin anew, but what a thermometer can show next still
    /// follows from what it showed last.
    pub(super) fn take(&mut self) -> Vec<Celsius> {
        let count = f64::from(core::mem::take(&mut self.count));
        let mean = |sum: &mut f64| Celsius(core::mem::take(sum) / count);
        self.sums.iter_mut().map(mean).collect()
    }
}
