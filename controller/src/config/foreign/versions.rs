//! Two versions of a part of the file, as a version control leaves them that could not join them.

use super::Foreign;
use crate::config::slips::{KEEP_ONE, is_mark};

/// What the first of `lines` begins, if it is both versions between their marks; the first version is read on.
pub(super) fn read(lines: &[&str], section: &str) -> Option<Foreign> {
    lines.first().filter(|it| it.starts_with("<<<<<<<"))?;
    let end = lines.iter().position(|it| it.starts_with(">>>>>>>"))?;
    let first = lines[1..end].iter().take_while(|it| !is_mark(it));
    let first = first.map(|it| (*it).to_owned());
    let mut meant: Vec<String> = core::iter::once(String::new()).chain(first).collect();
    meant.resize(end + 1, String::new());
    Some(Foreign {
        count: end + 1,
        meant,
        cause: format!(
            "two versions of the file were joined from here to {} lines below, and nobody chose between them",
            end
        ),
        help: KEEP_ONE.into(),
        path: Some(section.to_owned()),
        unread: Vec::new(),
    })
}
