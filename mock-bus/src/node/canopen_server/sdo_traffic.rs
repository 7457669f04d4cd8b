//! SDO frames of the node: the polite server's replies, spoilt where the manners say so, and
//! what a write to the communication area sets off.

use std::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::canopen::sdo::{AbortCode, SdoRequest, SdoResponse, Segment};
use wire::canopen::{Function, Object};

use super::dictionary::Dictionary;
use super::exchange::{Objects, Reply};
use super::manners::Rudeness;
use super::rules::{self, Area};
use super::{CanopenServer, ServerEvent};

/// The dictionary as the SDO server sees it, with the rules of the communication area.
struct ServedObjects<'a> {
    dictionary: &'a mut Dictionary,
    rudeness: &'a mut Rudeness,
    written: Vec<Object>,
}

impl Objects for ServedObjects<'_> {
    fn length(&self, object: Object) -> Option<usize> {
        self.dictionary.length(object)
    }

    fn read(&mut self, object: Object) -> Result<Vec<u8>, AbortCode> {
        self.rudeness.refuse_absent(object)?;
        let beyond_history = object.index == 0x1003
            && i64::from(object.sub) > self.dictionary.integer(0x1003, 0)
            && self.dictionary.contains(object);
        if beyond_history {
            return Err(AbortCode::NoData);
        }
        self.dictionary.read(object)
    }

    fn check_download(&mut self, object: Object, size: Option<usize>) -> Result<(), AbortCode> {
        self.rudeness.refuse_absent(object)?;
        self.rudeness.refuse_read_only(object)?;
        let concerned = self.rudeness.concerns(object.index);
        if concerned && self.rudeness.take("sdo_busy", |m| &mut m.sdo_busy) {
            return Err(AbortCode::DeviceState);
        }
        self.dictionary.check_download(object, size)
    }

    fn write(&mut self, object: Object, data: &[u8]) -> Result<(), AbortCode> {
        self.check_download(object, Some(data.len()))?;
        let value = self.dictionary.check_value(object, data)?;
        rules::check(self.dictionary, object, &value)?;
        let present = self.dictionary.value(object);
        self.rudeness.refuse_value(object, &present, &value)?;
        let value = self.rudeness.change_value(object, value);
        let mapping = matches!(Area::of(object.index), Area::Mapping { .. });
        let ignored =
            |m: &mut Rudeness| m.take("mapping_ignored_writes", |m| &mut m.mapping_ignored_writes);
        if mapping && object.sub > 0 && ignored(self.rudeness) {
            return Ok(());
        }
        self.dictionary.put(object, value);
        self.written.push(object);
        Ok(())
    }
}

impl CanopenServer {
    pub(super) fn handle_sdo(&mut self, now: Time, frame: &CanFrame) {
        if !self.phase.communicates() {
            return;
        }
        let object = self.object_of(frame);
        let concerned = self.rudeness.concerns(object.index);
        let ignore =
            |m: &mut Rudeness| m.take("sdo_ignored_requests", |m| &mut m.sdo_ignored_requests);
        if concerned && ignore(&mut self.rudeness) {
            return;
        }
        self.flood_after_abort(frame);
        let mut replies = Vec::new();
        if self.refuses_block(frame) {
            let code = AbortCode::UnknownCommand;
            let refusal = SdoResponse::Abort { object, code };
            return self.send_replies(now, now, object, &[Reply::Response(refusal)]);
        }
        let mut objects = ServedObjects {
            dictionary: &mut self.dictionary,
            rudeness: &mut self.rudeness,
            written: Vec::new(),
        };
        self.sdo
            .handle(now, frame.data(), &mut objects, &mut replies);
        let written = objects.written;
        let mut work = Duration::ZERO;
        for object in written {
            work += self.after_write(now, object);
        }
        self.send_replies(now + work, now, object, &replies);
    }

    pub(super) fn expire_sdo(&mut self, now: Time) {
        let object = self.sdo.object();
        let mut replies = Vec::new();
        self.sdo.handle_timeout(now, &mut replies);
        self.send_replies(now, now, object, &replies);
    }

