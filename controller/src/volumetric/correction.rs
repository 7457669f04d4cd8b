//! What the cyclic engine adds to each set-point of three axes (system S4).
//!
//! In every period: detectors → displacement from the reference, freed of the beam's drift and of
//! what a detector beside its slide's zero sees of tilts → less what the memories keep → feed, so that
//! nothing jumps → model, with roll and temperatures → exact inverse. Size and rate are limited by the engine ([`machine::engine::CorrectionLimits`]), which also
//! slews from one correction to the next; that the rate is enough at the axes' full speed is proven
//! when the correction is made. Nothing is allocated in a period.
//!
//! The positions of detectors with channels are those of the last SYNC although their samples may be some SYNCs
//! old: a reference is wrong by its slope times the way since then. A picture is some tenths of a second old: its position
//! is where the axis was when it was asked for ([`trail`]).

mod sources;
mod trail;
mod uncertainty;

use trail::Trail;

use core::any::Any;

use compensator::volumetric::function::Function;
use compensator::volumetric::identify::{IdentifiedBend, IdentifiedExpansion};
use compensator::volumetric::model::{
    AxisErrors, Conditions, ErrorCovariance, Machine as Model, Squareness, ThermalBend,
    VolumetricModel,
};
use compensator::volumetric::online::{
    AxisMonitor, BeamReference, DetectorLever, EndOfTravel, Feed, FeedStatus, Influences, Memories,
    MovingState, RollMonitor,
};
use compensator::volumetric::{Axis, NoCorrection, Point};
use units::{Celsius, Metres, Quantity, Radians};

use crate::config::MachineConfig;
use crate::volumetric::VolumetricFailure;
use crate::volumetric::inputs::{
    DetectorPlace, RollReader, repeats_of, repeats_of_module, slide_of,
};
use crate::volumetric::limits;
use crate::volumetric::settings::{
    eye, feed_settings, influences, point_of_mm, roll_max, thermal, volume_axis, volumetric_chain,
    work_volume,
};
use crate::volumetric::thermometers::Thermometers;
use crate::volumetric::{
    BeamConfig, BeamsConfig, BendConfig, DetectorConfig, FeedConfig, OneOrMore, ReactionName,
    RollConfig, VolumetricConfig,
};
use machine::engine::{AXES_MAX, Corrected, Correction, Lack, Observed, PerAxis, Validity};

/// As what a machine was calibrated: its errors, and what its detectors read then.
#[derive(Clone, Debug, Default)]
pub struct VolumetricState {
    /// The error functions of x, y, z.
    pub axes: [AxisErrors; 3],
    /// The squarenesses.
    pub squareness: Squareness,
    /// How sure both are together, where that is known.
    pub covariance: Option<ErrorCovariance>,
    /// Guides that bend, of those in the configuration.
    pub bends: Vec<IdentifiedBend>,
    /// Expansions of scales, in place of those in the configuration.
    pub expansions: Vec<IdentifiedExpansion>,
    /// What the detectors of each axis read; needed for each beam of the configuration.
    pub beams: [Option<BeamReference>; 3],
    /// What the roll detectors of x, y and z read along their axis; needed where there are some.
    pub rolls: [Option<Function<Radians>>; 3],
    /// What the thermometers showed, in the order of the configuration.
    pub temperatures: Vec<Celsius>,
    /// What is to be kept although it deviates.
    pub memories: Memories,
}

/// One beam, and where what its detectors show stands.
#[derive(Clone, Debug)]
struct WatchedBeam {
    monitor: AxisMonitor,
    slider: DetectorPlace,
    end: Option<DetectorPlace>,
    /// Where the detector sits on the slide: there it sees the slide's tilts too.
    lever: DetectorLever,
    /// Where the axis was when the slide's detector saw what it showed last.
    position: Metres,
}

/// The roll of one slide.
#[derive(Clone, Debug)]
struct WatchedRoll {
    axis: Axis,
    reader: RollReader,
    monitor: RollMonitor,
}

