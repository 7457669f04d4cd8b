//! What would explain all readings that contradict each other, as who set the machine up reads it.

use core::fmt;

use compensator::volumetric::identify::{
    Cause, Causes, Circumstance, Doubt, Explanation, Observation, Plan, Snooped, suspects,
};
use compensator::volumetric::model::Chain;
use compensator::volumetric::online::{BeamDrift, MovingState};
use compensator::volumetric::{Axis, Point};
use units::{Metres, Radians};

use crate::volumetric::{
    AXES, BeamRecord, LineEntry, LineReadingEntry, VolumeLog, VolumePlanEntry,
};

/// A place that an arm of the measurement must have had, in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The direction.
    pub axis: Axis,
    /// Where it was.
    pub at: Metres,
    /// Its standard uncertainty.
    pub u: Metres,
    /// Where it was said to be.
    pub stated: Metres,
}

/// One cause that explains all readings.
#[derive(Clone, Debug, PartialEq)]
pub enum LikelyCause {
    /// The axes stand on one another otherwise.
    Chain {
        /// From the workpiece to the tool, all that explain the readings alike.
        chains: Vec<Chain>,
        /// As stated.
        stated: String,
        /// Whether readings of the machine's own detectors tell which axes carry the workpiece.
        by_detectors: bool,
    },
    /// What was measured on these lines was elsewhere.
    Arm {
        /// The lines, from 1.
        lines: Vec<usize>,
        /// Where it was.
        places: Vec<Place>,
        /// Whether other lines were read with this arm, so that only the difference of arms is told.
        is_shared: bool,
    },
    /// A detector sits elsewhere on its slide.
    Detector {
        /// On the slide of this axis.
        axis: Axis,
        /// Where it sits.
        places: Vec<Place>,
    },
    /// A beam moves otherwise when it moves.
    Drift {
        /// The beam along this axis.
        axis: Axis,
        /// How much of its shift at the end it moves as a whole.
        share: f64,
        /// Its standard uncertainty.
        u: f64,
        /// As stated.
        stated: f64,
    },
}

/// What explains all readings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LikelyCauses {
    /// The causes, the likeliest first, each with how much the readings scatter then.
    pub told: Vec<(LikelyCause, f64)>,
    /// Whether readings that are grossly wrong explain them as well.
    pub gross_as_well: bool,
}

impl LikelyCauses {
    /// Of `observations`, made on the lines of `entry` that are whole in `read`, in which `snooped` was
    /// found.
    pub(super) fn of(
        (plan, observations, snooped): (&Plan, &[Observation], &Snooped),
        entry: &VolumePlanEntry,
        read: &VolumeLog,
    ) -> Self {
        let lines = whole_lines(entry, read);
        let circumstances = circumstances(entry, read, &lines);
        if circumstances.len() != observations.len() {
            return Self::default();
        }
        let beams = Axis::ALL.map(|axis| drift(record(read, axis)?));
        let suspects = suspects(plan, observations, &circumstances, beams);
        let causes = plan.causes(observations, &suspects, snooped);
        let by_detectors = circumstances.iter().any(|it| it.detector.is_some());
        let judged = Judged {
            plan,
            observations,
            circumstances: &circumstances,
            beams,
            lines: &lines,
        };
        judged.told(&causes, by_detectors)
    }

    /// The lines, from 0, that have to be read again; none where something else than lines may be wrong.
    pub(super) fn lines(&self) -> Option<Vec<usize>> {
        let mut all = Vec::new();
        for (cause, _) in &self.told {
            let LikelyCause::Arm { lines, .. } = cause else {
                return None;
            };
            all.extend(lines.iter().map(|it| it - 1));
        }
        Some(all)
    }
}

/// The lines of the plan, from 0, by run.
fn whole_lines(entry: &VolumePlanEntry, read: &VolumeLog) -> Vec<usize> {
    let whole = read.whole.iter().map(|it| it.line);
    whole.filter(|it| *it < entry.lines.len()).collect()
}

/// In the order of the observations.
fn circumstances(entry: &VolumePlanEntry, read: &VolumeLog, lines: &[usize]) -> Vec<Circumstance> {
    let each = lines.iter().flat_map(|line| {
        let own = read.readings.iter().filter(move |it| it.line == *line);
        own.map(move |it| circumstance(&entry.lines[*line], it))
    });
    each.collect()
}

fn circumstance(line: &LineEntry, it: &LineReadingEntry) -> Circumstance {
    let moves = |axis: &Axis| line.from_m[axis.index()] != line.to_m[axis.index()];
    let detector = Axis::ALL.into_iter().find(moves);
    Circumstance {
        detector: detector.filter(|_| line.by_detectors),
        state: MovingState {
            sideways: it.sideways_m.map(|it| it.map(Metres)),
            roll: it.roll_rad.map(Radians),
        },
        beam_shift: it.beam_shift_m.unwrap_or_default().map(|it| it.map(Metres)),
    }
}

fn record(read: &VolumeLog, axis: Axis) -> Option<&BeamRecord> {
    let beams = &read.references.as_ref()?.content.beams;
    beams.iter().find(|it| it.axis == AXES[axis.index()])
}

fn drift(beam: &BeamRecord) -> Option<BeamDrift> {
    let drift = beam.drift.as_ref()?;
    Some(BeamDrift::Mixed {
        source: Metres(drift.source_m),
        end: Metres(drift.end_m),
        translation: drift.translation_share,
    })
}

