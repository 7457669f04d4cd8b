//! References: what the detectors read along each axis when the machine is as its tables say.
//!
//! Each axis that is watched stops along the work volume, and its detectors' samples are averaged
//! there. While that lasts the beam itself wanders: what the detector at its end saw at each stop
//! brings the slide's reading to the same place of the beam. A detector in trouble ends it; half a
//! set of references is none.

pub(super) mod mean;

use core::time::Duration;

use compensator::volumetric::Axis;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::online::{Spot, Trouble};
use units::{Celsius, Metres, Quantity, Radians, Time};

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::run::{require_certified, settle, utc_now};
use crate::store::{CalibrationRecord, RecordHead, Store, short};
use crate::volumetric::config::THERMOMETERS;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::inputs::{DetectorPlace, RollReader, slide_of};
use crate::volumetric::settings::{beam_drift, drift_record, eye, volume_axis};
use crate::volumetric::thermometers::Thermometry;
use crate::volumetric::{AXES, BeamRecord, BeamReferencesContent, FunctionRecord};
use crate::volumetric::{BeamConfig, DetectorConfig, RollConfig, VolumetricConfig};
use crate::volumetric::{GEOMETRY, GeometryContent, REFERENCES, VolumetricFailure};
use machine::Stage;
use machine::engine::{
    CHANNELS_MAX, Channel, Observed, SPOTS_MAX, THERMOMETERS_MAX, ThermometerSample,
};
use mean::Mean;

/// How long an axis stands before its detectors count.
const REST: Duration = Duration::from_millis(50);
/// How long one sample may take to come; a picture may take longer by what its camera is given.
const SAMPLE_LIMIT: Duration = Duration::from_millis(500);
/// Samples of the thermometers by which the machine's warmth is judged.
const WARMTH_SAMPLES: u32 = 10;
/// How far a thermometer may be from what it showed when the errors were measured, unless the
/// configuration says otherwise: guides bend by some micrometres per kelvin, films grow likewise,
/// and a tenth of a machine's tolerance is some tenths of a micrometre.
const WARMTH_TOLERANCE_K: f64 = 0.2;
/// Which detector.
const ON_THE_SLIDE: &str = "on the slide";
const AT_THE_END: &str = "at the end of the beam";
const OF_THE_ROLL: &str = "of the roll";

/// What the detectors read, and how warm the machine was meanwhile.
#[derive(Clone, Debug)]
pub struct References {
    /// To be stored; still without the name of the errors it belongs to.
    pub content: BeamReferencesContent,
    /// Means of the thermometers, in the order of the configuration.
    pub temperatures: Vec<Celsius>,
}

/// References that were taken, stored and activated.
#[derive(Clone, Debug)]
pub struct VolumetricReferenced {
    /// The name of the record.
    pub id: String,
    /// What was read.
    pub references: References,
}

/// All channels at one moment of rest.
#[derive(Clone, Debug)]
pub(super) struct Still {
    pub(super) now: Time,
    channels: [Option<Channel>; CHANNELS_MAX],
    pub(super) temperatures: [Option<ThermometerSample>; THERMOMETERS_MAX],
    spots: [Option<Spot>; SPOTS_MAX],
}

impl Still {
    fn observed(&self) -> Observed<'_> {
        Observed {
            now: self.now,
            nominal: &[],
            actual: &[],
            channels: &self.channels,
            temperatures: &self.temperatures,
            spots: &self.spots,
        }
    }
}

/// What one axis was read at its stops.
#[derive(Clone, Debug, Default)]
struct Stops {
    nodes: Vec<Metres>,
    /// Of each stop: the slide's detector in both directions, that at the beam's end, the roll.
    slider: Vec<[Mean; 2]>,
    end: Vec<[Mean; 2]>,
    roll: Vec<Mean>,
}

/// Whether the certificates of the thermometers hold today.
///
/// # Errors
/// Of the first that does not.
pub(crate) fn require_thermometers_certified(config: &MachineConfig) -> Result<(), Failure> {
    require_certified(config, THERMOMETERS)
}

/// The name of the errors in use.
///
/// # Errors
/// When they were never measured.
pub(crate) fn measured_geometry(store: &Store) -> Result<String, Failure> {
    let geometry = store.active(GEOMETRY)?.current;
    Ok(geometry.ok_or(VolumetricFailure::NoGeometry)?)
}

