//! Traffic on the CAN buses that no device of the configuration should send: that of a second
//! master, of another SDO client, and of a sender that occupies the bus.
//!
//! A transport does not hear its own frames. A SYNC, an NMT command, a drive's set-point or a write
//! to a device that is heard was sent by another master; two masters on one machine are never safe.
//! A client that only reads from a device is reported: its answers look like ours. The sender that
//! occupies the bus is looked up only when something failed to come: a full bus alone does no harm.

mod load;

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::{Alarm, DeviceError};
use drivers::transport::SendError;
use units::Time;
use wire::can::{CanFrame, CanId};
use wire::canopen::nmt::{NMT_COB_ID, NmtCommand};
use wire::canopen::sdo::SdoRequest;
use wire::canopen::{Function, NodeId};
use wire::{Arrival, Input, Payload, Port};

use self::load::{Load, Loudest};
use crate::engine::EngineFailure;
use crate::failure::Failure;
use crate::parts;

/// The identifier of SYNC.
const SYNC_COB_ID: u16 = 0x080;
/// The share of the bus above which one identifier leaves no room for others.
const SHARE_MAX: f64 = 0.5;
/// The time over which shares are taken: four SYNC periods, what lost process data need.
const WINDOW_PERIODS: u32 = 4;

/// Watches all buses of a machine.
#[derive(Debug, Default)]
pub(crate) struct BusWatch {
    buses: BTreeMap<Port, Bus>,
}

#[derive(Debug)]
struct Bus {
    name: String,
    /// Only a master sends these, and the master is here.
    masters_own: BTreeMap<u16, &'static str>,
    /// Those of the configuration, by the identifier of what is asked of them.
    servers: BTreeMap<u16, Server>,
    load: Load,
}

/// A device that can be asked by SDO.
#[derive(Debug)]
struct Server {
    node: NodeId,
    /// Whether it was told that somebody else asks it.
    is_told: bool,
}

impl BusWatch {
    pub(crate) fn new(buses: &[parts::Bus]) -> Self {
        let watched = |bus: &parts::Bus| Bus {
            name: bus.name.clone(),
            masters_own: masters_own(bus),
            servers: servers(bus),
            load: Load::new(
                Duration::from_secs(1) / bus.bitrate,
                bus.sync_period * WINDOW_PERIODS,
            ),
        };
        Self {
            buses: buses.iter().map(|it| (it.port, watched(it))).collect(),
        }
    }

    /// Takes what came in, and is looked at now. Returns what an operator should know of it.
    ///
    /// # Errors
    /// When it is something that only another master can have sent.
    pub(crate) fn observe(
        &mut self,
        arrival: &Arrival,
        now: Time,
    ) -> Result<Option<String>, Failure> {
        let Some(bus) = self.buses.get_mut(&arrival.port) else {
            return Ok(None);
        };
        match &arrival.input {
            Input::Lost(frames) => {
                bus.load.lose(arrival.at, now, *frames);
                Ok(None)
            }
            Input::Payload(Payload::Frame(frame)) => {
                bus.load.count(arrival.at, now, frame);
                bus.judge(frame)
            }
            _ => Ok(None),
        }
    }

    /// Counts what came in while everything is stopped, and judges nothing.
    pub(crate) fn count(&mut self, arrival: &Arrival, now: Time) {
        if let Some(bus) = self.buses.get_mut(&arrival.port)
            && let Input::Payload(Payload::Frame(frame)) = &arrival.input
        {
            bus.load.count(arrival.at, now, frame);
        }
    }

    /// Something failed: the largest share of each bus is looked for from now on.
    pub(crate) fn ask(&mut self) {
        self.buses
            .values_mut()
            .for_each(|bus| bus.load.forget_peak());
    }

    /// The failure, or, when something did not come because somebody fills the bus, that.
    pub(crate) fn explain(&self, now: Time, failure: Failure) -> Failure {
        let loudest = |bus: &Bus| bus.load.loudest(now);
        match self.talker(loudest) {
            Some((bus, talker)) if is_absence(&failure) => bus.babbling(&talker, failure),
            _ => failure,
        }
    }

