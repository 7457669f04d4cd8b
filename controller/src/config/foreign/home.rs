//! Which section of a configuration a foreign one was meant to be: by its names, by where it stands and by its keys.

use super::Around;
use crate::config::lines::below;
use crate::config::structure::places;
use crate::config::wanted::{Wanted, section_meant};

/// The path of the section called `names`, one within the other, that has `keys`; `None` where nobody knows.
pub(super) fn of(names: &[&str], keys: &[&str], around: &Around<'_>) -> Option<String> {
    let mut candidates = named(names, around);
    candidates.extend(by_keys(names, keys, around));
    candidates.retain(|it| fits(it, keys, around));
    // What is there already was hardly meant.
    let is_new = |it: &&String| !around.headings.contains(&it.as_str());
    let new = candidates.iter().find(is_new);
    new.or(candidates.first()).cloned()
}

/// Whether it has most of the keys: one of them may be mistyped.
fn fits(path: &str, keys: &[&str], around: &Around<'_>) -> bool {
    let wanted = Wanted::at(around.schema, path);
    let known = keys.iter().filter(|it| wanted.has(it)).count();
    known > 0 && known * 2 >= keys.len()
}

/// By the names alone: from the top of the file, or within a section that it stands in.
fn named(names: &[&str], around: &Around<'_>) -> Vec<String> {
    let names: Vec<String> = names.iter().map(|it| it.to_lowercase()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut found: Vec<String> = section_meant(around.schema, &names).into_iter().collect();
    // `analog_hall`
    if let [name] = names[..]
        && let Some((group, own)) = name.split_once('_')
    {
        found.extend(section_meant(around.schema, &[group, own]));
    }
    let mut base = around.section;
    while !base.is_empty() && !names.is_empty() {
        let parts: Vec<&str> = base.split('.').chain(names.iter().copied()).collect();
        found.extend(section_meant(around.schema, &parts));
        base = base.rsplit_once('.').map_or("", |it| it.0);
    }
    found
}

/// By the keys: the sections that have them all, those first that are named like it.
fn by_keys(names: &[&str], keys: &[&str], around: &Around<'_>) -> Vec<String> {
    let letters = names.concat().to_lowercase();
    let alike = |path: &str| path.split('.').filter(|it| letters.contains(it)).count();
    let mut found = places::with_all(around.schema, keys);
    found.sort_by_key(|it| core::cmp::Reverse(alike(it)));
    let most = found.first().map_or(0, |it| alike(it));
    found.retain(|it| alike(it) == most);
    found
        .iter()
        .filter_map(|it| with_a_name(it, names, around))
        .collect()
}

/// `axis.x.zero` of `axis.NAME.zero`: by the section that it stands in, or the only one that has none.
fn with_a_name(path: &str, names: &[&str], around: &Around<'_>) -> Option<String> {
    let Some((group, rest)) = path.split_once(".NAME") else {
        return Some(path.to_owned());
    };
    // `can0` has the keys of a bus, and its name.
    if let (true, [.., name]) = (rest.is_empty(), names)
        && *name != group
    {
        return Some(below(group, name));
    }
    let own = |it: &'_ str| -> Option<String> {
        let name = it
            .strip_prefix(group)?
            .strip_prefix('.')?
            .split('.')
            .next()?;
        Some(below(group, name))
    };
    let whole = |it: &str| format!("{it}{rest}");
    let is_missing = |it: &String| !around.headings.contains(&whole(it).as_str());
    if let Some(it) = own(around.section).filter(is_missing) {
        return Some(whole(&it));
    }
    let mut lacking: Vec<String> = around
        .headings
        .iter()
        .filter_map(|it| own(it))
        .filter(is_missing)
        .collect();
    lacking.sort_unstable();
    lacking.dedup();
    match &lacking[..] {
        [one] => Some(whole(one)),
        _ => None,
    }
}
