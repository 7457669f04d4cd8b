//! Readings that scatter too much, named by the lines that the operator set up.

use core::fmt;

use compensator::volumetric::Point;
use compensator::volumetric::identify::{Conspicuous, Observation, Reading, Scattered};
use units::{Metres, Radians};

use crate::volumetric::{VolumeLog, VolumePlanEntry};

/// Readings that scatter more than they may.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// In units of what was stated of them.
    pub seen: f64,
    /// What it may be.
    pub limit: f64,
    /// How many readings are beyond the unknowns.
    pub spare: usize,
    /// Where to look first, the worst first.
    pub worst: Vec<WorstReading>,
}

/// The reading of a line that fits the others least.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstReading {
    /// Which line, from 1, as the page counts them.
    pub line: usize,
    /// What that is for.
    pub purpose: String,
    /// Where it was read.
    pub at: Point,
    /// By how much it is off, were it the only wrong one.
    pub off: Off,
    /// The same in units of what is to be expected of it.
    pub times: f64,
}

/// What a reading is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Off {
    /// A displacement.
    Length(Metres),
    /// A tilt.
    Angle(Radians),
}

impl fmt::Display for Off {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(it) => write!(f, "{:+.2} um", it.um()),
            Self::Angle(it) => write!(f, "{:+.2} arcsec", it.arcsec()),
        }
    }
}

impl Scatter {
    /// What `scattered` says of the lines of `plan`, of which those that are whole were evaluated.
    pub(super) fn of(
        scattered: &Scattered,
        plan: &VolumePlanEntry,
        read: &VolumeLog,
        observations: &[Observation],
    ) -> Self {
        let whole = read.whole.iter().map(|it| it.line);
        let whole: Vec<usize> = whole.filter(|it| *it < plan.lines.len()).collect();
        let worst = scattered.worst.iter().filter_map(|it| {
            let line = *whole.get(it.run)?;
            let purpose = plan.lines.get(line)?.purpose.clone();
            let observation = observations.get(it.index)?;
            Some(WorstReading {
                line: line + 1,
                purpose,
                at: observation.at,
                off: off(observation.reading, it),
                times: it.times.abs(),
            })
        });
        Self {
            seen: scattered.ratio,
            limit: scattered.limit,
            spare: scattered.degrees_of_freedom,
            worst: worst.collect(),
        }
    }
}

fn off(reading: Reading, seen: &Conspicuous) -> Off {
    match reading {
        Reading::Length { .. } => Off::Length(Metres(seen.off)),
        Reading::Angle { .. } => Off::Angle(Radians(seen.off)),
    }
}

impl fmt::Display for Scatter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the readings scatter {:.2} times as much as their stated uncertainties, the limit is \
             {:.2} times ({} readings beyond the unknowns); nothing was stored, what was in use \
             stays in use",
            self.seen, self.limit, self.spare
        )?;
        for (at, it) in self.worst.iter().enumerate() {
            let [x, y, z] = [it.at.x, it.at.y, it.at.z].map(Metres::mm);
            let head = if at == 0 { "; look first at" } else { "," };
            write!(
                f,
                "{head} line {} ({}) at ({x:.3}, {y:.3}, {z:.3}) mm, {} off what the others \
                 predict, {:.0} times what is expected",
                it.line, it.purpose, it.off, it.times
            )?;
        }
        f.write_str(
            "; a lost beam, steps of half a wavelength, a loose reflector, vibration or a machine \
             that changed between two lines are usual causes: remove the cause and calibrate \
             again; or the nodes are too far apart for errors that change so fast (step_mm), or \
             the instrument is less certain than stated (instrument_standard_uncertainty_nm)",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_set_the_lines_up_reads_which_one_to_look_at_first() {
        let worst = WorstReading {
            line: 17,
            purpose: "squarenesses".into(),
            at: Point::from_mm(500.0, 400.0, 300.0),
            off: Off::Length(Metres::from_mm(1.0)),
            times: 812.4,
        };
        let tilt = WorstReading {
            line: 4,
            off: Off::Angle(Radians::from_arcsec(-2.5)),
            ..worst.clone()
        };
        let text = Scatter {
            seen: 546.0,
            limit: 2.0,
            spare: 210,
            worst: vec![worst, tilt],
        }
        .to_string();
        for part in [
            "546.00 times",
            "the limit is 2.00 times",
            "210 readings",
            "nothing was stored",
            "line 17 (squarenesses) at (500.000, 400.000, 300.000) mm, +1000.00 um off",
            "812 times",
            "line 4 (squarenesses)",
            "-2.50 arcsec",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
