//! The part of a configuration that is about rotary axes. Each key's suffix is its unit.

use std::sync::OnceLock;

use compensator::rotary::{self, Criterion, Design, PlanError};
use serde::Deserialize;

use crate::config::{HomeOffsetName, IdentityConfig, OptionCodesConfig};

/// The kinds of drive of a rotary axis: those with a touch probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RotaryDevice {
    /// A CiA 402 drive on CAN.
    Cia402,
}

/// Where the position of a rotary axis's drive starts again (0x607B).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionRangeName {
    /// Not until 32 bits are full.
    CountsOn,
    /// After the last count of a turn, which is the upper limit.
    ToLastCount,
    /// At the upper limit, which is the counts of a turn.
    ToFirstCount,
}

/// A direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DirectionName {
    /// Coordinates increase.
    Forward,
    /// Coordinates decrease.
    Reverse,
}

/// An edge of an input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeName {
    /// From low to high.
    #[default]
    Positive,
    /// From high to low.
    Negative,
}

/// One rotary axis that turns endlessly.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryConfig {
    pub device: RotaryDevice,
    pub bus: String,
    pub node_id: u8,
    pub counts_per_turn: u32,
    #[serde(default)]
    pub reverse: bool,
    pub position_range: PositionRangeName,
    pub speed_deg_per_s: f64,
    pub speed_max_deg_per_s: f64,
    pub acceleration_deg_per_s2: f64,
    pub quick_stop_deceleration_deg_per_s2: f64,
    pub following_error_limit_arcsec: f64,
    pub following_error_timeout_ms: u16,
    pub position_window_arcsec: f64,
    pub position_window_time_ms: u16,
    pub move_timeout_s: f64,
    pub heartbeat_producer_ms: u16,
    pub heartbeat_consumer_ms: u16,
    pub watch_master_ms: u16,
    #[serde(default)]
    pub home_offset: HomeOffsetName,
    #[serde(default)]
    pub option_codes: OptionCodesConfig,
    pub identity: IdentityConfig,
    pub zero: Option<RotaryZeroConfig>,
    pub line_detector: Option<LineDetectorConfig>,
    pub calibrate: Option<RotaryCalibrateConfig>,
    pub verify: Option<RotaryVerifyConfig>,
    pub compensation: Option<RotaryCompensationConfig>,
}

/// The zero: the encoder's index mark.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryZeroConfig {
    pub index_direction: DirectionName,
    pub index_speed_deg_per_s: f64,
    pub index_deg: f64,
}

/// What sees the lines of a plate pass, wired to the drive's touch probe.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct LineDetectorConfig {
    #[serde(default)]
    pub edge: EdgeName,
    pub input: Option<i16>,
}

/// What planned offsets keep small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OptimiseName {
    /// The noise of the worst harmonic.
    #[default]
    Worst,
    /// The rms noise of a table error.
    Rms,
}

/// The calibration run: a plate read in several placements.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryCalibrateConfig {
    pub plate: String,
    pub lines: u32,
    pub offsets: Option<Vec<u32>>,
    pub placements: Option<u32>,
    pub optimise: Option<OptimiseName>,
    pub passes: u32,
    pub speed_deg_per_s: Option<f64>,
    pub reading_noise_arcsec: f64,
    pub amplification_limit: f64,
    pub closure_limit_arcsec: f64,
    /// Planned once, when the file is judged: of thousands of lines it takes longer than a drive
    /// waits for a heartbeat.
    #[serde(skip)]
    planned: OnceLock<Design>,
}

impl RotaryCalibrateConfig {
    /// The placements: those given, or those planned.
    ///
    /// # Errors
    /// When there are none that part table and plate within the limit.
    pub fn design(&self) -> Result<Design, PlanError> {
        if let Some(planned) = self.planned.get() {
            return Ok(planned.clone());
        }
        let planned = self.design_anew()?;
        Ok(self.planned.get_or_init(|| planned).clone())
    }

    fn design_anew(&self) -> Result<Design, PlanError> {
        let lines = self.lines as usize;
        let given = self.offsets.as_ref();
        let offsets = match given {
            Some(offsets) => offsets.iter().map(|it| *it as usize).collect(),
            None => {
                let criterion = match self.optimise.unwrap_or_default() {
                    OptimiseName::Worst => Criterion::Worst,
                    OptimiseName::Rms => Criterion::Rms,
                };
                let placements = self.placements.unwrap_or_default() as usize;
                rotary::plan(lines, placements, criterion)?
                    .offsets()
                    .to_vec()
            }
        };
        Ok(Design::new(lines, &offsets, self.amplification_limit)?)
    }
}

/// The verification: the same plate in a further placement.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryVerifyConfig {
    pub offset_lines: f64,
    pub passes: u32,
    pub tolerance_arcsec: f64,
}

/// How the deviation between two lines is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PeriodicInterpolationName {
    /// The trigonometric polynomial through all lines.
    BandLimited,
    /// Straight lines.
    Linear,
}

/// How a table's error is undone, and its limits.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RotaryCompensationConfig {
    pub interpolation: PeriodicInterpolationName,
    pub size_limit_arcsec: f64,
    pub slope_limit: f64,
}
