//! Trouble of a machine that lives faster than the wall's clock: how long it takes on the wall until
//! it is told and the machine is safe. See docs/decisions/0004-patience.md.

use core::time::Duration;

use mock_bus::fault::{Fault, FaultConfig};
use tests::{EMULATED, machine_config};
use truestage::CalibrateOptions;
use truestage::emulated::Emulated;
use truestage::{Machine, ports};

/// A calibration that meets `fault` fails after so long, on the wall: the machine stopped, as far as
/// it can be reached, and the reason told.
#[track_caller]
fn told_after(fault: &Fault, speed: f64) -> Duration {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut loaded = machine_config(folder.path(), |text| text);
    loaded.patience = ports::Pace::Wall(speed).patience();
    let emulated = Emulated::new(EMULATED, 7, &loaded.config);
    let emulated = emulated.unwrap_or_else(|error| panic!("{error}"));
    let mut machine = Machine::new(&loaded, Box::new(emulated.transport()));
    let store = loaded.config.machine.store();
    let ready = machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)
    });
    ready.unwrap_or_else(|failure| panic!("before the fault: {failure}"));
    let begun = machine.now();
    let fault = FaultConfig::permanent(fault.clone());
    let id = emulated.simulation_mut().inject(fault);
    let id = id.unwrap_or_else(|error| panic!("{error}"));
    let options = CalibrateOptions::default();
    let failed = machine.guarded(|machine| machine.linear("x")?.calibrate(&store, &options));
    let Err(failure) = failed else {
        panic!("nothing was noticed")
    };
    assert!(
        emulated.simulation().fault_deliveries(id) > 0,
        "never delivered"
    );
    let wall = (machine.now() - begun).div_f64(speed);
    println!("{speed}: {wall:?} {failure}");
    wall
}

/// Each time-out is a second longer on the wall, and there are three in a row at most: the one that
/// notices, the quick stop and the switching off of a drive that does not answer.
#[test]
fn on_a_scaled_clock_trouble_is_told_a_few_seconds_of_the_wall_later_than_in_real_time_at_most() {
    let named = |name: &str| name.to_owned();
    for fault in [
        Fault::BeamBlocked,
        Fault::Silence {
            port: named("laser"),
        },
        Fault::Mute {
            node: named("drive"),
        },
        Fault::StopHeartbeat {
            node: named("drive"),
        },
        Fault::LinkGone {
            port: named("can0"),
        },
    ] {
        let real = told_after(&fault, 1.0);
        for speed in [2.0, 10.0] {
            let wall = told_after(&fault, speed);
            let more = wall.saturating_sub(real);
            assert!(
                more < Duration::from_millis(3100),
                "{fault:?} at {speed}: {wall:?}, {real:?}"
            );
        }
    }
}
