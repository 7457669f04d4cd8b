use super::plan::{Edge, Plan};
use super::*;
use units::Time;

fn plan_with(config: FaultConfig) -> (Plan, FaultId) {
    let mut plan = Plan::new(1);
    let id = plan.add(Time::ZERO, config);
    while plan.poll_edge(Time::ZERO).is_some() {}
    (plan, id)
}

fn pdo() -> CanFrame {
    CanFrame::standard(0x181, &[1, 2, 3])
}

#[test]
fn a_dropped_frame_is_counted_and_others_pass() {
    let fault = Fault::Drop {
        port: "can0".into(),
        cob_id: Some(0x181),
    };
    let (mut plan, id) = plan_with(FaultConfig::times(fault, 1));
    assert_eq!(plan.frame_fate("can0", None, pdo()).copies, 0);
    assert_eq!(plan.frame_fate("can0", None, pdo()).copies, 1);
    assert_eq!(plan.frame_fate("can1", None, pdo()).copies, 1);
    assert_eq!(plan.delivered(id), 1);
}

#[test]
fn a_probability_strikes_that_share_and_repeats() {
    let fault = Fault::Drop {
        port: "can0".into(),
        cob_id: None,
    };
    let run = || {
        let mut config = FaultConfig::permanent(fault.clone());
        config.probability = 0.3;
        let (mut plan, id) = plan_with(config);
        for _ in 0..1000 {
            plan.frame_fate("can0", None, pdo());
        }
        plan.delivered(id)
    };
    assert!((250..350).contains(&run()), "{}", run());
    assert_eq!(run(), run());
}

#[test]
fn a_corrupted_frame_keeps_identifier_and_length() {
    let fault = Fault::Corrupt {
        port: "can0".into(),
        cob_id: None,
    };
    let (mut plan, _) = plan_with(FaultConfig::permanent(fault));
    let fate = plan.frame_fate("can0", None, pdo());
    assert_ne!(fate.frame, pdo());
    assert_eq!((fate.frame.id(), fate.frame.len()), (pdo().id(), 3));
}

#[test]
fn a_stopped_heartbeat_leaves_the_pdos_alone() {
    let fault = Fault::StopHeartbeat {
        node: "drive".into(),
    };
    let (mut plan, _) = plan_with(FaultConfig::permanent(fault));
    let beat = CanFrame::standard(0x701, &[5]);
    assert_eq!(plan.frame_fate("can0", Some("drive"), beat).copies, 0);
    assert_eq!(plan.frame_fate("can0", Some("drive"), pdo()).copies, 1);
    assert_eq!(plan.frame_fate("can0", Some("adc"), beat).copies, 1);
}

#[test]
fn a_foreign_master_sends_until_its_time_is_over() {
    let mut plan = Plan::new(1);
    let fault = Fault::ForeignSync {
        port: "can0".into(),
        period_ms: 10.0,
    };
    let id = plan.add(
        Time::ZERO,
        FaultConfig::lasting(fault, Duration::from_millis(35)),
    );
    let (mut sent, mut ended) = (0, 0);
    while plan.next_edge() != Time::NEVER {
        match plan.poll_edge(plan.next_edge()) {
            Some(Edge::Sends(..)) => sent += 1,
            Some(Edge::Ends(_)) => ended += 1,
            _ => {}
        }
    }
    assert_eq!((sent, ended, plan.delivered(id)), (4, 1, 4));
}

#[test]
fn split_answers_lose_no_byte() {
    let (mut plan, _) = plan_with(FaultConfig::permanent(Fault::Split { port: "adc".into() }));
    let fate = plan.bytes_fate("adc", Some("adc"), b">+1.2345\r".to_vec());
    assert_eq!(fate.runs.len(), 2);
    let together: Vec<u8> = fate.runs.into_iter().flat_map(|(_, run)| run).collect();
    assert_eq!(together, b">+1.2345\r");
}

#[test]
fn faults_read_from_toml_and_unknown_keys_are_refused() {
    let good = "from_s = 1.5\nprobability = 0.1\nfault = { kind = \"drop\", port = \"can0\", cob_id = 0x181 }";
    let config: FaultConfig = toml::from_str(good).unwrap();
    assert_eq!(config.from_s, 1.5);
    let typo = "fault = { kind = \"drop\", port = \"can0\", cobid = 0x181 }";
    assert!(toml::from_str::<FaultConfig>(typo).is_err());
}
