//! Lines measured by a laser interferometer: set up by a person, travelled straight by all axes
//! together, read where the machine stands.
//!
//! The start of a line is its zero: what is read is by how much the tool is off, against where it
//! was off at the start (as [`compensator::volumetric::identify`] takes it, with an offset of its
//! own for each line, and a slope where a straightedge was laid by hand).
//!
//! What guards it: the drives are switched off while hands are in the machine; a beam that is
//! lost while a line is measured is an alarm; a reading that no machine can make is refused.
//! Absent: plane-mirror optics, the square that joins two straightness lines.

mod measure;
pub(crate) mod settings;
mod task;

use core::time::Duration;

use compensator::length_correction::{LengthCorrection, combined, in_common};
use compensator::uncertainty::combine;
use compensator::volumetric::Point;
use compensator::volumetric::identify::{Observation, Reading};
use drivers::device::DisplacementReading;
use units::{Metres, Radians, Time};

use measure::Measure;
pub use task::{LineOperator, LineOptics, LineTask};

use crate::assemble;
use crate::failure::Failure;
use crate::volumetric::VolumetricFailure;
use crate::volumetric::handle::WorkVolume;

/// How long the machine lives between two looks at the person, or at the light.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// The same in readings, of an instrument that gives few.
const READINGS_OF_A_LOOK: f64 = 4.0;
/// How long the light of a line that was set up may be away.
const LIGHT_LIMIT: Duration = Duration::from_secs(10);
/// How long every axis rests before it is switched off, or left to whoever reads.
const REST: Duration = Duration::from_millis(50);
/// How long axes may take to come to rest.
const SETTLING_LIMIT: Duration = Duration::from_secs(2);

/// How lines are read.
#[derive(Clone, Debug, PartialEq)]
pub struct LineReadout {
    /// The instrument's name.
    pub instrument: String,
    /// How long the machine stands before it is read.
    pub settle: Duration,
    /// How many samples are averaged.
    pub samples: u32,
}

/// A line that is set up.
#[derive(Clone, Debug)]
pub struct Line {
    pub(super) task: LineTask,
    along: [f64; 3],
    measure: Measure,
    readout: LineReadout,
    length: LengthCorrection,
    /// What the instrument still read at the start, averaged.
    offset: Metres,
}

/// What was read at one place of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineReading {
    /// Where the machine was sent.
    pub at: Point,
    /// Where the moving optic was mounted.
    pub tool: Point,
    /// By how much the tool was off, against the start of the line.
    pub reading: Reading,
    /// What all lines have in common of its standard uncertainty, as [`Observation`] has it.
    pub common: f64,
    /// Standard deviation of the samples averaged, of the path that is counted.
    pub scatter: Metres,
    /// When.
    pub when: Time,
}

impl LineReading {
    /// As an identification takes it, from setting number `run` of the instrument.
    pub const fn observation(&self, run: usize) -> Observation {
        Observation {
            at: self.at,
            tool: self.tool,
            run,
            reading: self.reading,
            common: self.common,
            common_of_run: 0.0,
        }
    }
}

impl Line {
    /// What was asked for.
    pub const fn task(&self) -> &LineTask {
        &self.task
    }

    /// Its direction, of length 1.
    pub const fn along(&self) -> [f64; 3] {
        self.along
    }
}

