//! What a shell and its user want of the words of this program: completions and manual pages.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;
use serde_json::json;

use crate::Failure;
use crate::program::output::{Ended, Output};
use crate::program::streams;

/// For which shell.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// Which shell completes by it.
    shell: Shell,
}

/// Where manual pages go.
#[derive(Clone, Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder that they are written to; it must exist. `man -l DIR/truestage.1` shows one.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// A script that completes the words of this program.
pub(crate) fn completions(args: CompletionsArgs, mut words: Command) -> Ended {
    let mut script = Vec::new();
    let name = words.get_name().to_owned();
    clap_complete::generate(args.shell, &mut words, name, &mut script);
    streams::print(script)?;
    Ok(None)
}

/// A manual page for the program and each of its verbs.
pub(crate) fn man(args: &ManArgs, words: Command, output: Output) -> Ended {
    let folder = args.folder.display();
    clap_mangen::generate_to(words, &args.folder).map_err(|error| Failure::Usage {
        what: format!("manual pages cannot be written to {folder}: {error}"),
        help: "name a folder that exists and that you may write to".into(),
    })?;
    let text =
        format!("manual pages are in {folder}; `man -l {folder}/truestage.1` shows the first");
    output.result(&text, &json!({"folder": args.folder}))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use clap::CommandFactory as _;

    use super::*;
    use crate::program::Cli;

    #[test]
    fn every_verb_has_a_page_and_options_and_exit_codes_are_in_them() {
        let kept = tempfile::tempdir().unwrap();
        let folder = kept.path().to_path_buf();
        man(
            &ManArgs {
                folder: folder.clone(),
            },
            Cli::command(),
            Output::new(true, "test"),
        )
        .unwrap();
        for verb in Cli::command().get_subcommands().map(Command::get_name) {
            let page = fs::read_to_string(folder.join(format!("truestage-{verb}.1")));
            let page = page.unwrap_or_else(|error| panic!("{verb}: {error}"));
            assert!(page.contains(verb), "{page}");
        }
        let page = fs::read_to_string(folder.join("truestage-move.1")).unwrap();
        // roff writes each hyphen so.
        assert!(page.contains("\\-\\-align"), "{page}");
        let first = fs::read_to_string(folder.join("truestage.1")).unwrap();
        assert!(first.contains("Exit codes"), "{first}");
        let nowhere = ManArgs {
            folder: folder.join("nowhere"),
        };
        let refused = man(&nowhere, Cli::command(), Output::new(true, "test")).unwrap_err();
        assert_eq!(refused.exit_code(), 2);
    }

    #[test]
    fn completions_know_every_verb() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let (mut words, mut script) = (Cli::command(), Vec::new());
            clap_complete::generate(shell, &mut words, "truestage", &mut script);
            let script = String::from_utf8(script).unwrap();
            let words: Vec<&str> = script.split(|it: char| !it.is_alphanumeric()).collect();
            for verb in Cli::command().get_subcommands().map(Command::get_name) {
                assert!(words.contains(&verb), "{shell}: {verb}");
            }
        }
    }
}
