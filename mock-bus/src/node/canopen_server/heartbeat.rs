//! Heartbeat consumers: 0x1016 (CiA 301, 7.2.8.2.2).

use std::time::Duration;

use units::Time;
use wire::canopen::NodeId;

/// One producer that this node watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Consumer {
    pub(super) producer: NodeId,
    time: Duration,
    state: Watch,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Watch {
    /// Watching starts with the first heartbeat.
    Unheard,
    Alive {
        deadline: Time,
    },
    Lost,
}

impl Consumer {
    /// From the value of 0x1016 sub 1..; `None` where it watches nobody.
    pub(super) fn from_entry(raw: u32) -> Option<Self> {
        let producer = NodeId::new((raw >> 16) as u8)?;
        let time = Duration::from_millis(u64::from(raw & 0xFFFF));
        (!time.is_zero()).then_some(Self {
            producer,
            time,
            state: Watch::Unheard,
        })
    }

    /// The producer was heard.
    pub(super) fn heard(&mut self, now: Time) {
        let deadline = now + self.time;
        self.state = Watch::Alive { deadline };
    }

    /// `true` once, when the producer has been silent for too long.
    pub(super) fn expires(&mut self, now: Time) -> bool {
        let expired = self.deadline() <= now;
        if expired {
            self.state = Watch::Lost;
        }
        expired
    }

    pub(super) fn deadline(&self) -> Time {
        match self.state {
            Watch::Alive { deadline } => deadline,
            Watch::Unheard | Watch::Lost => Time::NEVER,
        }
    }
}
