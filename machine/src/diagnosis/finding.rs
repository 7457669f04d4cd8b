//! Causes of missing or false data, as the traffic of a bus shows them.

use core::fmt;
use core::time::Duration;

use units::{ShortSpan, Time};
use wire::LinkState;
use wire::canopen::NodeId;
use wire::canopen::nmt::NmtState;
use wire::cia402::Statusword;

use crate::bus_text::link_text;

/// A cause that was seen in the traffic of a bus.
///
/// # Example
///
/// ```
/// use machine::Finding;
/// use units::Time;
/// use wire::canopen::NodeId;
///
/// let node = |raw| NodeId::new(raw).expect("1 to 127");
/// let silent = Finding::Silent {
///     node: node(1),
///     since: Some(Time::from_seconds(12.034)),
///     others: vec![node(2)],
/// };
/// let text = "no data from node 1 since 12.034 s while node 2 answers: power or cable of this device. \
///             Check both, then start again";
/// assert_eq!(silent.to_string(), text);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The bus went away while the machine was stopped.
    LinkLost {
        /// The bus.
        port: String,
        /// What became of it.
        state: LinkState,
    },
    /// Nothing comes from a node while others are heard.
    Silent {
        /// The node.
        node: NodeId,
        /// When it was heard last; `None`: never since the start.
        since: Option<Time>,
        /// The nodes that are heard.
        others: Vec<NodeId>,
    },
    /// Nothing comes from any node of the bus.
    BusSilent {
        /// The bus.
        port: String,
        /// When the node in question was heard last; `None`: never since the start.
        since: Option<Time>,
        /// How many nodes the bus has.
        nodes: usize,
    },
    /// A node that sends no heartbeat answers nothing while others are heard.
    NoAnswer {
        /// The node.
        node: NodeId,
        /// When it was heard last.
        since: Time,
    },
    /// The heartbeat goes on, process data do not.
    NoProcessData {
        /// The node.
        node: NodeId,
        /// When the last process data came.
        since: Time,
        /// The state that its heartbeat says.
        state: NmtState,
    },
    /// The heartbeats of all nodes go on, the process data of none.
    NoSync {
        /// The bus.
        port: String,
        /// When the last process data came.
        since: Time,
    },
    /// Other process data of the same node go on.
    NoSample {
        /// The node.
        node: NodeId,
        /// When its TPDO 1 came last.
        since: Time,
    },
    /// Process data go on, the heartbeat does not.
    NoHeartbeat {
        /// The node.
        node: NodeId,
        /// When the last heartbeat came.
        since: Time,
    },
    /// The node has booted.
    Restarted {
        /// The node.
        node: NodeId,
        /// When its boot-up came.
        at: Time,
    },
    /// What was missing came again.
    Interrupted {
        /// The node.
        node: NodeId,
        /// How long nothing came.
        gap: Duration,
    },
    /// A limit switch is pressed, as the drive's inputs say.
    OnLimitSwitch {
        /// The node.
        node: NodeId,
        /// The negative one; else the positive one.
        negative: bool,
    },
    /// The same process data come again and again, but the object that they carry has changed.
    Frozen {
        /// The node.
        node: NodeId,
        /// Since when the process data have not changed.
        since: Time,
        /// The statusword in the process data.
        shown: Statusword,
        /// The statusword that was read.
        read: Statusword,
    },
}

impl Finding {
    /// The cause alone, without what to do.
    pub(crate) fn cause(&self) -> String {
        let text = self.to_string();
        let first = text.split(". ").next();
        first.unwrap_or_default().to_owned()
    }

    /// Whether it is none that a computer which was held up for a moment brings about: no SYNC, no answer in time.
    pub(crate) const fn outlasts_pause(&self) -> bool {
        match self {
            Self::LinkLost { .. }
            | Self::Silent { .. }
            | Self::BusSilent { .. }
            | Self::Restarted { .. }
            | Self::OnLimitSwitch { .. }
            | Self::Frozen { .. } => true,
            Self::NoAnswer { .. }
            | Self::NoProcessData { .. }
            | Self::NoSync { .. }
            | Self::NoSample { .. }
            | Self::NoHeartbeat { .. }
            | Self::Interrupted { .. } => false,
        }
    }

