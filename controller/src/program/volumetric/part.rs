//! Parts: a path of three axes that is followed, and what the correction said along it.

use std::path::Path;

use compensator::volumetric::Axis;
use machine::engine::{CsvPath, Departure, Join};
use machine::records::short;
use serde_json::{Value, json};
use units::Metres;

use crate::config;
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::data_text::read;
use crate::program::intended::nowhere;
use crate::program::kept::or_by_its_service;
use crate::program::output::{Ended, Output};
use crate::program::session::Session;
use crate::program::volumetric::memory::{kept_text, kept_value};
use crate::program::volumetric::verbs::zeroed_volume;
use crate::runs::Told;
use crate::volumetric::first_part::FirstPart;
use crate::volumetric::motion::require_measured;
use crate::volumetric::path::{CorrectedPath, PathFollowed};
use crate::volumetric::{Mover, Remembered};
use crate::{Failure, Machine};
use machine::records::Store;

/// What drives a path.
enum Ready {
    /// Nothing is known to correct, or it is not to be.
    Alone,
    Corrected(Mover),
    First(Mover, FirstPart),
}

pub(crate) fn run(
    args: &MachineArgs,
    file: &Path,
    join: Option<Join>,
    (is_first, uncompensated): (bool, bool),
    output: Output,
) -> Ended {
    let rows = read(file)?;
    let how = (is_first, uncompensated);
    let here = followed_here(args, (file, &rows), join, how, output);
    or_by_its_service(here, |service| {
        // What cannot be followed is said with the names of here.
        let path = judged(args, (file, &rows), join, !uncompensated)?;
        output.note(&before_it_moves(file, &path));
        service.follow(args, asked_of_service(&rows, join, how), output)
    })
}

/// The same as a run of a service: its lines are those of the file.
fn asked_of_service(
    rows: &str,
    join: Option<Join>,
    (is_first, uncompensated): (bool, bool),
) -> Value {
    let kind = if is_first { "first_part" } else { "path" };
    let join = join.map(|it| it.to_string());
    json!({"kind": kind, "path": rows, "join": join, "uncompensated": uncompensated})
}

fn followed_here(
    args: &MachineArgs,
    (file, rows): (&Path, &str),
    join: Option<Join>,
    (is_first, uncompensated): (bool, bool),
    output: Output,
) -> Ended {
    let mut session = Session::open(args, "run", Use::Motion, output)?;
    if !uncompensated {
        require_measured(&session.store)?;
    }
    // Long paths take seconds to judge: before the drives wait for our heartbeat.
    let judge = session.machine.volumetric()?.path_judge()?;
    let mut path = judge.judge((file, rows), join, !uncompensated)?;
    output.note(&before_it_moves(file, &path));
    let points = core::mem::take(&mut path.points);
    let ready = |machine: &mut Machine, store: &Store| {
        let volume = machine.volumetric()?;
        if is_first {
            let (mover, part) = volume.first_part(store)?;
            return Ok(Ready::First(mover, part));
        }
        let mover = match uncompensated {
            true => None,
            false => volume.stored_mover(store)?,
        };
        Ok(mover.map_or(Ready::Alone, Ready::Corrected))
    };
    let follow =
        |machine: &mut Machine, store: &Store, ready| follow_part(machine, store, ready, points);
    let ((along, kept), counters) = zeroed_volume(session, ready, follow)?;
    output.told(followed(&along, &path, kept.as_ref()), counters)
}

/// What came of a path; `kept` is what later parts are made with, when it was the first.
pub(super) fn followed(followed: &PathFollowed, path: &CsvPath, kept: Option<&Remembered>) -> Told {
    let said = match &followed.corrected {
        Some(corrected) => corrected_text(corrected),
        None => "NOT CORRECTED: by the encoders alone".into(),
    };
    let (count, timing) = (followed.count, &followed.timing);
    let mut value = json!({"points": count, "corrected": followed.corrected.is_some(),
                           "join": path.join.to_string(),
                           "largest_departure": departure_value(&path.departure),
                           "thread": followed.thread});
    if let Some(corrected) = &followed.corrected {
        write_corrected(corrected, &mut value);
    }
    let mut text = format!("{count} points followed, {said}\n{timing}");
    if let Some(kept) = kept {
        text += &format!(
            "\nthe errors that the detectors saw were not corrected in this part; {} keeps them: \
             all later parts are made with them\n{}",
            short(&kept.id),
            kept_text(kept)
        );
        value["memory"] = kept_value(kept);
    }
    Told { text, value }
}

/// The path in `rows`, judged without a machine.
fn judged(
    args: &MachineArgs,
    (file, rows): (&Path, &str),
    join: Option<Join>,
    is_corrected: bool,
) -> Result<CsvPath, Failure> {
    let loaded = config::load(&args.config)?;
    if is_corrected {
        require_measured(&loaded.config.machine.store())?;
    }
    let judge = nowhere::machine(&loaded).volumetric()?.path_judge()?;
    judge.judge((file, rows), join, is_corrected)
}

