//! One linear-motor stage: mass, encoder, deviation and limit switches in one.

use core::cell::Cell;

use crate::random::Stream;
use units::Time;

use super::config::StageConfig;
use super::mechanics::Mechanics;
use super::parts::actuator::Actuator;
use super::parts::deviation::{Field, Path};
use super::parts::drive_train::DriveTrain;
use super::parts::encoder::Encoder;
use super::parts::limit_switch::LimitSwitch;
use super::parts::servo::Mass;
use super::parts::servo::Servo;

/// Scales are true at this temperature (ISO 1).
const REFERENCE_C: f64 = 20.0;

#[derive(Clone, Debug)]
pub(super) struct Stage {
    config: StageConfig,
    train: DriveTrain,
    field: Field,
    /// Where the field was asked for last, and what it was: sensors ask one after the other, and
    /// again and again while the stage stands.
    asked: Cell<(f64, f64)>,
    path: Path,
    shift: Stream,
}

impl Stage {
    pub(super) fn new(config: StageConfig, seed: u64) -> Self {
        let mut shift = Stream::new(seed, "start position");
        let start_m = 1e-3 * shift.between(config.motion.start_min_mm, config.motion.start_max_mm);
        let mut stage = Self {
            train: DriveTrain {
                travelled: start_m.into(),
                mass: Mass::new(
                    config.motion.clone(),
                    start_m,
                    Stream::new(seed, "servo rest"),
                ),
                encoder: Encoder::new(config.encoder.resolution_nm * 1e-9, start_m),
                // The scale has none.
                index: None,
                switches: Some(LimitSwitch::pair(&config.limits, seed, "")),
            },
            field: Field::new(&config.deviation, seed),
            asked: Cell::new((f64::NAN, f64::NAN)),
            path: Path::new(&config.deviation, seed),
            shift,
            config,
        };
        stage.watch_switches();
        stage
    }

    /// The switches' own place varies by more than the scale grows: expansion is left out.
    fn watch_switches(&mut self) {
        let field = &self.field;
        let error_m = field.at_most(self.train.mass.position_at(Time::ZERO));
        self.train
            .watch_switches(error_m, |scale_m| scale_m + field.at(scale_m));
    }

    /// Scale position of the encoder's present zero count.
    pub(super) fn count_zero_m(&self) -> f64 {
        self.train.encoder.count_zero()
    }

    pub(super) fn scale_position_m(&self, now: Time) -> f64 {
        self.train.mass.position_at(now)
    }

    pub(super) fn speed(&self, now: Time) -> f64 {
        self.train.mass.speed_at(now)
    }

    pub(super) fn true_position_m(&self, now: Time, stage_c: f64) -> f64 {
        let scale_m = self.train.mass.position_at(now);
        self.grown(scale_m, stage_c) + self.field_at(scale_m) + self.path.deviation_m()
    }

    fn field_at(&self, scale_m: f64) -> f64 {
        let (place_m, known_m) = self.asked.get();
        if place_m == scale_m {
            return known_m;
        }
        let field_m = self.field.at(scale_m);
        self.asked.set((scale_m, field_m));
        field_m
    }

    fn grown(&self, scale_m: f64, stage_c: f64) -> f64 {
        let per_k = self.config.encoder.scale_expansion_ppm_per_k * 1e-6;
        scale_m * (1.0 + per_k * (stage_c - REFERENCE_C))
    }

    /// The true place that belongs to a scale position, without what the scale errs within its period, lost motion and
    /// the error of a stop.
    pub(super) fn smooth_place_m(&self, scale_m: f64, stage_c: f64) -> f64 {
        self.grown(scale_m, stage_c) + self.field.smooth(scale_m)
    }

    /// True minus scale position, fully engaged in the direction of `sign` (0: between both).
    pub(super) fn systematic_deviation_m(&self, scale_m: f64, sign: f64, stage_c: f64) -> f64 {
        self.grown(scale_m, stage_c) - scale_m + self.field.at(scale_m) + self.path.engaged_m(sign)
    }
}

impl Mechanics for Stage {
    fn advance(&mut self, now: Time) {
        while let Some((from, to)) = self.train.step_until(now) {
            if to != from {
                self.path.travel(to - from);
                self.watch_switches();
            }
        }
        self.train.settle(now);
    }

    fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        (number == 0).then_some(self as &dyn Actuator)
    }

    fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        (number == 0).then_some(self as &mut dyn Actuator)
    }

    /// Without power the stage can be moved; `now` is when the power is off.
    fn power_cycle(&mut self) {
        let limit_m = self.config.motion.power_cycle_shift_um * 1e-6;
        let by_m = self.shift.between(-limit_m, limit_m);
        self.train.mass.push(by_m);
        self.path.leave();
        self.path.travel(by_m);
    }

    fn boxed(&self) -> Box<dyn Mechanics> {
        Box::new(self.clone())
    }
}

impl Actuator for Stage {
    fn train(&self) -> &DriveTrain {
        &self.train
    }

    fn train_mut(&mut self) -> &mut DriveTrain {
        &mut self.train
    }

    fn set_servo(&mut self, now: Time, servo: Servo) {
        if self.train.set_servo(now, servo) {
            self.path.leave();
        }
    }
}
