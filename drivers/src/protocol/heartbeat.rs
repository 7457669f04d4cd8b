//! Heartbeats (CiA 301, 7.2.8.3.2): watching a node's, and sending our own.

use core::time::Duration;
use units::Time;
use wire::can::CanFrame;
use wire::canopen::NodeId;
use wire::canopen::nmt::{NmtState, emit_heartbeat, parse_heartbeat};

/// What a node's error control messages tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(
    missing_docs,
    reason = "from and to are NMT states, waited is a duration"
)]
pub enum HeartbeatEvent {
    /// The node booted.
    BootUp,
    /// The node's state is another one than before (`None`: it was not known).
    Changed {
        from: Option<NmtState>,
        to: NmtState,
    },
    /// Nothing came for the consumer time. Told once; a heartbeat re-arms it.
    Lost { waited: Duration },
}

/// Watches one node.
///
/// As CiA 301 wants it, a node is watched from its first heartbeat on, not before: see
/// [`HeartbeatConsumer::expect`] for one that must be alive now.
///
/// # Example
///
/// ```
/// use drivers::protocol::heartbeat::{HeartbeatConsumer, HeartbeatEvent};
/// use std::time::Duration;
/// use units::Time;
/// use wire::can::CanFrame;
/// use wire::canopen::{NodeId, nmt::NmtState};
///
/// let (node, waited) = (NodeId::new(5).expect("1 to 127"), Duration::from_millis(150));
/// let mut consumer = HeartbeatConsumer::new(node, waited);
/// let heard = consumer.handle_frame(Time::ZERO, &CanFrame::standard(0x705, &[0x05]));
/// let to = NmtState::Operational;
/// assert_eq!(heard, Some(HeartbeatEvent::Changed { from: None, to }));
/// let silent = consumer.handle_timeout(Time::from_seconds(0.15));
/// assert_eq!(silent, Some(HeartbeatEvent::Lost { waited }));
/// ```
#[derive(Debug)]
pub struct HeartbeatConsumer {
    node: NodeId,
    consumer_time: Duration,
    state: Option<NmtState>,
    last: Time,
    watching: bool,
}

impl HeartbeatConsumer {
    /// Watches `node`, which must beat within `consumer_time`; zero for never.
    pub const fn new(node: NodeId, consumer_time: Duration) -> Self {
        Self {
            node,
            consumer_time,
            state: None,
            last: Time::ZERO,
            watching: false,
        }
    }

    /// The state that was reported last; `None` before the first and after a loss.
    pub const fn state(&self) -> Option<NmtState> {
        self.state
    }

    /// From now on the node must beat, whether it did before or not.
    pub const fn expect(&mut self, now: Time) {
        self.last = now;
        self.watching = true;
    }

    /// Forgets the state reported last: the next heartbeat is news, whatever it says.
    pub const fn forget(&mut self) {
        self.state = None;
    }

    /// Stops watching, until the next heartbeat.
    pub const fn rest(&mut self) {
        self.watching = false;
    }

    /// Takes a frame; those of other nodes are not touched.
    pub fn handle_frame(&mut self, now: Time, frame: &CanFrame) -> Option<HeartbeatEvent> {
        let Ok((node, state)) = parse_heartbeat(frame) else {
            return None;
        };
        if node != self.node || frame.is_remote() {
            return None;
        }
        self.last = now;
        let from = self.state.replace(state);
        if state == NmtState::BootUp {
            // A boot-up message is no heartbeat: the first of those may take its time.
            self.watching = false;
            return Some(HeartbeatEvent::BootUp);
        }
        self.watching = true;
        (from != Some(state)).then_some(HeartbeatEvent::Changed { from, to: state })
    }

    /// Says once that the node fell silent.
    pub fn handle_timeout(&mut self, now: Time) -> Option<HeartbeatEvent> {
        if now < self.poll_timeout() {
            return None;
        }
        self.watching = false;
        self.state = None;
        Some(HeartbeatEvent::Lost {
            waited: now.since(self.last),
        })
    }

    /// When the node is lost unless it beats before.
    pub fn poll_timeout(&self) -> Time {
        if self.watching && !self.consumer_time.is_zero() {
            self.last + self.consumer_time
        } else {
            Time::NEVER
        }
    }
}

/// Sends our own heartbeat, which the drives watch (0x1016): when it stops, they stop.
///
/// # Example
///
/// ```
/// use drivers::protocol::heartbeat::HeartbeatProducer;
/// use std::time::Duration;
/// use units::Time;
/// use wire::canopen::NodeId;
///
/// let master = NodeId::new(0x7F).expect("1 to 127");
/// let mut producer = HeartbeatProducer::new(master, Duration::from_millis(50));
/// producer.handle_timeout(Time::ZERO);
/// assert_eq!(producer.poll_transmit().map(|it| it.to_string()), Some("77F#05".into()));
/// assert_eq!(producer.poll_transmit(), None);
/// assert_eq!(producer.poll_timeout(), Time::from_seconds(0.05));
/// ```
#[derive(Debug)]
pub struct HeartbeatProducer {
    node: NodeId,
    period: Duration,
    state: NmtState,
    next: Time,
    due: bool,
}

