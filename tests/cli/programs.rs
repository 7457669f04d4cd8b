//! The project's programs as a user runs them: processes, their output, their exit codes.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::fd::AsFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

use drivers::transport::clock::Clock;
use drivers::transport::lockstep::Participant;
use nix::fcntl::OFlag;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use tests::json_schema::check_output;
use tests::{Edit, INTERFACE, LINEAR, Rig, Shipped, rigs};

/// The clock that a machine and its controllers share, beside the machine's other files.
const LOCKSTEP: &str = "lockstep:clock";

/// Machines share the processor, and on SocketCAN the interface: one after the other.
static ONE_MACHINE: Mutex<()> = Mutex::new(());

/// Waits for its turn on the processor.
pub(crate) fn one_machine() -> MutexGuard<'static, ()> {
    ONE_MACHINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where a service listens, below the machine's folder.
pub(crate) const SOCKET: &str = "truestage.sock";

/// The rigs of this run on which other processes find a machine.
pub(crate) fn live_rigs() -> impl Iterator<Item = Rig> {
    rigs().into_iter().filter(|rig| *rig != Rig::InProcess)
}

/// A program of this workspace, beside the tests that cargo built.
pub(crate) fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a process knows its program");
    let folder = test.ancestors().nth(2).expect("target/PROFILE/deps/TEST");
    let path = folder.join(name);
    assert!(
        path.exists(),
        "{} is not there: run `cargo build --workspace --bins --examples` first, as tests/run does",
        path.display()
    );
    path
}

/// A process that ends with its test.
pub(crate) struct Process {
    child: Child,
    /// Whether it asks a service, and so counts seconds of the wall: a busy computer may hold it up for any of them.
    is_client: bool,
}

impl Process {
    pub(crate) fn start(command: &mut Command) -> Self {
        Self::start_at(command, Stdio::null())
    }

    /// Likewise, at a terminal of its own, say.
    pub(crate) fn start_at(command: &mut Command, input: Stdio) -> Self {
        let command = command.stdin(input).stdout(Stdio::piped());
        Self::spawn(command.stderr(Stdio::piped()))
    }

    /// The same with its streams as `command` has them.
    pub(crate) fn spawn(command: &mut Command) -> Self {
        let child = command.spawn();
        Self {
            child: child.unwrap_or_else(|error| panic!("{command:?}: {error}")),
            is_client: false,
        }
    }

    /// Its number.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal to this process and no other.
    pub(crate) fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.child.id()).expect("process numbers are positive");
        kill(Pid::from_raw(id), signal).expect("the process has not been waited for");
    }

    /// Waits until `reached`; looks whenever the process prints, and every few milliseconds.
    ///
    /// # Panics
    /// When the process ends before.
    pub(crate) fn wait_until(&mut self, reached: impl Fn() -> bool) {
        const LOOK_EVERY_MS: u16 = 5;
        while !reached() {
            self.goes_on();
            let output = self.child.stdout.as_ref().expect("it is piped").as_fd();
            let mut fds = [PollFd::new(output, PollFlags::POLLIN)];
            // A signal only makes the next look come sooner.
            let _ = poll(&mut fds, PollTimeout::from(LOOK_EVERY_MS));
        }
    }

    pub(crate) fn has_ended(&mut self) -> bool {
        let ended = self.child.try_wait().expect("a child can be asked");
        ended.is_some()
    }

    /// # Panics
    /// When it has ended.
    pub(crate) fn goes_on(&mut self) {
        let ended = self.child.try_wait().expect("a child can be asked");
        assert!(ended.is_none(), "it ended before: {:?}", self.collect());
    }

    /// Waits for its end.
    pub(crate) fn end(mut self) -> Ended {
        self.collect()
    }

    fn collect(&mut self) -> Ended {
        let child = std::mem::replace(&mut self.child, nothing());
        let output = child.wait_with_output().expect("a child can be waited for");
        if !self.is_client {
            check_no_silence(&String::from_utf8_lossy(&output.stderr));
        }
        Ended::new(&output)
    }

    /// Waits for its end, and shows each line that it tells people meanwhile to `hear`.
    pub(crate) fn end_heard(mut self, mut hear: impl FnMut(&Self, &str)) -> Ended {
        let said = self.child.stderr.take().expect("it is piped");
        let mut told = String::new();
        for line in BufReader::new(said).lines() {
            let line = line.expect("a program prints text");
            hear(&self, &line);
            told += &line;
            told.push('\n');
        }
        let ended = self.end();
        Ended {
            said: told + &ended.said,
            ..ended
        }
    }
}

