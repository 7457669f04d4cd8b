//! What the machine's own detectors tell of its lines: straightnesses by the beams, a roll.
//!
//! What is stated of a displacement while the machine works is no statement about a straightness: it has the air of a
//! few samples, how a beam is taken to have moved since its reference, and the width of the spot over what slides have
//! gone aside since. References are means of many samples within minutes. So a straightness counts with the scatter of its
//! means, with the width of the spot over its own size, and with what is stated of references; a roll likewise.

use compensator::uncertainty::combine;
use compensator::volumetric::identify::{
    Observation, Purpose, Reading, ReferenceLine, straightness,
};
use compensator::volumetric::{Axis, Point};
use units::portable::hypot;
use units::{Metres, Radians};

use crate::volumetric::calibrate::Session;
use crate::volumetric::calibrate::plan::nodes;
use crate::volumetric::settings::{beam_drift, point_of_mm, volume_axis};
use crate::volumetric::{AXES, BeamConfig};

/// The standard uncertainty of a straightness by a beam where nobody states any of it: the air along it.
const BEAM_FLOOR: Metres = Metres(0.1e-6);
/// By how much of its size such a reading may be wrong, as a standard uncertainty: the width of the spot, which is known
/// to 1 % either way. It is one error of all readings of a line.
const BEAM_SCALE: f64 = 0.01 / 1.732;
/// The standard uncertainty of a roll that the machine's own detectors read, where nobody states it of them.
const ROLL_FLOOR: Radians = Radians(0.5e-6);
/// By how much of its size such a reading may be wrong: volts per millimetre, likewise.
const ROLL_SCALE: f64 = 0.01;
/// Who states that nothing is uncertain of references means less than a tenth of a nanometre or nanoradian: what readings have in common
/// is never all of their uncertainty.
const LEAST_OWN: f64 = 1e-10;
/// A stop this close to a node is at it.
const AT_A_NODE_M: f64 = 1e-6;

