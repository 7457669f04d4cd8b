//! `truestage fit volumetric`: the errors of three axes from a run's journal, or from lines that were
//! read elsewhere.

use std::path::{Path, PathBuf};

use clap::Args;
use compensator::volumetric::identify::{IdentifyError, Observation, Optics};
use compensator::volumetric::{VolumeLine, VolumeSeries};
use machine::records::{CalibrationRecord, ReadJournal, RecordHead, read_journal, short};
use serde_json::json;
use units::Radians;

use crate::Failure;
use crate::config;
use crate::config::Loaded;
use crate::program::data_file::volume_head_of;
use crate::program::data_text::{is_journal, name_of, read};
use crate::program::output::{Ended, Output};
use crate::program::volumetric::shown::shown;
use crate::program::volumetric::uncertainty;
use crate::program::volumetric::verbs::{add_unknown, found_value, unknown_text, warmth_text};
use crate::volumetric::VolumetricConfig;
use crate::volumetric::calibrate::VolumetricEvaluated;
use crate::volumetric::calibrate::volume_plan;
use crate::volumetric::settings::function_shape;
use crate::volumetric::{
    BeamReferencesContent, LineEntry, LineReadEntry, LineReadingEntry, OpticsName, VolumeLog,
    VolumeReferencesEntry,
};
use crate::volumetric::{GEOMETRY, REFERENCES, VolumetricFailure};

/// What `truestage fit volumetric` is told.
#[derive(Debug, Args)]
pub(crate) struct VolumetricArgs {
    /// The journal of a calibration (….jsonl), or a data file.
    data: PathBuf,
    /// The machine's configuration.
    #[arg(long)]
    config: PathBuf,
    /// With a data file: what the thermometers showed, in the order of the configuration.
    #[arg(
        long,
        value_name = "CELSIUS",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    temperatures_c: Vec<f64>,
    /// Take these error functions as zero: `e_cz,e_az`.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    without: Vec<String>,
    /// Store it for this machine (use it with `cal activate`).
    #[arg(long)]
    save: bool,
}

/// Readings, and where they come from.
struct Given {
    read: VolumeLog,
    /// Of a run of this program.
    journal: Option<ReadJournal<VolumeLog>>,
    /// By reading: its line in the data file.
    rows: Vec<usize>,
}

pub(crate) fn fit(args: &VolumetricArgs, output: Output) -> Ended {
    let loaded = config::load(&args.config)?;
    let own = loaded.config.volumetric.as_ref();
    let own = own.ok_or(VolumetricFailure::None)?;
    let mut given = match is_journal(&args.data) {
        true => of_journal(args)?,
        false => of_series(args, own)?,
    };
    leave_out(&mut given.read, &args.without)?;
    let shape = function_shape(own.compensation.interpolation);
    let evaluated = VolumetricEvaluated::of(&given.read, shape);
    let evaluated = evaluated.map_err(|it| placed(it, &args.data, &given.rows))?;
    let found = &evaluated.found;
    let content = evaluated.content(own);
    let mut text = shown(&content) + &warmth_text(found) + &unknown_text(&content.unknown);
    if let Some(scatter) = &evaluated.scatter {
        text += &format!("\n  not to be stored: {scatter}");
    }
    let mut value = found_value(found);
    value["lines"] = json!(evaluated.lines);
    value["readings"] = json!(evaluated.readings);
    value["u_tool_max_um"] = json!(evaluated.u_max.um());
    value["uncertainty"] = uncertainty::value(content.budget.as_ref());
    add_unknown(&mut value, &content.unknown);
    value["functions"] = json!(content.functions);
    let arcsec = |it: f64| Radians(it).arcsec();
    value["squareness_arcsec"] = json!(content.squareness_rad.map(arcsec));
    value["squareness_u_arcsec"] = json!(content.squareness_u_rad.map(arcsec));
    if args.save {
        let stored = save(args, &loaded, &evaluated, &given)?;
        text += &stored_text(&args.config, &stored);
        value["calibration"] = json!(stored.0);
        value["references"] = json!(stored.1);
    }
    output.result(&text, &value)
}

