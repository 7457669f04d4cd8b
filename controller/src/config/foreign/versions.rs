//! Two versions of a part of the file, as a version control leaves them that could not join them.

use super::Foreign;

/// What the first of `lines` begins, if it is both versions between their marks; the first version is read on.
pub(super) fn read(lines: &[&str], section: &str) -> Option<Foreign> {
    lines.first().filter(|it| it.starts_with("<<<<<<<"))?;
    let end = lines.iter().position(|it| it.starts_with(">>>>>>>"))?;
    let is_mark = |it: &&&str| it.starts_with("|||||||") || it.starts_with("=======");
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
        help:
            "keep one version, and remove the other and the lines of <<<<<<<, ======= and >>>>>>>"
                .into(),
        path: Some(section.to_owned()),
        unread: Vec::new(),
    })
}