impl Session<'_> {
    /// What the machine's own detectors read of this line when their references were taken;
    /// `None` when they do not read it.
    pub(super) fn by_own_detectors(&self, run: usize) -> Option<Vec<Observation>> {
        match self.lines[run].purpose {
            Purpose::Straightness(axis, along) => self.straightness_by_beam(axis, along, run),
            Purpose::Roll(axis) => self.roll_by_detectors(axis, run),
            Purpose::Positioning(_)
            | Purpose::Tilt(..)
            | Purpose::RollOnLever(_)
            | Purpose::EvenRollOnLever(_)
            | Purpose::Squarenesses => None,
        }
    }

    /// How far the beam had wandered when the line `run` was read there, where a beam read it.
    pub(super) fn wandered(&self, run: usize, it: &Observation) -> Option<[[f64; 2]; 3]> {
        let Purpose::Straightness(axis, _) = self.lines[run].purpose else {
            return None;
        };
        let letter = AXES[axis.index()];
        let mut beams = self.references.content.beams.iter();
        let record = beams.find(|beam| beam.axis == letter)?;
        let mut shift = [[0.0; 2]; 3];
        shift[axis.index()] = record.wandered(it.at.along(axis))?;
        Some(shift)
    }

    fn straightness_by_beam(
        &self,
        axis: Axis,
        along: Axis,
        run: usize,
    ) -> Option<Vec<Observation>> {
        let reference = self.beams[axis.index()].as_ref()?;
        let config = self.config.beam.each()[axis.index()]?;
        let beam = config.on_the_slide()?;
        let record = self.references.content.beams.iter();
        let letter = ['x', 'y', 'z'][axis.index()];
        let record = record.clone().find(|it| it.axis == letter)?;
        let place = axis.others().iter().position(|it| *it == along)?;
        let direction = core::array::from_fn(|k| f64::from(u8::from(k == along.index())));
        let u_mean = record.slider[place].standard_uncertainties_si.as_ref();
        let stops = self.stops_at_nodes(axis, &record.slider[place].positions_m);
        let strayed = stops.iter().map(|(_, at)| reference.slider(*at)[place]);
        let strayed: Vec<Metres> = strayed.collect();
        // How the beam leans, and how far from the middle it meets the detector, is no part of a straightness.
        let positions: Vec<Metres> = stops.iter().map(|it| it.1).collect();
        let shape = straightness(&positions, &strayed, ReferenceLine::LeastSquares).ok()?;
        let chain = self.known.chain();
        let each = stops.into_iter().zip(strayed).zip(shape.deviations);
        let each = each.map(|(((index, position), strayed), deviation)| {
            let u_mean = u_mean.and_then(|it| it.get(index)).copied().unwrap_or(0.0);
            let scale = deviation.value() * BEAM_SCALE;
            let (own, of_end) = (u_straightness(config), self.u_of_end(axis, position));
            let u = combine(&[own.value().max(LEAST_OWN), of_end.value(), u_mean, scale]);
            let at = self.on_axis(axis, position);
            // The slide's tilts act on the detector's place on it alone: not on what an offset of
            // the tool is added to.
            let carried = chain.lever(axis, at, Point::ZERO);
            Observation {
                at,
                tool: point_of_mm(beam.place_mm()) - carried,
                run,
                reading: Reading::Length {
                    along: direction,
                    deviation: strayed * chain.sense(axis),
                    u: Metres(u),
                },
                common: 0.0,
                common_of_run: scale,
            }
        });
        Some(each.collect())
    }

    /// What the noise of the detector at the end makes of a mean that is brought to one place of the beam.
    fn u_of_end(&self, axis: Axis, position: Metres) -> Metres {
        let drift = self.config.beam.each()[axis.index()].and_then(beam_drift);
        let samples = self.config.reference.map_or(0, |it| it.samples);
        let u = self.end_noise[axis.index()].u_of_mean(samples);
        Metres(drift.map_or(0.0, |it| it.fraction(position)) * u)
    }

    fn roll_by_detectors(&self, axis: Axis, run: usize) -> Option<Vec<Observation>> {
        let reference = self.rolls[axis.index()].as_ref()?;
        let record = self.references.content.roll_record(&self.config, axis)?;
        let stops = self.stops_at_nodes(axis, &record.positions_m);
        let u = record.standard_uncertainties_si.as_ref();
        let sense = self.known.chain().sense(axis);
        let first = reference.at(Metres(record.positions_m[0]));
        let own = self.u_roll(axis).value().max(LEAST_OWN);
        let each = stops.into_iter().map(|(index, position)| {
            let u_mean = u.and_then(|it| it.get(index)).copied().unwrap_or(0.0);
            let scale = (reference.at(position) - first).value() * ROLL_SCALE;
            Observation {
                at: self.on_axis(axis, position),
                tool: Point::ZERO,
                run,
                reading: Reading::Angle {
                    about: axis,
                    deviation: reference.at(position) * sense,
                    u: Radians(hypot(hypot(own, u_mean), scale)),
                },
                common: 0.0,
                common_of_run: scale,
            }
        });
        Some(each.collect())
    }

    /// What is stated of references of the roll of `axis`, or else of that roll itself.
    fn u_roll(&self, axis: Axis) -> Radians {
        let mut each = self.config.roll.each().iter();
        let own = each.find(|it| volume_axis(it.axis) == axis);
        let stated = own.and_then(|it| {
            let of_references = it.reference_standard_uncertainty_arcsec;
            of_references.or(it.standard_uncertainty_arcsec)
        });
        stated.map_or(ROLL_FLOOR, Radians::from_arcsec)
    }

    /// Stops that are at nodes, which are not drawn by straight lines; all where none is.
    fn stops_at_nodes(&self, axis: Axis, positions_m: &[f64]) -> Vec<(usize, Metres)> {
        let k = axis.index();
        let low_m = self.config.low_mm[k] * 1e-3;
        let span_m = (self.config.high_mm[k] - self.config.low_mm[k]) * 1e-3;
        let step_m = span_m / (nodes(&self.config, &self.own)[k] - 1) as f64;
        let is_at_node = |position: f64| {
            let steps = (position - low_m) / step_m;
            ((steps - steps.round()) * step_m).abs() < AT_A_NODE_M
        };
        let all = || positions_m.iter().copied().map(Metres).enumerate();
        let at_nodes: Vec<_> = all().filter(|(_, it)| is_at_node(it.value())).collect();
        if at_nodes.len() < 3 {
            return all().collect();
        }
        at_nodes
    }

    /// With the other axes at the low ends of the volume.
    fn on_axis(&self, axis: Axis, position: Metres) -> Point {
        let low = point_of_mm(self.config.low_mm);
        let [x, y, z] = Axis::ALL.map(|it| if it == axis { position } else { low.along(it) });
        Point::new(x, y, z)
    }
}

/// What is stated of references of this beam, or else of a displacement.
fn u_straightness(beam: &BeamConfig) -> Metres {
    let stated = beam.reference_standard_uncertainty_um;
    let stated = stated.or(beam.standard_uncertainty_um);
    stated.map_or(BEAM_FLOOR, Metres::from_um)
}
