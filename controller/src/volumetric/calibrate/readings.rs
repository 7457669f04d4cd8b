//! One line of a calibration: read, and written down.

use core::time::Duration;

use compensator::volumetric::identify::Observation;
use compensator::volumetric::online::{Displacement, MovingState};
use compensator::volumetric::{Axis, Point};
use units::portable::hypot;
use units::{Celsius, Metres};

use crate::failure::Failure;
use crate::store::Journal;
use crate::volumetric::AXES;
use crate::volumetric::calibrate::Session;
use crate::volumetric::calibrate::known::SeenState;
use crate::volumetric::calibrate::plan::set_up_task;
use crate::volumetric::correction::lever;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::inputs::slide_of;
use crate::volumetric::line::LineReadout;
use crate::volumetric::reference::mean::Mean;
use crate::volumetric::settings::beam_drift;
use crate::volumetric::{LineReadEntry, LineReadingEntry};
use crate::volumetric::{VolumeEntry, VolumeLog};

impl WorkVolume<'_> {
    /// Reads the line of this number, by whatever reads it.
    pub(super) fn run_line(
        &mut self,
        session: &mut Session<'_>,
        at: usize,
        journal: &mut Journal<VolumeLog>,
    ) -> Result<(), Failure> {
        let shown = match session.by_own_detectors(at) {
            Some(observations) => {
                for it in &observations {
                    let reading = LineReadingEntry {
                        beam_shift_m: session.wandered(at, it),
                        ..LineReadingEntry::of(at, it)
                    };
                    session.keep(reading, journal)?;
                }
                session.references.temperatures.clone()
            }
            None => self.run_line_set_up(session, at, journal)?,
        };
        let whole = LineReadEntry {
            line: at,
            temperatures_c: shown.iter().map(|it| it.value()).collect(),
            at_s: self.core.now().seconds(),
        };
        journal.write(&VolumeEntry::LineRead(whole.clone()))?;
        journal.flush_to_disk()?;
        session.read.whole.push(whole);
        Ok(())
    }

    /// Has the line set up, and reads it by interferometer. Says what the thermometers showed.
    fn run_line_set_up(
        &mut self,
        session: &mut Session<'_>,
        number: usize,
        journal: &mut Journal<VolumeLog>,
    ) -> Result<Vec<Celsius>, Failure> {
        let line = session.lines[number];
        let task = set_up_task(&session.lines, number);
        let readout = LineReadout {
            instrument: session.own.instrument.clone(),
            settle: Duration::from_secs_f64(session.own.settle_ms * 1e-3),
            samples: session.own.average_samples,
        };
        let set_up = self.set_up_line(&task, &readout, session.operator)?;
        let mut shown = vec![Vec::new(); session.config.temperature.len()];
        for at in line.points(session.points_of(number)) {
            let read = self.read_line(&set_up, at)?;
            let (seen, shift, temperatures) = self.state_now(session, at)?;
            for (sum, celsius) in shown.iter_mut().zip(&temperatures) {
                sum.push(celsius.value());
            }
            let observation = read.observation(number);
            let reading = session.known.without(&observation, &seen, &temperatures)?;
            let beyond = Observation {
                reading,
                ..observation
            };
            let beyond = LineReadingEntry::of(number, &beyond);
            let entry = LineReadingEntry {
                deviation_si: beyond.read_si,
                u_si: beyond.u_si,
                scatter_m: Some(read.scatter.value()),
                sideways_m: seen.state.sideways.map(|it| it.map(Metres::value)),
                roll_rad: seen.state.roll.map(|it| it.value()),
                beam_shift_m: Some(shift.map(|it| it.map(Metres::value))),
                temperatures_c: temperatures.iter().map(|it| Some(it.value())).collect(),
                at_s: read.when.seconds(),
                ..LineReadingEntry::of(number, &observation)
            };
            session.keep(entry, journal)?;
        }
        let mean = |it: &Vec<f64>| Celsius(it.iter().sum::<f64>() / it.len() as f64);
        Ok(shown.iter().map(mean).collect())
    }

    /// What the detectors see beyond their references, how far the beams have moved at their ends, and
    /// what the thermometers show.
    fn state_now(
        &mut self,
        session: &mut Session<'_>,
        at: Point,
    ) -> Result<(SeenState, [Displacement; 3], Vec<Celsius>), Failure> {
        let seen = self.watch_at_rest(session.own.detector_samples)?;
        let mut state = MovingState::default();
        let mut u_displacement = [Metres(0.0); 3];
        let mut shifts = [Displacement::default(); 3];
        for axis in Axis::ALL {
            let own = session.config.rolls()[axis.index()];
            let (Some(config), Some(reference)) = (own, &session.rolls[axis.index()]) else {
                continue;
            };
            let position = at.along(axis);
            let roll = self.roll_of(axis, position, config, &seen)?;
            state.roll[axis.index()] = roll - reference.at(position);
        }
        for axis in Axis::ALL {
            let beam = session.config.beam.each()[axis.index()];
            let (Some(beam), Some(reference)) = (beam, &session.beams[axis.index()]) else {
                continue;
            };
            let position = at.along(axis);
            let (slide, end) = self.places_of_beam(axis, position, beam, &seen)?;
            let noise = &mut session.end_noise[axis.index()];
            end.iter().flatten().for_each(|it| noise.add(it));
            u_displacement[axis.index()] = session.u_displacement(axis, position);
            let end = end.map_or_else(|| reference.end(), place_of);
            let shift = reference.beam_shift(end);
            shifts[axis.index()] = shift;
            // How guides bend is still to be found: what the detector sees of that is part of the
            // unknown (`BendPlan::seen_from`).
            let tilts = lever(axis, slide_of(beam)?, &[], &[]).seen(
                position,
                state.roll[axis.index()],
                &[],
            );
            let whole = reference.displacement(position, place_of(slide), shift);
            state.sideways[axis.index()] = core::array::from_fn(|k| whole[k] - tilts[k]);
        }
        for still in &seen {
            session.thermometry.add(still.now, &still.temperatures)?;
        }
        let seen = SeenState {
            state,
            u_displacement,
        };
        Ok((seen, shifts, session.thermometry.take()))
    }
}