    /// Part of what a device should say stays away.
    fn write_partial_silence(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAnswer { node, since } => write!(
                f,
                "{node} answers nothing since {} while others do: it hangs, or lost power or cable. Restart it, check \
                 both, then start again",
                Clock(*since)
            ),
            Self::NoProcessData { node, since, state } => match state {
                NmtState::Operational => write!(
                    f,
                    "{node} lives, but sends no process data since {}: they were switched off. Look for another \
                     program that writes to it (0x1800, 0x1A00), reset the device, then start again",
                    Clock(*since)
                ),
                state => write!(
                    f,
                    "{node} left operational after {} and is {state}: an NMT command of another master, or its own \
                     watch (0x1016, 0x1029). Look for another master, then start again",
                    Clock(*since)
                ),
            },
            Self::NoSync { port, since } => write!(
                f,
                "{port}: every device lives, but none sends process data since {}: SYNC does not reach them. Look \
                 for another master that stopped them, then start again",
                Clock(*since)
            ),
            Self::NoSample { node, since } => write!(
                f,
                "TPDO 1 of {node} stays away since {} while its other process data come: it was switched off, or is \
                 lost on the way. Look at 0x1800:01, and for filters and gateways on the bus, then start again",
                Clock(*since)
            ),
            Self::NoHeartbeat { node, since } => write!(
                f,
                "{node} sends process data, but no heartbeat since {}: it was switched off (0x1017), or the device \
                 hangs. Reset the device, then start again",
                Clock(*since)
            ),
            Self::LinkLost { .. }
            | Self::Silent { .. }
            | Self::BusSilent { .. }
            | Self::Restarted { .. }
            | Self::Interrupted { .. }
            | Self::OnLimitSwitch { .. }
            | Self::Frozen { .. } => Ok(()),
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LinkLost { port, state } => write!(f, "{port}: {}", link_text(*state)),
            Self::Silent {
                node,
                since: Some(since),
                others,
            } => write!(
                f,
                "no data from {node} since {} while {}: power or cable of this device. Check both, then start again",
                Clock(*since),
                Answering(others)
            ),
            Self::Silent {
                node,
                since: None,
                others,
            } => write!(
                f,
                "{node} was never heard while {}: its power, its cable, its node number or its bit rate. \
                 Check them, then start again",
                Answering(others)
            ),
            Self::BusSilent { port, since, nodes } => write_bus_silence(f, port, *since, *nodes),
            Self::NoAnswer { .. }
            | Self::NoProcessData { .. }
            | Self::NoSync { .. }
            | Self::NoSample { .. }
            | Self::NoHeartbeat { .. } => self.write_partial_silence(f),
            Self::Restarted { node, at } => write!(
                f,
                "{node} restarted at {}: it lost power or was reset. Check its supply, then start again and zero",
                Clock(*at)
            ),
            Self::Interrupted { node, gap } => write!(
                f,
                "{node} was not heard for {} and came again: frames were lost, or the device was busy. Check cable, \
                 termination and the bus's load, then start again",
                ShortSpan(*gap)
            ),
            Self::OnLimitSwitch { node, negative } => {
                let which = if *negative { "negative" } else { "positive" };
                write!(
                    f,
                    "the {which} limit switch of {node} is pressed (0x60FD): the axis is on it, or the switch is stuck or \
                     its wire broken. Look where the axis stands, and at the switch, then start again"
                )
            }
            Self::Frozen {
                node,
                since,
                shown,
                read,
            } => write!(
                f,
                "{node} repeats the same process data since {}, \"{}\", while its 0x6041 reads \"{}\": its process \
                 data are frozen. Reset the device, then start again and zero",
                Clock(*since),
                shown.state(),
                read.state()
            ),
        }
    }
}

fn write_bus_silence(
    f: &mut fmt::Formatter<'_>,
    port: &str,
    since: Option<Time>,
    nodes: usize,
) -> fmt::Result {
    match (since, nodes) {
        (Some(since), 0 | 1) => write!(
            f,
            "no data from the only device of {port} since {}: its power, the cable or the adapter. Check them, then \
             start again",
            Clock(since)
        ),
        (Some(since), _) => write!(
            f,
            "no data from any device of {port} since {}: cable or termination of the bus, its adapter, or the supply \
             of all devices. Check them, then start again",
            Clock(since)
        ),
        (None, 0 | 1) => write!(
            f,
            "the only device of {port} was never heard: its power, the cable, its node number, the bit rate or the \
             adapter. Check them, then start again"
        ),
        (None, _) => write!(
            f,
            "no device of {port} was ever heard: cable, termination, bit rate or adapter of the bus, or the supply \
             of all devices. Check them, then start again"
        ),
    }
}

/// A moment of the machine's clock.
struct Clock(Time);

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.0.since(Time::ZERO).as_secs_f64())
    }
}

/// Nodes that are heard: the first ones of many.
struct Answering<'a>(&'a [NodeId]);

impl fmt::Display for Answering<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 3;
        for (at, node) in self.0.iter().take(SHOWN).enumerate() {
            let comma = if at == 0 { "" } else { ", " };
            write!(f, "{comma}{node}")?;
        }
        match self.0.len() {
            1 => f.write_str(" answers"),
            count if count > SHOWN => write!(f, " and {} more answer", count - SHOWN),
            _ => f.write_str(" answer"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).expect("1 to 127")
    }

    #[track_caller]
    fn check(finding: &Finding, words: &[&str]) {
        let text = finding.to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` is not in: {text}");
        }
    }

    #[test]
    fn the_cause_comes_before_what_to_do() {
        let since = Time::from_seconds(2.5);
        let state = NmtState::Operational;
        let stopped = Finding::NoProcessData {
            node: node(3),
            since,
            state,
        };
        check(
            &stopped,
            &["node 3 lives", "since 2.500 s", "switched off. Look"],
        );
        let state = NmtState::PreOperational;
        let left = Finding::NoProcessData {
            node: node(3),
            since,
            state,
        };
        check(&left, &["node 3 left operational", "pre-operational"]);
    }

    #[test]
    fn many_answering_nodes_are_counted() {
        let others: Vec<NodeId> = (2..=6).map(node).collect();
        assert_eq!(
            Answering(&others).to_string(),
            "node 2, node 3, node 4 and 2 more answer"
        );
        assert_eq!(Answering(&others[..2]).to_string(), "node 2, node 3 answer");
    }
}
