//! What the sections of all drives must keep to.

use crate::config::judge::Finding;

/// Axes name files, and stand in words of the command line (`x=1mm`).
pub(crate) fn check_axis_name(findings: &mut Vec<Finding>, section: &str, name: &str) {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        findings.push(Finding {
            key: format!("{section}.{name}"),
            cause: format!("`{name}` cannot name an axis"),
            help: "use letters, digits and _".into(),
        });
    }
}
