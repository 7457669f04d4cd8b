//! What the detectors of three axes see at this moment, for whoever adjusts beams and optics.
//!
//! Nothing is judged here by what it was before: while a person turns an adjuster a beam may jump and be anywhere. A
//! reading is the mean of the samples since the last look, which is steadier to the eye.
//!
//! Source: CN1214003A, claim 8: a detector at the end of the travel serves to set up and adjust the reference beam.
//!
//! Absent: where a slide stands. Without a zero, which would move it, nobody knows; its detector is compared with all
//! that its reference is along the travel.

use core::time::Duration;

use compensator::volumetric::online::{BeamDetector, Shown, SpotCamera, Trouble};
use compensator::volumetric::{Axis, ReferenceOf};
use machine::engine::Observed;
use units::{Metres, Radians, Time, Volts};

use crate::config::{ConfigHash, MachineConfig};
use crate::failure::Failure;
use crate::store::{RecordHead, Store};
use crate::volumetric::inputs::{DetectorPlace, RollReader, slide_of};
use crate::volumetric::reference::mean::Mean;
use crate::volumetric::settings::{beam_detector, spot_camera, volume_axis};
use crate::volumetric::{
    AXES, BeamReferencesContent, DetectorConfig, REFERENCES, RollConfig, VolumetricFailure,
};

/// What a detector sees.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sight {
    /// `x slide`, `y end`, `x roll`.
    pub(crate) name: String,
    /// The sum of its voltages; `None` for a camera or a roll.
    pub(crate) light: Option<Volts>,
    /// What it reads: two directions, or a roll.
    pub(crate) readings: Vec<SightReading>,
    /// Why there is no value, by the newest sample.
    pub(crate) trouble: Option<Trouble>,
}

impl Sight {
    /// Whether this is a roll, and no beam.
    pub(crate) fn is_roll(&self) -> bool {
        self.readings.iter().all(|it| it.along.is_none())
    }
}

/// One reading of a detector, in metres, of a roll in radians.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SightReading {
    /// `y`; `None` for a roll.
    pub(crate) along: Option<Axis>,
    /// What the detector can show: lowest, highest.
    pub(crate) field: (f64, f64),
    /// Its middle.
    pub(crate) middle: f64,
    /// Its smallest and largest reference along the travel; `None` where there is none.
    pub(crate) reference: Option<(f64, f64)>,
    /// The mean since the last look; `None` in trouble.
    pub(crate) value: Option<f64>,
    /// The newest value, or the end of the field that it is beyond; `None` in the dark.
    pub(crate) nearest: Option<f64>,
}

impl SightReading {
    /// How far the value is from the nearest of its references.
    pub(crate) fn off_reference(&self) -> Option<f64> {
        let ((low, high), value) = (self.reference?, self.value?);
        Some(value - value.clamp(low, high))
    }
}

/// How a detector is read.
enum Watch {
    Beam {
        detector: Box<BeamDetector>,
        place: DetectorPlace,
    },
    Spot {
        camera: SpotCamera,
        place: DetectorPlace,
    },
    Roll(RollReader),
}

/// A detector, and what it has shown since the last look.
struct Watched {
    eye: Watch,
    age_max: Duration,
    sight: Sight,
    newest: Option<Time>,
    light: Mean,
    values: [Mean; 2],
}

/// All detectors of three axes.
pub(crate) struct Sights {
    watched: Vec<Watched>,
}

