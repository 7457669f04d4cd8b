//! Cognex In-Sight vision systems in Native Mode.

use drivers::device::PoseInstrument;
use drivers::device::in_sight::{CameraFrame, InSight, InSightSettings};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Metres, Radians};
use wire::in_sight::Cell;

use super::{CameraConfig, CameraKeys, Family};
use crate::config::judge::Judge;
use crate::hardware::CHECKED;

/// What only an In-Sight vision system has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct InSightConfig {
    /// The job that must be active; each pose begins by asking for it.
    #[schemars(extend("x-range" = "ends in `.job` or `.jobx`"))]
    #[schemars(extend("x-own" = true))]
    pub job: String,
    /// What it must call itself.
    pub serial_number: Option<String>,
    /// The cell of text in which the job puts `count,found,judgement,x,y,angle,score`.
    #[schemars(extend("x-range" = "a letter and a row, `\"A0\"` to `\"Z399\"`"))]
    #[schemars(extend("x-own" = true))]
    pub result_cell: String,
    /// One unit of the job's x and y.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    #[schemars(extend("x-own" = true))]
    pub length_um_per_unit: f64,
    /// One unit of the job's angle; 3600 for degrees.
    #[schemars(range(min = 1e-06, max = 1000000.0))]
    pub angle_arcsec_per_unit: f64,
    /// The cameras' x axis against the machine's, counter-clockwise.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    #[schemars(extend("x-own" = true))]
    pub rotation_deg: f64,
    /// The cameras' y axis goes the other way, as when they look from below; their angles then do,
    /// too.
    #[serde(default)]
    pub mirrored: bool,
    /// Marks that a good picture shows.
    #[schemars(range(min = 1, max = 100))]
    pub targets: u32,
    /// A picture with a lower score is bad, whatever the job says.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub score_min_percent: f64,
}

impl InSightConfig {
    /// What its driver is told; the configuration has been checked.
    ///
    /// # Panics
    /// When the result cell is none.
    pub fn settings(&self, common: &CameraConfig, patience: Patience) -> InSightSettings {
        let cell = Cell::parse(&self.result_cell).expect(CHECKED);
        let usual = InSightSettings::new(&self.job, cell);
        InSightSettings {
            serial_number: self.serial_number.clone(),
            length_unit: Metres::from_um(self.length_um_per_unit),
            angle_unit: Radians::from_arcsec(self.angle_arcsec_per_unit),
            frame: CameraFrame {
                rotation: Radians::from_degrees(self.rotation_deg),
                mirrored: self.mirrored,
            },
            targets: self.targets,
            score_min: self.score_min_percent / 100.0,
            rejects_max: common.rejects_max,
            start_timeout: patience.of(usual.start_timeout),
            answer_timeout: patience.of(usual.answer_timeout),
            inspection_timeout: patience.of(common.inspection_timeout()),
            ..usual
        }
    }
}

impl Family for InSightConfig {
    fn check(&self, judge: &mut Judge<'_>) {
        let job = self.job.to_ascii_lowercase();
        let own = job.strip_suffix(".job").or(job.strip_suffix(".jobx"));
        if own.is_none_or(|it| it.trim().is_empty()) {
            judge.say(
                "job",
                format!("`{}` is not the name of a job", self.job),
                "give the name that In-Sight Explorer shows, with `.job` or `.jobx`",
            );
        }
        if self
            .serial_number
            .as_ref()
            .is_some_and(|it| it.trim().is_empty())
        {
            judge.say(
                "serial_number",
                "is empty, and no camera calls itself so",
                "give the number on its plate, or leave the key out",
            );
        }
        if Cell::parse(&self.result_cell).is_none() {
            judge.say(
                "result_cell",
                format!("`{}` is not a cell", self.result_cell),
                "give a letter and a row, such as \"C7\"",
            );
        }
    }

    fn driver(&self, common: &CameraConfig, patience: Patience) -> Box<dyn PoseInstrument> {
        Box::new(InSight::new(self.settings(common, patience)))
    }

    fn keys(&self) -> CameraKeys {
        CameraKeys {
            length_um_per_unit: self.length_um_per_unit,
            angle_arcsec_per_unit: self.angle_arcsec_per_unit,
            rotation: Radians::from_degrees(self.rotation_deg),
            mirrored: self.mirrored,
            targets: self.targets,
        }
    }

    fn teaching(&self) -> Vec<(&'static str, Option<&str>)> {
        vec![
            ("serial_number", self.serial_number.as_deref()),
            ("job", Some(&self.job)),
            ("result_cell", Some(&self.result_cell)),
        ]
    }
}
