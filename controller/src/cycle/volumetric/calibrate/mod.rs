//! Calibrate: lines by laser interferometer and by the machine's own detectors, cold and, for what
//! warmth does, warm; one identification of all of them with its covariance.
//!
//! The references of the detectors are taken first: what the tables hold for is the machine as it
//! was then. While lines are read it goes on warming up. What the detectors see of that is taken
//! off each reading where it is made; expansions and bends are found with the errors, by what the
//! thermometers showed at each line. Straightnesses are those that the detectors read along their
//! beams, where there are beams; a beam is straighter than what a straightedge tells.
//!
//! A result that cannot be applied is refused before it is stored.

mod own;

use core::time::Duration;

use compensator::volumetric::function::Function;
use compensator::volumetric::identify::{
    ExpansionPlan, Identified, Observation, Optics, Plan, Reading, RunSetup, StandardDesign,
    StandardLine, ThermalPlan, standard_design,
};
use compensator::volumetric::model::{Machine as Model, Thermal, VolumetricModel};
use compensator::volumetric::online::{BeamReference, MovingState};
use compensator::volumetric::{Axis, Point};
use units::{Celsius, Metres, Radians};

use super::correction::lever;
use super::line::{LineOperator, LineOptics, LineReadout, LineTask};
use super::reference::{References, stretches};
use super::{GEOMETRY, VolumetricCorrection, VolumetricFailure, VolumetricState};
use crate::assemble::{
    beam_drift, bend_plans, function_shape, model_limits, point_of_mm, thermal, volume_axis,
    volumetric_chain, work_volume,
};
use crate::config::{VolumetricCalibrateConfig, VolumetricConfig};
use crate::cycle::utc_now;
use crate::failure::Failure;
use crate::machine::Machine;
use crate::observer::Stage;
use crate::store::{
    BendRecord, CalibrationRecord, Content, ExpansionRecord, GeometryContent, InstrumentRecord,
    RecordHead, Store,
};

/// What it is called where progress is told.
const WHOLE: &str = "volume";
/// Places between which the uncertainty of the tool is looked for, along each axis.
const PLACES: u32 = 4;

/// How the machine becomes warm between cold and warm lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WarmUp {
    /// It is not wanted: what warmth does is taken from the configuration.
    None,
    /// Something else warms it for so long, while the axes are switched off.
    Idle(Duration),
    /// All axes go to and fro for so long (ISO 230-3).
    Travel(Duration),
}

/// A calibration of three axes that was made, stored and activated.
#[derive(Clone, Debug)]
pub struct VolumetricCalibrated {
    /// The name of the errors.
    pub id: String,
    /// The name of the references taken with them.
    pub references: String,
    /// How many lines were read, cold and warm.
    pub lines: usize,
    /// What was found.
    pub found: Identified,
    /// The largest standard uncertainty of the tool in the volume.
    pub u_max: Metres,
}

/// What is known of the machine when its lines are read.
struct Session<'a> {
    config: VolumetricConfig,
    own: VolumetricCalibrateConfig,
    references: References,
    beams: [Option<BeamReference>; 3],
    roll: Option<Function<Radians>>,
    /// What detectors alone make of a place: without any table.
    live: VolumetricModel,
    operator: &'a mut dyn LineOperator,
    design: StandardDesign,
    runs: Runs,
}

/// What was read, by runs.
#[derive(Default)]
struct Runs {
    setups: Vec<RunSetup>,
    temperatures: Vec<Vec<Celsius>>,
    observations: Vec<Observation>,
}

