//! The thread that owns a machine touches no file, whatever is done with it.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use tests::{GANTRY, LINEAR, ROTARY, Rig, Shipped, UVW, not_run};

use crate::programs::Bench;

/// What makes, reads, writes or looks for files.
const CALLS: &str = "trace=open,openat,creat,read,pread64,write,pwrite64,fsync,fdatasync,rename,renameat,renameat2,\
                     unlink,unlinkat,mkdir,mkdirat,truncate,ftruncate,getdents64,stat,statx,newfstatat,readlink";

/// What is no file on a disk: devices, pipes, sockets, and what the kernel says of itself.
const NO_FILES: [&str; 8] = [
    "/dev/",
    "/proc/",
    "/sys/",
    "pipe:",
    "socket:",
    "anon_inode:",
    "UNIX",
    "TCP",
];

/// What a call is about: the file that it names, or that its descriptor is of.
fn place(call: &str) -> Option<&str> {
    let (name, rest) = call.split_once('(')?;
    let by_name = [
        "open", "creat", "rename", "unlink", "mkdir", "stat", "readlink", "truncate",
    ];
    let is_named = by_name.iter().any(|part| name.contains(part)) && name != "ftruncate";
    let named = is_named.then(|| rest.split('"').nth(1)).flatten();
    let of_descriptor = || {
        rest.split_once('<')?
            .1
            .split_once('>')
            .map(|(place, _)| place)
    };
    named
        .filter(|place| !place.is_empty())
        .or_else(of_descriptor)
}

fn is_file(place: &str) -> bool {
    !NO_FILES.iter().any(|begin| place.starts_with(begin))
}

/// Calls on files by threads that write to a bus, once the first of them has sent something.
fn files_of_bus_threads(trace: &str) -> Vec<String> {
    let mut sends: BTreeMap<&str, bool> = BTreeMap::new();
    let mut of_threads: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for line in trace.lines() {
        let Some((thread, call)) = line.split_once(' ') else {
            continue;
        };
        let call = call.trim_start();
        let Some(place) = place(call) else {
            continue;
        };
        // The first frame; before it only the adapter was set up.
        if call.starts_with("write(") && place.starts_with("/dev/p") && call.contains(", \"t") {
            sends.insert(thread, true);
        } else if sends.contains_key(thread) && is_file(place) {
            of_threads.entry(thread).or_default().push(call.to_owned());
        }
    }
    assert!(!sends.is_empty(), "no frame was sent:\n{trace}");
    of_threads.into_values().flatten().collect()
}

fn can_trace() -> bool {
    let traced = Command::new("strace")
        .args([
            "-f",
            "--seccomp-bpf",
            "-e",
            "trace=write",
            "-o",
            "/dev/null",
            "true",
        ])
        .status();
    traced.is_ok_and(|status| status.success())
}

#[track_caller]
fn check(shipped: Shipped, bench: &Bench, verbs: &[&[&str]]) {
    for words in verbs {
        let ended = bench
            .start_traced(words, "calls.trace", &["-e", CALLS])
            .end();
        ended.with_code(0);
        let trace = fs::read_to_string(bench.folder().join("calls.trace")).expect("a trace");
        let files = files_of_bus_threads(&trace);
        let machine = shipped.machine.lines().next().unwrap_or_default();
        assert!(
            files.is_empty(),
            "{machine}: {words:?}\n{}",
            files.join("\n")
        );
    }
}

#[test]
fn no_verb_waits_for_a_file_with_a_machine_in_hand() {
    if !can_trace() {
        not_run("no verb waits for a file", "strace cannot be had here");
        return;
    }
    let linear = Bench::of(Rig::Pty, LINEAR, |text| text);
    let record = ["scan", "--record", "bus.log"];
    check(
        LINEAR,
        &linear,
        &[
            &record,
            &["zero"],
            &["plan", "zero"],
            &["calibrate"],
            &["verify"],
            &["verify", "--uncompensated"],
            &["move", "machine.toml", "x=12.5mm"],
        ],
    );
    drop(linear);
    let gantry = Bench::of(Rig::Pty, GANTRY, |text| text);
    check(GANTRY, &gantry, &[&["zero", "--axis", "beam"]]);
    drop(gantry);
    let platform = Bench::of(Rig::Pty, UVW, |text| text);
    check(UVW, &platform, &[&["zero"], &["calibrate"], &["verify"]]);
    drop(platform);
    let table = crate::table::bench(Rig::Pty);
    let verbs: [&[&str]; 4] = [
        &["zero"],
        &["calibrate", "--yes"],
        &["verify", "--yes"],
        &["move", "machine.toml", "c=10deg"],
    ];
    check(ROTARY, &table, &verbs);
}

#[test]
fn places_of_calls_are_found() {
    let write = "write(4</dev/pts/1>, \"\\r\", 1) = 1";
    assert_eq!(place(write), Some("/dev/pts/1"));
    let open = "openat(AT_FDCWD</stage>, \"data/x.json\", O_RDONLY) = 3</stage/data/x.json>";
    assert_eq!(place(open), Some("data/x.json"));
    assert_eq!(
        place("fdatasync(7</stage/a.jsonl>) = 0"),
        Some("/stage/a.jsonl")
    );
    let trace = "1 write(4</dev/pts/1>, \"t0800\", 5) = 5\n2 fsync(7</stage/a>) = 0\n1 fsync(7</stage/a>) = 0\n";
    assert_eq!(files_of_bus_threads(trace), ["fsync(7</stage/a>) = 0"]);
}
