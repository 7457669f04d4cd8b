//! What is run on a machine of whatever kind for those who do not have it in their hands: said beforehand, with
//! somebody who is asked meanwhile, and told at the end.
//!
//! A kind says what of a machine it runs as one ([`Group`]), and does it, by the same procedures as the verbs of the
//! command line: `runs.rs` in its folder. [`groups`](crate::groups) lists what a machine has.

mod choice;
mod data_file;
mod group;
mod job;
mod path;
mod person;
mod planned;
mod task;
mod teller;
mod together;

pub use choice::{Change, Choice};
pub use data_file::DataFile;
pub use group::{Group, Moved};
pub use job::{AskedJob, JobJudge, JudgedJob};
pub use path::{JudgedPath, PathJudge};
pub(crate) use person::DriveState;
pub use person::{Person, Question};
pub(crate) use planned::standing;
pub use planned::{Planned, Travel};
pub use task::{Found, Task};
pub use teller::{Teller, Told};
pub use together::{GroupMove, GroupMoved, Judge, Part, PartMoved, Place};

pub(crate) use choice::{each_usable, write};
pub(crate) use group::GroupRuns;
pub(crate) use task::Work;
#[cfg(feature = "program")]
pub(crate) use teller::Words;
pub(crate) use together::{GroupMoves, Judging, NotMoved};
