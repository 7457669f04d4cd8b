//! The SYNC object (CiA 301, 7.2.5).

use crate::can::CanFrame;

/// The default identifier of SYNC (0x1005).
pub const SYNC_COB_ID: u16 = 0x080;

/// A SYNC frame; `counter` is sent when 0x1019 is not 0 and runs from 1 to its value.
///
/// # Example
///
/// ```
/// use wire::canopen::sync::{emit_sync, is_sync};
///
/// assert_eq!(emit_sync(None).to_string(), "080#");
/// assert_eq!(emit_sync(Some(7)).to_string(), "080#07");
/// assert!(is_sync(&emit_sync(None)));
/// ```
pub fn emit_sync(counter: Option<u8>) -> CanFrame {
    match counter {
        Some(counter) => CanFrame::standard(SYNC_COB_ID, &[counter]),
        None => CanFrame::standard(SYNC_COB_ID, &[]),
    }
}

/// Whether `frame` is a SYNC.
pub fn is_sync(frame: &CanFrame) -> bool {
    frame.standard_id() == Some(SYNC_COB_ID) && !frame.is_remote()
}
