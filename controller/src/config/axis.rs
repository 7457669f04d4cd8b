//! Linear axes in the configuration file.

use core::time::Duration;

use drivers::device::{Axis, Identity};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::hardware::bus::Wiring;
use crate::hardware::drive::{CyclicConfig, DriveConfig, MotionConfig, Task};
use crate::hardware::node::NodeConfig;
use crate::linear::{CalibrateConfig, CompensationConfig, VerifyConfig, ZeroConfig};

/// A linear axis and its drive.
///
/// Node numbers on one bus must differ, the master's included; so must the addresses of amplifiers
/// on one line, which carries nothing else. Which of the optional keys a device needs, and which it
/// does not know, is checked when the file is read.
///
/// A `copley` axis has no section `zero`: the Hall search needs positions and voltages of one SYNC.
/// What stops it when the controller dies stands in docs/safety.md: read it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct AxisConfig {
    /// Its drive.
    #[serde(flatten)]
    pub drive: DriveConfig,
    /// How it counts and moves.
    #[serde(flatten)]
    pub motion: MotionConfig,
    /// How it gets its origin: the drift-free Hall search.
    #[schemars(extend("x-device" = "cia402"))]
    pub zero: Option<ZeroConfig>,
    /// How it is calibrated.
    pub calibrate: Option<CalibrateConfig>,
    /// How it is verified (ISO 230-2 asks for 5 runs and 5 targets).
    pub verify: Option<VerifyConfig>,
    /// How a calibration is applied, and its limits; needed to calibrate or to use one.
    pub compensation: Option<CompensationConfig>,
}

impl AxisConfig {
    /// Where its drive is on CAN, if it is.
    pub fn node(&self) -> Option<&NodeConfig> {
        self.drive.family().node()
    }

    /// Its drive's address on a serial line that it shares with others of its family.
    pub fn address(&self) -> Option<u8> {
        self.drive.family().address()
    }

    /// How it follows cyclic set-points, if it does.
    pub fn cyclic(&self) -> Option<&CyclicConfig> {
        self.drive.family().cyclic()
    }

    /// The bus or line that it is on.
    pub fn port(&self) -> &str {
        self.drive.family().port()
    }

    /// Who its drive is, as far as the configuration says it.
    pub fn configured_identity(&self) -> Identity {
        self.drive.family().identity()
    }

    /// How long its drive may look for its limit switch: over twice the travel, and some more.
    pub(crate) fn reference_limit(&self) -> Option<Duration> {
        let speed_mm_per_s = self.zero.as_ref()?.reference_speed_mm_per_s;
        let travel_mm = self.motion.soft_max_mm - self.motion.soft_min_mm + 50.0;
        Some(Duration::from_secs_f64(
            10.0 + 2.0 * travel_mm / speed_mm_per_s,
        ))
    }

    /// The driver of its drive; the configuration has been checked.
    pub fn driver(&self, wiring: Wiring<'_>, patience: Patience) -> Box<dyn Axis> {
        self.drive.family().driver(self.task(), wiring, patience)
    }

    /// What its drive is for.
    pub fn task(&self) -> Task<'_> {
        Task {
            motion: &self.motion,
            homing: self.reference_limit(),
        }
    }
}
