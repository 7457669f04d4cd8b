//! A list of SDO transfers, done one after the other; each step has a text for a person.
//!
//! A device's start procedure is such a list: read, expect, write, write and read back. A step
//! that fails ends the script; a step whose object need not exist is passed over when the
//! server says so (abort 0x06020000 or 0x06090011).

use std::collections::VecDeque;

use units::Time;
use wire::canopen::Object;
use wire::canopen::sdo::AbortCode;

use super::sdo_client::{Method, SdoClient, SdoFailure};

/// An integer of 1 to 8 bytes, as an object holds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value {
    bytes: [u8; 8],
    len: u8,
}

macro_rules! from_integers {
    ($($type:ty),*) => {
        $(
            /// Little-endian, with the length of the type.
            impl From<$type> for Value {
                fn from(value: $type) -> Self {
                    Self::new(&value.to_le_bytes())
                }
            }
        )*
    };
}

from_integers!(u8, i8, u16, i16, u32, i32);

impl Value {
    fn new(data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        let len = data.len().min(8);
        bytes[..len].copy_from_slice(&data[..len]);
        Self {
            bytes,
            len: len as u8,
        }
    }

    /// The bytes that go on the wire.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }

    /// The value as an unsigned number.
    pub const fn raw(&self) -> u64 {
        u64::from_le_bytes(self.bytes)
    }
}

/// What one step does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Read and keep; see [`Script::value`].
    Read,
    /// Read; anything else than this value is an error.
    Expect(Value),
    /// Write.
    Write(Value),
    /// Write, read back, compare the bits of `mask`.
    WriteAndCheck {
        /// What is written.
        value: Value,
        /// The bits the device may not change.
        mask: u64,
    },
}

/// Whether an object must exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// Its absence is an error.
    Required,
    /// Its absence is noted.
    Optional,
    /// Whatever the server answers in place of a value is taken for its absence.
    Informative,
}

/// One step of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The object it is about.
    pub object: Object,
    /// What it does.
    pub action: Action,
    /// Whether the object must exist.
    pub presence: Presence,
    /// What a person reads when it fails: "while ...".
    pub text: &'static str,
}

impl Step {
    const fn new(object: Object, action: Action, text: &'static str) -> Self {
        Self {
            object,
            action,
            presence: Presence::Required,
            text,
        }
    }

    /// Read and keep.
    pub const fn read(object: Object, text: &'static str) -> Self {
        Self::new(object, Action::Read, text)
    }

    /// Read and compare.
    pub fn expect(object: Object, value: impl Into<Value>, text: &'static str) -> Self {
        Self::new(object, Action::Expect(value.into()), text)
    }

    /// Write only.
    pub fn write(object: Object, value: impl Into<Value>, text: &'static str) -> Self {
        Self::new(object, Action::Write(value.into()), text)
    }

    /// Write and read back.
    pub fn check(object: Object, value: impl Into<Value>, text: &'static str) -> Self {
        Self::check_bits(object, value, u64::MAX, text)
    }

    /// Write and read back, comparing only the bits of `mask`.
    pub fn check_bits(
        object: Object,
        value: impl Into<Value>,
        mask: u64,
        text: &'static str,
    ) -> Self {
        let value = value.into();
        Self::new(object, Action::WriteAndCheck { value, mask }, text)
    }

    /// The same step for an object that need not exist.
    #[must_use]
    pub const fn optional(mut self) -> Self {
        self.presence = Presence::Optional;
        self
    }

    /// The same step for an object that only informs: some servers abort with codes of their own
    /// where an object is missing.
    #[must_use]
    pub const fn informative(mut self) -> Self {
        self.presence = Presence::Informative;
        self
    }
}

/// Why a script ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScriptFailure {
    /// The object of the step.
    pub object: Object,
    /// The text of the step.
    pub text: &'static str,
    /// What went wrong.
    pub cause: ScriptCause,
}

/// What went wrong in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScriptCause {
    /// The transfer failed.
    Sdo(SdoFailure),
    /// Another value than expected was read (back).
    Differs {
        /// What was written or expected.
        expected: u64,
        /// What was read.
        seen: u64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The next transfer is to be begun.
    Ready,
    Reading,
    Writing,
    /// Written; the read-back is to be begun.
    Written,
}