impl WorkVolume<'_> {
    /// Goes to the line's start, has the line set up there with all axes switched off, and makes
    /// the instrument read zero.
    ///
    /// # Errors
    /// Before anything moves: without a work volume, such an instrument or such optics; when the
    /// line is none. Then: when nobody can be asked, or no light comes back; whatever stops the
    /// machine.
    pub fn set_up_line(
        &mut self,
        task: &LineTask,
        readout: &LineReadout,
        operator: &mut dyn LineOperator,
    ) -> Result<Line, Failure> {
        let along = task.direction().ok_or(VolumetricFailure::NotALine)?;
        let measure = self.measure_of(task.optics, &readout.instrument)?;
        let axes = self.config.axes.clone();
        self.core.leave_instrument();
        self.go_straight(task.start)?;
        self.rest_all(REST)?;
        for axis in &axes {
            self.core.disable(axis)?;
        }
        operator.ask_line(task)?;
        while !operator.is_set_up()? {
            let look = self.core.now() + LOOK_EVERY;
            self.core.tick(look)?;
        }
        // Whoever mounts something pushes the slides; this switches them on again.
        self.go_straight(task.start)?;
        self.find_light(&readout.instrument)?;
        let offset = self.read_path(readout)?.vacuum;
        let config = &self.core.config.instrument[&readout.instrument];
        let settings = settings::line_corrections(config, measure.has_two_beams());
        self.core.tell_beyond_certified(&readout.instrument, &[])?;
        let environment = self.core.environment_of(&readout.instrument)?;
        let environment = assemble::correction_environment(&environment);
        let length = LengthCorrection::new(settings, &environment);
        let length = length.map_err(|source| Failure::Correction {
            instrument: readout.instrument.clone(),
            source,
        })?;
        Ok(Line {
            task: *task,
            along,
            measure,
            readout: readout.clone(),
            length,
            offset,
        })
    }

    /// Goes to `at` and reads the line there.
    ///
    /// # Errors
    /// As [`Self::go_straight`]; a lost beam; a reading that no machine can make.
    pub fn read_line(&mut self, line: &Line, at: Point) -> Result<LineReading, Failure> {
        self.go_straight(at)?;
        self.read_line_here(line, at)
    }

    /// Reads the line where the machine stands, which was sent to `at` in whatever way.
    ///
    /// # Errors
    /// When the beam is lost, or the reading is one that no machine can make.
    pub(super) fn read_line_here(
        &mut self,
        line: &Line,
        at: Point,
    ) -> Result<LineReading, Failure> {
        let counted = self.read_path(&line.readout)?;
        let instrument = &line.readout.instrument;
        let environment = self.core.environment_of(instrument)?;
        let environment = assemble::correction_environment(&environment);
        let failed = |source| Failure::Correction {
            instrument: instrument.clone(),
            source,
        };
        let optical = counted.vacuum - line.offset;
        let corrected = line.length.correct(optical, &environment).map_err(failed)?;
        let budget = line.length.budget(optical, &environment).map_err(failed)?;
        let own_nm = self.core.config.instrument[instrument].instrument_standard_uncertainty_nm;
        let mean = counted.standard_deviation / f64::from(counted.samples).sqrt();
        let parts = [Metres(own_nm * 1e-9), mean, combined(&budget)].map(Metres::value);
        let u = Metres(combine(&parts));
        let way = at - line.task.start;
        let path = corrected.displacement;
        let reading = line.measure.reading(line.along, way, path, u);
        self.judge_reading(line, way, &reading)?;
        Ok(LineReading {
            at,
            tool: line.task.tool,
            reading,
            common: match line.measure {
                Measure::Along => in_common(&budget).value() * path.value().signum(),
                // What stretches micrometres of path is nothing.
                Measure::Across { .. } | Measure::Tilt { .. } => 0.0,
            },
            scatter: counted.standard_deviation,
            when: counted.at,
        })
    }

    /// The measurement has ended: the instrument may be packed up.
    ///
    /// # Errors
    /// When nobody can be told.
    pub fn end_lines(&mut self, operator: &mut dyn LineOperator) -> Result<(), Failure> {
        self.core.forget_instruments();
        operator.pack_up()
    }

    /// Moves all three axes together along a straight line, uncorrected, switching them on where
    /// they are off.
    ///
    /// # Errors
    /// When an axis is not zeroed, `target` is outside the soft limits, or something stops the
    /// machine on the way.
    pub fn go_straight(&mut self, target: Point) -> Result<(), Failure> {
        let mut mover = self.uncorrected_mover()?;
        self.drive_to(&mut mover, target, REST).map(|_| ())
    }

    /// Waits until all axes have stood for `span` without a break, by their encoders: after a
    /// cyclic motion no drive has a target that it could report as reached.
    fn rest_all(&mut self, span: Duration) -> Result<(), Failure> {
        let axes = self.config.axes.clone();
        let limit = self.core.patience().of(SETTLING_LIMIT) + span;
        let begin = self.core.now();
        let mut since = begin;
        while self.core.now().since(since) < span {
            self.core.tick(since + span)?;
            for axis in &axes {
                if self.core.reading(axis)?.is_some_and(|it| it.at_rest) {
                    continue;
                }
                since = self.core.now();
                if since.since(begin) > limit {
                    return Err(Failure::Machine(machine::Failure::Overdue {
                        device: axis.clone(),
                        step: "standing still",
                        waited: limit,
                    }));
                }
            }
        }
        Ok(())
    }

    fn measure_of(&self, optics: LineOptics, instrument: &str) -> Result<Measure, Failure> {
        let named = || instrument.to_owned();
        let config = self.core.config.instrument.get(instrument);
        let config = config.ok_or_else(|| VolumetricFailure::NoInstrument {
            instrument: named(),
        })?;
        let measure = Measure::new(optics, &config.optics());
        Ok(measure.map_err(|key| VolumetricFailure::NoOptics {
            instrument: named(),
            key,
        })?)
    }

    /// Waits until the instrument counts, and lets its alarms count from then on: whoever set the
    /// line up had his hands in the beam.
    fn find_light(&mut self, instrument: &str) -> Result<(), Failure> {
        self.core.use_instrument(instrument)?;
        self.core.leave_instrument();
        let limit = self.core.now() + self.core.patience().of(LIGHT_LIMIT);
        // A datum takes readings of its own, and each new one gives up those under way.
        let readings_per_s = self.core.config.instrument[instrument].readings_per_s();
        let look = LOOK_EVERY.max(Duration::from_secs_f64(READINGS_OF_A_LOOK / readings_per_s));
        loop {
            let now = self.core.now();
            self.core.set_instrument_datum(instrument)?;
            self.core.run_until(now + look)?;
            let is_lit = self
                .core
                .devices()
                .instrument(instrument)?
                .latest()
                .is_some();
            if is_lit {
                return self.core.use_instrument(instrument);
            }
            if self.core.now() >= limit {
                let instrument = instrument.to_owned();
                return Err(VolumetricFailure::NoLight { instrument }.into());
            }
        }
    }

    /// Lets the machine stand, then averages.
    fn read_path(&mut self, readout: &LineReadout) -> Result<DisplacementReading, Failure> {
        self.rest_all(readout.settle)?;
        let rate_hz = self.core.config.instrument[&readout.instrument].readings_per_s();
        Ok(self
            .core
            .average(&readout.instrument, readout.samples, rate_hz)?)
    }

    /// What is beyond anything that can be compensated is no error of the machine, but wrong
    /// optics, a wrong sign or a count that was lost.
    fn judge_reading(&self, line: &Line, way: Point, reading: &Reading) -> Result<(), Failure> {
        let limits = &self.config.compensation;
        let size = Metres::from_um(2.0 * limits.size_limit_um);
        let tilt = Radians(limits.slope_limit);
        // A straightedge lies as well as a hand can lay it.
        let laid = match line.measure {
            Measure::Across { .. } => way.distance() * limits.slope_limit,
            Measure::Along | Measure::Tilt { .. } => Metres::ZERO,
        };
        // A comparison with NaN is false, so that it is refused too.
        match *reading {
            Reading::Length { deviation, .. } if deviation.abs() <= size + laid => Ok(()),
            Reading::Angle { deviation, .. } if deviation.abs() <= tilt => Ok(()),
            Reading::Length { deviation, .. } => Err(VolumetricFailure::ImpossibleReading {
                seen: deviation,
                limit: size + laid,
            }
            .into()),
            Reading::Angle { deviation, .. } => Err(VolumetricFailure::ImpossibleTilt {
                seen: deviation,
                limit: tilt,
            }
            .into()),
        }
    }
}
