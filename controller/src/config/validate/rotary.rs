//! Whether what is said about a rotary axis makes sense.

use super::axis::check_axis_name;
use super::judge::{Finding, Judge};
use super::{check_heartbeat, check_watch};
use crate::config::model::MachineConfig;
use crate::config::rotary::RotaryConfig;

pub(super) fn check_rotaries(config: &MachineConfig, findings: &mut Vec<Finding>) {
    for (name, rotary) in &config.rotary {
        check_axis_name(findings, "rotary", name);
        let judge = &mut Judge::at(format!("rotary.{name}"), findings);
        if config.axis.contains_key(name) {
            judge.say(
                "",
                format!("there is an axis `{name}` too"),
                "give one of them another name",
            );
        }
        check_drive(judge, config, rotary);
        check_range(judge, rotary);
        if let Some(zero) = &rotary.zero {
            let judge = &mut Judge::at(format!("rotary.{name}.zero"), findings);
            let speed = zero.index_speed_deg_per_s;
            judge.within(
                "index_speed_deg_per_s",
                speed,
                1e-3,
                rotary.speed_max_deg_per_s,
            );
            judge.within("index_deg", zero.index_deg, 0.0, 360.0);
        }
    }
}

fn check_drive(judge: &mut Judge<'_>, config: &MachineConfig, rotary: &RotaryConfig) {
    judge.known("bus", &rotary.bus, &config.can, "CAN bus");
    judge.within("node_id", rotary.node_id.into(), 1.0, 127.0);
    let speed_max = rotary.speed_max_deg_per_s;
    for (key, value, low, high) in [
        ("speed_max_deg_per_s", speed_max, 1e-3, 1e5),
        ("speed_deg_per_s", rotary.speed_deg_per_s, 1e-3, speed_max),
        (
            "acceleration_deg_per_s2",
            rotary.acceleration_deg_per_s2,
            1e-2,
            1e6,
        ),
        (
            "quick_stop_deceleration_deg_per_s2",
            rotary.quick_stop_deceleration_deg_per_s2,
            1e-2,
            1e6,
        ),
        (
            "following_error_limit_arcsec",
            rotary.following_error_limit_arcsec,
            1e-3,
            1e6,
        ),
        (
            "position_window_arcsec",
            rotary.position_window_arcsec,
            1e-4,
            1e5,
        ),
        ("move_timeout_s", rotary.move_timeout_s, 0.01, 1e5),
    ] {
        judge.within(key, value, low, high);
    }
    check_heartbeat(
        judge,
        rotary.heartbeat_producer_ms,
        rotary.heartbeat_consumer_ms,
    );
    check_watch(judge, config, &rotary.bus, rotary.watch_master_ms);
}

/// What the drive's 32 bits can hold.
fn check_range(judge: &mut Judge<'_>, rotary: &RotaryConfig) {
    const REGISTER: f64 = i32::MAX as f64;
    let counts = f64::from(rotary.counts_per_turn);
    judge.within("counts_per_turn", counts, 360.0, REGISTER);
    let fastest = [
        ("speed_max_deg_per_s", rotary.speed_max_deg_per_s),
        ("acceleration_deg_per_s2", rotary.acceleration_deg_per_s2),
        (
            "quick_stop_deceleration_deg_per_s2",
            rotary.quick_stop_deceleration_deg_per_s2,
        ),
    ];
    for (key, value) in fastest {
        let needed = value * counts / 360.0;
        if needed > REGISTER {
            judge.say(
                key,
                format!("{value} is {needed:.0} counts, a drive has 2147483647"),
                format!("give at most {:.0}", REGISTER * 360.0 / counts),
            );
        }
    }
}
