//! Three axes on the bench, judged by the plant's truth.

mod frame;

use core::time::Duration;
use std::path::Path;

use compensator::budget::PlacesBudget;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::model::{AxisErrors, Squareness};
use compensator::volumetric::{Axis, Point};
use machine::engine::Live;
use machine::engine::Observed;
use machine::records::{CalibrationRecord, RecordHead};
use mock_bus::plant::VolumetricTruth;
use truestage::Failure;
use truestage::for_tests::VolumetricCalibrated;
use truestage::volumetric::{GeometryContent, WarmUp, WorkVolume};
use truestage::volumetric::{Mover, VolumetricCorrection, VolumetricState};
use units::{Celsius, Metres, Radians, Time};

use crate::{Bench, VOLUMETRIC, random};
use truestage::for_tests::{BendRecord, Edit, import_memory, with_rare_heartbeats};

pub use frame::Frame;

/// What the errors of three axes are called where an axis is named.
pub const GEOMETRY: &str = "volume";
/// Likewise what their detectors read.
pub const REFERENCES: &str = "volume-references";
/// Likewise the displacements that the machine was built with.
const FIRST_MEMORY: &str = "volume-first-memory";

/// How far the axes go.
pub const TRAVEL_MM: [f64; 3] = [500.0, 400.0, 300.0];
/// How far apart what a calibration finds is.
const NODE_MM: f64 = 25.0;
/// How long the tool stands before it is judged.
pub const STAND: Duration = Duration::from_millis(300);

/// Heartbeats so rare that hours without SYNC cost little.
pub fn calm(text: String) -> String {
    with_rare_heartbeats(&text)
}

/// Few readings and short averages, for tests of what is done rather than of how well it is measured.
pub fn quick(text: String) -> String {
    let text = text.edit(
        "step_mm = 25.0\nsamples = 50",
        "step_mm = 50.0\nsamples = 10",
    );
    let text = text.edit(
        "step_mm = 50.0\nsettle_ms = 100.0",
        "step_mm = 50.0\nsettle_ms = 50.0",
    );
    calm(text.edit("average_samples = 60", "average_samples = 20"))
}

/// An error of the tool: along x, y, z.
pub type Off = [Metres; 3];

/// The shipped three axes with a judge.
pub struct Volume {
    /// The machine and its emulation.
    pub bench: Bench,
}

/// How far the tool is off where it stands, and what the correction says of itself there.
#[derive(Clone, Debug)]
pub struct Stood {
    /// By how much it is off.
    pub off: Off,
    /// The standard uncertainties that are stated.
    pub stated: Off,
    /// What makes these: along x, y and z, its places in this order; `None` where nothing is stated.
    pub budget: Option<PlacesBudget<Metres>>,
}

/// A point given in millimetres.
pub fn point_mm(mm: [f64; 3]) -> Point {
    let [x, y, z] = mm.map(Metres::from_mm);
    Point::new(x, y, z)
}

fn each(point: Point) -> Off {
    Axis::ALL.map(|axis| point.along(axis))
}

/// `count` places all over the volume, from number `first` of an endless row.
pub fn spread(first: u32, count: u32) -> Vec<[f64; 3]> {
    let part = |at: u32, ratio: f64| (f64::from(at) * ratio).fract();
    let each = (first + 1..=first + count).map(|at| {
        [
            TRAVEL_MM[0] * part(at, 0.819_172_513),
            TRAVEL_MM[1] * part(at, 0.671_043_607),
            TRAVEL_MM[2] * part(at, 0.549_700_478),
        ]
    });
    each.collect()
}

/// `count` random places all over the volume, each with the same chance; `seed` says which.
pub fn random_places(seed: u64, count: usize) -> Vec<[f64; 3]> {
    let mut state = seed;
    let mut place = || TRAVEL_MM.map(|travel| travel * random(&mut state));
    (0..count).map(|_| place()).collect()
}

