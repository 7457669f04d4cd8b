//! The errors from what was written down, by a machine just now or by anybody at any time.

use compensator::volumetric::Axis;
use compensator::volumetric::function::Shape;
use compensator::volumetric::identify::{
    Alignment, BendPlan, ExpansionPlan, FunctionPlan, Identified, IdentifyError, Observation, Plan,
    RunSetup, Scattered, Snooped, SquarenessName, ThermalPlan,
};
use compensator::volumetric::model::{AxisErrors, ErrorCovariance, ErrorName};
use units::{Celsius, Metres};

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::store::IdentityRecord;
use crate::store::budget::PlacesBudgetRecord;
use crate::volumetric::VolumetricConfig;
use crate::volumetric::calibrate::budget::{budget, grid, places};
use crate::volumetric::calibrate::cause::LikelyCauses;
use crate::volumetric::calibrate::plan::axis_of;
use crate::volumetric::settings::{beam_drift, bend_plans};
use crate::volumetric::{
    AgreementRecord, BeamReferencesContent, BendRecord, CovarianceRecord, ExpansionRecord,
    GeometryContent, LineEntry, LineReadEntry, UnknownRecord, VolumeLog, VolumePlanEntry,
    error_name, point,
};
use crate::volumetric::{Scatter, VolumetricCorrection, VolumetricFailure, VolumetricState};

/// What readings of lines say of three axes.
#[derive(Clone, Debug)]
pub struct VolumetricEvaluated {
    /// What was found.
    pub found: Identified,
    /// The same as functions.
    pub axes: [AxisErrors; 3],
    /// At which temperatures the errors hold.
    pub temperatures: Vec<Celsius>,
    /// How many lines were read whole.
    pub lines: usize,
    /// How many readings these have.
    pub readings: usize,
    /// The largest standard uncertainty of the tool in use, in the volume.
    pub u_max: Metres,
    /// Readings that are grossly wrong, or scatter more than they may.
    pub scatter: Option<Scatter>,
    /// What makes that uncertain; `None` of readings that are not to be used.
    budget: Option<PlacesBudgetRecord>,
    drives: Vec<IdentityRecord>,
    /// Errors that move nothing with the tools given: taken as zero.
    without_effect: Vec<ErrorName>,
}

impl VolumetricEvaluated {
    /// Finds the errors by the lines that are whole; between the nodes they run as `shape` says.
    ///
    /// # Errors
    /// When it was not written how, or the readings do not tell all errors.
    pub fn of(read: &VolumeLog, shape: Shape) -> Result<Self, Failure> {
        let entry = read.plan.as_ref().ok_or(VolumetricFailure::NoPlan)?;
        let wrong = || VolumetricFailure::NoPlan;
        let (plan, observations) = plan_of(entry, read, shape).ok_or_else(wrong)?;
        let found = plan.identify(&observations);
        let found = found.map_err(VolumetricFailure::from)?;
        let axes = found.axis_errors(shape);
        let axes = axes.map_err(VolumetricFailure::from)?;
        let temperatures = references(read);
        let wrong = contradiction(&plan, &found, &observations).map_err(VolumetricFailure::from)?;
        let scatter = wrong.map(|(scattered, gross)| {
            let causes = LikelyCauses::of((&plan, &observations, &gross), entry, read);
            Scatter::of(&scattered, (&gross, causes), entry, read, &observations)
        });
        let budget = match scatter {
            Some(_) => None,
            None => {
                let lines: Vec<_> = whole_of(entry, read)
                    .map(|it| &entry.lines[it.line])
                    .collect();
                let of = (&plan, observations.as_slice(), &found);
                budget(entry, &lines, of, &temperatures).map_err(VolumetricFailure::from)?
            }
        };
        Ok(Self {
            scatter,
            budget,
            u_max: largest_u(entry, &found, &temperatures),
            found,
            axes,
            temperatures,
            lines: plan.runs.len(),
            readings: observations.len(),
            drives: entry.drives.clone(),
            without_effect: without_effect(&plan),
        })
    }

