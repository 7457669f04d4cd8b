//! Three axes, in virtual time: calibrated cold and warm, then eight hours of drift, seen by an
//! interferometer along a line that no calibration uses.

use core::time::Duration;
use std::path::{Path, PathBuf};
use std::time::Instant;

use machine::records::{Lease, ReadJournal, read_journal};
use serde_json::json;
use units::{Metres, Time};

use crate::edit::with_rare_heartbeats;
use crate::emulated::Emulated;
use crate::program::demo::stand::{Demo, DemoArgs, Show, shipped, write_page};
use crate::program::output::{Ended, Output};
use crate::program::volumetric::report::{HourOfDay, render_day};
use crate::program::volumetric::verbs::{calibrated_text, calibrated_value};
use crate::volumetric::{VerifyBy, VolumeLog, VolumetricCalibrated, WarmUp};
use crate::{Failure, Machine, config};
use machine::records::Store;

/// How long the machine warms up between cold and warm lines.
const WARM_UP: Duration = Duration::from_secs(2 * 3600);
/// When the line is read, hours after that: warmth settles as an exponential does.
const HOURS: [u32; 5] = [0, 1, 2, 4, DAY_H];
const DAY_H: u32 = 8;

/// What the line showed at one hour, as ranges of the deviation along it.
struct Hour {
    hour: u32,
    found: Metres,
    tables: Metres,
    live: Metres,
    /// Where its readings are, in the same order.
    journals: [PathBuf; 3],
}

/// What can be shown.
pub(crate) const DEMOS: &[Demo] = &[Demo {
    name: "volumetric",
    help: "Three axes corrected throughout their volume, for eight hours in virtual time",
    files: shipped!("volumetric"),
    show: Show::Alone(run),
}];

fn run(demo: &Demo, args: &DemoArgs, output: Output) -> Ended {
    let started = Instant::now();
    let [path, text, description] = demo.files;
    let mut loaded = config::parse(&with_rare_heartbeats(text), path)?;
    if let Some(folder) = &args.data_dir {
        loaded.config.machine.data_dir.clone_from(folder);
    }
    let section = &loaded.config.machine;
    let store = section.store();
    let _lease = Lease::take(&store, "demo")?;
    let emulated = Emulated::new(description, args.seed, &loaded.config)?;
    let mut machine = Machine::new(&loaded, Box::new(emulated.transport()));
    crate::program::signals::stop_on_signals(&machine.stop_request())?;
    output.note(&format!(
        "truestage demo: emulated machine `{}` (stage {}), seed {}, in virtual time",
        section.name, section.stage_serial, args.seed
    ));
    let mut hand = emulated.clone();
    let (made, hours) = machine.guarded(|machine| {
        output.note("1 start: identity, set-up, supervision; zero: the index pulses of x, y and z");
        machine.start()?;
        machine.volumetric()?.zero()?;
        output.note("2 calibrate: references, lines by interferometer, cold and 2 h later");
        let made =
            machine
                .volumetric()?
                .calibrate(&store, WarmUp::Idle(WARM_UP), None, &mut hand)?;
        output.note(&calibrated_text(&made));
        output.note("3 eight hours: deviations along a line that no calibration uses");
        let hours = day(machine, &store, &mut hand, output)?;
        machine.shut_down()?;
        Ok((made, hours))
    })?;
    let report = write_report(&store, &made, &hours)?;
    let wall = started.elapsed();
    let text = format!(
        "{}\nreport       {}",
        text_of(&hours, wall),
        report.display()
    );
    let mut value = value_of(&made, &hours, wall);
    value["report"] = json!(report);
    output.result(&text, &value)
}

/// One page: the day, and the calibration before it.
fn write_report(
    store: &Store,
    made: &VolumetricCalibrated,
    hours: &[Hour],
) -> Result<PathBuf, Failure> {
    let read = |path: &Path| read_journal(path).map_err(Failure::from);
    let calibrated = read(&made.journal)?;
    let mut runs: Vec<[ReadJournal<VolumeLog>; 3]> = Vec::new();
    for hour in hours {
        let [found, tables, live] = &hour.journals;
        runs.push([read(found)?, read(tables)?, read(live)?]);
    }
    let day: Vec<_> = hours
        .iter()
        .zip(&runs)
        .map(|(hour, runs)| HourOfDay {
            hour: f64::from(hour.hour),
            runs: runs.each_ref(),
        })
        .collect();
    let html = render_day(&day, &calibrated, &super::made_from(&made.journal)?);
    write_page(store, &calibrated.header, &html)
}

fn day(
    machine: &mut Machine,
    store: &Store,
    hand: &mut Emulated,
    output: Output,
) -> Result<Vec<Hour>, Failure> {
    let morning = machine.now();
    let mut hours = Vec::new();
    for hour in HOURS {
        let until = morning + Duration::from_secs(u64::from(hour) * 3600);
        let pause = until.since(machine.now());
        if until > Time::ZERO && !pause.is_zero() {
            machine.idle(pause)?;
        }
        let mut verified = |by| machine.volumetric()?.verify(store, by, hand);
        let found = verified(VerifyBy::AsFound)?;
        let tables = verified(VerifyBy::Tables)?;
        let live = verified(VerifyBy::Everything)?;
        let seen = Hour {
            hour,
            found: found.range,
            tables: tables.range,
            live: live.range,
            journals: [found.journal, tables.journal, live.journal],
        };
        output.note(&line_of(&seen));
        hours.push(seen);
    }
    Ok(hours)
}

fn line_of(it: &Hour) -> String {
    format!(
        "  {} h: {:>6.2} µm as found, {:>6.2} µm by tables alone, {:>5.2} µm corrected by what the machine sees",
        it.hour,
        it.found.um(),
        it.tables.um(),
        it.live.um()
    )
}

fn text_of(hours: &[Hour], wall: Duration) -> String {
    let worst = |of: fn(&Hour) -> Metres| {
        let each = hours.iter().map(of);
        each.fold(Metres(0.0), |a, b| a.max(b)).um()
    };
    format!(
        "range of the deviation along the line over {DAY_H} h, at worst: {:.2} µm as found, {:.2} µm by \
         tables alone, {:.2} µm corrected by what the machine sees\ntook {:.1} s for {} h of the machine",
        worst(|it| it.found),
        worst(|it| it.tables),
        worst(|it| it.live),
        wall.as_secs_f64(),
        DAY_H + 2
    )
}

fn value_of(made: &VolumetricCalibrated, hours: &[Hour], wall: Duration) -> serde_json::Value {
    let hours = hours.iter().map(|it| {
        json!({"hour": it.hour, "as_found_um": it.found.um(), "by_tables_um": it.tables.um(),
               "corrected_um": it.live.um()})
    });
    json!({
        "calibration": calibrated_value(made),
        "hours": hours.collect::<Vec<_>>(),
        "wall_s": wall.as_secs_f64(),
    })
}