/// The same places, from each to the nearest that is left.
pub fn by_short_ways(mut places: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let square = |a: [f64; 3], b: [f64; 3]| -> f64 { (0..3).map(|k| (a[k] - b[k]).powi(2)).sum() };
    let mut way = Vec::with_capacity(places.len());
    let mut here = [0.0; 3];
    loop {
        let left = places.iter().enumerate();
        let nearest = left.min_by(|a, b| square(*a.1, here).total_cmp(&square(*b.1, here)));
        let Some((at, _)) = nearest else {
            return way;
        };
        here = places.swap_remove(at);
        way.push(here);
    }
}

/// How large an error is.
pub fn size([x, y, z]: Off) -> Metres {
    Metres(x.value().hypot(y.value()).hypot(z.value()))
}

/// By how much each of the errors is another one than was expected.
pub fn beyond(errors: &[Off], expected: &[Off]) -> Vec<Off> {
    let pairs = errors.iter().zip(expected);
    pairs
        .map(|(a, b)| core::array::from_fn(|k| a[k] - b[k]))
        .collect()
}

/// The size that 95 % of the errors do not exceed.
///
/// # Panics
/// When there are none.
pub fn percentile_95(errors: &[Off]) -> Metres {
    let mut sizes: Vec<f64> = errors.iter().map(|it| size(*it).value()).collect();
    sizes.sort_by(f64::total_cmp);
    Metres(sizes[(sizes.len() * 95).div_ceil(100) - 1])
}

/// The largest of the errors.
pub fn largest(errors: &[Off]) -> Metres {
    let sizes = errors.iter().map(|it| size(*it));
    sizes.fold(Metres(0.0), |a, b| a.max(b))
}

/// ISO 230-1's way to tell a volumetric error: how far the deviations along x, y and z range, the
/// largest of the three.
pub fn largest_range(errors: &[Off]) -> Metres {
    let range = |k: usize| {
        let along = errors.iter().map(|it| it[k].value());
        let high = along.clone().fold(f64::NEG_INFINITY, f64::max);
        high - along.fold(f64::INFINITY, f64::min)
    };
    Metres((0..3).map(range).fold(0.0, f64::max))
}

/// Whatever failed, in its own words.
///
/// # Panics
/// When it failed.
#[track_caller]
pub fn good<R, F: std::fmt::Display>(result: Result<R, F>) -> R {
    result.unwrap_or_else(|failure| panic!("{failure}"))
}

impl Volume {
    /// The shipped machine, zeroed.
    ///
    /// # Panics
    /// When it does not come up.
    pub fn zeroed(
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: impl Fn(String) -> String,
    ) -> Self {
        let mut bench = Bench::shaped(&VOLUMETRIC, seed, machine, emulated);
        good(bench.machine.start());
        good(bench.machine.volumetric().unwrap().zero());
        Self { bench }
    }

    /// A machine that `fresh` makes, just switched on, after it has calibrated itself on another day as it does: cold, and
    /// again after `warm_up`.
    ///
    /// # Panics
    /// When that fails.
    pub fn calibrated(fresh: impl Fn() -> Self, warm_up: WarmUp) -> (Self, VolumetricCalibrated) {
        let mut before = fresh();
        let made = good(before.calibrate(warm_up));
        let later = fresh();
        later.inherit(&before);
        (later, made)
    }

    /// Calibrates it, cold and again after `warm_up`.
    ///
    /// # Errors
    /// When that fails.
    pub fn calibrate(&mut self, warm_up: WarmUp) -> Result<VolumetricCalibrated, Failure> {
        let store = self.bench.store.clone();
        let mut hand = self.bench.emulated.clone();
        self.work().calibrate(&store, warm_up, None, &mut hand)
    }

    /// Stores what `other` has stored: the same machine on another day.
    ///
    /// # Panics
    /// When files cannot be copied.
    pub fn inherit(&self, other: &Self) {
        other.bequeath(self.bench.store.root());
    }

