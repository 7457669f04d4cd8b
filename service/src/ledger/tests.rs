//! Ledger on a disk that fails at each call in turn, whose power is cut, and that is full.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use machine::records::files::{Fault, Files, SimulatedFiles, write_all};
use units::Metres;

use super::*;
use crate::request::{MoveRequest, RunKind, RunRequest};
use crate::view::{MotionState, RunPlanView, RunState};

const FOLDER: &str = "/records/service";
/// Tests copy it often.
const BALLAST: usize = 4096;
const NO_SPACE: i32 = 28;
const IO: i32 = 5;
const QUOTA: i32 = 122;

fn open(files: &SimulatedFiles) -> (Arc<Ledger>, Writer) {
    let files = Arc::new(files.clone());
    Ledger::open_with(files, Path::new(FOLDER), BALLAST).expect("it can be read")
}

fn bytes(files: &SimulatedFiles) -> Vec<u8> {
    let path = Path::new(FOLDER).join("ledger.jsonl");
    files.read(&path).expect("there is a ledger")
}

/// Puts `content` in the place of the ledger, as an editor or `cp` does.
fn put(files: &SimulatedFiles, content: &[u8]) {
    let path = Path::new(FOLDER).join("ledger.jsonl");
    files.make_folder(Path::new(FOLDER)).expect("a folder");
    let _ = files.remove(&path);
    let mut file = files.create(&path, None).expect("a file");
    write_all(&mut *file, content).expect("room");
    file.sync().expect("a disk");
    files.sync_folder(Path::new(FOLDER)).expect("a disk");
}

fn motion(ledger: &Ledger, key: Option<&str>) -> Asked {
    let request = MoveRequest::of("x", Metres::from_mm(1.0));
    Asked::Motion(AskedMotion::now(
        ledger.next_id('m'),
        key,
        "a test",
        &request,
    ))
}

fn run(ledger: &Ledger, key: &str) -> Asked {
    let request = RunRequest::of(RunKind::Zero, None);
    Asked::Run(AskedRun::now(&ledger.next_id('r'), key, "a test", &request))
}

/// How `asked` ends well.
fn done(asked: &Asked) -> End {
    match asked {
        Asked::Motion(motion) => End::Motion(Arc::new(MotionView {
            state: MotionState::Done,
            kept: None,
            ..motion.unended(true)
        })),
        Asked::Run(_) => {
            let plan = RunPlanView::default();
            let planned =
                RunView::planned(asked.id(), "a test", RunKind::Zero, ("x", vec![]), plan);
            End::Run(Arc::new(RunView {
                state: RunState::Done,
                ..planned
            }))
        }
    }
}

/// Asks, lets the writer write, and hears the answer.
fn ask(ledger: &Ledger, writer: &mut Writer, asked: Asked) -> Result<Noted, Problem> {
    let asked = Arc::new(asked);
    match ledger.begin_note(&asked)? {
        Begun::Before(id) => Ok(Noted::Before(id)),
        Begun::Beside => panic!("no other asks"),
        Begun::Writing(answer) => {
            writer.write();
            let answered = answer.try_recv();
            // A disk that does not answer is given up, as time would.
            let answered = answered.unwrap_or_else(|_| {
                ledger.refuse(asked.id());
                Err(storage("no answer"))
            });
            answered.map(|()| Noted::New)
        }
    }
}

#[test]
fn a_name_of_this_start_is_known_without_its_letters() {
    let files = SimulatedFiles::new();
    let (ledger, _) = Ledger::open(Arc::new(files), Path::new("/store/service")).unwrap();
    let name = ledger.next_id('m');
    assert_eq!(ledger.whole_name(&name), name);
    assert_eq!(ledger.whole_name("m1-1"), name);
    for other in ["m2-1", "m11-1", "", "m", "x"] {
        assert_eq!(ledger.whole_name(other), other);
    }
}

#[test]
fn a_request_is_known_after_a_restart() {
    let files = SimulatedFiles::new();
    let (first, mut writer) = open(&files);
    let one = motion(&first, Some("one"));
    let id = one.id().to_owned();
    assert_eq!(ask(&first, &mut writer, one.clone()), Ok(Noted::New));
    assert_eq!(first.motion(&id).unwrap().state, MotionState::Queued);
    let (second, mut writer) = open(&files);
    let again = motion(&second, Some("one"));
    assert_ne!(again.id(), id, "names are never given twice");
    assert_eq!(
        ask(&second, &mut writer, again),
        Ok(Noted::Before(id.clone()))
    );
    let view = second.motion(&id).unwrap();
    assert_eq!((view.state, view.kept), (MotionState::Failed, Some(true)));
    assert_eq!(second.warnings, Vec::<String>::new());
}