/// A script on its way.
///
/// # Example
///
/// ```
/// use drivers::protocol::script::{Script, ScriptCause, Step};
/// use drivers::protocol::sdo_client::{SdoClient, Timeouts};
/// use units::Time;
/// use wire::can::CanFrame;
/// use wire::canopen::{NodeId, Object};
///
/// let node = NodeId::new(5).expect("1 to 127");
/// let mut client = SdoClient::new(node, Timeouts::default());
/// let window = Object::new(0x6067, 0);
/// let mut script = Script::new([Step::check(window, 9_u32, "setting the position window")]);
/// // Written, and read back as 8.
/// for answer in [[0x60, 0x67, 0x60, 0, 0, 0, 0, 0], [0x43, 0x67, 0x60, 0, 8, 0, 0, 0]] {
///     assert_eq!(script.poll(Time::ZERO, &mut client), None);
///     client.poll_transmit();
///     client.handle_frame(Time::ZERO, &CanFrame::standard(0x585, &answer));
/// }
/// let failure = script.poll(Time::ZERO, &mut client).and_then(Result::err);
/// assert_eq!(failure.map(|it| it.cause), Some(ScriptCause::Differs { expected: 9, seen: 8 }));
/// ```
#[derive(Debug)]
pub struct Script {
    steps: VecDeque<Step>,
    phase: Phase,
    values: Vec<(Object, Vec<u8>)>,
}

impl Script {
    /// A script of these steps.
    pub fn new(steps: impl IntoIterator<Item = Step>) -> Self {
        Self {
            steps: steps.into_iter().collect(),
            phase: Phase::Ready,
            values: Vec::new(),
        }
    }

    /// What was read from `object`, in this script; `None` when it was absent.
    pub fn data(&self, object: Object) -> Option<&[u8]> {
        self.values
            .iter()
            .rev()
            .find(|(of, _)| *of == object)
            .map(|(_, data)| data.as_slice())
    }

    /// All that was read from `object`, in order, as unsigned numbers of at most 32 bits.
    pub fn values(&self, object: Object) -> impl Iterator<Item = u32> + '_ {
        let of = self.values.iter().filter(move |(of, _)| *of == object);
        of.map(|(_, data)| Value::new(data).raw() as u32)
    }

    /// What was read from `object` last, as an unsigned number of at most 32 bits.
    pub fn value(&self, object: Object) -> Option<u32> {
        self.data(object).map(|data| Value::new(data).raw() as u32)
    }

    /// Goes on: takes the client's outcome and begins the next transfer. Call it after every
    /// frame and time-out the client was given; no other user may share the client meanwhile.
    /// `Some` when the script is done.
    pub fn poll(&mut self, now: Time, client: &mut SdoClient) -> Option<Result<(), ScriptFailure>> {
        loop {
            let Some(step) = self.steps.front().copied() else {
                return Some(Ok(()));
            };
            match self.phase {
                Phase::Reading | Phase::Writing => {
                    let outcome = client.poll_outcome()?;
                    if let Err(cause) = self.take(step, outcome) {
                        self.steps.clear();
                        return Some(Err(ScriptFailure {
                            object: step.object,
                            text: step.text,
                            cause,
                        }));
                    }
                }
                Phase::Ready | Phase::Written => {
                    if self.begin(now, step, client).is_err() {
                        return None;
                    }
                }
            }
        }
    }

    fn begin(
        &mut self,
        now: Time,
        step: Step,
        client: &mut SdoClient,
    ) -> Result<(), super::sdo_client::Busy> {
        let to_write = match step.action {
            Action::Read | Action::Expect(_) => None,
            Action::Write(value) | Action::WriteAndCheck { value, .. } => {
                (self.phase == Phase::Ready).then_some(value)
            }
        };
        // Configuration values may be written twice without harm.
        match to_write {
            Some(value) => {
                client.write_idempotent(now, step.object, value.bytes(), Method::Auto)?;
                self.phase = Phase::Writing;
            }
            None => {
                client.read(now, step.object, Method::Auto)?;
                self.phase = Phase::Reading;
            }
        }
        Ok(())
    }

    fn take(
        &mut self,
        step: Step,
        outcome: Result<Vec<u8>, SdoFailure>,
    ) -> Result<(), ScriptCause> {
        let data = match outcome {
            Ok(data) => data,
            Err(failure) if is_noted(step.presence, &failure) => {
                self.done();
                return Ok(());
            }
            Err(failure) => return Err(ScriptCause::Sdo(failure)),
        };
        match (step.action, self.phase) {
            (Action::WriteAndCheck { .. }, Phase::Writing) => self.phase = Phase::Written,
            (Action::Write(_), _) => self.done(),
            (Action::Read, _) => {
                self.values.push((step.object, data));
                self.done();
            }
            (Action::Expect(value), _) => {
                compare(value, u64::MAX, &data)?;
                self.done();
            }
            (Action::WriteAndCheck { value, mask }, _) => {
                compare(value, mask, &data)?;
                self.done();
            }
        }
        Ok(())
    }

    fn done(&mut self) {
        self.steps.pop_front();
        self.phase = Phase::Ready;
    }
}

