//! Requests that the ledger keeps, and their ends.

use std::sync::Arc;

use ring::digest;
use serde::{Deserialize, Serialize};

use crate::keeper::utc_now;
use crate::problem::Code;
use crate::random::write_hex;
use crate::request::{MoveRequest, RunKind, RunRequest};
use crate::view::{Cause, MotionState, MotionView, RunPlanView, RunState, RunView};

/// A motion that was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AskedMotion {
    pub(crate) id: String,
    /// The Idempotency-Key, when there was one.
    pub(crate) key: Option<String>,
    pub(crate) by: String,
    pub(crate) at: String,
    pub(crate) request: MoveRequest,
}

/// A run that was asked for with a key.
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

/// A motion, or a run with a key, that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Asked {
    Motion(AskedMotion),
    Run(AskedRun),
}

/// How a motion or run ended.
#[derive(Clone, Debug)]
pub(crate) enum End {
    Motion(Arc<MotionView>),
    Run(Arc<RunView>),
}

impl AskedMotion {
    /// A motion that is asked for now.
    pub(crate) fn now(id: String, key: Option<&str>, by: &str, request: &MoveRequest) -> Self {
        Self {
            id,
            key: key.map(str::to_owned),
            by: by.to_owned(),
            at: utc_now(),
            request: request.clone(),
        }
    }

    /// The motion while its end is not known.
    pub(super) fn unended(&self, is_own: bool) -> MotionView {
        let (state, cause) = match is_own {
            true => (MotionState::Queued, None),
            false => (MotionState::Failed, Some(restarted("motion", ""))),
        };
        MotionView {
            id: self.id.clone(),
            by: self.by.clone(),
            accepted: self.at.clone(),
            state,
            stopped: None,
            cause,
            axes: std::collections::BTreeMap::new(),
            told: None,
            // What is not known by now never will be.
            kept: (!is_own).then_some(true),
        }
    }
}

impl AskedRun {
    /// A run that is asked for now.
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

    /// The run while its end is not known.
    pub(super) fn unended(&self, is_own: bool) -> RunView {
        let axis = self.axis.clone().unwrap_or_default();
        let plan = RunPlanView::default();
        let planned = RunView::planned(&self.id, &self.by, self.kind, (&axis, Vec::new()), plan);
        if is_own {
            return planned;
        }
        let help = "; where it can go on, a run that is paused has its journal";
        RunView {
            state: RunState::Failed,
            cause: Some(restarted("run", help)),
            kept: Some(true),
            ..planned
        }
    }
}

impl Asked {
    pub(super) fn id(&self) -> &str {
        match self {
            Self::Motion(motion) => &motion.id,
            Self::Run(run) => &run.id,
        }
    }

    pub(super) fn key(&self) -> Option<&str> {
        match self {
            Self::Motion(motion) => motion.key.as_deref(),
            Self::Run(run) => Some(&run.key),
        }
    }

    /// When it was asked for, UTC, RFC 3339.
    pub(super) fn at(&self) -> &str {
        match self {
            Self::Motion(motion) => &motion.at,
            Self::Run(run) => &run.at,
        }
    }

    /// Its kind and name, for people.
    pub(super) fn called(&self) -> String {
        match self {
            Self::Motion(motion) => format!("motion {}", motion.id),
            Self::Run(run) => format!("run {}", run.id),
        }
    }

    /// Whether `other` asks for the same.
    pub(super) fn is_same_request(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Motion(own), Self::Motion(other)) => own.request == other.request,
            (Self::Run(own), Self::Run(other)) => own.hash == other.hash,
            (Self::Motion(_), Self::Run(_)) | (Self::Run(_), Self::Motion(_)) => false,
        }
    }
}

impl End {
    pub(super) fn id(&self) -> &str {
        match self {
            Self::Motion(view) => &view.id,
            Self::Run(view) => &view.id,
        }
    }

    /// Whether `other` is the same end. A run may go on, and end again.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Motion(own), Self::Motion(other)) => own.state == other.state,
            (Self::Run(own), Self::Run(other)) => {
                (own.state, own.begun) == (other.state, other.begun)
            }
            (Self::Motion(_), Self::Run(_)) | (Self::Run(_), Self::Motion(_)) => false,
        }
    }
}

/// What of the end of a run outlasts the service: its points are in its journal, and after a restart it goes on under
/// another name.
pub(super) fn lasting(view: &RunView) -> RunView {
    RunView {
        reached: Vec::new(),
        can_resume: false,
        ..view.clone()
    }
}

/// That the end of a `thing` was lost.
fn restarted(thing: &str, help: &str) -> Cause {
    Cause {
        code: Code::ServiceRestarted,
        cause: format!("the service ended before the end of this {thing} was written down{help}"),
        exit_code: Code::ServiceRestarted.exit_code(),
    }
}

fn hash_of(request: &RunRequest) -> String {
    // What was read from JSON can be written so.
    let text = serde_json::to_vec(request).unwrap_or_default();
    write_hex(digest::digest(&digest::SHA256, &text).as_ref())
}