#[test]
fn a_refused_request_may_be_made_again() {
    let files = SimulatedFiles::new();
    let (ledger, mut writer) = open(&files);
    let one = motion(&ledger, Some("one"));
    let id = one.id().to_owned();
    ask(&ledger, &mut writer, one).unwrap();
    ledger.refuse(&id);
    writer.write();
    for ledger in [&ledger, &open(&files).0] {
        assert!(ledger.motion(&id).is_none());
    }
    let (ledger, mut writer) = open(&files);
    let again = motion(&ledger, Some("one"));
    assert_eq!(ask(&ledger, &mut writer, again), Ok(Noted::New));
}

#[test]
fn a_key_of_another_request_is_refused() {
    let (ledger, mut writer) = open(&SimulatedFiles::new());
    let one = motion(&ledger, Some("one"));
    ask(&ledger, &mut writer, one).unwrap();
    let refused = ask(&ledger, &mut writer, run(&ledger, "one")).unwrap_err();
    assert_eq!(refused.code, Code::KeyReused);
}

#[test]
fn an_end_is_kept_once_it_is_on_the_disk() {
    let (ledger, mut writer) = open(&SimulatedFiles::new());
    for asked in [motion(&ledger, None), run(&ledger, "key")] {
        ask(&ledger, &mut writer, asked.clone()).unwrap();
        assert_eq!(ledger.end(done(&asked)), Some(false));
        writer.write();
        assert_eq!(ledger.end(done(&asked)), Some(true));
    }
    let jog = motion(&ledger, None);
    assert_eq!(
        ledger.end(done(&jog)),
        None,
        "what was not asked for is not kept"
    );
}

#[test]
fn a_request_that_is_not_written_is_taken_back() {
    let files = SimulatedFiles::new();
    let (ledger, mut writer) = open(&files);
    let waiting = motion(&ledger, Some("one"));
    let id = waiting.id().to_owned();
    let begun = Instant::now();
    let problem = ledger.note(waiting).unwrap_err();
    assert_eq!(problem.code, Code::Storage, "{problem}");
    assert!(begun.elapsed() >= WRITE_LIMIT);
    writer.write();
    assert!(open(&files).0.motion(&id).is_none());
}

#[test]
fn ends_have_the_room_of_the_ballast_and_no_request_has() {
    let files = SimulatedFiles::new();
    let (ledger, mut writer) = open(&files);
    let moving = motion(&ledger, Some("one"));
    ask(&ledger, &mut writer, moving.clone()).unwrap();
    let ballast = Path::new(FOLDER).join("ledger.ballast");
    assert_eq!(files.read(&ballast).unwrap().len(), BALLAST);
    ledger.end(done(&moving));
    files.fail(files.calls(), Fault::Partly(NO_SPACE));
    writer.write();
    assert!(files.read(&ballast).is_err(), "it was given away");
    assert_eq!(ledger.motion(moving.id()).unwrap().kept, Some(true));
    let problem = ask(&ledger, &mut writer, motion(&ledger, None)).unwrap_err();
    assert_eq!(problem.code, Code::Storage);
    assert!(problem.cause.contains("ledger.jsonl"), "{problem}");
    writer.retry_now();
    writer.write();
    assert_eq!(files.read(&ballast).unwrap().len(), BALLAST);
    let later = motion(&ledger, None);
    assert_eq!(ask(&ledger, &mut writer, later), Ok(Noted::New));
}

#[test]
fn a_damaged_ledger_refuses_keys_until_accepted() {
    let files = SimulatedFiles::new();
    let (ledger, mut writer) = open(&files);
    for key in ["one", "two"] {
        let asked = motion(&ledger, Some(key));
        ask(&ledger, &mut writer, asked).unwrap();
    }
    let mut content = bytes(&files);
    let at = content.windows(3).position(|part| part == b"one").unwrap();
    content[at] ^= 1;
    put(&files, &content);
    for _ in 0..2 {
        let (ledger, mut writer) = open(&files);
        let kept = files.read(&Path::new(FOLDER).join("ledger.damaged-1"));
        assert_eq!(kept.unwrap(), content);
        assert!(ledger.warnings[0].contains("ledger.damaged-1"));
        let problem = ask(&ledger, &mut writer, motion(&ledger, Some("two"))).unwrap_err();
        assert_eq!(problem.code, Code::Storage, "{problem}");
        assert_eq!(
            ledger.storage().damaged.as_deref(),
            Some("ledger.damaged-1")
        );
        let keyless = motion(&ledger, None);
        assert_eq!(ask(&ledger, &mut writer, keyless), Ok(Noted::New));
    }
    let (ledger, mut writer) = open(&files);
    std::thread::scope(|scope| {
        let accepting = scope.spawn(|| ledger.accept_damage("anna"));
        while !accepting.is_finished() {
            writer.write();
        }
    });
    for (ledger, mut writer) in [(ledger, writer), open(&files)] {
        let known = ask(&ledger, &mut writer, motion(&ledger, Some("two"))).unwrap();
        assert!(matches!(known, Noted::Before(_)), "{known:?}");
    }
}

