//! What goes to the machine's thread, and what comes back.

use core::sync::atomic::{AtomicIsize, Ordering};
use std::path::PathBuf;
use std::sync::Arc;

use tokio::sync::oneshot;
use truestage::runs::{Change, Choice, DataFile, JudgedJob, JudgedPath};

use crate::problem::Problem;
use crate::request::{
    AnswerRequest, Caller, JogRequest, LeaseRequest, MoveRequest, RunRequest, StopMode,
};
use crate::stops::Arrival;
use crate::view::Leased;

/// What is asked of the machine's thread.
#[derive(Clone, Debug)]
pub(crate) enum Order {
    /// A motion under the name that it is to have.
    Move { id: String, request: MoveRequest },
    /// A jog under the name that it is to have, or one more proof that somebody holds the key.
    Jog { id: String, request: JogRequest },
    /// The dead-man of a motion still holds.
    Renew { motion: String },
    /// Everything stops.
    Stop { mode: StopMode },
    /// What a failure stopped may be used again.
    Reset,
    /// Switches an axis on or off.
    Power { axis: String, on: bool },
    /// A run under the name that it is to have.
    Plan {
        id: String,
        /// Apart: no other order is nearly as large.
        request: Box<RunRequest>,
        /// What it follows or does, where that is in the request.
        judged: Option<Judged>,
    },
    /// A planned run begins.
    Start { run: String },
    /// A run ends.
    Abort { run: String },
    /// A run ends where it is, to go on later.
    Pause { run: String },
    /// A run that ended before its result goes on.
    Resume { run: String },
    /// A person answers the question of a run.
    Answer {
        run: String,
        answer: AnswerRequest,
        /// Whether whoever answers may say more than the words of the question.
        text: Result<(), Problem>,
    },
    /// Who may command; the token is what the holder is given.
    Lease {
        request: LeaseRequest,
        token: String,
    },
    /// Another calibration is used from now on.
    Calibration(Choice),
    /// The lease goes back.
    Release,
    /// The holder of the lease still waits for something.
    KeepLease,
    /// Something that a person should look after is said among the events.
    Warn { text: String },
    /// The service ends.
    End,
}

impl Order {
    /// Whether it could move an axis or switch one on: a stop that arrived after it voids it.
    pub(crate) fn is_voided_by_stop(&self) -> bool {
        match self {
            Self::Move { .. }
            | Self::Reset
            | Self::Start { .. }
            | Self::Resume { .. }
            | Self::Answer { .. } => true,
            Self::Jog { request, .. } => request.speed.0.value() != 0.0,
            Self::Power { on, .. } => *on,
            Self::Plan { request, .. } => request.start,
            Self::Stop { .. }
            | Self::Renew { .. }
            | Self::Abort { .. }
            | Self::Pause { .. }
            | Self::Lease { .. }
            | Self::Calibration(_)
            | Self::Release
            | Self::KeepLease
            | Self::Warn { .. }
            | Self::End => false,
        }
    }

    /// Whether only the holder of the lease may ask for it.
    pub(crate) const fn needs_lease(&self) -> bool {
        match self {
            Self::Stop { .. }
            | Self::Lease { .. }
            | Self::Release
            | Self::KeepLease
            | Self::Warn { .. }
            | Self::End => false,
            Self::Move { .. }
            | Self::Jog { .. }
            | Self::Renew { .. }
            | Self::Reset
            | Self::Power { .. }
            | Self::Plan { .. }
            | Self::Start { .. }
            | Self::Abort { .. }
            | Self::Pause { .. }
            | Self::Resume { .. }
            | Self::Answer { .. }
            | Self::Calibration(_) => true,
        }
    }
}

/// What a run goes along, judged before it is planned.
#[derive(Clone, Debug)]
pub(crate) enum Judged {
    Path {
        path: JudgedPath,
        /// The group that follows it.
        group: String,
    },
    Job {
        job: JudgedJob,
        /// It goes on with this journal.
        resume: Option<PathBuf>,
    },
    /// What was measured or designed elsewhere.
    Files {
        files: Vec<DataFile>,
        /// It goes on with this journal.
        resume: Option<PathBuf>,
    },
}

impl Judged {
    /// The journal that it goes on with.
    pub(crate) fn resume(&self) -> Option<&PathBuf> {
        match self {
            Self::Job { resume, .. } | Self::Files { resume, .. } => resume.as_ref(),
            Self::Path { .. } => None,
        }
    }
}

/// What an order that was carried out comes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// It is done, or goes on under its name.
    Done,
    /// The motion that a jog is.
    Named(String),
    /// What is used from now on, and by which axes.
    Chosen(Vec<Change>, Vec<String>, Option<String>),
    /// The lease.
    Leased(Leased),
}

/// Whether it is carried out.
pub(crate) type Answered = Result<Answer, Problem>;

/// The place for an answer; while it is there, the order counts as unanswered.
#[derive(Debug)]
pub(crate) struct Reply {
    sender: Option<oneshot::Sender<Answered>>,
    unanswered: Unanswered,
}

/// How many orders are without an answer. Below zero while one is answered before it was counted.
pub(crate) type Unanswered = Arc<AtomicIsize>;

impl Reply {
    /// One of those that share `unanswered`, and where its answer comes. Whoever gives it away counts it then, and not
    /// before: whoever sees it counted can rely on it that its order is on its way.
    pub(crate) fn new(unanswered: &Unanswered) -> (Self, oneshot::Receiver<Answered>) {
        let (sender, answer) = oneshot::channel();
        let reply = Self {
            sender: Some(sender),
            unanswered: Arc::clone(unanswered),
        };
        (reply, answer)
    }

    /// Whoever asked may have gone: that is no reason to do anything else.
    pub(crate) fn send(mut self, answered: Answered) {
        if let Some(sender) = self.sender.take() {
            let _ = sender.send(answered);
        }
    }
}

impl Drop for Reply {
    fn drop(&mut self) {
        self.unanswered.fetch_sub(1, Ordering::SeqCst);
    }
}

/// An order on its way.
#[derive(Debug)]
pub(crate) struct Letter {
    pub(crate) order: Order,
    pub(crate) caller: Caller,
    /// When it was asked for.
    pub(crate) arrival: Arrival,
    pub(crate) reply: Reply,
}
