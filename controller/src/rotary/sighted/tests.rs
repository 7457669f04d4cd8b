use core::f64::consts::TAU;
use core::time::Duration;

use compensator::rotary::{Sighted, SightedPlan};
use machine::records::ReadJournal;
use units::Radians;

use super::alone::{NextPlacement, Progress, Source, calibrate, verify};
use super::{Asked, Person, Question};
use crate::Edit;
use crate::config::{self, Loaded};
use crate::failure::Failure;
use crate::rotary::calibrate::RotaryCalibrated;
use crate::rotary::operator::{Operator, PlateMove, PlateTask};
use crate::rotary::subject::Subject;
use crate::rotary::{PlateLog, RotaryFailure, SightingConfig};
use crate::run::CalibrateOptions;
use crate::runs::DataFile;
use crate::store::{IdentityRecord, RecordHead, Store, read_journal};
use crate::stores::store_in;

const LINES: usize = 36;
const NOISE_ARCSEC: f64 = 0.05;

/// A machine whose plate of 36 lines a person reads.
fn loaded(value: &str) -> Loaded {
    let text = include_str!("../../../../configs/machines/rotary.toml");
    let sighting = format!("[rotary.c.sighting]\nvalue = \"{value}\"\nrange_arcsec = 120.0");
    let text = text
        .edit(
            "[rotary.c.line_detector]       # at the drive's touch probe 1",
            &sighting,
        )
        .edit(
            "edge = \"positive\"              # \"positive\", \"negative\"",
            "",
        )
        .edit("lines = 360", "lines = 36")
        .edit(
            "closure_limit_arcsec = 0.1 ",
            "closure_limit_arcsec = 0.15 ",
        )
        .edit("offset_lines = 200.5", "offset_lines = 20.5");
    config::parse(&text, "machine.toml").unwrap_or_else(|failure| panic!("{failure}"))
}

fn subject(loaded: &Loaded) -> Subject<'_> {
    let rotary = &loaded.config.rotary["c"];
    Subject {
        axis: "c",
        config: rotary,
        hash: &loaded.hash,
        here: RecordHead {
            schema_version: 1,
            stage_serial: loaded.config.machine.stage_serial.clone(),
            config_hash: loaded.hash.as_str().to_owned(),
            axis: "c".into(),
            drive: IdentityRecord::from(&rotary.node.identity.configured()),
            resolution_rad: Some(TAU / f64::from(rotary.counts_per_turn)),
            ..RecordHead::default()
        },
        asked: false,
    }
}

/// The placements that are configured.
fn offsets(loaded: &Loaded) -> Vec<f64> {
    let run = loaded.config.rotary["c"].calibrate.as_ref().unwrap();
    let design = run.design().unwrap();
    design.offsets().iter().map(|it| *it as f64).collect()
}

fn store() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = store_in(folder.path(), "m");
    (folder, store)
}

/// Reading − true angle of the table at a reading, arcseconds.
fn table_error(reading: f64) -> f64 {
    6.0 * reading.cos() + 2.0 * (2.0 * reading).sin() + (9.0 * reading + 0.3).cos()
}

/// The same every time: uniform between −1 and 1.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        let next = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = next.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }
}

/// A plate that lies on the table, and somebody who reads it.
struct Reader {
    chance: Chance,
    plate_arcsec: Vec<f64>,
    lies_at: f64,
    /// How far each placement is off.
    askew_arcsec: f64,
    /// What has moved since it was placed.
    slipped_arcsec: f64,
    /// In how many lines it is turned too far.
    mistaken: f64,
    asked_to: Vec<PlateTask>,
    told: Vec<String>,
    refused: Vec<String>,
    answers: Vec<String>,
    questions: usize,
    /// What is typed at a question, counted from 1, in place of what was seen.
    instead: Vec<(usize, &'static str)>,
    close: &'static str,
}

impl Reader {
    fn new(seed: u64) -> Self {
        let mut chance = Chance(seed);
        let plate_arcsec = (0..LINES).map(|_| 30.0 * chance.next()).collect();
        Self {
            chance,
            plate_arcsec,
            lies_at: 0.0,
            askew_arcsec: 40.0,
            slipped_arcsec: 0.0,
            mistaken: 0.0,
            asked_to: Vec::new(),
            told: Vec::new(),
            refused: Vec::new(),
            answers: Vec::new(),
            questions: 0,
            instead: Vec::new(),
            close: "",
        }
    }