impl WorkVolume<'_> {
    /// Takes the references of all detectors against the errors in use, stores and activates
    /// them: from now on a displacement is what has changed since now. The machine must be as
    /// warm as it was when its errors were measured.
    ///
    /// # Errors
    /// When an axis is not zeroed, the errors were never measured, the machine is warmer or colder
    /// than they were measured at by more than is permitted, a detector is in trouble, or anything
    /// stops the machine. What was in use before stays in use then.
    pub fn reference(&mut self, store: &Store) -> Result<VolumetricReferenced, Failure> {
        require_thermometers_certified(self.core.config)?;
        let geometry = measured_geometry(store)?;
        let errors = store.load::<GeometryContent>(&geometry)?.content;
        let then = errors.temperatures();
        let config = self.config.clone();
        if !config.temperature.is_empty() {
            // Before anything moves, and again by what it was while they were taken.
            let seen = self.watch_at_rest(WARMTH_SAMPLES)?;
            let mut thermometry = Thermometry::new(self.core.config, &config.temperature);
            for still in &seen {
                thermometry.add(still.now, &still.temperatures)?;
            }
            check_warmth(&config, &geometry, &then, &thermometry.take())?;
        }
        let references = self.take_references()?;
        check_warmth(&config, &geometry, &then, &references.temperatures)?;
        let kept = self.keep_references(store, &geometry, references, "reference")?;
        // What is used was stored before.
        settle(&mut self.core, store)?;
        store.activate(REFERENCES, &kept.id)?;
        settle(&mut self.core, store)?;
        Ok(kept)
    }

    /// Stores `references`, which come from `source`, as those of the errors called `geometry`.
    pub(super) fn keep_references(
        &self,
        store: &Store,
        geometry: &str,
        mut references: References,
        source: &str,
    ) -> Result<VolumetricReferenced, Failure> {
        references.content.geometry = geometry.to_owned();
        let mut head = RecordHead {
            created: utc_now(),
            source: source.to_owned(),
            ..self.this_volume(REFERENCES)?
        };
        head.instrument.certificates = self.config.certificate_records();
        let content = references.content.clone();
        let id = store.save(&CalibrationRecord { head, content })?;
        Ok(VolumetricReferenced { id, references })
    }

    /// Drives each watched axis along the work volume and takes down what its detectors read.
    pub(super) fn take_references(&mut self) -> Result<References, Failure> {
        let config = self.config.clone();
        for axis in &config.axes {
            self.core.require_zeroed(axis)?;
            self.core.enable(axis)?;
        }
        let mut thermometry = Thermometry::new(self.core.config, &config.temperature);
        let (mut content, mut rolls) = (BeamReferencesContent::default(), Vec::new());
        for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
            let roll = config.rolls()[axis.index()];
            if beam.is_none() && roll.is_none() {
                continue;
            }
            let stops = self.read_along(&config, axis, beam, roll, &mut thermometry)?;
            if let Some(beam) = beam {
                content.beams.push(stops.beam(axis, beam)?);
            }
            if roll.is_some() {
                rolls.push((axis, stops.roll()?));
            }
        }
        content.set_rolls(rolls);
        if thermometry.is_empty() && !config.temperature.is_empty() {
            for still in &self.watch_at_rest(WARMTH_SAMPLES)? {
                thermometry.add(still.now, &still.temperatures)?;
            }
        }
        Ok(References {
            content,
            temperatures: thermometry.take(),
        })
    }

    fn read_along(
        &mut self,
        config: &VolumetricConfig,
        axis: Axis,
        beam: Option<&BeamConfig>,
        roll: Option<&RollConfig>,
        thermometry: &mut Thermometry,
    ) -> Result<Stops, Failure> {
        let section = "reference";
        let own = config.reference;
        let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
        let name = config.axes[axis.index()].clone();
        let mut stops = Stops::default();
        let nodes = stops_along(config, axis, own.step_mm);
        let total = nodes.len() as u64;
        for (done, node) in (0..).zip(nodes) {
            let observer = self.core.observer();
            observer.progress(Stage::Reference, &name, done, total);
            self.go(&name, node)?;
            self.core.stand_still(&name, REST)?;
            let seen = self.watch_at_rest(own.samples)?;
            let machine = self.core.config;
            let blind = |what, source| VolumetricFailure::Blind {
                axis,
                at: node,
                what,
                source,
            };
            stops.nodes.push(node);
            if let Some(beam) = beam {
                let place = |it: DetectorConfig<'_>, what| {
                    place_of_beam(machine, axis, it, &seen, |source| blind(what, source))
                };
                stops.slider.push(place(slide_of(beam)?, ON_THE_SLIDE)?);
                if let Some(end) = beam.at_the_end() {
                    stops.end.push(place(end, AT_THE_END)?);
                }
            }
            if let Some(roll) = roll {
                let mean = mean_roll(machine, roll, &seen, |it| blind(OF_THE_ROLL, it))?;
                stops.roll.push(mean);
            }
            for still in &seen {
                thermometry.add(still.now, &still.temperatures)?;
            }
        }
        let observer = self.core.observer();
        observer.progress(Stage::Reference, &name, total, total);
        Ok(stops)
    }

    /// Where the detectors of a beam saw it at `seen`, with the axis at `at`: that on the slide,
    /// and that at the beam's end.
    pub(super) fn places_of_beam(
        &self,
        axis: Axis,
        at: Metres,
        beam: &BeamConfig,
        seen: &[Still],
    ) -> Result<([Mean; 2], Option<[Mean; 2]>), VolumetricFailure> {
        let place = |it: DetectorConfig<'_>, what| {
            let blind = |source| VolumetricFailure::Blind {
                axis,
                at,
                what,
                source,
            };
            place_of_beam(self.core.config, axis, it, seen, blind)
        };
        let slider = place(slide_of(beam)?, ON_THE_SLIDE)?;
        let end = beam.at_the_end().map(|it| place(it, AT_THE_END));
        Ok((slider, end.transpose()?))
    }

    /// Likewise the roll.
    pub(super) fn roll_of(
        &self,
        axis: Axis,
        at: Metres,
        config: &RollConfig,
        seen: &[Still],
    ) -> Result<Radians, VolumetricFailure> {
        let what = OF_THE_ROLL;
        let blind = |source| VolumetricFailure::Blind {
            axis,
            at,
            what,
            source,
        };
        let mean = mean_roll(self.core.config, config, seen, blind)?;
        Ok(Radians(mean.mean()))
    }

    /// So many samples of all modules and cameras, each newer than the one before, while nothing moves.
    pub(super) fn watch_at_rest(&mut self, samples: u32) -> Result<Vec<Still>, Failure> {
        let expected = samples as usize;
        let started = self.core.now();
        let limit = SAMPLE_LIMIT + self.core.config.longest_picture();
        let limit = self.core.patience().of(limit);
        let mut seen: Vec<Still> = Vec::with_capacity(expected);
        let (mut last, mut deadline) = (started, started + limit);
        while seen.len() < expected {
            let now = self.core.now();
            if now >= deadline {
                let (seen, waited) = (seen.len(), now.since(started));
                return Err(VolumetricFailure::NoSamples {
                    seen,
                    expected,
                    waited,
                }
                .into());
            }
            self.core.tick(deadline)?;
            let devices = self.core.devices();
            let samples = devices.analogs().map(|it| it.last_sample());
            let newest = samples.chain(devices.newest_spots());
            let newest = newest.map(|it| it.unwrap_or(Time::ZERO)).min();
            if newest.unwrap_or(Time::ZERO) <= last {
                continue;
            }
            (last, deadline) = (self.core.now(), self.core.now() + limit);
            let mut still = Still {
                now: last,
                channels: [None; CHANNELS_MAX],
                temperatures: [None; THERMOMETERS_MAX],
                spots: [None; SPOTS_MAX],
            };
            devices.hear_channels(&mut still.channels);
            devices.hear_temperatures(&mut still.temperatures);
            devices.hear_spots(&mut still.spots);
            seen.push(still);
        }
        Ok(seen)
    }
}

