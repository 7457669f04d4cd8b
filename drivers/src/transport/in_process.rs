//! A world in this process, in virtual time: no wall clock, the same result every run.

use core::time::Duration;
use std::collections::VecDeque;
use units::Time;
use wire::canopen::sync::emit_sync;
use wire::{Arrival, Payload, Port, Ports};

use super::sync_grid::SyncGrid;
use super::{SendError, Transport};

/// What Linux says of a period that is none.
const EINVAL: i32 = 22;

/// What is at the other end of the ports: emulated devices and their machine.
///
/// # Example
///
/// A world in which every frame comes back 300 µs later.
///
/// ```
/// use drivers::transport::in_process::{InProcess, World};
/// use drivers::transport::{SendError, Transport};
/// use std::time::Duration;
/// use units::Time;
/// use wire::can::CanFrame;
/// use wire::{Arrival, Input, Payload, Port};
///
/// #[derive(Default)]
/// struct Echo(Option<Arrival>, Time);
///
/// impl World for Echo {
///     fn next_event(&self) -> Time {
///         self.0.as_ref().map_or(Time::NEVER, |it| it.at)
///     }
///     fn advance(&mut self, to: Time) {
///         self.1 = to;
///     }
///     fn deliver(&mut self, at: Time, port: Port, it: &Payload) -> Result<(), SendError> {
///         let at = at + Duration::from_micros(300);
///         self.0 = Some(Arrival { port, at, input: Input::Payload(it.clone()) });
///         Ok(())
///     }
///     fn collect(&mut self) -> Option<Arrival> {
///         self.0.take_if(|it| it.at <= self.1)
///     }
/// }
///
/// let mut bus = InProcess::new(Echo::default());
/// bus.send(Port(2), &Payload::Frame(CanFrame::standard(0x601, &[1])))?;
/// let answer = bus.receive(Time::from_seconds(1.0));
/// assert_eq!(answer.map(|it| (it.port, it.at)), Some((Port(2), Time(300_000))));
/// assert_eq!(bus.now(), Time(300_000), "no time is waited for in vain");
/// # Ok::<(), SendError>(())
/// ```
pub trait World {
    /// The world's present time. Ahead of the host's when the host was held up.
    fn now(&self) -> Time {
        Time::ZERO
    }

    /// When something happens by itself next; [`Time::NEVER`] for never.
    fn next_event(&self) -> Time;

    /// Lets time pass up to `to`.
    fn advance(&mut self, to: Time);

    /// Lets time pass to the next moment at which something may reach the host, at most to `to`,
    /// and says to when. A world that knows better than its next event is asked less often.
    fn advance_until_arrival(&mut self, to: Time) -> Time {
        let next = self.next_event().min(to);
        self.advance(next);
        next
    }

    /// Takes what the host sends.
    ///
    /// # Errors
    /// When the port cannot take it; nothing is sent then.
    fn deliver(&mut self, at: Time, port: Port, payload: &Payload) -> Result<(), SendError>;

    /// The next thing that reaches the host, if it has arrived by the world's present time.
    fn collect(&mut self) -> Option<Arrival>;
}

/// How often a world may ask for the same moment before it is taken to hang.
const ROUNDS_MAX: u32 = 1_000_000;

/// A transport whose other end is a [`World`].
#[derive(Debug)]
pub struct InProcess<W> {
    world: W,
    near: NearEnd,
}

/// The host's end of the ports. It knows its world as a `dyn`: one loop serves all worlds, compiled here and not
/// once more wherever a world is.
#[derive(Debug)]
struct NearEnd {
    now: Time,
    syncs: SyncGrid,
    /// What could wait, in order, and behind it at most one that could not.
    kept: VecDeque<Arrival>,
}

impl NearEnd {
    fn now(&self, world: &dyn World) -> Time {
        self.now.max(world.now())
    }

    /// Sends the SYNCs that are due; the host does not hear its own.
    fn send_due_syncs(&mut self, world: &mut dyn World) {
        self.syncs.send_due(self.now, |port, at| {
            // A SYNC that the port cannot take is lost, as on a real bus.
            let _ = world.deliver(at, port, &Payload::Frame(emit_sync(None)));
        });
    }

