//! Readings that contradict each other, named by the lines that the operator set up: by a few that are
//! grossly wrong, or all together by their scatter.

use core::fmt;

use compensator::volumetric::Point;
use compensator::volumetric::identify::{Observation, Scattered, Snooped, scatter_limit};
use units::Metres;

use super::cause::LikelyCauses;
use super::gross::GrossReading;
use super::off::Off;
use crate::volumetric::{VolumeLog, VolumePlanEntry};

/// Readings that are grossly wrong, or scatter more than they may.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// How much they scatter, in units of what was stated of them.
    pub seen: f64,
    /// What it may be.
    pub limit: f64,
    /// How many readings are beyond the unknowns.
    pub spare: usize,
    /// Where to look first, the worst first.
    pub worst: Vec<WorstReading>,
    /// Those that are grossly wrong.
    pub gross: Vec<GrossReading>,
    /// How much the others scatter without them.
    pub left: f64,
    /// What explains all readings, none left out.
    pub causes: LikelyCauses,
    /// Whether the run can be continued, with these lines measured again.
    pub is_run: bool,
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

impl Scatter {
    /// What `scattered` and `snooped` say of the lines of `plan`, of which those that are whole were
    /// evaluated; `None` where nothing contradicts.
    pub(super) fn of(
        scattered: &Scattered,
        (snooped, causes): (&Snooped, LikelyCauses),
        plan: &VolumePlanEntry,
        read: &VolumeLog,
        observations: &[Observation],
    ) -> Self {
        let whole = read.whole.iter().map(|it| it.line);
        let whole: Vec<usize> = whole.filter(|it| *it < plan.lines.len()).collect();
        let gross = snooped.found.iter();
        let gross = gross.filter_map(|it| GrossReading::of(it, plan, read, observations));
        let worst = scattered.worst.iter().filter_map(|it| {
            let line = *whole.get(it.run)?;
            let purpose = plan.lines.get(line)?.purpose.clone();
            let observation = observations.get(it.index)?;
            Some(WorstReading {
                line: line + 1,
                purpose,
                at: observation.at,
                off: Off::of(observation.reading, it.off),
                times: it.times.abs(),
            })
        });
        Self {
            seen: scattered.ratio,
            limit: scattered.limit,
            spare: scattered.degrees_of_freedom,
            worst: worst.collect(),
            gross: gross.collect(),
            left: snooped.ratio_left.unwrap_or(0.0),
            causes,
            is_run: !plan.drives.is_empty(),
        }
    }

    /// The lines, from 0, that have to be measured again; none where it is no matter of single lines.
    pub(super) fn lines(&self) -> Vec<usize> {
        let Some(mut lines) = self.causes.lines() else {
            return Vec::new();
        };
        if self.is_gross() {
            let gross = self.gross.iter().flat_map(GrossReading::lines);
            lines.extend(gross.map(|it| it - 1));
        }
        lines.sort_unstable();
        lines.dedup();
        lines
    }

    /// Those of them that are read again when the run is continued: what the machine's own detectors read
    /// counts from the references of the run, and would be the same.
    pub(super) fn void(&self) -> Vec<usize> {
        if self.is_gross() && self.gross.iter().any(|it| it.by_detectors) {
            return Vec::new();
        }
        self.lines()
    }

    /// Whether what is grossly wrong is all that is.
    fn is_explained(&self) -> bool {
        let spare = self.spare.saturating_sub(self.gross.len());
        !self.gross.is_empty() && self.left <= scatter_limit(spare)
    }

    /// Whether what is grossly wrong is to be told: nothing that leaves no reading out is far likelier.
    fn is_gross(&self) -> bool {
        self.is_explained() && (self.causes.told.is_empty() || self.causes.gross_as_well)
    }

