//! What passes on the CAN buses that nobody of the configuration should say: a second master,
//! and somebody who takes the bus for himself.
//!
//! A transport does not hear its own frames. A SYNC, an NMT command or a drive's set-point that
//! is heard was sent by another master; two masters on one machine are never safe. Who occupies
//! the bus is looked up only when something failed to come: a full bus alone hurts nobody.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::{Alarm, DeviceError};
use drivers::transport::{Arrival, Input, Payload, Port, SendError};
use drivers::wire::can::CanFrame;
use drivers::wire::canopen::nmt::{NMT_COB_ID, NmtCommand};
use drivers::wire::canopen::{Function, NodeId};
use units::Time;

use crate::config::{AxisConfig, MachineConfig};
use crate::engine::EngineFailure;
use crate::failure::Failure;

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
    bit: Duration,
    window: Duration,
    /// Only a master sends these, and the master is here.
    masters_own: BTreeMap<u16, &'static str>,
    before: Load,
    now: Load,
}

/// Identifiers of standard frames.
const IDENTIFIERS: usize = 0x800;

/// One place for each identifier: counting asks for no memory, the cyclic engine counts too.
#[derive(Debug)]
struct Load {
    since: Time,
    busy: Box<[Duration; IDENTIFIERS]>,
    /// The identifiers that were heard: few of all.
    heard: Vec<u16>,
}

impl Default for Load {
    fn default() -> Self {
        Self {
            since: Time::ZERO,
            busy: Box::new([Duration::ZERO; IDENTIFIERS]),
            heard: Vec::with_capacity(IDENTIFIERS),
        }
    }
}

impl Load {
    fn begin(&mut self, since: Time) {
        self.since = since;
        for cob_id in self.heard.drain(..) {
            self.busy[usize::from(cob_id)] = Duration::ZERO;
        }
    }

    fn add(&mut self, cob_id: u16, span: Duration) {
        let Some(busy) = self.busy.get_mut(usize::from(cob_id)) else {
            return;
        };
        if *busy == Duration::ZERO {
            self.heard.push(cob_id);
        }
        *busy += span;
    }
}

impl BusWatch {
    pub(crate) fn new(config: &MachineConfig, ports: &BTreeMap<String, Port>) -> Self {
        let buses = config.can.iter().map(|(name, can)| {
            let period = Duration::from_secs_f64(can.sync_period_ms * 1e-3);
            let bus = Bus {
                name: name.clone(),
                bit: Duration::from_secs(1) / can.bitrate_bit_per_s,
                window: period * WINDOW_PERIODS,
                masters_own: masters_own(config, name, can.master_node_id),
                before: Load::default(),
                now: Load::default(),
            };
            (ports[name], bus)
        });
        Self {
            buses: buses.collect(),
        }
    }

    /// Takes what came in.
    ///
    /// # Errors
    /// When it is something that only another master can have sent.
    pub(crate) fn observe(&mut self, arrival: &Arrival) -> Result<(), Failure> {
        let Input::Payload(Payload::Frame(frame)) = &arrival.input else {
            return Ok(());
        };
        let (Some(bus), Some(cob_id)) = (self.buses.get_mut(&arrival.port), frame.standard_id())
        else {
            return Ok(());
        };
        bus.count(arrival.at, cob_id, frame);
        match bus.masters_own.get(&cob_id) {
            // Noise on identifier 0 is no command.
            Some(_) if cob_id == NMT_COB_ID && NmtCommand::parse(frame).is_err() => Ok(()),
            Some(heard) => Err(Failure::SecondMaster {
                port: bus.name.clone(),
                heard,
            }),
            None => Ok(()),
        }
    }

    /// The failure, or, when something did not come because somebody fills the bus, that.
    pub(crate) fn explain(&self, now: Time, failure: Failure) -> Failure {
        if !is_absence(&failure) {
            return failure;
        }
        let loudest = self.buses.values().filter_map(|bus| bus.loudest(now));
        match loudest.max_by(|a, b| a.2.total_cmp(&b.2)) {
            Some((port, cob_id, share)) if share > SHARE_MAX => Failure::Babbling {
                port,
                cob_id,
                percent: (share * 100.0).min(100.0),
                missing: Box::new(failure),
            },
            _ => failure,
        }
    }
}

impl Bus {
    fn count(&mut self, at: Time, cob_id: u16, frame: &CanFrame) {
        if at.since(self.now.since) >= self.window {
            core::mem::swap(&mut self.before, &mut self.now);
            self.now.begin(at);
        }
        // Between the shortest form and the longest, with every stuff bit there may be.
        let bits = (47 + 8 * frame.data().len()) as u32;
        self.now.add(cob_id, self.bit * bits);
    }

    /// Who took the largest share lately.
    fn loudest(&self, now: Time) -> Option<(String, u16, f64)> {
        let span = now.since(self.before.since).as_secs_f64();
        if span > 3.0 * self.window.as_secs_f64() || span <= 0.0 {
            return None;
        }
        // Since when the talker talks is not known: the shorter of both spans favours him.
        let recent = now.since(self.now.since).as_secs_f64();
        let share = |cob_id: u16| {
            let of = |load: &Load| load.busy[usize::from(cob_id)];
            let (late, all) = (of(&self.now), of(&self.now) + of(&self.before));
            let late = if recent > 0.25 * self.window.as_secs_f64() {
                late.as_secs_f64() / recent
            } else {
                0.0
            };
            late.max(all.as_secs_f64() / span)
        };
        let loudest = (0..IDENTIFIERS as u16)
            .map(|cob_id| (cob_id, share(cob_id)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        (loudest.1 > 0.0).then(|| (self.name.clone(), loudest.0, loudest.1))
    }
}

fn masters_own(config: &MachineConfig, bus: &str, master: u8) -> BTreeMap<u16, &'static str> {
    let mut own = BTreeMap::from([(SYNC_COB_ID, "a SYNC"), (NMT_COB_ID, "an NMT command")]);
    if let Some(master) = NodeId::new(master) {
        own.insert(
            master.cob_id(Function::ErrorControl),
            "a heartbeat with this controller's own node number",
        );
    }
    let axes = config.axis.values().filter_map(AxisConfig::can);
    let axes = axes.map(|it| (it.bus, it.node_id));
    let rotaries = config.rotary.values();
    let rotaries = rotaries.map(|it| (&*it.bus, it.node_id));
    for (_, node_id) in axes.chain(rotaries).filter(|(on, _)| *on == bus) {
        if let Some(node) = NodeId::new(node_id) {
            own.insert(
                node.cob_id(Function::Rpdo1),
                "a command to one of the drives",
            );
        }
    }
    own
}

/// Whether something failed to come or to go.
const fn is_absence(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Overdue { .. }
            | Failure::Engine(EngineFailure::Missing { .. } | EngineFailure::NotSent { .. })
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