impl Machine {
    /// Takes references, reads all lines that tell this machine's errors, then (unless it is not
    /// wanted) lets it become warm and reads those again that tell what warmth does; finds the
    /// errors, stores and activates them with their references.
    ///
    /// # Errors
    /// When an axis is not zeroed, a line cannot be set up or read, the readings do not tell all
    /// errors, the result cannot be applied, or anything stops the machine. What was in use before
    /// stays in use then.
    pub fn calibrate_volumetric(
        &mut self,
        store: &Store,
        warm_up: WarmUp,
        operator: &mut dyn LineOperator,
    ) -> Result<VolumetricCalibrated, Failure> {
        let mut session = self.calibration_session(operator)?;
        let lines = session.design.lines.clone();
        let warm: Vec<StandardLine> = match warm_up {
            WarmUp::None => Vec::new(),
            WarmUp::Idle(_) | WarmUp::Travel(_) => lines
                .iter()
                .filter(|it| it.is_for_warmth())
                .copied()
                .collect(),
        };
        let setups = session.plan_of_cold().runs;
        let total = (lines.len() + warm.len()) as u64;
        for (step, (line, setup)) in lines.iter().zip(setups).enumerate() {
            self.observer
                .progress(Stage::Calibrate, WHOLE, step as u64, total);
            session.runs.setups.push(setup);
            self.run_line(&mut session, line, (step + 1, total as usize))?;
        }
        if !warm.is_empty() {
            self.end_lines(session.operator)?;
            self.become_warm(warm_up)?;
        }
        for (at, line) in warm.iter().enumerate() {
            let step = lines.len() + at;
            self.observer
                .progress(Stage::Calibrate, WHOLE, step as u64, total);
            session.runs.setups.push(RunSetup {
                offset: true,
                alignment: None,
            });
            self.run_line(&mut session, line, (step + 1, total as usize))?;
        }
        self.end_lines(session.operator)?;
        self.observer
            .progress(Stage::Calibrate, WHOLE, total, total);
        self.conclude(store, session, !warm.is_empty())
    }

