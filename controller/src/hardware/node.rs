//! What CANopen nodes have in common, whatever they are: keys, what these must keep to, settings.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::Identity;
use drivers::device::canopen_node::{ExpectedIdentity, NodeSettings, NodeTimeouts};
use drivers::protocol::sdo_client::Timeouts as SdoTimeouts;
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use wire::canopen::NodeId;

use super::bus::CanBus;
use super::{CHECKED, millis};
use crate::config::judge::Judge;

/// Who a CANopen node must be.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentityConfig {
    /// 0x1000.
    #[schemars(extend("x-own" = true))]
    pub device_type: u32,
    /// 0x1018:01.
    #[schemars(extend("x-own" = true))]
    pub vendor_id: u32,
    /// 0x1018:02.
    #[schemars(extend("x-own" = true))]
    pub product_code: u32,
    /// 0x1018:03.
    #[schemars(extend("x-own" = true))]
    pub revision: Option<u32>,
    /// 0x1018:04.
    #[schemars(extend("x-own" = true))]
    pub serial_number: Option<u32>,
}

impl IdentityConfig {
    /// The same as a driver says it, as far as the configuration does.
    pub fn configured(&self) -> Identity {
        Identity {
            device_type: self.device_type,
            vendor: self.vendor_id,
            product: self.product_code,
            revision: self.revision.unwrap_or(0),
            serial: self.serial_number.unwrap_or(0),
            name: String::new(),
        }
    }
}

/// What every node on CAN has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct NodeConfig {
    /// The bus that it is on.
    #[schemars(extend("x-range" = "a `[can.NAME]`"))]
    pub bus: String,
    /// Its number there; no two nodes of a bus have the same.
    #[schemars(range(min = 1, max = 127))]
    #[schemars(extend("x-own" = true))]
    pub node_id: u8,
    /// Period of its heartbeat (0x1017).
    #[schemars(range(min = 5, max = 10000))]
    pub heartbeat_producer_ms: u16,
    /// Without a heartbeat for this long it counts as lost.
    #[schemars(extend("x-range" = "at least 2 × `heartbeat_producer_ms`"))]
    pub heartbeat_consumer_ms: u16,
    /// Without the controller's heartbeat for this long (0x1016) a drive stops by itself, and a
    /// module knows.
    #[schemars(extend("x-range" = "at least 2 × `master_heartbeat_ms`"))]
    pub watch_master_ms: u16,
    /// Who it must be.
    pub identity: IdentityConfig,
}

impl NodeConfig {
    /// What its driver is told of it; the configuration has been checked.
    pub(crate) fn settings(
        &self,
        can: &BTreeMap<String, CanBus>,
        patience: Patience,
    ) -> NodeSettings {
        let heartbeats = (
            self.heartbeat_producer_ms,
            self.heartbeat_consumer_ms,
            self.watch_master_ms,
        );
        let bus = &can[&self.bus];
        node_settings(self.node_id, bus, &self.identity, heartbeats, patience)
    }

    /// Judges what its keys must keep to together.
    pub(crate) fn check(&self, judge: &mut Judge<'_>, can: &BTreeMap<String, CanBus>) {
        let heartbeats = [
            self.heartbeat_producer_ms,
            self.heartbeat_consumer_ms,
            self.watch_master_ms,
        ];
        check_node(judge, can, &self.bus, heartbeats);
    }
}

pub(crate) fn node_id(raw: u8) -> NodeId {
    NodeId::new(raw).expect(CHECKED)
}

pub(crate) fn node_settings(
    node: u8,
    bus: &CanBus,
    identity: &IdentityConfig,
    heartbeat_ms: (u16, u16, u16),
    patience: Patience,
) -> NodeSettings {
    let sync_period = bus.sync_period();
    let (producer, consumer, watch_master) = heartbeat_ms;
    let usual = NodeSettings::new(node_id(node), node_id(bus.master_node_id), sync_period);
    NodeSettings {
        expected: expected_identity(identity),
        heartbeat_period: millis(producer),
        consumer_time: patience.of(millis(consumer)),
        // 0x1016 has 16 bits of milliseconds.
        master_consumer_time: patience.of(millis(watch_master)).min(millis(u16::MAX)),
        missed_pdos_max: patient_pdos(&usual, millis(consumer), patience),
        timeouts: patient_node(usual.timeouts, patience),
        ..usual
    }
}

pub(crate) fn expected_identity(identity: &IdentityConfig) -> ExpectedIdentity {
    ExpectedIdentity {
        device_type: Some(identity.device_type),
        vendor: Some(identity.vendor_id),
        product: Some(identity.product_code),
        revision: identity.revision,
        serial: identity.serial_number,
    }
}

/// Where the clock is faster than the wall's, a pause of the host silences process data and
/// heartbeats alike, so they are waited for alike.
fn patient_pdos(usual: &NodeSettings, consumer_time: Duration, patience: Patience) -> u32 {
    if patience == Patience::NONE {
        return usual.missed_pdos_max;
    }
    let periods = patience.of(consumer_time).as_nanos() / usual.sync_period.as_nanos().max(1);
    u32::try_from(periods).map_or(u32::MAX, |it| it.max(usual.missed_pdos_max))
}

/// See [`crate::config::Loaded::patience`].
fn patient_node(usual: NodeTimeouts, patience: Patience) -> NodeTimeouts {
    NodeTimeouts {
        boot: patience.of(usual.boot),
        sdo: SdoTimeouts {
            response: patience.of(usual.sdo.response),
            block_segment: patience.of(usual.sdo.block_segment),
            ..usual.sdo
        },
        operational: patience.of(usual.operational),
    }
}

/// What every node on CAN needs; its producer's, its consumer's and the master's heartbeat in ms.
pub(crate) fn check_node(
    judge: &mut Judge<'_>,
    can: &BTreeMap<String, CanBus>,
    bus: &str,
    [producer, consumer, watch_master]: [u16; 3],
) {
    judge.known("bus", bus, can, "can");
    check_heartbeat(judge, producer, consumer);
    check_watch(judge, can, bus, watch_master);
}

fn check_heartbeat(judge: &mut Judge<'_>, producer: u16, consumer: u16) {
    if consumer < producer.saturating_mul(2) {
        judge.say(
            "heartbeat_consumer_ms",
            format!("{consumer} ms leaves no room for one late heartbeat every {producer} ms"),
            format!("give at least {}", producer.saturating_mul(2)),
        );
    }
}

fn check_watch(
    judge: &mut Judge<'_>,
    can: &BTreeMap<String, CanBus>,
    bus: &str,
    watch_master_ms: u16,
) {
    let Some(bus) = can.get(bus) else {
        return;
    };
    let least = bus.master_heartbeat_ms.saturating_mul(2);
    if watch_master_ms < least {
        judge.say(
            "watch_master_ms",
            format!(
                "{watch_master_ms} ms with a master heartbeat every {} ms",
                bus.master_heartbeat_ms
            ),
            format!(
                "give at least {least}; without it a killed controller would not stop the stage"
            ),
        );
    }
}
