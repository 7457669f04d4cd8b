//! One seed is one log: in virtual time, on SLCAN and serial lines, and on SocketCAN.


use mock_bus::simulation::Simulation;
use tests::{Rig, Setup, Stand, rigs};
use truestage::Failure;

/// What a machine did on its buses.
#[derive(Debug, PartialEq)]
struct Log {
    hash: u64,
    lines: Vec<String>,
}

fn log_of(
    rig: Rig,
    setup: &Setup,
    procedure: impl Fn(&mut Stand) -> Result<(), Failure>,
) -> Log {
    let mut stand = Stand::new(rig, setup);
    stand.simulation(Simulation::keep_log);
    let result = stand
        .machine
        .start()
        .and_then(|()| procedure(&mut stand))
        .and_then(|()| stand.machine.shut_down());
    result.unwrap_or_else(|failure| panic!("{rig:?}: {failure}"));
    stand.simulation(|simulation| Log {
        hash: simulation.log_hash(),
        lines: simulation.log_lines().to_vec(),
    })
}

/// The log on each live rig is that of virtual time, to the last bit.
#[track_caller]
fn check(setup: &Setup, procedure: impl Fn(&mut Stand) -> Result<(), Failure>) {
    let expected = log_of(Rig::InProcess, setup, &procedure);
    assert!(expected.lines.len() > 1_000, "next to nothing happened");
    for rig in rigs().into_iter().filter(|rig| *rig != Rig::InProcess) {
        let seen = log_of(rig, setup, &procedure);
        let pairs = expected.lines.iter().zip(&seen.lines);
        let other = pairs.enumerate().find(|(_, (one, other))| one != other);
        assert!(other.is_none(), "{rig:?}: {other:?}");
        assert_eq!(expected.lines.len(), seen.lines.len(), "{rig:?}");
        assert_eq!(expected.hash, seen.hash, "{rig:?}");
    }
}

#[test]
fn a_linear_stage_has_one_log_on_every_bus() {
    check(&Setup::new(7), |stand| {
        let store = stand.store.clone();
        stand.machine.zero("x", &store).map(drop)
    });
}
