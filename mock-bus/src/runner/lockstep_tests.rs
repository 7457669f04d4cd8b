//! The clock that both ends share, by its lines: what passes, who is waited for, who is named.

use super::*;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::net::UnixStream;

const MACHINE: &str = r#"
    name = "test"
    [[ports]]
    kind = "serial"
    name = "adc"
    baud_bit_per_s = 9600
    [[nodes]]
    name = "adc"
    port = "adc"
    device = { kind = "dcon_module", checksum = false, boot_ms = 0.0 }
"#;

const ON_CAN: &str = r#"
    name = "test"
    [[ports]]
    kind = "can"
    name = "can0"
    bitrate_kbit_per_s = 1000
    [[nodes]]
    name = "adc"
    port = "can0"
    device = { kind = "cia401_analog", node_id = 2, boot_delay_ms = 50 }
"#;

/// A machine with one port, and the folder of its side channel.
struct Bench {
    machine: Running,
    clock: PathBuf,
}

impl Bench {
    fn new(name: &str, change: impl FnOnce(&mut Options)) -> Self {
        Self::of(MACHINE, name, change)
    }

    fn of(machine: &str, name: &str, change: impl FnOnce(&mut Options)) -> Self {
        let file = format!("truestage-{}-{name}", std::process::id());
        let clock = std::env::temp_dir().join(file);
        let mut options = Options {
            pace: Pace::Lockstep(clock.clone()),
            ..Options::default()
        };
        change(&mut options);
        let config = MachineConfig::parse(machine).unwrap();
        let machine = spawn(&config, &options).unwrap();
        Self { machine, clock }
    }

    fn client(&self) -> Client {
        Client(BufReader::new(UnixStream::connect(&self.clock).unwrap()))
    }

    fn terminal(&self) -> String {
        self.machine.ports()[0].display().to_string()
    }

    fn open_terminal(&self) -> File {
        let mut options = File::options();
        let opened = options.read(true).write(true).open(self.terminal());
        opened.unwrap()
    }

    /// A program at an adapter that is open, and its line; the node has booted.
    fn booted(&self) -> (Client, File) {
        let mut client = self.client();
        assert_eq!(client.ask("hello 1 0 me"), "welcome 0");
        let mut line = self.open_terminal();
        let attach = format!("attach 0 {}", self.terminal());
        assert_eq!(client.ask(&attach), "attached");
        line.write_all(b"S8\rO\r").unwrap();
        assert_eq!(client.ask("idle 100000000 0:5"), "go 0 0:2");
        let heard = client.ask("idle 100000000");
        assert!(
            heard.ends_with(" 0:8"),
            "the node says that it is there: {heard}"
        );
        assert_eq!(client.ask("idle 100000000"), "go 100000000");
        (client, line)
    }

    /// What the machine ended by.
    fn ended(self) -> String {
        let ended = self.machine.thread_result();
        ended.expect_err("it goes on").to_string()
    }
}

struct Client(BufReader<UnixStream>);

impl Client {
    fn say(&mut self, line: &str) {
        let line = format!("{line}\n");
        self.0.get_mut().write_all(line.as_bytes()).unwrap();
    }

    fn hear(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }

    fn ask(&mut self, line: &str) -> String {
        self.say(line);
        self.hear()
    }
}

#[test]
fn an_answer_comes_at_its_own_time_whenever_it_is_asked_for() {
    let bench = Bench::new("answer", |_| {});
    let mut client = bench.client();
    assert_eq!(client.ask("hello 1 0 me"), "welcome 0");
    let mut line = bench.open_terminal();
    let attach = format!("attach 4 {}", bench.terminal());
    assert_eq!(client.ask(&attach), "attached");
    line.write_all(b"$01M\r").unwrap();
    let heard = client.ask("idle 1000000000 4:5");
    let (time, passed) = heard.strip_prefix("go ").unwrap().split_once(' ').unwrap();
    // Five bytes there and eight back, ten bits each, at the rate of a terminal that nobody has set
    // (38 400 bit/s), and what the module takes.
    let time: u64 = time.parse().unwrap();
    assert!(time > 13 * 10 * 1_000_000_000 / 38_400 && time < 1_000_000_000);
    assert_eq!(passed, "4:8");
    let mut answer = [0; 8];
    line.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"!014117\r");
    assert_eq!(client.ask("idle 1000000000"), "go 1000000000");
    client.say("bye");
    drop(bench);
}

#[test]
fn what_an_adapter_says_at_one_moment_is_one_piece() {
    let bench = Bench::of(ON_CAN, "piece", |_| {});
    let mut client = bench.client();
    assert_eq!(client.ask("hello 1 0 me"), "welcome 0");
    let mut line = bench.open_terminal();
    let attach = format!("attach 0 {}", bench.terminal());
    assert_eq!(client.ask(&attach), "attached");
    line.write_all(b"S8\rO\r").unwrap();
    assert_eq!(client.ask("idle 1000000000 0:5"), "go 0 0:2");
    line.write_all(b"t0800\r").unwrap();
    // What the adapter says to a frame that it has taken waits for what the module says when it has
    // booted.
    let heard = client.ask("idle 1000000000 0:6");
    assert!(heard.ends_with(" 0:10"), "{heard}");
    let mut answers = [0; 12];
    line.read_exact(&mut answers).unwrap();
    assert_eq!(&answers, b"\r\rz\rt702100\r");
    client.say("bye");
    drop(bench);
}