/// Says what would be driven; nothing is connected.
pub(crate) fn only_judged(
    args: &MachineArgs,
    file: &Path,
    join: Option<Join>,
    is_corrected: bool,
    output: Output,
) -> Ended {
    let rows = read(file)?;
    let path = judged(args, (file, &rows), join, is_corrected)?;
    let value = json!({"dry_run": true, "points": path.points.len(), "join": path.join.to_string(),
                       "longer_s": path.longer.as_secs_f64(),
                       "largest_departure": departure_value(&path.departure)});
    output.result(&before_it_moves(file, &path), &value)
}

/// What is driven, for whoever may still stop it: rows that turn a corner are not joined straight, or not passed.
fn before_it_moves(file: &Path, path: &CsvPath) -> String {
    let CsvPath {
        points, departure, ..
    } = path;
    let at = Axis::ALL.into_iter().zip(&departure.place);
    let at: Vec<String> = at
        .map(|(axis, it)| format!("{axis} {:.3}", it.mm()))
        .collect();
    let ([from, to], size, at_s) = (departure.lines, departure.size.mm(), departure.at_s);
    let place = format!("at {at_s:.3} s (lines {from} to {to}), {} mm", at.join(" "));
    let begin = format!("{}: {} points along", file.display(), points.len());
    match path.join {
        Join::Spline => format!(
            "{begin} the cubic spline through the rows; it departs from the straight lines between them by \
             {size:.3} mm at most, {place}"
        ),
        Join::Linear { blend } => format!(
            "{begin} straight lines through the rows; no corner is passed farther than {size:.3} mm ({:.3} mm are \
             allowed), {place}; to begin and end at rest it takes {:.3} s longer than the rows say",
            blend.mm(),
            path.longer.as_secs_f64()
        ),
    }
}

fn departure_value(departure: &Departure) -> Value {
    let place = departure.place.iter().map(|it| it.mm());
    json!({"mm": departure.size.mm(), "at_s": departure.at_s, "lines": departure.lines,
           "place_mm": place.collect::<Vec<_>>()})
}

/// Follows the path, and says what later parts are made with, when this was the first.
fn follow_part(
    machine: &mut Machine,
    store: &Store,
    ready: Ready,
    points: Vec<Vec<Metres>>,
) -> Result<(PathFollowed, Option<Remembered>), Failure> {
    let mut volume = machine.volumetric()?;
    match ready {
        Ready::First(mover, part) => {
            let (followed, kept) = volume.follow_part(store, (mover, part), points)?;
            Ok((followed, Some(kept)))
        }
        Ready::Corrected(mut mover) => {
            let followed = volume.follow(&mut mover, points, true, || {})?;
            Ok((followed, None))
        }
        Ready::Alone => {
            let mut mover = volume.uncorrected_mover()?;
            let followed = volume.follow(&mut mover, points, false, || {})?;
            Ok((followed, None))
        }
    }
}

fn corrected_text(path: &CorrectedPath) -> String {
    let (largest, u) = (path.largest.map(|it| it.um()), path.u.map(|it| it.um()));
    let mut text = format!("largest corrections {largest:.3?} µm, u {u:.3?} µm at most");
    if path.degraded > 0 {
        let (degraded, periods) = (path.degraded, path.periods);
        text += &format!("\nthe correction lacked a value in {degraded} of {periods} periods");
    }
    if let Some(lack) = &path.without {
        text += &format!("; without {lack}");
    }
    if path.limited > 0 {
        let limited = path.limited;
        text += &format!("\nthe correction was limited in {limited} periods");
    }
    text
}

