//! Servo drives of CiA 402, and what a rotary axis has of them, too.

use drivers::device::cia402::{
    Cia402Drive, Cia402Settings, Cia402Timeouts, HomeOffset, OptionCodes, StatedUnits,
    interpolation_period, period_from,
};
use drivers::device::{Axis, Identity};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale};

use super::{CyclicConfig, Family, Task};
use crate::config::judge::Judge;
use crate::hardware::bus::Wiring;
use crate::hardware::kept_zero::KeptZeroConfig;
use crate::hardware::node::NodeConfig;
use crate::hardware::{CHECKED, millis};

/// What only an axis on CAN has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Cia402AxisConfig {
    /// Where it is.
    #[serde(flatten)]
    pub node: NodeConfig,
    /// For how long the following error may be exceeded (0x6066).
    pub following_error_timeout_ms: u16,
    /// What the drive takes 0x607C for; CiA 402 says `zero_from_home`, many drives do
    /// `position_at_home`. A wrong one is noticed after homing, before anything moves by it.
    #[serde(default)]
    pub home_offset: HomeOffsetName,
    /// Written and read back at the start; what is absent stays as the drive has it.
    #[serde(default)]
    pub option_codes: OptionCodesConfig,
    /// The drive takes controlword and target over at SYNC (RPDO 1 with transmission type 1, read
    /// back), so that a group starts at the same SYNC; a quick stop is up to one SYNC later.
    #[serde(default)]
    pub synchronous_start: bool,
    /// The unit of its speeds, for a drive that does not say so (0x60A9): with both units the first motion after a start is
    /// as fast as asked, otherwise slow until it was measured. Another unit than position units a second is refused.
    pub speed_unit: Option<SpeedUnitName>,
    /// Likewise of its accelerations (0x60AA).
    pub acceleration_unit: Option<AccelerationUnitName>,
    /// How the drive proves at a start that it has kept its zero; without it an axis is zeroed after each start.
    pub kept_zero: Option<KeptZeroConfig>,
    /// The axis can follow cyclic set-points.
    pub cyclic: Option<CyclicConfig>,
}

/// What a drive takes its home offset (0x607C) for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HomeOffsetName {
    /// The position at home, as many drives do.
    #[default]
    PositionAtHome,
    /// The way from home to zero, as CiA 402 has it.
    ZeroFromHome,
}

/// What a drive counts speeds in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedUnitName {
    /// Position units a second.
    CountsPerS,
}

/// What a drive counts accelerations in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum AccelerationUnitName {
    /// Position units a second, each second.
    #[serde(rename = "counts_per_s2")]
    CountsPerS2,
}

/// The option codes of CiA 402; what is absent stays as the drive has it.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptionCodesConfig {
    /// 0x605A.
    pub quick_stop: Option<i16>,
    /// 0x605B.
    pub shutdown: Option<i16>,
    /// 0x605C.
    pub disable: Option<i16>,
    /// 0x605D.
    pub halt: Option<i16>,
    /// 0x605E.
    pub fault_reaction: Option<i16>,
}

impl Cia402AxisConfig {
    /// What its driver is told; the configuration has been checked.
    ///
    /// # Panics
    /// When its bus is not there.
    pub fn settings(
        &self,
        task: Task<'_>,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> Cia402Settings {
        let motion = task.motion;
        let common = self.node.settings(wiring.can, patience);
        let scale = Scale::new(Metres(motion.resolution_nm * 1e-9)).expect(CHECKED);
        let speed_max = MetresPerSecond(motion.speed_max_mm_per_s * 1e-3);
        let acceleration = MetresPerSecondSquared(motion.acceleration_mm_per_s2 * 1e-3);
        let quick_stop = MetresPerSecondSquared(motion.quick_stop_deceleration_mm_per_s2 * 1e-3);
        let usual = Cia402Settings::new(common, scale, speed_max, acceleration.max(quick_stop));
        Cia402Settings {
            soft_limits: Some((
                Metres::from_mm(motion.soft_min_mm),
                Metres::from_mm(motion.soft_max_mm),
            )),
            following_error: Some((
                Metres::from_um(motion.following_error_limit_um),
                millis(self.following_error_timeout_ms),
            )),
            position_window: Metres::from_um(motion.position_window_um),
            position_window_time: millis(motion.position_window_time_ms),
            hold_limit: Some(motion.hold_limit()),
            gravity: motion.gravity,
            quick_stop_deceleration: Some(quick_stop),
            stall_max: patience.beyond(usual.common.sync_period),
            home_offset: home_offset(self.home_offset),
            reference_proof: self.kept_zero.as_ref().map(KeptZeroConfig::proof),
            stated_units: stated_units(self.speed_unit, self.acceleration_unit),
            options: option_codes(&self.option_codes, usual.options),
            synchronous_start: self.synchronous_start,
            timeouts: patient_drive(
                Cia402Timeouts {
                    homing: task.homing.unwrap_or(usual.timeouts.homing),
                    ..usual.timeouts
                },
                patience,
            ),
            ..usual
        }
    }

