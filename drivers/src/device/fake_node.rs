//! A small CANopen node for the tests of the devices: dictionary, SDO server, NMT, heartbeat
//! and mapped PDOs, with bad manners on demand. It shares nothing with the drivers but frames.

use std::collections::{BTreeMap, VecDeque};

use wire::can::CanFrame;

pub(super) const NODE: u16 = 5;

/// How the node misbehaves.
#[derive(Debug, Default)]
pub(super) struct Manners {
    /// SDO requests that are swallowed from now on.
    pub(super) deaf_requests: u32,
    /// Objects whose reads differ from what was written.
    pub(super) lies: Vec<(u16, u8)>,
    /// Objects that refuse to be written, and how.
    pub(super) refuses: Vec<(u16, u8, u32)>,
    pub(super) no_heartbeat: bool,
    pub(super) no_pdos: bool,
    pub(super) short_pdos: bool,
    /// PDOs carry their first two objects exchanged, whatever the mapping says.
    pub(super) exchanged_objects: bool,
    pub(super) never_operational: bool,
}

#[derive(Debug)]
pub(super) struct FakeNode {
    pub(super) objects: BTreeMap<(u16, u8), Vec<u8>>,
    pub(super) manners: Manners,
    /// NMT state as the heartbeat says it; `None`: not powered or still booting.
    pub(super) nmt: Option<u8>,
    pub(super) sent: VecDeque<CanFrame>,
    /// Everything that was written, in order.
    pub(super) written: Vec<(u16, u8, u64)>,
    segments: Option<(Vec<u8>, u8)>,
    next_heartbeat_ms: u64,
}

impl FakeNode {
    pub(super) fn new(device_type: u32) -> Self {
        let mut node = Self {
            objects: BTreeMap::new(),
            manners: Manners::default(),
            nmt: Some(0x7F),
            sent: VecDeque::new(),
            written: Vec::new(),
            segments: None,
            next_heartbeat_ms: 0,
        };
        node.set_u32(0x1000, 0, device_type);
        node.set(0x1001, 0, &[0]);
        node.set(0x1008, 0, b"fake device");
        node.set(0x1018, 0, &[4]);
        for (sub, value) in [(1, 0x0AA), (2, 0x0BB), (3, 0x0CC), (4, 0x0DD)] {
            node.set_u32(0x1018, sub, value);
        }
        node.set_u32(0x1016, 1, 0);
        node.set(0x1017, 0, &[0, 0]);
        for pdo in 0..4_u16 {
            for (communication, mapping, base) in
                [(0x1400, 0x1600, 0x200_u32), (0x1800, 0x1A00, 0x4000_0180)]
            {
                let cob_id = base + u32::from(pdo) * 0x100 + u32::from(NODE);
                node.set_u32(communication + pdo, 1, cob_id);
                node.set(communication + pdo, 2, &[255]);
                node.set(mapping + pdo, 0, &[0]);
                (1..=4).for_each(|sub| node.set_u32(mapping + pdo, sub, 0));
            }
            node.set(0x1800 + pdo, 3, &[10, 0]);
        }
        node
    }

    pub(super) fn set(&mut self, index: u16, sub: u8, data: &[u8]) {
        self.objects.insert((index, sub), data.to_vec());
    }

    pub(super) fn set_u32(&mut self, index: u16, sub: u8, value: u32) {
        self.set(index, sub, &value.to_le_bytes());
    }

    pub(super) fn get(&self, index: u16, sub: u8) -> i64 {
        let data = &self.objects[&(index, sub)];
        let mut bytes = if data.last().is_some_and(|top| top & 0x80 != 0) {
            [0xFF; 8]
        } else {
            [0; 8]
        };
        bytes[..data.len()].copy_from_slice(data);
        i64::from_le_bytes(bytes)
    }

    pub(super) fn operational(&self) -> bool {
        self.nmt == Some(5)
    }

    /// Boots: boot-up message, pre-operational.
    pub(super) fn boot(&mut self) {
        self.nmt = Some(0x7F);
        self.set(0x1017, 0, &[0, 0]);
        self.sent.push_back(CanFrame::standard(0x700 + NODE, &[0]));
    }

    pub(super) fn emergency(&mut self, code: u16) {
        let [low, high] = code.to_le_bytes();
        let payload = [low, high, 0x20, 0, 0, 0, 0, 0];
        self.sent
            .push_back(CanFrame::standard(0x080 + NODE, &payload));
    }

    pub(super) fn beat(&mut self, now_ms: u64) {
        let period = self.get(0x1017, 0) as u64;
        let Some(state) = self.nmt.filter(|_| period > 0) else {
            return;
        };
        if now_ms >= self.next_heartbeat_ms && !self.manners.no_heartbeat {
            self.next_heartbeat_ms = now_ms + period;
            self.sent
                .push_back(CanFrame::standard(0x700 + NODE, &[state]));
        }
    }

