//! Simulated machines for the tests of this folder: smooth error motions, measured as a machine does
//! it, with as many readings along a line as there are nodes.

use core::f64::consts::{PI, TAU};

use units::MetresPerSecond;
use units::portable::{hypot, sin};

use super::*;
use crate::error_table::Limits;
use crate::noise::Noise;
use crate::volumetric::Volume;
use crate::volumetric::function::{Function, Shape};
use crate::volumetric::model::{
    AxisErrors, Conditions, Machine, Squareness, Thermal, VolumetricModel,
};
use crate::volumetric::online::MovingState;

const ARCSEC: f64 = 4.848_137e-6;
/// Nodes that draw the truth.
const FINE: usize = 121;
pub(super) const TOOL: Point = Point::from_mm(0.0, 0.0, -100.0);
pub(super) const ARM: Point = Point::from_mm(100.0, 0.0, -100.0);

/// What kind of machine, and how it is measured.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    pub(super) chain: &'static str,
    pub(super) span_m: [f64; 3],
    /// By axis, how many nodes.
    pub(super) nodes: [usize; 3],
    /// Errors in units of the shipped machine's.
    pub(super) size: f64,
    /// Noise in units of the stated one.
    pub(super) noise: f64,
    /// Stated uncertainties in units of the usual ones.
    pub(super) stated: f64,
    /// Half waves along the travel at most.
    pub(super) waves: usize,
    /// The relative standard uncertainty of every length, which is off by as much on all lines.
    pub(super) in_common: f64,
}

impl Default for Rig {
    fn default() -> Self {
        Self {
            chain: "FXYZ",
            span_m: [0.5, 0.4, 0.3],
            nodes: [11, 9, 7],
            size: 1.0,
            noise: 1.0,
            stated: 1.0,
            waves: 3,
            in_common: 0.0,
        }
    }
}

/// What is stated of a machine and how its lines were really read.
pub(super) struct Stated<'a> {
    pub(super) chain: &'a str,
    /// By line, the arm that is written down.
    pub(super) arm: &'a dyn Fn(usize, &StandardLine) -> Point,
    /// The arm that it really was.
    pub(super) real: &'a dyn Fn(usize, &StandardLine) -> Point,
}

/// A machine with its readings.
pub(super) struct Measured {
    pub(super) truth: VolumetricModel,
    pub(super) design: StandardDesign,
    pub(super) plan: Plan,
    pub(super) observations: Vec<Observation>,
}

impl Rig {
    fn volume(&self) -> Volume {
        Volume::new(Point::ZERO, Point::of(self.span_m)).unwrap()
    }

    pub(super) fn measured(&self, seed: u64) -> Measured {
        self.measured_as(
            seed,
            &Stated {
                chain: self.chain,
                arm: &|_, line| line.tool,
                real: &|_, line| line.tool,
            },
        )
    }

    /// Along the lines that tell a machine as it is stated.
    pub(super) fn measured_as(&self, seed: u64, stated: &Stated<'_>) -> Measured {
        let mut noise = Noise(seed);
        let chain = stated.chain.parse().unwrap();
        let rolls = [true, false, false];
        let design = standard_design(chain, &self.volume(), &[TOOL, ARM], rolls);
        let truth = self.truth(&mut noise);
        let observations = self.observations(&truth, &design, stated, &mut noise);
        let plan = design.plan(self.nodes, Point::ZERO, Shape::Spline);
        Measured {
            truth,
            design,
            plan,
            observations,
        }
    }

    /// Bands of 20 µm, 8 µm, 5″ and 10″ to either side, which are 0 at 0.
    fn truth(&self, noise: &mut Noise) -> VolumetricModel {
        let mut axes: [AxisErrors; 3] = Default::default();
        for axis in Axis::ALL {
            let span = self.span_m[axis.index()];
            let at: Vec<Metres> = (0..FINE)
                .map(|n| Metres(span * n as f64 / (FINE - 1) as f64))
                .collect();
            for k in Axis::ALL {
                let band = if k == axis { 20e-6 } else { 8e-6 };
                let along = self.curve(band, noise);
                let along = self.kept(axis, k, &along).map(Metres);
                let band = if k == axis { 5.0 } else { 10.0 } * ARCSEC;
                let about = self.curve(band, noise);
                let about = fine(&about).map(Radians);
                let own = &mut axes[axis.index()];
                own.along[k.index()] = Some(Function::new(&at, &along, Shape::Spline).unwrap());
                own.about[k.index()] = Some(Function::new(&at, &about, Shape::Spline).unwrap());
            }
        }
        let lean = || Radians(30.0 * ARCSEC * self.size * noise.within(1.0));
        model(
            machine(self.chain, self.volume(), axes, lean),
            Metres::from_um(3000.0),
        )
    }

    /// A polynomial of the third degree and some half waves, as high as the band, over 0 to 1.
    fn curve(&self, band: f64, noise: &mut Noise) -> impl Fn(f64) -> f64 + use<> {
        let powers = [noise.within(1.0), noise.within(2.0), noise.within(4.0)];
        let waves: Vec<[f64; 3]> = (1..=self.waves)
            .map(|order| {
                let order = order as f64;
                let amplitude = (0.65 + noise.within(0.35)) / (order * order);
                [order, amplitude, TAU * noise.uniform()]
            })
            .collect();
        let at = move |u: f64| {
            let bends = powers[1] * u * (u - 1.0) + powers[2] * u * (u - 0.5) * (u - 1.0);
            let wave = |[order, amplitude, phase]: &[f64; 3]| {
                amplitude * (sin(PI * order * u + phase) - sin(*phase))
            };
            powers[0] * u + bends + waves.iter().map(wave).sum::<f64>()
        };
        let values = fine(&at);
        let high = values.iter().copied().fold(f64::MIN, f64::max);
        let low = values.iter().copied().fold(f64::MAX, f64::min);
        let scale = 2.0 * band * self.size / (high - low);
        move |u| at(u) * scale
    }

