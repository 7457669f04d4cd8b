//! Keys that stand in one section and are missing in another: told once, where they stand.

use super::Found;
use crate::config::judge::without;

/// Findings, by their place among all, with the key that each is about.
#[derive(Debug, Default)]
pub(super) struct Moved {
    /// Of keys that are not known where they stand.
    strange: Vec<(usize, String)>,
    /// Of keys that a section lacks.
    lacking: Vec<(usize, String, String)>,
}

impl Moved {
    pub(super) fn add_strange(&mut self, finding: usize, key: &str) {
        self.strange.push((finding, key.to_owned()));
    }

    pub(super) fn add_lacking(&mut self, finding: usize, section: &str, key: &str) {
        self.lacking
            .push((finding, section.to_owned(), key.to_owned()));
    }
}

/// Says where each strange key is missing, where only one section lacks it, and no longer that it lacks it.
pub(super) fn join(found: &mut Found<'_>) {
    let mut told = Vec::new();
    for (at, key) in &found.moved.strange {
        let is_only = found.moved.strange.iter().filter(|it| it.1 == *key).count() == 1;
        let mut lacking = found.moved.lacking.iter().filter(|it| it.2 == *key);
        let (Some((missing, section, _)), None, true) = (lacking.next(), lacking.next(), is_only)
        else {
            continue;
        };
        let place = match section.is_empty() {
            true => "at the top of the file".to_owned(),
            false => format!("in [{section}]"),
        };
        found.findings[*at].0.help = format!("`{key}` is missing {place}: move it there");
        told.push(*missing);
    }
    found.findings = without(core::mem::take(&mut found.findings), &told);
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    const GANTRY: &str = include_str!("../../../../configs/machines/gantry.toml");

    #[track_caller]
    fn told(text: &str) -> Vec<String> {
        match parse(text, "m.toml") {
            Err(ConfigError::Invalid { findings }) => {
                findings.iter().map(ToString::to_string).collect()
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_key_in_the_wrong_section_is_told_once_with_the_one_that_lacks_it() {
        let line = "negative_limit_mm = -6.0";
        let text = GANTRY.edit_first(line, "#").edit(
            "[analog.hall_1.identity]\n",
            &format!("[analog.hall_1.identity]\n{line}\n"),
        );
        let found = told(&text);
        assert_eq!(found.len(), 1, "{found:#?}");
        assert!(
            found[0].contains("is missing in [axis.x1.zero]: move it there"),
            "{found:#?}"
        );
        // Where two sections lack it nobody knows of which it is.
        let text = GANTRY.edit(line, "#").edit(
            "[analog.hall_1.identity]\n",
            &format!("[analog.hall_1.identity]\n{line}\n"),
        );
        assert!(!told(&text).iter().any(|it| it.contains("move it there")));
    }
}
