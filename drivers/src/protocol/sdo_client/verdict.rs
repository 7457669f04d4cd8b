//! What a payload means for a transfer.

use wire::canopen::sdo::{AbortCode, SdoRequest};

/// Why a payload was ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Oddity {
    Mismatched,
    Unexpected,
    Duplicated,
}

/// What a payload means for the transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Taken; more is to come without being asked for.
    Wait,
    Send(SdoRequest),
    Done(Vec<u8>),
    DoneAfter(SdoRequest, Vec<u8>),
    /// The server broke the protocol: abort.
    Break(AbortCode),
    /// The server aborted.
    Aborted(AbortCode),
    /// The server has no block transfer: begin anew, segmented.
    FallBack,
    Ignore(Oddity),
}
