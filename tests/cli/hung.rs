//! A service that hangs, as a person at the command line meets it.

use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::programs::{Bench, live_rigs};
use crate::serve::keep;

/// Two seconds of the verb, and what a busy computer takes to start it.
const SOON: Duration = Duration::from_secs(4);

#[test]
fn stop_and_status_name_the_emergency_stop_where_the_service_hangs() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        service.signal(Signal::SIGSTOP);
        for verb in ["stop", "status"] {
            let begun = Instant::now();
            let ended = bench.run(&[verb]);
            let after = begun.elapsed();
            let said = format!("{ended:?}");
            assert!(after < SOON, "{verb}: {after:?}: {said}");
            assert!(
                said.contains("does not answer: use the emergency stop"),
                "{verb}: {said}"
            );
            assert!(!said.contains("switched off"), "{verb}: {said}");
            ended.with_code(4);
        }
        service.signal(Signal::SIGCONT);
        // The stop that it was sent meanwhile is taken.
        bench.run(&["status"]).with_code(0);
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
