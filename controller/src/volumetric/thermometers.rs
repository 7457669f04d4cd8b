//! Thermometers on their way into the correction. Those that make one effect between them share
//! their trouble: when one of them says nothing, all of them hold, fade or stop, and they come back
//! together. If one of a pair faded alone, it would leave a gradient that does not exist.

use std::sync::Arc;

use compensator::volumetric::model::{Thermal, ThermalChannel};
use compensator::volumetric::online::{Feed, FeedStatus, TemperatureChannel, Trouble};
use units::portable::hypot;
use units::{Celsius, Time};

use crate::certificate::Certified;
use crate::config::MachineConfig;
use crate::volumetric::VolumetricFailure;
use crate::volumetric::inputs::{place_of_temperature, repeats_of_module};
use crate::volumetric::settings::{feed_settings, temperature_settings};
use crate::volumetric::{FeedConfig, TemperatureConfig};
use machine::engine::{Observed, ThermometerSample};

/// What is read of a thermometer at a moment: when its sample came, and what it said.
fn newest(seen: &[Option<ThermometerSample>], place: usize) -> Option<(Time, Celsius)> {
    let newest = seen.get(place).copied().flatten();
    newest.map(|it| (it.at, it.celsius.unwrap_or(Celsius(f64::NAN))))
}

/// What it shows, with what its certificate corrects.
pub(super) fn right(shown: Celsius, certified: Option<&Certified>) -> Celsius {
    let correction = certified.map_or(0.0, |it| it.figures.correction(shown.value()));
    Celsius(shown.value() + correction)
}

/// A thermometer that is believed only while it shows what can be.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    place: usize,
    channel: TemperatureChannel,
    certified: Option<Arc<Certified>>,
}

impl Reader {
    pub(super) fn new(config: &MachineConfig, temperature: &TemperatureConfig) -> Self {
        Self {
            place: place_of_temperature(config, &temperature.analog, temperature.channel),
            channel: TemperatureChannel::new(temperature_settings(temperature)),
            certified: temperature.certified(),
        }
    }

    /// The temperature at `now` by the newest samples of all thermometers.
    pub(super) fn read(
        &mut self,
        now: Time,
        seen: &[Option<ThermometerSample>],
    ) -> Result<Celsius, Trouble> {
        let newest = newest(seen, self.place);
        let newest = newest.map(|(at, it)| (at, right(it, self.certified.as_deref())));
        self.channel.read(now, newest)
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
            let each = members.map(|(it, _)| repeats_of_module(config, &it.analog));
            feed_settings(feed, each.max().unwrap_or(1))
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
            return hypot(channel.u, feed.left().value());
        }
        let shown = self.shown[at];
        let farthest = (channel.high - shown)
            .value()
            .max((shown - channel.low).value());
        farthest / 3.0_f64.sqrt()
    }

    /// The standard uncertainties of what was given out last, in kelvin.
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

#[cfg(test)]
mod tests {
    use crate::Edit;
    use core::time::Duration;

    use super::*;
    use crate::certificate::{CertificateConfig, Figures, Point};
    use crate::volumetric::VolumetricConfig;
    use crate::volumetric::settings::thermal;

    const SHIPPED: &str = include_str!("../../../configs/machines/volumetric.toml");
    const REFERENCES: [Celsius; 6] = [Celsius(20.0); 6];
    const PERIOD: Duration = Duration::from_millis(20);

    /// What the thermometers show; they are on one module, whose sample came just now.
    type Shown = [Option<Celsius>; 6];

    fn shipped() -> (MachineConfig, VolumetricConfig) {
        let quick = SHIPPED.edit("fade_out_s = 60.0", "fade_out_s = 1.0");
        let config = crate::config::parse(&quick, "m").unwrap().config;
        let own = config.volumetric.clone().unwrap();
        (config, own)
    }

    fn samples(shown: &Shown, at: Time) -> Vec<Option<ThermometerSample>> {
        let sample = |celsius: &Option<Celsius>| {
            let celsius = *celsius;
            Some(ThermometerSample { at, celsius })
        };
        shown.iter().map(sample).collect()
    }

