// STOP, and what became of it.
"use strict";

const LIMIT_MS = 2000;
const INSTEAD = "use the emergency stop";

const timeOfDay = () => new Date().toTimeString().slice(0, 8);

// Says in `shown` whether the service took it.
export class Stop {
  constructor(shown) {
    this.shown = shown;
    // The first press without an answer.
    this.pressed = null;
    this.sent = null;
  }

  async press() {
    this.pressed ??= performance.now();
    // The one before may hang on a connection that is dead; what has left this computer is not taken back.
    if (this.sent) this.sent.abort();
    const sent = new AbortController();
    this.sent = sent;
    const left = LIMIT_MS - (performance.now() - this.pressed);
    const limit = setTimeout(() => this.say(`NO ANSWER: ${INSTEAD}`, "failed"), Math.max(0, left));
    if (left > 0) this.say("STOP sent …", "");
    const said = await this.ask(sent.signal);
    clearTimeout(limit);
    if (this.sent !== sent) return;
    [this.sent, this.pressed] = [null, null];
    this.say(...said);
  }

  // What is to be said of the answer, and how.
  async ask(signal) {
    const headers = { "content-type": "application/json", "truestage-client": "page" };
    const begun = this.pressed;
    try {
      const answer = await fetch("/v1/stop", { method: "POST", headers, body: "{}", signal, priority: "high" });
      const value = await answer.json();
      if (!answer.ok) return [`NOT TAKEN: ${INSTEAD} (${value.detail})`, "failed"];
      const isLate = performance.now() - begun > LIMIT_MS;
      return [isLate ? `taken late, at ${timeOfDay()}` : `taken at ${timeOfDay()}`, isLate ? "failed" : "done"];
    } catch (error) {
      return [`NO ANSWER: ${INSTEAD} (${error.message})`, "failed"];
    }
  }

  say(text, kind) {
    [this.shown.textContent, this.shown.className] = [text, kind];
  }
}