    /// Straightnesses keep the convention: no line at the nodes.
    fn kept(&self, axis: Axis, along: Axis, curve: &impl Fn(f64) -> f64) -> [f64; FINE] {
        if axis == along {
            return fine(curve);
        }
        let last = self.nodes[axis.index()] - 1;
        let at: Vec<Metres> = (0..=last).map(|n| Metres(n as f64 / last as f64)).collect();
        let values: Vec<Metres> = at.iter().map(|it| Metres(curve(it.value()))).collect();
        let line = straightness(&at, &values, ReferenceLine::LeastSquares).unwrap();
        fine(&|u: f64| curve(u) - line.offset.value() - line.slope.value() * u)
    }

    /// 0.1 µm along and across, 0.3″; unknown zeros, and straightedges that lean by up to 100 µrad.
    fn observations(
        &self,
        truth: &VolumetricModel,
        design: &StandardDesign,
        stated: &Stated<'_>,
        noise: &mut Noise,
    ) -> Vec<Observation> {
        let mut observations = Vec::new();
        let stretched = if self.in_common > 0.0 {
            noise.normal()
        } else {
            0.0
        };
        for (run, line) in design.lines.iter().enumerate() {
            let (zero, lean) = (noise.within(1e-5), noise.within(1e-4));
            let way = line.to - line.from;
            let moved = Axis::ALL
                .into_iter()
                .filter(|it| way.along(*it) != Metres::ZERO);
            let count = moved.map(|it| self.nodes[it.index()]).max().unwrap_or(2);
            let real = StandardLine {
                tool: (stated.real)(run, line),
                ..*line
            };
            for at in line.points(count) {
                let (value, usual) = read(truth, &real, at, lean);
                let u = usual * self.stated;
                let value = value + zero + u * self.noise * noise.normal();
                let common = match line.optics {
                    Optics::Linear => self.in_common * (at - line.from).distance().value(),
                    Optics::Straightness(_) | Optics::Angle(_) => 0.0,
                };
                let (value, u) = (value + stretched * common, hypot(u, common));
                observations.push(Observation {
                    at,
                    tool: (stated.arm)(run, line),
                    run,
                    reading: line.reading(value, u),
                    common,
                    common_of_run: 0.0,
                });
            }
        }
        observations
    }
}

/// What is found of a machine that is known to be as it is drawn between its nodes: no real one is, so that
/// nothing is stated of what it does there.
pub(super) fn as_drawn(plan: &Plan, observations: &[Observation]) -> Identified {
    let design = design::Design::new(plan, observations).unwrap();
    solve::solve(plan, &design, observations).unwrap()
}

fn fine(curve: &impl Fn(f64) -> f64) -> [f64; FINE] {
    core::array::from_fn(|n| curve(n as f64 / (FINE - 1) as f64))
}

/// What the instrument would read, and how sure it usually is.
fn read(truth: &VolumetricModel, line: &StandardLine, at: Point, lean: f64) -> (f64, f64) {
    let moved = |tool: Point| {
        let now = still(truth, line.tool + tool);
        truth.deviation(at, &now).unwrap().array()
    };
    match line.reading(0.0, 1.0) {
        Reading::Length { along, .. } => {
            let way = (at - line.from).distance().value();
            let leaning = if line.optics == Optics::Linear {
                0.0
            } else {
                lean * way
            };
            let seen: f64 = along
                .iter()
                .zip(moved(Point::ZERO))
                .map(|(a, b)| a * b)
                .sum();
            (seen + leaning, 1e-7)
        }
        Reading::Angle { about, .. } => {
            // By the right hand, how a point 0.1 m along the next direction moves on.
            let (next, last) = ((about.index() + 1) % 3, (about.index() + 2) % 3);
            let mut aside = [0.0; 3];
            aside[next] = 0.1;
            let turned = moved(Point::of(aside))[last] - moved(Point::ZERO)[last];
            (turned / 0.1, 0.3 * ARCSEC)
        }
    }
}

/// A machine that neither grows nor is moved by anything, whose axes lean against each other so.
pub(super) fn machine(
    chain: &str,
    volume: Volume,
    axes: [AxisErrors; 3],
    mut lean: impl FnMut() -> Radians,
) -> Machine {
    Machine {
        chain: chain.parse().unwrap(),
        volume,
        axes,
        squareness: Squareness {
            y_to_x: lean(),
            z_to_x: lean(),
            z_to_y: lean(),
            u: [Radians::ZERO; 3],
        },
        thermal: Thermal::default(),
        tool_max: Metres(0.4),
        displacement_max: Metres::ZERO,
        roll_max: Radians::ZERO,
    }
}

/// Its model, which permits deviations up to `size`.
pub(super) fn model(machine: Machine, size: Metres) -> VolumetricModel {
    let limits = Limits {
        size,
        slope: 0.1,
        rate: MetresPerSecond(0.1),
    };
    VolumetricModel::new(machine, limits).unwrap()
}

pub(super) fn still(model: &VolumetricModel, tool: Point) -> Conditions {
    model
        .conditions(tool, &[], &MovingState::default())
        .unwrap()
}