/// From one end of the work volume to the other. Where errors have nodes the detectors are read
/// too: between nodes errors are straight lines, and what a detector reads there is none.
fn stops_along(config: &VolumetricConfig, axis: Axis, step_mm: f64) -> Vec<Metres> {
    let (low, high) = (config.low_mm[axis.index()], config.high_mm[axis.index()]);
    let wanted = ((high - low) / step_mm).ceil().max(1.0) as u32;
    let nodes = config.calibrate.as_ref();
    let nodes = nodes.map_or(1, |it| config.stretches(axis, it.step_mm));
    let steps = wanted.next_multiple_of(nodes);
    let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(steps);
    (0..=steps).map(|it| Metres::from_mm(at(it))).collect()
}

/// Where a detector saw the beam, over all samples.
fn place_of_beam(
    machine: &MachineConfig,
    axis: Axis,
    config: DetectorConfig<'_>,
    seen: &[Still],
    blind: impl Fn(Trouble) -> VolumetricFailure,
) -> Result<[Mean; 2], VolumetricFailure> {
    let place = DetectorPlace::of(machine, config);
    let mut eye = eye(config).map_err(|source| VolumetricFailure::Detector { axis, source })?;
    let mut means = [Mean::default(); 2];
    for still in seen {
        let shown = place.shown(&still.observed());
        let place = eye.read(still.now, shown.as_ref()).map_err(&blind)?;
        for (mean, place) in means.iter_mut().zip(place) {
            mean.add(place.value());
        }
    }
    Ok(means)
}