    /// The object a request is about: its own, or that of the transfer that runs.
    fn object_of(&self, frame: &CanFrame) -> Object {
        if self.sdo.takes_block_segments() {
            return self.sdo.object();
        }
        match SdoRequest::parse(frame.data()) {
            Ok(
                SdoRequest::UploadInitiate { object }
                | SdoRequest::DownloadExpedited { object, .. }
                | SdoRequest::DownloadInitiate { object, .. }
                | SdoRequest::BlockDownloadInitiate { object, .. }
                | SdoRequest::BlockUploadInitiate { object, .. },
            ) => object,
            _ => self.sdo.object(),
        }
    }

    fn refuses_block(&mut self, frame: &CanFrame) -> bool {
        let request = SdoRequest::parse(frame.data());
        let block = matches!(
            request,
            Ok(SdoRequest::BlockDownloadInitiate { .. } | SdoRequest::BlockUploadInitiate { .. })
        );
        let busy = self.sdo.takes_block_segments();
        block
            && !busy
            && self
                .rudeness
                .switched("sdo_blocks_refused", |m| m.sdo_blocks_refused)
    }

    /// What a write sets off; the time the node works on it before it answers.
    fn after_write(&mut self, now: Time, object: Object) -> Duration {
        match (object.index, object.sub) {
            (0x1003, 0) => {
                self.errors.history.clear();
                self.publish_errors();
            }
            (0x1010, 1) => {
                self.set(0x1010, 1, 1);
                self.dictionary.store();
                return Duration::from_millis(self.rudeness.left.store_delay_ms);
            }
            (0x1011, 1) => {
                self.set(0x1011, 1, 1);
                self.dictionary.restore_factory();
            }
            (0x1005 | 0x1006 | 0x1019, _) => self.restart_own_sync(now),
            (0x1016, _) => self.reload_consumers(now),
            (0x1017, _) => self.restart_heartbeat(now),
            (index, _) => self.reload_pdo(now, Area::of(index)),
        }
        self.events.push_back(ServerEvent::Written(object));
        Duration::ZERO
    }

    /// A server that had filled its queue before it read the abort (python-canopen issue 409).
    fn flood_after_abort(&mut self, frame: &CanFrame) {
        const ABORT: u8 = 0x80;
        if frame.data().first() != Some(&ABORT) {
            return;
        }
        let flood =
            |m: &mut Rudeness| m.take("sdo_floods_after_abort", |m| &mut m.sdo_floods_after_abort);
        if !flood(&mut self.rudeness) {
            return;
        }
        for number in 0..8 {
            let segment = Segment::new(number % 2 == 1, false, b"STALE!!");
            let segment = segment.expect("seven bytes fit");
            self.send_sdo(SdoResponse::UploadSegment(segment).emit());
        }
    }

    fn send_sdo(&mut self, payload: [u8; 8]) {
        let id = self.node.cob_id(Function::SdoResponse);
        self.outbox.send(CanFrame::standard(id, &payload));
    }

    fn send_replies(&mut self, start: Time, now: Time, object: Object, replies: &[Reply]) {
        let id = self.node.cob_id(Function::SdoResponse);
        let concerned = self.rudeness.concerns(object.index);
        for reply in replies {
            let (due, payloads) = match (reply, concerned) {
                (Reply::Response(response), true) => (
                    start + self.rudeness.delay(),
                    self.rudeness.spoil(*response),
                ),
                (Reply::Segment(_), true) if self.rudeness.loses_segment() => continue,
                (Reply::Response(response), false) => (start, vec![response.emit().to_vec()]),
                (Reply::Segment(segment), _) => (start, vec![segment.emit().to_vec()]),
            };
            for payload in payloads {
                self.outbox
                    .send_at(now, due, CanFrame::standard(id, &payload));
            }
        }
    }
}

impl Rudeness {
    fn loses_segment(&mut self) -> bool {
        self.take("sdo_lost_block_segments", |m| {
            &mut m.sdo_lost_block_segments
        })
    }

