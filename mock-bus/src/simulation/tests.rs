use super::*;
use crate::fault::Fault;
use crate::plant::HallDrift;
use core::time::Duration;
use wire::can::{BusErrorClass, CanFrame};

const MACHINE: &str = r#"
    name = "test"
    power_off_ms = 100.0
    [[ports]]
    kind = "can"
    name = "can0"
    bitrate_kbit_per_s = 1000
    [[ports]]
    kind = "serial"
    name = "laser"
    [[ports]]
    kind = "serial"
    name = "adc"
    baud_bit_per_s = 9600
    [[nodes]]
    name = "laser"
    port = "laser"
    device = { kind = "umd2_interferometer" }
    [[nodes]]
    name = "adc"
    port = "adc"
    device = { kind = "dcon_module", checksum = false, boot_ms = 0.0 }
"#;

const CAN: Port = Port(0);
const LASER: Port = Port(1);
const ADC: Port = Port(2);

/// Beats every 10 ms and answers every other frame with its identifier plus 1.
#[derive(Default)]
struct Parrot {
    id: u16,
    next: Option<Time>,
    outbox: VecDeque<Payload>,
}

impl Parrot {
    fn say(&mut self, id: u16, data: &[u8]) {
        self.outbox
            .push_back(Payload::Frame(CanFrame::standard(id, data)));
    }
}

impl Node for Parrot {
    fn handle(&mut self, _now: Time, payload: &Payload, _plant: &mut Plant) {
        if let Payload::Frame(frame) = payload
            && frame.standard_id() == Some(self.id)
        {
            self.say(self.id + 1, frame.data());
        }
    }

    fn advance(&mut self, now: Time, _plant: &mut Plant) {
        if self.next.is_some_and(|next| next <= now) {
            self.next = Some(now + Duration::from_millis(10));
            self.say(0x701, &[5]);
        }
    }

