//! One slide: linear motor, incremental scale with reference marks, limit switches.

use units::Time;

use super::config::VolumetricConfig;
use crate::plant::config::MotionConfig;
use crate::plant::parts::actuator::Actuator;
use crate::plant::parts::drive_train::DriveTrain;
use crate::plant::parts::encoder::Encoder;
use crate::plant::parts::index_mark::IndexMark;
use crate::plant::parts::limit_switch::LimitSwitch;
use crate::plant::parts::servo::Mass;
use crate::random::Stream;

/// The axis that a weight pulls at.
const VERTICAL: usize = 2;

#[derive(Clone, Debug)]
pub(super) struct Slide {
    train: DriveTrain,
    shift_max_m: f64,
    shift: Stream,
}

impl Slide {
    pub(super) fn new(config: &VolumetricConfig, axis: usize, seed: u64) -> Self {
        let whose = format!("slide {axis} ");
        let stream = |what: &str| Stream::new(seed, &format!("{whose}{what}"));
        let travel_mm = config.travel_mm[axis];
        let slide = &config.slide;
        let motion = MotionConfig {
            weight: config.weight_z.filter(|_| axis == VERTICAL),
            ..slide.motion(travel_mm)
        };
        let mut shift = stream("start position");
        let start_m = 1e-3 * shift.between(slide.start_min_mm, slide.start_max_mm);
        Self {
            train: DriveTrain {
                travelled: start_m.into(),
                mass: Mass::new(motion, start_m, stream("servo rest")),
                encoder: Encoder::new(config.resolution_nm * 1e-9, start_m),
                index: Some(IndexMark::new(
                    slide.index_spacing_mm * 1e-3,
                    slide.index_repeatability_nm * 1e-9,
                    stream("index"),
                )),
                switches: Some(LimitSwitch::pair(&slide.limits(travel_mm), seed, &whose)),
            },
            shift_max_m: slide.power_cycle_shift_um * 1e-6,
            shift,
        }
    }

    /// Where a switch acts varies by more than the errors of the axis: these are left out.
    pub(super) fn advance(&mut self, now: Time) {
        while let Some((from, to)) = self.train.step_until(now) {
            if to != from {
                self.train.watch_switches(0.0, |scale_m| scale_m);
            }
        }
        self.train.settle(now);
    }

    /// Without power the slide can be moved.
    pub(super) fn push_a_little(&mut self) {
        let by_m = self.shift.between(-self.shift_max_m, self.shift_max_m);
        self.train.mass.push(by_m);
    }

    /// Where the scale is read, from its own zero.
    pub(super) fn scale_m(&self, now: Time) -> f64 {
        self.train.mass.position_at(now)
    }

    pub(super) fn speed_m_per_s(&self, now: Time) -> f64 {
        self.train.mass.speed_at(now)
    }

    pub(super) fn count_zero_m(&self) -> f64 {
        self.train.encoder.count_zero()
    }
}

impl Actuator for Slide {
    fn train(&self) -> &DriveTrain {
        &self.train
    }

    fn train_mut(&mut self) -> &mut DriveTrain {
        &mut self.train
    }
}
