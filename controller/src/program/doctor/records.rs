//! Where the records of a machine are, who uses it, and how old its calibrations are.

use std::path::Path;

use jiff::Timestamp;
use machine::records::{Lease, Store, short};
use nix::sys::statvfs::statvfs;
use nix::unistd::{AccessFlags, access};
use units::Several;

use super::checked::Checked;
use crate::config::MachineConfig;
use crate::groups;
use crate::program::intended::ago;
use crate::time_of_day::time_of_day;

/// Less than this is left: a run may not find room for its journal.
const ROOM_LEAST: u64 = 1 << 30;
/// A stage is calibrated at least every so many days (as instruments usually are).
const DAYS_MAX: i64 = 366;

/// The folder of the records, which may not be there yet.
pub(super) fn folder(root: &Path) -> Vec<Checked> {
    const SUBJECT: &str = "records";
    let mut there = root.ancestors().filter(|it| !it.as_os_str().is_empty());
    let there = there.find(|it| it.exists()).unwrap_or(Path::new("."));
    let shown = root.display();
    if access(there, AccessFlags::W_OK).is_err() {
        let told = format!("{} cannot be written to", there.display());
        return vec![Checked::bad(
            SUBJECT,
            told,
            "`data_dir` names another folder, or give this user the right",
        )];
    }
    let left = statvfs(there).map(|it| it.blocks_available() * it.fragment_size());
    vec![match left {
        Ok(left) if left < ROOM_LEAST => Checked::doubtful(
            SUBJECT,
            format!("{} MB are left for {shown}", left >> 20),
            "make room: a journal that cannot be written ends its run",
        ),
        _ => Checked::good(SUBJECT, format!("{shown}")),
    }]
}

/// What is in use.
pub(super) fn calibrations(config: &MachineConfig, store: &Store) -> Vec<Checked> {
    let names = pointers(config);
    names.iter().map(|it| calibration(store, it)).collect()
}

/// Under which names calibrations are in use.
pub(super) fn pointers(config: &MachineConfig) -> Vec<String> {
    let axes = config.axis.keys().chain(config.rotary.keys());
    let mut names: Vec<String> = axes.cloned().collect();
    for pointer in groups(config).into_iter().flat_map(|it| it.pointers) {
        if !names.contains(&pointer) {
            names.push(pointer);
        }
    }
    names
}

/// Who has the machine, if anybody has.
pub(super) fn owner(store: &Store) -> Option<Checked> {
    let (owner, _) = Lease::owner(store)?;
    Some(Checked::doubtful(
        "lease",
        format!("{owner} uses the machine"),
        "end it, or ask it: `truestage status`, `truestage stop`",
    ))
}

fn calibration(store: &Store, pointer: &str) -> Checked {
    let subject = format!("calibration of {pointer}");
    let current = match store.active(pointer) {
        Ok(active) => active.current,
        Err(error) => return Checked::bad(&subject, error.to_string(), RESTORE),
    };
    let Some(id) = current else {
        return Checked::not_told(&subject, "none is in use");
    };
    let created = match store.glance(&id) {
        Ok(glance) => glance.head.created,
        Err(error) => return Checked::bad(&subject, error.to_string(), RESTORE),
    };
    let told = format!(
        "{} of {created}{}",
        short(&id),
        ago::since(&created).map_or(String::new(), |it| format!(", {it}"))
    );
    match days_since(&created) {
        Some(days) if days > DAYS_MAX => {
            let told = format!("{told}: {} old", Several(days, "day"));
            Checked::doubtful(
                &subject,
                told,
                "`truestage verify`, and calibrate again if it is out of tolerance",
            )
        }
        _ => Checked::good(&subject, told),
    }
}

const RESTORE: &str = "`truestage cal rollback` goes back to the one before, `truestage cal list` shows what there is";

fn days_since(created: &str) -> Option<i64> {
    let then: Timestamp = created.parse().ok()?;
    Some((time_of_day().as_second() - then.as_second()) / 86_400)
}

#[cfg(test)]
mod tests {
    use super::super::checked::Verdict;
    use super::super::checked::tests::expect;
    use super::*;
    use crate::config::parse;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

    #[test]
    fn a_folder_that_is_not_there_yet_is_judged_by_where_it_will_be() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("not/yet");
        expect(
            &super::folder(&root),
            "records",
            Verdict::Good,
            ["not/yet", ""],
        );
        assert!(!root.exists());
    }

    #[test]
    fn who_has_the_machine_and_what_is_in_use_is_told() {
        let config = parse(LINEAR, "m").unwrap().config;
        let folder = tempfile::tempdir().unwrap();
        let store = crate::stores::store_in(folder.path(), "linear");
        let found = calibrations(&config, &store);
        assert_eq!(found.len(), 1);
        expect(
            &found,
            "calibration of x",
            Verdict::NotTold,
            ["none is in use", ""],
        );
        let _lease = Lease::take(&store, "calibrate").unwrap();
        let found: Vec<_> = owner(&store).into_iter().collect();
        expect(
            &found,
            "lease",
            Verdict::Doubtful,
            ["truestage calibrate", "status"],
        );
    }

    #[test]
    fn days_are_counted_from_a_records_time() {
        assert!(days_since("2020-01-01T00:00:00Z").unwrap() > 2000);
        assert_eq!(days_since("never"), None);
    }
}