    fn next_event(&self) -> Time {
        self.next.unwrap_or(Time::NEVER)
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn power_off(&mut self, _now: Time, _plant: &mut Plant) {
        self.next = None;
    }

    fn power_on(&mut self, now: Time, _plant: &mut Plant) {
        self.next = Some(now);
        self.say(0x701, &[0]);
    }
}

fn machine(seed: u64) -> Simulation {
    let config = MachineConfig::parse(MACHINE).unwrap();
    let parrot = Guest {
        name: "parrot".into(),
        port: "can0".into(),
        node: Box::new(Parrot {
            id: 0x200,
            ..Parrot::default()
        }),
    };
    Simulation::with_guests(&config, seed, vec![parrot]).unwrap()
}

fn frame(id: u16) -> Payload {
    Payload::Frame(CanFrame::standard(id, &[1, 2]))
}

/// Everything that arrives on `port` up to `ms`.
fn arrivals(simulation: &mut Simulation, port: Port, ms: u64) -> Vec<Delivery> {
    let end = Time(ms * 1_000_000);
    core::iter::from_fn(|| simulation.advance_to_delivery(end))
        .filter(|delivery| delivery.port == port)
        .collect()
}

fn count_id(deliveries: &[Delivery], wanted: u16) -> usize {
    deliveries
        .iter()
        .filter(|delivery| {
            matches!(&delivery.event, Event::Payload(Payload::Frame(frame))
                if frame.standard_id() == Some(wanted))
        })
        .count()
}

#[test]
fn two_runs_of_one_seed_have_the_same_log_and_another_seed_another() {
    let run = |seed| {
        let mut simulation = machine(seed);
        simulation
            .deliver(Time(5_000_000), CAN, &frame(0x200))
            .unwrap();
        let poll = Payload::Bytes(b"#01\r".to_vec());
        simulation.deliver(Time(6_000_000), ADC, &poll).unwrap();
        simulation.advance(Time(500_000_000));
        simulation.log_hash()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn small_steps_and_large_ones_deliver_the_same() {
    let run = |step_ns: u64| {
        let mut simulation = machine(3);
        let mut seen = Vec::new();
        while simulation.now() < Time(400_000_000) {
            simulation.advance(Time(simulation.now().0 + step_ns));
            seen.extend(core::iter::from_fn(|| simulation.collect()));
        }
        (seen, simulation.log_hash())
    };
    assert_eq!(run(100_000), run(400_000_000));
}

#[test]
fn a_frame_and_its_answer_take_their_time_on_the_wire() {
    let mut simulation = machine(1);
    simulation
        .deliver(Time(1_000_000), CAN, &frame(0x200))
        .unwrap();
    let seen = arrivals(&mut simulation, CAN, 5);
    assert_eq!(count_id(&seen, 0x200), 0, "the host hears its own frame");
    let answer = seen.last().unwrap();
    let bits = u64::from(CanFrame::standard(0x200, &[1, 2]).worst_case_bits());
    assert_eq!(answer.at, Time(1_000_000 + 2 * bits * 1000));
}

#[test]
fn bytes_take_their_time_on_a_slow_line() {
    let mut simulation = machine(1);
    let poll = Payload::Bytes(b"$01M\r".to_vec());
    simulation.deliver(Time(1_000_000), ADC, &poll).unwrap();
    let seen = arrivals(&mut simulation, ADC, 100);
    // 5 + 8 bytes of 10 bits at 9600 bit/s, and 2 to 3 ms to answer.
    let ms = seen[0].at.seconds() * 1e3 - 1.0;
    assert!((15.5..16.6).contains(&ms), "{ms}");
}

#[test]
fn what_a_port_cannot_carry_is_refused() {
    let mut simulation = machine(1);
    let wrong = simulation.deliver(Time::ZERO, LASER, &frame(1));
    assert_eq!(wrong, Err(DeliverError::WrongKind { port: LASER }));
    let nowhere = simulation.deliver(Time::ZERO, Port(9), &frame(1));
    assert_eq!(nowhere, Err(DeliverError::NoPort { port: Port(9) }));
    let full = (0..200).find_map(|_| simulation.deliver(Time::ZERO, CAN, &frame(1)).err());
    assert_eq!(full, Some(DeliverError::QueueFull { port: CAN }));
}

#[test]
fn a_power_cycle_silences_everybody_and_boots_them_again() {
    let mut simulation = machine(1);
    simulation.advance(Time(50_000_000));
    while simulation.collect().is_some() {}
    simulation.power_cycle(HallDrift::default());
    let seen = arrivals(&mut simulation, CAN, 155);
    let first = &seen[0];
    assert!(first.at >= Time(150_000_000), "{}", first.at);
    let boot_up = Payload::Frame(CanFrame::standard(0x701, &[0]));
    assert_eq!(first.event, Event::Payload(boot_up));
}

#[test]
fn a_mute_node_is_not_heard() {
    let mut simulation = machine(1);
    let mute = Fault::Mute {
        node: "parrot".into(),
    };
    let fault = simulation
        .inject(FaultConfig::lasting(mute, Duration::from_millis(100)))
        .unwrap();
    assert_eq!(count_id(&arrivals(&mut simulation, CAN, 99), 0x701), 0);
    assert!(simulation.fault_deliveries(fault) >= 10);
    assert!(count_id(&arrivals(&mut simulation, CAN, 200), 0x701) >= 9);
}

#[test]
fn a_babbling_node_fills_the_bus() {
    let mut simulation = machine(1);
    let babble = Fault::Babble {
        port: "can0".into(),
        cob_id: 0x001,
    };
    simulation.inject(FaultConfig::permanent(babble)).unwrap();
    let seen = arrivals(&mut simulation, CAN, 100);
    assert!(count_id(&seen, 0x001) > 700);
    assert_eq!(count_id(&seen, 0x701), 0, "lower priority gets no turn");
    assert!(simulation.bus_load(CAN).unwrap() > 0.98);
}

#[test]
fn bus_off_is_reported_and_takes_the_link_down_until_it_ends() {
    let mut simulation = machine(1);
    let bus_off = Fault::BusOff {
        port: "can0".into(),
    };
    let fault = FaultConfig::lasting(bus_off, Duration::from_millis(20));
    simulation.inject(fault).unwrap();
    simulation.advance(Time(1_000_000));
    let refused = simulation.deliver(Time::ZERO, CAN, &frame(1));
    assert!(matches!(
        refused,
        Err(DeliverError::Unusable {
            link: Link::Down,
            ..
        })
    ));
    let seen = arrivals(&mut simulation, CAN, 30);
    assert!(matches!(seen[0].event, Event::BusError(error)
        if error.class == BusErrorClass::BUS_OFF));
    assert_eq!(seen[1].event, Event::Link(Link::Down));
    assert_eq!(seen[2].event, Event::Link(Link::Up));
    assert_eq!(simulation.link(CAN), Some(Link::Up));
}

#[test]
fn a_held_back_frame_comes_after_the_next_one() {
    let mut simulation = machine(1);
    let reorder = Fault::Reorder {
        port: "can0".into(),
        cob_id: Some(0x201),
    };
    simulation.inject(FaultConfig::times(reorder, 1)).unwrap();
    simulation
        .deliver(Time(12_000_000), CAN, &frame(0x200))
        .unwrap();
    let seen = arrivals(&mut simulation, CAN, 25);
    let after: Vec<&Delivery> = seen.iter().filter(|d| d.at > Time(12_000_000)).collect();
    assert_eq!(count_id(&[after[0].clone()], 0x701), 1);
    assert_eq!(count_id(&[after[1].clone()], 0x201), 1);
}

#[test]
fn serial_faults_change_what_arrives() {
    let ask = |fault: Fault| {
        let mut simulation = machine(1);
        let id = simulation.inject(FaultConfig::permanent(fault)).unwrap();
        let poll = Payload::Bytes(b"$01M\r".to_vec());
        simulation.deliver(Time(1_000_000), ADC, &poll).unwrap();
        let runs = arrivals(&mut simulation, ADC, 500);
        assert!(simulation.fault_deliveries(id) > 0);
        runs
    };
    let port = || "adc".to_owned();
    assert!(ask(Fault::Silence { port: port() }).is_empty());
    assert_eq!(ask(Fault::Split { port: port() }).len(), 2);
    assert_eq!(ask(Fault::Garbage { port: port() }).len(), 2);
    assert_eq!(ask(Fault::Echo { port: port() }).len(), 2);
    let late = ask(Fault::LateAnswer {
        port: port(),
        delay_ms: 200.0,
    });
    assert!(late[0].at > Time(200_000_000));
}

#[test]
fn a_fault_on_something_that_is_not_there_is_refused() {
    let mut simulation = machine(1);
    let fault = Fault::Mute {
        node: "nobody".into(),
    };
    let refused = simulation.inject(FaultConfig::permanent(fault));
    assert!(matches!(refused, Err(ConfigError::NoNode { .. })));
    let fault = Fault::Silence {
        port: "can0".into(),
    };
    let refused = simulation.inject(FaultConfig::permanent(fault));
    assert!(matches!(refused, Err(ConfigError::WrongKind { .. })));
}

#[test]
fn an_unknown_key_is_refused_with_its_line() {
    let renamed = |from: &str, to: &str| {
        assert!(MACHINE.contains(from), "{from}");
        MACHINE.replace(from, to)
    };
    let text = renamed("power_off_ms", "power_off_s");
    let error = MachineConfig::parse(&text).unwrap_err().to_string();
    assert!(
        error.contains("power_off_s") && error.contains("line 3"),
        "{error}"
    );
    let text = renamed("checksum = false", "checksums = false");
    assert!(MachineConfig::parse(&text).is_err());
}

/// The demo lives on this: a commissioning of minutes in less than a second. It asserts the
/// amount of work, not the time it takes; `--nocapture` prints that.
#[test]
fn minutes_of_streaming_and_polling_pass_in_virtual_time() {
    let started = std::time::Instant::now();
    let mut simulation = machine(1);
    let mut arrived = 0;
    for tick in 1..=30_000_u64 {
        let now = Time(tick * 5_000_000);
        while simulation.advance_to_delivery(now).is_some() {
            arrived += 1;
        }
        simulation.deliver(now, CAN, &frame(0x200)).unwrap();
    }
    println!("{arrived} deliveries of 150 s in {:?}", started.elapsed());
    assert!(arrived > 55_000, "{arrived}");
}
