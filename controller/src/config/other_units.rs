//! Keys that end with another unit than the one that was meant: whether the number is of the one or of the other.

use toml::{Table, Value};
use units::Short;

use super::consequences::with;
use super::judge::Finding;
use super::structure::{Converted, Findings};

/// `judged` of the numbers as they were meant, which is told in `findings`: by which of the two less is wrong with the
/// file. `found_in` judges a document, and gives nothing where it cannot be read.
pub(super) fn judged(
    mut judged: Vec<Finding>,
    (document, converted): (&Table, &[Converted]),
    findings: &mut Findings,
    mut found_in: impl FnMut(&Table) -> Option<Vec<Finding>>,
) -> Vec<Finding> {
    for it in converted {
        // A key of whole numbers takes no others.
        let ways = [Value::Float(it.value), Value::Integer(it.value as i64)];
        let mut ways = ways
            .into_iter()
            .filter_map(|value| with(document, &it.key, value));
        let Some(other) = ways.find_map(|it| found_in(&it)) else {
            continue;
        };
        let key = it.key.rsplit('.').next().unwrap_or_default();
        let line = format!("`{key} = {:?}`", it.value);
        let help = &mut findings[it.finding].0.help;
        if other.len() < judged.len() {
            *help = format!("write {line}: a key's ending is its unit");
            judged = other;
        } else if other.len() == judged.len() {
            *help = format!(
                "did you mean `{key}`? In its unit it is {}",
                Short(it.value)
            );
        }
    }
    judged
}
