//! Whether a calibration that is continued is still warm, or is warmed up anew.
//!
//! A line that is read warm is read whole at whatever warmth it then has: what warmth does is found with the errors, by what the
//! thermometers showed at each line. So nothing is wrong with a line that is read a little less warm than the one before it. It
//! tells less, because the standard uncertainty of a thermal error goes with one over the rise of temperature. Where
//! [`WARMTH_LEFT`] of the rise is left, it tells as much but for a quarter, and that is in the stated uncertainty; where less is
//! left, the machine is warmed up anew, for the whole time. The clock is not asked: how fast a machine cools down is
//! its own affair, and the thermometers see it.

use std::path::Path;

use machine::ask_disk;
use machine::records::{Store, read_journal};
use units::{Celsius, Short};

use super::WarmUp;
use crate::failure::Failure;
use crate::handle::Core;
use crate::volumetric::VolumeLog;

/// How much of the rise must be left.
const WARMTH_LEFT: f64 = 0.8;

/// For how many minutes a run with this journal was to let all axes go to and fro; `None` where it was not, or where
/// that cannot be read.
pub(crate) fn minutes_of(journal: &Path) -> Option<f64> {
    read_journal::<VolumeLog>(journal)
        .ok()?
        .log
        .plan?
        .warm_up_min
}

/// The same as it is done. What is wrong with the journal is said when it is continued.
///
/// # Errors
/// Whatever stops the machine meanwhile.
pub(super) fn warm_up_of(
    core: &mut Core<'_>,
    store: &Store,
    journal: &Path,
) -> Result<WarmUp, Failure> {
    let journal = journal.to_owned();
    let minutes = ask_disk(core, store, move |_| minutes_of(&journal))?;
    Ok(minutes.and_then(WarmUp::of_minutes).unwrap_or(WarmUp::None))
}

/// What is left of what the machine had warmed up by where it was interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Warmth {
    /// Enough.
    Left,
    /// Less than [`WARMTH_LEFT`] of it.
    Gone,
    /// No line was read warm: it is not known how warm it had become.
    Unknown,
}

impl Warmth {
    /// What is said of it to whoever has the run go on.
    pub(super) fn text(self, how: WarmUp) -> String {
        let why = match self {
            Self::Left => {
                return "at least four fifths of the warmth are left: the axes do not warm up again before the \
                        next line that is read warm"
                    .into();
            }
            Self::Gone => "less than four fifths of the warmth are left",
            Self::Unknown => "no line was read warm before",
        };
        let minutes = how.minutes().map(|it| format!(" for {} min", Short(it)));
        let minutes = minutes.unwrap_or_default();
        format!("{why}: the axes warm up{minutes} before the next line that is read warm")
    }
}

/// What is left of the rise from `cold`, where the references were taken, to the last line that was read warm, by the
/// thermometer that had risen most.
pub(super) fn warmth_left(read: &VolumeLog, cold: &[f64], now: &[Celsius]) -> Warmth {
    let Some(plan) = &read.plan else {
        return Warmth::Unknown;
    };
    // Of what detectors read, the references' temperatures are kept.
    let is_warm = |line: usize| {
        let line = plan.lines.get(line);
        line.is_some_and(|it| it.warm && !it.by_detectors)
    };
    let Some(warm) = read.whole.iter().rfind(|it| is_warm(it.line)) else {
        return Warmth::Unknown;
    };
    let each = cold.iter().zip(&warm.temperatures_c).zip(now);
    let each = each.map(|((cold, warm), now)| (warm - cold, now.value() - cold));
    let most = each.max_by(|(rise, _), (other, _)| rise.total_cmp(other));
    // A comparison with NaN is false: then it is warmed up.
    match most.is_some_and(|(rise, left)| rise > 0.0 && left >= WARMTH_LEFT * rise) {
        true => Warmth::Left,
        false => Warmth::Gone,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volumetric::{LineEntry, LineReadEntry, VolumePlanEntry};

    const COLD: [f64; 2] = [20.0, 20.5];

    /// A line read cold, one read warm by an interferometer, and one by detectors.
    fn read(whole: &[(usize, [f64; 2])]) -> VolumeLog {
        let line = |warm, by_detectors| LineEntry {
            warm,
            by_detectors,
            ..LineEntry::default()
        };
        let plan = VolumePlanEntry {
            lines: vec![line(false, false), line(true, false), line(true, true)],
            ..VolumePlanEntry::default()
        };
        let whole = whole.iter().map(|(line, celsius)| LineReadEntry {
            line: *line,
            temperatures_c: celsius.to_vec(),
            at_s: 0.0,
        });
        VolumeLog {
            plan: Some(plan),
            whole: whole.collect(),
            ..VolumeLog::default()
        }
    }

    #[track_caller]
    fn check(whole: &[(usize, [f64; 2])], now: [f64; 2], expected: Warmth) {
        let now = now.map(Celsius);
        assert_eq!(warmth_left(&read(whole), &COLD, &now), expected, "{now:?}");
    }

    #[test]
    fn whoever_goes_on_is_told_whether_it_warms_up_again_why_and_for_how_long() {
        let how = WarmUp::of_minutes(90.0).expect("a time");
        let check = |warmth: Warmth, words: [&str; 2]| {
            let text = warmth.text(how);
            for word in words {
                assert!(text.contains(word), "`{word}` is not in: {text}");
            }
        };
        check(Warmth::Left, ["at least four fifths", "do not warm up"]);
        check(Warmth::Gone, ["less than four fifths", "for 90 min"]);
        check(Warmth::Unknown, ["no line was read warm", "for 90 min"]);
    }

    #[test]
    fn the_thermometer_that_had_risen_most_says_whether_enough_is_left() {
        let warm = [(0, [20.1, 20.6]), (1, [25.0, 21.0])];
        check(&warm, [25.0, 21.0], Warmth::Left);
        check(&warm, [24.01, 20.5], Warmth::Left);
        check(&warm, [23.99, 21.0], Warmth::Gone);
        check(&warm, [26.0, 21.0], Warmth::Left);
        check(&warm, [f64::NAN, 21.0], Warmth::Gone);
    }

    #[test]
    fn what_was_not_read_warm_is_not_known_to_be_warm() {
        check(&[], [25.0, 25.0], Warmth::Unknown);
        check(&[(0, [25.0, 25.0])], [25.0, 25.0], Warmth::Unknown);
        // The last of those that were set up counts.
        check(&[(1, [25.0, 21.0]), (2, COLD)], [25.0, 21.0], Warmth::Left);
        check(&[(2, COLD)], [25.0, 21.0], Warmth::Unknown);
        // Nothing became warmer: nothing is left of it.
        check(&[(1, COLD)], COLD, Warmth::Gone);
    }
}