fn place_of(means: [Mean; 2]) -> Displacement {
    means.map(|it| Metres(it.mean()))
}

impl Session<'_> {
    /// How sure a displacement of `axis` is by the noise of its detectors. Few samples at one stop say little of that: what
    /// the slide's detector does is known from its references, which are means of many, and the end detector always sees
    /// the same, so that all stops count.
    fn u_displacement(&self, axis: Axis, position: Metres) -> Metres {
        let k = axis.index();
        let samples = self.own.detector_samples;
        let fraction = self.config.beam.each()[k].and_then(beam_drift);
        let fraction = fraction.map_or(0.0, |it| it.fraction(position));
        let of_end = fraction * self.end_noise[k].u_of_mean(samples);
        let mut beams = self.references.content.beams.iter();
        let record = beams.find(|it| it.axis == AXES[k]);
        let taken = self.config.reference.map_or(0, |it| it.samples);
        let slide = record.and_then(|it| it.u_slide(position));
        let slide = slide.unwrap_or_default() * (f64::from(taken) / f64::from(samples)).sqrt();
        Metres(hypot(slide.value(), of_end))
    }

    /// Writes a reading down.
    fn keep(
        &mut self,
        reading: LineReadingEntry,
        journal: &mut Journal<VolumeLog>,
    ) -> Result<(), Failure> {
        journal.write(&VolumeEntry::LineReading(reading.clone()))?;
        self.read.readings.push(reading);
        Ok(())
    }

    fn points_of(&self, at: usize) -> usize {
        let plan = self.read.plan.as_ref();
        plan.map_or(2, |it| it.lines[at].points)
    }
}
