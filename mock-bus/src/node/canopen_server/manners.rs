//! How badly a node behaves, and how often it did.
//!
//! Every fault that real servers were seen to commit is a quota here: the next `n`
//! opportunities are spoilt, then the node is polite again. Each delivery is counted, so that
//! a test can prove that the fault it asked for really happened.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::named_objects::{ChangedWrite, NamedObject};

/// What a node does wrong; the default is nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Manners {
    /// Spoil only transfers of this index; every transfer when absent.
    pub sdo_only_index: Option<u16>,
    /// Every SDO response comes this much later.
    pub sdo_response_delay_us: u64,
    /// So many responses are held back by `sdo_late_reply_ms`: longer than the client waits.
    pub sdo_late_replies: u32,
    /// How long a late reply is held back.
    pub sdo_late_reply_ms: u64,
    /// So many responses are sent twice.
    pub sdo_duplicate_responses: u32,
    /// So many segment responses carry the wrong toggle bit.
    pub sdo_wrong_toggles: u32,
    /// So many responses name the next index instead of the one asked for.
    pub sdo_wrong_indices: u32,
    /// So many responses are preceded by a stray one for the next index.
    pub sdo_stray_replies: u32,
    /// So many responses have three bytes.
    pub sdo_short_replies: u32,
    /// So many segmented or block uploads announce 79 bytes more than they deliver.
    pub sdo_wrong_sizes: u32,
    /// Segmented uploads do not say how long they are.
    pub sdo_sizes_omitted: bool,
    /// The unused bytes of expedited uploads are not 0.
    pub sdo_stale_bytes: bool,
    /// So many downloads are refused with 0x08000022.
    pub sdo_busy: u32,
    /// So many requests are executed but not answered.
    pub sdo_lost_replies: u32,
    /// So many requests are neither executed nor answered.
    pub sdo_ignored_requests: u32,
    /// So many segments of block uploads are lost.
    pub sdo_lost_block_segments: u32,
    /// So many times an abort by the client is followed by eight stale segments.
    pub sdo_floods_after_abort: u32,
    /// Storing parameters (0x1010) takes this long before it is answered.
    pub store_delay_ms: u64,
    /// So many writes of mapping entries are confirmed and not done.
    pub mapping_ignored_writes: u32,
    /// TPDOs carry their first two mapped objects exchanged, whatever the mapping says.
    pub mapping_lies: bool,
    /// So many TPDOs are not sent.
    pub tpdo_drops: u32,
    /// No TPDO is sent at all, while the heartbeat goes on.
    pub tpdo_mute: bool,
    /// No heartbeat is sent, while everything else goes on.
    pub heartbeat_mute: bool,
    /// Expedited uploads do not say how many bytes they have.
    pub sdo_size_bit_omitted: bool,
    /// Expedited uploads say that they have four bytes, whatever the object has.
    pub sdo_always_four_bytes: bool,
    /// Block transfers are refused.
    pub sdo_blocks_refused: bool,
    /// Objects that are not there for a master.
    pub absent_objects: Vec<NamedObject>,
    /// The abort code for objects that are not there, in place of the standard's.
    pub absent_abort_code: Option<u32>,
    /// Objects that can be written in most nodes and not in this one.
    pub read_only_objects: Vec<NamedObject>,
    /// COB-IDs of PDOs can be switched on and off only.
    pub pdo_identifiers_fixed: bool,
    /// Objects whose written values are rounded or cut.
    pub changed_writes: Vec<ChangedWrite>,
    /// 0x607D:01 is refused as long as 0x607D:02 was not written.
    pub upper_soft_limit_first: bool,
    /// The node says a second time, so long after the first, that it has booted.
    pub boots_twice_after_ms: u64,
    /// At power-on it produces SYNC itself with this period, until bit 30 of 0x1005 is cleared.
    pub own_sync_ms: u32,
    /// 0x1019 at power-on: a SYNC must carry a counter when it is 2 or more.
    pub sync_counter_overflow: u8,
    /// The node has neither 0x1016 nor 0x1017, and is guarded by 0x100C and 0x100D.
    pub node_guarding_only: bool,
}

/// Deliveries by the name of the key in [`Manners`], or in the device's own faults, that asked
/// for them.
pub type Deliveries = BTreeMap<&'static str, u64>;

/// The manners that are left, and what was delivered.
#[derive(Clone, Debug, Default)]
pub(super) struct Rudeness {
    pub(super) left: Manners,
    pub(super) delivered: Deliveries,
    /// 0x607D:02 was written.
    pub(super) upper_limit_written: bool,
}

impl Rudeness {
    pub(super) fn new(manners: Manners) -> Self {
        Self {
            left: manners,
            delivered: Deliveries::new(),
            upper_limit_written: false,
        }
    }

    /// Whether transfers of `index` may be spoilt.
    pub(super) fn concerns(&self, index: u16) -> bool {
        self.left.sdo_only_index.is_none_or(|only| only == index)
    }

    /// Uses up one delivery of a quota.
    pub(super) fn take(&mut self, name: &'static str, quota: fn(&mut Manners) -> &mut u32) -> bool {
        let left = quota(&mut self.left);
        if *left == 0 {
            return false;
        }
        *left -= 1;
        self.count(name);
        true
    }

    /// Delivers where a switch is on.
    pub(super) fn switched(&mut self, name: &'static str, switch: fn(&Manners) -> bool) -> bool {
        let on = switch(&self.left);
        if on {
            self.count(name);
        }
        on
    }

    /// How long the response is held back.
    pub(super) fn delay(&mut self) -> Duration {
        let base = Duration::from_micros(self.left.sdo_response_delay_us);
        if !base.is_zero() {
            self.count("sdo_response_delay_us");
        }
        if self.take("sdo_late_replies", |m| &mut m.sdo_late_replies) {
            return base + Duration::from_millis(self.left.sdo_late_reply_ms);
        }
        base
    }

    pub(super) fn count(&mut self, name: &'static str) {
        *self.delivered.entry(name).or_default() += 1;
    }
}