    /// Who has filled a bus since [`BusWatch::ask`], as far as that explains `failure`: what a node sends under a
    /// number for which `is_own` holds may be false, and nothing else.
    ///
    /// # Errors
    /// The failure itself when that is no explanation.
    pub(crate) fn explain_by_peak(
        &self,
        now: Time,
        failure: Failure,
        is_own: impl Fn(CanId) -> bool,
    ) -> Result<Failure, Failure> {
        let peak = |bus: &Bus| bus.load.peak(now);
        match self.talker(peak) {
            Some((bus, talker)) if is_absence(&failure) || is_own(talker.id) => {
                Ok(bus.babbling(&talker, failure))
            }
            _ => Err(failure),
        }
    }

    /// The loudest sender of all buses, when it leaves no room for others.
    fn talker(&self, loudest: impl Fn(&Bus) -> Option<Loudest>) -> Option<(&Bus, Loudest)> {
        let buses = self.buses.values();
        let each = buses.filter_map(|bus| Some((bus, loudest(bus)?)));
        let first = each.max_by(|(_, a), (_, b)| a.share.total_cmp(&b.share));
        first.filter(|(_, talker)| talker.share > SHARE_MAX)
    }
}

impl Bus {
    fn babbling(&self, talker: &Loudest, failure: Failure) -> Failure {
        Failure::Babbling {
            port: self.name.clone(),
            id: talker.id,
            percent: (talker.share * 100.0).min(100.0),
            missing: Box::new(failure),
        }
    }

    fn judge(&mut self, frame: &CanFrame) -> Result<Option<String>, Failure> {
        let Some(cob_id) = frame.standard_id() else {
            return Ok(None);
        };
        if let Some(&heard) = self.masters_own.get(&cob_id) {
            // Noise on identifier 0 is no command.
            if cob_id == NMT_COB_ID && NmtCommand::parse(frame).is_err() {
                return Ok(None);
            }
            return Err(self.second_master(heard));
        }
        let Some(server) = self.servers.get_mut(&cob_id) else {
            return Ok(None);
        };
        match SdoRequest::parse(frame.data()) {
            Ok(request) if writes(&request) => {
                Err(self.second_master("an SDO request that writes to one of the devices"))
            }
            Ok(_) if !core::mem::replace(&mut server.is_told, true) => Ok(Some(format!(
                "{}: received an SDO request to {} that this controller did not send: another \
                 program reads from this device, and each may take the other's answer for its own; \
                 let it wait until this machine is at rest",
                self.name, server.node
            ))),
            // Noise, or told already.
            Ok(_) | Err(_) => Ok(None),
        }
    }

    fn second_master(&self, heard: &'static str) -> Failure {
        Failure::SecondMaster {
            port: self.name.clone(),
            heard,
        }
    }
}

/// Whether a value of the device changes.
const fn writes(request: &SdoRequest) -> bool {
    matches!(
        request,
        SdoRequest::DownloadExpedited { .. }
            | SdoRequest::DownloadInitiate { .. }
            | SdoRequest::BlockDownloadInitiate { .. }
    )
}

fn servers(bus: &parts::Bus) -> BTreeMap<u16, Server> {
    bus.nodes
        .keys()
        .map(|node| {
            let (node, is_told) = (*node, false);
            (node.cob_id(Function::SdoRequest), Server { node, is_told })
        })
        .collect()
}

fn masters_own(bus: &parts::Bus) -> BTreeMap<u16, &'static str> {
    let mut own = BTreeMap::from([
        (SYNC_COB_ID, "a SYNC"),
        (NMT_COB_ID, "an NMT command"),
        (
            bus.master.cob_id(Function::ErrorControl),
            "a heartbeat with this controller's own node number",
        ),
    ]);
    let drives = bus.drives.iter();
    own.extend(drives.map(|it| (it.cob_id(Function::Rpdo1), "a command to one of the drives")));
    own
}

/// Whether something failed to come or to go.
pub(crate) const fn is_absence(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Overdue { .. }
            | Failure::Engine(
                EngineFailure::Missing { .. }
                    | EngineFailure::NotSent { .. }
                    // Whatever fills a bus keeps this computer busy.
                    | EngineFailure::HeldUp { .. },
            )
            | Failure::Send {
                source: SendError::QueueFull { .. },
                ..
            }
            | Failure::Alarm {
                alarm: Alarm::PdoLost { .. }
                    | Alarm::HeartbeatLost { .. }
                    | Alarm::StaleSample { .. },
                ..
            }
            | Failure::Device {
                source: DeviceError::Timeout { .. } | DeviceError::SdoTimeout { .. },
                ..
            }
    )
}