    /// Copies what it has stored to the store at `root`.
    ///
    /// # Panics
    /// When files cannot be copied.
    pub fn bequeath(&self, root: &Path) {
        for folder in ["calibrations", "active"] {
            let from = self.bench.store.root().join(folder);
            let to = root.join(folder);
            std::fs::create_dir_all(&to).expect("there is room");
            for file in std::fs::read_dir(from).expect("it is there") {
                let file = file.expect("it is there");
                let copied = std::fs::copy(file.path(), to.join(file.file_name()));
                copied.expect("there is room");
            }
        }
    }

    /// A look behind all sensors.
    ///
    /// # Panics
    /// Never: the machine has three axes.
    pub fn truth<R>(&self, look: impl FnOnce(VolumetricTruth<'_>) -> R) -> R {
        let simulation = self.bench.emulated.simulation();
        look(simulation.truth().volumetric().expect("three axes"))
    }

    /// By how much the tool is off `target` now.
    pub fn off(&self, target: Point) -> Off {
        self.truth(|truth| {
            let (is, should) = (truth.tool_point(), truth.nominal_for(each(target)));
            core::array::from_fn(|k| is[k] - should[k])
        })
    }

    /// By how much the tool would be off, were nothing corrected.
    pub fn uncorrected(&self, places: &[[f64; 3]]) -> Vec<Off> {
        self.uncorrected_at(places, self.bench.machine.now())
    }

    /// The same at another time: errors and heat do not depend on what the machine does.
    pub fn uncorrected_at(&self, places: &[[f64; 3]], now: Time) -> Vec<Off> {
        self.truth(|truth| {
            let truth = truth.at(now);
            let of = |mm: &[f64; 3]| truth.deviation_for(each(point_mm(*mm)));
            places.iter().map(of).collect()
        })
    }

    /// What a perfect calibration would find now, stored as the errors in use.
    ///
    /// # Panics
    /// When it cannot be stored.
    pub fn know_errors(&self) -> String {
        let (axes, squareness) = self.true_errors();
        let config = &self.bench.loaded.config.volumetric;
        let thermometers = config.as_ref().expect("a volume").temperature.len();
        // The sensors' own offsets are nobody's business: nothing but their change counts.
        let temperatures = self.truth(|truth| {
            let each = (0..thermometers).map(|it| {
                let side = if it % 2 == 0 { 0.5 } else { -0.5 };
                let scale = truth.scale_temperature(it / 2);
                Celsius(scale.value() + side * truth.gradient_k(it / 2))
            });
            each.collect::<Vec<_>>()
        });
        let mut content = GeometryContent::new(&axes, &squareness, &temperatures);
        content.bends = self.true_bends();
        let head = RecordHead {
            axis: GEOMETRY.into(),
            ..self.bench.machine.this_machine("x")
        };
        let content = content;
        let record = CalibrationRecord { head, content };
        let id = self.bench.store.save(&record).expect("there is room");
        let activated = self.bench.store.activate(GEOMETRY, &id);
        activated.expect("it was just stored");
        id
    }

    /// How the guides bend per kelvin: what a cold and a warm calibration would find.
    fn true_bends(&self) -> Vec<BendRecord> {
        // Soon enough that nothing else has begun by then; the plant is exact.
        let later = self.bench.machine.now() + Duration::from_secs(60);
        let towards = [2, 2, 1];
        self.truth(|truth| {
            let each = (0..3).map(|axis| {
                // The slope at the beginning of the arc is 4 h/L, about the third direction.
                let about = 3 - axis - towards[axis];
                let sense = if (axis + 1) % 3 == towards[axis] {
                    1.0
                } else {
                    -1.0
                };
                let tilt = |truth: VolumetricTruth<'_>| {
                    truth.error_motion(axis, Metres::ZERO).turn[about].value()
                };
                let warmer = truth.at(later);
                let kelvin = warmer.gradient_k(axis) - truth.gradient_k(axis);
                let travel = TRAVEL_MM[axis] * 1e-3;
                let slope = sense * (tilt(warmer) - tilt(truth)) / kelvin;
                let letters = ['x', 'y', 'z'];
                BendRecord {
                    axis: letters[axis],
                    towards: letters[towards[axis]],
                    over: 2 * axis,
                    under: Some(2 * axis + 1),
                    low_m: 0.0,
                    high_m: travel,
                    bow_m_per_k: slope * travel / 4.0,
                    standard_uncertainty_m_per_k: 0.0,
                    sideways: false,
                }
            });
            each.collect()
        })
    }

