//! Events as they happen: Server-Sent Events with ids.

use core::convert::Infallible;
use core::time::Duration;
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use axum::Extension;
use axum::extract::{Query, State};
use axum::http::HeaderMap;
use axum::response::sse::{Event as Sent, KeepAlive, Sse};
use futures_util::stream::{self, Stream};
use serde::Deserialize;
use serde_json::json;
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::{Instant, sleep};
use utoipa::IntoParams;

use super::places::{Heard, Keeps};
use super::state::{Closing, STREAMS, State as Shared};
use crate::desk::Desk;
use crate::problem::{Code, Problem, ProblemBody};
use crate::view::Event;

/// How often a stream looks, unless it samples more often.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// A comment keeps a connection alive through what stands between, also while the machine's thread hangs.
const COMMENT_EVERY: Duration = Duration::from_secs(3);

/// How often a stream says that the machine's thread lives. Pages never hear of comments.
const ALIVE_EVERY: Duration = Duration::from_millis(500);

/// Between two samples of every axis.
const SAMPLE_MS: core::ops::RangeInclusive<u64> = 1..=60_000;

/// What of it is sent.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(super) struct Wanted {
    /// Only these kinds, with commas between: `motion,run,axis`.
    #[param(
        pattern = "^(machine|axis|position|motion|run|stop|lease|calibration|question|point|warning)(,(machine|axis|position|motion|run|stop|lease|calibration|question|point|warning))*$"
    )]
    kinds: Option<String>,
    /// After the event of this number; the header `Last-Event-ID` says the same.
    after: Option<u64>,
    /// Also a sample of every axis each so many milliseconds, as events `sample` without an id; at most one for each
    /// state that the machine publishes, which is more than one each SYNC.
    #[param(minimum = 1, maximum = 60000)]
    sample_ms: Option<u64>,
}

struct Following {
    desk: Desk,
    kinds: Option<BTreeSet<String>>,
    newest: u64,
    waiting: VecDeque<Sent>,
    sample: Option<Sampling>,
    alive: Alive,
    closing: Closing,
    _stream: OwnedSemaphorePermit,
    /// Its connection keeps its place among the others.
    _heard: Option<Heard>,
}

struct Sampling {
    every: Duration,
    due: Instant,
    /// When the last one was by the machine's clock: the same again says nothing.
    last_s: f64,
}

/// The proof that the machine's thread lives: an event without an id, whatever kinds are asked for.
struct Alive {
    due: Instant,
    /// The ticks of the machine's thread when it was sent last.
    ticks: u64,
}

impl Alive {
    fn begin() -> Self {
        Self {
            due: Instant::now(),
            ticks: 0,
        }
    }

    /// The event, when it is time for one and the machine's thread has ticked since.
    fn take(&mut self, desk: &Desk) -> Option<Sent> {
        let now = Instant::now();
        if now < self.due {
            return None;
        }
        let beat = desk.beat();
        if beat.ticks == self.ticks {
            return None;
        }
        self.ticks = beat.ticks;
        self.due = now + ALIVE_EVERY;
        let data = json!({"clock_s": beat.clock_s});
        Some(Sent::default().event("alive").data(data.to_string()))
    }
}

impl Sampling {
    fn each(every: Duration) -> Self {
        Self {
            every,
            due: Instant::now(),
            last_s: f64::NEG_INFINITY,
        }
    }

    /// The axes, when it is time for them and the machine has ticked since.
    fn take(&mut self, desk: &Desk) -> Option<Sent> {
        let now = Instant::now();
        let clock_s = desk.beat().clock_s;
        if now < self.due || clock_s <= self.last_s {
            return None;
        }
        self.last_s = clock_s;
        // Whoever was held up begins anew: no burst makes up for what was missed.
        self.due = (self.due + self.every).max(now);
        let axes = json!(desk.axes()).to_string();
        Some(Sent::default().event("sample").data(axes))
    }
}

