//! What a journal says of three axes: how their errors are to be found, what their detectors read
//! when that began, and each line with its readings. A file of such lines can be evaluated again
//! without the machine and its configuration.

use compensator::volumetric::identify::{Observation, Reading};
use compensator::volumetric::{Axis, Point};
use serde::{Deserialize, Serialize};
use units::{Metres, Radians};

use crate::store::IdentityRecord;
use crate::volumetric::{AXES, BeamReferencesContent, FunctionShape};

/// Nobody warms a machine up for longer: seventy days.
pub(crate) const MINUTES_MAX: f64 = 1e5;

/// What a line is read with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OpticsName {
    /// Displacements along the line.
    #[default]
    Linear,
    /// Displacements across the line.
    Straightness,
    /// Tilts.
    Angular,
}

/// One line that is to be read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineEntry {
    /// Where it begins, machine coordinates.
    pub from_m: [f64; 3],
    /// Where it ends.
    pub to_m: [f64; 3],
    /// The offset of the point that is measured.
    pub tool_m: [f64; 3],
    /// What it is read with.
    pub optics: OpticsName,
    /// The direction across which these optics look, or about which.
    pub sees: Option<char>,
    /// What it is for.
    pub purpose: String,
    /// At how many places.
    pub points: usize,
    /// Whether it is read again because the machine is warmer.
    pub warm: bool,
    /// The number of the unknown angle at which a straightedge lies.
    pub angle: Option<usize>,
    /// Whether the machine's own detectors read it, and nobody sets anything up.
    pub by_detectors: bool,
}

/// An expansion that is to be found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExpansionEntry {
    /// Along which axis.
    pub axis: char,
    /// By the mean of which thermometers, from 0.
    pub thermometers: Vec<usize>,
}

/// A bending guide that is to be found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BendEntry {
    /// Whose guide.
    pub axis: char,
    /// Where a positive bow goes.
    pub towards: char,
    /// The thermometer over its neutral plane, from 0.
    pub over: usize,
    /// The one under it.
    pub under: Option<usize>,
    /// Where the arc begins.
    pub low_m: f64,
    /// Where it ends.
    pub high_m: f64,
    /// Where the detector on its slide sits, whose displacements were taken off the readings.
    #[serde(default)]
    pub seen_from_m: Option<[f64; 3]>,
}

/// How the errors of three axes are to be found: what a run that is continued must have in common
/// with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VolumePlanEntry {
    /// Which axis stands on which.
    pub chain: String,
    /// The work volume's lowest corner.
    pub low_m: [f64; 3],
    /// Its highest.
    pub high_m: [f64; 3],
    /// The offset of the tool in use.
    pub tool_m: [f64; 3],
    /// Where positioning errors and tilts are zero.
    pub zero_m: [f64; 3],
    /// Where along x, y and z the errors are wanted.
    pub nodes_m: [Vec<f64>; 3],
    /// Which error functions, by the letters of ISO 230-1.
    pub functions: Vec<String>,
    /// How they run between the nodes; `None` in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<FunctionShape>,
    /// The lines, in the order in which they are read.
    pub lines: Vec<LineEntry>,
    /// Standard uncertainty of what a thermometer shows, kelvin.
    pub thermometer_u_k: f64,
    /// Expansions to be found; none where all lines count as read at one warmth.
    pub expansions: Vec<ExpansionEntry>,
    /// Likewise bends.
    pub bends: Vec<BendEntry>,
    /// From where scales expand.
    pub fixed_m: [f64; 3],
    /// Who the drives of x, y and z are; empty where that is not known.
    pub drives: Vec<IdentityRecord>,
    /// For how many minutes all axes go to and fro before the lines that are read warm; `None` where something else
    /// warms them, where none are read warm, and in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warm_up_min: Option<f64>,
}

/// What the detectors read before the first line: everything after it counts from there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VolumeReferencesEntry {
    /// By axis.
    pub content: BeamReferencesContent,
    /// What the thermometers showed, °C.
    pub temperatures_c: Vec<f64>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

