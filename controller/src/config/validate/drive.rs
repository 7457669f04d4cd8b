//! What the sections of all drives must keep to.

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};

/// Axes name files, and stand in words of the command line (`x=1mm`).
pub(crate) fn check_axis_name(findings: &mut Vec<Finding>, section: &str, name: &str) {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        findings.push(Finding {
            key: format!("{section}.{name}"),
            cause: format!("`{name}` cannot name an axis"),
            help: "use letters, digits and _".into(),
        });
    }
}

/// What every node on CAN needs; its producer's, its consumer's and the master's heartbeat in ms.
pub(crate) fn check_node(
    judge: &mut Judge<'_>,
    config: &MachineConfig,
    bus: &str,
    [producer, consumer, watch_master]: [u16; 3],
) {
    judge.known("bus", bus, &config.can, "CAN bus");
    check_heartbeat(judge, producer, consumer);
    check_watch(judge, config, bus, watch_master);
}

fn check_heartbeat(judge: &mut Judge<'_>, producer: u16, consumer: u16) {
    if consumer < producer.saturating_mul(2) {
        judge.say(
            "heartbeat_consumer_ms",
            format!("{consumer} ms leaves no room for one late heartbeat every {producer} ms"),
            format!("give at least {}", producer.saturating_mul(2)),
        );
    }
}

fn check_watch(judge: &mut Judge<'_>, config: &MachineConfig, bus: &str, watch_master_ms: u16) {
    let Some(bus) = config.can.get(bus) else {
        return;
    };
    let least = bus.master_heartbeat_ms.saturating_mul(2);
    if watch_master_ms < least {
        judge.say(
            "watch_master_ms",
            format!(
                "{watch_master_ms} ms with a master heartbeat every {} ms",
                bus.master_heartbeat_ms
            ),
            format!(
                "give at least {least}; without it a killed controller would not stop the stage"
            ),
        );
    }
}