fn mean_roll(
    machine: &MachineConfig,
    config: &RollConfig,
    seen: &[Still],
    blind: impl Fn(Trouble) -> VolumetricFailure,
) -> Result<Mean, VolumetricFailure> {
    let mut reader = RollReader::new(machine, config)?;
    let mut mean = Mean::default();
    for still in seen {
        let roll = reader.read(&still.observed()).map_err(&blind)?;
        mean.add(roll.value());
    }
    Ok(mean)
}

/// How far a thermometer may be from what it showed, in kelvin, for the machine to count as warm as it
/// was.
pub(super) fn warmth_tolerance_k(config: &VolumetricConfig) -> f64 {
    let own = config.reference.and_then(|it| it.warmth_tolerance_k);
    own.unwrap_or(WARMTH_TOLERANCE_K)
}

/// Whether the machine is as warm as when its errors were measured, thermometer by thermometer and
/// across each guide that bends.
fn check_warmth(
    config: &VolumetricConfig,
    geometry: &str,
    then: &[Celsius],
    now: &[Celsius],
) -> Result<(), VolumetricFailure> {
    let (seen, expected) = (then.len(), now.len());
    if seen != expected {
        return Err(VolumetricFailure::Temperatures { seen, expected });
    }
    let limit_k = warmth_tolerance_k(config);
    let geometry = short(geometry);
    for (index, (then, now)) in then.iter().zip(now).enumerate() {
        if (*now - *then).abs().value() > limit_k {
            let (then, now) = (*then, *now);
            return Err(VolumetricFailure::OtherWarmth {
                index,
                then,
                now,
                limit_k,
                geometry,
            });
        }
    }
    for bend in &config.bend {
        let Some(under) = bend.under else {
            continue;
        };
        let (axis, over) = (volume_axis(bend.axis), bend.over);
        let across = |shown: &[Celsius]| (shown[over] - shown[under]).value();
        let (then_k, now_k) = (across(then), across(now));
        if (now_k - then_k).abs() > limit_k {
            return Err(VolumetricFailure::OtherGradient {
                axis,
                over,
                under,
                then_k,
                now_k,
                limit_k,
                geometry,
            });
        }
    }
    Ok(())
}

impl Stops {
    /// The references of a beam, all brought to where it was on average.
    fn beam(&self, axis: Axis, config: &BeamConfig) -> Result<BeamRecord, VolumetricFailure> {
        let section = "beam";
        let drift = beam_drift(config).ok_or(VolumetricFailure::NotConfigured { section })?;
        let count = self.end.len().max(1) as f64;
        let end = [0, 1].map(|k| self.end.iter().map(|it| it[k].mean()).sum::<f64>() / count);
        let function = |k: usize| {
            let values = self.slider.iter().zip(&self.nodes).enumerate();
            let values = values.map(|(at, (seen, node))| {
                let wandered = self.end.get(at).map_or(0.0, |it| it[k].mean() - end[k]);
                Metres(seen[k].mean() + wandered * drift.fraction(*node))
            });
            let u = self.slider.iter().map(|it| Metres(it[k].u()));
            let name = ["first", "second"][k];
            record(name, &self.nodes, values.collect(), u.collect())
        };
        Ok(BeamRecord {
            axis: AXES[axis.index()],
            slider: [function(0)?, function(1)?],
            end_m: config.at_the_end().map(|_| end),
            drift: drift_record(config),
            wandered_m: config.at_the_end().map(|_| {
                let of = |k: usize| self.end.iter().map(move |it| it[k].mean() - end[k]);
                [of(0).collect(), of(1).collect()]
            }),
        })
    }