/// What was judged.
struct Judged<'a> {
    plan: &'a Plan,
    observations: &'a [Observation],
    circumstances: &'a [Circumstance],
    beams: [Option<BeamDrift>; 3],
    lines: &'a [usize],
}

impl Judged<'_> {
    fn told(&self, causes: &Causes, by_detectors: bool) -> LikelyCauses {
        let mut told: Vec<(LikelyCause, f64)> = Vec::new();
        for cause in &causes.told {
            let known = told.iter_mut().find_map(|(it, _)| match it {
                LikelyCause::Chain { chains, .. } => Some(chains),
                _ => None,
            });
            match (cause.doubt, known) {
                (Doubt::Chain(chain), Some(chains)) => chains.push(chain),
                _ => told.extend(self.cause(cause, by_detectors).map(|it| (it, cause.ratio))),
            }
        }
        LikelyCauses {
            told,
            gross_as_well: causes.gross_as_well,
        }
    }

    fn cause(&self, cause: &Cause, by_detectors: bool) -> Option<LikelyCause> {
        let line_of = |run: usize| Some(self.lines.get(run)? + 1);
        match (cause.doubt, cause.explanation) {
            (Doubt::Chain(chain), _) => Some(LikelyCause::Chain {
                chains: vec![chain],
                stated: self.plan.chain.to_string(),
                by_detectors,
            }),
            (Doubt::Tool(tool), Explanation::Arm(by)) => {
                let with = self.observations.iter().zip(self.circumstances);
                let with = with.filter(|(it, of)| it.tool == tool && of.detector.is_none());
                let mut lines: Vec<usize> = with.filter_map(|(it, _)| line_of(it.run)).collect();
                lines.dedup();
                Some(LikelyCause::Arm {
                    lines,
                    places: places(tool, by),
                    is_shared: false,
                })
            }
            (Doubt::Line(run), Explanation::Arm(by)) => {
                let own = self.observations.iter().find(|it| it.run == run)?;
                Some(LikelyCause::Arm {
                    lines: vec![line_of(run)?],
                    places: places(own.tool, by),
                    is_shared: true,
                })
            }
            (Doubt::Detector(axis), Explanation::Arm(by)) => {
                let mut own = self.observations.iter().zip(self.circumstances);
                let (it, _) = own.find(|(_, of)| of.detector == Some(axis))?;
                let stated = it.tool + self.plan.chain.lever(axis, it.at, Point::ZERO);
                let places = places(stated, by);
                Some(LikelyCause::Detector { axis, places })
            }
            (Doubt::Drift(axis), Explanation::Effect(more, u)) => {
                let BeamDrift::Mixed { translation, .. } = self.beams[axis.index()]? else {
                    return None;
                };
                Some(LikelyCause::Drift {
                    axis,
                    share: translation + more,
                    u,
                    stated: translation,
                })
            }
            _ => None,
        }
    }
}

fn places(stated: Point, by: [Option<(Metres, Metres)>; 3]) -> Vec<Place> {
    let each = Axis::ALL.into_iter().zip(by);
    let off = each.filter_map(|(axis, by)| {
        let (by, u) = by?;
        let stated = stated.along(axis);
        Some(Place {
            axis,
            at: stated + by,
            u,
            stated,
        })
    });
    off.collect()
}

struct Places<'a>(&'a [Place]);

impl fmt::Display for Places<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, it) in self.0.iter().enumerate() {
            let head = if n == 0 { "" } else { ", " };
            write!(
                f,
                "{head}{} = {:.1} mm (standard uncertainty {:.1} mm) where {:.1} mm is stated",
                it.axis,
                it.at.mm(),
                it.u.mm(),
                it.stated.mm()
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for LikelyCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Chain {
                chains,
                stated,
                by_detectors,
            } => {
                let names: Vec<String> = chains.iter().map(|it| format!("`{it}`")).collect();
                write!(
                    f,
                    "the axes stand on one another like {} where `{stated}` is stated: correct `chain` and \
                     calibrate again",
                    names.join(" or ")
                )?;
                if !by_detectors {
                    f.write_str(
                        " (these readings tell the order of the axes, not which of them carry the workpiece)",
                    )?;
                }
                Ok(())
            }
            Self::Arm {
                lines,
                places,
                is_shared,
            } => {
                let lines: Vec<String> = lines.iter().map(usize::to_string).collect();
                let (lines, places) = (lines.join(", "), Places(places));
                if *is_shared {
                    return write!(
                        f,
                        "on line {lines} alone the measured point was elsewhere on the tool: {places}; mount \
                         the optic as stated and measure that line again"
                    );
                }
                write!(
                    f,
                    "on lines {lines} the measured point was elsewhere on the tool, compared with the other \
                     lines: {places}; mount the optic as stated and measure these lines again, or correct the \
                     arm in the configuration and calibrate again"
                )
            }
            Self::Detector { axis, places } => write!(
                f,
                "the detector on the slide of {axis} sits elsewhere: {}; measure where it is, correct its \
                 `place_mm` and calibrate again",
                Places(places)
            ),
            Self::Drift {
                axis,
                share,
                u,
                stated,
            } => write!(
                f,
                "the beam along {axis} moves otherwise when it moves: {share:.2} (standard uncertainty {u:.2}) \
                 of its shift at the end as a whole where {stated:.2} is stated (0 is `pivoting`, 1 is \
                 `translating`); correct `drift` and calibrate again"
            ),
        }
    }
}
