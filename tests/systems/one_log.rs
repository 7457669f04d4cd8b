//! One seed is one log: in virtual time, on SLCAN and serial lines, and on SocketCAN.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mock_bus::simulation::Simulation;
use tests::{Rig, Setup, Stand, rigs};
use truestage::Failure;
use truestage::platform::Pose;
use truestage::rotary::Way;
use units::{Metres, Radians};

/// What a machine did on its buses.
#[derive(Debug, PartialEq)]
struct Log {
    hash: u64,
    lines: Vec<String>,
}

fn log_of(rig: Rig, setup: &Setup, procedure: impl Fn(&mut Stand) -> Result<(), Failure>) -> Log {
    let mut stand = Stand::new(rig, setup);
    stand.simulation(Simulation::keep_log);
    let result = stand
        .machine
        .start()
        .and_then(|()| procedure(&mut stand))
        .and_then(|()| stand.machine.shut_down());
    result.unwrap_or_else(|failure| panic!("{rig:?}: {failure}"));
    stand.gone().simulation(|simulation| Log {
        hash: simulation.log_hash(),
        lines: simulation.log_lines().to_vec(),
    })
}

/// The log on each live rig of a busy computer is that of virtual time, to the last bit.
#[track_caller]
fn check(setup: &Setup, procedure: impl Fn(&mut Stand) -> Result<(), Failure>) {
    let expected = log_of(Rig::InProcess, setup, &procedure);
    assert!(expected.lines.len() > 1_000, "next to nothing happened");
    let _busy = BusyComputer::new();
    for rig in rigs().into_iter().filter(|rig| *rig != Rig::InProcess) {
        let seen = log_of(rig, setup, &procedure);
        let pairs = expected.lines.iter().zip(&seen.lines);
        let other = pairs.enumerate().find(|(_, (one, other))| one != other);
        assert!(other.is_none(), "{rig:?}: {other:?}");
        assert_eq!(expected.lines.len(), seen.lines.len(), "{rig:?}");
        assert_eq!(expected.hash, seen.hash, "{rig:?}");
    }
}

/// It computes for this long and then leaves the core for as long: what comes and goes takes turns from a log at more
/// places than what is always there, and other tests get the half of it.
const TURN: Duration = Duration::from_millis(3);

/// Keeps both cores of a small computer busy while it lives.
struct BusyComputer {
    enough: Arc<AtomicBool>,
    threads: Vec<JoinHandle<u64>>,
}

impl BusyComputer {
    fn new() -> Self {
        let enough = Arc::new(AtomicBool::new(false));
        let busy = |_| {
            let enough = Arc::clone(&enough);
            std::thread::spawn(move || {
                let mut count = 0_u64;
                while !enough.load(Ordering::Relaxed) {
                    let turn = Instant::now();
                    while turn.elapsed() < TURN {
                        count = std::hint::black_box(count + 1);
                    }
                    // Nothing is waited for: the core is left to others.
                    std::thread::park_timeout(TURN);
                }
                count
            })
        };
        let threads = (0..2).map(busy).collect();
        Self { enough, threads }
    }
}

impl Drop for BusyComputer {
    fn drop(&mut self) {
        self.enough.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            assert!(thread.join().is_ok_and(|count| count > 0), "it was idle");
        }
    }
}

#[test]
fn a_linear_stage_has_one_log_on_every_bus_of_a_busy_computer() {
    check(&Setup::new(7), |stand| {
        let store = stand.store.clone();
        stand.machine.linear("x")?.zero(&store)?;
        let target = Metres::from_mm(12.5);
        stand.machine.linear("x")?.move_to(target).map(drop)
    });
}

#[test]
fn a_platform_has_one_log_on_every_bus_of_a_busy_computer() {
    for setup in [Setup::uvw(7), Setup::uvw_copley(7)] {
        check(&setup, |stand| {
            let store = stand.store.clone();
            stand.machine.platform()?.zero(&store)?;
            stand.machine.platform()?.move_to(Pose::default()).map(drop)
        });
    }
}

#[test]
fn a_rotary_table_has_one_log_on_every_bus_of_a_busy_computer() {
    check(&Setup::rotary(7), |stand| {
        stand.machine.rotary("c")?.zero()?;
        let target = Radians::from_degrees(123.4);
        let way = Way::Shortest;
        stand.machine.rotary("c")?.move_to(target, way).map(drop)
    });
}

#[test]
fn three_axes_have_one_log_on_every_bus_of_a_busy_computer() {
    check(&Setup::volumetric(7), |stand| {
        stand.machine.volumetric()?.zero()
    });
}