#[test]
fn a_copy_of_the_ledger_is_noticed() {
    let files = SimulatedFiles::new();
    let (ledger, mut writer) = open(&files);
    let asked = motion(&ledger, Some("one"));
    ask(&ledger, &mut writer, asked).unwrap();
    let copy = bytes(&files);
    let (ledger, mut writer) = open(&files);
    let lost = motion(&ledger, Some("two"));
    ask(&ledger, &mut writer, lost.clone()).unwrap();
    put(&files, &copy);
    let (ledger, mut writer) = open(&files);
    assert!(
        ledger.warnings[0].contains("restored"),
        "{:?}",
        ledger.warnings
    );
    let again = motion(&ledger, Some("two"));
    assert_ne!(again.id(), lost.id(), "names are never given twice");
    assert_eq!(ask(&ledger, &mut writer, again), Ok(Noted::New));
    assert_eq!(
        open(&files).0.warnings,
        Vec::<String>::new(),
        "it is told once"
    );
}

#[test]
fn a_ledger_of_an_earlier_program_is_read() {
    let files = SimulatedFiles::new();
    let (ledger, mut writer) = open(&files);
    let asked = motion(&ledger, Some("one"));
    ask(&ledger, &mut writer, asked.clone()).unwrap();
    let Asked::Motion(asked) = asked else {
        unreachable!()
    };
    let line = serde_json::json!({"asked": asked});
    // Its last record was torn by a full disk, and the next one stands behind it.
    let torn = r#"{"asked":{"id":"m1-9","key":"nine","by":"#;
    put(&files, format!("{{\"boot\":7}}\n{torn}{line}\n").as_bytes());
    let (ledger, mut writer) = open(&files);
    let again = motion(&ledger, Some("one"));
    assert!(again.id().starts_with("m8"), "{}", again.id());
    assert_eq!(
        ask(&ledger, &mut writer, again),
        Ok(Noted::Before(asked.id))
    );
    assert_eq!(ledger.storage().damaged, None);
}

/// What a client was told.
#[derive(Debug, Default)]
struct Told {
    /// By key: the name that was given for it, and whether its end was told as kept.
    keyed: BTreeMap<String, (String, bool)>,
    /// Names of motions without a key, likewise.
    keyless: BTreeMap<String, bool>,
    /// Names whose motion was given to the machine.
    begun: Vec<String>,
}

impl Told {
    fn ask(&mut self, ledger: &Ledger, writer: &mut Writer, asked: &Asked) -> bool {
        match ask(ledger, writer, asked.clone()) {
            Ok(Noted::New) => {
                self.begun.push(asked.id().to_owned());
                match asked.key() {
                    Some(key) => {
                        let before = self.keyed.insert(key.into(), (asked.id().into(), false));
                        assert!(before.is_none(), "{key} moves twice");
                    }
                    None => drop(self.keyless.insert(asked.id().into(), false)),
                }
                true
            }
            Ok(Noted::Before(_)) | Err(_) => false,
        }
    }

    fn end(&mut self, ledger: &Ledger, writer: &mut Writer, asked: &Asked) {
        ledger.end(done(asked));
        writer.write();
        let is_kept = ledger.end(done(asked)) == Some(true);
        match asked.key() {
            Some(key) => self.keyed.get_mut(key).expect("it was asked for").1 = is_kept,
            None => drop(self.keyless.insert(asked.id().into(), is_kept)),
        }
    }

    fn end_if(&mut self, was_asked: bool, parts: (&Ledger, &mut Writer), asked: &Asked) {
        if was_asked {
            self.end(parts.0, parts.1, asked);
        }
    }