    /// How well the readings agree, as it is stored and shown.
    pub fn agreement(&self) -> AgreementRecord {
        AgreementRecord {
            lines: self.lines,
            readings: self.readings,
            degrees_of_freedom: self.found.degrees_of_freedom,
            scatter_ratio: self.found.birge_ratio,
            tool_u_max_m: self.u_max.value(),
        }
    }

    /// As it is stored, with what stays unknown of a machine of `config`.
    pub fn content(&self, config: &VolumetricConfig) -> GeometryContent {
        let found = &self.found;
        let of = |it: &BendPlan| (it.axis, it.towards);
        let is_known = |it: &BendPlan| found.bends.iter().any(|known| of(&known.plan) == of(it));
        let mut unknown = bend_plans(config);
        unknown.retain(|it| !is_known(it));
        let of = (&self.axes, &found.squareness, &self.temperatures);
        GeometryContent {
            bends: found.bends.iter().map(BendRecord::of).collect(),
            expansions: found.expansions.iter().map(ExpansionRecord::of).collect(),
            drives: self.drives.clone(),
            agreement: Some(self.agreement()),
            covariance: self.covariance(config).as_ref().map(CovarianceRecord::of),
            budget: self.budget.clone(),
            unknown: UnknownRecord::of(&unknown, &self.without_effect),
            ..GeometryContent::new(of.0, of.1, of.2)
        }
    }

    /// How sure all errors are together, all over the volume.
    fn covariance(&self, config: &VolumetricConfig) -> Option<ErrorCovariance> {
        let along = |k: usize| {
            let all = places(config.low_mm[k], config.high_mm[k]);
            all.map(Metres::from_mm).collect()
        };
        self.found.covariance([along(0), along(1), along(2)])
    }

    /// Proves that the readings agree, and that the machine of `config` can be corrected by what was
    /// found: with what its detectors read then, or by tables alone where that is not known.
    ///
    /// # Errors
    /// When they do not, or it cannot.
    pub fn check(
        &self,
        config: &MachineConfig,
        references: Option<&BeamReferencesContent>,
    ) -> Result<(), Failure> {
        if let Some(scatter) = &self.scatter {
            return Err(VolumetricFailure::Scatter(Box::new(scatter.clone())).into());
        }
        let own = config.volumetric.as_ref().ok_or(VolumetricFailure::None)?;
        let mut state = VolumetricState {
            axes: self.axes.clone(),
            squareness: self.found.squareness,
            bends: self.found.bends.clone(),
            expansions: self.found.expansions.clone(),
            temperatures: self.temperatures.clone(),
            ..VolumetricState::default()
        };
        let Some(references) = references else {
            VolumetricCorrection::by_tables(config, state)?;
            return Ok(());
        };
        for (axis, beam) in Axis::ALL.into_iter().zip(own.beam.each()) {
            if let Some(drift) = beam.and_then(beam_drift) {
                state.beams[axis.index()] = references.beam("these references", axis, drift)?;
            }
        }
        state.rolls = references.rolls("these references", own)?;
        VolumetricCorrection::new(config, state)?;
        Ok(())
    }
}

/// What is wrong with readings that contradict each other; `None` where they do not. Errors that straight
/// lines or monotone cubics between the nodes cannot draw are no fault of the readings: these are judged by
/// the curve that bends most, and the errors found are as uncertain as the curve in use leaves them.
fn contradiction(
    plan: &Plan,
    found: &Identified,
    observations: &[Observation],
) -> Result<Option<(Scattered, Snooped)>, IdentifyError> {
    if plan.shape != Shape::Spline {
        let smooth = Plan {
            shape: Shape::Spline,
            ..plan.clone()
        };
        if let Ok(found) = smooth.identify(observations) {
            return contradiction(&smooth, &found, observations);
        }
    }
    let Some(scatter) = found.scatter(observations) else {
        return Ok(None);
    };
    let snooped = plan.snoop(observations)?;
    let is_sound = snooped.found.is_empty() && found.scattered(observations).is_none();
    Ok((!is_sound).then_some((scatter, snooped)))
}