    /// What has arrived by now: the first thing, once there is something that cannot wait.
    fn arrived(&mut self, world: &mut dyn World, unhurried: Ports) -> Option<Arrival> {
        let mut is_due = self.kept.iter().any(|it| !it.can_wait(unhurried));
        while !is_due && let Some(arrival) = world.collect() {
            is_due = !arrival.can_wait(unhurried);
            self.kept.push_back(arrival);
        }
        is_due.then(|| self.kept.pop_front())?
    }

    /// # Panics
    /// When the world asks for the same moment without end.
    fn receive(&mut self, world: &mut dyn World, until: Time, unhurried: Ports) -> Option<Arrival> {
        let mut rounds = 0;
        self.now = self.now(world);
        loop {
            if let Some(arrival) = self.arrived(world, unhurried) {
                return Some(arrival);
            }
            let to = until.min(self.syncs.next()).max(self.now);
            let before = self.now;
            // A world may be late for an event, but time does not run backwards.
            self.now = world.advance_until_arrival(to).max(self.now);
            self.send_due_syncs(world);
            if self.now >= until {
                world.advance(self.now);
                return self.arrived(world, Ports::NONE);
            }
            rounds = if self.now == before { rounds + 1 } else { 0 };
            assert!(rounds < ROUNDS_MAX, "the world hangs at {}", self.now);
        }
    }

    fn sleep_until(&mut self, world: &mut dyn World, until: Time) {
        self.now = self.now(world);
        while self.now < until {
            self.now = until.min(self.syncs.next()).max(self.now);
            self.send_due_syncs(world);
            world.advance(self.now);
        }
    }
}

impl<W> InProcess<W> {
    /// Starts at [`Time::ZERO`].
    pub const fn new(world: W) -> Self {
        let near = NearEnd {
            now: Time::ZERO,
            syncs: SyncGrid::new(),
            kept: VecDeque::new(),
        };
        Self { world, near }
    }

    /// The world.
    pub const fn world(&self) -> &W {
        &self.world
    }

    /// The world, to meddle with it: faults, power, hands on the stage.
    pub const fn world_mut(&mut self) -> &mut W {
        &mut self.world
    }

    /// Gives the world back.
    pub fn into_world(self) -> W {
        self.world
    }
}

