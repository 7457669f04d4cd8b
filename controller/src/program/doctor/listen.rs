//! What can be heard on the buses by whoever only listens: other masters, errors, nodes that are there twice.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::transport::Transport;
use units::Several;
use wire::can::BusErrorClass;
use wire::{Arrival, Input, Payload, Port};

use super::checked::Checked;
use crate::config::{CanTransport, Loaded, MachineConfig};
use crate::ports::{self, Overrides, Use};
use crate::program::MachineArgs;
use crate::{Failure, assemble};

/// Longer than the periods of all heartbeats that are usual.
const LISTEN: Duration = Duration::from_secs(2);
/// So many heartbeats more than configured are those of a second device.
const TWICE: f64 = 1.5;

// CiA 301, the predefined connection set.
const SYNC: u16 = 0x080;
const SDO_REQUEST: u16 = 0x600;
const HEARTBEAT: u16 = 0x700;

/// What was heard on one bus.
#[derive(Clone, Debug, Default, PartialEq)]
struct Heard {
    frames: u32,
    syncs: u32,
    errors: u32,
    /// Those of them that a wrong bit rate makes: bits where none can be.
    garbled: u32,
    /// Whether the controller has given up.
    is_off: bool,
    /// Requests to nodes, by their numbers.
    requests: BTreeMap<u8, u32>,
    /// Heartbeats, by their numbers.
    heartbeats: BTreeMap<u8, u32>,
}

impl Heard {
    fn take(&mut self, input: &Input) {
        let frame = match input {
            Input::Payload(Payload::Frame(frame)) => frame,
            Input::BusError(error) => {
                self.errors += 1;
                let of_bits = BusErrorClass::PROTOCOL | BusErrorClass::BUS_ERROR;
                self.garbled += u32::from(error.class.intersects(of_bits));
                self.is_off |= error.class.contains(BusErrorClass::BUS_OFF);
                return;
            }
            _ => return,
        };
        self.frames += 1;
        let Some(id) = frame.standard_id() else {
            return;
        };
        let node = (id & 0x7F) as u8;
        match id & 0x780 {
            _ if id == SYNC => self.syncs += 1,
            SDO_REQUEST => *self.requests.entry(node).or_default() += 1,
            HEARTBEAT => *self.heartbeats.entry(node).or_default() += 1,
            _ => {}
        }
    }
}

pub(super) fn checks(
    args: &MachineArgs,
    loaded: &Loaded,
    overrides: &Overrides,
) -> Result<Vec<Checked>, Failure> {
    let pace = args.pace("doctor")?;
    let mut transport = ports::open(&loaded.config, overrides, Use::Motion, pace)?;
    let names: BTreeMap<Port, String> = assemble::ports(&loaded.config)
        .into_iter()
        .map(|(name, port)| (port, name))
        .collect();
    let mut heard: BTreeMap<&str, Heard> = BTreeMap::new();
    let until = transport.now() + LISTEN;
    while transport.now() < until {
        if let Some(Arrival { port, input, .. }) = transport.receive(until)
            && let Some(name) = names.get(&port)
        {
            heard.entry(name).or_default().take(&input);
        }
    }
    let nothing = Heard::default();
    let buses = loaded.config.can.keys();
    let found = buses.flat_map(|name| {
        let heard = heard.get(name.as_str()).unwrap_or(&nothing);
        judged(&loaded.config, name, heard)
    });
    Ok(found.collect())
}

fn judged(config: &MachineConfig, bus: &str, heard: &Heard) -> Vec<Checked> {
    let mut found = Vec::new();
    let subject = format!("{bus} traffic");
    found.extend(wrong_bit_rate(config, bus, heard));
    if found.is_empty() && heard.errors > 0 {
        found.push(Checked::bad(
            &subject,
            format!("{} in {} s", Several(heard.errors, "error frame"), LISTEN.as_secs()),
            "the bit rate of every device, 60 Ω between CAN_H and CAN_L with power off, and somebody who acknowledges: \
             a device that is on",
        ));
    }
    found.extend(other_master(config, bus, heard));
    found.extend(twice(config, bus, heard));
    if found.is_empty() {
        found.push(match heard.frames {
            0 => Checked::not_told(
                &subject,
                "silent, as devices are that nobody has started, and those of another bit rate behind an adapter; \
                 `truestage scan` asks them",
            ),
            frames => Checked::good(&subject, Several(frames, "frame").to_string()),
        });
    }
    found
}