    /// The shipped thermometers in a warm machine, and the time.
    struct Warm {
        thermometers: Thermometers,
        now: Time,
        shown: Vec<Celsius>,
    }

    impl Warm {
        fn new() -> Self {
            let (config, own) = shipped();
            let feed = own.feed.clone().unwrap();
            let thermal = thermal(&own, &REFERENCES);
            let thermometers = Thermometers::new(&config, &own.temperature, &feed, &thermal);
            let mut warm = Self {
                thermometers,
                now: Time::ZERO,
                shown: REFERENCES.to_vec(),
            };
            warm.run(300, |_| [Some(Celsius(22.0)); 6]);
            assert_eq!(warm.shown, [Celsius(22.0); 6]);
            assert_eq!(warm.thermometers.u_kelvin(), [0.01; 6]);
            warm
        }

        /// So many periods with what is shown in each; no two of a pair ever part, nothing jumps.
        #[track_caller]
        fn run(&mut self, periods: u32, each: impl Fn(u32) -> Shown) {
            for period in 0..periods {
                self.now += PERIOD;
                let temperatures = samples(&each(period), self.now);
                let observed = Observed {
                    now: self.now,
                    nominal: &[],
                    actual: &[],
                    channels: &[],
                    temperatures: &temperatures,
                    spots: &[],
                };
                let before = core::mem::take(&mut self.shown);
                self.shown = self.thermometers.advance(&observed).to_vec();
                for pair in self.shown.chunks(2) {
                    assert_eq!(pair[0], pair[1], "in period {period}: {:?}", self.shown);
                }
                for (before, now) in before.iter().zip(&self.shown) {
                    let jump = (*now - *before).abs();
                    assert!(jump.value() < 0.05, "{jump} in period {period}");
                }
            }
        }
    }

    /// One of a pair in trouble: the pair fades and returns, the others stay as they are.
    #[test]
    fn a_pair_goes_and_comes_back_together_whatever_befalls_one_of_it() {
        let good = Some(Celsius(22.0));
        // No sensor, below what can be, faster than it can be.
        for bad in [None, Some(Celsius(5.0)), Some(Celsius(25.0))] {
            let mut warm = Warm::new();
            warm.run(200, |_| [bad, good, good, good, good, good]);
            assert_eq!(warm.shown[..2], REFERENCES[..2]);
            assert_eq!(warm.shown[2..], [Celsius(22.0); 4]);
            let u = warm.thermometers.u_kelvin();
            // From 20 to 35 °C, evenly.
            let unknown = 15.0 / 3.0_f64.sqrt();
            assert!(u[..2].iter().all(|it| (it - unknown).abs() < 1e-9), "{u:?}");
            assert_eq!(u[2..], [0.01; 4]);
            let troubled = warm.thermometers.statuses();
            let troubled = troubled.filter(|it| matches!(it, FeedStatus::Faded(_)));
            assert_eq!(troubled.count(), 2);
            warm.run(150, |_| [good; 6]);
            // Half way back it is nearly a kelvin off, and says so.
            let (shown, u) = (warm.shown[0], warm.thermometers.u_kelvin()[0]);
            assert!((21.0..21.9).contains(&shown.value()), "{shown}");
            assert!(
                (u - (22.0 - shown.value())).abs() < 0.01,
                "{u} K at {shown}"
            );
            warm.run(150, |_| [good; 6]);
            assert_eq!(warm.shown, [Celsius(22.0); 6]);
            assert_eq!(warm.thermometers.u_kelvin(), [0.01; 6]);
        }
    }

    /// A spike each second, and never ten good samples between two that are bad.
    #[test]
    fn a_pair_is_not_believed_while_one_of_it_flickers() {
        let mut warm = Warm::new();
        let good = Some(Celsius(22.0));
        let flickers = |period: u32| {
            if period.is_multiple_of(50) {
                None
            } else {
                good
            }
        };
        warm.run(400, |period| {
            [good, flickers(period), good, good, good, good]
        });
        assert_eq!(warm.shown[..2], REFERENCES[..2]);
        assert_eq!(warm.shown[2..], [Celsius(22.0); 4]);
    }

