//! The part of a configuration that is about rotary axes. Each key's suffix is its unit.

use std::sync::OnceLock;

use compensator::rotary::{self, Criterion, Design, PlanError, Sighted};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::config::{AccelerationUnitName, HomeOffsetName, OptionCodesConfig, SpeedUnitName};
use crate::hardware::kept_zero::KeptZeroConfig;
use crate::hardware::node::NodeConfig;

/// The kinds of drive of a rotary axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RotaryDevice {
    /// A CiA 402 drive on CAN.
    Cia402,
}

/// Where the position of a rotary axis's drive starts again (0x607B).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DirectionName {
    /// Coordinates increase.
    Forward,
    /// Coordinates decrease.
    Reverse,
}

/// An edge of an input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EdgeName {
    /// From low to high.
    #[default]
    Positive,
    /// From high to low.
    Negative,
}

/// A rotary axis that turns endlessly, and its drive.
///
/// Angles count on over the turns; a table may turn any number of them. Speeds and accelerations
/// must fit 31 bits of counts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct RotaryConfig {
    /// The kind of drive.
    pub device: RotaryDevice,
    /// Where the drive is, and who it must be.
    #[serde(flatten)]
    pub node: NodeConfig,
    /// Position units of the drive in one turn: exactly a whole number.
    #[schemars(range(min = 360, max = 2147483647))]
    #[schemars(extend("x-own" = true))]
    pub counts_per_turn: u32,
    /// `true` when the drive counts against the table.
    #[serde(default)]
    pub reverse: bool,
    /// Where the drive's position wraps round to its lower limit (0x607B, written at the start).
    /// `"counts_on"`: not until 32 bits are full; targets beyond them are refused.
    /// `"to_last_count"`: after the last count of a turn, and the upper limit written is that
    /// count. `"to_first_count"`: at the same place, but the upper limit written is the number of
    /// counts of a turn, which the drive takes for 0. A drive that wraps must have 0x60F2 and be
    /// set to take the shortest way.
    pub position_range: PositionRangeName,
    /// Speed of ordinary moves and of sweeps over a plate.
    #[schemars(range(min = 0.001), extend("x-range" = "at most `speed_max_deg_per_s`"))]
    #[schemars(extend("x-own" = true))]
    pub speed_deg_per_s: f64,
    /// Fastest possible: faster moves are refused, faster changes of position not believed.
    #[schemars(range(min = 0.001, max = 100000.0))]
    #[schemars(extend("x-own" = true))]
    pub speed_max_deg_per_s: f64,
    /// Of moves and of the search of the index mark.
    #[schemars(range(min = 0.01, max = 1000000.0))]
    #[schemars(extend("x-own" = true))]
    pub acceleration_deg_per_s2: f64,
    /// 0x6085.
    #[schemars(range(min = 0.01, max = 1000000.0))]
    #[schemars(extend("x-own" = true))]
    pub quick_stop_deceleration_deg_per_s2: f64,
    /// Following error window (0x6065).
    #[schemars(range(min = 0.001, max = 1000000.0), extend("x-range" = "at least one count"))]
    pub following_error_limit_arcsec: f64,
    /// For how long it may be exceeded (0x6066).
    pub following_error_timeout_ms: u16,
    /// How far a table that is on, and that nothing turns, may be from where it stood before it is stopped; a tenth of
    /// `following_error_limit_arcsec` when left out, and `position_window_arcsec` at least.
    #[schemars(range(min = 0.0001, max = 1000000.0), extend("x-range" = "at least `position_window_arcsec`"))]
    pub hold_limit_arcsec: Option<f64>,
    /// How near its target the axis must be (0x6067).
    #[schemars(range(min = 0.0001, max = 100000.0))]
    pub position_window_arcsec: f64,
    /// For how long it must be there (0x6068).
    pub position_window_time_ms: u16,
    /// Longest time of one move.
    #[schemars(range(min = 0.01, max = 100000.0))]
    pub move_timeout_s: f64,
    /// What the drive takes 0x607C for, as for a linear axis.
    #[serde(default)]
    pub home_offset: HomeOffsetName,
    /// As for a linear axis.
    #[serde(default)]
    pub option_codes: OptionCodesConfig,
    /// As for a linear axis.
    pub speed_unit: Option<SpeedUnitName>,
    /// As for a linear axis.
    pub acceleration_unit: Option<AccelerationUnitName>,
    /// As for a linear axis.
    pub kept_zero: Option<KeptZeroConfig>,
    /// How it gets its origin: the encoder's index mark.
    pub zero: Option<RotaryZeroConfig>,
    /// What sees the lines of a plate pass.
    pub line_detector: Option<LineDetectorConfig>,
    /// What sees them as a voltage, where the drive has no touch probe.
    pub line_signal: Option<LineSignalConfig>,
    /// How a person reads the lines of a plate, where no detector does.
    pub sighting: Option<SightingConfig>,
    /// How it is calibrated.
    pub calibrate: Option<RotaryCalibrateConfig>,
    /// How it is verified.
    pub verify: Option<RotaryVerifyConfig>,
    /// How a calibration is applied, and its limits; needed to calibrate or to use one.
    pub compensation: Option<RotaryCompensationConfig>,
}

