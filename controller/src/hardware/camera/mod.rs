//! Image controllers: `[camera.NAME]`.

pub(crate) mod in_sight;

use core::time::Duration;

use drivers::device::PoseInstrument;
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::Radians;

use super::bus::Wiring;
use crate::config::judge::Judge;
pub(crate) use in_sight::InSightConfig;

/// An image controller, by what `device` calls it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "device", rename_all = "snake_case")]
pub enum CameraDevice {
    /// A Cognex In-Sight vision system in Native Mode.
    ///
    /// The job: `count` is the spreadsheet function `Count` over the image, `found` the number of marks
    /// found, `judgement` 1 for good and 0 for bad, the pose 0 where nothing was found, `score` 0 to
    /// 100, of the worst mark. The seven are put into one cell of text, separated by commas, with
    /// decimal points. The count is how a picture is told from the one before it: do not reset it while
    /// the machine runs.
    InSight(InSightConfig),
}

/// What a family of image controllers is to a machine.
pub(crate) trait Family {
    /// Judges what its keys must keep to together.
    fn check(&self, judge: &mut Judge<'_>);

    /// Its driver; the configuration has been checked.
    fn driver(&self, common: &CameraConfig, patience: Patience) -> Box<dyn PoseInstrument>;

    /// What turns its numbers into poses.
    fn keys(&self) -> CameraKeys;

    /// Which camera it must be and what it was taught, by the names of the keys.
    fn teaching(&self) -> Vec<(&'static str, Option<&str>)>;
}

/// What turns a camera's numbers into poses: the keys of this name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraKeys {
    pub(crate) length_um_per_unit: f64,
    pub(crate) angle_arcsec_per_unit: f64,
    pub(crate) rotation: Radians,
    pub(crate) mirrored: bool,
    /// Marks that a good picture shows.
    pub(crate) targets: u32,
}

impl CameraDevice {
    fn family(&self) -> &dyn Family {
        match self {
            Self::InSight(family) => family,
        }
    }
}

/// An image controller.
///
/// It sees where the machine's platform is, from where it was taught. It is started when a
/// procedure first needs it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct CameraConfig {
    /// What it is.
    #[serde(flatten)]
    pub device: CameraDevice,
    /// The line that it is on.
    #[schemars(extend("x-range" = "a `[serial.NAME]`"))]
    pub line: String,
    /// So many bad pictures may be left out of one pose; one more, and there is no pose.
    #[schemars(range(min = 0, max = 1000))]
    pub rejects_max: u32,
    /// How long taking and judging a picture may take.
    #[schemars(range(min = 10.0, max = 60000.0))]
    pub inspection_timeout_ms: f64,
    /// Of the cameras' own scale and teaching; what scatters from picture to picture is measured.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub standard_uncertainty_um: f64,
    /// Likewise of the angle.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub standard_uncertainty_arcsec: f64,
}

impl CameraConfig {
    /// How long one picture may take.
    pub(crate) fn inspection_timeout(&self) -> Duration {
        Duration::from_secs_f64(self.inspection_timeout_ms * 1e-3)
    }

    /// What turns its numbers into poses.
    pub(crate) fn keys(&self) -> CameraKeys {
        self.device.family().keys()
    }

    /// Which camera it must be and what it was taught, by the names of the keys: its places count from that.
    pub(crate) fn teaching(&self) -> Vec<(&'static str, Option<&str>)> {
        self.device.family().teaching()
    }

    /// Judges what its keys must keep to together.
    pub(crate) fn check(&self, judge: &mut Judge<'_>, wiring: Wiring<'_>) {
        judge.known("line", &self.line, wiring.serial, "serial");
        self.device.family().check(judge);
    }

    /// Its driver; the configuration has been checked.
    pub(crate) fn driver(&self, patience: Patience) -> Box<dyn PoseInstrument> {
        self.device.family().driver(self, patience)
    }
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");

    #[track_caller]
    fn check(from: &str, to: &str, key: &str) {
        match parse(&UVW.edit(from, to), "uvw.toml") {
            Err(ConfigError::Invalid { findings }) => {
                assert!(findings.iter().any(|it| it.key == key), "{findings:?}");
            }
            other => panic!("{to}: {other:?}"),
        }
    }

    #[test]
    fn the_shipped_platform_is_sound() {
        parse(UVW, "uvw.toml").unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn what_no_camera_can_be_is_found_where_it_stands() {
        check("line = \"vision\"", "line = \"visoin\"", "camera.eye.line");
        check("platform.job", "platform", "camera.eye.job");
        check("platform.job", " .job", "camera.eye.job");
        let job = "job = \"platform.job\"";
        let numbered = format!("{job}\nserial_number = \" \"");
        check(job, &numbered, "camera.eye.serial_number");
        check("\"C7\"", "\"C400\"", "camera.eye.result_cell");
        let key = "camera.eye.length_um_per_unit";
        check("um_per_unit = 1.0", "um_per_unit = nan", key);
        let key = "camera.eye.angle_arcsec_per_unit";
        check("arcsec_per_unit = 1.0", "arcsec_per_unit = 0.0", key);
        check(
            "rotation_deg = 0.0",
            "rotation_deg = inf",
            "camera.eye.rotation_deg",
        );
        check("targets = 2", "targets = 0", "camera.eye.targets");
        let key = "camera.eye.score_min_percent";
        check("score_min_percent = 60.0", "score_min_percent = 101.0", key);
        let key = "camera.eye.inspection_timeout_ms";
        check("timeout_ms = 2000.0", "timeout_ms = 0.0", key);
    }
}
