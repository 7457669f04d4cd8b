//! What a plant is made of, as a configuration file says it. Every key ends in its unit.

mod parts;

use serde::Deserialize;

pub use self::parts::{
    ClimateConfig, DeviationConfig, EncoderConfig, HallConfig, InterferometerConfig, LimitConfig,
    MotionConfig, StageConfig, WeightConfig,
};

use super::camera::CameraConfig;
use super::gantry::config::GantryConfig;
use super::mechanics::Section;
use super::picture::Scene;
use super::platform::config::PlatformConfig;
use super::table::config::TableConfig;
use super::volumetric::config::VolumetricConfig;
use crate::config::error::{ConfigError, positive};

/// The physics of one machine.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantConfig {
    /// Guide, motor, encoder and their errors; there unless the machine is another one.
    pub stage: StageConfig,
    /// A platform on screws in place of the stage.
    pub platform: Option<PlatformConfig>,
    /// A stage with a motor on either side in place of the stage.
    pub gantry: Option<GantryConfig>,
    /// A rotary table in place of the stage, or beside three axes: then its drive's axis is number 3.
    pub table: Option<TableConfig>,
    /// Three linear axes in place of the stage.
    pub volumetric: Option<VolumetricConfig>,
    /// The cameras over the platform.
    pub camera: CameraConfig,
    /// The magnets and sensors of the absolute zero.
    pub hall: HallConfig,
    /// Air and machine temperature.
    pub climate: ClimateConfig,
    /// The laser interferometer's optics.
    pub interferometer: InterferometerConfig,
}

impl PlantConfig {
    /// What stands in place of the stage, of each kind; their axes are numbered in this order.
    pub(super) fn others(&self) -> [Option<&dyn Section>; 4] {
        [
            self.gantry.as_ref().map(|it| it as &dyn Section),
            self.platform.as_ref().map(|it| it as &dyn Section),
            self.volumetric.as_ref().map(|it| it as &dyn Section),
            self.table.as_ref().map(|it| it as &dyn Section),
        ]
    }

    /// Travel of one encoder count of the machine's axes.
    pub fn resolution_nm(&self) -> f64 {
        let mut others = self.others().into_iter().flatten();
        let other = others.find_map(Section::resolution_nm);
        other.unwrap_or(self.stage.encoder.resolution_nm)
    }

    /// What makes no machine: numbers that no kind has, and more than one kind.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let mut others = self.others().into_iter().flatten();
        others.try_for_each(Section::check)?;
        if self.platform.is_some() {
            positive("field_mm", self.camera.field_mm)?;
        }
        self.is_one_machine()
    }

    /// What a camera looks at must be there.
    pub(crate) fn check_scene(&self, scene: Scene) -> Result<(), ConfigError> {
        match scene {
            Scene::Marks => Ok(()),
            Scene::Beam { axis: 0..=2, .. } if self.volumetric.is_some() => Ok(()),
            Scene::Beam { axis, .. } => Err(ConfigError::Value {
                key: "looks_at.beam.axis",
                seen: axis as f64,
                expected: "an axis from 0 to 2 of [plant.volumetric]",
            }),
        }
    }

    /// A machine is one thing or the other; only a table stands beside three axes.
    fn is_one_machine(&self) -> Result<(), ConfigError> {
        let others = self.others().into_iter().flatten().count();
        let is_beside = self.table.is_some() && self.volumetric.is_some();
        if others <= 1 + usize::from(is_beside) {
            return Ok(());
        }
        Err(ConfigError::Value {
            key: "gantry and platform and table and volumetric",
            seen: others as f64,
            expected: "at most one of them, or a table beside volumetric",
        })
    }
}
