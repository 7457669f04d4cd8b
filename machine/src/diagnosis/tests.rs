use drivers::device::canopen_node::ExpectedIdentity;
use wire::canopen::nmt::{NmtState, emit_heartbeat};
use wire::canopen::sdo::{Expedited, SdoResponse};

use drivers::device::Alarm;

use super::node_traffic::STATUSWORD;
use super::*;

const MS: u64 = 1_000_000;
const PORT: Port = Port(0);
/// When everything begins to go wrong, in milliseconds.
const FAILED: u64 = 1_000;

fn node(raw: u8) -> NodeId {
    NodeId::new(raw).expect("1 to 127")
}

fn at(ms: u64) -> Time {
    Time(ms * MS)
}

/// A drive `x` (node 1) and a module `hall` (node 2), each with a heartbeat every 50 ms and process data every 5 ms.
struct Scene {
    diagnosis: Diagnosis,
}

impl Scene {
    fn new() -> Self {
        let expected = |device: &str| parts::ExpectedNode {
            device: device.into(),
            identity: ExpectedIdentity::default(),
        };
        let bus = parts::Bus {
            port: PORT,
            name: "can0".into(),
            bitrate: 1_000_000,
            sync_period: Duration::from_millis(5),
            master: node(127),
            heartbeat: Duration::from_millis(50),
            nodes: [(node(1), expected("x")), (node(2), expected("hall"))].into(),
            drives: vec![node(1)],
        };
        Self {
            diagnosis: Diagnosis::new(&[bus]),
        }
    }

    fn hear(&mut self, ms: u64, frame: CanFrame) -> &mut Self {
        let input = Input::Payload(Payload::Frame(frame));
        let at = at(ms);
        let port = PORT;
        self.diagnosis.note(&Arrival { at, port, input }, at);
        self
    }

    fn beats(&mut self, of: u8, from: u64, until: u64, state: NmtState) -> &mut Self {
        for ms in (from..until).filter(|ms| ms % 50 == 0) {
            self.hear(ms, emit_heartbeat(node(of), state));
        }
        self
    }

    fn process_data(&mut self, of: u8, function: Function, from: u64, until: u64) -> &mut Self {
        for ms in (from..until).filter(|ms| ms % 5 == 0) {
            let frame = CanFrame::standard(node(of).cob_id(function), &[0x37, 0x06, 7, 0]);
            self.hear(ms, frame);
        }
        self
    }

    /// Both nodes say all that they should, up to the failure.
    fn sound(&mut self) -> &mut Self {
        for of in [1, 2] {
            self.beats(of, 0, FAILED, NmtState::Operational);
            self.process_data(of, Function::Tpdo1, 0, FAILED);
        }
        self
    }

    /// Node 2 goes on for so long.
    fn other_goes_on(&mut self, until: u64) -> &mut Self {
        self.beats(2, FAILED, until, NmtState::Operational);
        self.process_data(2, Function::Tpdo1, FAILED, until)
    }

    fn ask(&mut self) -> &mut Self {
        let failure = Failure::Alarm {
            device: "x".into(),
            alarm: Alarm::PdoLost {
                node: node(1),
                missed: 3,
            },
        };
        self.ask_of(&failure)
    }

    fn ask_of(&mut self, failure: &Failure) -> &mut Self {
        self.diagnosis.ask(at(FAILED + 17), failure);
        self
    }

    #[track_caller]
    fn check(&mut self, ms: u64, expected: Option<Finding>) {
        self.diagnosis.conclude(at(ms));
        let answer = self.diagnosis.take_answer().map(|(_, finding)| finding);
        assert_eq!(answer, expected);
    }
}

#[test]
fn a_silent_node_beside_another_has_no_power() {
    let silent = Finding::Silent {
        node: node(1),
        since: Some(at(995)),
        others: vec![node(2)],
    };
    Scene::new()
        .sound()
        .ask()
        .other_goes_on(3_000)
        .check(3_000, Some(silent));
}

#[test]
fn a_node_is_silent_only_after_its_heartbeat_is_overdue() {
    Scene::new()
        .sound()
        .ask()
        .other_goes_on(1_100)
        .check(1_100, None);
}

#[test]
fn silence_of_every_node_is_the_bus() {
    let silent = Finding::BusSilent {
        port: "can0".into(),
        since: Some(at(995)),
        nodes: 2,
    };
    Scene::new().sound().ask().check(3_000, Some(silent));
}

#[test]
fn a_node_never_heard_is_told_from_a_silent_one() {
    let mut scene = Scene::new();
    scene.process_data(2, Function::Tpdo1, 0, 2_000).ask();
    let never = Finding::Silent {
        node: node(1),
        since: None,
        others: vec![node(2)],
    };
    scene.check(2_000, Some(never));
}

