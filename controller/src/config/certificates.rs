//! Whether the certificates of a machine hold: those that do not are refused where something is measured, and told
//! here; those that soon will not are warned of.

use jiff::civil::Date;

use super::judge::{Finding, Judge};
use super::model::MachineConfig;
use crate::certificate::Standing;

/// Those that do not hold on the day `today`; those that end soon are among the `warnings`.
pub(super) fn judged(
    config: &MachineConfig,
    today: Date,
    warnings: &mut Vec<Finding>,
) -> Vec<Finding> {
    let mut ended = Vec::new();
    for (key, _, it) in config.certificates() {
        let Some(certified) = &it.certified else {
            continue;
        };
        let standing = certified.standing(today, it.remind_days);
        let found = match standing {
            Standing::Holds => continue,
            Standing::Ends(_) => &mut *warnings,
            Standing::Ended(_) | Standing::NotYet(_) => &mut ended,
        };
        let cause = format!(
            "{} ({}): {standing}; today is {today}",
            it.file.display(),
            certified.identifier
        );
        Judge::at(key, found).say("file", cause, standing.help());
    }
    ended
}
