//! `truestage jog` on a machine that a service keeps, in real time.

use serde_json::json;

use crate::programs::{Bench, live_rigs, number};
use crate::serve::{ask, keep};

/// The service stops a jog that was not renewed for 200 ms of its machine's clock.
#[test]
fn a_machine_that_a_service_keeps_is_jogged_by_its_dead_man() {
    for rig in live_rigs() {
        let bench = Bench::in_real_time(rig);
        let service = keep(&bench);
        let jog = ["jog", "machine.toml", "x=2mm/s"];
        let jogged = bench.run(&[&jog[..], &["--for", "1"]].concat());
        let jogged = jogged.with_code(0);
        let stands = number(&jogged["encoder_mm"]);
        // A busy computer may only make it shorter or longer by what it was held up.
        assert!((1.0..=4.0).contains(&stands), "{jogged}");
        // What somebody stops stays stopped, whoever holds the key.
        let mut client = bench.start(&jog);
        client.wait_until(|| {
            let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
            axis["state"] == "ContinuousMotion"
        });
        bench.run(&["stop"]).with_code(0);
        let ended = client.end();
        assert_eq!(ended.code, Some(130), "{ended:?}");
        assert!(ended.said.contains("stopped by"), "{ended:?}");
        let (_, axis) = ask(bench.folder(), "GET /v1/axes/x", &json!({}));
        assert_eq!(axis["state"], "Standstill", "{axis}");
        service.signal(nix::sys::signal::Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