/// Events as they happen. Each 500 ms an event `alive` without an id says that the machine's thread ticks; a client that
/// hears none for 2 s knows nothing of the machine any more.
#[utoipa::path(
    get, path = "/events", tag = "events",
    params(Wanted, ("Last-Event-ID" = Option<u64>, Header, description = "After the event of this number, as a browser says it")),
    responses(
        (status = 200, description = "Server-Sent Events, each with its id; `data` is an Event", content_type = "text/event-stream", body = String),
        (status = 400, description = "Not understood", body = ProblemBody, content_type = "application/problem+json"),
        (status = 503, description = "Too many streams", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn events(
    State(shared): State<Shared>,
    wanted: Result<Query<Wanted>, axum::extract::rejection::QueryRejection>,
    keeps: Option<Extension<Keeps>>,
    headers: HeaderMap,
) -> Result<Sse<impl Stream<Item = Result<Sent, Infallible>>>, Problem> {
    let Query(wanted) = wanted.map_err(|it| Problem::new(Code::BadRequest, it.body_text(), ""))?;
    let place = Arc::clone(&shared.streams).try_acquire_owned();
    let place = place.map_err(|_| {
        let what = format!("{STREAMS} event streams are open here");
        Problem::new(Code::Busy, what, "close one")
    })?;
    let resumed = headers.get("last-event-id").and_then(|it| it.to_str().ok());
    let resumed = resumed.and_then(|it| it.parse().ok()).or(wanted.after);
    let known = shared.desk.newest_event();
    let newest = match resumed {
        None => known,
        Some(heard) if heard <= known => heard,
        // Never heard from this service: everything is new.
        Some(_) => 0,
    };
    let every = sampled(wanted.sample_ms)?;
    let kinds = wanted.kinds.as_deref().map(kinds_of).transpose()?;
    let following = Following {
        desk: shared.desk,
        kinds,
        newest,
        waiting: VecDeque::new(),
        sample: every.map(Sampling::each),
        alive: Alive::begin(),
        closing: shared.closing,
        _stream: place,
        _heard: keeps.map(|Extension(it)| it.heard()),
    };
    let stream = stream::unfold(following, async |mut following| {
        let sent = following.next().await?;
        Some((Ok(sent), following))
    });
    Ok(Sse::new(stream).keep_alive(KeepAlive::new().interval(COMMENT_EVERY)))
}

/// The kinds with commas between, each of which there must be: a word that is misspelt would wait for ever.
fn kinds_of(text: &str) -> Result<BTreeSet<String>, Problem> {
    let kinds: BTreeSet<String> = text.split(',').map(str::to_owned).collect();
    match kinds.iter().find(|it| !Event::KINDS.contains(&it.as_str())) {
        None => Ok(kinds),
        Some(other) => Err(Problem::new(
            Code::BadRequest,
            format!("`kinds`: `{other}` is no kind of event"),
            format!(
                "give one or more of {}, with commas between",
                Event::KINDS.join(", ")
            ),
        )),
    }
}

/// How often the axes are told, when they are.
fn sampled(sample_ms: Option<u64>) -> Result<Option<Duration>, Problem> {
    match sample_ms {
        Some(it) if !SAMPLE_MS.contains(&it) => {
            let what = format!("sample_ms = {it} is no time between samples");
            let help = format!("give {} to {}", SAMPLE_MS.start(), SAMPLE_MS.end());
            Err(Problem::new(Code::BadRequest, what, help))
        }
        other => Ok(other.map(Duration::from_millis)),
    }
}

impl Following {
    /// `None` when the edge closes and all has been said.
    async fn next(&mut self) -> Option<Sent> {
        loop {
            if let Some(sent) = self.waiting.pop_front() {
                return Some(sent);
            }
            // Asked before the look: whatever was published before it closed is still said.
            let is_last = self.closing.is_now();
            self.look();
            if !self.waiting.is_empty() {
                continue;
            }
            if is_last {
                return None;
            }
            tokio::select! {
                () = sleep(self.look_every()) => {}
                () = self.closing.begun() => {}
            }
        }
    }

    fn look_every(&self) -> Duration {
        let sampled = self.sample.as_ref().map(|it| it.every);
        sampled.map_or(LOOK_EVERY, |it| it.min(LOOK_EVERY))
    }

    fn look(&mut self) {
        let events = self.desk.events(self.newest);
        if let Some(first) = events.first()
            && first.id > self.newest + 1
            && self.newest > 0
        {
            let lost = json!({"from": self.newest + 1, "to": first.id - 1});
            let gap = Sent::default().event("gap").data(lost.to_string());
            self.waiting.push_back(gap);
        }
        for event in events {
            self.newest = event.id;
            let is_wanted = self
                .kinds
                .as_ref()
                .is_none_or(|it| it.contains(&event.kind));
            if is_wanted {
                let sent = Sent::default().id(event.id.to_string()).event(&event.kind);
                self.waiting.push_back(sent.data(json!(event).to_string()));
            }
        }
        let sample = self.sample.as_mut();
        self.waiting
            .extend(sample.and_then(|sample| sample.take(&self.desk)));
        self.waiting.extend(self.alive.take(&self.desk));
    }
}