fn write_corrected(path: &CorrectedPath, value: &mut Value) {
    value["largest_correction_um"] = json!(path.largest.map(|it| it.um()));
    value["u_max_um"] = json!(path.u.map(|it| it.um()));
    value["periods_degraded"] = json!(path.degraded);
    value["without"] = json!(path.without.as_ref().map(|it| it.to_string()));
    value["periods_limited"] = json!(path.limited);
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use drivers::transport::{SendError, Transport};
    use units::Time;
    use wire::{Arrival, Payload, Port};

    use super::*;

    /// Nobody is there, and nobody is asked.
    struct Nobody;

    impl Transport for Nobody {
        fn now(&self) -> Time {
            Time::ZERO
        }

        fn send(&mut self, _: Port, _: &Payload) -> Result<(), SendError> {
            panic!("nothing is sent before a path is judged")
        }

        fn receive(&mut self, _: Time) -> Option<Arrival> {
            None
        }

        fn sleep_until(&mut self, _: Time) {}

        fn set_sync(&mut self, _: Port, _: Option<Duration>) -> Result<(), SendError> {
            Ok(())
        }
    }

    fn machine() -> (Machine, Store) {
        let toml = include_str!("../../../../configs/machines/volumetric.toml");
        let loaded = config::parse(toml, "volumetric.toml").unwrap();
        let store = loaded.config.machine.store();
        (Machine::new(&loaded, Box::new(Nobody)), store)
    }

    fn judge(text: &str, is_corrected: bool) -> Result<CsvPath, Failure> {
        judge_joined(text, None, is_corrected)
    }

    fn judge_joined(
        text: &str,
        join: Option<Join>,
        is_corrected: bool,
    ) -> Result<CsvPath, Failure> {
        let mut machine = machine().0;
        let judge = machine.volumetric().unwrap().path_judge().unwrap();
        judge.judge((Path::new("path.csv"), text), join, is_corrected)
    }

    /// As a service judges what it is asked.
    fn judge_there(asked: &Value) -> Failure {
        let (mut machine, store) = machine();
        let group = crate::groups(machine.config()).swap_remove(0);
        let judge = group.path_judge(&mut machine).unwrap().unwrap();
        let rows = asked["path"].as_str().unwrap();
        let join = asked["join"].as_str();
        let join = join.map(|it| Join::of_text(it).unwrap());
        judge.judge(&store, (rows, join), false).unwrap_err()
    }

    /// Steps of 5 mm a second along x that suddenly end at `end_mm`; no row is beyond it.
    fn sudden_end(end_mm: f64) -> String {
        let rows = (0..=8).map(|row: u32| {
            let left = 5.0 * f64::from(4_u32.saturating_sub(row));
            format!("{row},{},100,100\n", end_mm - left)
        });
        "time_s,x_mm,y_mm,z_mm\n".to_owned() + &rows.collect::<String>()
    }

    #[track_caller]
    fn check_refused(text: &str, is_corrected: bool, why: &str) {
        let refused = judge(text, is_corrected).unwrap_err();
        assert_eq!(refused.exit_code(), 3, "{refused}");
        let said = refused.to_string();
        for part in ["path.csv", why, "nothing was moved"] {
            assert!(said.contains(part), "`{part}` is not in {said}");
        }
    }

    #[test]
    fn a_path_is_judged_as_its_spline_runs_between_the_rows() {
        // x may go to 503 mm, and is calibrated to 500 mm and 0.25 mm beyond.
        check_refused(&sudden_end(502.9), false, "axis x: ");
        check_refused(&sudden_end(499.9), true, "outside the calibrated");
        judge(&sudden_end(499.0), true).unwrap();
        judge(&sudden_end(502.0), false).unwrap();
    }

    #[test]
    fn a_file_that_is_no_path_is_a_matter_of_usage() {
        let refused = judge("time_s,x_mm\n", false).unwrap_err();
        assert_eq!(refused.exit_code(), 2, "{refused}");
    }

    /// Along x, then along y, at 10 mm/s.
    fn corner(join: &str) -> String {
        format!("{join}time_s,x_mm,y_mm,z_mm\n0,100,100,100\n2,120,100,100\n4,120,120,100\n")
    }

    #[test]
    fn straight_lines_are_driven_where_the_file_says_so_and_a_tight_corner_says_what_it_needs() {
        let path = judge(&corner("# join: linear 1mm\n"), true).unwrap();
        let said = before_it_moves(Path::new("path.csv"), &path);
        let by = path.departure.size.mm();
        assert!((0.01..1.0).contains(&by), "{said}");
        for part in [
            "straight lines",
            "(1.000 mm are allowed)",
            "lines 3 to 5",
            "longer",
        ] {
            assert!(said.contains(part), "`{part}` is not in {said}");
        }
        let tight = corner("# join: linear 1um\n");
        check_refused(&tight, true, "the corner in line 4 can be passed within 0.");
        assert_eq!(judge(&corner(""), true).unwrap().join, Join::Spline);
        let unknown = judge(&corner("# join: circles\n"), true).unwrap_err();
        assert_eq!(unknown.exit_code(), 2, "{unknown}");
        assert!(
            unknown.to_string().contains("line 1: `# join: circles`"),
            "{unknown}"
        );
    }

    #[test]
    fn a_service_names_the_lines_of_the_file_whatever_joins_its_rows() {
        let tight = Join::Linear {
            blend: Metres::from_um(1.0),
        };
        let slip = corner("# by hand\n").replace("2,120", "2,12O");
        for (rows, join, line) in [
            (&slip, None, "line 4, column x_mm"),
            (&slip, Some(Join::Spline), "line 4, column x_mm"),
            (&slip, Some(tight), "line 4, column x_mm"),
            (&corner(""), Some(tight), "the corner in line 3"),
            (&corner("# by hand\n"), Some(tight), "the corner in line 4"),
        ] {
            let here = judge_joined(rows, join, false).unwrap_err().to_string();
            assert!(here.contains(line), "{here}");
            let there = judge_there(&asked_of_service(rows, join, (false, true)));
            assert_eq!(here.replace("path.csv", "path"), there.to_string());
        }
    }

    #[test]
    fn before_it_moves_it_is_said_how_far_a_corner_is_overshot_and_where() {
        let path = judge(&sudden_end(400.0), false).unwrap();
        let said = before_it_moves(Path::new("path.csv"), &path);
        let by = path.departure.size.mm();
        assert!((0.3..0.6).contains(&by), "{said}");
        for part in [
            "path.csv: 4001 points",
            "cubic spline",
            "lines 6 to 7",
            "x 400.",
        ] {
            assert!(said.contains(part), "`{part}` is not in {said}");
        }
    }
}
