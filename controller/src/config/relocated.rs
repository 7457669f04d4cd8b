//! Sections under a name that no section has, by their keys: parts that are swapped, joined, or called by another word.

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::judge::Finding;
use super::lines::below;
use super::place::Part;
use super::repair::join;
use super::structure::Findings;
use super::wanted::{Wanted, heading, is_list, section_meant};

/// So many sections under strange names are looked for at most.
const STRANGE_MAX: usize = 25;
/// More parts than this no section's name has.
const PARTS_MAX: usize = 4;

/// The document with each of them in its place, and what is told of them.
pub(super) fn relocated(mut document: Table, schema: &Schema) -> (Table, Findings) {
    let mut sections = Vec::new();
    walk(&document, &mut Vec::new(), &mut sections);
    let mut findings = Findings::new();
    // A file with more of them is no configuration of ours.
    let strange = sections.into_iter().filter_map(|it| {
        let namesake = it.of_namesake(&document, schema);
        (namesake.is_some() || !it.is_at_home(schema)).then_some((it, namesake))
    });
    let strange: Vec<_> = strange.take(STRANGE_MAX).collect();
    for (it, namesake) in strange {
        let Some(meant) = namesake.or_else(|| it.meant(&document, schema)) else {
            continue;
        };
        let Some(value) = taken(&mut document, &it.parts) else {
            continue;
        };
        let nested = meant.iter().rev().fold(value, |inner, part| {
            Value::Table([(part.clone(), inner)].into_iter().collect())
        });
        if let Value::Table(nested) = nested {
            join(&mut document, nested);
        }
        let heading = heading(schema, &meant.join("."));
        let finding = Finding {
            key: it.parts.join("."),
            cause: "no section has this name".to_owned(),
            help: format!("write `{heading}`"),
        };
        findings.push((finding, Part::Name));
    }
    (document, findings)
}

/// The parts of a section's name.
type Name = Vec<String>;

/// The names that a section may have been meant to have.
type Way = fn(&Named, &Schema) -> Vec<Name>;

/// A section with keys of its own.
struct Named {
    parts: Vec<String>,
    keys: Vec<String>,
}

/// Every section of `table` that has keys which are no sections, the innermost first.
fn walk(table: &Table, above: &mut Vec<String>, found: &mut Vec<Named>) {
    for (name, value) in table {
        let first = match value {
            Value::Table(own) => own,
            Value::Array(items) => match items.first() {
                Some(Value::Table(own)) => own,
                _ => continue,
            },
            _ => continue,
        };
        above.push(name.clone());
        walk(first, above, found);
        let plain = first.iter().filter(|(_, it)| !is_section(it));
        let keys: Vec<String> = plain.map(|(key, _)| key.clone()).collect();
        if !keys.is_empty() && above.len() <= PARTS_MAX {
            let parts = above.clone();
            found.push(Named { parts, keys });
        }
        above.pop();
    }
}

fn is_section(value: &Value) -> bool {
    let is_list = |it: &Vec<Value>| !it.is_empty() && it.iter().all(Value::is_table);
    value.is_table() || value.as_array().is_some_and(is_list)
}

impl Named {
    /// The only place that has all its keys and a name that is made of the same parts, or of all but one of them.
    fn meant(&self, document: &Table, schema: &Schema) -> Option<Name> {
        let is_mistyped = self.is_mistyped(document, schema);
        /// A part of a section that is there is known by one key.
        const LENGTHENED: usize = 3;
        const PARTED: usize = 1;
        let ways: [Way; 5] = [
            Self::swapped,
            Self::parted,
            Self::shortened,
            Self::lengthened,
            Self::renamed,
        ];
        for (nth, way) in ways.into_iter().enumerate() {
            // Swapped parts may be like other words; what is like the right ones is told where each is judged.
            // By one key alone nobody is known, and a key with a point in it looks like a section with one.
            let is_short = self.keys.len() < 2;
            let by_one = nth == LENGTHENED || nth == PARTED && self.parts.len() == 1;
            if nth > 0 && (is_mistyped || is_short && !by_one) {
                continue;
            }
            let mut found = way(self, schema);
            if is_short && by_one {
                found.retain(|it| it.len() > 2 && at(document, &it[..it.len() - 1]).is_some());
            }
            found.retain(|it| *it != self.parts && self.fits(it, document, schema));
            found.sort();
            found.dedup();
            let has_section = |it: &Name| at(document, &it[..it.len() - 1]).is_some();
            if found.iter().any(|it| it.len() > 1 && has_section(it)) {
                found.retain(has_section);
            }
            if let [one] = &mut found[..] {
                return Some(core::mem::take(one));
            }
        }
        None
    }

