//! A calibration that is verified at once: what was stored is told, whatever becomes of its verification.

use std::path::{Path, PathBuf};

use machine::records::{Store, short};
use serde_json::{Value, json};

use super::CalibrateArgs;
use super::output::{Ended, Output, with_counters};
use crate::Failure;
use crate::run::CalibrateOptions;
use crate::runs::Told;

/// A verification, and what it fails by.
pub(crate) type Verified = (Told, Option<Failure>);

/// What a calibration stored, and how that is told.
pub(crate) struct Made {
    pub(crate) told: Told,
    /// Where it is stored.
    pub(crate) store: Store,
    /// What `cal rollback` calls all of it.
    pub(crate) group: String,
    /// What the store calls each calibration, and its name.
    pub(crate) stored: Vec<(String, String)>,
}

/// Prints what was `made`, and how its verification `ended`, if there was one; with what the devices counted.
pub(crate) fn tried(
    made: Option<Made>,
    ended: Result<(Option<Verified>, Value), Failure>,
    args: &CalibrateArgs,
    output: Output,
) -> Ended {
    let Some(made) = made else {
        return ended.and(Ok(None));
    };
    let (verified, counters) = match ended {
        Ok(ended) => ended,
        Err(failure) if args.verify => {
            let (told, failure) = made.not_verified(args, failure);
            return output.bad_result(&told.text, told.value, failure);
        }
        Err(failure) => return output.bad_result(&made.told.text, made.told.value, failure),
    };
    let mut told = made.told;
    let Some((then, bad)) = verified else {
        return output.told(told, counters);
    };
    told.append_verified(then);
    match bad {
        None => output.told(told, counters),
        Some(failure) => {
            output.bad_result(&told.text, with_counters(told.value, counters), failure)
        }
    }
}

/// How a verification ended that did not come to figures of a good calibration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Somebody stopped it; where what it measured is kept.
    Stopped(Option<PathBuf>),
    Failed,
    /// It shows that the machine is worse with the calibration.
    Worse,
}

