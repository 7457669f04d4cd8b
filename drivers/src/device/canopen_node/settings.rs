//! What is set about a node, whatever its profile.

use core::time::Duration;

use crate::protocol::sdo_client::{Retry, Timeouts as SdoTimeouts};
use wire::canopen::NodeId;

/// What the configuration says about a device; `None` accepts anything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExpectedIdentity {
    /// 0x1000, all of it; the profile number in its lower half is always checked.
    pub device_type: Option<u32>,
    /// 0x1018:01.
    pub vendor: Option<u32>,
    /// 0x1018:02.
    pub product: Option<u32>,
    /// 0x1018:03.
    pub revision: Option<u32>,
    /// 0x1018:04.
    pub serial: Option<u32>,
}

/// How long each thing is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeTimeouts {
    /// Boot-up or the first answer: drives take up to 5 s after power-on.
    pub boot: Duration,
    /// One SDO response, and what belongs to it.
    pub sdo: SdoTimeouts,
    /// Operational, and the first process data, after NMT start.
    pub operational: Duration,
}

impl Default for NodeTimeouts {
    fn default() -> Self {
        Self {
            boot: Duration::from_secs(10),
            sdo: SdoTimeouts::default(),
            operational: Duration::from_secs(2),
        }
    }
}

/// What is set about a node, whatever its profile.
///
/// # Example
///
/// A device at which nobody answers.
///
/// ```
/// use drivers::device::canopen_node::NodeSettings;
/// use drivers::device::cia401::{ChannelSettings, Cia401Analog, Cia401Settings};
/// use drivers::device::Device;
/// use std::time::Duration;
/// use units::{Time, Volts};
/// use wire::canopen::NodeId;
///
/// let (node, master) = (NodeId::new(5).expect("1 to 127"), NodeId::new(127).expect("likewise"));
/// let common = NodeSettings::new(node, master, Duration::from_millis(2));
/// let channel = ChannelSettings { input: 1, full_scale: Volts(10.0) };
/// let settings = Cia401Settings::new(common, &[channel]).expect("1 to 4 channels");
/// let mut module = Cia401Analog::new(settings);
/// module.start(Time::ZERO);
/// module.handle_timeout(Time::from_seconds(10.0));
/// let Some(Err(error)) = module.poll_outcome() else { unreachable!("10 s are over") };
/// let text = "node 5: waited 10s for boot-up or an answer to SDO, last saw nothing";
/// assert_eq!(error.to_string(), text);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeSettings {
    /// The node.
    pub node: NodeId,
    /// Us: the producer whose heartbeat the node watches.
    pub master: NodeId,
    /// Who it must be.
    pub expected: ExpectedIdentity,
    /// The node's own heartbeat (0x1017), whole milliseconds.
    pub heartbeat_period: Duration,
    /// Without a heartbeat for this long the node is lost to us.
    pub consumer_time: Duration,
    /// Without our heartbeat for this long we are lost to the node (0x1016:01), which then
    /// stops; zero: the node does not watch us.
    pub master_consumer_time: Duration,
    /// From SYNC to SYNC.
    pub sync_period: Duration,
    /// So many SYNCs without process data are an alarm.
    pub missed_pdos_max: u32,
    /// How often reads and configuration writes are repeated.
    pub retry: Retry,
    /// How long each thing is waited for.
    pub timeouts: NodeTimeouts,
}

impl NodeSettings {
    /// Heartbeats of 50 ms watched for 150 ms, both ways; any identity; two retries.
    pub fn new(node: NodeId, master: NodeId, sync_period: Duration) -> Self {
        Self {
            node,
            master,
            expected: ExpectedIdentity::default(),
            heartbeat_period: Duration::from_millis(50),
            consumer_time: Duration::from_millis(150),
            master_consumer_time: Duration::from_millis(150),
            sync_period,
            missed_pdos_max: 3,
            retry: Retry::UpTo(2),
            timeouts: NodeTimeouts::default(),
        }
    }
}

/// Whole milliseconds, as 0x1016 and 0x1017 hold them.
pub(in crate::device) fn millis(span: Duration) -> u16 {
    u16::try_from(span.as_millis()).unwrap_or(u16::MAX)
}