    /// Takes a frame from the bus; an RPDO is written to its mapped objects (and `true`).
    pub(super) fn hear(&mut self, frame: &CanFrame) -> bool {
        let Some(id) = frame.standard_id().filter(|_| self.nmt.is_some()) else {
            return false;
        };
        if id == 0 && (frame.data()[1] == 0 || u16::from(frame.data()[1]) == NODE) {
            match frame.data()[0] {
                0x01 if !self.manners.never_operational => self.nmt = Some(5),
                0x80 => self.nmt = Some(0x7F),
                _ => {}
            }
        } else if id == 0x600 + NODE {
            self.serve(frame.data().try_into().unwrap());
        } else if self.operational() {
            return (0..4_u16).any(|pdo| self.take_rpdo(pdo, u32::from(id), frame.data()));
        }
        false
    }

    fn take_rpdo(&mut self, pdo: u16, id: u32, mut data: &[u8]) -> bool {
        if self.get(0x1400 + pdo, 1) as u32 != id {
            return false;
        }
        for sub in 1..=self.get(0x1600 + pdo, 0) as u8 {
            let entry = self.get(0x1600 + pdo, sub) as u32;
            let (value, rest) = data.split_at((entry & 0xFF) as usize / 8);
            self.set((entry >> 16) as u16, (entry >> 8) as u8, value);
            data = rest;
        }
        true
    }

    /// Sends the synchronous PDOs.
    pub(super) fn sync(&mut self) {
        if !self.operational() || self.manners.no_pdos {
            return;
        }
        for pdo in 0..4_u16 {
            let cob_id = self.get(0x1800 + pdo, 1) as u32;
            if cob_id & 0x8000_0000 != 0 || self.get(0x1800 + pdo, 2) != 1 {
                continue;
            }
            let mut payload = Vec::new();
            let mut subs: Vec<u8> = (1..=self.get(0x1A00 + pdo, 0) as u8).collect();
            if self.manners.exchanged_objects && subs.len() > 1 {
                subs.swap(0, 1);
            }
            for sub in subs {
                let entry = self.get(0x1A00 + pdo, sub) as u32;
                payload.extend(&self.objects[&((entry >> 16) as u16, (entry >> 8) as u8)]);
            }
            if self.manners.short_pdos {
                payload.pop();
            }
            self.sent
                .push_back(CanFrame::standard((cob_id & 0x7FF) as u16, &payload));
        }
    }

    fn reply(&mut self, payload: [u8; 8]) {
        self.sent
            .push_back(CanFrame::standard(0x580 + NODE, &payload));
    }

    fn serve(&mut self, request: [u8; 8]) {
        if self.manners.deaf_requests > 0 {
            self.manners.deaf_requests -= 1;
            return;
        }
        let [command, low, high, sub, ..] = request;
        let index = u16::from_le_bytes([low, high]);
        let abort = |code: u32| {
            let [a, b, c, d] = code.to_le_bytes();
            [0x80, low, high, sub, a, b, c, d]
        };
        match command & 0xE0 {
            0x40 => {
                let Some(data) = self.objects.get(&(index, sub)).cloned() else {
                    return self.reply(abort(0x0602_0000));
                };
                let mut reply = [0, low, high, sub, 0, 0, 0, 0];
                if data.len() > 4 {
                    reply[0] = 0x41;
                    reply[4] = data.len() as u8;
                    self.segments = Some((data, 0));
                } else {
                    reply[0] = 0x43 | ((4 - data.len() as u8) << 2);
                    reply[4..4 + data.len()].copy_from_slice(&data);
                    reply[4] ^= u8::from(self.manners.lies.contains(&(index, sub)));
                }
                self.reply(reply);
            }
            0x60 => self.serve_segment(),
            0x20 => {
                let refused = self.manners.refuses.iter();
                let mut refused = refused.filter(|(i, s, _)| (*i, *s) == (index, sub));
                if let Some((_, _, code)) = refused.next() {
                    let code = *code;
                    return self.reply(abort(code));
                }
                let Some(old) = self.objects.get(&(index, sub)) else {
                    return self.reply(abort(0x0602_0000));
                };
                let len = 4 - usize::from(command >> 2 & 3);
                if old.len() != len {
                    return self.reply(abort(0x0607_0010));
                }
                let data = request[4..4 + len].to_vec();
                let mut bytes = [0; 8];
                bytes[..len].copy_from_slice(&data);
                self.written.push((index, sub, u64::from_le_bytes(bytes)));
                self.set(index, sub, &data);
                self.reply([0x60, low, high, sub, 0, 0, 0, 0]);
            }
            _ => self.segments = None,
        }
    }

    fn serve_segment(&mut self) {
        let Some((data, toggle)) = self.segments.take() else {
            return;
        };
        let count = data.len().min(7);
        let last = u8::from(data.len() <= 7);
        let mut reply = [0; 8];
        reply[0] = toggle | ((7 - count as u8) << 1) | last;
        reply[1..=count].copy_from_slice(&data[..count]);
        if last == 0 {
            self.segments = Some((data[count..].to_vec(), toggle ^ 0x10));
        }
        self.reply(reply);
    }
}
