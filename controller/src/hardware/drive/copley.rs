//! Copley Controls amplifiers on serial lines.

use core::time::Duration;

use drivers::device::copley::{CopleyAxis, CopleySettings, CopleyTimeouts};
use drivers::device::{Axis, Identity};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale};
use wire::copley::Address;

use super::{Family, Task};
use crate::config::judge::Judge;
use crate::hardware::bus::Wiring;
use crate::hardware::{CHECKED, millis};

/// The rates that both amplifiers and serial ports have.
pub(crate) const AMPLIFIER_RATES: [u32; 5] = [9_600, 19_200, 38_400, 57_600, 115_200];

/// What only an axis on a serial line has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct CopleyAxisConfig {
    /// The line that the amplifier is on. Amplifiers are looked for at its rate and at 9600 bit/s,
    /// and brought to its rate.
    #[schemars(extend("x-range" = "a `[serial.NAME]` with 9600, 19200, 38400, 57600 or 115200 bit/s"))]
    pub line: String,
    /// 0: the amplifier at the cable; others: its node number on the CAN behind that one.
    #[schemars(range(min = 0, max = 127))]
    #[schemars(extend("x-own" = true))]
    pub address: u8,
    /// From one look at status and position to the next. A look is three exchanges of some 3 ms at
    /// 115200 bit/s and 17 ms at 9600; what the line cannot carry comes later.
    #[schemars(range(min = 1.0, max = 300.0))]
    pub poll_period_ms: f64,
    /// Who the amplifier must be.
    pub amplifier: Option<AmplifierConfig>,
}

/// What an amplifier on a serial line must answer at the start.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplifierConfig {
    /// What it must call itself (parameter 0x80); any without it.
    pub model: Option<String>,
    /// The serial number that it must have (parameter 0x81); any without it.
    #[schemars(extend("x-own" = true))]
    pub serial_number: Option<u32>,
}

impl CopleyAxisConfig {
    /// What its driver is told; the configuration has been checked.
    ///
    /// # Panics
    /// With an address that no amplifier has.
    pub fn settings(
        &self,
        task: Task<'_>,
        wiring: Wiring<'_>,
        patience: Patience,
    ) -> CopleySettings {
        let motion = task.motion;
        let amplifier = self.amplifier.clone().unwrap_or_default();
        let address = Address::node(self.address).expect(CHECKED);
        let scale = Scale::new(Metres(motion.resolution_nm * 1e-9)).expect(CHECKED);
        let speed_max = MetresPerSecond(motion.speed_max_mm_per_s * 1e-3);
        let acceleration = MetresPerSecondSquared(motion.acceleration_mm_per_s2 * 1e-3);
        let quick_stop = MetresPerSecondSquared(motion.quick_stop_deceleration_mm_per_s2 * 1e-3);
        let usual = CopleySettings::new(address, scale, speed_max, acceleration.max(quick_stop));
        CopleySettings {
            baud: wiring.serial[&self.line].baud_bit_per_s,
            model: amplifier.model,
            serial: amplifier.serial_number,
            soft_limits: Some((
                Metres::from_mm(motion.soft_min_mm),
                Metres::from_mm(motion.soft_max_mm),
            )),
            following_error: Some(Metres::from_um(motion.following_error_limit_um)),
            position_window: Metres::from_um(motion.position_window_um),
            position_window_time: millis(motion.position_window_time_ms),
            hold_limit: Some(motion.hold_limit()),
            gravity: motion.gravity,
            quick_stop_deceleration: quick_stop,
            poll_period: Duration::from_secs_f64(self.poll_period_ms * 1e-3),
            timeouts: patient(
                CopleyTimeouts {
                    homing: task.homing.unwrap_or(usual.timeouts.homing),
                    ..usual.timeouts
                },
                patience,
            ),
            ..usual
        }
    }
}

impl Family for CopleyAxisConfig {
    fn port(&self) -> &str {
        &self.line
    }

    fn address(&self) -> Option<u8> {
        Some(self.address)
    }

    fn identity(&self) -> Identity {
        let amplifier = self.amplifier.clone().unwrap_or_default();
        Identity {
            serial: amplifier.serial_number.unwrap_or(0),
            name: amplifier.model.unwrap_or_default(),
            ..Identity::default()
        }
    }

    /// It counts in 0.1 counts/s and 10 counts/s².
    fn register_units(&self) -> [f64; 2] {
        [0.1, 10.0]
    }

    fn check(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>) {
        let model = self.amplifier.as_ref().and_then(|it| it.model.as_ref());
        if model.is_some_and(|it| it.trim().is_empty()) {
            judge.say(
                "amplifier.model",
                "is empty, and no amplifier calls itself so",
                "give what it says in parameter 0x80, or leave the key out",
            );
        }
        let name = &self.line;
        judge.known("line", name, wiring.serial, "serial");
    }

    fn driver(&self, task: Task<'_>, wiring: Wiring<'_>, patience: Patience) -> Box<dyn Axis> {
        Box::new(CopleyAxis::new(self.settings(task, wiring, patience)))
    }
}

fn patient(usual: CopleyTimeouts, patience: Patience) -> CopleyTimeouts {
    CopleyTimeouts {
        reply: patience.of(usual.reply),
        quiet: patience.of(usual.quiet),
        find: patience.of(usual.find),
        drain: patience.of(usual.drain),
        silence: patience.of(usual.silence),
        transition: patience.of(usual.transition),
        motion: patience.of(usual.motion),
        settling: patience.of(usual.settling),
        standing: patience.of(usual.standing),
        homing: patience.of(usual.homing),
    }
}