/// The origin of a rotary axis: the encoder's index mark.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryZeroConfig {
    /// From which side the mark is sought (methods 34 and 33).
    #[schemars(extend("x-own" = true))]
    pub index_direction: DirectionName,
    /// How fast it is sought.
    #[schemars(range(min = 0.001), extend("x-range" = "at most `speed_max_deg_per_s`"))]
    #[schemars(extend("x-own" = true))]
    pub index_speed_deg_per_s: f64,
    /// What the mark's angle is called.
    #[schemars(range(min = 0.0, max = 360.0))]
    pub index_deg: f64,
}

/// What sees the lines of a plate pass.
///
/// It is wired to the drive's touch probe 1, which latches the angle at each line (0x60B8 to
/// 0x60BB, and 0x60D5 or 0x60D6 where the drive counts edges). A sweep is refused when less than
/// two SYNC periods would lie between two lines; the refusal says which speed fits.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineDetectorConfig {
    /// The edge of its pulse that is at the line.
    #[serde(default)]
    pub edge: EdgeName,
    /// 0x60D0:01, where the drive has a choice of inputs.
    pub input: Option<i16>,
}

/// Which side of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LineSideName {
    /// A line raises the voltage.
    Above,
    /// A line lowers it.
    Below,
}

/// A detector whose voltage shows each line of a plate pass.
///
/// In place of `line_detector`, with an analog module on the bus of the drive: it is sampled by the same SYNC
/// as the angle. The place of a line is the centroid of its pulse, so that its height and the module's delay do not
/// count (a delay drops out of the mean of both directions). A line must be seen in eight samples at least while it
/// is beyond the level, which limits `calibrate.speed_deg_per_s`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineSignalConfig {
    /// The analog module that reads it.
    #[schemars(extend("x-range" = "an `[analog.NAME]` on the bus of the drive"))]
    pub analog: String,
    /// The module's input.
    #[schemars(extend("x-range" = "one of its `channels`"))]
    pub channel: u8,
    /// A voltage that only lines reach: half of their height.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub level_v: f64,
    /// Where a line is: `above` it or `below`.
    pub line: LineSideName,
    /// How far the table turns while a line is beyond the level.
    #[schemars(range(min = 0.001), extend("x-range" = "at most a quarter of the line spacing"))]
    pub width_arcsec: f64,
}

/// What a person types of a line, or imports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SightedName {
    /// The machine drives the table to the line's nominal angle before it asks; by how much the table would
    /// have to turn on for the line to lie under the cross-hair, positive towards larger angles.
    ToLine,
    /// Nothing is driven; what the encoder shows with the line under the cross-hair, counted from the table's
    /// zero.
    Angle,
    /// Nothing is driven; the same less the line's nominal angle.
    Deviation,
}

/// How a person reads the lines of a plate: with a microscope, a camera or an autocollimator.
///
/// In place of a detector. The passes are those of a detector: each line once in each pass,
/// `calibrate.passes` forward and as many in reverse, and the first pass repeated at the end. What
/// drifts evenly with time falls out of the mean of both directions.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SightingConfig {
    /// What is typed of a line, or stands in a file.
    pub value: SightedName,
    /// How far a line may be from the median of its placement; a value farther off is refused as
    /// mistyped. Give more than the largest errors of table and plate together: sound lines are never refused
    /// then.
    #[schemars(range(min = 0.001, max = 100000.0), extend("x-range" = "at most a quarter of the line spacing"))]
    pub range_arcsec: f64,
}

impl RotaryConfig {
    /// Whether the machine turns the table while its plate is read; a person does otherwise, while its drive is off.
    pub(crate) fn is_driven(&self) -> bool {
        let sighting = self.sighting.as_ref();
        sighting.is_none_or(SightingConfig::is_driven)
    }
}

impl SightingConfig {
    /// Whether the table is driven to each line; a person turns it by hand otherwise.
    pub(crate) const fn is_driven(&self) -> bool {
        matches!(self.value, SightedName::ToLine)
    }
}

/// What planned offsets keep small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OptimiseName {
    /// The noise of the worst harmonic.
    #[default]
    Worst,
    /// The rms noise of a table error.
    Rms,
}