impl<W: World> Transport for InProcess<W> {
    fn now(&self) -> Time {
        self.near.now(&self.world)
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.world.deliver(self.near.now, port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.receive_unhurried(until, Ports::NONE)
    }

    /// # Panics
    /// When the world asks for the same moment without end.
    fn receive_unhurried(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        self.near.receive(&mut self.world, until, unhurried)
    }

    fn sleep_until(&mut self, until: Time) {
        self.near.sleep_until(&mut self.world, until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        if period.is_some_and(|period| period.is_zero()) {
            return Err(SendError::System {
                port,
                errno: EINVAL,
            });
        }
        self.near.syncs.set(self.near.now, port, period);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::Input;
    use wire::can::CanFrame;

    /// Answers each frame after 300 µs and writes down what it got.
    #[derive(Default)]
    struct Echo {
        now: Time,
        heard: Vec<(Time, String)>,
        answers: Vec<Arrival>,
    }

    impl World for Echo {
        fn next_event(&self) -> Time {
            self.answers.first().map_or(Time::NEVER, |answer| answer.at)
        }

        fn advance(&mut self, to: Time) {
            self.now = to;
        }

        fn deliver(&mut self, at: Time, port: Port, payload: &Payload) -> Result<(), SendError> {
            let Payload::Frame(frame) = payload else {
                return Err(SendError::WrongKind { port });
            };
            self.heard.push((at, frame.to_string()));
            let at = at + Duration::from_micros(300);
            let input = Input::Payload(payload.clone());
            self.answers.push(Arrival { port, at, input });
            Ok(())
        }

        fn collect(&mut self) -> Option<Arrival> {
            if self.answers.first()?.at > self.now {
                return None;
            }
            Some(self.answers.remove(0))
        }
    }

    const MS: u64 = 1_000_000;

    #[test]
    fn time_jumps_to_what_happens_next_and_no_further_than_asked() {
        let mut bus = InProcess::new(Echo::default());
        let frame = Payload::Frame(CanFrame::standard(0x601, &[1]));
        bus.send(Port(2), &frame).unwrap();
        let answer = bus.receive(Time(MS)).unwrap();
        assert_eq!((answer.port, answer.at), (Port(2), Time(300_000)));
        assert_eq!(bus.now(), Time(300_000));
        assert_eq!(bus.receive(Time(MS)), None);
        assert_eq!(bus.now(), Time(MS));
    }

    #[test]
    fn what_arrives_at_the_deadline_itself_is_not_missed() {
        let mut bus = InProcess::new(Echo::default());
        let frame = Payload::Frame(CanFrame::standard(0x601, &[]));
        bus.send(Port(0), &frame).unwrap();
        assert!(bus.receive(Time(300_000)).is_some());
    }

    #[test]
    fn syncs_are_sent_on_their_grid_until_stopped() {
        let mut bus = InProcess::new(Echo::default());
        bus.set_sync(Port(0), Some(Duration::from_millis(2)))
            .unwrap();
        while bus.receive(Time(5 * MS)).is_some() {}
        bus.set_sync(Port(0), None).unwrap();
        while bus.receive(Time(9 * MS)).is_some() {}
        let at: Vec<_> = bus.world().heard.iter().map(|(at, _)| at.nanos()).collect();
        assert_eq!(at, [2 * MS, 4 * MS]);
        assert!(bus.world().heard.iter().all(|(_, frame)| frame == "080#"));
    }

    #[test]
    fn a_period_of_zero_is_refused() {
        let mut bus = InProcess::new(Echo::default());
        assert!(bus.set_sync(Port(0), Some(Duration::ZERO)).is_err());
    }

    /// Says these at their times.
    struct Talker(Time, VecDeque<Arrival>);

    impl World for Talker {
        fn next_event(&self) -> Time {
            self.1.front().map_or(Time::NEVER, |it| it.at)
        }

        fn advance(&mut self, to: Time) {
            self.0 = to;
        }

        fn deliver(&mut self, _: Time, port: Port, _: &Payload) -> Result<(), SendError> {
            Err(SendError::WrongKind { port })
        }

        fn collect(&mut self) -> Option<Arrival> {
            self.1.pop_front_if(|it| it.at <= self.0)
        }
    }

    fn says(port: u8, at_ms: u64, payload: Payload) -> Arrival {
        let (port, at, input) = (Port(port), Time(at_ms * MS), Input::Payload(payload));
        Arrival { port, at, input }
    }

    #[test]
    fn bytes_that_nobody_waits_for_come_with_what_somebody_does_in_order() {
        let bytes = |at_ms| says(1, at_ms, Payload::Bytes(vec![b'x']));
        let frame = says(0, 5, Payload::Frame(CanFrame::standard(0x181, &[])));
        let all = [bytes(1), bytes(3), frame.clone(), bytes(6), bytes(20)];
        let mut bus = InProcess::new(Talker(Time::ZERO, all.into()));
        let mut unhurried = Ports::NONE;
        unhurried.insert(Port(1));
        let mut next = |until: u64| {
            let arrival = bus.receive_unhurried(Time(until * MS), unhurried);
            (arrival, bus.now())
        };
        assert_eq!(next(10), (Some(bytes(1)), Time(5 * MS)));
        assert_eq!(next(10), (Some(bytes(3)), Time(5 * MS)));
        assert_eq!(next(10), (Some(frame), Time(5 * MS)));
        assert_eq!(
            next(10),
            (Some(bytes(6)), Time(10 * MS)),
            "the wait is over"
        );
        assert_eq!(next(12), (None, Time(12 * MS)));
        let at_once = bus.receive(Time(30 * MS));
        assert_eq!((at_once, bus.now()), (Some(bytes(20)), Time(20 * MS)));
    }
}