/// Corrects three axes by what is known of them and seen of them.
#[derive(Clone, Debug)]
pub struct VolumetricCorrection {
    model: VolumetricModel,
    tool: Point,
    beams: [Option<WatchedBeam>; 3],
    rolls: [Option<WatchedRoll>; 3],
    thermometers: Option<Thermometers>,
    temperatures: Vec<Celsius>,
    influences: Influences,
    memories: Memories,
    /// Where the axes were when pictures were taken.
    trail: Trail,
    /// When what is seen is nothing the model was proven for.
    reaction: Option<ReactionName>,
    /// Of displacements of x, y and z by detectors that are believed.
    u_displacement: [Metres; 3],
    u_roll: [Radians; 3],
    /// For which command it gave a correction last, and as what the machine was then.
    given: Option<(Point, Conditions)>,
}

impl VolumetricCorrection {
    /// For the machine of `config`, calibrated as `state`. Its axes x, y, z must be those of the
    /// engine, in this order.
    ///
    /// # Errors
    /// When the configuration has no work volume, a detector has no reference, or the errors
    /// cannot be compensated within the limits.
    pub fn new(config: &MachineConfig, state: VolumetricState) -> Result<Self, VolumetricFailure> {
        let own = config.volumetric.as_ref().ok_or(VolumetricFailure::None)?;
        let (expected, seen) = (own.temperature.len(), state.temperatures.len());
        if seen != expected {
            return Err(VolumetricFailure::Temperatures { seen, expected });
        }
        let model = limits::within(model(own, &state)?, config, own, &state.temperatures)?;
        let model = model.with_covariance(state.covariance);
        let mut beams = [None, None, None];
        for (axis, beam) in Axis::ALL.into_iter().zip(own.beam.each()) {
            if let Some(beam) = beam {
                let reference = state.beams[axis.index()].clone();
                let reference = reference.ok_or(VolumetricFailure::NoReference { axis })?;
                let lever = lever(
                    axis,
                    slide_of(beam)?,
                    &model.machine().thermal.bends,
                    &state.temperatures,
                );
                beams[axis.index()] = Some(watched_beam(config, own, beam, reference, lever)?);
            }
        }
        let mut rolls = [None, None, None];
        for ((watched, roll), reference) in rolls.iter_mut().zip(own.rolls()).zip(state.rolls) {
            if let Some(roll) = roll {
                *watched = Some(watched_roll(config, own, roll, reference)?);
            }
        }
        let thermometers = match &*own.temperature {
            [] => None,
            each => {
                let thermal = &model.machine().thermal;
                Some(Thermometers::new(config, each, feed(own)?, thermal))
            }
        };
        Ok(Self {
            model,
            tool: point_of_mm(own.tool_offset_mm),
            beams,
            rolls,
            thermometers,
            temperatures: state.temperatures,
            influences: influences(&own.influence)?,
            memories: state.memories,
            trail: Trail::default(),
            reaction: own.feed.as_ref().map(|it| it.reaction),
            u_displacement: u_displacement(own),
            u_roll: u_roll(own),
            given: None,
        })
    }

    /// The same by the tables alone: what the machine would do without its detectors and
    /// thermometers.
    ///
    /// # Errors
    /// As [`VolumetricCorrection::new`].
    pub fn by_tables(
        config: &MachineConfig,
        state: VolumetricState,
    ) -> Result<Self, VolumetricFailure> {
        let mut blind = config.clone();
        if let Some(own) = &mut blind.volumetric {
            own.beam = BeamsConfig::default();
            own.roll = OneOrMore::default();
            (own.temperature, own.bend) = (Vec::new(), Vec::new());
        }
        let state = VolumetricState {
            axes: state.axes,
            squareness: state.squareness,
            covariance: state.covariance,
            ..VolumetricState::default()
        };
        Self::new(&blind, state)
    }

    /// The model in use.
    pub const fn model(&self) -> &VolumetricModel {
        &self.model
    }

    /// What the detectors say at `actual`, as it enters the model.
    fn moving_state(&mut self, observed: &Observed<'_>, actual: Point) -> MovingState {
        let mut state = MovingState::default();
        self.trail.note(observed.now, actual);
        // Tilts come first: a detector beside its slide's zero sees them too, also those that are kept.
        let mut whole = [Radians::ZERO; 3];
        for roll in self.rolls.iter_mut().flatten() {
            let (position, k) = (actual.along(roll.axis), roll.axis.index());
            let read = roll.reader.read(observed);
            let monitor = &mut roll.monitor;
            state.roll[k] = monitor.advance(observed.now, position, read, &self.memories);
            whole[k] = monitor.whole();
        }
        for axis in Axis::ALL {
            let Some(beam) = &mut self.beams[axis.index()] else {
                continue;
            };
            let slider = beam.slider.shown(observed);
            let end = beam.end.and_then(|it| it.shown(observed));
            let position = self.trail.position(axis, slider.as_ref(), actual);
            beam.position = position;
            let roll = whole[axis.index()];
            let seen = beam.monitor.advance(
                observed.now,
                position,
                (slider.as_ref(), end.as_ref()),
                beam.lever.seen(position, roll, &self.temperatures),
                &self.memories,
            );
            let factors = &self.influences.of[axis.index()];
            state.sideways[axis.index()] =
                core::array::from_fn(|k| seen[k] * factors[k].at(actual));
        }
        state
    }