    /// `analog.hall.identity` of `axis.hall.identity` where there is no axis `hall`, and the module of that name has
    /// no such part.
    fn of_namesake(&self, document: &Table, schema: &Schema) -> Option<Name> {
        let [group, name, part] = &self.parts[..] else {
            return None;
        };
        let has_keys = |group: &str| {
            let own = document.get(group).and_then(|it| it.get(name));
            let own = own.and_then(Value::as_table);
            own.is_some_and(|it| it.values().any(|it| !is_section(it)))
        };
        if has_keys(group) || schema["properties"][group].is_null() {
            return None;
        }
        let others = document.keys().filter(|it| *it != group && has_keys(it));
        let others = others.map(|it| vec![it.clone(), name.clone(), part.clone()]);
        let mut others = others.filter(|it| self.fits(it, document, schema));
        others.next().filter(|_| others.next().is_none())
    }

    /// Whether its keys are known where it stands, but for one that may be mistyped.
    fn is_at_home(&self, schema: &Schema) -> bool {
        let wanted = keys_of(schema, &self.parts);
        let strange = self.keys.iter().filter(|it| !wanted.has(it)).count();
        strange < self.keys.len().min(2)
    }

    /// Whether its name is like that of one that is not there: that is told where each part is judged.
    fn is_mistyped(&self, document: &Table, schema: &Schema) -> bool {
        let parts: Vec<&str> = self.parts.iter().map(String::as_str).collect();
        let meant = section_meant(schema, &parts);
        meant.is_some_and(|it| {
            let parts: Name = it.split('.').map(str::to_owned).collect();
            let wanted = keys_of(schema, &parts);
            let there = at(document, &parts).and_then(Value::as_table);
            let is_free =
                there.is_none_or(|own| !self.keys.iter().any(|key| own.contains_key(key)));
            it != self.parts.join(".") && is_free && self.keys.iter().any(|key| wanted.has(key))
        })
    }

    /// Whether all its keys are known there, and none of them is there already.
    fn fits(&self, parts: &[String], document: &Table, schema: &Schema) -> bool {
        let wanted = keys_of(schema, parts);
        let there = at(document, parts);
        // One more of a list has its own.
        let is_one_of_a_list = is_list(schema, &parts.join("."));
        let is_free = |key: &String| match there {
            Some(Value::Table(own)) => !own.contains_key(key),
            Some(Value::Array(_)) => is_one_of_a_list,
            other => other.is_none(),
        };
        self.keys.iter().all(|it| wanted.has(it) && is_free(it))
    }

    /// The same parts in another order.
    fn swapped(&self, _: &Schema) -> Vec<Name> {
        orders(&self.parts)
    }

    /// `axis-x-identity`, `axisx`: parts that nothing, or something else than a point, parts.
    fn parted(&self, schema: &Schema) -> Vec<Name> {
        let whole = self.parts.join(".");
        let known = schema["properties"].as_object().into_iter().flatten();
        let rests =
            known.filter_map(|(group, _)| Some((group, whole.strip_prefix(group.as_str())?)));
        let split = |rest: &str, at: usize| {
            let (before, behind) = rest.split_at(at);
            let is_between = |it: char| "._- /".contains(it);
            let parts = [
                before.trim_matches(is_between),
                behind.trim_matches(is_between),
            ];
            let parts = parts.into_iter().filter(|it| !it.is_empty());
            // A point within a word is one that slipped.
            let whole = parts.map(|it| it.split('.').collect::<String>());
            whole.collect::<Vec<_>>()
        };
        let each = rests.flat_map(|(group, rest)| {
            let places = rest.char_indices().map(|(at, _)| at);
            let own = Wanted::at(schema, group);
            let is_word = move |it: &Name| match it.first() {
                // `can0` is a name by itself.
                Some(first) if first.starts_with(|it: char| it.is_ascii_digit()) => false,
                Some(first) => own.has(first) || !rest.chars().skip(1).any(|it| it == '.'),
                None => false,
            };
            let ways = places.map(move |at| split(rest, at)).filter(is_word);
            ways.map(move |it| [vec![group.clone()], it].concat())
        });
        each.filter(|it| it.len() > 1).collect()
    }

    /// One part too many.
    fn shortened(&self, schema: &Schema) -> Vec<Name> {
        // What comes last is what a name goes on with.
        let [whole @ .., _] = &self.parts[..] else {
            return Vec::new();
        };
        let keys = keys_of(schema, whole);
        if !whole.is_empty() && self.keys.iter().all(|it| keys.has(it)) {
            return vec![whole.to_vec()];
        }
        let each = (0..whole.len()).map(|at| {
            let mut parts = self.parts.clone();
            parts.remove(at);
            parts
        });
        each.collect()
    }