    /// All of them: one module sends nothing any more.
    #[test]
    fn thermometers_whose_samples_are_old_fade_together() {
        let mut warm = Warm::new();
        let last = samples(&[Some(Celsius(22.0)); 6], warm.now);
        for _ in 0..200 {
            warm.now += PERIOD;
            let observed = Observed {
                now: warm.now,
                nominal: &[],
                actual: &[],
                channels: &[],
                temperatures: &last,
                spots: &[],
            };
            let shown = warm.thermometers.advance(&observed);
            assert!(shown.iter().all(|it| *it == shown[0]), "{shown:?}");
        }
        // A second until a sample is old, 0.2 s of patience, a second to fade.
        assert_eq!(warm.thermometers.shown, REFERENCES);
    }

    /// The sample with which it fails, and why.
    #[track_caller]
    fn fails(shown: &[Shown], index: usize, says: fn(&Trouble) -> bool) {
        let (config, own) = shipped();
        let mut thermometry = Thermometry::new(&config, &own.temperature);
        let mut now = Time::ZERO;
        for (at, it) in shown.iter().enumerate() {
            now += PERIOD;
            let added = thermometry.add(now, &samples(it, now));
            let is_last = at + 1 == shown.len();
            match added {
                Ok(()) => assert!(!is_last, "it was believed"),
                Err(VolumetricFailure::NoTemperature {
                    index: seen,
                    source,
                }) => {
                    assert!(is_last && seen == index && says(&source), "{at}: {source}");
                }
                Err(failure) => panic!("{failure}"),
            }
        }
    }

    #[test]
    fn a_spike_or_what_cannot_be_never_gets_into_a_mean() {
        let good = [Some(Celsius(21.0)); 6];
        let with = |celsius: Option<Celsius>| {
            let mut shown = good;
            shown[4] = celsius;
            shown
        };
        let spike = with(Some(Celsius(21.5)));
        fails(&[good, good, spike], 4, |it| {
            matches!(it, Trouble::Jumped { .. })
        });
        let cold = with(Some(Celsius(9.9)));
        fails(&[good, cold], 4, |it| {
            matches!(it, Trouble::Implausible { .. })
        });
        fails(&[with(None)], 4, |it| {
            matches!(it, Trouble::Implausible { .. })
        });
    }

    /// It shows 0.2 K too much at 20 °C: 20.0 on it are 19.8 °C.
    #[test]
    fn what_a_thermometer_shows_too_much_is_taken_away() {
        let point = Point {
            reading: 20.0,
            correction: -0.2,
            u: 0.01,
        };
        let certificate = CertificateConfig::of(Figures::Table(vec![point]));
        let certified = certificate.certified.as_deref();
        assert_eq!(right(Celsius(20.0), certified), Celsius(19.8));
        assert_eq!(right(Celsius(20.0), None), Celsius(20.0));
        // Both that of the certificate and that of the key count, wherever it is asked for.
        let (_, own) = shipped();
        let mut thermometer = own.temperature[0].clone();
        thermometer.standard_uncertainty_k = 0.01;
        thermometer.certificate = Some(certificate);
        let u = thermometer.u_kelvin();
        assert!((u - 0.01 * 2.0_f64.sqrt()).abs() < 1e-12, "{u}");
    }

    #[test]
    fn means_begin_anew_and_what_was_shown_last_still_counts() {
        let (config, own) = shipped();
        let mut thermometry = Thermometry::new(&config, &own.temperature);
        assert!(thermometry.is_empty());
        for celsius in [21.0, 21.1, 21.2] {
            let shown = samples(&[Some(Celsius(celsius)); 6], Time::from_seconds(1.0));
            let added = thermometry.add(Time::from_seconds(1.0), &shown);
            added.unwrap_or_else(|failure| panic!("{failure}"));
        }
        let means = thermometry.take();
        assert!(means.iter().all(|it| (it.value() - 21.1).abs() < 1e-9));
        assert!(thermometry.is_empty());
        let later = Time::from_seconds(2.0);
        let far = samples(&[Some(Celsius(23.0)); 6], later);
        assert!(thermometry.add(later, &far).is_err(), "1 K per minute");
        let old = Time::from_seconds(4.0);
        let refused = thermometry.add(old, &far);
        assert!(refused.is_err(), "two seconds old");
    }
}
