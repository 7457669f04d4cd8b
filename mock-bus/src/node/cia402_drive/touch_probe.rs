//! Touch probe 1: the position latched at the edges of a fast input (CiA 402-2, 0x60B8 to
//! 0x60BB, 0x60D0, 0x60D5 and 0x60D6).
//!
//! The latch is hardware: it holds the count of the moment, whenever the drive's processor looks.
//! It holds one value for each edge; a further edge overwrites it, also unread. Touch probe 2 is
//! wired to nothing.

use super::Drive;
use super::mechanism::Mechanism;
use crate::plant::ProbeEdge;

const ON: i64 = 1 << 0;
const CONTINUOUS: i64 = 1 << 1;
/// Bits 2 and 3 of the function: its own input, the zero impulse, or the one in 0x60D0:01.
const TRIGGER: i64 = 3 << 2;
const CHOSEN_SOURCE: i64 = 2 << 2;
const AT_POSITIVE_EDGE: i64 = 1 << 4;
const AT_NEGATIVE_EDGE: i64 = 1 << 5;
/// The input that something is wired to (0x60D0).
const WIRED_SOURCE: i64 = 1;

/// Function bit, status bit, toggling status bit, position and count of an edge.
struct EdgeObjects {
    function: i64,
    stored: i64,
    toggle: i64,
    position: u16,
    count: u16,
}

const POSITIVE: EdgeObjects = EdgeObjects {
    function: AT_POSITIVE_EDGE,
    stored: 1 << 1,
    toggle: 1 << 6,
    position: 0x60BA,
    count: 0x60D5,
};

const NEGATIVE: EdgeObjects = EdgeObjects {
    function: AT_NEGATIVE_EDGE,
    stored: 1 << 2,
    toggle: 1 << 7,
    position: 0x60BB,
    count: 0x60D6,
};

impl Drive {
    /// 0x60B8 was written: a rising edge of bit 0 begins anew, bit 0 low ends it.
    pub(super) fn on_probe_function(&mut self) {
        if !self.has_probe() {
            return;
        }
        let on = self.get(0x60B8) & ON;
        let was_on = self.get(0x60B9) & ON;
        if on != was_on {
            self.server.set(0x60B9, 0, on);
        }
    }

    /// What the latch has caught since the last look.
    pub(super) fn take_edges(&mut self, m: &mut impl Mechanism) {
        while let Some(edge) = m.probe_edge() {
            if self.has_probe() && self.is_listening() {
                self.take_edge(edge);
            }
        }
    }

    const fn has_probe(&self) -> bool {
        self.config.touch_probe.is_some()
    }

    fn is_listening(&self) -> bool {
        let wired = match self.get(0x60B8) & TRIGGER {
            0 => true,
            CHOSEN_SOURCE => self.server.get(0x60D0, 1) == WIRED_SOURCE,
            _ => false,
        };
        wired && self.get(0x60B9) & ON != 0
    }

    fn take_edge(&mut self, edge: ProbeEdge) {
        let objects = if edge.rising { POSITIVE } else { NEGATIVE };
        let (function, status) = (self.get(0x60B8), self.get(0x60B9));
        let spent = function & CONTINUOUS == 0 && status & objects.stored != 0;
        if function & objects.function == 0 || spent {
            return;
        }
        let probe = self.config.touch_probe.unwrap_or_default();
        let toggled = if probe.status_toggles {
            status ^ objects.toggle
        } else {
            status
        };
        self.server.set(0x60B9, 0, toggled | objects.stored);
        let position = self.sign() * edge.count + self.offset;
        let shown = self.shown(position);
        self.server.set(objects.position, 0, shown);
        if probe.edge_counters {
            let count = self.get(objects.count) + 1;
            self.server.set(objects.count, 0, count);
        }
    }
}