fn of_journal(args: &VolumetricArgs) -> Result<Given, Failure> {
    if !args.temperatures_c.is_empty() {
        return Err(Failure::Usage {
            what: "--temperatures-c is for data files".into(),
            help: "leave it out: a journal has its own".into(),
        });
    }
    let journal = read_journal::<VolumeLog>(&args.data)?;
    Ok(Given {
        read: journal.log.clone(),
        journal: Some(journal),
        rows: Vec::new(),
    })
}

/// Lines that were read elsewhere count as read at one warmth.
fn of_series(args: &VolumetricArgs, config: &VolumetricConfig) -> Result<Given, Failure> {
    let file = name_of(&args.data);
    let series = VolumeSeries::from_csv(&read(&args.data)?, &file)?;
    let (mut plan, _) = volume_plan(config, false, Vec::new())?;
    plan.lines.clear();
    let mut given = VolumeLog::default();
    let mut rows = Vec::new();
    for (number, line) in series.lines().iter().enumerate() {
        plan.lines.push(entry(number, line));
        given.whole.push(LineReadEntry {
            line: number,
            temperatures_c: args.temperatures_c.clone(),
            at_s: 0.0,
        });
        for point in &line.points {
            let observation = Observation {
                at: point.at,
                tool: line.tool,
                run: number,
                reading: point.reading,
                common: 0.0,
                common_of_run: 0.0,
            };
            given
                .readings
                .push(LineReadingEntry::of(number, &observation));
            rows.push(point.row);
        }
    }
    given.plan = Some(plan);
    given.references = Some(VolumeReferencesEntry {
        temperatures_c: args.temperatures_c.clone(),
        ..VolumeReferencesEntry::default()
    });
    Ok(Given {
        read: given,
        journal: None,
        rows,
    })
}

fn entry(number: usize, line: &VolumeLine) -> LineEntry {
    let (optics, sees) = match line.optics {
        Optics::Linear => (OpticsName::Linear, None),
        Optics::Straightness(across) => (OpticsName::Straightness, Some(across)),
        Optics::Angle(about) => (OpticsName::Angular, Some(about)),
    };
    LineEntry {
        optics,
        sees: sees.and_then(|it| it.to_string().chars().next()),
        purpose: format!("line {} of the file", line.number),
        points: line.points.len(),
        // A straightedge was laid by hand.
        angle: (optics == OpticsName::Straightness).then_some(number),
        ..LineEntry::default()
    }
}

fn leave_out(read: &mut VolumeLog, names: &[String]) -> Result<(), Failure> {
    let Some(plan) = &mut read.plan else {
        return Ok(());
    };
    for name in names {
        let at = plan.functions.iter().position(|it| it == name);
        let at = at.ok_or_else(|| Failure::Usage {
            what: format!("--without {name}: that error is not looked for"),
            help: format!("it is one of {}", plan.functions.join(", ")),
        })?;
        plan.functions.remove(at);
    }
    Ok(())
}

/// The line of the data file in place of a reading's number.
fn placed(failure: Failure, file: &Path, rows: &[usize]) -> Failure {
    let Some(VolumetricFailure::Identify(source)) = failure.of_kind() else {
        return failure;
    };
    let index = match source {
        IdentifyError::Run { index, .. }
        | IdentifyError::NotUsable { index }
        | IdentifyError::Outside { index, .. } => *index,
        _ => return failure,
    };
    let Some(row) = rows.get(index) else {
        return failure;
    };
    Failure::Usage {
        what: format!("{}:{row}: {source}", file.display()),
        help: "correct the row, or low_mm and high_mm of [volumetric]".into(),
    }
}

/// Stores what was found, with the references of the run where it was one.
fn save(
    args: &VolumetricArgs,
    loaded: &Loaded,
    evaluated: &VolumetricEvaluated,
    given: &Given,
) -> Result<(String, Option<String>), Failure> {
    let machine = &loaded.config;
    let own = machine.volumetric.as_ref().ok_or(VolumetricFailure::None)?;
    let (seen, expected) = (evaluated.temperatures.len(), own.temperature.len());
    if seen != expected {
        return Err(Failure::Usage {
            what: format!("temperatures of {seen} thermometers, the machine has {expected}"),
            help: "give with --temperatures-c what they showed when the lines were read".into(),
        });
    }
    let store = machine.machine.store();
    let mut head = volume_head_of(loaded, GEOMETRY, &args.data)?;
    let references = match &given.journal {
        Some(journal) => {
            same_machine(&args.data, journal, loaded)?;
            head.instrument = journal.header.instrument.clone();
            head.drive = journal.header.drive.clone();
            given.read.references.as_ref().map(|it| &it.content)
        }
        None => None,
    };
    evaluated.check(machine, references)?;
    let content = evaluated.content(own);
    let record = CalibrationRecord { head, content };
    let geometry = store.save(&record)?;
    let references = references.map(|it| {
        let content = BeamReferencesContent {
            geometry: geometry.clone(),
            ..it.clone()
        };
        let head = RecordHead {
            axis: REFERENCES.to_owned(),
            ..record.head.clone()
        };
        store.save(&CalibrationRecord { head, content })
    });
    Ok((geometry, references.transpose()?))
}