/// The calibration run of a rotary axis (system S2).
///
/// A plate of lines is fixed on the table and read, turned and read again; somebody turns it when
/// asked. Needs the sections `zero` and `compensation`, and one of `line_detector`, `line_signal` and
/// `sighting`.
///
/// Two placements cannot judge each other: with two, a plate turned by a wrong number of lines is
/// not noticed, and not one line may be missing.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryCalibrateConfig {
    /// Serial number of the plate: a run is continued, and a calibration verified, with the same
    /// one.
    #[schemars(extend("x-range" = "not empty"))]
    #[schemars(extend("x-own" = true))]
    pub plate: String,
    /// Its lines.
    #[schemars(range(min = 12, max = 100000))]
    #[schemars(extend("x-own" = true))]
    pub lines: u32,
    /// By how many lines it is turned in each placement, against the first.
    #[schemars(extend("x-range" = "each once, below `lines`; or `placements`"))]
    pub offsets: Option<Vec<u32>>,
    /// How often it is placed; the offsets are planned (`truestage plan rotary`).
    #[schemars(extend("x-range" = "2 or more; or `offsets`"))]
    pub placements: Option<u32>,
    /// What planned offsets keep small.
    #[schemars(extend("x-range" = "with `placements`"))]
    pub optimise: Option<OptimiseName>,
    /// Turns over all lines in each direction and placement; the first is repeated at the end.
    #[schemars(range(min = 1, max = 1000))]
    pub passes: u32,
    /// Of a pass, the axis's own without it; between two lines there must be two SYNC periods where a
    /// touch probe reads them, and in a line eight samples where its voltage is sampled.
    #[schemars(range(min = 0.001), extend("x-range" = "at most `speed_max_deg_per_s`"))]
    pub speed_deg_per_s: Option<f64>,
    /// Standard deviation of one line in one pass. Readings that scatter more than twice as much
    /// are refused.
    #[schemars(range(min = 1e-06, max = 10000.0))]
    pub reading_noise_arcsec: f64,
    /// Offsets that amplify the noise of a harmonic more than this are refused, before anything is
    /// read.
    #[schemars(range(min = 0.1, max = 1000000.0))]
    pub amplification_limit: f64,
    /// How far an eighth of the lines may have moved while a placement was read.
    #[schemars(range(min = 1e-06, max = 10000.0))]
    pub closure_limit_arcsec: f64,
    /// Planned once, when the file is judged: of thousands of lines it takes longer than a drive
    /// waits for a heartbeat.
    #[serde(skip)]
    planned: OnceLock<Design>,
}

impl RotaryConfig {
    /// Whether a detector reads the lines of a plate while the table turns.
    pub(crate) const fn has_detector(&self) -> bool {
        self.line_detector.is_some() || self.line_signal.is_some()
    }
}

impl From<SightedName> for Sighted {
    fn from(name: SightedName) -> Self {
        match name {
            SightedName::ToLine => Self::ToLine,
            SightedName::Angle => Self::Angle,
            SightedName::Deviation => Self::Deviation,
        }
    }
}

impl RotaryCalibrateConfig {
    /// The placements: those given, or those planned.
    ///
    /// # Errors
    /// When none separate the errors of table and plate within the limit.
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

/// The verification of a rotary axis: the same plate in a further placement.
///
/// It sees errors of every harmonic of the table, and those between the lines; not where the zero
/// is, nor what table and detector do alike in every placement.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryVerifyConfig {
    /// Where the plate is placed. Whole lines: the places of the calibration, each read by another
    /// line. A half line beyond: the places between them, where the interpolation is on trial.
    #[schemars(range(min = 0.0), extend("x-range" = "at most below `lines`, in quarters; none of the calibration's"))]
    pub offset_lines: f64,
    /// Turns over all lines in each direction; the first is repeated at the end.
    #[schemars(range(min = 1, max = 1000))]
    pub passes: u32,
    /// Largest deviation (less the mean) of the table with its calibration. The scatter of these
    /// readings is in it.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    pub tolerance_arcsec: f64,
}

/// How the deviation between two lines is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PeriodicInterpolationName {
    /// The trigonometric polynomial through all lines.
    BandLimited,
    /// Straight lines.
    Linear,
}

/// How a table's error is undone, and its limits.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryCompensationConfig {
    /// Between the lines: the trigonometric polynomial through all of them, right for errors
    /// without harmonics above half their number; or straight lines.
    pub interpolation: PeriodicInterpolationName,
    /// Largest deviation corrected.
    #[schemars(range(min = 0.0001, max = 100000.0))]
    pub size_limit_arcsec: f64,
    /// Largest slope of the deviation, dimensionless.
    #[schemars(range(min = 1e-09, max = 0.5))]
    pub slope_limit: f64,
}