#[test]
fn a_heartbeat_without_process_data_says_its_state() {
    for state in [NmtState::Operational, NmtState::PreOperational] {
        let mut scene = Scene::new();
        scene.sound().ask().other_goes_on(1_200);
        let since = at(995);
        let expected = Finding::NoProcessData {
            node: node(1),
            since,
            state,
        };
        scene
            .beats(1, 1_050, 1_200, state)
            .check(1_200, Some(expected));
    }
}

#[test]
fn heartbeats_of_all_without_process_data_mean_no_sync() {
    let mut scene = Scene::new();
    scene.sound().ask();
    for of in [1, 2] {
        scene.beats(of, 1_050, 1_200, NmtState::Operational);
    }
    let port = "can0".into();
    scene.check(
        1_200,
        Some(Finding::NoSync {
            port,
            since: at(995),
        }),
    );
}

#[test]
fn a_boot_up_after_process_data_is_a_restart() {
    let mut scene = Scene::new();
    scene.sound().ask().other_goes_on(1_200);
    scene.hear(1_150, emit_heartbeat(node(1), NmtState::BootUp));
    let restarted = Finding::Restarted {
        node: node(1),
        at: at(1_150),
    };
    scene.check(1_200, Some(restarted));
}

#[test]
fn a_missing_sample_beside_other_process_data_is_told() {
    let mut scene = Scene::new();
    scene.sound().ask().other_goes_on(1_200);
    scene.process_data(1, Function::Tpdo2, FAILED, 1_200);
    scene.beats(1, FAILED, 1_200, NmtState::Operational);
    let since = at(995);
    scene.check(
        1_200,
        Some(Finding::NoSample {
            node: node(1),
            since,
        }),
    );
}

#[test]
fn frames_that_come_again_were_lost() {
    let mut scene = Scene::new();
    scene.sound().ask().other_goes_on(1_200);
    scene.process_data(1, Function::Tpdo1, 1_040, 1_200);
    scene.beats(1, 1_050, 1_200, NmtState::Operational);
    let gap = Duration::from_millis(45);
    scene.check(1_200, Some(Finding::Interrupted { node: node(1), gap }));
}

#[test]
fn process_data_without_a_heartbeat_are_told() {
    let mut scene = Scene::new();
    let lost = Failure::Alarm {
        device: "x".into(),
        alarm: Alarm::HeartbeatLost {
            node: node(1),
            waited: Duration::from_millis(150),
        },
    };
    scene.sound().ask_of(&lost).other_goes_on(1_200);
    scene.process_data(1, Function::Tpdo1, FAILED, 1_200);
    let since = at(950);
    scene.check(
        1_200,
        Some(Finding::NoHeartbeat {
            node: node(1),
            since,
        }),
    );
}

fn answer(word: u16) -> CanFrame {
    let object = STATUSWORD;
    let data = Expedited::new(&word.to_le_bytes()).expect("two bytes");
    let response = SdoResponse::UploadExpedited { object, data };
    CanFrame::standard(node(1).cob_id(Function::SdoResponse), &response.emit())
}

#[track_caller]
fn check_frozen(word: u16, is_frozen: bool) {
    let mut scene = Scene::new();
    let late = Failure::Overdue {
        device: "x".into(),
        step: "move",
        waited: Duration::from_secs(1),
    };
    scene.sound().ask_of(&late);
    let (port, frame) = scene
        .diagnosis
        .poll_probe(at(1_020))
        .expect("a drive is asked");
    assert_eq!((port, frame.standard_id()), (PORT, Some(0x601)));
    let again = scene.diagnosis.poll_probe(at(1_021));
    assert_eq!(again, None, "asked a moment ago");
    scene.process_data(1, Function::Tpdo1, FAILED, 1_025);
    scene.hear(1_025, answer(word));
    scene.process_data(1, Function::Tpdo1, 1_026, 1_100);
    scene.beats(1, FAILED, 1_100, NmtState::Operational);
    let frozen = Finding::Frozen {
        node: node(1),
        since: at(0),
        shown: wire::cia402::Statusword::from_bits_retain(0x0637),
        read: wire::cia402::Statusword::from_bits_retain(word),
    };
    scene.check(1_100, is_frozen.then_some(frozen));
}

#[test]
fn process_data_that_contradict_the_object_are_frozen() {
    check_frozen(0x0250, true);
    check_frozen(0x0237, false);
}

#[test]
fn a_lost_interface_is_the_cause_of_all_silence() {
    let mut scene = Scene::new();
    scene.sound().ask();
    let state = LinkState::Down;
    let input = Input::Link(state);
    let arrival = Arrival {
        at: at(1_050),
        port: PORT,
        input,
    };
    scene.diagnosis.note(&arrival, at(1_050));
    let port = "can0".into();
    scene.check(3_000, Some(Finding::LinkLost { port, state }));
}

#[test]
fn a_failure_of_no_node_asks_nothing() {
    let mut scene = Scene::new();
    scene.sound().ask_of(&Failure::Interrupted);
    assert_eq!(scene.diagnosis.look_until(at(FAILED)), None);
    scene.check(3_000, None);
}
