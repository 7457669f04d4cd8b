//! What stands at the end of each verb's help: how it is called, and what its exit code says.

use clap::Command;

/// By the words of the verb: calls of it. Each is read by the program in a test.
const EXAMPLES: &[(&str, &[&str])] = &[
    (
        "demo",
        &[
            "truestage demo",
            "truestage demo --machine rotary --seed 7 --in-process",
        ],
    ),
    (
        "check",
        &["truestage check", "truestage check linear.toml --json"],
    ),
    (
        "new",
        &[
            "truestage new",
            "truestage new stage.toml --machine linear --port can0=socketcan:can0 --set axis.x.soft_max_mm=250 --yes",
        ],
    ),
    (
        "doctor",
        &["truestage doctor", "truestage doctor linear.toml"],
    ),
    (
        "scan",
        &[
            "truestage scan",
            "truestage scan linear.toml --port can0=slcan:/dev/ttyACM1",
        ],
    ),
    (
        "reset",
        &["truestage reset", "truestage reset linear.toml --axis x"],
    ),
    (
        "zero",
        &[
            "truestage zero --dry-run",
            "truestage zero linear.toml --axis x",
        ],
    ),
    (
        "calibrate",
        &[
            "truestage calibrate --dry-run",
            "truestage calibrate linear.toml --axis x --verify",
            "truestage calibrate linear.toml --resume",
        ],
    ),
    (
        "verify",
        &[
            "truestage verify",
            "truestage verify linear.toml --axis x --uncompensated",
        ],
    ),
    (
        "move",
        &[
            "truestage move x=12.5mm",
            "truestage move linear.toml x=12.5mm --approach forward",
            "truestage move rotary.toml c=90deg --way forward",
            "truestage move uvw.toml x=1mm theta=20arcsec --align",
        ],
    ),
    (
        "jog",
        &[
            "truestage jog x=2mm/s",
            "truestage jog rotary.toml c=-5deg/s --for 2s",
        ],
    ),
    ("reference", &["truestage reference volumetric.toml"]),
    (
        "reference import",
        &["truestage reference import volumetric.toml detectors.csv"],
    ),
    (
        "align",
        &[
            "truestage align volumetric.toml",
            "truestage align linear.toml --instruments --for 5min",
        ],
    ),
    (
        "run",
        &[
            "truestage run linear.toml job.toml --dry-run",
            "truestage run volumetric.toml part.csv --join linear --blend 50um",
        ],
    ),
    (
        "memory record",
        &["truestage memory record volumetric.toml --memory first"],
    ),
    (
        "memory import",
        &["truestage memory import volumetric.toml shape.csv"],
    ),
    (
        "memory clear",
        &["truestage memory clear volumetric.toml --memory second"],
    ),
    ("cal list", &["truestage cal list linear.toml"]),
    (
        "cal show",
        &[
            "truestage cal show linear.toml",
            "truestage cal show linear.toml 3f2a",
        ],
    ),
    (
        "cal diff",
        &["truestage cal diff linear.toml 3f2a 9c01 --page both.html"],
    ),
    ("cal activate", &["truestage cal activate linear.toml 3f2a"]),
    (
        "cal rollback",
        &["truestage cal rollback linear.toml --axis x"],
    ),
    (
        "fit linear",
        &[
            "truestage fit linear readings.csv",
            "truestage fit linear readings.csv --save linear.toml --axis x --instrument laser",
        ],
    ),
    ("fit hall", &["truestage fit hall sweep.csv"]),
    (
        "fit screw",
        &[
            "truestage fit screw strokes.csv",
            "truestage fit screw strokes.csv --lead-mm 1 --save uvw.toml",
        ],
    ),
    (
        "fit rotary",
        &[
            "truestage fit rotary placements.csv --lines 36",
            "truestage fit rotary placements.csv --lines 36 --save rotary.toml --axis c",
        ],
    ),
    (
        "fit volumetric",
        &[
            "truestage fit volumetric lines.csv --config volumetric.toml",
            "truestage fit volumetric lines.csv --config volumetric.toml --without e_cz,e_az --save",
        ],
    ),
    (
        "plan path",
        &["truestage plan path volumetric.toml path.csv --join linear --blend 50um"],
    ),
    (
        "plan rotary",
        &[
            "truestage plan rotary --lines 36 --placements 3",
            "truestage plan rotary --lines 36 --offsets 0,1,8,26",
        ],
    ),
    (
        "plan screw",
        &["truestage plan screw --lead-mm 1 --first-mm -4 --last-mm 4"],
    ),
    (
        "plan zero",
        &[
            "truestage plan zero linear.toml --axis x",
            "truestage plan zero linear.toml --sweep sweep.csv",
        ],
    ),
    ("iso230", &["truestage iso230 readings.csv"]),
    (
        "explain",
        &[
            "truestage explain 0x8611",
            "truestage explain 0x06090030 0x7305",
        ],
    ),
    (
        "serve",
        &[
            "truestage serve",
            "truestage serve linear.toml --listen unix:truestage.sock --listen tcp:127.0.0.1:8470",
        ],
    ),
    ("token", &["truestage token anna --role operator"]),
    (
        "status",
        &["truestage status", "truestage status linear.toml --json"],
    ),
    (
        "monitor",
        &[
            "truestage monitor",
            "truestage monitor --at https://stage:8470 --all --for 10s",
        ],
    ),
    (
        "enable",
        &["truestage enable", "truestage enable linear.toml --axis x"],
    ),
    ("disable", &["truestage disable linear.toml --axis x"]),
    (
        "stop",
        &["truestage stop", "truestage stop linear.toml --quick"],
    ),
    (
        "journal export",
        &[
            "truestage journal export run.jsonl --format csv",
            "truestage journal export run.jsonl --format parquet --table point --out tables",
        ],
    ),
    (
        "report",
        &[
            "truestage report run.jsonl",
            "truestage report --compare before.jsonl after.jsonl -o both.html",
        ],
    ),
    ("schema output", &["truestage schema output"]),
    ("schema machine", &["truestage schema machine"]),
    ("completions", &["truestage completions bash"]),
    ("man", &["truestage man man1"]),
];