/// With another bit rate than the others have no frame is read: only what breaks the rules of bits is seen, or the
/// controller has given up. An adapter (SLCAN) says nothing of errors; where whoever sends heartbeats is not heard, a
/// wrong rate is one cause.
fn wrong_bit_rate(config: &MachineConfig, bus: &str, heard: &Heard) -> Option<Checked> {
    let own = config.can.get(bus)?;
    let rate = own.bitrate_bit_per_s;
    if heard.frames > 0 {
        return None;
    }
    let seen = match (heard.is_off, heard.garbled) {
        (true, _) => "the controller has given up (bus-off), and no frame was read".to_owned(),
        (false, 0) => return None,
        (false, garbled) => format!(
            "no frame, and {} of bits where none can be in {} s",
            Several(garbled, "error frame"),
            LISTEN.as_secs()
        ),
    };
    let set_up = match own.transport {
        CanTransport::SocketCan => format!(
            "`bitrate_bit_per_s` and what `ip -details link show {0}` says of it must be the rate of the devices, which \
             their switches or manuals say: sudo ip link set {0} down, then sudo ip link set {0} up type can bitrate RATE",
            own.interface.as_deref().unwrap_or("can0")
        ),
        CanTransport::Slcan => {
            "`bitrate_bit_per_s` must be the rate of the devices, which their switches or manuals say".to_owned()
        }
    };
    Some(Checked::bad(
        &format!("{bus} bit rate"),
        format!("probably not {rate} bit/s: {seen}"),
        &format!(
            "{set_up}. If it is right: 60 Ω between CAN_H and CAN_L with power off, and a device that is on"
        ),
    ))
}

/// Whoever sends what only this program should.
fn other_master(config: &MachineConfig, bus: &str, heard: &Heard) -> Option<Checked> {
    let master = config.can.get(bus)?.master_node_id;
    let mut seen = Vec::new();
    if heard.syncs > 0 {
        seen.push(Several(heard.syncs, "SYNC").to_string());
    }
    if heard.heartbeats.contains_key(&master) {
        seen.push(format!(
            "heartbeats of node {master}, which is this program's"
        ));
    }
    let nodes: Vec<String> = heard.requests.keys().map(u8::to_string).collect();
    if !nodes.is_empty() {
        seen.push(format!("SDO requests to node {}", nodes.join(", ")));
    }
    (!seen.is_empty()).then(|| {
        Checked::bad(
            &format!("{bus} master"),
            format!("another master is on the bus: {}", seen.join("; ")),
            "end the other program, or unplug the other controller: two masters move one axis to two places",
        )
    })
}

/// Nodes that are heard more often than they were set up to be.
fn twice(config: &MachineConfig, bus: &str, heard: &Heard) -> Option<Checked> {
    let linear = config.axis.values().filter_map(|it| it.node());
    let rotary = config.rotary.values().map(|it| &it.node);
    let modules = config.analog.values().filter_map(|it| it.node());
    let nodes = linear.chain(rotary).chain(modules);
    let nodes = nodes.filter(|it| it.bus == bus).filter(|it| {
        let usual = LISTEN.as_secs_f64() * 1e3 / f64::from(it.heartbeat_producer_ms);
        let seen = heard.heartbeats.get(&it.node_id).copied().unwrap_or(0);
        f64::from(seen) > TWICE * usual + 1.0
    });
    let nodes: Vec<String> = nodes.map(|it| it.node_id.to_string()).collect();
    (!nodes.is_empty()).then(|| {
        Checked::doubtful(
            &format!("{bus} nodes"),
            format!(
                "more heartbeats than one device sends: node {}",
                nodes.join(", ")
            ),
            "two devices may have one number: switch one of them off, and give each its own",
        )
    })
}

