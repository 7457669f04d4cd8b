//! `truestage report`: a page of one run, or of two side by side.

use std::path::{Path, PathBuf};

use clap::Args;
use machine::records::{AnyLog, read_journal};
use serde_json::{Value, json};

use crate::Failure;
use crate::program::kind::KINDS;
use crate::program::linear;
use crate::program::output::{Ended, Output};
use crate::program::page::pictures::pictures;
use crate::program::verbs::Verbs;
use crate::program::written::replace;

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The run's journal (`machine-data/MACHINE/runs/….jsonl`).
    #[arg(required_unless_present = "compare", conflicts_with = "compare")]
    run: Option<PathBuf>,
    /// Two runs side by side, at one scale, with the differences of their figures (second − first).
    #[arg(long, num_args = 2, value_names = ["FIRST", "SECOND"])]
    compare: Vec<PathBuf>,
    /// Where to write the page; beside the journal when not given.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Write each picture of the page into this folder, too, as an SVG file by itself.
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
}

/// The kind whose journal is at `run`, by what its first line tells.
fn kind_of(run: &Path) -> Result<&'static Verbs, Failure> {
    let opened_by = read_journal::<AnyLog>(run)?.log.opened_by;
    let own = opened_by.and_then(|name| {
        let mut kinds = KINDS.iter().copied();
        kinds.find(|it| it.opened_by.contains(&&*name))
    });
    // A run of which only the header was written shows that.
    Ok(own.unwrap_or(&linear::VERBS))
}

/// The page of the journal at `run`.
pub(crate) fn html(run: &Path) -> Result<String, Failure> {
    (kind_of(run)?.page)(run)
}

/// The page of two runs, and their figures.
pub(crate) fn compared([first, second]: [&Path; 2]) -> Result<(String, Value), Failure> {
    let (kind, other) = (kind_of(first)?, kind_of(second)?);
    if !core::ptr::eq(kind, other) {
        return Err(Failure::Usage {
            what: format!(
                "{} and {} are runs of machines of different kinds",
                first.display(),
                second.display()
            ),
            help: "compare two runs of one kind: two verifications of one axis, for example".into(),
        });
    }
    let comparison = (kind.compare)([first, second])?;
    Ok((comparison.html(), comparison.value()))
}

pub(crate) fn run(args: &ReportArgs, output: Output) -> Ended {
    let (html, figures, beside) = match (&args.run, args.compare.as_slice()) {
        (_, [first, second]) => {
            let (html, figures) = compared([first, second])?;
            (html, Some(figures), second.with_extension("compared.html"))
        }
        (Some(run), _) => (html(run)?, None, run.with_extension("html")),
        (None, _) => unreachable!("the command line wants a run or two"),
    };
    let path = args.output.clone().unwrap_or(beside);
    replace(&path, html.as_bytes())?;
    let mut text = format!("report in {}", path.display());
    let mut value = json!({"report": path});
    if let Some(figures) = figures {
        value["figures"] = figures;
    }
    if let Some(folder) = &args.svg {
        let written = write_pictures(folder, &html)?;
        text += &format!("\n{} pictures in {}", written.len(), folder.display());
        value["pictures"] = json!(written);
    }
    output.result(&text, &value)
}

fn write_pictures(folder: &Path, html: &str) -> Result<Vec<PathBuf>, Failure> {
    std::fs::create_dir_all(folder).map_err(unwritten(folder))?;
    let each = pictures(html).into_iter();
    each.map(|it| {
        let path = folder.join(it.file);
        replace(&path, it.svg.as_bytes())?;
        Ok(path)
    })
    .collect()
}

fn unwritten(path: &Path) -> impl FnOnce(std::io::Error) -> Failure {
    move |source| Failure::File {
        path: path.to_owned(),
        source,
    }
}