    fn typing(mut self, instead: &[(usize, &'static str)]) -> Self {
        self.instead = instead.to_vec();
        self
    }

    /// What is read where a line should be, arcseconds, or degrees of the encoder.
    fn sees(&mut self, line: usize, value: Sighted, nominal: Radians) -> f64 {
        let spacing = TAU / LINES as f64;
        // Of a plate that was turned too far it is another one.
        let really = (line as f64 - self.mistaken).rem_euclid(LINES as f64);
        let off = self.askew_arcsec + self.slipped_arcsec + self.plate_arcsec[really as usize];
        let place = (really + self.lies_at) * spacing;
        let truth = place + Radians::from_arcsec(off).value();
        let error = |reading: f64| Radians::from_arcsec(table_error(reading)).value();
        let noise = NOISE_ARCSEC * self.chance.next() * 3.0_f64.sqrt();
        match value {
            Sighted::ToLine => {
                let away = truth - (nominal.value() - error(nominal.value()));
                let away = Radians(away);
                (away - away.whole_turns()).arcsec() + noise
            }
            Sighted::Angle | Sighted::Deviation => {
                let mut reading = truth;
                for _ in 0..3 {
                    reading = truth + error(reading);
                }
                let reading = Radians(reading) + Radians::from_arcsec(noise);
                let away = reading - nominal;
                match value {
                    Sighted::Angle => reading.degrees().rem_euclid(360.0),
                    _ => (away - away.whole_turns()).arcsec(),
                }
            }
        }
    }

    /// The file of the placement where the plate lies.
    fn file(&mut self, plan: &SightedPlan, value: Sighted) -> DataFile {
        let mut text = format!("{}\n", value.header());
        for (pass, approach) in plan.passes() {
            for line in 0..LINES {
                let seen = self.sees(line, value, plan.nominal(line));
                let sign = approach.symbol();
                text += &format!("{},{pass},{sign},{line},{seen:.6}\n", plan.offset);
            }
        }
        let name = format!("offset-{}.csv", plan.offset);
        DataFile { name, text }
    }

    fn place(&mut self, offset: f64) {
        self.lies_at = offset + self.mistaken;
        self.slipped_arcsec = 0.0;
        self.askew_arcsec = 40.0 * self.chance.next();
    }
}

impl Operator for Reader {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        self.asked_to.push(task.clone());
        self.place(task.offset);
        Ok(())
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(true)
    }
}

impl Person for Reader {
    fn tell(&mut self, text: &str) {
        self.told.push(text.to_owned());
    }

    fn question(&mut self, question: &Question) -> Result<(), Failure> {
        self.questions += 1;
        let number = self.questions;
        let said = match question.asked {
            Asked::Line {
                line,
                value,
                nominal,
            } => {
                let seen = self.sees(line as usize, value, nominal);
                let unit = if value == Sighted::Angle {
                    "deg"
                } else {
                    "arcsec"
                };
                format!("{seen:.6}{unit}")
            }
            Asked::Close => {
                self.told.push(question.text.clone());
                self.close.to_owned()
            }
        };
        let instead = self.instead.iter().find(|it| it.0 == number);
        self.answers
            .push(instead.map_or(said, |it| it.1.to_owned()));
        Ok(())
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        Ok(self.answers.pop())
    }

    fn refuse(&mut self, why: &str) -> Result<(), Failure> {
        self.refused.push(why.to_owned());
        assert!(self.refused.len() < 20, "{:?}", self.refused);
        Ok(())
    }