impl Sights {
    /// The detectors of `config`, none for a machine without three axes that are watched; `references` are those in
    /// use.
    ///
    /// # Errors
    /// When a detector has impossible settings.
    pub(crate) fn new(
        config: &MachineConfig,
        references: Option<&BeamReferencesContent>,
    ) -> Result<Self, VolumetricFailure> {
        let Some(own) = &config.volumetric else {
            return Ok(Self {
                watched: Vec::new(),
            });
        };
        let mut watched = Vec::new();
        for (axis, beam) in Axis::ALL.into_iter().zip(own.beam.each()) {
            let Some(beam) = beam else {
                continue;
            };
            let letter = AXES[axis.index()];
            let known = references.and_then(|it| it.beams.iter().find(|it| it.axis == letter));
            let slide = known.map(|it| [0, 1].map(|k| ends(&it.slider[k].values_si)));
            watched.push(beam_eye(config, (axis, "slide"), slide_of(beam)?, slide)?);
            if let Some(end) = beam.at_the_end() {
                let known = known.and_then(|it| it.end_m);
                let known = known.map(|it| it.map(|place| (place, place)));
                watched.push(beam_eye(config, (axis, "end"), end, known)?);
            }
        }
        for (axis, roll) in Axis::ALL.into_iter().zip(own.rolls()) {
            let Some(roll) = roll else {
                continue;
            };
            let known = references.and_then(|it| it.roll_record(own, axis));
            watched.push(roll_eye(config, roll, known.map(|it| ends(&it.values_si)))?);
        }
        Ok(Self { watched })
    }

    /// Whether there is nothing to see.
    pub(crate) fn is_empty(&self) -> bool {
        self.watched.is_empty()
    }

    /// Takes the newest samples; one that was taken already counts once.
    pub(crate) fn hear(&mut self, observed: &Observed<'_>) {
        for it in &mut self.watched {
            it.hear(observed);
        }
    }

    /// What was seen since the last look, at `now`.
    pub(crate) fn look(&mut self, now: Time) -> Vec<Sight> {
        let each = self.watched.iter_mut();
        each.map(|it| it.look(now)).collect()
    }
}

/// The smallest and the largest.
fn ends(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}