/// A reading of a line.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineReadingEntry {
    /// Of which line of the plan, from 0.
    pub line: usize,
    /// Where the machine was sent.
    pub at_m: [f64; 3],
    /// The offset of the point that was measured.
    pub tool_m: [f64; 3],
    /// The direction of a displacement, of length 1.
    pub along: Option<[f64; 3]>,
    /// The direction about which a tilt was read.
    pub about: Option<char>,
    /// What was read: actual − target, metres or radians.
    pub read_si: f64,
    /// The same less what the detectors saw beyond their references then.
    pub deviation_si: f64,
    /// Its standard uncertainty.
    pub u_si: f64,
    /// What all lines have in common of that, with the sign that one error of the instrument has here; 0 in files of
    /// earlier programs.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub common_si: f64,
    /// Likewise what all readings of its line have in common of that, and no others.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub common_of_line_si: f64,
    /// Standard deviation of the samples averaged, of the path that was counted.
    pub scatter_m: Option<f64>,
    /// What the slides were displaced by beyond the references: across x, y, z, two directions each.
    pub sideways_m: [[f64; 2]; 3],
    /// By what they had rolled.
    pub roll_rad: [f64; 3],
    /// How far the beams along x, y and z had moved at their ends, two directions each, which was counted
    /// in `sideways_m`; of a line that detectors read, in what they read. `None` in files of earlier
    /// programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam_shift_m: Option<[[f64; 2]; 3]>,
    /// What the thermometers showed, °C.
    pub temperatures_c: Vec<Option<f64>>,
    /// What the machine was corrected by, where it was.
    pub correction_m: Option<[f64; 3]>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

/// A line was read to its end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineReadEntry {
    /// Which line of the plan, from 0.
    pub line: usize,
    /// Means of what the thermometers showed, °C.
    pub temperatures_c: Vec<f64>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

/// A line contradicts the others: what was read of it does not count, and it is to be read again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineVoidEntry {
    /// Which line of the plan, from 0.
    pub line: usize,
}

/// Which line a verification reads, and by what the machine is corrected meanwhile.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VolumeCheckEntry {
    /// `as found`, `by tables alone`, `as left`.
    pub state: String,
    /// Where the line begins.
    pub from_m: [f64; 3],
    /// Where it ends.
    pub to_m: [f64; 3],
    /// The offset of the point that is measured.
    pub tool_m: [f64; 3],
    /// What the range of the deviations may be.
    pub limit_m: f64,
}

impl LineReadingEntry {
    /// An observation of the line with this number, as it was read.
    pub fn of(line: usize, observation: &Observation) -> Self {
        let (along, about, read_si, u_si) = parts(&observation.reading);
        Self {
            line,
            at_m: metres(observation.at),
            tool_m: metres(observation.tool),
            along,
            about,
            read_si,
            deviation_si: read_si,
            u_si,
            common_si: observation.common,
            common_of_line_si: observation.common_of_run,
            ..Self::default()
        }
    }

    /// As an identification takes it, from setting number `run` of the instrument; `None` where
    /// it says no direction.
    pub fn observation(&self, run: usize) -> Option<Observation> {
        let reading = match (self.along, self.about) {
            (Some(along), None) => Reading::Length {
                along,
                deviation: Metres(self.deviation_si),
                u: Metres(self.u_si),
            },
            (None, Some(letter)) => Reading::Angle {
                about: Axis::of_letter(letter)?,
                deviation: Radians(self.deviation_si),
                u: Radians(self.u_si),
            },
            _ => return None,
        };
        Some(Observation {
            at: point(self.at_m),
            tool: point(self.tool_m),
            run,
            reading,
            common: self.common_si,
            common_of_run: self.common_of_line_si,
        })
    }
}

fn is_nothing(value: &f64) -> bool {
    *value == 0.0
}

fn parts(reading: &Reading) -> (Option<[f64; 3]>, Option<char>, f64, f64) {
    match *reading {
        Reading::Length {
            along,
            deviation,
            u,
        } => (Some(along), None, deviation.value(), u.value()),
        Reading::Angle {
            about,
            deviation,
            u,
        } => {
            let letter = AXES[about.index()];
            (None, Some(letter), deviation.value(), u.value())
        }
    }
}

/// As files have it.
pub(crate) fn metres(point: Point) -> [f64; 3] {
    [point.x, point.y, point.z].map(|it| it.value())
}

/// From a file.
pub(crate) fn point(metres: [f64; 3]) -> Point {
    let [x, y, z] = metres.map(Metres);
    Point::new(x, y, z)
}