/// Of every verb: what a script can rely on.
pub(super) const EXIT_CODES: &str = "Exit codes: 0 done, 2 usage or configuration, 3 refused for safety, 4 device or bus, 5 out of tolerance,\n\
     130 stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP";

/// Of a verb that works until somebody ends it: that is how it ends well.
const EXIT_CODES_OF_SERVICE: &str = "Exit codes: 0 done, which is also an end by Ctrl-C, SIGTERM or SIGHUP (one that comes 15 s later or more ends it at once:\n\
     130, 143, 129), 2 usage or configuration, 3 refused for safety, 4 device or bus";

/// `command` with examples and exit codes in the help of each of its verbs.
pub(super) fn with_examples(command: Command) -> Command {
    of_each(command, "")
}

fn of_each(command: Command, path: &str) -> Command {
    let names: Vec<String> = command
        .get_subcommands()
        .map(|it| it.get_name().to_owned())
        .collect();
    names.into_iter().fold(command, |command, name| {
        let words = format!("{path} {name}").trim_start().to_owned();
        command.mut_subcommand(&name, |verb| of_each(helped(verb, &words), &words))
    })
}

fn helped(verb: Command, words: &str) -> Command {
    let own = verb.get_after_help().map(ToString::to_string);
    let calls = EXAMPLES.iter().find(|it| it.0 == words);
    let calls = calls.map(|(_, calls)| format!("Examples:\n  {}", calls.join("\n  ")));
    let parts: Vec<String> = [calls, own].into_iter().flatten().collect();
    if parts.is_empty() {
        // A word that only leads to others.
        return verb;
    }
    let codes = match words {
        "serve" => EXIT_CODES_OF_SERVICE,
        _ => EXIT_CODES,
    };
    verb.after_help(format!("{}\n\n{codes}", parts.join("\n\n")))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::program::Cli;

    /// The words of each verb that does something by itself.
    fn verbs(command: &Command, path: &str) -> Vec<String> {
        let inner: Vec<_> = command
            .get_subcommands()
            .flat_map(|it| verbs(it, format!("{path} {}", it.get_name()).trim_start()))
            .collect();
        let does_something = !command.is_subcommand_required_set() && !path.is_empty();
        inner
            .into_iter()
            .chain(does_something.then(|| path.to_owned()))
            .collect()
    }

    #[test]
    fn a_signal_that_ends_a_service_is_a_good_end() {
        let command = with_examples(Cli::command());
        let help = |verb: &str| {
            let verb = command.find_subcommand(verb).expect("there is one");
            verb.get_after_help().expect("it has one").to_string()
        };
        assert!(help("serve").contains("0 done, which is also an end by Ctrl-C"));
        assert!(help("verify").contains("130 stopped by Ctrl-C"));
    }

    #[test]
    fn every_verb_has_examples_that_the_program_understands_and_its_exit_codes() {
        let mut command = with_examples(Cli::command());
        command.build();
        let all = verbs(&Cli::command(), "");
        assert!(all.len() > 40, "{all:?}");
        for words in &all {
            let found = words
                .split(' ')
                .try_fold(&command, |it, word| it.find_subcommand(word));
            let help = found
                .and_then(Command::get_after_help)
                .map(ToString::to_string);
            let help = help.unwrap_or_default();
            assert!(
                help.contains("Examples:") && help.contains("Exit codes:"),
                "{words}: {help}"
            );
        }
        for (words, calls) in EXAMPLES {
            assert!(
                all.iter().any(|it| it == words),
                "there is no verb `{words}`"
            );
            for call in *calls {
                assert!(call.starts_with(&format!("truestage {words}")), "{call}");
                let read = Cli::command().try_get_matches_from(call.split(' '));
                assert!(read.is_ok(), "{call}: {}", read.unwrap_err());
            }
        }
    }
}
