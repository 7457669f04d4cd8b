//! What a journal says of a linear axis.

use compensator::hall_zero::{Held, Outcome};
use machine::BusFigures;
use serde::{Deserialize, Serialize};
use units::Approach;

use crate::linear::record::PlaceRecord;
use crate::store::EnvironmentRecord;
use crate::store::budget::PlacesBudgetRecord;

/// One measured point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointEntry {
    /// Which run, from 1.
    pub run: u32,
    /// `+` or `-`.
    pub approach: char,
    /// Where it should be, metres.
    pub target_m: f64,
    /// What the drive was sent, metres.
    pub set_point_m: f64,
    /// What the encoder said, metres.
    pub encoder_m: f64,
    /// What the instrument said, corrected, metres.
    pub measured_m: f64,
    /// Standard deviation of the readings averaged, metres.
    pub scatter_m: f64,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
    /// The environment then.
    pub environment: EnvironmentRecord,
}

impl PointEntry {
    /// From which side the stage had come.
    pub(super) const fn side(&self) -> Approach {
        match self.approach {
            '-' => Approach::Reverse,
            _ => Approach::Forward,
        }
    }
}

/// What a zero search found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZeroEntry {
    /// The origin in the drive's coordinates before it became zero, metres.
    pub origin_m: f64,
    /// Its standard uncertainty, metres.
    pub standard_uncertainty_m: f64,
    /// The patent's P0 in the same coordinates, metres.
    pub patent_p0_m: f64,
    /// Highest voltage of the peak sensor, volts.
    pub peak_max_v: f64,
    /// Voltage of the slope sensor at the origin, volts.
    pub mid_v: f64,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
    /// What makes it uncertain; `None` in journals of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<PlacesBudgetRecord>,
}

/// By what a verification is judged, and how uncertain the corrected position is; written before its first point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CriterionEntry {
    /// What the bidirectional accuracy may be, metres.
    pub tolerance_m: f64,
    /// How uncertain the corrected position is at each target; empty for a measurement as found.
    pub targets: Vec<PlaceRecord>,
}

/// Both sensors at one of the places where a zero search stood still: means of its samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldEntry {
    /// Where, in the drive's coordinates before the origin became zero, metres.
    pub position_m: f64,
    /// Of the even sensor, volts.
    pub peak_v: f64,
    /// Of the odd one, volts.
    pub slope_v: f64,
}

/// What a zero search read of both Hall sensors on its way, and where its steps ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HallSweepEntry {
    /// Where samples were taken, in the order of time, in the drive's coordinates before the origin became zero,
    /// metres. Of a long search not every sample is kept.
    pub positions_m: Vec<f64>,
    /// What the even sensor showed there, volts.
    pub peak_v: Vec<f64>,
    /// What the odd one showed, volts.
    pub slope_v: Vec<f64>,
    /// Where the even sensor was highest (G7), metres.
    pub peak_m: f64,
    /// What it showed there (V1max), volts.
    pub peak_max_v: f64,
    /// G1 with P1.
    pub g1: HeldEntry,
    /// G2 with P2.
    pub g2: HeldEntry,
    /// G8 with P0.
    pub p0: HeldEntry,
}

/// So many samples of a search are kept at most.
const SAMPLES_MAX: usize = 200;

impl HallSweepEntry {
    /// Of a search that found its zero.
    pub(crate) fn of(outcome: &Outcome) -> Self {
        let held = |it: &Held| HeldEntry {
            position_m: it.position.value(),
            peak_v: it.peak.value(),
            slope_v: it.slope.value(),
        };
        let samples = &outcome.samples;
        let highest = samples.iter();
        let highest = highest.max_by(|a, b| a.peak.value().total_cmp(&b.peak.value()));
        let every = samples.len().div_ceil(SAMPLES_MAX).max(1);
        let kept = || samples.iter().step_by(every);
        Self {
            positions_m: kept().map(|it| it.position.value()).collect(),
            peak_v: kept().map(|it| it.peak.value()).collect(),
            slope_v: kept().map(|it| it.slope.value()).collect(),
            peak_m: highest
                .map_or(outcome.p0.position, |it| it.position)
                .value(),
            peak_max_v: outcome.peak_max.value(),
            g1: held(&outcome.g1),
            g2: held(&outcome.g2),
            p0: held(&outcome.p0),
        }
    }
}