impl HeartbeatProducer {
    /// Beats as `node` every `period`, the first time at once; a period of zero is silent.
    pub const fn new(node: NodeId, period: Duration) -> Self {
        Self {
            node,
            period,
            state: NmtState::Operational,
            next: if period.is_zero() {
                Time::NEVER
            } else {
                Time::ZERO
            },
            due: false,
        }
    }

    /// The state that is reported from now on.
    pub const fn set_state(&mut self, state: NmtState) {
        self.state = state;
    }

    /// Beats when it is time. After a stall it beats once, not once for each missed period.
    pub fn handle_timeout(&mut self, now: Time) {
        if now < self.next {
            return;
        }
        self.due = true;
        let planned = self.next + self.period;
        self.next = if planned > now {
            planned
        } else {
            now + self.period
        };
    }

    /// When the next beat is due.
    pub const fn poll_timeout(&self) -> Time {
        self.next
    }

    /// The heartbeat to send.
    pub fn poll_transmit(&mut self) -> Option<CanFrame> {
        core::mem::take(&mut self.due).then(|| emit_heartbeat(self.node, self.state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::new(5).unwrap();
    const CONSUMER_TIME: Duration = Duration::from_millis(150);

    const fn ms(ms: u64) -> Time {
        Time(ms * 1_000_000)
    }

    fn beat(consumer: &mut HeartbeatConsumer, at: Time, raw: u8) -> Option<HeartbeatEvent> {
        consumer.handle_frame(at, &CanFrame::standard(0x705, &[raw]))
    }

    #[test]
    fn a_silent_node_is_lost_once_and_found_again() {
        let mut consumer = HeartbeatConsumer::new(NODE, CONSUMER_TIME);
        assert_eq!(consumer.poll_timeout(), Time::NEVER);
        let event = beat(&mut consumer, ms(10), 0x7F);
        let to = NmtState::PreOperational;
        assert_eq!(event, Some(HeartbeatEvent::Changed { from: None, to }));
        assert_eq!(consumer.poll_timeout(), ms(160));
        assert_eq!(consumer.handle_timeout(ms(159)), None);
        let waited = Duration::from_millis(150);
        assert_eq!(
            consumer.handle_timeout(ms(160)),
            Some(HeartbeatEvent::Lost { waited })
        );
        assert_eq!(consumer.handle_timeout(ms(999)), None);
        assert!(beat(&mut consumer, ms(1000), 0x05).is_some());
        assert_eq!(consumer.poll_timeout(), ms(1150));
    }

    #[test]
    fn a_change_of_state_names_both_states() {
        let mut consumer = HeartbeatConsumer::new(NODE, CONSUMER_TIME);
        beat(&mut consumer, ms(0), 0x7F);
        assert_eq!(beat(&mut consumer, ms(5), 0x7F), None);
        let event = beat(&mut consumer, ms(10), 0x05);
        let (from, to) = (Some(NmtState::PreOperational), NmtState::Operational);
        assert_eq!(event, Some(HeartbeatEvent::Changed { from, to }));
    }

    #[test]
    fn a_boot_up_is_told_and_starts_no_watch() {
        let mut consumer = HeartbeatConsumer::new(NODE, CONSUMER_TIME);
        beat(&mut consumer, ms(0), 0x05);
        assert_eq!(
            beat(&mut consumer, ms(5), 0x00),
            Some(HeartbeatEvent::BootUp)
        );
        assert_eq!(consumer.poll_timeout(), Time::NEVER);
    }

    #[test]
    fn other_nodes_and_malformed_beats_are_not_taken() {
        let mut consumer = HeartbeatConsumer::new(NODE, CONSUMER_TIME);
        assert_eq!(
            consumer.handle_frame(ms(0), &CanFrame::standard(0x706, &[5])),
            None
        );
        assert_eq!(
            consumer.handle_frame(ms(0), &CanFrame::standard(0x705, &[5, 5])),
            None
        );
        assert_eq!(consumer.state(), None);
    }

    #[test]
    fn a_node_that_must_beat_is_lost_even_if_it_never_did() {
        let mut consumer = HeartbeatConsumer::new(NODE, CONSUMER_TIME);
        consumer.expect(ms(100));
        assert!(consumer.handle_timeout(ms(250)).is_some());
    }

    #[test]
    fn our_heartbeat_keeps_its_period_and_does_not_catch_up_after_a_stall() {
        let mut producer = HeartbeatProducer::new(NODE, Duration::from_millis(50));
        producer.handle_timeout(ms(0));
        assert_eq!(producer.poll_transmit().unwrap().to_string(), "705#05");
        assert_eq!(producer.poll_transmit(), None);
        producer.handle_timeout(ms(49));
        assert_eq!(producer.poll_transmit(), None);
        producer.handle_timeout(ms(51));
        assert!(producer.poll_transmit().is_some());
        assert_eq!(producer.poll_timeout(), ms(100));
        producer.handle_timeout(ms(1000));
        assert!(producer.poll_transmit().is_some());
        assert_eq!(producer.poll_transmit(), None);
        assert_eq!(producer.poll_timeout(), ms(1050));
    }
}