#[test]
fn what_comes_on_a_line_that_nobody_waits_for_is_told_with_the_next_go() {
    let bench = Bench::new("unhurried", |_| {});
    let mut client = bench.client();
    client.ask("hello 1 0 me");
    let mut line = bench.open_terminal();
    client.ask(&format!("attach 4 {}", bench.terminal()));
    line.write_all(b"$01M\r").unwrap();
    let heard = client.ask("idle 1000000000 4:later 4:5");
    let (units, time) = heard
        .strip_prefix("go 1000000000 4:")
        .and_then(|passed| passed.split_once('@'))
        .unwrap_or_else(|| panic!("{heard}"));
    let time: u64 = time.parse().unwrap();
    assert!(units == "8" && time > 0 && time < 1_000_000_000, "{heard}");
    let mut answer = [0; 8];
    line.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"!014117\r");
    // Whoever waits for it again hears it at once.
    line.write_all(b"$01M\r").unwrap();
    let heard = client.ask("idle 2000000000 4:5");
    assert!(
        heard.ends_with(" 4:8") && !heard.starts_with("go 2000000000"),
        "{heard}"
    );
    client.say("bye");
}

/// A read of the device's type, over SDO.
const ASKED: &[u8; 22] = b"t60284000100000000000\r";

#[test]
fn what_is_sent_ahead_of_its_time_counts_as_sent_then() {
    let bench = Bench::of(ON_CAN, "ahead", |_| {});
    let (mut client, mut line) = bench.booted();
    line.write_all(ASKED).unwrap();
    let heard = client.ask("idle 1000000000 0:22@300000000");
    let (time, passed) = heard.strip_prefix("go ").unwrap().split_once(' ').unwrap();
    let time: u64 = time.parse().unwrap();
    assert!(time > 300_000_000 && time < 310_000_000, "{heard}");
    assert_eq!(
        passed, "0:24",
        "what the adapter says, and the node's answer"
    );
    client.say("bye");
}

#[test]
fn what_is_recalled_is_never_sent() {
    let bench = Bench::of(ON_CAN, "recall", |_| {});
    let (mut client, mut line) = bench.booted();
    line.write_all(ASKED).unwrap();
    assert_eq!(client.ask("idle 200000000 0:22@300000000"), "go 200000000");
    // The adapter has taken it, and its client waits to be told so.
    let heard = client.ask("idle 900000000 0:recall");
    assert_eq!(heard, "go 900000000 0:2");
    line.write_all(ASKED).unwrap();
    let heard = client.ask("idle 1900000000 0:22");
    assert!(heard.ends_with(" 0:24"), "once only: {heard}");
    client.say("bye");
}

#[test]
fn time_passes_to_the_first_moment_that_somebody_waits_for_and_not_while_one_works() {
    let bench = Bench::new("two", |_| {});
    let (mut one, mut other) = (bench.client(), bench.client());
    one.ask("hello 1 0 one");
    other.ask("hello 1 0 other");
    one.say("idle 5000000");
    // It works as yet: whatever it asks for is still at the beginning.
    assert!(other.ask("do truth").starts_with("done {\"time_s\":0,"));
    assert_eq!(other.ask("idle 2000000"), "go 2000000");
    assert_eq!(other.ask("idle 5000000"), "go 5000000");
    assert_eq!(one.hear(), "go 5000000");
    one.say("bye");
    other.say("bye");
}

#[test]
fn what_cannot_be_is_refused_with_what_there_is() {
    let bench = Bench::new("refused", |_| {});
    let mut client = bench.client();
    assert!(client.ask("hello 9 0 me").contains("version 9"));
    assert_eq!(client.ask("hello 1 0 me"), "welcome 0");
    let unknown = client.ask("attach 0 /dev/null");
    assert!(unknown.starts_with("refused") && unknown.contains(&bench.terminal()));
    let attach = format!("attach 0 {}", bench.terminal());
    assert_eq!(client.ask(&attach), "attached");
    let mut other = bench.client();
    other.ask("hello 1 0 other");
    assert!(other.ask(&attach).contains("`me` has"));
    assert!(other.ask("what?").contains("not a message"));
    client.say("bye");
    other.say("bye");
}

#[test]
fn somebody_who_ends_without_taking_leave_is_named_and_ends_the_machine() {
    let bench = Bench::new("gone", |_| {});
    let mut client = bench.client();
    client.ask("hello 1 4711 a killed one");
    drop(client);
    let said = bench.ended();
    assert!(
        said.contains("`a killed one` (process 4711) ended without"),
        "{said}"
    );
}