    fn roll(&self) -> Result<FunctionRecord, VolumetricFailure> {
        let values = self.roll.iter().map(|it| Radians(it.mean())).collect();
        let u = self.roll.iter().map(|it| Radians(it.u())).collect();
        record("roll", &self.nodes, values, u)
    }
}

fn record<Q: Quantity>(
    name: &str,
    nodes: &[Metres],
    values: Vec<Q>,
    u: Vec<Q>,
) -> Result<FunctionRecord, VolumetricFailure> {
    let function = Function::new(nodes, &values, Shape::Spline)?;
    Ok(FunctionRecord::of(name, &function.with_uncertainties(&u)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_at_both_ends_and_no_farther_apart_than_said() {
        let text = include_str!("../../../configs/machines/volumetric.toml");
        let config = crate::config::parse(text, "m").unwrap().config;
        let mut config = config.volumetric.unwrap();
        config.calibrate = None;
        let stops = |config: &VolumetricConfig, step_mm: f64| -> Vec<f64> {
            let stops = stops_along(config, Axis::Z, step_mm);
            stops.iter().map(|it| it.mm()).collect()
        };
        let expected = [0.0, 60.0, 120.0, 180.0, 240.0, 300.0];
        assert_eq!(stops(&config, 70.0), expected);
    }

    /// 30 mm from stop to stop at most, nodes 50 mm apart: 25 mm.
    #[test]
    fn nodes_of_the_errors_are_stops() {
        let text = include_str!("../../../configs/machines/volumetric.toml");
        let config = crate::config::parse(text, "m").unwrap().config;
        let config = config.volumetric.unwrap();
        for axis in Axis::ALL {
            let nodes = config.stretches(axis, config.calibrate.as_ref().unwrap().step_mm);
            for step_mm in [25.0, 30.0, 50.0, 70.0] {
                let stops = stops_along(&config, axis, step_mm);
                let apart = (stops[1] - stops[0]).mm();
                assert!(apart <= step_mm, "{apart} mm");
                for node in 0..=nodes {
                    let (low, high) = (config.low_mm[axis.index()], config.high_mm[axis.index()]);
                    let at = low + (high - low) * f64::from(node) / f64::from(nodes);
                    let is_stop = stops.iter().any(|it| (it.mm() - at).abs() < 1e-9);
                    assert!(is_stop, "no stop at {at} mm of {axis}, {step_mm} mm apart");
                }
            }
        }
    }

    /// The second and third thermometers are over and under y's guide by the configuration.
    #[test]
    fn a_machine_as_warm_as_it_was_is_told_from_another() {
        let text = include_str!("../../../configs/machines/volumetric.toml");
        let config = crate::config::parse(text, "m").unwrap().config;
        let mut config = config.volumetric.unwrap();
        let then = [20.0, 20.5, 21.0, 21.0, 20.0, 20.0].map(Celsius);
        let now = |at: usize, by: f64| {
            let mut now = then;
            now[at] += Celsius(by);
            now
        };
        let check = |config: &VolumetricConfig, now: &[Celsius]| {
            check_warmth(config, "0123456789abcdef", &then, now)
        };
        assert!(check(&config, &now(1, 0.19)).is_ok());
        let refused = check(&config, &now(1, -0.3)).unwrap_err().to_string();
        for word in [
            "thermometer 1 ",
            "20.20 °C",
            "20.50 °C",
            "0.20 K",
            "0123456789ab",
        ] {
            assert!(refused.contains(word), "{word}: {refused}");
        }
        // Each within its tolerance, but the guide bends by their difference.
        let mut across = now(2, 0.15);
        across[3] -= Celsius(0.15);
        let refused = check(&config, &across).unwrap_err();
        let VolumetricFailure::OtherGradient { axis, over, .. } = &refused else {
            panic!("{refused}")
        };
        assert_eq!((*axis, *over), (Axis::Y, 2));
        assert!(refused.to_string().contains("+0.30 K"), "{refused}");
        if let Some(reference) = &mut config.reference {
            reference.warmth_tolerance_k = Some(0.5);
        }
        assert!(check(&config, &across).is_ok());
        let fewer = check(&config, &then[..5]);
        assert!(matches!(fewer, Err(VolumetricFailure::Temperatures { .. })));
    }
}