    /// One part too few: the first.
    fn lengthened(&self, schema: &Schema) -> Vec<Name> {
        let known = schema["properties"].as_object().into_iter().flatten();
        // `[axis]` lacks another part.
        let known = known.filter(|_| schema["properties"][&self.parts[0]].is_null());
        let whole = known.map(|(group, _)| [vec![group.clone()], self.parts.clone()].concat());
        whole.collect()
    }

    /// Another word for one of the parts.
    fn renamed(&self, schema: &Schema) -> Vec<Name> {
        let others = (0..self.parts.len()).flat_map(|at| {
            let wanted = Wanted::at(schema, &self.parts[..at].join("."));
            let words = wanted.keys().into_iter().map(str::to_owned);
            let words: Vec<String> = words.collect();
            words.into_iter().map(move |word| {
                let mut parts = self.parts.clone();
                parts[at] = word;
                parts
            })
        });
        others.collect()
    }
}

/// What a section of that name can hold, each one of a list alike.
fn keys_of<'a>(schema: &'a Schema, parts: &[String]) -> Wanted<'a> {
    let path = parts.iter().fold(String::new(), |path, part| {
        let path = below(&path, part);
        match Wanted::at(schema, &path).keys().is_empty() && is_list(schema, &path) {
            true => below(&path, "0"),
            false => path,
        }
    });
    Wanted::at(schema, &path)
}

fn orders(parts: &[String]) -> Vec<Name> {
    if parts.len() < 2 {
        return vec![parts.to_vec()];
    }
    let each = (0..parts.len()).flat_map(|at| {
        let mut rest = parts.to_vec();
        let first = rest.remove(at);
        let inner = orders(&rest).into_iter();
        inner
            .map(move |it| [vec![first.clone()], it].concat())
            .collect::<Vec<_>>()
    });
    each.collect()
}

fn at<'a>(document: &'a Table, parts: &[String]) -> Option<&'a Value> {
    let (first, rest) = parts.split_first()?;
    rest.iter()
        .try_fold(document.get(first)?, |value, part| value.get(part))
}

/// The section, which is no longer in the document, nor are those around it that are empty without it.
fn taken(document: &mut Table, parts: &[String]) -> Option<Value> {
    let (first, rest) = parts.split_first()?;
    if rest.is_empty() {
        return document.remove(first);
    }
    let outer = document.get_mut(first)?.as_table_mut()?;
    let found = taken(outer, rest);
    if outer.is_empty() {
        document.remove(first);
    }
    found
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    #[test]
    fn one_of_a_list_goes_with_the_others() {
        let uvw = include_str!("../../../configs/machines/uvw.toml");
        for wrong in ["[[platformactuator]]", "[[actuator.platform]]"] {
            let text = uvw.edit_first("[[platform.actuator]]", wrong);
            let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
                panic!("{wrong} is no section")
            };
            assert_eq!(findings.len(), 1, "{findings:#?}");
            assert!(
                findings[0].help.contains("`[[platform.actuator]]`"),
                "{findings:#?}"
            );
        }
    }

    #[test]
    fn a_section_under_another_name_is_known_by_its_keys() {
        for (right, wrong) in [
            ("[analog.hall]", "[hall.analog]"),
            ("[can.can0]", "[can0.can]"),
            ("[axis.x.identity]", "[axis-x-identity]"),
            ("[axis.x.identity]", "[axis.identity.x]"),
            ("[axis.x.identity]", "[identity.axis.x]"),
            ("[axis.x.identity]", "[axis.x-identity]"),
            ("[axis.x]", "[axisx]"),
            ("[axis.x]", "[achse.x]"),
            ("[analog.hall.identity]", "[adc.hall.identity]"),
            ("[axis.x.compensation]", "[axis.x.correction]"),
            ("[axis.x.verify]", "[axis.x.calibrate2]"),
            ("[analog.hall.identity]", "[axis.hall.identity]"),
        ] {
            let text = LINEAR.edit(&format!("{right}\n"), &format!("{wrong}\n"));
            let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
                panic!("{wrong} is no section")
            };
            let told: Vec<_> = findings.iter().map(ToString::to_string).collect();
            assert_eq!(findings.len(), 1, "{told:#?}");
            assert!(
                findings[0].help.contains(&format!("`{right}`")),
                "{told:#?}"
            );
        }
    }
}