    /// A life of the ledger on `files`; each `life` has keys of its own, and asks for those of the one before again.
    fn live(&mut self, files: &SimulatedFiles, life: u32) {
        let shared: Arc<dyn Files> = Arc::new(files.clone());
        let Ok((ledger, mut writer)) = Ledger::open_with(shared, Path::new(FOLDER), BALLAST) else {
            return;
        };
        let writer = &mut writer;
        let key = |name: &str, life: u32| format!("{name}-{life}");
        let [one, refused, four] =
            ["one", "refused", "four"].map(|name| motion(&ledger, Some(&key(name, life))));
        let keyless = motion(&ledger, None);
        let zero = run(&ledger, &key("run", life));
        let has_one = self.ask(&ledger, writer, &one);
        let has_keyless = self.ask(&ledger, writer, &keyless);
        if self.ask(&ledger, writer, &refused) {
            // The machine has not begun it.
            self.begun.pop();
            self.keyed.remove(&key("refused", life));
            ledger.refuse(refused.id());
            writer.write();
        }
        self.end_if(has_one, (&ledger, writer), &one);
        let has_zero = self.ask(&ledger, writer, &zero);
        self.end_if(has_keyless, (&ledger, writer), &keyless);
        self.end_if(has_zero, (&ledger, writer), &zero);
        writer.retry_now();
        writer.write();
        self.ask(&ledger, writer, &four);
        self.check(&ledger, life == 0, "while it lives");
        if life > 0 {
            let again = motion(&ledger, Some(&key("one", life - 1)));
            // What was never taken may begin now; what was taken may not.
            self.ask(&ledger, writer, &again);
        }
    }

    /// Every request and end that was told is there, and none is there as done that was not.
    fn check(&self, ledger: &Ledger, has_all: bool, what: &str) {
        for (id, is_kept) in self.keyed.values() {
            let ended = match id.starts_with('m') {
                true => ledger
                    .motion(id)
                    .map(|view| view.state == MotionState::Done),
                false => ledger.run(id).map(|view| view.state == RunState::Done),
            };
            let ended = ended.unwrap_or_else(|| panic!("{what}: {id} is lost: {self:?}"));
            assert!(ended || !is_kept, "{what}: the end of {id} is lost");
        }
        for (id, is_kept) in &self.keyless {
            let view = ledger.motion(id);
            assert!(view.is_some() || !has_all, "{what}: {id} is lost");
            let is_done = view.is_some_and(|view| view.state == MotionState::Done);
            assert!(is_done || !is_kept, "{what}: the end of {id} is lost");
        }
        for entry in ledger.state().memory.entries() {
            if entry.end.is_some() {
                let id = entry.asked.id();
                assert!(
                    self.begun.iter().any(|known| known == id),
                    "{what}: {id} was invented"
                );
            }
        }
    }
}

/// How a life ends.
#[derive(Clone, Copy, Debug)]
enum Cut {
    Kill,
    Power(u32),
}

fn cut(files: &SimulatedFiles, how: Cut) {
    match how {
        Cut::Kill => files.restart(),
        Cut::Power(seed) => {
            let mut dice = seed;
            files.cut_power(|| {
                dice = dice.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                f64::from(dice >> 24) / 128.0 - 0.5
            });
        }
    }
}

/// Each call of two lives fails in each way, then the program is killed or the power cut.
#[test]
fn no_failed_call_loses_an_acknowledgement() {
    let calls = {
        let files = SimulatedFiles::new();
        let mut told = Told::default();
        told.live(&files, 0);
        let first = files.calls();
        files.restart();
        told.live(&files, 1);
        (first, files.calls())
    };
    let errors = [NO_SPACE, IO, QUOTA].into_iter();
    let faults = errors.flat_map(|errno| [Fault::Error(errno), Fault::Partly(errno)]);
    let faults: Vec<_> = faults.chain([Fault::End]).collect();
    let cuts = [Cut::Kill].into_iter().chain((0..12).map(Cut::Power));
    let cuts: Vec<_> = cuts.collect();
    let (mut histories, mut refused) = (0, 0);
    for call in 0..calls.1 {
        for fault in &faults {
            for how in &cuts {
                let files = SimulatedFiles::new();
                let mut told = Told::default();
                let mut life = 0;
                if call >= calls.0 {
                    told.live(&files, 0);
                    cut(&files, *how);
                    life = 1;
                }
                files.fail(call, *fault);
                let asked = told.begun.len();
                told.live(&files, life);
                refused += usize::from(told.begun.len() < asked + 4);
                cut(&files, *how);
                let what = format!("call {call}, {fault:?}, {how:?}");
                let (ledger, writer) = open(&files);
                let is_kill = matches!(how, Cut::Kill);
                told.check(&ledger, is_kill, &what);
                assert_eq!(ledger.storage().damaged, None, "{what}");
                drop((ledger, writer));
                told.live(&files, life + 1);
                cut(&files, *how);
                let (ledger, _writer) = open(&files);
                told.check(&ledger, is_kill, &what);
                histories += 1;
            }
        }
    }
    println!(
        "{histories} histories: {} calls, {} faults, {} cuts; {refused} refused a request",
        calls.1,
        faults.len(),
        cuts.len()
    );
    assert!(histories > 2000 && refused > 100, "{histories}, {refused}");
}