/// How late the SYNCs of a bus were since the program was connected, when a run ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SyncsEntry {
    /// The bus.
    pub bus: String,
    /// How many were sent.
    pub sent: u64,
    /// How many were left out because they were more than half a period late.
    pub skipped: u64,
    /// Which share of them was no later than what stands in `late_s` at the same place.
    pub shares: Vec<f64>,
    /// Seconds; the last one is the latest of all.
    pub late_s: Vec<f64>,
}

/// The shares of SYNCs whose lateness is kept; the last one is the latest of all.
const SHARES: [f64; 4] = [0.5, 0.99, 0.999, 1.0];

impl SyncsEntry {
    /// Of each bus whose SYNCs a thread sends: where time is simulated none is late.
    pub(super) fn of(buses: Vec<BusFigures>) -> Vec<Self> {
        let each = buses.into_iter();
        each.filter_map(|it| {
            let sync = it.sync?;
            let late = SHARES.map(|share| sync.lateness.percentile(share).as_secs_f64());
            Some(Self {
                bus: it.name,
                sent: sync.sent,
                skipped: sync.skipped,
                shares: SHARES.to_vec(),
                late_s: late.to_vec(),
            })
        })
        .collect()
    }
}

/// How far the stage of a gantry was turned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotationEntry {
    /// Both sides.
    pub axes: [String; 2],
    /// The journals of their zeros.
    pub zeros: [String; 2],
    /// Their zero points, each in its drive's coordinates before they became zero, metres.
    pub origins_m: [f64; 2],
    /// The side that is ahead at positive angles.
    pub ahead_when_positive: String,
    /// From the one side to the other, metres.
    pub distance_m: f64,
    /// Its standard uncertainty, metres.
    pub distance_u_m: f64,
    /// How well an encoder tells a short length, as a share of it.
    pub scale_u: f64,
    /// How far the stage was turned where both drives showed the same, radians.
    pub angle_rad: f64,
    /// Standard uncertainty of that, radians.
    pub standard_uncertainty_rad: f64,
    /// How well that is known; `None` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
    /// The angle at acceptance, radians, where the configuration says it.
    pub angle_at_acceptance_rad: Option<f64>,
    /// How far it may differ from that, radians.
    pub angle_limit_rad: Option<f64>,
    /// Standard uncertainty of where the stage stands now against its zero, radians: both sides' zeros, each on a
    /// whole count.
    pub zero_u_rad: f64,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

impl RotationEntry {
    /// By how much the angle differs from that at acceptance.
    pub fn change_rad(&self) -> Option<f64> {
        Some(self.angle_rad - self.angle_at_acceptance_rad?)
    }

    /// Whether that is within its limit; so is what nothing is compared with.
    pub fn is_within_limit(&self) -> bool {
        let judged = self.change_rad().zip(self.angle_limit_rad);
        judged.is_none_or(|(change, limit)| change.abs() <= limit)
    }
}

/// What a job is: the first line of its journal after the header.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JobEntry {
    /// What its points are called, in order; where they are, the header says.
    pub names: Vec<String>,
    /// How often they are gone through.
    pub repetitions: u32,
    /// How long the axis stands before its place is read, seconds.
    pub settle_s: f64,
    /// Where the axis goes at the end, metres, where it is told to.
    pub end_m: Option<f64>,
    /// When it goes on from each point, in words; empty in journals of programs that did not keep it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub go_on: Vec<String>,
}

/// A point of a job that was reached, written before the next one is wanted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachedEntry {
    /// Which repetition, from 1.
    pub repetition: u32,
    /// Which point, from 1.
    pub number: usize,
    /// `+` or `-`.
    pub approach: char,
    /// Where it should be, metres.
    pub target_m: f64,
    /// The calibrated positions before and behind it, metres; `None` beyond the calibrated range.
    pub interval_m: Option<[f64; 2]>,
    /// What the drive was sent, metres.
    pub set_point_m: f64,
    /// What the encoder said, metres.
    pub encoder_m: f64,
    /// Where the point itself stands by encoder and calibration, metres.
    pub place_m: Option<f64>,
    /// Standard uncertainty of that, metres; `None` where none is stated.
    pub u_m: Option<f64>,
    /// The same expanded (k = 2), metres.
    pub expanded_u_m: Option<f64>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

/// The next point of a job was wanted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WentOnEntry {
    /// Which repetition, from 1.
    pub repetition: u32,
    /// From which point, from 1.
    pub number: usize,
    /// `time`, `operator` or `input`.
    pub by: String,
    /// How long the axis stood there, seconds.
    pub waited_s: f64,
    /// What the input showed, volts, where one was waited for.
    pub seen_v: Option<f64>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}
