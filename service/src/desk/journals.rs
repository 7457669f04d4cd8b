//! Journals of runs, and the pages that are made of them.

use std::fs::File;
use std::io::{Read as _, Take};
use std::path::{Path, PathBuf};

use machine::records::{AnyLog, JOURNAL_MAX, StoreError, open_regular, read_journal};
use truestage::Failure;

use super::Desk;
use crate::problem::{Code, Problem};
use crate::view::JournalView;

/// So many journals are told, the newest: each is read as a whole for it.
const TOLD: usize = 100;

/// Journals.
impl Desk {
    /// The newest ones, the newest first; one that cannot be read is told without what it says.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn journals(&self) -> Result<Vec<JournalView>, Problem> {
        let mut names = self.journal_names()?;
        names.sort();
        let newest = names.into_iter().rev().take(TOLD);
        Ok(newest.map(|name| self.journal_view(name)).collect())
    }

    /// What the journal `name`, or that of the run with this name, says: JSON Lines.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    pub fn journal(&self, name: &str) -> Result<String, Problem> {
        let path = self.journal_path(name)?;
        let mut text = String::new();
        let read =
            open_regular(&path, JOURNAL_MAX).and_then(|mut file| file.read_to_string(&mut text));
        read.map_err(|source| Problem::from(Failure::File { path, source }))?;
        Ok(text)
    }

    /// The same, to be read in pieces.
    pub(crate) fn journal_file(&self, name: &str) -> Result<Take<File>, Problem> {
        let path = self.journal_path(name)?;
        let opened = open_regular(&path, JOURNAL_MAX);
        opened.map_err(|source| Problem::from(Failure::File { path, source }))
    }

    /// The page of the journal `name`, or of that of the run with this name, in HTML.
    ///
    /// # Errors
    /// When there is none, nothing can be shown of it, or nobody here makes pages.
    pub fn report(&self, name: &str) -> Result<String, Problem> {
        let path = self.journal_path(name)?;
        let page = self.shared.page.ok_or_else(|| {
            let what = "this service makes no pages";
            Problem::new(Code::NotOffered, what, "use `truestage report`")
        })?;
        page(&path).map_err(Problem::from)
    }

    /// Only what is in the folder has a name: a path leads nowhere else. A run has the name of its journal, too, and a file
    /// that of what it is called without its ending.
    pub(super) fn journal_path(&self, name: &str) -> Result<PathBuf, Problem> {
        let names = self.journal_names()?;
        let of_run = || {
            Path::new(&self.run(name).ok()?.journal?)
                .file_stem()?
                .to_str()
                .map(str::to_owned)
        };
        let stem = name.strip_suffix(".jsonl").unwrap_or(name);
        let found = match names.iter().find(|it| *it == stem) {
            Some(found) => Some(found.clone()),
            None => of_run().filter(|it| names.contains(it)),
        };
        if let Some(found) = found {
            return Ok(self.shared.store.runs().join(format!("{found}.jsonl")));
        }
        let what = format!("there is no journal {name}");
        let help =
            "GET /v1/journals says which there are; a run that has one says so, too (`journal`)";
        Err(Problem::new(Code::NotFound, what, help))
    }

    fn journal_names(&self) -> Result<Vec<String>, Problem> {
        let listed = self.shared.store.journals();
        let listed = listed.map_err(|it: StoreError| Problem::from(Failure::from(it)))?;
        let names = listed.iter().filter_map(|it| it.strip_suffix(".jsonl"));
        Ok(names.map(str::to_owned).collect())
    }

    fn journal_view(&self, name: String) -> JournalView {
        let path = self.shared.store.runs().join(format!("{name}.jsonl"));
        let read = read_journal::<AnyLog>(&path).ok();
        let header = read.as_ref().map(|it| &it.header);
        JournalView {
            name,
            verb: header.map(|it| it.verb.clone()),
            axis: header.map(|it| it.axis.clone()),
            started: header.map(|it| it.started.clone()),
            complete: read.as_ref().is_some_and(|it| it.complete),
        }
    }
}
