//! What a transfer is asked with and answered by.

use core::time::Duration;

use wire::canopen::Object;
use wire::canopen::sdo::AbortCode;

/// How long each thing is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeouts {
    /// The server's response to a request.
    pub response: Duration,
    /// The next segment of a block that the server sends.
    pub block_segment: Duration,
    /// After a time-out: how late a reply may still come before the next transfer starts.
    pub late_reply: Duration,
    /// After another abort of ours: the silence that must pass before the next transfer.
    pub quiet: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self {
            response: Duration::from_millis(500),
            block_segment: Duration::from_millis(100),
            late_reply: Duration::from_millis(500),
            quiet: Duration::from_millis(20),
        }
    }
}

/// How a value is carried.
///
/// # Example
///
/// ```
/// use drivers::protocol::sdo_client::{Method, SdoClient, Timeouts};
/// use units::Time;
/// use wire::can::CanFrame;
/// use wire::canopen::{NodeId, Object};
///
/// let node = NodeId::new(2).expect("1 to 127");
/// let mut client = SdoClient::new(node, Timeouts::default());
/// client.read(Time::ZERO, Object::new(0x1000, 0), Method::Auto)?;
/// let asked = client.poll_transmit().map(|it| it.to_string());
/// assert_eq!(asked, Some("602#4000100000000000".into()));
/// let answer = CanFrame::standard(0x582, &[0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]);
/// client.handle_frame(Time::from_seconds(0.001), &answer);
/// assert_eq!(client.poll_outcome(), Some(Ok(vec![0x92, 0x01, 0x02, 0x00])));
/// # Ok::<(), drivers::protocol::sdo_client::Busy>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// Expedited up to 4 bytes, segmented above.
    Auto,
    /// Block transfer; segmented when the server knows no block transfer.
    Block,
}

/// How often a failed transfer is repeated.
///
/// # Example
///
/// ```
/// use drivers::protocol::sdo_client::{Method, Retry, SdoClient, Timeouts};
/// use units::Time;
/// use wire::canopen::{NodeId, Object};
///
/// let node = NodeId::new(2).expect("1 to 127");
/// let mut client = SdoClient::new(node, Timeouts::default()).with_retry(Retry::Never);
/// client.read(Time::ZERO, Object::new(0x1008, 0), Method::Auto)?;
/// client.poll_transmit();
/// client.handle_timeout(client.poll_timeout());
/// let Some(Err(failure)) = client.poll_outcome() else { unreachable!("nobody answered") };
/// let text = "0x1008:00: no answer to a read within 500ms (1 attempt)";
/// assert_eq!(failure.to_string(), text);
/// let abort = client.poll_transmit().map(|it| it.to_string());
/// assert_eq!(abort, Some("602#8008100000000405".into()));
/// # Ok::<(), drivers::protocol::sdo_client::Busy>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Retry {
    /// Not at all.
    Never,
    /// At most this many times after the first attempt.
    UpTo(u32),
}

impl Retry {
    pub(super) const fn attempts(self) -> u32 {
        match self {
            Self::Never => 1,
            Self::UpTo(more) => more.saturating_add(1),
        }
    }
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the Display text says what each field is")]
pub enum SdoFailure {
    /// The server aborted it.
    #[error("{object}: the server aborted with {code}")]
    Aborted { object: Object, code: AbortCode },
    /// The server did not answer; it was told so by an abort.
    #[error("{object}: no {awaited} within {waited:?} ({})", units::Several(*attempts, "attempt"))]
    TimedOut {
        object: Object,
        awaited: &'static str,
        waited: Duration,
        attempts: u32,
    },
    /// The server broke the protocol and was aborted.
    #[error("{object}: aborted by this controller with {code} ({})", units::Several(*attempts, "attempt"))]
    Protocol {
        object: Object,
        code: AbortCode,
        attempts: u32,
    },
}

impl SdoFailure {
    /// Whether the wire or the moment rather than the object dictionary is to blame, so that a
    /// second attempt may go better.
    pub(super) const fn is_transient(&self) -> bool {
        match *self {
            Self::TimedOut { .. } | Self::Protocol { .. } => true,
            Self::Aborted { code, .. } => {
                matches!(
                    code,
                    AbortCode::ToggleNotAlternated
                        | AbortCode::TimedOut
                        | AbortCode::InvalidSequence
                        | AbortCode::CrcMismatch
                ) || is_busy(code)
            }
        }
    }
}

/// Frames that were ignored, by reason, and what was done about trouble.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Nothing was pending.
    pub stale: u64,
    /// For another object.
    pub mismatched: u64,
    /// Fewer than 8 bytes.
    pub short: u64,
    /// Of a kind that the transfer does not expect now.
    pub unexpected: u64,
    /// A repetition of what was taken already.
    pub duplicated: u64,
    /// After an own abort, before the next transfer.
    pub late: u64,
    /// Aborts sent.
    pub aborts_sent: u64,
    /// Transfers begun anew.
    pub retries: u64,
}

/// A transfer was asked for while another one runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an SDO transfer with this server is already running")]
pub struct Busy;

/// Whether the server cannot just now: worth another attempt after a pause.
pub(super) const fn is_busy(code: AbortCode) -> bool {
    matches!(
        code,
        AbortCode::DeviceState | AbortCode::LocalControl | AbortCode::NoResource
    )
}