/// Whether a step without its object is passed over.
fn is_noted(presence: Presence, failure: &SdoFailure) -> bool {
    match presence {
        Presence::Required => false,
        Presence::Optional => is_absence(failure),
        Presence::Informative => matches!(failure, SdoFailure::Aborted { .. }),
    }
}

const fn is_absence(failure: &SdoFailure) -> bool {
    match failure {
        SdoFailure::Aborted { code, .. } => {
            matches!(code, AbortCode::NoSuchObject | AbortCode::NoSuchSubIndex)
        }
        SdoFailure::TimedOut { .. } | SdoFailure::Protocol { .. } => false,
    }
}

/// A server that does not indicate the size answers with 4 bytes: only the value's own count.
fn compare(expected: Value, mask: u64, data: &[u8]) -> Result<(), ScriptCause> {
    let own = data.len().min(usize::from(expected.len));
    let seen = Value::new(&data[..own]);
    let same = seen.raw() & mask == expected.raw() & mask && !data.is_empty();
    if same {
        Ok(())
    } else {
        Err(ScriptCause::Differs {
            expected: expected.raw(),
            seen: Value::new(data).raw(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::sdo_client::Timeouts;
    use wire::can::CanFrame;
    use wire::canopen::NodeId;

    const OBJECT: Object = Object::new(0x6067, 0);

    /// Runs one step; each request is answered with the next payload.
    #[track_caller]
    fn run(step: Step, answers: &[[u8; 8]]) -> (Script, Option<Result<(), ScriptFailure>>) {
        let node = NodeId::new(5).unwrap();
        let mut client = SdoClient::new(node, Timeouts::default());
        let mut script = Script::new([step]);
        let mut result = script.poll(Time::ZERO, &mut client);
        for answer in answers {
            assert_eq!(result, None);
            assert!(client.poll_transmit().is_some(), "a request is due");
            client.handle_frame(Time::ZERO, &CanFrame::standard(0x585, answer));
            result = script.poll(Time::ZERO, &mut client);
        }
        (script, result)
    }

    const WRITTEN: [u8; 8] = [0x60, 0x67, 0x60, 0, 0, 0, 0, 0];
    const ABSENT: [u8; 8] = [0x80, 0x67, 0x60, 0, 0x00, 0x00, 0x02, 0x06];

    const fn value(command: u8, value: u8) -> [u8; 8] {
        [command, 0x67, 0x60, 0, value, 0, 0, 0]
    }

    #[test]
    fn a_value_read_is_kept() {
        let (script, result) = run(Step::read(OBJECT, "reading"), &[value(0x4B, 9)]);
        assert_eq!(result, Some(Ok(())));
        assert_eq!(script.value(OBJECT), Some(9));
        assert_eq!(script.data(OBJECT), Some(&[9, 0][..]));
    }

    #[test]
    fn a_checked_write_is_read_back() {
        let step = Step::check(OBJECT, 9_u32, "writing");
        let (_, result) = run(step, &[WRITTEN, value(0x43, 9)]);
        assert_eq!(result, Some(Ok(())));
        let (_, result) = run(step, &[WRITTEN, value(0x43, 8)]);
        let cause = ScriptCause::Differs {
            expected: 9,
            seen: 8,
        };
        assert_eq!(result.unwrap().unwrap_err().cause, cause);
    }

    #[test]
    fn bits_outside_the_mask_may_differ() {
        let step = Step::check_bits(OBJECT, 9_u32, 0x0F, "writing");
        let (_, result) = run(step, &[WRITTEN, value(0x43, 0x79)]);
        assert_eq!(result, Some(Ok(())));
    }

    #[test]
    fn a_server_that_does_not_indicate_sizes_is_compared_by_the_values_own_bytes() {
        let step = Step::expect(OBJECT, 9_u8, "expecting");
        let (_, result) = run(step, &[[0x42, 0x67, 0x60, 0, 9, 0xAA, 0xBB, 0xCC]]);
        assert_eq!(result, Some(Ok(())));
    }

    #[test]
    fn an_absent_object_ends_the_script_unless_it_is_optional() {
        let step = Step::read(OBJECT, "reading");
        let (_, result) = run(step, &[ABSENT]);
        assert_eq!(result.unwrap().unwrap_err().object, OBJECT);
        let (script, result) = run(step.optional(), &[ABSENT]);
        assert_eq!(result, Some(Ok(())));
        assert_eq!(script.value(OBJECT), None);
    }

    #[test]
    fn another_abort_ends_the_script_even_if_the_object_is_optional() {
        let step = Step::write(OBJECT, 9_u32, "writing").optional();
        let busy = [0x80, 0x67, 0x60, 0, 0x22, 0x00, 0x00, 0x08];
        let (_, result) = run(step, &[busy]);
        assert!(result.unwrap().is_err());
    }
}