    fn check_cyclic(&self, judge: &mut Judge<'_>) {
        if !self.synchronous_start {
            judge.say(
                "synchronous_start",
                "is not true, but the axis follows cyclic set-points",
                "set `synchronous_start = true`: all axes must take their set-points at one SYNC",
            );
        }
    }

    /// Every drive is told the SYNC period as so many units of a power of ten.
    fn check_period(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>) {
        let bus = wiring.can.get(&self.node.bus);
        let Some((period_ms, period)) = bus.map(|it| (it.sync_period_ms, it.sync_period())) else {
            return;
        };
        if interpolation_period(period).is_some() {
            return;
        }
        let help = match period_from(period) {
            Some(next) => format!(
                "set sync_period_ms of its bus to {}",
                next.as_nanos() as f64 / 1e6
            ),
            None => "shorten sync_period_ms of its bus".into(),
        };
        judge.say(
            "cyclic",
            format!(
                "the SYNC period of {period_ms} ms cannot be told to a drive: 0x60C2 takes 1 to 255 times \
                 1, 0.1, 0.01 or 0.001 ms"
            ),
            help,
        );
    }
}

impl Family for Cia402AxisConfig {
    fn port(&self) -> &str {
        &self.node.bus
    }

    fn node(&self) -> Option<&NodeConfig> {
        Some(&self.node)
    }

    fn cyclic(&self) -> Option<&CyclicConfig> {
        self.cyclic.as_ref()
    }

    fn identity(&self) -> Identity {
        self.node.identity.configured()
    }

    fn register_units(&self) -> [f64; 2] {
        [1.0, 1.0]
    }

    fn check(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>) {
        if self.cyclic.is_some() {
            self.check_cyclic(judge);
            self.check_period(judge, wiring);
        }
        if let Some(kept) = &self.kept_zero {
            kept.check(judge);
        }
        self.node.check(judge, wiring.can);
    }

    fn driver(&self, task: Task<'_>, wiring: Wiring<'_>, patience: Patience) -> Box<dyn Axis> {
        Cia402Drive::linear(self.settings(task, wiring, patience))
    }
}

pub(crate) const fn home_offset(name: HomeOffsetName) -> HomeOffset {
    match name {
        HomeOffsetName::PositionAtHome => HomeOffset::IsPositionAtHome,
        HomeOffsetName::ZeroFromHome => HomeOffset::IsZeroFromHome,
    }
}

pub(crate) const fn stated_units(
    speed: Option<SpeedUnitName>,
    acceleration: Option<AccelerationUnitName>,
) -> StatedUnits {
    StatedUnits {
        speed: speed.is_some(),
        acceleration: acceleration.is_some(),
    }
}

pub(crate) fn option_codes(config: &OptionCodesConfig, usual: OptionCodes) -> OptionCodes {
    OptionCodes {
        quick_stop: config.quick_stop.or(usual.quick_stop),
        shutdown: config.shutdown.or(usual.shutdown),
        disable: config.disable.or(usual.disable),
        halt: config.halt.or(usual.halt),
        fault_reaction: config.fault_reaction.or(usual.fault_reaction),
        ..usual
    }
}

pub(crate) fn patient_drive(usual: Cia402Timeouts, patience: Patience) -> Cia402Timeouts {
    Cia402Timeouts {
        transition: patience.of(usual.transition),
        mode: patience.of(usual.mode),
        set_point: patience.of(usual.set_point),
        settling: patience.of(usual.settling),
        standing: patience.of(usual.standing),
        homing: patience.of(usual.homing),
        new_position: patience.of(usual.new_position),
        latch: patience.of(usual.latch),
        repeat: patience.of(usual.repeat),
    }
}
