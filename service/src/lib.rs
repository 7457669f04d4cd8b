//! One process keeps a machine zeroed, enabled and supervised, and many clients ask it.
//!
//! [`Service::start`] makes a machine on a thread of its own, which ticks for ever; a [`Desk`] takes orders to
//! it and reads what it publishes, from any thread. [Decision
//! 0034](../../docs/decisions/0034-one-process-keeps-the-machine.md) says why it is built this way, with a
//! picture.
//!
//! Quantities go in as a text with a unit (`"12.5mm"`) or as `{"value": 12.5, "unit": "mm"}`, and come out in the
//! second form. Nothing here is a safety function: wire STO.

mod access;
mod coordinate;
mod desk;
mod figures;
mod http;
mod keeper;
mod ledger;
mod manager;
mod order;
mod problem;
mod quantity;
mod random;
mod request;
mod scribe;
mod snapshot;
mod stops;
mod system_log;
mod thread;
mod view;

pub use access::{
    Access, AccessError, AccessFiles, Role, RoleError, SecretError, TlsError, TokenError, add_token,
};
pub use coordinate::Coordinate;
pub use desk::Desk;
pub use figures::{Figures, Minute};
pub use http::{Edge, EdgeError, Listen, ListenError, openapi};
pub use ledger::LedgerError;
pub use manager::Manager;
pub use problem::{Code, Problem, ProblemBody, failure_code};
pub use quantity::{Quantity, Speed};
pub use request::{
    AnswerRequest, ApproachName, Caller, GivenFile, IfMoving, JogRequest, LeaseRequest,
    MoveRequest, PathRows, PathTable, RunKind, RunRequest, StopMode, Target, WayName,
};
pub use thread::{Opened, Service, StartError};
pub use view::{
    AxisState, AxisView, CalibrationView, Cause, ChangeView, ChosenView, DepartureView, Event,
    GroupView, JournalView, LeaseView, Leased, LegView, MachineState, MachineView, MotionState,
    MotionView, QuestionView, RunPlanView, RunState, RunView, Stopped, StorageView, StoredView,
    ToldView,
};