    fn write_causes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the readings scatter {:.2} times as much as their stated uncertainties, the limit is {:.2} \
             times ({} readings beyond the unknowns); nothing was stored, what was in use stays in use; ",
            self.seen, self.limit, self.spare
        )?;
        let count = self.causes.told.len();
        f.write_str(match count {
            1 => "one cause explains all of them, none left out",
            _ => "each of these causes alone explains all of them, none left out, and the readings do not \
                  tell which it is",
        })?;
        for (cause, ratio) in &self.causes.told {
            write!(
                f,
                "; likely cause: {cause} (the readings then scatter {ratio:.2} times)"
            )?;
        }
        if self.is_gross() {
            f.write_str("; or single readings are wrong, which explains the others as well: ")?;
            self.write_gross(f)?;
        } else if self.is_run && !self.void().is_empty() {
            f.write_str(
                "; `truestage calibrate --resume` with this run's journal reads the lines named here once \
                 more, and keeps all other lines",
            )?;
        }
        Ok(())
    }

    fn write_gross(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "readings contradict the others: all together scatter {:.2} times as much as their stated \
             uncertainties, without these {:.2} times; nothing was stored, what was in use stays in use",
            self.seen, self.left
        )?;
        for it in &self.gross {
            write!(f, "; {it}")?;
        }
        let lines = self.lines().into_iter().map(|it| (it + 1).to_string());
        let lines = lines.collect::<Vec<_>>().join(" and ");
        let by_detectors = self.gross.iter().any(|it| it.by_detectors);
        match (self.is_run, by_detectors) {
            (true, false) => write!(
                f,
                "; remove the cause and measure line {lines} again: `truestage calibrate --resume` with this \
                 run's journal reads what is named here once more, and keeps all other lines"
            ),
            (true, true) => f.write_str(
                "; the machine's own detectors read one of these lines with their references: look for what has \
                 shifted or covers the beam, and start a new calibration without --resume",
            ),
            (false, _) => write!(
                f,
                "; measure line {lines} again and put its readings in place of these"
            ),
        }
    }
}

impl fmt::Display for Scatter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.causes.told.is_empty() {
            return self.write_causes(f);
        }
        if self.is_explained() {
            return self.write_gross(f);
        }
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
    use compensator::volumetric::identify::GrossKind;
    use units::Radians;

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
            gross: Vec::new(),
            left: 546.0,
            causes: LikelyCauses::default(),
            is_run: true,
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

    fn slipped(line: usize, by_detectors: bool) -> Scatter {
        let gross = GrossReading {
            line,
            purpose: "squarenesses".into(),
            by_detectors,
            number: 7,
            at: Point::from_mm(500.0, 400.0, 300.0),
            kind: GrossKind::Slip,
            seen: Off::Length(Metres::from_um(10.0)),
            off: Off::Length(Metres::from_um(9.5)),
            times: 61.2,
            limit: 5.4,
            rivals: vec![4],
        };
        Scatter {
            seen: 30.0,
            limit: 2.0,
            spare: 210,
            worst: Vec::new(),
            gross: vec![gross],
            left: 0.9,
            causes: LikelyCauses::default(),
            is_run: true,
        }
    }

    #[test]
    fn a_line_that_slipped_is_named_with_what_was_expected_and_what_to_do() {
        let scatter = slipped(17, false);
        assert_eq!(
            (scatter.lines(), scatter.void()),
            (vec![3, 16], vec![3, 16])
        );
        let text = scatter.to_string();
        for part in [
            "line 17 (squarenesses) slipped: from reading 7 at (500.000, 400.000, 300.000) mm on",
            "seen +10.00 um, expected +0.50 um, +9.50 um off, 61.2 times",
            "stay below 5.4",
            "or line 4 is wrong instead",
            "measure line 4 and 17 again",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let own = slipped(17, true);
        assert!(own.void().is_empty());
        assert!(own.to_string().contains("without --resume"), "{own}");
    }

    #[test]
    fn what_single_lines_do_not_explain_voids_none() {
        let scatter = Scatter {
            left: 7.0,
            ..slipped(17, false)
        };
        assert!(scatter.void().is_empty());
        assert!(
            scatter.to_string().contains("the limit is 2.00 times"),
            "{scatter}"
        );
    }
}