#[cfg(test)]
mod tests {
    use wire::can::{BusError, CanFrame};

    use super::super::checked::Verdict;
    use super::super::checked::tests::expect;
    use super::*;
    use crate::config::parse;

    const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

    fn judged_of(ids: &[(u16, u32)]) -> Vec<Checked> {
        let config = parse(LINEAR, "m").unwrap().config;
        let mut heard = Heard::default();
        for (id, count) in ids {
            let frame = CanFrame::standard(*id, &[5]);
            (0..*count).for_each(|_| heard.take(&Input::Payload(Payload::Frame(frame))));
        }
        judged(&config, "can0", &heard)
    }

    #[test]
    fn a_bus_that_is_silent_or_busy_as_it_should_be_is_good() {
        let says = ["silent", ""];
        expect(&judged_of(&[]), "can0 traffic", Verdict::NotTold, says);
        let usual = judged_of(&[(0x701, 40), (0x702, 40)]);
        expect(&usual, "can0 traffic", Verdict::Good, ["80 frames", ""]);
    }

    #[track_caller]
    fn check_errors(class: BusErrorClass, frames: u32, subject: &str, says: [&str; 2]) {
        let config = parse(LINEAR, "m").unwrap().config;
        let mut heard = Heard::default();
        let controller = wire::can::ControllerProblem::empty();
        heard.take(&Input::BusError(BusError { class, controller }));
        let frame = CanFrame::standard(0x701, &[5]);
        (0..frames).for_each(|_| heard.take(&Input::Payload(Payload::Frame(frame))));
        let found = judged(&config, "can0", &heard);
        expect(&found, subject, Verdict::Bad, says);
    }

    #[test]
    fn a_wrong_bit_rate_is_suspected_where_bits_are_seen_and_no_frame() {
        let says = [
            "not 1000000 bit/s: no frame, and 1 error frame",
            "rate of the devices",
        ];
        check_errors(BusErrorClass::PROTOCOL, 0, "can0 bit rate", says);
        let says = ["bus-off", "60 Ω"];
        check_errors(BusErrorClass::BUS_OFF, 0, "can0 bit rate", says);
        // Whoever is heard has the right one.
        let says = ["1 error frame in 2 s", "60 Ω"];
        check_errors(BusErrorClass::PROTOCOL, 9, "can0 traffic", says);
        // Nobody acknowledges: that is said of the wiring.
        check_errors(BusErrorClass::NO_ACK, 0, "can0 traffic", says);
    }

    #[test]
    fn another_master_is_known_by_what_only_this_program_sends() {
        for (id, says) in [
            (0x080, "3 SYNC"),
            (0x77F, "heartbeats of node 127"),
            (0x601, "SDO requests to node 1"),
        ] {
            let found = judged_of(&[(id, 3), (0x701, 40)]);
            expect(&found, "can0 master", Verdict::Bad, [says, "two masters"]);
        }
    }

    #[test]
    fn a_number_that_two_devices_have_is_suspected() {
        let found = judged_of(&[(0x701, 80), (0x702, 40)]);
        expect(
            &found,
            "can0 nodes",
            Verdict::Doubtful,
            ["node 1", "its own"],
        );
    }

    #[test]
    fn error_frames_are_told_with_what_makes_them() {
        let config = parse(LINEAR, "m").unwrap().config;
        let mut heard = Heard::default();
        heard.take(&Input::BusError(BusError::parse(0, &[0; 8])));
        let says = ["1 error frame in 2 s", "60 Ω"];
        expect(
            &judged(&config, "can0", &heard),
            "can0 traffic",
            Verdict::Bad,
            says,
        );
    }
}