/// Commands, and what they do.
type Next = Vec<(String, &'static str)>;

impl Made {
    /// What is told of it when its verification ended by `failure`, which is told less what it says of going on: it is
    /// not this command that goes on.
    fn not_verified(self, args: &CalibrateArgs, failure: Failure) -> (Told, Failure) {
        let (failure, journal) = match failure {
            Failure::Resumable { source, journal } => (*source, Some(journal)),
            other => (other, None),
        };
        let cut = match (failure.is_stop(), failure.tells_worse()) {
            (true, _) => Cut::Stopped(journal),
            (false, true) => Cut::Worse,
            (false, false) => Cut::Failed,
        };
        let machine = &args.axis;
        let told = self.standing(&cut, (&machine.machine.config, machine.axis.as_deref()));
        (told, failure)
    }

    /// What is stored, whether it is used, and what to do next.
    pub(crate) fn standing(self, cut: &Cut, of: (&Path, Option<&str>)) -> Told {
        let is_used = |(pointer, id): &(String, String)| {
            let active = self.store.active(pointer).ok();
            active.and_then(|it| it.current).as_ref() == Some(id)
        };
        let used: Vec<bool> = self.stored.iter().map(is_used).collect();
        let is_in_use = used.iter().all(|it| *it);
        let next = match (cut, is_in_use) {
            // Nobody is led to use it; what to look for is in the failure.
            (Cut::Worse, _) => self.made_again(of),
            (Cut::Stopped(_) | Cut::Failed, false) => self.all_the_same(of),
            (Cut::Stopped(journal), true) => self.verified_later(journal.is_some(), of),
            (Cut::Failed, true) => self.verified_later(false, of),
        };
        let in_place = self.used_in_place(cut);
        let mut told = self.told;
        told.text += match cut {
            Cut::Stopped(_) => "\nNOT VERIFIED: its verification was stopped",
            Cut::Failed => "\nNOT VERIFIED: its verification failed",
            Cut::Worse => "\nNOT GOOD: its verification shows that the machine is worse with it",
        };
        let mut stored = Vec::new();
        for ((pointer, id), is_used) in self.stored.iter().zip(used) {
            let path = self.store.calibration_path(id);
            let state = if is_used { "in use" } else { "NOT IN USE" };
            let name = short(id);
            told.text += &format!(
                "\n  {pointer}: {name} is {state}, stored in {}",
                path.display()
            );
            stored.push(json!({"of": pointer, "calibration": id, "path": path, "in_use": is_used}));
        }
        told.text += &in_place;
        for (command, what) in &next {
            told.text += &format!("\n  `{command}` {what}");
        }
        let (ended, journal) = match cut {
            Cut::Stopped(journal) => ("stopped", journal.as_ref()),
            Cut::Failed => ("failed", None),
            Cut::Worse => ("worse", None),
        };
        let commands: Vec<&String> = next.iter().map(|it| &it.0).collect();
        // As the kind calls it.
        let key = match told.value.get("active") {
            Some(_) => "active",
            None => "in_use",
        };
        told.value[key] = json!(is_in_use);
        told.value["verification"] = json!({
            "ended": ended,
            "journal": journal,
            "stored": stored,
            "next": commands,
        });
        told
    }

    /// What is in use in place of what makes the machine worse.
    fn used_in_place(&self, cut: &Cut) -> String {
        if *cut != Cut::Worse {
            return String::new();
        }
        let lines = self.stored.iter().map(|(pointer, id)| {
            let active = self.store.active(pointer).ok();
            match active.and_then(|it| it.current).filter(|it| it != id) {
                Some(earlier) => format!("\n  {pointer}: {} is in use again", short(&earlier)),
                None => format!("\n  {pointer}: NOTHING is in use: moves are not corrected"),
            }
        });
        lines.collect()
    }

    /// How to see that the machine is as good as before, and how to calibrate again.
    fn made_again(&self, of: (&Path, Option<&str>)) -> Next {
        let mut all = self.stored.iter();
        let is_any = all.all(|(pointer, id)| {
            let active = self.store.active(pointer).ok();
            let used = active.and_then(|it| it.current);
            used.is_some_and(|it| it != *id)
        });
        let verify = (
            verify_of(of),
            "shows whether what is in use again is still good",
        );
        let calibrate = (
            format!("{} --verify", words_of("calibrate", of)),
            "calibrates again, once the cause is mended",
        );
        let verify = is_any.then_some(verify).into_iter();
        verify.chain([calibrate]).collect()
    }

    /// How what is not used is used all the same, and verified.
    fn all_the_same(&self, of: (&Path, Option<&str>)) -> Next {
        let activated = self.stored.iter().filter(|it| self.is_chosen(it));
        let activate = activated.map(|(_, id)| {
            let command = format!("truestage cal activate {} {}", of.0.display(), short(id));
            (command, "uses it all the same")
        });
        let again = (verify_of(of), "then verifies it again");
        activate.chain([again]).collect()
    }

    /// How what is used is verified, going on with what that has measured or anew, and how to go back.
    fn verified_later(&self, goes_on: bool, of: (&Path, Option<&str>)) -> Next {
        let verify = verify_of(of);
        let mut next = vec![match goes_on {
            true => (format!("{verify} --resume"), "goes on with that"),
            false => (verify, "verifies it"),
        }];
        let mut all = self.stored.iter();
        if all.all(|it| self.store.earlier(&it.0).is_ok()) {
            let config = of.0.display();
            let back = format!("truestage cal rollback {config} --axis {}", self.group);
            next.push((back, "goes back to what was used before"));
        }
        next
    }

    /// What is activated by itself, and not with what it belongs to.
    fn is_chosen(&self, stored: &(String, String)) -> bool {
        stored.0 == self.group || self.stored.iter().all(|it| it.0 != self.group)
    }
}

fn verify_of(of: (&Path, Option<&str>)) -> String {
    words_of("verify", of)
}

fn words_of(verb: &str, (config, axis): (&Path, Option<&str>)) -> String {
    let axis = axis.map_or(String::new(), |it| format!(" --axis {it}"));
    format!("truestage {verb} {}{axis}", config.display())
}

/// Whether what was made is used, in the words of its kind: `what` is made ready.
pub(crate) fn used(what: &str, is_in_use: bool) -> String {
    match is_in_use {
        true => format!("{what} stored and activated"),
        false => format!("{what} stored; what was used before is used still"),
    }
}

impl CalibrateArgs {
    /// What becomes of what is found, before it is.
    pub(super) const fn then(&self) -> &'static str {
        match self.no_activate {
            true => "what was found is stored, and not used",
            false => "what was found is stored and used from then on",
        }
    }

    /// How it is made, by this journal if it goes on with one.
    pub(super) fn options(&self, resume: Option<PathBuf>) -> CalibrateOptions {
        CalibrateOptions {
            resume,
            accept_drift: self.accept_drift,
            aside: self.no_activate,
        }
    }
}

