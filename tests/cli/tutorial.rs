//! `docs/tutorial.md`, as somebody who follows it types it.
//!
//! What the document shows of each command is compared with what it prints: `…` stands for what differs from day
//! to day, a line of nothing else for any number of lines. A command that ends in failure is followed by `echo $?`.
//! Blocks that need a network or hardware are called `console build` and `console hardware` in the source; what
//! stands in them may be nothing that could have been run here.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tests::LINEAR;

use crate::programs::{one_machine, program};

/// Stands for whatever is there.
const ANY: &str = "…";
/// What a block of the document may be called.
const RUN: &str = "console";
const HARDWARE: &str = "console hardware";
const BUILD: &str = "console build";
/// What belongs to the system, or comes before there is anything to run.
const ELSEWHERE: [&str; 6] = ["cargo", "cd", "echo", "git", "ip", "sudo"];
/// Verbs that judge everything, and open no port, with `--dry-run`.
const JUDGED: [&str; 4] = ["zero", "calibrate", "verify", "move"];

pub(crate) fn repository() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().expect("it is in the workspace").to_owned()
}

/// A command of the document, and what it shows of its output.
#[derive(Debug)]
struct Typed {
    command: String,
    shown: Vec<String>,
}

/// The blocks of a document: what each is called, and its lines.
pub(crate) fn blocks(document: &str) -> Vec<(&str, Vec<&str>)> {
    let mut blocks: Vec<(&str, Vec<&str>)> = Vec::new();
    let mut is_open = false;
    for line in document.lines() {
        match line.strip_prefix("```") {
            Some(_) if is_open => is_open = false,
            Some(called) => {
                blocks.push((called, Vec::new()));
                is_open = true;
            }
            None if is_open => blocks.last_mut().expect("it is open").1.push(line),
            None => {}
        }
    }
    assert!(!is_open, "a block has no end");
    blocks
}

/// The commands of a block; one that ends with a backslash goes on in the next line.
fn typed(lines: &[&str]) -> Vec<Typed> {
    let mut all: Vec<Typed> = Vec::new();
    for line in lines {
        match (line.strip_prefix("$ "), all.last_mut()) {
            (Some(command), _) => all.push(Typed {
                command: command.to_owned(),
                shown: Vec::new(),
            }),
            (None, Some(last)) if last.command.ends_with('\\') => {
                last.command += "\n";
                last.command += line;
            }
            (None, Some(last)) => last.shown.push((*line).to_owned()),
            (None, None) => panic!("a block begins with `$ `: {line}"),
        }
    }
    all
}

/// The commands of all blocks that are called so.
fn called(document: &str, name: &str) -> Vec<Typed> {
    let blocks = blocks(document).into_iter();
    let own = blocks.filter(|(called, _)| *called == name);
    own.flat_map(|(_, lines)| typed(&lines)).collect()
}

/// Whether `line` is what is shown.
fn is_line(shown: &str, line: &str) -> bool {
    let Some((before, behind)) = shown.split_once(ANY) else {
        return shown == line;
    };
    let rest = line.strip_prefix(before);
    let is_behind = |rest: &str| {
        let mut places = (0..=rest.len()).filter(|at| rest.is_char_boundary(*at));
        places.any(|at| is_line(behind, &rest[at..]))
    };
    rest.is_some_and(is_behind)
}

/// Whether `lines` are what is shown, from the first to the last.
pub(crate) fn are_lines(shown: &[String], lines: &[&str]) -> bool {
    match (shown, lines) {
        ([], lines) => lines.is_empty(),
        ([any, shown @ ..], lines) if any.trim() == ANY => {
            (0..=lines.len()).any(|from| are_lines(shown, &lines[from..]))
        }
        ([first, shown @ ..], [line, lines @ ..]) => {
            is_line(first, line.trim_end()) && are_lines(shown, lines)
        }
        ([..], []) => false,
    }
}

/// Whether it says how far a verb has come, for which a reader's terminal has a bar.
fn is_progress(line: &str) -> bool {
    let said = line
        .strip_prefix("  at ")
        .and_then(|it| it.split_once(" s: "));
    said.is_some_and(|(seconds, _)| seconds.parse::<f64>().is_ok())
}

fn tutorial() -> String {
    let path = repository().join("docs/tutorial.md");
    fs::read_to_string(path).expect("it is there")
}

/// A fresh clone in which everything has been built.
fn clone() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let built = program("truestage");
    let built = built.parent().expect("it is in a folder");
    fs::create_dir(folder.path().join("target")).expect("a folder can be made");
    let links = [
        (built, "target/release"),
        (&repository().join("configs"), "configs"),
    ];
    for (there, here) in links {
        symlink(there, folder.path().join(here)).expect("a link can be made");
    }
    folder
}

fn shell(folder: &Path, script: &str) -> Command {
    let mut command = Command::new("bash");
    command.args(["-c", script]).current_dir(folder);
    command.env("HOME", folder).stdin(Stdio::null());
    command
}

