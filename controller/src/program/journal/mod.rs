//! `truestage journal export`: what a run's journal holds, as tables for other programs.

mod csv_text;
mod entries;
mod mcap;
mod node;
mod parquet;
mod shape;
mod table;
mod thrift;

use std::io;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Value, json};

use crate::Failure;
use crate::program::output::{Ended, Output};
use crate::program::streams;
use crate::program::written::create;
use csv_text::csv_of;
use entries::{Entry, entries_of};
use mcap::mcap_of;
use parquet::parquet_of;
use table::{Table, tables_of};

#[derive(Debug, Subcommand)]
pub(crate) enum JournalCommand {
    /// Write what a run measured for spreadsheets, pandas and DuckDB (CSV, Parquet) or for Foxglove and PlotJuggler
    /// (MCAP): every kind of entry a table, or a channel, of its own. No file is overwritten.
    Export(ExportArgs),
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ExportFormat {
    /// A file for each table, with a heading.
    Csv,
    /// A file for each table.
    Parquet,
    /// One file with a channel for each kind of entry.
    Mcap,
}

impl ExportFormat {
    const fn ending(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mcap => "mcap",
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// The run's journal (`machine-data/MACHINE/runs/….jsonl`).
    run: PathBuf,
    #[arg(long, value_enum)]
    format: ExportFormat,
    /// Where to: a folder for the tables, a file for `mcap`; beside the journal when not given. `-` is standard output
    /// for one table as CSV.
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Only this table: `point`, `stroke`, `sweep_items`. An unknown one is answered with all there are.
    #[arg(long, value_name = "NAME")]
    table: Option<String>,
}

/// What stands for standard output where a place is named.
const STANDARD_OUTPUT: &str = "-";

impl ExportArgs {
    fn is_printed(&self) -> bool {
        let out = self.out.as_deref();
        out.is_some_and(|it| it.as_os_str() == STANDARD_OUTPUT)
    }

    /// # Errors
    /// When options exclude each other.
    fn judge(&self, output: Output) -> Result<(), Failure> {
        let refused = |what: &str, help: &str| {
            Err(Failure::Usage {
                what: what.into(),
                help: help.into(),
            })
        };
        match (self.format, self.is_printed()) {
            (ExportFormat::Mcap, _) if self.table.is_some() => refused(
                "--table, and MCAP has every kind of entry in one file",
                "leave it out",
            ),
            (ExportFormat::Csv, true) if output.is_json() => refused(
                "--out - and --json both print on standard output",
                "name a folder with --out",
            ),
            (ExportFormat::Csv, _) | (_, false) => Ok(()),
            (_, true) => refused(
                "--out - is for CSV",
                "name a place with --out, or leave it out",
            ),
        }
    }
}

pub(crate) fn run(command: &JournalCommand, output: Output) -> Ended {
    match command {
        JournalCommand::Export(args) => export(args, output),
    }
}

fn export(args: &ExportArgs, output: Output) -> Ended {
    args.judge(output)?;
    let entries = entries_of(&args.run)?;
    if entries.is_torn {
        output.note("warning: the last line of the journal is not whole, and is left out");
    }
    if args.format == ExportFormat::Mcap {
        return as_one_file(args, &entries.all, output);
    }
    let tables = chosen(tables_of(entries.all), args)?;
    match (args.is_printed(), tables.as_slice()) {
        (false, tables) => as_files(args, tables, output),
        (true, [table]) => {
            streams::print(csv_of(table).into_bytes())?;
            Ok(None)
        }
        (true, tables) => Err(Failure::Usage {
            what: format!(
                "--out - prints one table, and the journal has {}",
                tables.len()
            ),
            help: format!("add --table with one of {}", names(tables)),
        }),
    }
}

fn names(tables: &[Table]) -> String {
    let names: Vec<&str> = tables.iter().map(|it| it.name.as_str()).collect();
    names.join(", ")
}

fn chosen(tables: Vec<Table>, args: &ExportArgs) -> Result<Vec<Table>, Failure> {
    let Some(name) = &args.table else {
        return Ok(tables);
    };
    let all = names(&tables);
    let mut only = tables;
    only.retain(|it| it.name == *name);
    match only.is_empty() {
        false => Ok(only),
        true => Err(Failure::Usage {
            what: format!("--table {name}: {} has no such table", args.run.display()),
            help: format!("it has {all}"),
        }),
    }
}

/// The journal's name without its ending.
fn stem(run: &Path) -> String {
    run.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

fn as_files(args: &ExportArgs, tables: &[Table], output: Output) -> Ended {
    let beside = args.run.parent().unwrap_or(Path::new("."));
    let folder = args.out.as_deref().unwrap_or(beside);
    let (stem, ending) = (stem(&args.run), args.format.ending());
    let path = |it: &Table| folder.join(format!("{stem}.{}.{ending}", it.name));
    let paths: Vec<PathBuf> = tables.iter().map(path).collect();
    paths.iter().try_for_each(|it| refuse_existing(it))?;
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    for (table, path) in tables.iter().zip(&paths) {
        let bytes = match args.format {
            ExportFormat::Parquet => parquet_of(table),
            ExportFormat::Csv | ExportFormat::Mcap => csv_of(table).into_bytes(),
        };
        create(path, &bytes).map_err(failed(path))?;
    }
    let each = tables.iter().zip(&paths);
    let lines = each.clone().map(|(table, path)| {
        let (rows, columns) = (table.rows, table.columns.len());
        format!(
            "{}: {rows} rows, {columns} columns in {}",
            table.name,
            path.display()
        )
    });
    let values = each.map(|(table, path)| {
        let columns: Vec<&str> = table.columns.iter().map(|it| it.name.as_str()).collect();
        json!({"table": table.name, "rows": table.rows, "columns": columns, "file": path})
    });
    let value = json!({"journal": args.run, "tables": values.collect::<Vec<Value>>()});
    output.result(&lines.collect::<Vec<_>>().join("\n"), &value)
}

fn as_one_file(args: &ExportArgs, entries: &[Entry], output: Output) -> Ended {
    let beside = args.run.with_extension("mcap");
    let path = args.out.clone().unwrap_or(beside);
    refuse_existing(&path)?;
    create(&path, &mcap_of(entries)).map_err(failed(&path))?;
    let text = format!("{} entries in {}", entries.len(), path.display());
    let value = json!({"journal": args.run, "entries": entries.len(), "file": path});
    output.result(&text, &value)
}

/// What is there is never written over; said before anything is written.
fn refuse_existing(path: &Path) -> Result<(), Failure> {
    match path.try_exists().map_err(failed(path))? {
        false => Ok(()),
        true => Err(Failure::Usage {
            what: format!(
                "{}: there is something of this name already",
                path.display()
            ),
            help: "nothing was written; name another place with --out, or move it away".into(),
        }),
    }
}

fn failed(path: &Path) -> impl Fn(io::Error) -> Failure {
    move |source| Failure::File {
        path: path.to_owned(),
        source,
    }
}
