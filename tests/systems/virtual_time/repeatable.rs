//! A seed is a machine: what happens is the same in every run, bit for bit.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Instant;

use drivers::transport::record::Recorder;
use tests::Bench;
use truestage::CalibrateOptions;
use truestage::for_tests::port_numbers;
use truestage::linear::VerifyOptions;

/// What a recorder writes and a test reads.
#[derive(Clone, Default)]
struct Shared(Rc<RefCell<Vec<u8>>>);

impl io::Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Everything on the buses by the controller's record and by the emulator's own, and the
/// largest wall time that it took.
struct Traces {
    recording: Vec<u8>,
    emulator: u64,
    accuracy_m: f64,
}

fn cycle(seed: u64) -> Traces {
    let log = Shared::default();
    let writer = log.clone();
    let mut bench = Bench::wrapped(
        seed,
        |text| text,
        |text| text,
        |inner| {
            let config = tests::machine_config(std::path::Path::new("/"), |text| text).config;
            let ports = port_numbers(&config);
            let names: Vec<_> = ports.iter().map(|(name, port)| (*port, &**name)).collect();
            Box::new(Recorder::new(inner, writer, &names).expect("memory takes every byte"))
        },
    );
    let store = bench.store.clone();
    let result = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let calibrated = machine
            .linear("x")?
            .calibrate(&store, &CalibrateOptions::default())?;
        let options = VerifyOptions {
            compensated: true,
            calibration: Some(calibrated.id),
            resume: None,
        };
        let left = machine.linear("x")?.verify(&store, &options)?;
        machine.shut_down()?;
        Ok(left.figures.accuracy.bidirectional)
    });
    let accuracy = result.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
    let emulator = bench.emulated.simulation().log_hash();
    drop(bench.machine);
    Traces {
        recording: log.0.take(),
        emulator,
        accuracy_m: accuracy.value(),
    }
}

#[test]
fn one_seed_gives_bit_identical_logs_and_another_seed_another() {
    let begun = Instant::now();
    let first = cycle(5);
    println!(
        "the cycle took {:.2} s with its recording of {} lines",
        begun.elapsed().as_secs_f64(),
        first
            .recording
            .iter()
            .filter(|byte| **byte == b'\n')
            .count()
    );
    let second = cycle(5);
    assert!(
        first.recording.len() > 100_000,
        "an empty recording proves nothing"
    );
    assert!(first.recording == second.recording, "the recordings differ");
    assert_eq!(first.emulator, second.emulator);
    assert_eq!(first.accuracy_m.to_bits(), second.accuracy_m.to_bits());
    let other = cycle(6);
    assert!(first.recording != other.recording);
    assert_ne!(first.emulator, other.emulator);
}