    fn wait(&mut self, _: Duration) {}
}

fn typed(
    loaded: &Loaded,
    store: &Store,
    options: &CalibrateOptions,
    reader: &mut Reader,
) -> Result<RotaryCalibrated, Failure> {
    match calibrate(subject(loaded), store, options, Source::Person(reader))? {
        Progress::Done(it) => Ok(*it),
        Progress::Due(it) => panic!("{:?} is due", it.task),
    }
}

fn imported(
    loaded: &Loaded,
    store: &Store,
    resume: Option<&NextPlacement>,
    files: &[DataFile],
) -> Result<Progress, Failure> {
    let options = CalibrateOptions {
        resume: resume.map(|it| it.journal.clone()),
        accept_drift: false,
        ..CalibrateOptions::default()
    };
    calibrate(subject(loaded), store, &options, Source::Files(files))
}

fn plan(loaded: &Loaded, offset: f64) -> SightedPlan {
    let config = loaded.config.rotary["c"].sighting.as_ref().unwrap();
    crate::rotary::sighting::Sighting::from(config).plan(offset, LINES as u32, 1)
}

fn value_of(config: Option<&SightingConfig>) -> Sighted {
    config.unwrap().value.into()
}

fn newest(store: &Store) -> ReadJournal<PlateLog> {
    let path = store.newest_run("calibrate", "c").unwrap();
    read_journal(&path.expect("a run was begun")).unwrap()
}

fn resume(store: &Store) -> CalibrateOptions {
    CalibrateOptions {
        resume: store.newest_run("calibrate", "c").unwrap(),
        accept_drift: false,
        ..CalibrateOptions::default()
    }
}

/// The largest error of the table errors found, in units of their uncertainty.
fn worst(found: &RotaryCalibrated) -> f64 {
    let spacing = TAU / LINES as f64;
    let truth: Vec<f64> = (0..LINES)
        .map(|at| table_error(at as f64 * spacing))
        .collect();
    let mean = truth.iter().sum::<f64>() / LINES as f64;
    let u = found.content.uncertainty_max().unwrap().arcsec();
    let apart = found.content.table_error_rad.iter().zip(&truth);
    apart
        .map(|(seen, truth)| (Radians(*seen).arcsec() - (truth - mean)).abs() / u)
        .fold(0.0, f64::max)
}

#[test]
fn a_plate_that_a_person_reads_gives_the_tables_error_in_each_of_the_three_ways() {
    for value in ["to_line", "angle", "deviation"] {
        let loaded = loaded(value);
        let (_folder, store) = store();
        let mut reader = Reader::new(11);
        let found = typed(&loaded, &store, &CalibrateOptions::default(), &mut reader)
            .unwrap_or_else(|failure| panic!("{value}: {failure}"));
        let off = worst(&found);
        assert!(off < 4.5, "{value}: {off} standard uncertainties");
        assert!(
            found.content.uncertainty_max().unwrap().arcsec() < 0.05,
            "{value}"
        );
        assert_eq!(
            (reader.asked_to.len(), reader.refused.len()),
            (4, 0),
            "{value}"
        );
        assert_eq!(reader.asked_to[0].by, PlateMove::FixAt { offset: 0.0 });
        // Three passes of 36 lines, and the question whether to close.
        assert_eq!(reader.questions, 4 * (3 * LINES + 1), "{value}");
        assert!(newest(&store).complete);
        assert_eq!(store.active("c").unwrap().current, Some(found.id));
    }
}

/// A table that stands at its positions shows its error there, however askew the plate lies.
#[test]
fn a_line_that_is_read_from_its_position_needs_no_correction_for_where_it_is() {
    let loaded = loaded("to_line");
    let (_folder, store) = store();
    let mut files = Vec::new();
    let mut reader = Reader::new(12);
    for offset in offsets(&loaded) {
        reader.place(offset);
        reader.askew_arcsec = 9000.0;
        files.push(reader.file(&plan(&loaded, offset), Sighted::ToLine));
    }
    let Progress::Done(found) = imported(&loaded, &store, None, &files).unwrap() else {
        panic!("all placements were given")
    };
    assert!(worst(&found) < 4.5, "{}", worst(&found));
    assert_eq!(found.content.plate_phase_rad, None);
}

#[test]
fn somebody_who_stops_goes_on_at_the_next_line_and_nothing_typed_is_lost() {
    let loaded = loaded("deviation");
    let (_folder, store) = store();
    // In the first pass of the second placement.
    let stop = 3 * LINES + 1 + 18;
    let mut reader = Reader::new(13).typing(&[(stop, "stop")]);
    let stopped = typed(&loaded, &store, &CalibrateOptions::default(), &mut reader);
    assert_eq!(stopped.unwrap_err().exit_code(), 130);
    let kept = newest(&store).log;
    assert_eq!((kept.placements.len(), kept.sweeps.len()), (1, 4));
    assert_eq!(kept.sweeps[3].deviations_rad.iter().flatten().count(), 17);

    reader.instead.clear();
    reader.questions = 0;
    let asked_before = reader.asked_to.len();
    let found = typed(&loaded, &store, &resume(&store), &mut reader).unwrap();
    // Nobody is asked to turn a plate that lies where it was left.
    assert_eq!(reader.asked_to.len() - asked_before, 2);
    assert_eq!(reader.questions, 3 * (3 * LINES + 1) - 17);
    assert!(worst(&found) < 4.5);
    let whole = newest(&store);
    assert_eq!(whole.log.sweeps[..3], kept.sweeps[..3]);
    let (before, after) = (
        &kept.sweeps[3].deviations_rad,
        &whole.log.sweeps[3].deviations_rad,
    );
    let both = before.iter().zip(after);
    assert!(
        both.filter(|it| it.0.is_some())
            .all(|(before, after)| before == after)
    );
}

#[test]
fn values_that_cannot_be_are_refused_and_a_line_is_typed_again_until_the_placement_is_closed() {
    let loaded = loaded("deviation");
    let (_folder, store) = store();
    let typing = [
        (1, ""),
        (2, "12.5"),
        (3, "12,5arcsec"),
        (4, "9.9deg"),
        (6, "-300arcsec"),
        // A slip within the range, of line 2, and taken back.
        (8, "30arcsec"),
        (9, "again"),
        (11, "again 35"),
        (12, "none"),
        (13, "again 3"),
    ];
    let mut reader = Reader::new(14).typing(&typing);
    let found = typed(&loaded, &store, &CalibrateOptions::default(), &mut reader).unwrap();
    for (at, says) in [
        "type the value",
        "has no unit",
        "has a comma",
        "half the line spacing",
        "range_arcsec",
        "line 35 of pass 1+ was not read yet",
    ]
    .iter()
    .enumerate()
    {
        assert!(
            reader.refused[at].contains(says),
            "{at}: {:?}",
            reader.refused
        );
    }
    assert_eq!(reader.refused.len(), 6, "{:?}", reader.refused);
    let first = &newest(&store).log.sweeps[0];
    assert!(first.missing.is_empty() && first.deviations_rad.iter().all(Option::is_some));
    assert!(worst(&found) < 4.5 && found.solution.outliers.is_empty());
}

#[test]
fn a_line_that_differs_from_pass_to_pass_is_named_at_once_and_can_be_put_right_before_closing() {
    let loaded = loaded("deviation");
    let (_folder, store) = store();
    // Line 35 of pass 1-, the first that is read there; put right when the placement is to be closed.
    let typing = [(LINES + 1, "60arcsec"), (3 * LINES + 1, "again 35 1-")];
    let mut reader = Reader::new(15).typing(&typing);
    let found = typed(&loaded, &store, &CalibrateOptions::default(), &mut reader).unwrap();
    let named = |it: &String| it.contains("line 35 is") && it.contains("`again 35 1-`");
    assert!(reader.told.iter().any(named), "{:?}", reader.told);
    let clean = reader
        .told
        .iter()
        .filter(|it| it.contains("if one of them was a slip"));
    // Against pass 1+ when it was typed; pass 2+ differs from it again until it was put right.
    assert_eq!(clean.count(), 2, "{:?}", reader.told);
    assert!(found.solution.outliers.is_empty() && worst(&found) < 4.5);
}

#[test]
fn a_placement_that_moved_is_not_closed_and_one_that_is_given_up_is_asked_for_again() {
    let loaded = loaded("deviation");
    let (_folder, store) = store();
    let mut reader = Reader::new(16).typing(&[(3 * LINES + 2, "discard")]);
    // It slips before the first pass is repeated.
    struct Slips(Reader);
    impl Operator for Slips {
        fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
            self.0.ask(task)
        }
        fn is_done(&mut self) -> Result<bool, Failure> {
            self.0.is_done()
        }
    }
    impl Person for Slips {
        fn tell(&mut self, text: &str) {
            self.0.tell(text);
        }
        fn question(&mut self, question: &Question) -> Result<(), Failure> {
            if self.0.questions == 2 * LINES {
                self.0.slipped_arcsec = 2.0;
            }
            self.0.question(question)
        }
        fn answer(&mut self) -> Result<Option<String>, Failure> {
            self.0.answer()
        }
        fn refuse(&mut self, why: &str) -> Result<(), Failure> {
            self.0.refuse(why)
        }
        fn wait(&mut self, at_most: Duration) {
            self.0.wait(at_most);
        }
    }
    let mut slips = Slips(reader);
    let source = Source::Person(&mut slips);
    let stopped = calibrate(
        subject(&loaded),
        &store,
        &CalibrateOptions::default(),
        source,
    );
    assert!(stopped.is_err());
    reader = slips.0;
    assert_eq!(reader.refused.len(), 1);
    assert!(
        reader.refused[0].contains("moved by"),
        "{:?}",
        reader.refused
    );
    let log = newest(&store).log;
    assert_eq!((log.sweeps.len(), log.placements.len()), (0, 0));
    reader.instead.clear();
    let found = typed(&loaded, &store, &resume(&store), &mut reader).unwrap();
    assert_eq!(reader.asked_to[1].offset, 0.0);
    assert!(worst(&found) < 4.5);
}

#[test]
fn placements_come_file_by_file_each_when_it_is_due_and_bad_ones_change_nothing() {
    let loaded = loaded("angle");
    let value = value_of(loaded.config.rotary["c"].sighting.as_ref());
    let (_folder, store) = store();
    let offsets = offsets(&loaded);
    let mut reader = Reader::new(17);
    reader.place(offsets[0]);
    let first = reader.file(&plan(&loaded, offsets[0]), value);
    let worse = DataFile {
        text: first.text.edit_first("0,1,+,5,", "0,1,+,5,9"),
        ..first.clone()
    };
    let refused = imported(&loaded, &store, None, &[worse]).err().unwrap();
    assert_eq!(refused.exit_code(), 2);
    assert!(refused.to_string().contains("offset-0.csv:7:"), "{refused}");
    assert_eq!(
        store.newest_run("calibrate", "c").unwrap(),
        None,
        "a run was begun"
    );

    let Progress::Due(next) =
        imported(&loaded, &store, None, core::slice::from_ref(&first)).unwrap()
    else {
        panic!("there are four placements")
    };
    assert_eq!((next.task.offset, next.task.step), (offsets[1], (2, 4)));
    assert_eq!(next.task.by, PlateMove::TurnBy(offsets[1]));
    let again = imported(&loaded, &store, Some(&next), &[first])
        .err()
        .unwrap();
    assert!(
        again
            .to_string()
            .contains("offset-0.csv:2:1: `offset` is 0"),
        "{again}"
    );
    let before = newest(&store).log;

    let mut files = Vec::new();
    for offset in &offsets[1..] {
        reader.place(*offset);
        files.push(reader.file(&plan(&loaded, *offset), value));
    }
    let Progress::Done(found) = imported(&loaded, &store, Some(&next), &files).unwrap() else {
        panic!("all placements were given")
    };
    assert!(worst(&found) < 4.5, "{}", worst(&found));
    assert_eq!(newest(&store).log.sweeps[..3], before.sweeps[..]);

    reader.place(20.5);
    let between = [reader.file(&plan(&loaded, 20.5), value)];
    let verified = verify(
        subject(&loaded),
        &store,
        (true, None),
        Source::Files(&between),
    )
    .unwrap();
    let left = verified.left.clone().unwrap();
    assert!(
        verified.is_within_tolerance() && left.rms.arcsec() < 0.1,
        "{}",
        left.rms.arcsec()
    );
    assert!(verified.found.largest.arcsec() > 5.0);
}

#[test]
fn a_table_read_from_half_a_line_beside_its_positions_is_verified_there() {
    let loaded = loaded("to_line");
    let (_folder, store) = store();
    let mut reader = Reader::new(18);
    typed(&loaded, &store, &CalibrateOptions::default(), &mut reader).unwrap();
    let before = reader.questions;
    // Stopped half way, and continued.
    reader.instead = vec![(before + 50, "stop")];
    let source = Source::Person(&mut reader);
    verify(subject(&loaded), &store, (true, None), source).unwrap_err();
    reader.instead.clear();
    let journal = store.newest_run("verify", "c").unwrap();
    let how = (true, journal.as_ref());
    let it = verify(subject(&loaded), &store, how, Source::Person(&mut reader)).unwrap();
    assert_eq!(reader.questions - before, 50 + 3 * LINES - 49 + 1);
    assert!(it.is_within_tolerance() && it.left.unwrap().rms.arcsec() < 0.1);
}

#[test]
fn a_plate_turned_by_a_wrong_number_of_lines_is_named_and_only_that_placement_is_read_again() {
    let loaded = loaded("deviation");
    let (_folder, store) = store();
    let mut reader = Reader::new(19);
    let offsets = offsets(&loaded);
    let mut files = Vec::new();
    for (at, offset) in offsets.iter().enumerate() {
        reader.mistaken = if at == 1 { 1.0 } else { 0.0 };
        reader.place(*offset);
        files.push(reader.file(&plan(&loaded, *offset), Sighted::Deviation));
    }
    let refused = imported(&loaded, &store, None, &files).err().unwrap();
    let misplaced = refused.of_kind();
    assert!(
        matches!(misplaced, Some(RotaryFailure::Misplaced { .. })),
        "{refused}"
    );
    let kept: Vec<f64> = newest(&store)
        .log
        .placements
        .iter()
        .map(|it| it.offset)
        .collect();
    assert!(!kept.contains(&offsets[1]) && kept.len() >= 2, "{kept:?}");
}
