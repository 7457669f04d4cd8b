//! The file that a configuration was read from.

use std::path::{Path, PathBuf};

use machine::records::ConfigHash;

use super::whole;
use crate::time_of_day::time_of_day;

/// A configuration's file as it was read, to be compared with what it says later.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ConfigFile {
    path: PathBuf,
    text: ConfigHash,
    /// When it was read, UTC, to the minute.
    read_at: String,
}

impl ConfigFile {
    /// Notes that the file at `path` was read now, as `text`.
    pub(super) fn note_read(path: &Path, text: ConfigHash) -> Self {
        Self {
            path: path.to_owned(),
            text,
            read_at: time_of_day().strftime("%Y-%m-%d %H:%M UTC").to_string(),
        }
    }

    /// Says that the file has another text by now than the one in use. Reads the disk.
    pub(super) fn change(&self) -> Option<String> {
        let (path, read_at) = (self.path.display(), &self.read_at);
        let what = match whole::text_of(&self.path) {
            Ok(text) if ConfigHash::of_texts(&text, &[]) == self.text => return None,
            Ok(_) => format!("has changed since {read_at}"),
            Err(_) => format!("cannot be read any more as it was at {read_at}"),
        };
        Some(format!(
            "{path}: the file {what}, and the machine goes on with what it said then; restart the service to use it"
        ))
    }
}

#[cfg(test)]
mod tests {
    use crate::config::load;

    #[test]
    fn a_file_that_says_something_else_is_noticed() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let path = file.path();
        let text = include_str!("../../../configs/machines/linear.toml");
        std::fs::write(path, text).unwrap();
        let read = load(path).unwrap().config.file.unwrap();
        assert_eq!(read.change(), None);
        // Written anew with the same text, it says the same.
        std::fs::write(path, text).unwrap();
        assert_eq!(read.change(), None);
        std::fs::write(path, format!("{text}\n# another word")).unwrap();
        let said = read.change().unwrap();
        assert!(said.contains("has changed since 20"), "{said}");
        std::fs::remove_file(path).unwrap();
        let said = read.change().unwrap();
        assert!(said.contains("cannot be read any more"), "{said}");
    }
}
