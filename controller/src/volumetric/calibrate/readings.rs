//! One line of a calibration: read, and written down.

use core::time::Duration;

use compensator::volumetric::identify::Observation;
use compensator::volumetric::online::{Displacement, MovingState};
use compensator::volumetric::{Axis, Point};
use units::{Celsius, Metres};

use crate::failure::Failure;
use crate::store::Journal;
use crate::volumetric::calibrate::Session;
use crate::volumetric::calibrate::plan::set_up_task;
use crate::volumetric::correction::lever;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::inputs::slide_of;
use crate::volumetric::line::LineReadout;
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
            let (state, shift, temperatures) = self.state_now(session, at)?;
            for (sum, celsius) in shown.iter_mut().zip(&temperatures) {
                sum.push(celsius.value());
            }
            let observation = read.observation(number);
            let reading = session.known.without(&observation, &state, &temperatures)?;
            let beyond = Observation {
                reading,
                ..observation
            };
            let beyond = LineReadingEntry::of(number, &beyond);
            let entry = LineReadingEntry {
                deviation_si: beyond.read_si,
                u_si: beyond.u_si,
                scatter_m: Some(read.scatter.value()),
                sideways_m: state.sideways.map(|it| it.map(Metres::value)),
                roll_rad: state.roll.map(|it| it.value()),
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
    ) -> Result<(MovingState, [Displacement; 3], Vec<Celsius>), Failure> {
        let seen = self.watch_at_rest(session.own.detector_samples)?;
        let mut state = MovingState::default();
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
            let places = self.places_of_beam(axis, position, beam, &seen)?;
            let end = places.1.unwrap_or_else(|| reference.end());
            let shift = reference.beam_shift(end);
            shifts[axis.index()] = shift;
            // How guides bend is still to be found: what the detector sees of that is part of the
            // unknown (`BendPlan::seen_from`).
            let tilts = lever(axis, slide_of(beam)?, &[], &[]).seen(
                position,
                state.roll[axis.index()],
                &[],
            );
            let whole = reference.displacement(position, places.0, shift);
            state.sideways[axis.index()] = core::array::from_fn(|k| whole[k] - tilts[k]);
        }
        for still in &seen {
            session.thermometry.add(still.now, &still.temperatures)?;
        }
        Ok((state, shifts, session.thermometry.take()))
    }
}

impl Session<'_> {
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
