//! Runs that were asked for with a key: which request each of them is, and how it ended.

use core::fmt::Write as _;
use std::collections::{BTreeMap, VecDeque};

use ring::digest;
use serde::{Deserialize, Serialize};

use super::KEPT;
use crate::keeper::utc_now;
use crate::problem::Code;
use crate::request::{RunKind, RunRequest};
use crate::view::{Cause, RunPlanView, RunState, RunView};

/// A run that was asked for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct AskedRun {
    pub(crate) id: String,
    /// The Idempotency-Key.
    key: String,
    by: String,
    at: String,
    kind: RunKind,
    axis: Option<String>,
    /// SHA-256 of the request: paths are long.
    hash: String,
}

impl AskedRun {
    /// One that is asked for now.
    pub(crate) fn now(id: &str, key: &str, by: &str, request: &RunRequest) -> Self {
        Self {
            id: id.to_owned(),
            key: key.to_owned(),
            by: by.to_owned(),
            at: utc_now(),
            kind: request.kind,
            axis: request.axis.clone(),
            hash: hash_of(request),
        }
    }

    /// Whether it was asked for by `request`.
    pub(crate) fn is(&self, request: &RunRequest) -> bool {
        self.hash == hash_of(request)
    }

    /// What is known of it where its end is not.
    fn unended(&self, is_of_earlier_boot: bool) -> RunView {
        let of = self.axis.clone().unwrap_or_default();
        let plan = RunPlanView::default();
        let planned = RunView::planned(&self.id, &self.by, self.kind, (&of, Vec::new()), plan);
        if !is_of_earlier_boot {
            return planned;
        }
        RunView {
            state: RunState::Failed,
            cause: Some(Cause {
                code: Code::ServiceRestarted,
                cause: "the service ended before the end of this run was written down; where it can go on, a run that \
                        is paused has its journal"
                    .into(),
                exit_code: Code::ServiceRestarted.exit_code(),
            }),
            ..planned
        }
    }
}

fn hash_of(request: &RunRequest) -> String {
    // What was read from JSON can be written so.
    let text = serde_json::to_vec(request).unwrap_or_default();
    let mut hash = String::new();
    for byte in digest::digest(&digest::SHA256, &text).as_ref() {
        // To write into a text cannot fail.
        let _ = write!(hash, "{byte:02x}");
    }
    hash
}

/// The runs that were asked for with a key.
#[derive(Debug, Default)]
pub(super) struct KnownRuns {
    /// The oldest first.
    order: VecDeque<String>,
    asked: BTreeMap<String, AskedRun>,
    ended: BTreeMap<String, RunView>,
}

impl KnownRuns {
    pub(super) fn of_key(&self, key: &str) -> Option<&AskedRun> {
        self.asked.values().find(|it| it.key == key)
    }

    pub(super) fn ask(&mut self, asked: AskedRun) {
        self.order.push_back(asked.id.clone());
        self.asked.insert(asked.id.clone(), asked);
        if self.order.len() > KEPT
            && let Some(old) = self.order.front().cloned()
        {
            self.forget(&old);
        }
    }

    /// Its key is free again.
    pub(super) fn forget(&mut self, id: &str) {
        self.order.retain(|it| it != id);
        self.asked.remove(id);
        self.ended.remove(id);
    }

    /// What is to be written down of the end that `view` shows; `None` where that was, or nobody asked with a key.
    pub(super) fn end(&mut self, view: &RunView) -> Option<RunView> {
        let is_told = |it: &RunView| (it.state, it.begun) == (view.state, view.begun);
        if !self.asked.contains_key(&view.id) || self.ended.get(&view.id).is_some_and(is_told) {
            return None;
        }
        let ended = RunView {
            // Its points are in its journal; and nobody goes on with it by this name after a restart.
            reached: Vec::new(),
            can_resume: false,
            ..view.clone()
        };
        self.take_end(ended.clone());
        Some(ended)
    }

    pub(super) fn take_end(&mut self, view: RunView) {
        if self.asked.contains_key(&view.id) {
            self.ended.insert(view.id.clone(), view);
        }
    }

    /// The run `id`, as far as it is known.
    pub(super) fn run(&self, id: &str, is_of_earlier_boot: bool) -> Option<RunView> {
        let ended = self.ended.get(id).cloned();
        ended.or_else(|| Some(self.asked.get(id)?.unended(is_of_earlier_boot)))
    }

    /// All that is known, as it is written: each run with its end.
    pub(super) fn all(&self) -> impl Iterator<Item = (AskedRun, Option<RunView>)> + '_ {
        let asked = self.order.iter().filter_map(|id| self.asked.get(id));
        asked.map(|it| (it.clone(), self.ended.get(&it.id).cloned()))
    }
}
