//! What is doubtful of how devices are watched and asked.

use units::Short;

use super::judge::{Finding, Judge};
use super::least_time::span;
use super::model::MachineConfig;
use crate::hardware::analog::ModuleConfig;
use crate::hardware::camera::CameraDevice;
use crate::hardware::node::NodeConfig;

/// A device that is gone is noticed within this, unless its heartbeats are rare.
const LOST_MAX_MS: u16 = 5000;
/// So many heartbeats may be missed before anybody asks why.
const LOST_HEARTBEATS: u16 = 10;
/// Without a reading for so long a module's alarm is raised.
const STALE_MS: f64 = 1000.0;

pub(super) fn check(config: &MachineConfig, found: &mut Vec<Finding>) {
    for (key, node) in nodes(config) {
        check_heartbeat(&mut Judge::at(key, found), node);
    }
    for (name, analog) in &config.analog {
        if let ModuleConfig::Dcon(own) = &analog.module {
            check_period(
                &mut Judge::at(format!("analog.{name}"), found),
                own.poll_period_ms,
            );
        }
    }
    for (name, camera) in &config.camera {
        let CameraDevice::InSight(own) = &camera.device;
        check_score(
            &mut Judge::at(format!("camera.{name}"), found),
            own.score_min_percent,
        );
    }
}

fn nodes(config: &MachineConfig) -> impl Iterator<Item = (String, &NodeConfig)> {
    let axes = config.axis.iter();
    let axes = axes.filter_map(|(name, it)| Some((format!("axis.{name}"), it.node()?)));
    let tables = config.rotary.iter();
    let tables = tables.map(|(name, it)| (format!("rotary.{name}"), &it.node));
    let modules = config.analog.iter();
    let modules = modules.filter_map(|(name, it)| Some((format!("analog.{name}"), it.node()?)));
    axes.chain(tables).chain(modules)
}

fn check_heartbeat(judge: &mut Judge<'_>, node: &NodeConfig) {
    let (period, lost) = (node.heartbeat_producer_ms, node.heartbeat_consumer_ms);
    if lost > LOST_MAX_MS.max(period.saturating_mul(LOST_HEARTBEATS)) {
        judge.say(
            "heartbeat_consumer_ms",
            format!(
                "a device that is gone is noticed after {}, and its heartbeat comes every {}",
                span(f64::from(lost) * 1e-3),
                span(f64::from(period) * 1e-3)
            ),
            "give two to five periods of its heartbeat",
        );
    }
}

fn check_period(judge: &mut Judge<'_>, period_ms: f64) {
    if period_ms >= STALE_MS {
        judge.say(
            "poll_period_ms",
            format!(
                "a reading comes every {}, and without one for {} an alarm is raised",
                span(period_ms * 1e-3),
                span(STALE_MS * 1e-3)
            ),
            "give less than 1000, better 100",
        );
    }
}

/// A share where percent are meant.
fn check_score(judge: &mut Judge<'_>, percent: f64) {
    if percent > 0.0 && percent <= 1.0 {
        judge.say(
            "score_min_percent",
            format!(
                "a picture is good from {} % on: nearly any is",
                Short(percent)
            ),
            format!(
                "give percent: {} where a share of {} is meant",
                Short(percent * 100.0),
                Short(percent)
            ),
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    #[test]
    fn a_device_that_is_missed_late_is_told() {
        let edit = (
            "heartbeat_consumer_ms = 150",
            "heartbeat_consumer_ms = 15000",
        );
        let says = "is noticed after 15s, and its heartbeat comes every 50ms";
        check(LINEAR, &[edit], &["axis.x.heartbeat_consumer_ms"], says);
    }

    #[test]
    fn a_share_in_place_of_percent_is_told() {
        let edit = ("score_min_percent = 60.0", "score_min_percent = 0.6");
        let says = "good from 0.6 % on";
        check(UVW, &[edit], &["camera.eye.score_min_percent"], says);
    }

    #[test]
    fn a_module_that_is_asked_too_seldom_is_told() {
        let module = "[serial.volts]\npath = \"/dev/ttyUSB7\"\nbaud_bit_per_s = 9600\n\n[analog.volts]\n\
                      device = \"dcon\"\nline = \"volts\"\naddress = 1\npoll_period_ms = 5000.0\n\
                      channels = [0]\nfull_scale_v = [5.0]\n\n[instrument.laser]";
        let text = LINEAR.edit_first("[instrument.laser]", module);
        let says = "a reading comes every 5s, and without one for 1s an alarm is raised";
        check(&text, &[], &["analog.volts.poll_period_ms"], says);
    }
}