/// Something that has ended, in the place of a child that was given away.
fn nothing() -> Child {
    let mut child = Command::new("true").spawn().expect("`true` is everywhere");
    let _ = child.wait();
    child
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// How a program ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// `None`: by a signal.
    pub(crate) code: Option<i32>,
    /// The one object on standard output; null when there is none.
    pub(crate) json: Value,
    /// What it told people.
    pub(crate) said: String,
}

impl Ended {
    fn new(output: &Output) -> Self {
        let text = String::from_utf8_lossy(&output.stdout);
        let json = if text.trim().is_empty() {
            Value::Null
        } else {
            let parsed = serde_json::from_str(&text);
            parsed.unwrap_or_else(|error| panic!("not one JSON object: {error}: {text}"))
        };
        if !json.is_null() {
            check_output(&json);
        }
        Self {
            code: output.status.code(),
            json,
            said: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// One that was at work for longer than it may be silent, and said so.
    #[track_caller]
    pub(crate) fn that_told(self) -> Self {
        assert!(self.said.contains("\n  at 8 s: "), "{self:#?}");
        self
    }

    /// The result of a program that must have ended with `code`.
    #[track_caller]
    pub(crate) fn with_code(self, code: i32) -> Value {
        assert_eq!(self.code, Some(code), "{self:#?}");
        self.json
    }
}

/// So long may a program be silent while a machine is at work, in seconds of the machine's clock.
const SILENCE_MAX_S: f64 = 5.0;

/// Whether a program that is not at a terminal said every few seconds that it was at work (`  at 8 s: zero x, …`).
#[track_caller]
fn check_no_silence(said: &str) {
    let times = said.lines().filter_map(|line| {
        let (time, _) = line.strip_prefix("  at ")?.split_once(" s: ")?;
        time.parse::<f64>().ok()
    });
    let mut last = 0.0;
    for time in times {
        // Both are rounded to a second.
        assert!(
            time - last <= SILENCE_MAX_S + 1.0,
            "silent from {last} to {time} s:\n{said}"
        );
        last = time;
    }
}

/// Runs `truestage` with these words in `folder`, without any machine.
pub(crate) fn truestage(folder: &Path, words: &[&str]) -> Ended {
    let mut command = Command::new(program("truestage"));
    Process::start(command.current_dir(folder).arg("--json").args(words)).end()
}

/// An emulated machine in a process of its own, and a folder with its configuration.
pub(crate) struct Bench {
    rig: Rig,
    shipped: Shipped,
    mock: Process,
    ports: Vec<String>,
    is_lockstep: bool,
    folder: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

impl Bench {
    /// Starts `mock-bus` with the linear machine; it says where its ports are.
    pub(crate) fn new(rig: Rig) -> Self {
        Self::of(rig, LINEAR, |text| text)
    }

    /// The same with any machine that ships, its emulation after `change`.
    pub(crate) fn of(rig: Rig, shipped: Shipped, change: impl Fn(String) -> String) -> Self {
        let clock = ["--clock", LOCKSTEP, "--outlive"];
        Self::with_clock(rig, shipped, &clock, change)
    }

    /// The linear machine in real time.
    pub(crate) fn in_real_time(rig: Rig) -> Self {
        Self::with_clock(rig, LINEAR, &["--speed", "1"], |text| text)
    }

    fn with_clock(
        rig: Rig,
        shipped: Shipped,
        clock: &[&str],
        change: impl Fn(String) -> String,
    ) -> Self {
        let emulated = change(shipped.emulated.to_owned());
        let turn = one_machine();
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        fs::write(folder.path().join("emulated.toml"), &emulated).expect("a file can be written");
        let mut command = Command::new(program("mock-bus"));
        command.current_dir(folder.path());
        command.args(["emulated.toml", "--seed", "51"]).args(clock);
        if rig == Rig::Vcan {
            command.args(["--can", INTERFACE]);
        } else {
            command.args(["--slcan", "can0"]);
        }
        let mut mock = Process::start(&mut command);
        let ports = read_ports(&mut mock, &emulated);
        let bench = Self {
            rig,
            shipped,
            mock,
            ports,
            is_lockstep: clock.contains(&LOCKSTEP),
            folder,
            _turn: turn,
        };
        bench.configure("machine.toml", |text| text);
        bench
    }

    /// Which rig it is on.
    pub(crate) const fn rig(&self) -> Rig {
        self.rig
    }

    /// Where the machine's files are.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Where its records are.
    pub(crate) fn records(&self) -> PathBuf {
        let name = self.shipped.machine.lines();
        let name = name.filter_map(|line| line.strip_prefix("name = "));
        let name: String = name
            .take(1)
            .map(|it| it.trim_matches('"').to_owned())
            .collect();
        self.folder().join("machine-data").join(name)
    }

    /// The endpoint of a port of the machine.
    pub(crate) fn port(&self, name: &str) -> &str {
        let start = format!("{name}=");
        let found = self.ports.iter().find_map(|it| it.strip_prefix(&start));
        found.expect("mock-bus names all its ports")
    }

    /// Opens each terminal of the emulated machine, so that its name stays its own.
    pub(crate) fn hold_terminals(&self) -> Vec<fs::File> {
        let paths = self
            .ports
            .iter()
            .filter_map(|it| it.split_once("/dev/pts/"));
        let open = |number: &str| {
            let path = format!("/dev/pts/{number}");
            // It must not become the terminal of this process.
            let mut options = fs::OpenOptions::new();
            options.read(true).custom_flags(OFlag::O_NOCTTY.bits());
            options
                .open(&path)
                .unwrap_or_else(|error| panic!("{path}: {error}"))
        };
        paths.map(|(_, number)| open(number)).collect()
    }

    /// Writes the shipped configuration, with fewer measurements and after `change`.
    pub(crate) fn configure(&self, name: &str, change: impl Fn(String) -> String) {
        let short = shortened(self.shipped.machine);
        fs::write(self.folder().join(name), change(short)).expect("a file can be written");
    }

    /// Runs an example of the controller with these words in the machine's folder; what it
    /// printed, to standard output and to standard error.
    pub(crate) fn example(&self, name: &str, words: &[&str]) -> (bool, String, String) {
        let mut command = Command::new(program(&format!("examples/{name}")));
        let command = command.current_dir(self.folder()).args(words);
        let output = command.output().expect("it can be started");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (printed, said) = (text(&output.stdout), text(&output.stderr));
        (output.status.success(), printed, said)
    }

    /// Runs `truestage --json` with these words and no others in the machine's folder.
    pub(crate) fn run_plainly(&self, words: &[&str]) -> Ended {
        Process::start(self.command().args(words)).end()
    }

    fn command(&self) -> Command {
        let mut command = Command::new(program("truestage"));
        command.current_dir(self.folder()).arg("--json");
        command
    }

    /// Starts a verb in the machine's folder; verbs that use the machine are told where it is.
    pub(crate) fn start(&self, words: &[&str]) -> Process {
        self.start_within(words, &[])
    }

    /// The same, with these variables in its environment.
    pub(crate) fn start_within(&self, words: &[&str], variables: &[(&str, &str)]) -> Process {
        let mut command = self.verb(words);
        let mut process = Process::start(command.envs(variables.iter().copied()));
        process.is_client = self.folder().join(SOCKET).exists();
        process
    }

    /// The same under strace with these options, which writes to `trace` in the machine's folder.
    pub(crate) fn start_traced(&self, words: &[&str], trace: &str, options: &[&str]) -> Process {
        let verb = self.verb(words);
        let mut command = Command::new("strace");
        command.current_dir(self.folder());
        command.args(["-f", "-y", "--seccomp-bpf", "-o", trace]);
        command.args(options).arg(verb.get_program());
        let mut process = Process::start(command.args(verb.get_args()));
        process.is_client = self.folder().join(SOCKET).exists();
        process
    }

    /// The verb, not started yet.
    pub(crate) fn verb(&self, words: &[&str]) -> Command {
        let mut command = self.command();
        // `plan zero` is one verb.
        let verb = if words.starts_with(&["plan", "zero"]) {
            2
        } else {
            1
        };
        command.args(&words[..verb]);
        let uses_machine = [
            "scan",
            "doctor",
            "zero",
            "calibrate",
            "verify",
            "move",
            "jog",
            "run",
            "serve",
        ];
        if uses_machine.contains(&words[verb - 1]) {
            if self.is_lockstep {
                command.args(["--clock", LOCKSTEP]);
            }
            let machine = self.shipped.machine;
            let uses = |name: &str| machine.contains(&format!(".{name}]"));
            for port in self
                .ports
                .iter()
                .filter(|it| it.split('=').next().is_some_and(uses))
            {
                command.args(["--port", port]);
            }
        }
        command.args(&words[verb..]);
        command
    }

    /// The same, and waits for its end.
    pub(crate) fn run(&self, words: &[&str]) -> Ended {
        self.start(words).end()
    }

    /// Sends the emulator a signal; time stands still while it is stopped.
    pub(crate) fn signal_emulator(&self, signal: Signal) {
        self.mock.signal(signal);
    }

    /// The clock of the machine, in which somebody called `name` takes part.
    pub(crate) fn clock(&self, name: &str) -> Clock {
        let participant = Participant::join(&self.folder().join("clock"), name);
        Clock::lockstep(participant.unwrap_or_else(|error| panic!("{error}")))
    }

    /// Asks the emulator to end, and says how it did.
    pub(crate) fn stop(self) -> Option<i32> {
        self.mock.signal(Signal::SIGTERM);
        self.mock.end_quietly()
    }
}

impl Process {
    /// Waits for its end; what it printed has been read already.
    fn end_quietly(mut self) -> Option<i32> {
        self.child.wait().expect("a child can be waited for").code()
    }
}

/// `can0: slcan /dev/pts/4` and the like become endpoints `can0=slcan:/dev/pts/4`.
/// The shipped configuration of `machine`, with fewer measurements where it repeats them.
fn shortened(machine: &str) -> String {
    if machine != LINEAR.machine {
        return machine.to_owned();
    }
    machine
        .edit("runs = 3", "runs = 2")
        .edit("targets = 8\nruns = 5", "targets = 4\nruns = 2")
}

fn read_ports(mock: &mut Process, emulated: &str) -> Vec<String> {
    let ports = emulated.matches("[[ports]]").count();
    let output = mock.child.stdout.as_mut().expect("it is piped");
    let lines = BufReader::new(output).lines().take(ports);
    let ports: Vec<_> = lines
        .map(|line| endpoint(&line.expect("mock-bus prints text")))
        .collect();
    assert!(!ports.is_empty(), "mock-bus ended without a word");
    ports
}

fn endpoint(line: &str) -> String {
    let (name, rest) = line.split_once(": ").expect("NAME: WHERE");
    match rest.split_once(' ') {
        Some((kind, place)) => format!("{name}={kind}:{place}"),
        None => format!("{name}={rest}"),
    }
}

/// A value of `--json` that is a text.
#[track_caller]
pub(crate) fn text(value: &Value) -> &str {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value} is no text"))
}

/// A value of `--json` that is a number.
#[track_caller]
pub(crate) fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// The page that `truestage report` makes of a journal.
#[track_caller]
pub(crate) fn page(folder: &Path, journal: &str) -> String {
    let made = truestage(folder, &["report", journal]).with_code(0);
    let html = std::fs::read_to_string(text(&made["report"])).expect("it was written");
    assert!(
        !html.contains("<script") && !html.contains("http"),
        "not self-contained"
    );
    assert!(!html.contains("NaN") && html.ends_with("</html>\n"));
    html
}

#[track_caller]
pub(crate) fn check_says(html: &str, parts: &[&str]) {
    for part in parts {
        assert!(html.contains(part), "`{part}` is not on the page");
    }
}

/// That an error says all of these.
#[track_caller]
pub(crate) fn check_error(said: &Value, parts: &[&str]) {
    let error = text(&said["error"]);
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in {error}");
    }
}