fn same_machine(
    path: &Path,
    journal: &ReadJournal<VolumeLog>,
    loaded: &Loaded,
) -> Result<(), Failure> {
    let (header, section) = (&journal.header, &loaded.config.machine);
    let hash = loaded.hash.beside(&header.config_hash);
    let comparisons = [
        ("stage", &*header.stage_serial, &*section.stage_serial),
        ("configuration hash", &header.config_hash, hash),
    ];
    for (what, expected, seen) in comparisons {
        if expected != seen {
            return Err(Failure::Usage {
                what: format!(
                    "{}: its {what} is `{expected}`, but that of the machine is `{seen}`",
                    path.display()
                ),
                help: "give the configuration that the run was made with".into(),
            });
        }
    }
    Ok(())
}

fn stored_text(config: &Path, (geometry, references): &(String, Option<String>)) -> String {
    let activate = |id: &str| {
        format!(
            "`truestage cal activate {} {}`",
            config.display(),
            short(id)
        )
    };
    let then = match references {
        Some(id) => format!("{} with its references", activate(id)),
        None => "`truestage reference` while the machine has the temperature that it had then"
            .to_owned(),
    };
    format!(
        "\nstored as {}; use it with {}, then {then}",
        short(geometry),
        activate(geometry)
    )
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::Value;

    use super::*;
    use crate::Edit;
    use machine::records::sealed;

    use crate::program::stored_tests::lines_of;
    use machine::records::Store;

    const JOURNAL: &str = include_str!("../../../golden/volumetric_calibrate.jsonl");
    const MACHINE: &str = include_str!("../../../../configs/machines/volumetric.toml");
    const HALF_WAVELENGTH_M: f64 = 0.316_4e-6;
    /// The first diagonal, counted from 0.
    const DIAGONAL: usize = 16;

    /// The machine's folder with a run of it, whose readings `change` has changed.
    struct Desk {
        folder: tempfile::TempDir,
        config: PathBuf,
        store: Store,
    }

    impl Desk {
        fn new() -> Self {
            Self::with(str::to_owned)
        }

        /// Of a machine whose file `change` has changed.
        fn with(change: impl Fn(&str) -> String) -> Self {
            let folder = tempfile::tempdir().unwrap();
            let config = folder.path().join("machine.toml");
            let data = format!("data_dir = {:?}", folder.path().join("data"));
            let text = MACHINE.replace("data_dir = \"machine-data\"", &data);
            assert_ne!(text, MACHINE);
            fs::write(&config, change(&text)).unwrap();
            let loaded = config::load(&config).unwrap();
            Self {
                folder,
                config,
                store: loaded.config.machine.store(),
            }
        }

        /// As if that configuration had been used.
        fn journal(&self, name: &str, change: impl Fn(usize, &mut Value)) -> PathBuf {
            let hash = config::load(&self.config).unwrap().hash;
            let mut lines = lines_of(JOURNAL);
            lines[0]["config_hash"] = hash.as_str().into();
            let own = |it: &&mut Value| it["entry"] == "line_reading" && it["line"] == DIAGONAL;
            let diagonal = lines.iter_mut().filter(own).enumerate();
            diagonal.for_each(|(at, line)| change(at, line));
            let text = lines.iter().map(|it| sealed(&it.to_string()));
            let runs = self.store.runs();
            fs::create_dir_all(&runs).unwrap();
            fs::write(runs.join(name), text.collect::<String>()).unwrap();
            runs.join(name)
        }

        fn save(&self, data: PathBuf) -> Ended {
            let args = VolumetricArgs {
                data,
                config: self.config.clone(),
                temperatures_c: Vec::new(),
                without: Vec::new(),
                save: true,
            };
            fit(&args, Output::new(true, "test"))
        }
    }

    fn add(line: &mut Value, metres: f64) {
        for key in ["read_si", "deviation_si"] {
            line[key] = (line[key].as_f64().unwrap() + metres).into();
        }
    }

    #[test]
    fn lines_that_lost_half_wavelengths_or_have_a_wild_reading_are_not_stored() {
        let desk = Desk::new();
        let jumped = desk.journal("jumped.jsonl", |at, line| {
            if at > 5 {
                add(line, 30.0 * HALF_WAVELENGTH_M);
            }
        });
        let wild = desk.journal("wild.jsonl", |at, line| {
            if at == 3 {
                add(line, 1e-3);
            }
        });
        let named = [
            (jumped, "slipped: from reading 7 at"),
            (wild, "reading 4 at"),
        ];
        for (path, what) in named {
            let refused = desk.save(path).expect_err("they scatter");
            assert_eq!(refused.exit_code(), 5, "{refused}");
            let text = refused.to_string();
            assert!(text.contains("times as much as their stated"), "{text}");
            assert!(text.contains(&format!("line {} (", DIAGONAL + 1)), "{text}");
            assert!(text.contains(what) && text.contains("expected"), "{text}");
            assert!(desk.store.list().unwrap().is_empty());
        }
        let sound = desk.journal("sound.jsonl", |_, _| ());
        desk.save(sound).expect("it is sound");
        assert_eq!(desk.store.list().unwrap().len(), 2);
        drop(desk.folder);
    }

    /// Limits between what one function needs and what all together do, and the ones that are named.
    #[test]
    fn limits_that_would_stop_a_path_are_refused_before_anything_is_stored_with_the_ones_that_do() {
        let limited = |size: &str, slope: &str| {
            Desk::with(|text| {
                text.edit("size_limit_um = 250.0", &format!("size_limit_um = {size}"))
                    .edit("displacement_max_um = 60.0", "displacement_max_um = 10.0")
                    .edit("slope_limit = 0.01", &format!("slope_limit = {slope}"))
            })
        };
        let save = |desk: &Desk| desk.save(desk.journal("run.jsonl", |_, _| ()));
        let number = |text: &str, key: &str| {
            let after = text.split(&format!("`{key} = ")).nth(1)?;
            after.split('`').next().map(str::to_owned)
        };
        let mut seen = Vec::new();
        for (size, slope) in [("12.0", "0.01"), ("80.0", "0.01"), ("250.0", "0.0001")] {
            let desk = limited(size, slope);
            let refused = save(&desk).expect_err("it is beyond").to_string();
            assert!(refused.contains("is wise only where"), "{refused}");
            assert!(desk.store.list().unwrap().is_empty());
            let size = number(&refused, "size_limit_um").unwrap_or(size.to_owned());
            let slope = number(&refused, "slope_limit").unwrap_or(slope.to_owned());
            save(&limited(&size, &slope)).expect("the numbers named do");
            seen.push(refused);
        }
        assert!(seen[0].contains("alone moves the tool"), "{}", seen[0]);
        assert!(
            seen[1].contains("a path there would be stopped"),
            "{}",
            seen[1]
        );
        assert!(seen[2].contains("may change by"), "{}", seen[2]);
    }

    #[test]
    fn a_page_states_the_figures_that_were_stored_and_the_screen_does() {
        let desk = Desk::new();
        let path = desk.journal("run.jsonl", |_, _| ());
        desk.save(path.clone()).expect("it is sound");
        let made = crate::program::volumetric::report::Made::of(&desk.store, "run.jsonl").unwrap();
        let stored = made.geometries.first().expect("it was stored");
        let agreement = stored.agreement.expect("with its figures");
        let html = crate::program::volumetric::report::render(&read_journal(&path).unwrap(), &made);
        for text in [agreement.readings_text(), agreement.tool_text()] {
            assert_eq!(html.matches(&text).count(), 1, "{text}");
            assert!(shown(stored).contains(&text), "{text}");
        }
        assert_eq!(html.matches("standard uncertainty 0").count(), 1);
        // Without what was made, it is evaluated alike.
        let html = crate::program::volumetric::report::render(
            &read_journal(&path).unwrap(),
            &Default::default(),
        );
        assert!(html.contains(&agreement.tool_text()));
    }
}