    /// When what is seen is not what the model was proven for.
    const fn without(&self) -> Corrected {
        let validity = match self.reaction {
            Some(ReactionName::Hold) | None => Validity::Hold,
            Some(ReactionName::FadeOut) => Validity::FadeOut,
            Some(ReactionName::Stop) => {
                Validity::Stop("detectors report more than the correction was proven for")
            }
        };
        nothing(validity)
    }
}

/// No offset, and why: how far that is from right nobody knows.
const fn nothing(validity: Validity) -> Corrected {
    Corrected {
        offset: [Metres(0.0); AXES_MAX],
        uncertainty: [Metres(f64::NAN); AXES_MAX],
        validity,
    }
}

impl Correction for VolumetricCorrection {
    fn as_any(&self) -> Option<&dyn Any> {
        Some(self)
    }

    fn take_over(&mut self, before: &dyn Any) {
        self.go_on_from(before);
    }

    fn correct(&mut self, observed: &Observed<'_>) -> Corrected {
        self.given = None;
        let (&[x, y, z], &[x_now, y_now, z_now]) = (observed.nominal, observed.actual) else {
            return nothing(Validity::Stop("the engine does not move three axes"));
        };
        let (target, actual) = (Point::new(x, y, z), Point::new(x_now, y_now, z_now));
        if let Some(thermometers) = &mut self.thermometers {
            let shown = thermometers.advance(observed);
            self.temperatures.copy_from_slice(shown);
        }
        let state = self.moving_state(observed, actual);
        let validity = match Lack::worst(self.statuses()) {
            None => Validity::Valid,
            Some(lack) if matches!(lack.status, FeedStatus::Stop(_)) => {
                return nothing(Validity::Lost(lack));
            }
            Some(lack) => Validity::Without(lack),
        };
        let Ok(now) = self.model.conditions(self.tool, &self.temperatures, &state) else {
            return self.without();
        };
        // An axis at the end of the volume is some counts beyond it: the end's correction holds there.
        let reach = self.model.limits().size;
        let Ok(inside) = self.model.machine().volume.nearest_within(target, reach) else {
            return nothing(Validity::Stop("the path leaves the calibrated volume"));
        };
        match self.model.command(inside, &now) {
            Ok(command) => {
                self.given = Some((command, now));
                Corrected {
                    offset: per_axis(command - inside),
                    uncertainty: self.uncertainty(command, &now),
                    validity,
                }
            }
            Err(NoCorrection::Outside { .. }) => {
                nothing(Validity::Stop("the path leaves the calibrated volume"))
            }
            Err(NoCorrection::TooLarge { .. }) => {
                nothing(Validity::Stop("the deviation exceeds its limit"))
            }
        }
    }
}

/// `noise_max` is how far two samples can be apart: so many standard deviations. What is stated
/// where nobody says more of a detector.
const NOISE_RANGE: f64 = 3.0;

fn per_axis(point: Point) -> PerAxis<Metres> {
    let mut values = [Metres::ZERO; AXES_MAX];
    for axis in Axis::ALL {
        values[axis.index()] = point.along(axis);
    }
    values
}

/// Of each slide's displacement by its own beam; of one without a beam by the worst of the others.
fn u_displacement(config: &VolumetricConfig) -> [Metres; 3] {
    let of = |it: &BeamConfig| {
        let noise_um = it.on_the_slide().map_or(0.0, |it| it.noise_max_um());
        Metres::from_um(it.standard_uncertainty_um.unwrap_or(noise_um / NOISE_RANGE))
    };
    each_or_worst(config.beam.each().map(|it| it.map(of)))
}

