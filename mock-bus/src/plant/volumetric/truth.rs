//! What no device knows about a three-axis machine: for tests and reports that judge.

use units::{Celsius, Metres, Radians, Time};

use super::Volumetric;
use super::rigid::Vector;
use crate::plant::truth::Truth;

/// What the hand that set a line up has left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineTruth {
    /// The beam against the line.
    pub misalignment: Radians,
    /// The straightedge against the line, in the direction across that is measured.
    pub slope: Radians,
}

/// A place, or a displacement: x, y, z.
pub type Point = [Metres; 3];

/// The six error motions of one slide, of the point of it that is in the machine's zero when
/// all axes are at 0. What is off along the axis belongs to its coordinate: positive takes the
/// tool farther along the workpiece. The rest belongs to the slide itself, also to one that
/// carries the workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorMotion {
    /// Along x, y, z.
    pub shift: Point,
    /// About x, y, z; the turn about x comes first, then about y, then about z, all by fixed
    /// axes.
    pub turn: [Radians; 3],
}

/// A look at a three-axis machine behind all sensors. Axes are numbered 0 (x), 1 (y), 2 (z);
/// scale positions count from each scale's own zero, a reference mark.
#[derive(Clone, Copy, Debug)]
pub struct VolumetricTruth<'a> {
    machine: &'a Volumetric,
    now: Time,
}

const fn metres([x, y, z]: Vector) -> Point {
    [Metres(x), Metres(y), Metres(z)]
}

fn values(point: Point) -> Vector {
    point.map(Metres::value)
}

impl<'a> Truth<'a> {
    /// The three axes, where the machine has them.
    pub fn volumetric(&self) -> Option<VolumetricTruth<'a>> {
        let plant = self.plant;
        let volumetric = plant.machine.of::<Volumetric>()?;
        Some(VolumetricTruth::new(volumetric, plant.now))
    }
}

impl<'a> VolumetricTruth<'a> {
    const fn new(machine: &'a Volumetric, now: Time) -> Self {
        Self { machine, now }
    }

    /// The same machine at another time: its errors are functions of time, whatever it does.
    /// The scale positions stay those of the look.
    #[must_use]
    pub const fn at(self, now: Time) -> Self {
        Self { now, ..self }
    }

    /// Where the scales are read, not rounded.
    pub fn scales(&self) -> Point {
        metres(self.machine.scales_m(self.now))
    }

    /// The scale position of an axis's present count 0.
    pub fn count_zero(&self, axis: usize) -> Metres {
        Metres(self.machine.slides[axis].count_zero_m())
    }

    /// Where the tool point is, in the workpiece's frame.
    pub fn tool_point(&self) -> Point {
        self.tool_point_for(self.scales())
    }

    /// Where it would be now at other scale positions.
    pub fn tool_point_for(&self, scales: Point) -> Point {
        metres(self.machine.tool_point_m(values(scales), self.now))
    }

    /// Where a point of the tool would be now at other scale positions, by its place with all axes
    /// at 0.
    pub fn point_for(&self, tool_offset: Point, scales: Point) -> Point {
        let scales_m = values(scales);
        let motions = self.machine.motions(scales_m, self.now);
        let stand = self.machine.chain.stand(scales_m, &motions);
        metres(stand.point(values(tool_offset)))
    }

    /// What the hand that set up the laser's line has left, while one is set up.
    pub fn laser_line(&self) -> Option<LineTruth> {
        self.machine.laser.truth()
    }

    /// Where a machine without errors would have it.
    pub fn nominal_for(&self, scales: Point) -> Point {
        metres(self.machine.chain.nominal(values(scales)))
    }

    /// Tool point minus where a machine without errors would have it.
    pub fn deviation_for(&self, scales: Point) -> Point {
        let (actual, nominal) = (self.tool_point_for(scales), self.nominal_for(scales));
        [0, 1, 2].map(|axis| actual[axis] - nominal[axis])
    }

    /// The error motions of one axis at a scale position.
    pub fn error_motion(&self, axis: usize, scale: Metres) -> ErrorMotion {
        let motion = self.machine.motion(axis, scale.value(), self.now);
        ErrorMotion {
            shift: metres(motion.shift),
            turn: motion.turn.map(Radians),
        }
    }

    /// How far y is turned about z, z about y, and z about x, from square.
    pub fn squareness(&self) -> [Radians; 3] {
        self.machine.chain.squareness().map(Radians)
    }

    /// How far the detector on a slide is off its place, across its travel (x: y and z; y: x
    /// and z; z: x and y).
    pub fn detector_shift(&self, axis: usize, scale: Metres) -> [Metres; 2] {
        let motion = self.machine.motion(axis, scale.value(), self.now);
        let beam = &self.machine.beams[axis];
        beam.detector_m(&motion, super::across(axis)).map(Metres)
    }

    /// How far a beam is off its place, so far from its source.
    pub fn beam_offset(&self, axis: usize, distance: Metres) -> [Metres; 2] {
        let beam = &self.machine.beams[axis];
        beam.offset_m(distance.value(), self.now).map(Metres)
    }

    /// How warm an axis's scale is.
    pub fn scale_temperature(&self, axis: usize) -> Celsius {
        Celsius(self.machine.heat.axis(axis, self.now).scale_c)
    }

    /// By how much a guide is warmer over its neutral plane than under it, in kelvins.
    pub fn gradient_k(&self, axis: usize) -> f64 {
        self.machine.heat.axis(axis, self.now).gradient_k
    }
}