/// The errors that are not looked for.
fn without_effect(plan: &Plan) -> Vec<ErrorName> {
    let pairs = Axis::ALL
        .into_iter()
        .flat_map(|axis| Axis::ALL.map(|it| (axis, it)));
    let names =
        pairs.flat_map(|(axis, it)| [ErrorName::Along(axis, it), ErrorName::About(axis, it)]);
    let is_planned = |name: &ErrorName| plan.functions.iter().any(|it| it.name == *name);
    names.filter(|it| !is_planned(it)).collect()
}

fn references(read: &VolumeLog) -> Vec<Celsius> {
    let shown = read.references.iter().flat_map(|it| &it.temperatures_c);
    shown.copied().map(Celsius).collect()
}

/// What is to be found, and from what; lines that are not whole are left out. `None` when something
/// is called what it is not.
fn plan_of(
    entry: &VolumePlanEntry,
    read: &VolumeLog,
    shape: Shape,
) -> Option<(Plan, Vec<Observation>)> {
    let whole: Vec<_> = whole_of(entry, read).collect();
    let mut observations = Vec::new();
    for (run, it) in whole.iter().enumerate() {
        let own = read
            .readings
            .iter()
            .filter(|reading| reading.line == it.line);
        for reading in own {
            observations.push(reading.observation(run)?);
        }
    }
    let functions = entry.functions.iter().map(|text| {
        let name = error_name(text)?;
        let nodes = &entry.nodes_m[axis_of(name).index()];
        let nodes = nodes.iter().copied().map(Metres).collect();
        Some(FunctionPlan { name, nodes })
    });
    let runs = whole.iter().map(|it| setup(&entry.lines[it.line]));
    let shown = whole
        .iter()
        .map(|it| it.temperatures_c.iter().copied().map(Celsius).collect());
    let plan = Plan {
        chain: entry.chain.parse().ok()?,
        functions: functions.collect::<Option<_>>()?,
        shape,
        squarenesses: SquarenessName::ALL.to_vec(),
        runs: runs.collect(),
        zero: point(entry.zero_m),
        thermal: thermal_of(entry, references(read), shown.collect())?,
    };
    Some((plan, observations))
}

/// The lines that were read whole: a run each.
fn whole_of<'a>(
    entry: &VolumePlanEntry,
    read: &'a VolumeLog,
) -> impl Iterator<Item = &'a LineReadEntry> {
    let lines = entry.lines.len();
    read.whole.iter().filter(move |it| it.line < lines)
}

fn setup(line: &LineEntry) -> RunSetup {
    RunSetup {
        offset: true,
        alignment: line.angle.map(|angle| Alignment { angle, factor: 1.0 }),
    }
}

fn thermal_of(
    entry: &VolumePlanEntry,
    references: Vec<Celsius>,
    runs: Vec<Vec<Celsius>>,
) -> Option<ThermalPlan> {
    if entry.expansions.is_empty() && entry.bends.is_empty() {
        return Some(ThermalPlan::default());
    }
    let expansions = entry.expansions.iter().map(|it| {
        Some(ExpansionPlan {
            axis: Axis::of_letter(it.axis)?,
            thermometers: it.thermometers.clone(),
        })
    });
    let bends = entry.bends.iter().map(|it| {
        Some(BendPlan {
            axis: Axis::of_letter(it.axis)?,
            towards: Axis::of_letter(it.towards)?,
            over: it.over,
            under: it.under,
            low: Metres(it.low_m),
            high: Metres(it.high_m),
            // Films and supports shift a slide sideways too.
            sideways: false,
            seen_from: it.seen_from_m.map(point),
        })
    });
    Some(ThermalPlan {
        references,
        runs,
        u: entry.thermometer_u_k,
        expansions: expansions.collect::<Option<_>>()?,
        bends: bends.collect::<Option<_>>()?,
        fixed: point(entry.fixed_m),
    })
}

/// At the tool in use, over places all over the volume.
fn largest_u(entry: &VolumePlanEntry, found: &Identified, shown: &[Celsius]) -> Metres {
    let u_at = |at| {
        let u = found.standard_uncertainty(at, point(entry.tool_m), shown);
        u.map_or(Metres::ZERO, |it| it.distance())
    };
    grid(entry).map(u_at).fold(Metres::ZERO, Metres::max)
}