/// Likewise of its roll.
fn u_roll(config: &VolumetricConfig) -> [Radians; 3] {
    let of = |it: &RollConfig| {
        let noise_arcsec = it.noise_max_arcsec / NOISE_RANGE;
        Radians::from_arcsec(it.standard_uncertainty_arcsec.unwrap_or(noise_arcsec))
    };
    each_or_worst(config.rolls().map(|it| it.map(of)))
}

fn each_or_worst<Q: Quantity>(each: [Option<Q>; 3]) -> [Q; 3] {
    let worst = each.iter().flatten().copied().fold(Q::ZERO, Quantity::max);
    each.map(|it| it.unwrap_or(worst))
}

fn feed(config: &VolumetricConfig) -> Result<&FeedConfig, VolumetricFailure> {
    let section = "feed";
    let missing = VolumetricFailure::NotConfigured { section };
    config.feed.as_ref().ok_or(missing)
}

fn model(config: &VolumetricConfig, state: &VolumetricState) -> Result<Model, VolumetricFailure> {
    let mut thermal = thermal(config, &state.temperatures);
    for expansion in &state.expansions {
        expansion.apply(&mut thermal.channels);
    }
    thermal.bends = bends(config, state)?;
    Ok(Model {
        chain: volumetric_chain(config)?,
        volume: work_volume(config)?,
        axes: state.axes.clone(),
        squareness: state.squareness,
        thermal,
        tool_max: Metres::from_mm(config.tool_max_mm),
        displacement_max: Metres::from_um(config.compensation.displacement_max_um),
        roll_max: roll_max(config),
    })
}

/// Where the detector on the slide of `axis` sits, and what tilts that slide beyond `references`.
pub(super) fn lever(
    axis: Axis,
    detector: DetectorConfig<'_>,
    bends: &[ThermalBend],
    references: &[Celsius],
) -> DetectorLever {
    let place = point_of_mm(detector.place_mm());
    DetectorLever::new(axis, place, bends, references)
}

/// The bends found, within what the configuration permits.
pub(super) fn bends(
    config: &VolumetricConfig,
    state: &VolumetricState,
) -> Result<Vec<ThermalBend>, VolumetricFailure> {
    let section = "bend";
    let bend = |found: &IdentifiedBend| {
        let (axis, towards) = (found.plan.axis, found.plan.towards);
        let is_this =
            |it: &&BendConfig| (volume_axis(it.axis), volume_axis(it.towards)) == (axis, towards);
        let own = config.bend.iter().find(is_this);
        let own = own.ok_or(VolumetricFailure::NotConfigured { section })?;
        let is_watched = config.beam.each()[axis.index()].is_some();
        Ok(found.thermal_bend(own.gradient_max_k, is_watched))
    };
    state.bends.iter().map(bend).collect()
}

fn watched_beam(
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
    beam: &BeamConfig,
    reference: BeamReference,
    lever: DetectorLever,
) -> Result<WatchedBeam, VolumetricFailure> {
    let axis = lever.axis();
    let common = feed(volumetric)?;
    let detector = |it| eye(it).map_err(|source| VolumetricFailure::Detector { axis, source });
    let feed = |it| Feed::new(feed_settings(common, repeats_of(config, it)));
    let end = match beam.at_the_end() {
        Some(it) => Some(EndOfTravel {
            detector: detector(it)?,
            feed: feed(it),
        }),
        None => None,
    };
    let slide = slide_of(beam)?;
    Ok(WatchedBeam {
        monitor: AxisMonitor::new(axis, detector(slide)?, end, reference, feed(slide)),
        slider: DetectorPlace::of(config, slide),
        end: beam.at_the_end().map(|it| DetectorPlace::of(config, it)),
        lever,
        position: Metres(0.0),
    })
}

fn watched_roll(
    config: &MachineConfig,
    volumetric: &VolumetricConfig,
    roll: &RollConfig,
    reference: Option<Function<Radians>>,
) -> Result<WatchedRoll, VolumetricFailure> {
    let repeats = repeats_of_module(config, &roll.analog);
    let settings = feed_settings(feed(volumetric)?, repeats);
    let reference = reference.ok_or(VolumetricFailure::NoRollReference)?;
    let (axis, feed) = (volume_axis(roll.axis), Feed::new(settings));
    Ok(WatchedRoll {
        axis,
        reader: RollReader::new(config, roll)?,
        monitor: RollMonitor::new(axis, reference, feed),
    })
}
