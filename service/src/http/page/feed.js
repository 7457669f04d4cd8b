// The stream of events, kept as long as somebody listens.
"use strict";

const KINDS = ["machine", "axis", "position", "motion", "run", "question", "point", "stop", "lease", "calibration", "warning"];
// The past that a page begins with.
export const EVENTS_SHOWN = 60;
const LOOK_MS = 1000;
// A connection that says nothing for so long is given up: no computer in between tells that it has dropped it.
const DEAD_MS = 6000;
const ANSWER_MS = 2000;

// Tells `hear(kind, data)` of each message; `open` and `lost` are of the connection.
export class Feed {
  constructor(hear) {
    this.hear = hear;
    this.stream = null;
    this.newest = null;
    this.heard = 0;
    this.looking = null;
  }

  begin() {
    if (this.looking) return;
    this.looking = setInterval(() => this.look(), LOOK_MS);
    this.connect();
  }

  end() {
    clearInterval(this.looking);
    [this.looking, this.newest] = [null, null];
    this.drop();
  }

  drop() {
    if (this.stream) this.stream.close();
    this.stream = null;
  }

  look() {
    const isClosed = this.stream && this.stream.readyState === EventSource.CLOSED;
    if (isClosed || performance.now() - this.heard > DEAD_MS) this.connect();
  }

  async connect() {
    this.drop();
    this.heard = performance.now();
    try {
      this.newest ??= await oldest();
    } catch {
      this.hear("lost");
      return;
    }
    if (this.looking && !this.stream) this.follow();
  }

  follow() {
    // The browser connects again by itself, with the number of the last event that it has heard.
    const stream = new EventSource(`/v1/events?sample_ms=100&after=${this.newest}`);
    this.stream = stream;
    stream.onopen = () => this.hear("open");
    stream.onerror = () => this.hear("lost");
    for (const kind of [...KINDS, "sample", "alive"]) {
      stream.addEventListener(kind, ({ data, lastEventId }) => {
        this.heard = performance.now();
        if (lastEventId) this.newest = lastEventId;
        this.hear(kind, data);
      });
    }
  }
}

// The number before the first event that is shown.
async function oldest() {
  const answer = await fetch("/v1/machine", { signal: AbortSignal.timeout(ANSWER_MS) });
  if (!answer.ok) throw new Error(answer.statusText);
  return Math.max(0, (await answer.json()).newest_event - EVENTS_SHOWN);
}