    fn calibration_session<'a>(
        &mut self,
        operator: &'a mut dyn LineOperator,
    ) -> Result<Session<'a>, Failure> {
        let config = self.volumetric_config()?.clone();
        let section = "calibrate";
        let own = config.calibrate.clone();
        let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
        let chain = volumetric_chain(&config).map_err(VolumetricFailure::from)?;
        let volume = work_volume(&config).map_err(VolumetricFailure::from)?;
        let roll_axis = config.roll.as_ref().map(|it| volume_axis(it.axis));
        let tool = point_of_mm(config.tool_offset_mm);
        let mut tools = vec![tool];
        tools.extend(own.second_tool_offset_mm.map(point_of_mm));
        let rolls = Axis::ALL.map(|axis| roll_axis == Some(axis));
        let design = standard_design(chain, &volume, &tools, rolls);
        let live = VolumetricModel::new(
            Model {
                chain,
                volume,
                axes: Default::default(),
                squareness: Default::default(),
                thermal: Thermal::default(),
                tool_max: Metres::from_mm(config.tool_max_mm),
                displacement_max: Metres::from_um(config.compensation.displacement_max_um),
                roll_max: config
                    .roll
                    .as_ref()
                    .map_or(Radians(0.0), |it| Radians::from_arcsec(it.roll_max_arcsec)),
            },
            model_limits(&config.compensation),
        );
        let live = live.map_err(VolumetricFailure::from)?;
        let references = self.take_references()?;
        let mut beams = [None, None, None];
        for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
            if let Some(drift) = beam.and_then(beam_drift) {
                beams[axis.index()] = references.content.beam("just taken", axis, drift)?;
            }
        }
        let roll = references.content.roll("just taken")?;
        Ok(Session {
            config,
            own,
            references,
            beams,
            roll,
            live,
            operator,
            design,
            runs: Runs::default(),
        })
    }

    /// Reads one line, by whatever reads it.
    fn run_line(
        &mut self,
        session: &mut Session<'_>,
        line: &StandardLine,
        step: (usize, usize),
    ) -> Result<(), Failure> {
        let run = session.runs.setups.len() - 1;
        if let Some(observations) = session.by_own_detectors(line, run) {
            let temperatures = session.references.temperatures.clone();
            session.runs.temperatures.push(temperatures);
            session.runs.observations.extend(observations);
            return Ok(());
        }
        let task = LineTask {
            optics: match line.optics {
                Optics::Linear => LineOptics::Linear,
                Optics::Straightness(across) => LineOptics::Straightness { across },
                Optics::Angle(about) => LineOptics::Angular { about },
            },
            start: line.from,
            end: line.to,
            tool: line.tool,
            step,
        };
        let readout = LineReadout {
            instrument: session.own.instrument.clone(),
            settle: Duration::from_secs_f64(session.own.settle_ms * 1e-3),
            samples: session.own.average_samples,
        };
        let set_up = self.set_up_line(&task, &readout, session.operator)?;
        let mut shown = vec![Vec::new(); session.config.temperature.len()];
        for at in line.points(session.points_of(line)) {
            let read = self.read_line(&set_up, at)?;
            let (state, temperatures) = self.state_now(session, at)?;
            for (sum, celsius) in shown.iter_mut().zip(temperatures) {
                sum.push(celsius.value());
            }
            let mut observation = read.observation(run);
            observation.reading = session.without_live(&observation, &state)?;
            session.runs.observations.push(observation);
        }
        let mean = |it: &Vec<f64>| Celsius(it.iter().sum::<f64>() / it.len() as f64);
        let temperatures = shown.iter().map(mean).collect();
        session.runs.temperatures.push(temperatures);
        Ok(())
    }

    /// What the detectors see beyond their references, and what the thermometers show.
    fn state_now(
        &mut self,
        session: &Session<'_>,
        at: Point,
    ) -> Result<(MovingState, Vec<Celsius>), Failure> {
        let seen = self.watch_at_rest(session.own.detector_samples)?;
        let mut state = MovingState::default();
        if let (Some(config), Some(reference)) = (&session.config.roll, &session.roll) {
            let axis = volume_axis(config.axis);
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
            // How guides bend is still to be found: what the detector sees of that is part of the
            // unknown (`BendPlan::seen_from`).
            let tilts = lever(axis, beam, &[], &[]).seen(position, state.roll[axis.index()], &[]);
            let whole = reference.displacement(position, places.0, shift);
            state.sideways[axis.index()] = core::array::from_fn(|k| whole[k] - tilts[k]);
        }
        Ok((state, self.temperatures_of(&session.config, &seen)?))
    }

    fn become_warm(&mut self, how: WarmUp) -> Result<(), Failure> {
        let config = self.volumetric_config()?.clone();
        let corners = [point_of_mm(config.low_mm), point_of_mm(config.high_mm)];
        match how {
            WarmUp::None => {}
            WarmUp::Idle(span) => self.idle(span)?,
            WarmUp::Travel(span) => {
                let until = self.now() + span;
                while self.now() < until {
                    for corner in corners {
                        self.go_straight(corner)?;
                    }
                }
            }
        }
        for axis in &config.axes {
            self.enable(axis)?;
        }
        Ok(())
    }

    fn conclude(
        &mut self,
        store: &Store,
        session: Session<'_>,
        is_warm: bool,
    ) -> Result<VolumetricCalibrated, Failure> {
        let plan = session.plan(is_warm);
        let found = plan.identify(&session.runs.observations);
        let found = found.map_err(VolumetricFailure::from)?;
        let shape = function_shape(session.config.compensation.interpolation);
        let axes = found.axis_errors(shape).map_err(VolumetricFailure::from)?;
        let temperatures = session.references.temperatures.clone();
        // What cannot be applied must not be stored as what is in use.
        let state = VolumetricState {
            axes: axes.clone(),
            squareness: found.squareness,
            bends: found.bends.clone(),
            expansions: found.expansions.clone(),
            beams: session.beams.clone(),
            roll: session.roll.clone(),
            temperatures: temperatures.clone(),
            ..VolumetricState::default()
        };
        VolumetricCorrection::new(self.config(), state)?;
        let mut content = GeometryContent::new(&axes, &found.squareness, &temperatures);
        content.bends = found.bends.iter().map(BendRecord::of).collect();
        content.expansions = found.expansions.iter().map(ExpansionRecord::of).collect();
        content.drives = self.volume_drives(&session.config);
        let head = RecordHead {
            created: utc_now(),
            source: format!("calibrate, {} lines", session.runs.setups.len()),
            instrument: InstrumentRecord {
                name: session.own.instrument.clone(),
                ..InstrumentRecord::default()
            },
            ..self.this_volume(GEOMETRY)?
        };
        let content = Content::VolumetricGeometry(content);
        let id = store.save(&CalibrationRecord { head, content })?;
        let u_max = session.largest_u(&found);
        let lines = session.runs.setups.len();
        let references = self.keep_references(store, &id, session.references)?.id;
        store.activate(GEOMETRY, &id)?;
        Ok(VolumetricCalibrated {
            id,
            references,
            lines,
            found,
            u_max,
        })
    }
}