#[test]
fn a_machine_that_outlives_its_controllers_goes_on_with_the_next_one() {
    let bench = Bench::new("outlive", |options| options.outlive = true);
    let mut client = bench.client();
    client.ask("hello 1 0 a killed one");
    assert_eq!(client.ask("idle 3000000"), "go 3000000");
    drop(client);
    let mut next = bench.client();
    assert_eq!(next.ask("hello 1 0 the next one"), "welcome 3000000");
    assert_eq!(next.ask("idle 4000000"), "go 4000000");
    next.say("bye");
}

#[test]
fn the_port_of_one_that_was_killed_while_it_waited_is_free_for_the_next_one() {
    let bench = Bench::new("killed", |options| options.outlive = true);
    let attach = format!("attach 0 {}", bench.terminal());
    // Time stands still for this one.
    let mut other = bench.client();
    other.ask("hello 1 0 other");
    let mut client = bench.client();
    client.ask("hello 1 0 a killed one");
    assert_eq!(client.ask(&attach), "attached");
    client.say("idle 3000000");
    drop(client);
    let mut next = bench.client();
    next.ask("hello 1 0 the next one");
    assert_eq!(next.ask(&attach), "attached");
    next.say("bye");
    other.say("bye");
}

/// The next program opens its port, and writes, before it says so.
#[test]
fn what_one_had_sent_that_was_killed_while_it_waited_is_not_taken_from_the_next_one() {
    for written in [&b"$01M\r"[..], b"$0", b""] {
        let bench = Bench::new("next", |options| options.outlive = true);
        let attach = format!("attach 0 {}", bench.terminal());
        // Time stands still for this one.
        let mut other = bench.client();
        other.ask("hello 1 0 other");
        let mut client = bench.client();
        client.ask("hello 1 0 a killed one");
        let mut line = bench.open_terminal();
        assert_eq!(client.ask(&attach), "attached");
        line.write_all(written).unwrap();
        // It was killed before it had written all.
        client.say("idle 3000000 0:5");
        drop((client, line));
        let mut next = bench.client();
        next.ask("hello 1 0 the next one");
        let mut line = bench.open_terminal();
        if written.len() == 5 {
            line.write_all(b"$01M\r").unwrap();
        }
        assert_eq!(next.ask(&attach), "attached");
        if written.len() < 5 {
            // What is left of a line ends with the next one, as on a real line.
            line.write_all(b"\r$01M\r").unwrap();
        }
        other.say("bye");
        let sent = if written.len() == 5 { 5 } else { 6 };
        let mut heard = next.ask(&format!("idle 1000000000 0:{sent}"));
        while !heard.starts_with("go 1000000000") {
            let (_, passed) = heard.split_once(" 0:").unwrap_or_else(|| panic!("{heard}"));
            let mut answer = vec![0; passed.parse().unwrap()];
            line.read_exact(&mut answer).unwrap();
            let text = String::from_utf8_lossy(&answer).into_owned();
            assert!("!014117\r?01\r".contains(&text), "{text}");
            heard = next.ask("idle 1000000000");
        }
        next.say("bye");
    }
}

#[test]
fn what_a_program_says_that_does_not_share_the_clock_is_not_taken_for_the_next_ones() {
    let bench = Bench::of(ON_CAN, "stranger", |_| {});
    for _ in 0..2 {
        let mut stranger = bench.open_terminal();
        stranger.write_all(b"C\rV\rS8\r").unwrap();
        drop(stranger);
        let mut client = bench.client();
        let welcome = client.ask("hello 1 0 me");
        let now = welcome.strip_prefix("welcome ").unwrap();
        let mut line = bench.open_terminal();
        let attach = format!("attach 0 {}", bench.terminal());
        assert_eq!(client.ask(&attach), "attached");
        line.write_all(b"V\r").unwrap();
        assert_eq!(client.ask("idle 900000000 0:2"), format!("go {now} 0:6"));
        let mut version = [0; 6];
        line.read_exact(&mut version).unwrap();
        assert_eq!(&version, b"V1013\r");
        client.say("bye");
    }
}

#[test]
fn somebody_who_hangs_is_named_and_ends_the_machine() {
    let bench = Bench::new("hangs", |options| {
        options.patience = Duration::from_millis(1);
    });
    let mut client = bench.client();
    // No process has this number: nothing is known of what it does.
    client.ask("hello 1 999999999 a sleeper");
    let said = bench.ended();
    assert!(
        said.contains("`a sleeper`") && said.contains("has not answered"),
        "{said}"
    );
    drop(client);
}

#[test]
fn a_side_channel_that_a_killed_program_has_left_behind_is_made_anew_and_a_living_one_is_not() {
    let bench = Bench::new("left", |_| {});
    let options = Options {
        pace: Pace::Lockstep(bench.clock.clone()),
        ..Options::default()
    };
    let config = MachineConfig::parse(MACHINE).unwrap();
    let taken = spawn(&config, &options).err().unwrap().to_string();
    assert!(taken.contains("no other program"), "{taken}");
    let clock = bench.clock.clone();
    drop(bench);
    drop(std::os::unix::net::UnixListener::bind(&clock).unwrap());
    assert!(clock.exists(), "a socket's file outlives its listener");
    drop(spawn(&config, &options).unwrap());
    assert!(!clock.exists());
}
