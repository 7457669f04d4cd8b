//! Whether two devices answer to one node identifier.
//!
//! At the start both answer every question, and their serial numbers differ. Later one of them
//! boots while the other goes on: a boot-up message, and yet process data at the next SYNC,
//! which no device that was reset sends before it is started.

use wire::can::CanFrame;
use wire::canopen::sdo::SdoResponse;
use wire::canopen::{Function, NodeId};

const IDENTITY: u16 = 0x1018;

/// What was answered since the start.
#[derive(Debug)]
pub(super) struct Twins {
    node: NodeId,
    /// 0x1018:01 to :04.
    identity: [Option<u32>; 4],
}

impl Twins {
    pub(super) const fn new(node: NodeId) -> Self {
        Self {
            node,
            identity: [None; 4],
        }
    }

    pub(super) const fn forget(&mut self) {
        self.identity = [None; 4];
    }

    /// Whether this answer contradicts an earlier one.
    pub(super) fn contradicts(&mut self, frame: &CanFrame) -> bool {
        if frame.standard_id() != Some(self.node.cob_id(Function::SdoResponse)) {
            return false;
        }
        let Ok(SdoResponse::UploadExpedited { object, data }) = SdoResponse::parse(frame.data())
        else {
            return false;
        };
        if object.index != IDENTITY || !(1..=4).contains(&object.sub) {
            return false;
        }
        let mut bytes = [0; 4];
        bytes[..data.data().len()].copy_from_slice(data.data());
        let seen = u32::from_le_bytes(bytes);
        let known = &mut self.identity[usize::from(object.sub) - 1];
        seen != *known.get_or_insert(seen)
    }
}