impl Session<'_> {
    fn nodes(&self) -> [usize; 3] {
        Axis::ALL.map(|axis| stretches(&self.config, axis, self.own.step_mm) as usize + 1)
    }

    fn plan_of_cold(&self) -> Plan {
        let low = point_of_mm(self.config.low_mm);
        let high = point_of_mm(self.config.high_mm);
        // Tilts and positioning errors count from the machine's zero, where the volume has it.
        let zero = Axis::ALL.map(|axis| {
            let (low, high) = (low.along(axis).value(), high.along(axis).value());
            Metres(0.0_f64.clamp(low, high))
        });
        self.design
            .plan(self.nodes(), Point::new(zero[0], zero[1], zero[2]))
    }

    fn plan(&self, is_warm: bool) -> Plan {
        let mut plan = self.plan_of_cold();
        plan.runs = self.runs.setups.clone();
        let known = thermal(&self.config, &self.references.temperatures);
        if !is_warm || known.channels.is_empty() {
            return plan;
        }
        let expansions = Axis::ALL.into_iter().filter_map(|axis| {
            let of_axis = |it: &usize| known.channels[*it].expansion[axis.index()] != 0.0;
            let thermometers: Vec<usize> = (0..known.channels.len()).filter(of_axis).collect();
            (!thermometers.is_empty()).then_some(ExpansionPlan { axis, thermometers })
        });
        plan.thermal = ThermalPlan {
            references: self.references.temperatures.clone(),
            runs: self.runs.temperatures.clone(),
            u: known.channels.iter().map(|it| it.u).fold(0.0, f64::max),
            expansions: expansions.collect(),
            bends: bend_plans(&self.config),
            fixed: known.fixed,
        };
        plan
    }

    /// As many as there are nodes along the axis that goes farthest.
    fn points_of(&self, line: &StandardLine) -> usize {
        let nodes = self.nodes();
        let way = line.to - line.from;
        let moved = Axis::ALL
            .into_iter()
            .filter(|it| way.along(*it) != Metres(0.0));
        moved.map(|it| nodes[it.index()]).max().unwrap_or(2)
    }

    /// The reading as it would be, had the detectors seen nothing beyond their references.
    fn without_live(
        &self,
        observation: &Observation,
        state: &MovingState,
    ) -> Result<Reading, VolumetricFailure> {
        let Reading::Length {
            along,
            deviation,
            u,
        } = observation.reading
        else {
            return Ok(observation.reading);
        };
        let now = self.live.conditions(observation.tool, &[], state)?;
        let seen = self.live.deviation(observation.at, &now)?;
        let part = Axis::ALL
            .into_iter()
            .map(|it| seen.along(it) * along[it.index()]);
        let part = part.fold(Metres(0.0), |sum, it| sum + it);
        let deviation = deviation - part;
        Ok(Reading::Length {
            along,
            deviation,
            u,
        })
    }

    /// At the tool in use, over places all over the volume.
    fn largest_u(&self, found: &Identified) -> Metres {
        let (low, high) = (self.config.low_mm, self.config.high_mm);
        let tool = point_of_mm(self.config.tool_offset_mm);
        let shown = self.references.temperatures.clone();
        let mut largest = Metres(0.0);
        for n in 0..(PLACES + 1).pow(3) {
            let steps = [
                n % (PLACES + 1),
                n / (PLACES + 1) % (PLACES + 1),
                n / (PLACES + 1).pow(2),
            ];
            let at = core::array::from_fn(|k| {
                low[k] + (high[k] - low[k]) * f64::from(steps[k]) / f64::from(PLACES)
            });
            let u = found.standard_uncertainty(point_of_mm(at), tool, &shown);
            largest = largest.max(u.map_or(Metres(0.0), |it| it.distance()));
        }
        largest
    }
}
