//! States of three axes that are kept on purpose: recorded, used by what moves then, and forgotten.

use std::path::Path;

use service::{Code, MotionState, RunKind, RunRequest, RunState, RunView};
use tests::VOLUMETRIC;
use tests::volume::{Volume, good, quick};

use super::{Bed, SEED, anna, compensated, each_here, to, zeroed};
use crate::client::PATIENCE;
use crate::stage::Stage;

const FIRST: &str = "volume-first-memory";
const SECOND: &str = "volume-second-memory";

impl Bed<'_> {
    fn keeps(&self, kind: RunKind) -> RunView {
        let id = self.client.plan(&anna(), &RunRequest::of(kind, None));
        let run = id.and_then(|id| self.client.run(&id, PATIENCE));
        run.unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// The name of what is kept and used there.
    fn kept(&self, of: &str) -> Option<String> {
        let mut all = self.client.calibrations().into_iter();
        all.find(|it| it.axis == of && it.active).map(|it| it.id)
    }

    /// What is used otherwise, and why nothing is corrected by it.
    fn forgets(&self, of: &str) -> (Vec<(String, Option<String>)>, Option<String>) {
        let chosen = self.client.clear(&anna(), of);
        let chosen = chosen.unwrap_or_else(|problem| panic!("{problem}"));
        let changes = chosen.changes.into_iter();
        (changes.map(|it| (it.of, it.id)).collect(), chosen.warning)
    }
}

/// Errors are known and the detectors' references taken: what is seen or designed beyond them is kept.
pub(super) fn with_references(body: impl Fn(&Bed<'_>)) {
    let mut before = Volume::zeroed(SEED, quick, |text| text);
    let store = before.bench.store.clone();
    before.know_errors();
    good(before.work().reference(&store));
    let new = |rig, folder: &Path| {
        before.bequeath(&folder.join("volumetric"));
        Stage::new(rig, (VOLUMETRIC, SEED), folder, quick)
    };
    each_here(new, body);
}

#[test]
fn a_state_is_kept_used_and_forgotten_with_what_counts_from_it() {
    with_references(zeroed(|bed: &Bed<'_>| {
        are_kept(bed);
        are_forgotten(bed);
        are_refused(bed);
    }));
}

fn are_kept(bed: &Bed<'_>) {
    for (kind, of) in [
        (RunKind::FirstMemory, FIRST),
        (RunKind::SecondMemory, SECOND),
    ] {
        assert_eq!(bed.kept(of), None);
        let run = bed.keeps(kind);
        assert_eq!((run.state, run.kind), (RunState::Done, kind), "{run:?}");
        let kept = bed.kept(of);
        assert_eq!(run.result["memory"].as_str(), kept.as_deref(), "{run:?}");
        assert!(kept.is_some());
        let view = bed.ended(&bed.begin(&compensated("x", 40.0)));
        assert_eq!(view.state, MotionState::Done, "{view:?}");
        assert_eq!(view.axes["x"].corrected, "yes");
    }
}

/// A second that counted from the first stays, and nothing is corrected until it is forgotten, too.
fn are_forgotten(bed: &Bed<'_>) {
    let none = |of: &str| (of.to_owned(), None);
    let second = bed.kept(SECOND).expect("it was recorded");
    let (changes, warning) = bed.forgets(FIRST);
    assert_eq!(changes, [none(FIRST)]);
    assert!(warning.is_some_and(|it| it.contains(&second[..12])));
    assert_eq!((bed.kept(FIRST), bed.kept(SECOND)), (None, Some(second)));
    assert_eq!(bed.client.axis("x").unwrap().calibration, None);
    assert_eq!(bed.forgets(SECOND), (vec![none(SECOND)], None));
    assert_eq!(bed.kept(SECOND), None);
    assert!(bed.client.axis("x").unwrap().calibration.is_some());
    assert_eq!(bed.forgets(SECOND), (vec![none(SECOND)], None), "as before");
    let view = bed.ended(&bed.begin(&compensated("x", 60.0)));
    assert_eq!(view.state, MotionState::Done, "{view:?}");
}

fn are_refused(bed: &Bed<'_>) {
    let refused = |of: &str, words: &str| {
        let problem = bed.client.clear(&anna(), of).unwrap_err();
        assert!(problem.to_string().contains(words), "{problem}");
    };
    refused("volume", SECOND);
    refused("q", "volume-first-memory");
    let id = bed.begin(&to("z", 100.0));
    bed.let_time_pass(0.05);
    let busy = bed.client.clear(&anna(), FIRST).unwrap_err();
    assert_eq!(busy.code, Code::AxisBusy, "{busy}");
    assert_eq!(bed.ended(&id).state, MotionState::Done);
}