    /// The payloads that go out instead of one response.
    fn spoil(&mut self, response: SdoResponse) -> Vec<Vec<u8>> {
        if self.take("sdo_lost_replies", |m| &mut m.sdo_lost_replies) {
            return Vec::new();
        }
        let response = self.spoil_toggle(response);
        let mut right = self.spoil_size(response).emit();
        self.spoil_expedited(response, &mut right);
        let mut payloads = Vec::new();
        let mut payload = right.to_vec();
        if response.object().is_some() {
            if self.take("sdo_stray_replies", |m| &mut m.sdo_stray_replies) {
                payloads.push(for_next_index(right));
            }
            if self.take("sdo_wrong_indices", |m| &mut m.sdo_wrong_indices) {
                payload = for_next_index(right);
            }
        }
        if self.take("sdo_short_replies", |m| &mut m.sdo_short_replies) {
            payload.truncate(3);
        }
        if self.take("sdo_duplicate_responses", |m| {
            &mut m.sdo_duplicate_responses
        }) {
            payloads.push(payload.clone());
        }
        payloads.push(payload);
        payloads
    }
}

impl Rudeness {
    fn spoil_toggle(&mut self, response: SdoResponse) -> SdoResponse {
        const NAME: &str = "sdo_wrong_toggles";
        match response {
            SdoResponse::UploadSegment(mut segment)
                if self.take(NAME, |m| &mut m.sdo_wrong_toggles) =>
            {
                segment.toggle = !segment.toggle;
                SdoResponse::UploadSegment(segment)
            }
            SdoResponse::DownloadSegment { toggle }
                if self.take(NAME, |m| &mut m.sdo_wrong_toggles) =>
            {
                SdoResponse::DownloadSegment { toggle: !toggle }
            }
            other => other,
        }
    }

    /// The unused bytes of an expedited value, which the standard reserves and some leave, and
    /// what its command says of its size.
    fn spoil_expedited(&mut self, response: SdoResponse, payload: &mut [u8; 8]) {
        const NO_SIZE: u8 = 0x42;
        const FOUR_BYTES: u8 = 0x43;
        let SdoResponse::UploadExpedited { data, .. } = response else {
            return;
        };
        if self.switched("sdo_stale_bytes", |m| m.sdo_stale_bytes) {
            payload[4 + data.data().len()..].fill(0xA5);
        }
        if self.switched("sdo_size_bit_omitted", |m| m.sdo_size_bit_omitted) {
            payload[0] = NO_SIZE;
        } else if self.left.sdo_always_four_bytes && payload[0] != FOUR_BYTES {
            self.count("sdo_always_four_bytes");
            payload[0] = FOUR_BYTES;
        }
    }

    fn spoil_size(&mut self, response: SdoResponse) -> SdoResponse {
        const NAME: &str = "sdo_wrong_sizes";
        const TOO_MANY: u32 = 79;
        match response {
            SdoResponse::UploadInitiate { object, .. }
                if self.switched("sdo_sizes_omitted", |m| m.sdo_sizes_omitted) =>
            {
                SdoResponse::UploadInitiate { object, size: None }
            }
            SdoResponse::UploadInitiate { object, size }
                if self.take(NAME, |m| &mut m.sdo_wrong_sizes) =>
            {
                let size = size.map(|size| size + TOO_MANY);
                SdoResponse::UploadInitiate { object, size }
            }
            SdoResponse::BlockUploadInitiate { object, size, crc }
                if self.take(NAME, |m| &mut m.sdo_wrong_sizes) =>
            {
                let size = size.map(|size| size + TOO_MANY);
                SdoResponse::BlockUploadInitiate { object, size, crc }
            }
            other => other,
        }
    }
}

fn for_next_index(payload: [u8; 8]) -> Vec<u8> {
    let [command, low, high, rest @ ..] = payload;
    let [low, high] = (u16::from_le_bytes([low, high]).wrapping_add(1)).to_le_bytes();
    let mut changed = vec![command, low, high];
    changed.extend(rest);
    changed
}
