//! `truestage jog`: an axis that runs as long as somebody says so.

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::{ROTARY, Shipped, UVW};

use crate::held::Brake;
use crate::programs::{Bench, live_rigs, number};
use crate::serve::{ask, keep};

#[test]
fn an_axis_is_jogged_for_a_time_and_to_its_soft_limit() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let jogged = bench.run(&["jog", "machine.toml", "x=2mm/s", "--for", "1.5s"]);
        let jogged = jogged.with_code(0);
        // From its zero, less what it takes to speed up, plus what it takes to stop.
        let stands = number(&jogged["encoder_mm"]);
        assert!((2.5..=3.5).contains(&stands), "{jogged}");
        assert_eq!(jogged["at_soft_limit"], false, "{jogged}");
        let jogged = bench.run(&["jog", "machine.toml", "x=-5mm/s"]).with_code(0);
        let stands = number(&jogged["encoder_mm"]);
        assert!((stands + 3.0).abs() < 0.001, "{jogged}");
        assert_eq!(jogged["at_soft_limit"], true, "{jogged}");
    }
}

#[test]
fn a_table_is_jogged_for_a_time_either_way() {
    for rig in live_rigs() {
        let bench = Bench::of(rig, ROTARY, |text| text);
        let stands = |speed: &str| {
            let jogged = bench.run(&["jog", "machine.toml", speed, "--for", "1s"]);
            let jogged = jogged.with_code(0);
            assert_eq!(jogged["at_last_count"], false, "{jogged}");
            number(&jogged["encoder_deg"])
        };
        // Both from where its zero leaves it.
        let apart = stands("c=20deg/s") - stands("c=-20deg/s");
        assert!((34.0..=46.0).contains(&apart), "{apart} degrees");
        let refused = |words: &str, said: &str| {
            let refused = bench.run(&["jog", "machine.toml", words]).with_code(2);
            assert!(refused["error"].to_string().contains(said), "{refused}");
        };
        refused("c=2mm/s", "axis c turns");
        refused("c=40deg/s", "faster than it usually moves");
        refused("c=5deg", "with a sign and a unit");
    }
}

#[test]
fn a_jog_that_makes_no_sense_is_refused_before_anything_moves() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let refused = |words: &[&str], said: &str| {
            let words = [&["jog", "machine.toml"], words].concat();
            let refused = bench.run(&words).with_code(2);
            assert!(refused["error"].to_string().contains(said), "{refused}");
        };
        refused(&["x=2"], "with a sign and a unit");
        refused(&["x=0mm/s"], "with a sign and a unit");
        refused(&["x=900mm/s"], "faster than it usually moves");
        refused(&["x=5deg/s"], "goes along a way");
        refused(&["q=2mm/s"], "q");
        let zeros = std::fs::read_dir(bench.records().join("runs"));
        assert_eq!(zeros.map_or(0, Iterator::count), 0, "it zeroed nothing");
    }
}

#[test]
fn a_machine_that_a_service_keeps_is_jogged_as_long_as_the_jog_is_renewed() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        bench.run(&["zero", "machine.toml"]).with_code(0);
        let brake = Brake::on(&bench);
        let jog = ["jog", "machine.toml", "x=2mm/s"];
        // Three times as long as an axis runs without being told so.
        let jogged = bench.run(&[&jog[..], &["--for", "6s"]].concat());
        let jogged = jogged.with_code(0);
        let stands = number(&jogged["encoder_mm"]);
        assert!((0.7..=1.5).contains(&stands), "{jogged}");
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
        drop(brake);
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// `jog` says the same without a service and with one, and neither does what makes no sense.
fn check_kept(shipped: Shipped, jog: &str, refused: &[(&str, &str)]) {
    for rig in live_rigs() {
        let bench = Bench::of(rig, shipped, |text| text);
        let refuses = || {
            for (words, said) in refused {
                let refused = bench.run(&["jog", "machine.toml", words]).with_code(2);
                assert!(refused["error"].to_string().contains(said), "{refused}");
            }
        };
        refuses();
        let names = |value: &Value| -> Vec<String> {
            let members = value.as_object().expect("an object").keys();
            members.filter(|it| *it != "counters").cloned().collect()
        };
        let here = bench.run(&["jog", "machine.toml", jog, "--for", "0.5s"]);
        let here = names(&here.with_code(0));
        let service = keep(&bench);
        bench.run(&["zero", "machine.toml"]).with_code(0);
        refuses();
        let brake = Brake::on(&bench);
        let there = bench.run(&["jog", "machine.toml", jog, "--for", "2s"]);
        assert_eq!(names(&there.with_code(0)), here);
        drop(brake);
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

#[test]
fn a_kept_table_is_jogged_as_one_without_a_service_is() {
    let refused = [("c=2mm/s", "axis c turns"), ("q=2deg/s", "q")];
    check_kept(ROTARY, "c=-20deg/s", &refused);
}

#[test]
fn a_platform_is_jogged_for_a_time_and_to_the_end_of_its_reach_kept_or_not() {
    for rig in live_rigs() {
        let bench = Bench::of(rig, UVW, |text| text);
        let jogged = bench.run(&["jog", "machine.toml", "x=0.5mm/s", "--for", "1s"]);
        let jogged = jogged.with_code(0);
        let stands = number(&jogged["encoder_mm"]);
        assert!((0.4..=0.55).contains(&stands), "{jogged}");
        assert_eq!(jogged["at_end_of_reach"], false, "{jogged}");
        let jogged = bench.run(&["jog", "machine.toml", "theta=-0.5deg/s"]);
        let jogged = jogged.with_code(0);
        let stands = number(&jogged["encoder_deg"]);
        assert!((stands + 0.5).abs() < 0.001, "{jogged}");
        assert_eq!(jogged["at_end_of_reach"], true, "{jogged}");
    }
    let refused = [
        ("x=2deg/s", "goes along a way"),
        ("theta=1mm/s", "axis theta turns"),
        ("z=1mm/s", "z"),
    ];
    check_kept(UVW, "y=-0.5mm/s", &refused);
}
