//! Findings, and the small rules that make them.

use std::collections::BTreeMap;

use units::Short;

use super::diagnostic::shown;
use super::meant::name_meant;
use super::place::is_of_key;

/// A tolerance so many times as large as the errors that are corrected is reached by any machine: its errors are larger
/// before they are corrected, but hardly by so much.
pub(crate) const ANY_REACHES: f64 = 10.0;
/// An axis is measured where it works, which may be a small part of its travel; less than this share is seldom meant.
pub(crate) const COVERED_SHARE: f64 = 0.1;

/// Something that cannot be, at a dotted key.
#[derive(Clone, Debug)]
pub(crate) struct Finding {
    pub(crate) key: String,
    pub(crate) cause: String,
    pub(crate) help: String,
}

/// Collects findings below one key.
pub(crate) struct Judge<'a> {
    prefix: String,
    findings: &'a mut Vec<Finding>,
}

impl<'a> Judge<'a> {
    pub(crate) const fn at(prefix: String, findings: &'a mut Vec<Finding>) -> Self {
        Self { prefix, findings }
    }

    pub(crate) fn say(&mut self, key: &str, cause: impl Into<String>, help: impl Into<String>) {
        let key = self.path(key);
        self.findings.push(Finding {
            key,
            cause: cause.into(),
            help: help.into(),
        });
    }

    /// Where several have it in common, the first of them tells it.
    pub(crate) fn say_once(
        &mut self,
        key: &str,
        cause: impl Into<String>,
        help: impl Into<String>,
    ) {
        let path = self.path(key);
        if !self.findings.iter().any(|it| it.key == path) {
            self.say(key, cause, help);
        }
    }

    fn path(&self, key: &str) -> String {
        match (self.prefix.as_str(), key) {
            (prefix, "") => prefix.to_owned(),
            ("", key) => key.to_owned(),
            (prefix, key) => format!("{prefix}.{key}"),
        }
    }

    pub(crate) fn within(&mut self, key: &str, value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            self.say(
                key,
                format!("{} is impossible", Short(value)),
                format!("give {} to {}", Short(low), Short(high)),
            );
        }
    }

    /// More than nothing, and no more than `most`, which is what the words `limit` say.
    pub(crate) fn up_to(&mut self, key: &str, value: f64, (most, limit): (f64, &str)) {
        if !(value > 0.0 && value <= most) {
            let cause = match value > most {
                true => format!("{} is more than {limit}, {}", Short(value), Short(most)),
                false => format!("{} is impossible", Short(value)),
            };
            let help = format!(
                "give more than 0 and at most {}, or raise {limit}",
                Short(most)
            );
            self.say(key, cause, help);
        }
    }

    /// At least `least`, which is what the words `limit` say.
    pub(crate) fn at_least(&mut self, key: &str, value: f64, (limit, least): (&str, f64)) {
        // A NaN, which TOML can write, is no limit, either.
        let is_enough = value >= least;
        if !is_enough {
            let cause = format!("{} is less than {limit}, {}", Short(value), Short(least));
            let help = format!("give at least {}, or lower {limit}", Short(least));
            self.say(key, cause, help);
        }
    }

    pub(crate) fn below(&mut self, low: (&str, f64), high: (&str, f64)) {
        // A NaN, which TOML can write, is not in order, either.
        let in_order = low.1 < high.1;
        if !in_order {
            let cause = format!(
                "{} must be greater than {} ({} and {})",
                high.0,
                low.0,
                Short(high.1),
                Short(low.1)
            );
            let exchanged = match low.1 > high.1 {
                true => "exchange the two if they stand one for the other, or ",
                false => "",
            };
            let help = format!("{exchanged}raise {} or lower {}", high.0, low.0);
            self.say(high.0, cause, help);
        }
    }

    /// That a section of the kind `section` (`analog`, say) of this file is called `name`.
    pub(crate) fn known<T>(
        &mut self,
        key: &str,
        name: &str,
        table: &BTreeMap<String, T>,
        section: &str,
    ) {
        let heading = is_plain(name).then(|| format!("[{section}.{name}]"));
        let add = heading.map_or("add a section for it".into(), |it| format!("add {it}"));
        self.is_among((key, name), table, (said_of(section), Some(&add)));
    }

    /// Likewise of another file, to which nothing can be added here.
    pub(crate) fn known_to_machine<T>(
        &mut self,
        key: &str,
        name: &str,
        table: &BTreeMap<String, T>,
        section: &str,
    ) {
        self.is_among((key, name), table, (said_of(section), None));
    }

    fn is_among<T>(
        &mut self,
        (key, name): (&str, &str),
        table: &BTreeMap<String, T>,
        (kind, add): (&str, Option<&str>),
    ) {
        if table.contains_key(name) {
            return;
        }
        let names: Vec<&str> = table.keys().map(String::as_str).collect();
        let known = match names.is_empty() {
            true => "there is none yet".to_owned(),
            false => format!("known: {}", names.join(", ")),
        };
        // `analog.hall` is how its section is called.
        let (_, last) = name.rsplit_once('.').unwrap_or(("", name));
        let own = names.iter().find(|it| **it == last).copied();
        let meant = own.or_else(|| name_meant(name, &names));
        let help = match (meant, add) {
            (Some(meant), _) => format!("did you mean `{meant}`? {}", capital(&known)),
            (None, Some(add)) if names.is_empty() => format!("{known}: {add}"),
            (None, Some(add)) => format!("{known}; or {add}"),
            (None, None) => known,
        };
        self.say(key, format!("there is no {kind} `{}`", shown(name)), help);
    }
}

/// What the sections of a kind are, in words.
fn said_of(section: &str) -> &str {
    match section {
        "analog" => "analog module",
        "axis" => "linear axis",
        "can" => "CAN bus",
        "serial" => "serial line",
        other => other,
    }
}

/// Whether it can be the name of a section as it is.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && name.len() <= 40 && name.chars().all(is_of_key)
}

/// `findings` without those whose places among them are `told` by others.
pub(super) fn without<T>(findings: Vec<T>, told: &[usize]) -> Vec<T> {
    let each = findings.into_iter().enumerate();
    let left = each.filter(|(at, _)| !told.contains(at));
    left.map(|it| it.1).collect()
}

/// As a sentence begins.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}
