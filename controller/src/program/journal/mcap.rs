//! A journal as an MCAP file (mcap.dev, "MCAP Format Specification"), which Foxglove and PlotJuggler open: one channel for
//! each kind of entry, its messages the entries as JSON, with a JSON Schema of what they have. What an entry says nothing
//! of (`null`) is left out of its message. All messages are in one chunk, and the file ends with its index.

use super::entries::Entry;
use super::node::Node;
use super::shape::Shape;

/// What a file begins and ends with.
const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Numbers of the records.
mod record {
    pub(super) const HEADER: u8 = 0x01;
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const MESSAGE_INDEX: u8 = 0x07;
    pub(super) const CHUNK_INDEX: u8 = 0x08;
    pub(super) const STATISTICS: u8 = 0x0B;
    pub(super) const DATA_END: u8 = 0x0F;
}

/// What a record says.
#[derive(Default)]
struct Content(Vec<u8>);

impl Content {
    fn u16(mut self, value: u16) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn plain(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    /// A text, a list or a map: its length in bytes comes first.
    fn bytes(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).plain(bytes)
    }

    fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes())
    }

    fn record(self, number: u8) -> Vec<u8> {
        let mut record = vec![number];
        record.extend((self.0.len() as u64).to_le_bytes());
        record.extend(self.0);
        record
    }
}

/// A kind of entry.
struct Channel<'a> {
    number: u16,
    kind: &'a str,
    /// When each of its messages was written, and where it begins in the chunk.
    index: Vec<(u64, u64)>,
}

/// The whole file.
pub(super) fn mcap_of(entries: &[Entry]) -> Vec<u8> {
    let mut channels = channels_of(entries);
    let about: Vec<u8> = channels.iter().flat_map(|it| about(entries, it)).collect();
    let mut records = about.clone();
    for entry in entries {
        let own = channels.iter_mut().find(|it| it.kind == entry.kind);
        let channel = own.expect("every kind has one");
        channel.index.push((time_ns(entry), records.len() as u64));
        records.extend(message(entry, channel.number));
    }
    let [begin, end] = span(entries);
    let chunk = Content::default()
        .u64(begin)
        .u64(end)
        .u64(records.len() as u64)
        // No checksum.
        .u32(0)
        .text("")
        .u64(records.len() as u64)
        .plain(&records)
        .record(record::CHUNK);
    let library = concat!("truestage ", env!("CARGO_PKG_VERSION"));
    let mut file = MAGIC.to_vec();
    file.extend(
        Content::default()
            .text("")
            .text(library)
            .record(record::HEADER),
    );
    let chunk_at = file.len() as u64;
    file.extend(&chunk);
    let mut places = Content::default();
    let indices_at = file.len();
    for channel in &channels {
        places = places.u16(channel.number).u64(file.len() as u64);
        file.extend(message_index(channel));
    }
    let indices = (file.len() - indices_at) as u64;
    file.extend(Content::default().u32(0).record(record::DATA_END));
    let summary_at = file.len() as u64;
    file.extend(about);
    file.extend(statistics(&channels, [begin, end]));
    let chunk_index = Content::default()
        .u64(begin)
        .u64(end)
        .u64(chunk_at)
        .u64(chunk.len() as u64)
        .bytes(&places.0)
        .u64(indices)
        .text("")
        .u64(records.len() as u64)
        .u64(records.len() as u64);
    file.extend(chunk_index.record(record::CHUNK_INDEX));
    let footer = Content::default().u64(summary_at).u64(0).u32(0);
    file.extend(footer.record(record::FOOTER));
    file.extend(MAGIC);
    file
}

fn channels_of(entries: &[Entry]) -> Vec<Channel<'_>> {
    let mut channels: Vec<Channel<'_>> = Vec::new();
    for entry in entries {
        if channels.iter().all(|it| it.kind != entry.kind) {
            channels.push(Channel {
                number: channels.len() as u16 + 1,
                kind: &entry.kind,
                index: Vec::new(),
            });
        }
    }
    channels
}

/// The schema and the channel of a kind, which have one number.
fn about(entries: &[Entry], channel: &Channel<'_>) -> Vec<u8> {
    let (number, kind) = (channel.number, channel.kind);
    let mut records = Content::default()
        .u16(number)
        .text(&format!("truestage.{kind}"))
        .text("jsonschema")
        .text(&schema_of(entries, kind))
        .record(record::SCHEMA);
    let channel = Content::default()
        .u16(number)
        .u16(number)
        .text(&format!("/{kind}"))
        .text("json")
        .bytes(&[]);
    records.extend(channel.record(record::CHANNEL));
    records
}

fn time_ns(entry: &Entry) -> u64 {
    // Its nanoseconds end in the year 2554.
    u64::try_from(entry.time_us)
        .unwrap_or_default()
        .saturating_mul(1000)
}

/// The first and the last time.
fn span(entries: &[Entry]) -> [u64; 2] {
    let times = || entries.iter().map(time_ns);
    [times().min(), times().max()].map(Option::unwrap_or_default)
}

fn message(entry: &Entry, channel: u16) -> Vec<u8> {
    let said = said(&Node::Object(entry.members.clone()));
    let said = serde_json::to_vec(&said).expect("plain data always serialises");
    let (line, at) = (
        u32::try_from(entry.line).unwrap_or_default(),
        time_ns(entry),
    );
    let message = Content::default().u16(channel).u32(line).u64(at).u64(at);
    message.plain(&said).record(record::MESSAGE)
}

fn message_index(channel: &Channel<'_>) -> Vec<u8> {
    let each = channel.index.iter();
    let places = each.fold(Content::default(), |all, (at, place)| {
        all.u64(*at).u64(*place)
    });
    let index = Content::default().u16(channel.number).bytes(&places.0);
    index.record(record::MESSAGE_INDEX)
}

fn statistics(channels: &[Channel<'_>], [begin, end]: [u64; 2]) -> Vec<u8> {
    let counts = channels.iter().fold(Content::default(), |all, it| {
        all.u16(it.number).u64(it.index.len() as u64)
    });
    let messages = channels.iter().map(|it| it.index.len() as u64).sum();
    Content::default()
        .u64(messages)
        .u16(channels.len() as u16)
        .u32(channels.len() as u32)
        // Neither attachments nor metadata, and one chunk.
        .u32(0)
        .u32(0)
        .u32(1)
        .u64(begin)
        .u64(end)
        .bytes(&counts.0)
        .record(record::STATISTICS)
}

/// What all entries of a kind have.
fn schema_of(entries: &[Entry], kind: &str) -> String {
    let same = entries.iter().filter(|it| it.kind == kind);
    let shapes = same.map(|it| Shape::of("", &Node::Object(it.members.clone())));
    let shape = shapes.reduce(Shape::with).unwrap_or(Shape::Nothing);
    shape.schema("").to_string()
}

/// Without members of which nothing is said.
fn said(node: &Node) -> Node {
    match node {
        Node::Object(members) => {
            let there = members.iter().filter(|it| it.1 != Node::Null);
            Node::Object(there.map(|(key, it)| (key.clone(), said(it))).collect())
        }
        Node::List(items) => Node::List(items.iter().map(said).collect()),
        other => other.clone(),
    }
}