    /// The errors as the plant has them now.
    ///
    /// # Panics
    /// Never: nodes of a plant are sound.
    pub fn true_errors(&self) -> ([AxisErrors; 3], Squareness) {
        self.truth(|truth| {
            let axes = [0, 1, 2].map(|axis| {
                let count = (TRAVEL_MM[axis] / NODE_MM) as u32;
                let nodes: Vec<Metres> = (0..=count)
                    .map(|at| Metres::from_mm(f64::from(at) * NODE_MM))
                    .collect();
                let motions: Vec<_> = nodes
                    .iter()
                    .map(|it| truth.error_motion(axis, *it))
                    .collect();
                let along = core::array::from_fn(|k| {
                    let values: Vec<Metres> = motions.iter().map(|it| it.shift[k]).collect();
                    Some(Function::new(&nodes, &values, Shape::Spline).expect("sound"))
                });
                let about = core::array::from_fn(|k| {
                    let values: Vec<Radians> = motions.iter().map(|it| it.turn[k]).collect();
                    Some(Function::new(&nodes, &values, Shape::Spline).expect("sound"))
                });
                AxisErrors { along, about }
            });
            let [y_to_x, z_to_x, z_to_y] = truth.squareness();
            let squareness = Squareness {
                y_to_x,
                z_to_x,
                z_to_y,
                u: [Radians(0.0); 3],
            };
            (axes, squareness)
        })
    }

    /// Imports, as the first memory, a design by which the x guide bows upwards by so much in its middle.
    ///
    /// # Panics
    /// When it cannot be stored.
    pub fn remember_bow(&self, height: Metres) {
        let row = |node: u32| {
            let share = f64::from(node) / 20.0;
            let up = height.um() * 4.0 * share * (1.0 - share);
            format!("x,z,{},{up}\n", TRAVEL_MM[0] * share)
        };
        let rows: String = (0..=20).map(row).collect();
        self.remember(&format!("axis,along,position_mm,displacement_um\n{rows}"));
    }

    /// Imports a designed shape as the first memory.
    ///
    /// # Panics
    /// When it cannot be stored.
    pub fn remember(&self, csv: &str) {
        let head = RecordHead {
            axis: FIRST_MEMORY.into(),
            ..self.bench.machine.this_machine("x")
        };
        let (config, store) = (&self.bench.loaded.config, &self.bench.store);
        good(import_memory(config, store, head, (csv, "shape.csv")));
    }

