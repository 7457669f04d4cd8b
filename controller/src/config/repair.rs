//! A file as it was meant, so that what stands between its keys can be judged along with each of them.

use toml::{Table, Value};

/// What makes one value of a file readable.
#[derive(Clone, Debug)]
pub(super) enum Repair {
    /// A key that was mistyped.
    Rename { key: String, to: String },
    /// A value that was written in another way.
    Replace { key: String, value: Value },
    /// A key that is not known at all.
    Remove { key: String },
}

impl Repair {
    fn key(&self) -> &str {
        match self {
            Repair::Rename { key, .. } | Repair::Replace { key, .. } | Repair::Remove { key } => {
                key
            }
        }
    }

    /// The keys whose values may not be what was meant: nothing more is said of them.
    pub(super) fn doubted(&self) -> Vec<String> {
        let mut keys = vec![self.key().to_owned()];
        if let Repair::Rename { key, to } = self {
            let section = key.rsplit_once('.').map_or("", |it| it.0);
            keys.push(super::lines::below(section, to));
        }
        keys
    }
}

/// `document` with all of them.
pub(super) fn repaired(mut document: Table, repairs: &[Repair]) -> Table {
    let mut repairs: Vec<&Repair> = repairs.iter().collect();
    // What is within a section comes before its name.
    repairs.sort_by_key(|it| core::cmp::Reverse(it.key().matches('.').count()));
    for repair in repairs {
        let (section, key) = repair.key().rsplit_once('.').unwrap_or(("", repair.key()));
        if let Some(table) = section_at(&mut document, section) {
            apply(table, key, repair);
        }
    }
    document
}

fn apply(table: &mut Table, key: &str, repair: &Repair) {
    match repair {
        Repair::Replace { value, .. } => {
            if let Some(own) = table.get_mut(key) {
                *own = value.clone();
            }
        }
        Repair::Remove { .. } => {
            table.remove(key);
        }
        Repair::Rename { to, .. } => match (table.remove(key), table.get_mut(to.as_str())) {
            (Some(Value::Table(own)), Some(Value::Table(other))) => {
                join(other, own);
            }
            (Some(Value::Array(own)), Some(Value::Array(other))) => other.extend(own),
            (Some(value), None) => {
                table.insert(to.clone(), value);
            }
            _ => {}
        },
    }
}

/// Puts what is only in `own` into `other`, section by section.
pub(super) fn join(other: &mut Table, own: Table) {
    for (key, value) in own {
        match (other.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(own)) => join(inner, own),
            (Some(Value::Array(items)), Value::Array(own)) if own.iter().all(Value::is_table) => {
                items.extend(own);
            }
            (Some(_), _) => {}
            (None, value) => {
                other.insert(key, value);
            }
        }
    }
}

fn section_at<'a>(document: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    let mut parts = path.split('.').filter(|it| !it.is_empty());
    let mut table = document;
    while let Some(part) = parts.next() {
        table = match table.get_mut(part)? {
            Value::Table(inner) => inner,
            Value::Array(items) => {
                let at: usize = parts.next()?.parse().ok()?;
                items.get_mut(at)?.as_table_mut()?
            }
            _ => return None,
        };
    }
    Some(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_names_and_what_is_not_known_are_as_they_were_meant() {
        let text = "[axsi.x]\nrunz = \"3\"\nother = 1\n[[p.a]]\n[[p.a]]\nn = [1]\n";
        let document = text.parse::<Table>().expect("it is TOML");
        let key = |it: &str| it.to_owned();
        let repairs = [
            Repair::Rename {
                key: key("axsi"),
                to: key("axis"),
            },
            Repair::Replace {
                key: key("axsi.x.runz"),
                value: Value::Integer(3),
            },
            Repair::Rename {
                key: key("axsi.x.runz"),
                to: key("runs"),
            },
            Repair::Remove {
                key: key("axsi.x.other"),
            },
            Repair::Replace {
                key: key("p.a.1.n"),
                value: Value::Integer(1),
            },
        ];
        let meant = "[axis.x]\nruns = 3\n[[p.a]]\n[[p.a]]\nn = 1\n";
        let meant = meant.parse::<Table>().expect("it is TOML");
        assert_eq!(repaired(document, &repairs), meant);
        assert_eq!(repairs[2].doubted(), ["axsi.x.runz", "axsi.x.runs"]);
    }
}