/// Runs all commands in one shell, and says of each what it printed and its exit code.
fn run(folder: &Path, commands: &[Typed]) -> Vec<(String, i32)> {
    let out = folder.join("out");
    fs::create_dir(&out).expect("a folder can be made");
    let end = "trap 'kill $(jobs -p) 2>/dev/null' EXIT\n".to_owned();
    let script = commands.iter().enumerate().fold(end, |script, (at, it)| {
        let file = out.join(at.to_string());
        let (file, command) = (file.display(), &it.command);
        script + &format!("{{ {command}\n}} >{file} 2>&1; c=$?; echo $c >{file}.code; (exit $c)\n")
    });
    shell(folder, &script)
        .status()
        .expect("bash can be started");
    let read = |name: String| fs::read_to_string(out.join(name)).unwrap_or_default();
    let ended = (0..commands.len()).map(|at| {
        let code = read(format!("{at}.code"));
        (read(at.to_string()), code.trim().parse().unwrap_or(-1))
    });
    ended.collect()
}

/// Whether the document goes on to show the exit code.
fn shown_code(next: Option<&Typed>) -> i32 {
    let asked = next.filter(|it| it.command == "echo $?");
    let code = asked.and_then(|it| it.shown.first()?.parse().ok());
    code.unwrap_or(0)
}

#[test]
fn every_command_of_the_tutorial_does_what_it_shows() {
    let commands = called(&tutorial(), RUN);
    assert!(commands.len() > 20, "{} commands", commands.len());
    let _turn = one_machine();
    let folder = clone();
    let ended = run(folder.path(), &commands);
    let mut wrong = Vec::new();
    for (at, (it, (printed, code))) in commands.iter().zip(&ended).enumerate() {
        let lines: Vec<_> = printed.lines().filter(|it| !is_progress(it)).collect();
        let is_shown = it.shown.is_empty() || are_lines(&it.shown, &lines);
        if *code != shown_code(commands.get(at + 1)) || !is_shown {
            wrong.push(format!("$ {}\n{printed}exit code {code}", it.command));
        }
    }
    assert!(wrong.is_empty(), "not as shown:\n{}", wrong.join("\n\n"));
    let pages = ["calibration.html", "verification.html"];
    for page in pages.map(|it| folder.path().join("stage").join(it)) {
        let page = fs::read_to_string(page).expect("it was made");
        assert!(page.contains("<svg"), "it has pictures");
    }
}

/// Runs a command for a real machine as far as it goes without one.
#[track_caller]
fn check_words(folder: &Path, command: &str) {
    let verb = command.split_whitespace().nth(1).unwrap_or_default();
    let end = match verb {
        "check" | "explain" => "",
        _ if command.contains("--dry-run") => "",
        _ if JUDGED.contains(&verb) => "--dry-run",
        _ => "--help",
    };
    let programs = program("truestage");
    let programs = programs.parent().expect("it is in a folder").display();
    let script = format!("PATH={programs}:$PATH; {command} {end}");
    let output = shell(folder, &script)
        .output()
        .expect("bash can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "$ {command}\n{said}");
}

/// A command of the system, which nobody can have compared; what it names of this project is there.
#[track_caller]
fn check_elsewhere(it: &Typed) {
    let mut words = it.command.split_whitespace();
    let first = words.next().unwrap_or_default();
    assert!(
        ELSEWHERE.contains(&first) && it.shown.is_empty(),
        "{it:?} can be run here"
    );
    for path in words.filter(|it| it.starts_with("packaging/")) {
        assert!(repository().join(path).exists(), "{path} is not there");
    }
}

/// What stands in the text as code and is a command of this project.
fn named_commands(document: &str) -> Vec<String> {
    let blocks = document.split("```").step_by(2);
    let code = blocks.flat_map(|text| text.split('`').skip(1).step_by(2));
    let own = code.filter(|it| it.starts_with("truestage ") || it.starts_with("mock-bus "));
    own.map(str::to_owned).collect()
}

#[test]
fn what_the_tutorial_says_of_real_machines_exists_and_nothing_else_is_left_out() {
    let document = tutorial();
    for (name, _) in blocks(&document) {
        assert!(
            [RUN, HARDWARE, BUILD].contains(&name),
            "`{name}` is no block that is looked at"
        );
    }
    let folder = clone();
    fs::write(folder.path().join("machine.toml"), LINEAR.machine).expect("there is room");
    for it in called(&document, BUILD) {
        check_elsewhere(&it);
    }
    for it in called(&document, HARDWARE) {
        let (first, rest) = it.command.split_once(' ').unwrap_or((&it.command, ""));
        if first == "truestage" {
            let is_emulated = rest.contains("--clock") || rest.contains("$emulated");
            assert!(
                !is_emulated && it.shown.is_empty(),
                "{it:?} can be run here"
            );
            check_words(folder.path(), &it.command);
        } else {
            check_elsewhere(&it);
            let is_own = |it: &str| it == "truestage" || it == "mock-bus";
            assert!(
                !rest.split_whitespace().any(is_own),
                "{it:?} is looked at by nobody"
            );
        }
    }
    for command in named_commands(&document) {
        check_words(folder.path(), &command);
    }
}

#[test]
fn what_is_shown_is_compared_to_the_letter_except_where_it_says_so() {
    let is = |shown: &str, printed: &str| {
        let shown: Vec<_> = shown.lines().map(str::to_owned).collect();
        are_lines(&shown, &printed.lines().collect::<Vec<_>>())
    };
    assert!(is("a\n…\nb … d", "a\n1\n2\nb c d"));
    assert!(is("…\nb", "b"));
    for printed in ["a\nb c", "b c d", "a\nb c d\ne"] {
        assert!(!is("a\n…\nb … d", printed), "{printed}");
    }
    assert!(!is("a", "a\nb") && !is("a\nb", "a") && !is("1.2", "1.23"));
}
