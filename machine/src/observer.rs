//! Who is told how far a procedure has come.

use core::time::Duration;

use units::Time;

/// The procedures of the cycle, as a person names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Finding the origin.
    Zero,
    /// Taking down what the detectors read.
    Reference,
    /// Measuring to learn the deviations.
    Calibrate,
    /// Measuring to judge.
    Verify,
    /// Going from point to point of a job.
    Job,
}

impl Stage {
    /// For the screen.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Reference => "reference",
            Self::Calibrate => "calibrate",
            Self::Verify => "verify",
            Self::Job => "run",
        }
    }
}

/// Is told about progress.
///
/// # Example
///
/// ```
/// use machine::{Observer, Stage};
///
/// struct Last(String);
///
/// impl Observer for Last {
///     fn progress(&mut self, stage: Stage, axis: &str, done: u64, total: u64) {
///         self.0 = format!("{} {axis}: {done} of {total}", stage.text());
///     }
/// }
///
/// let mut last = Last(String::new());
/// last.progress(Stage::Calibrate, "x", 3, 21);
/// last.warning("nobody has to listen to that");
/// assert_eq!(last.0, "calibrate x: 3 of 21");
/// ```
pub trait Observer {
    /// `done` of `total` steps of `stage` on `axis` are done.
    fn progress(&mut self, stage: Stage, axis: &str, done: u64, total: u64);

    /// A part of `stage` begins that has no steps, and takes so long: a path that is followed.
    fn begins(&mut self, _stage: Stage, _axis: &str, _takes: Duration) {}

    /// The machine is alive at `now` by its clock: told twice a second while anything waits or axes follow a path, so
    /// that nobody need be silent for long. Whoever takes it must not make the machine wait.
    fn lives(&mut self, _now: Time) {}

    /// Something that a person should look after, although the machine goes on.
    fn warning(&mut self, _text: &str) {}

    /// What is waited for or looked for, told while that goes on: nobody should take a machine for
    /// dead that searches.
    fn waiting(&mut self, _text: &str) {}
}

/// Hears nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _stage: Stage, _axis: &str, _done: u64, _total: u64) {}
}