fn beam_eye(
    config: &MachineConfig,
    (axis, whose): (Axis, &'static str),
    own: DetectorConfig<'_>,
    references: Option<[(f64, f64); 2]>,
) -> Result<Watched, VolumetricFailure> {
    let refused = |source| VolumetricFailure::Detector { axis, source };
    let place = DetectorPlace::of(config, own);
    let (eye, field, middle) = match own {
        DetectorConfig::Channels(own) => {
            let detector = Box::new(beam_detector(own).map_err(refused)?);
            let (field, middle) = (detector.field(), detector.middle());
            (Watch::Beam { detector, place }, field, middle)
        }
        DetectorConfig::Camera(own) => {
            let camera = spot_camera(own).map_err(refused)?;
            // Where it was taught.
            let middle = [Metres(0.0); 2];
            (Watch::Spot { camera, place }, camera.field(), middle)
        }
    };
    let reading = |k: usize| SightReading {
        along: Some(axis.others()[k]),
        field: (field[k].0.value(), field[k].1.value()),
        middle: middle[k].value(),
        reference: references.map(|it| it[k]),
        value: None,
        nearest: None,
    };
    let sight = Sight {
        name: format!("{axis} {whose}"),
        light: None,
        readings: vec![reading(0), reading(1)],
        trouble: None,
    };
    Ok(Watched::new(eye, own.age_max_ms(), sight))
}

fn roll_eye(
    config: &MachineConfig,
    own: &RollConfig,
    reference: Option<(f64, f64)>,
) -> Result<Watched, VolumetricFailure> {
    let largest = Radians::from_arcsec(own.roll_max_arcsec).value();
    let sight = Sight {
        name: format!("{} {}", volume_axis(own.axis), ReferenceOf::Roll),
        light: None,
        readings: vec![SightReading {
            along: None,
            field: (-largest, largest),
            middle: 0.0,
            reference,
            value: None,
            nearest: None,
        }],
        trouble: None,
    };
    let eye = Watch::Roll(RollReader::new(config, own)?);
    Ok(Watched::new(eye, own.age_max_ms, sight))
}

impl Watched {
    fn new(eye: Watch, age_max_ms: f64, sight: Sight) -> Self {
        Self {
            eye,
            age_max: Duration::from_secs_f64(age_max_ms * 1e-3),
            sight,
            newest: None,
            light: Mean::default(),
            values: [Mean::default(); 2],
        }
    }

    fn hear(&mut self, observed: &Observed<'_>) {
        match &self.eye {
            Watch::Beam { detector, place } => {
                let Some(Shown::Channels(sample)) = place.shown(observed) else {
                    return;
                };
                if !is_news(&mut self.newest, sample.at) {
                    return;
                }
                let look = detector.look(&sample.channels);
                self.light.add(look.light.value());
                let place = look.place.map(|it| it.map(Metres::value));
                self.take(place, look.nearest.map(|it| it.map(Metres::value)));
            }
            Watch::Spot { camera, place } => {
                let Some(Shown::Camera(spot)) = place.shown(observed) else {
                    return;
                };
                if !is_news(&mut self.newest, spot.at) {
                    return;
                }
                let field = camera.field();
                let nearest = |place: [Metres; 2]| {
                    core::array::from_fn(|k| {
                        let (low, high) = field[k];
                        place[k].value().clamp(low.value(), high.value())
                    })
                };
                let place = camera.place(&spot).map(|it| it.map(Metres::value));
                self.take(place, spot.place.ok().map(nearest));
            }
            Watch::Roll(reader) => match reader.look(observed) {
                Ok((roll, at)) => {
                    if !is_news(&mut self.newest, at) {
                        return;
                    }
                    let value = [roll.value(); 2];
                    self.take(Ok(value), Some(value));
                }
                // Too old is judged at the look, when the picture says so.
                Err(Trouble::Stale { .. }) => {}
                Err(trouble) => {
                    self.newest = Some(observed.now);
                    self.take(Err(trouble), None);
                }
            },
        }
    }

    fn take(&mut self, values: Result<[f64; 2], Trouble>, nearest: Option<[f64; 2]>) {
        let readings = self.sight.readings.iter_mut().enumerate();
        readings.for_each(|(k, it)| it.nearest = nearest.map(|it| it[k]));
        match values {
            Ok(values) => {
                self.sight.trouble = None;
                let each = self.values.iter_mut().zip(values);
                each.for_each(|(mean, value)| mean.add(value));
            }
            Err(trouble) => self.sight.trouble = Some(trouble),
        }
    }

    fn look(&mut self, now: Time) -> Sight {
        let limit = self.age_max;
        let seen = self.newest.map_or(Duration::MAX, |at| now.since(at));
        if seen > limit {
            self.sight.trouble = Some(Trouble::Stale { seen, limit });
            self.sight.light = None;
            for it in &mut self.sight.readings {
                it.nearest = None;
            }
        }
        let (light, values) = (core::mem::take(&mut self.light), self.values);
        self.values = [Mean::default(); 2];
        if let Some(light) = light.known() {
            self.sight.light = Some(Volts(light));
        }
        let is_good = self.sight.trouble.is_none();
        for (it, mean) in self.sight.readings.iter_mut().zip(values) {
            it.value = match is_good {
                // A module that is slower than the picture: what it showed last.
                true => mean.known().or(it.value).or(it.nearest),
                false => None,
            };
        }
        self.sight.clone()
    }
}

/// Whether something of `at` has not been taken yet; it counts as taken from now on.
fn is_news(newest: &mut Option<Time>, at: Time) -> bool {
    let is_new = newest.is_none_or(|before| at > before);
    if is_new {
        *newest = Some(at);
    }
    is_new
}

/// The references in use of the machine of `config`, where detectors were read or references given; drives are not
/// asked who they are.
///
/// # Errors
/// When the record is damaged, or belongs to another stage or configuration.
pub(crate) fn references_in_use(
    config: &MachineConfig,
    hash: &ConfigHash,
    store: &Store,
) -> Result<Option<BeamReferencesContent>, Failure> {
    let Some(id) = store.active(REFERENCES)?.current else {
        return Ok(None);
    };
    let record = store.load::<BeamReferencesContent>(&id)?;
    let here = RecordHead {
        stage_serial: config.machine.stage_serial.clone(),
        config_hash: hash.as_str().to_owned(),
        ..record.head.clone()
    };
    record.head.belongs_to(&id, &here, hash)?;
    Ok(Some(record.content))
}

#[cfg(test)]
mod tests;
