//! A key that stands twice where another one is missing: one of the two was meant to be that.

use super::diagnostic::Diagnostic;
use super::judge::without;
use super::meant::key_meant;

/// `findings` with each such pair told as one.
pub(super) fn told(mut findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut gone = Vec::new();
    for at in 0..findings.len() {
        if !findings[at]
            .cause
            .starts_with("the key stands here a second time")
        {
            continue;
        }
        let (section, key) = findings[at]
            .key
            .rsplit_once('.')
            .unwrap_or(("", &findings[at].key));
        let missing = findings
            .iter()
            .enumerate()
            .filter(|(_, it)| it.key == section);
        let missing = missing.filter_map(|(at, it)| {
            let name = it.cause.strip_prefix("missing `")?.strip_suffix('`')?;
            Some((at, name))
        });
        let missing: Vec<_> = missing.collect();
        let names: Vec<&str> = missing.iter().map(|it| it.1).collect();
        let Some(meant) = key_meant(key, &names) else {
            continue;
        };
        let help = format!("did you mean `{meant}` by one of them? It is missing");
        gone.extend(missing.iter().filter(|it| it.1 == meant).map(|it| it.0));
        findings[at].help = help;
    }
    without(findings, &gone)
}