#[cfg(test)]
mod tests {
    use machine::records::CalibrationRecord;

    use super::*;
    use crate::linear::LinearContent;

    const GOLDEN: &str = include_str!("../../golden/linear_budget.json");

    /// Two calibrations of one axis, the second of them just made.
    fn stored() -> (tempfile::TempDir, Store, [String; 2]) {
        let folder = tempfile::tempdir().unwrap();
        let store = crate::stores::store_in(folder.path(), "m");
        let mut record: CalibrationRecord<LinearContent> = serde_json::from_str(GOLDEN).unwrap();
        let mut save = |created: &str| {
            record.head.created = created.into();
            store.save(&record).unwrap()
        };
        let ids = ["2026-01-01T00:00:00Z", "2026-01-02T00:00:00Z"].map(&mut save);
        (folder, store, ids)
    }

    fn told(store: &Store, ids: &[(&str, &String)], cut: &Cut) -> Told {
        let made = Made {
            told: Told {
                text: "made".into(),
                value: json!({"in_use": true}),
            },
            store: store.clone(),
            group: "x".into(),
            stored: ids
                .iter()
                .map(|(of, id)| ((*of).to_owned(), (*id).clone()))
                .collect(),
        };
        made.standing(cut, (Path::new("m.toml"), Some("x")))
    }

    #[test]
    fn what_is_used_unverified_is_told_with_how_to_verify_it_and_how_to_go_back() {
        let (_folder, store, [first, second]) = stored();
        store.activate("x", &second).unwrap();
        let told_of = |cut: &Cut| told(&store, &[("x", &second)], cut);
        let it = told_of(&Cut::Stopped(Some("v.jsonl".into())));
        let name = short(&second);
        for part in [
            "made\nNOT VERIFIED: its verification was stopped",
            &format!("x: {name} is in use, stored in "),
            "`truestage verify m.toml --axis x --resume` goes on with that",
        ] {
            assert!(it.text.contains(part), "{part}: {}", it.text);
        }
        assert!(
            !it.text.contains("rollback"),
            "nothing was before: {}",
            it.text
        );
        assert_eq!(it.value["in_use"], true);
        assert_eq!(it.value["verification"]["ended"], "stopped");
        assert_eq!(
            it.value["verification"]["stored"][0]["calibration"],
            json!(second)
        );
        store.activate("x", &first).unwrap();
        store.activate("x", &second).unwrap();
        let it = told_of(&Cut::Failed);
        let commands = json!([
            "truestage verify m.toml --axis x",
            "truestage cal rollback m.toml --axis x"
        ]);
        assert_eq!(it.value["verification"]["next"], commands);
    }

    #[test]
    fn what_is_not_used_any_more_is_told_so_with_how_to_use_it_all_the_same() {
        let (_folder, store, [first, second]) = stored();
        store.activate("x", &first).unwrap();
        let it = told(&store, &[("x", &second)], &Cut::Failed);
        let name = short(&second);
        assert!(it.text.contains("its verification failed"), "{}", it.text);
        assert!(
            it.text.contains(&format!("x: {name} is NOT IN USE")),
            "{}",
            it.text
        );
        assert_eq!(it.value["in_use"], false);
        let commands = json!([
            format!("truestage cal activate m.toml {name}"),
            "truestage verify m.toml --axis x"
        ]);
        assert_eq!(it.value["verification"]["next"], commands);
        let path = it.value["verification"]["stored"][0]["path"].as_str();
        assert!(path.is_some_and(|it| Path::new(it).exists()));
    }

    #[test]
    fn nobody_is_led_to_use_what_makes_the_machine_worse() {
        let (_folder, store, [first, second]) = stored();
        store.activate("x", &first).unwrap();
        let it = told(&store, &[("x", &second)], &Cut::Worse);
        assert!(it.text.contains("NOT GOOD"), "{}", it.text);
        assert!(!it.text.contains("cal activate"), "{}", it.text);
        assert_eq!(it.value["verification"]["ended"], "worse");
        let before = format!("x: {} is in use again", short(&first));
        assert!(it.text.contains(&before), "{}", it.text);
        let commands = json!([
            "truestage verify m.toml --axis x",
            "truestage calibrate m.toml --axis x --verify"
        ]);
        assert_eq!(it.value["verification"]["next"], commands);
    }
}