    /// What its three axes do.
    ///
    /// # Panics
    /// Never: the machine that ships has them.
    pub fn work(&mut self) -> WorkVolume<'_> {
        self.bench.machine.volumetric().expect("it ships with them")
    }

    /// The machine corrected by all that is stored, and that state.
    ///
    /// # Panics
    /// When nothing is stored, or it cannot be applied.
    pub fn corrected(&mut self) -> (Mover, VolumetricState) {
        let store = self.bench.store.clone();
        let stored = good(self.work().state(&store));
        let (state, _) = stored.expect("it was stored");
        self.corrected_by(state)
    }

    /// Likewise, corrected by `state`.
    ///
    /// # Panics
    /// When it cannot be applied.
    pub fn corrected_by(&mut self, state: VolumetricState) -> (Mover, VolumetricState) {
        let correction = VolumetricCorrection::new(&self.bench.loaded.config, state.clone());
        let correction = correction.unwrap_or_else(|failure| panic!("{failure}"));
        let mover = self.work().mover(Box::new(correction));
        let mut mover = good(mover);
        good(self.work().correct(&mut mover, true));
        (mover, state)
    }

    /// What a move to `target` states of its tool, with errors that a perfect calibration would find and no guide that bends.
    ///
    /// # Panics
    /// When it does not get there.
    pub fn stated_without_bends(&mut self, target: [f64; 3]) -> Off {
        self.know_errors();
        let store = self.bench.store.clone();
        good(self.work().reference(&store));
        let (_, mut state) = self.corrected();
        state.bends.clear();
        let (mut mover, _) = self.corrected_by(state);
        let rest = Duration::from_millis(200);
        let live = good(self.work().drive_to(&mut mover, point_mm(target), rest));
        core::array::from_fn(|k| live.uncertainty[k])
    }

    /// Brings the tool to each place, stands there and says by how much it is off; `along` gets
    /// what is off on the way at some set-points, as if the drives were there already.
    pub fn visit(
        &mut self,
        mover: &mut Mover,
        places: &[[f64; 3]],
        along: &mut Vec<([f64; 3], Off)>,
    ) -> Vec<Off> {
        let stood = self.stand_at(mover, places, along);
        stood.into_iter().map(|it| it.off).collect()
    }

    /// The same, with what the correction says of itself.
    pub fn stand_at(
        &mut self,
        mover: &mut Mover,
        places: &[[f64; 3]],
        along: &mut Vec<([f64; 3], Off)>,
    ) -> Vec<Stood> {
        let emulated = self.bench.emulated.clone();
        let mut watch = |live: &Live| {
            if !live.cycle.is_multiple_of(64) {
                return;
            }
            let simulation = emulated.simulation();
            let truth = simulation.truth().volumetric().expect("three axes");
            let nominal: Off = core::array::from_fn(|k| live.nominal[k]);
            let command = core::array::from_fn(|k| live.nominal[k] + live.offset[k]);
            let (is, should) = (truth.tool_point_for(command), truth.nominal_for(nominal));
            let off = core::array::from_fn(|k| is[k] - should[k]);
            along.push((nominal.map(|it| it.mm()), off));
        };
        let stand = |mm: &[f64; 3]| {
            let target = point_mm(*mm);
            let machine = &mut self.bench.machine;
            let live = good(
                machine
                    .volumetric()
                    .unwrap()
                    .drive_watched(mover, target, STAND, &mut watch),
            );
            let correction = mover.engine().correction();
            let correction = correction.and_then(|it| it.downcast_ref::<VolumetricCorrection>());
            Stood {
                off: self.off(target),
                stated: core::array::from_fn(|k| live.uncertainty[k]),
                budget: correction.and_then(VolumetricCorrection::budget),
            }
        };
        places.iter().map(stand).collect()
    }

    /// By how much the tool would be off now at `places`, corrected by the tables of `state`
    /// alone: no detectors, no thermometers.
    ///
    /// # Panics
    /// When these tables cannot be applied.
    pub fn by_tables(&self, places: &[[f64; 3]], state: &VolumetricState) -> Vec<Off> {
        let machine = &self.bench.loaded.config;
        let correction = VolumetricCorrection::by_tables(machine, state.clone());
        let mut correction = correction.unwrap_or_else(|failure| panic!("{failure}"));
        self.truth(|truth| {
            let one = |mm: &[f64; 3]| {
                use machine::engine::Correction;
                let target = each(point_mm(*mm));
                let corrected = correction.correct(&Observed {
                    now: self.bench.machine.now(),
                    nominal: &target,
                    actual: &target,
                    channels: &[],
                    temperatures: &[],
                    spots: &[],
                });
                let command = core::array::from_fn(|k| target[k] + corrected.offset[k]);
                let (is, should) = (truth.tool_point_for(command), truth.nominal_for(target));
                core::array::from_fn(|k| is[k] - should[k])
            };
            places.iter().map(one).collect()
        })
    }
}
