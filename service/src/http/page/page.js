// One page of one machine: what it shows comes from the stream of events, what it asks goes where every
// client asks. Everything from outside is set as text, never as markup.
"use strict";

import { Trace, draw, ofRun } from "/curve.js";
import { EVENTS_SHOWN } from "/feed.js";
import { listen } from "/link.js";
import { Stop } from "/stop.js";

const LEASE_S = 10;
const RENEW_MS = 3000;
// The service stops a jog 200 ms after the last word.
const JOG_MS = 60;
// A live service is heard each 500 ms.
const SILENT_MS = 2000;
const LOOK_MS = 250;
// A question that has no answer by then keeps one of the browser's six connections from a stop.
const ANSWER_MS = 2000;
const ORDER_MS = 60000;
// Changes of the machine that come together are asked for once.
const TOGETHER_MS = 30;
const LIVE_S = 20;
// What is asked for with a text: where it goes, and what it is.
const ALONG = { path: ["path", "Rows: time_s,x_mm,y_mm,z_mm"], first_part: ["path", "Rows: time_s,x_mm,y_mm,z_mm"],
  job: ["job", "The job, as a .toml file has it"] };

const byId = (id) => document.getElementById(id);
let token = null;
// Who has it by what the service says, and whether somebody who was asked wants it all the same.
let holder = null;
let sure = false;
let renewing = null;
let renewal = null;
// What the service said of the machine, when it was heard last, and whether its connection is lost.
let machineText = "connecting …";
let machineKind = "";
let heard = performance.now();
let isLost = false;
let lookingAt = null;
const onTheirWay = new Set();
const plans = new Map();
const together = new Set();
const traces = new Map();

async function ask(method, path, body) {
  // An order on its way with the token before would be that of somebody else; a stop never waits.
  if (renewal && method !== "GET" && path !== "/v1/lease" && path !== "/v1/stop") await renewal;
  const headers = { "content-type": "application/json", "truestage-client": "page" };
  if (token) headers["truestage-lease"] = token;
  const way = new AbortController();
  const limit = method === "GET" || path === "/v1/lease" ? ANSWER_MS : ORDER_MS;
  const late = setTimeout(() => way.abort(new Error(`no answer for ${limit / 1000} s`)), limit);
  onTheirWay.add(way);
  try {
    const said = body === undefined ? undefined : JSON.stringify(body);
    const answer = await fetch(path, { method, headers, body: said, signal: way.signal });
    const value = await answer.json();
    if (answer.ok) return value;
    if (value.code === "lease_lapsed") lose();
    throw Object.assign(new Error(value.detail), { code: value.code });
  } finally {
    clearTimeout(late);
    onTheirWay.delete(way);
  }
}

const stopping = new Stop(byId("stop-answer"));

// Nothing that waits for an answer stands in its way.
function stop() {
  for (const way of onTheirWay) way.abort(new Error("STOP was pressed before this had an answer"));
  byId("problem").textContent = "";
  stopping.press();
}

// What goes wrong is said in one place.
function told(promise) {
  byId("problem").textContent = "";
  return promise.catch((error) => { byId("problem").textContent = error.message; });
}

const unit = (it) => it.unit.replace("um", "µm");
const number = (it, digits) => (it ? `${it.value.toFixed(digits)} ${unit(it)}` : "–");

function showMachine(machine) {
  byId("name").textContent = `${machine.name} · ${machine.stage_serial}`;
  document.title = `${machine.name} – truestage`;
  const cause = machine.cause ? `: ${machine.cause.cause}` : "";
  machineText = machine.state.replace("_", " ") + cause;
  machineKind = machine.state === "error_stop" ? "failed" : "";
  showState();
  holder = machine.lease ? machine.lease.name : null;
  showTake();
  showGroups(machine.groups);
}

// What was heard is shown as long as the machine's thread says that it lives.
function showState() {
  const silence = performance.now() - heard;
  const isSilent = silence > SILENT_MS;
  document.body.classList.toggle("silent", isSilent || isLost);
  const nothing = isSilent ? `nothing heard for ${Math.floor(silence / 1000)} s` : "trying again …";
  const text = isLost ? `connection lost; ${nothing}` : nothing;
  const [shown, kind] = isSilent || isLost ? [text, "unheard"] : [machineText, machineKind];
  if (byId("state").textContent !== shown) byId("state").textContent = shown;
  byId("state").className = kind;
}

// Axes that never move by themselves have one form for all of them.
function showGroups(groups) {
  for (const { name, axes, targets } of groups) {
    if (targets.every((it) => axes.includes(it)) || byId(`group-${name}`)) continue;
    const made = byId("group-card").content.cloneNode(true).querySelector("article");
    made.id = `group-${name}`;
    made.querySelector("h3").textContent = `${name} · ${axes.join(", ")}`;
    const inputs = targets.map((target) => {
      const [label, input] = [element("label", `${target} `), document.createElement("input")];
      [input.size, input.name, input.placeholder] = [10, target, "stays"];
      label.append(input);
      made.querySelector(".parts").append(label, " ");
      return input;
    });
    made.querySelector("form").addEventListener("submit", (event) => {
      event.preventDefault();
      const named = inputs.map((it) => [it.name, it.value.trim()]).filter(([, text]) => text);
      const [uncompensated, align] = [".uncompensated", ".align"].map((it) => agreed(made.querySelector(it)));
      told(ask("POST", "/v1/motions", { targets: Object.fromEntries(named), uncompensated, align }));
    });
    for (const target of targets) {
      const row = byId("axis-card").content.querySelector(".jog").parentElement.cloneNode(true);
      row.querySelector(".power").remove();
      row.querySelector("label").firstChild.data = `Jog ${target} `;
      if (target === "theta") row.querySelector(".speed").value = "60arcsec/s";
      for (const it of row.querySelectorAll(".jog")) holdToJog(it, target, row.querySelector(".speed"));
      made.append(row);
    }
    byId("axes").prepend(made);
    axes.forEach((axis) => together.add(axis));
    showControl();
  }
}

// Whose control it would be that is taken: whoever presses it twice takes it from him.
function showTake() {
  const from = token === null && holder !== null ? ` from ${holder}` : "";
  byId("take").textContent = sure ? `Yes, take control${from}` : `Take control${from}`;
  byId("take").dataset.sure = sure ? "yes" : "";
}

function showControl() {
  const mine = token !== null;
  byId("control-text").textContent = mine
    ? "This page commands the machine; STOP works for everybody."
    : "Read-only. STOP works all the same.";
  showTake();
  byId("take").hidden = mine;
  byId("give").hidden = !mine;
  for (const it of document.querySelectorAll(".command")) it.disabled = !mine;
}

async function take() {
  const force = sure;
  sure = false;
  let leased;
  try {
    leased = await ask("POST", "/v1/lease", { name: "page", seconds: LEASE_S, force });
  } catch (error) {
    sure = error.code === "leased";
    showMachine(await ask("GET", "/v1/machine"));
    throw sure ? new Error(`${holder || "somebody"} has control, and is told when it is taken: press again to take it`) : error;
  }
  token = leased.token;
  clearInterval(renewing);
  renewing = setInterval(() => { renewal = renew().finally(() => { renewal = null; }); }, RENEW_MS);
  showControl();
}

async function renew() {
  try {
    token = (await ask("POST", "/v1/lease", { name: "page", seconds: LEASE_S })).token;
  } catch (error) {
    lose();
    // Who has it now: the event of that may have come while this page thought that it had it.
    ask("GET", "/v1/machine").then(showMachine).catch(() => {});
    byId("problem").textContent = `control was lost: ${error.message}`;
  }
}

function lose() {
  [token, sure] = [null, false];
  clearInterval(renewing);
  showControl();
}

async function give() {
  await ask("DELETE", "/v1/lease");
  holder = null;
  lose();
}

function card(axis) {
  const id = `axis-${axis.name}`;
  const known = byId(id);
  if (known) return known;
  const made = byId("axis-card").content.cloneNode(true).querySelector("article");
  made.id = id;
  made.querySelector(".go").addEventListener("submit", (event) => {
    event.preventDefault();
    const target = made.querySelector(".go input").value.trim();
    const [uncompensated, beyond] = [".uncompensated", ".beyond"].map((name) => agreed(made.querySelector(name)));
    told(ask("POST", "/v1/motions", { targets: { [axis.name]: target }, uncompensated, beyond }));
  });
  if (axis.soft_min === null) {
    made.querySelector(".go input").placeholder = "90deg";
    made.querySelector(".speed").value = "5deg/s";
  }
  for (const button of made.querySelectorAll(".jog")) holdToJog(button, axis.name, made.querySelector(".speed"));
  made.querySelector(".power").addEventListener("click", (event) => {
    told(ask("POST", `/v1/axes/${encodeURIComponent(axis.name)}/${event.target.dataset.verb}`));
  });
  byId("axes").append(made);
  const groups = [...byId("axis").options].map((it) => it.value);
  if (!groups.includes(axis.group)) byId("axis").append(new Option(axis.group, axis.group));
  showControl();
  return made;
}

// For this move only.
function agreed(box) {
  const { checked } = box;
  box.checked = false;
  return checked;
}

// As long as the button or a key on it is held, and not longer: the service stops it when nothing comes.
function holdToJog(button, axis, speed) {
  let held = null;
  let said = null;
  // One word at a time: one that overtook the word to end would begin another jog.
  const say = () => {
    if (said !== null) return;
    const wanted = speed.value.trim().replace(/^[-+]/, "");
    said = ask("POST", "/v1/jog", { axis, speed: button.dataset.way + wanted }).catch((error) => {
      release();
      byId("problem").textContent = error.message;
    }).finally(() => { said = null; });
  };
  const hold = () => {
    if (held !== null || button.disabled) return;
    byId("problem").textContent = "";
    held = setInterval(say, JOG_MS);
    say();
  };
  const release = () => {
    if (held === null) return;
    clearInterval(held);
    held = null;
    // 0 ends it in any unit.
    Promise.resolve(said).then(() => ask("POST", "/v1/jog", { axis, speed: "0mm/s" })).catch(() => {});
  };
  button.addEventListener("pointerdown", (event) => { button.setPointerCapture(event.pointerId); hold(); });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) button.addEventListener(end, release);
  button.addEventListener("keydown", (event) => {
    if (event.key === " " || event.key === "Enter") { event.preventDefault(); hold(); }
  });
  button.addEventListener("keyup", release);
  document.addEventListener("visibilitychange", () => { if (document.hidden) release(); });
}

function showAxes(list) {
  for (const axis of list) {
    const shown = card(axis);
    shown.querySelector("h3").textContent = `${axis.name} · ${axis.state}${axis.used_by ? ` · ${axis.used_by}` : ""}`;
    shown.querySelector(".position").textContent = number(axis.position || axis.encoder, 6);
    // Coverage factor 2, as everywhere else.
    const u = axis.standard_uncertainty;
    shown.querySelector(".uncertainty").textContent = u ? `± ${(2 * u.value).toFixed(3)} ${unit(u)} (k = 2)` : "";
    const bar = shown.querySelector("meter");
    const turns = axis.soft_min === null;
    const [low, high] = turns ? [0, 360] : [axis.soft_min.value, axis.soft_max.value];
    const at = axis.encoder ? axis.encoder.value : low;
    bar.value = (turns ? ((at % 360) + 360) % 360 : at - low) / (high - low);
    const never = together.has(axis.name);
    for (const it of shown.querySelectorAll(".jogs")) it.hidden = never;
    shown.querySelector(".go").hidden = never;
    bar.title = turns ? "turns endlessly" : `${low} to ${high} ${axis.soft_min.unit}`;
    const facts = {
      zero: axis.homed ? "found" : "not found yet",
      calibration: axis.calibration ? axis.calibration.slice(0, 8) : "none",
      correction: axis.corrected && axis.position && axis.encoder
        ? correction(axis.position.value - axis.encoder.value, axis.position.unit) : "–",
      encoder: number(axis.encoder, 6),
      target: number(axis.target, 6),
      limits: bar.title,
      ...(axis.last_cause ? { "last cause": axis.last_cause.cause } : {}),
    };
    const rows = Object.entries(facts).flatMap(([name, text]) => {
      const [term, value] = [document.createElement("dt"), document.createElement("dd")];
      [term.textContent, value.textContent] = [name, text];
      return [term, value];
    });
    shown.querySelector("dl").replaceChildren(...rows);
    showLive(axis, shown);
    const off = axis.state === "Disabled";
    const power = shown.querySelector(".power");
    power.textContent = off ? "Enable" : "Disable";
    power.dataset.verb = off ? "enable" : "disable";
  }
}

// Where it was and how far from its target, as long as somebody looks.
function showLive(axis, shown) {
  const place = axis.position || axis.encoder;
  if (!place) return;
  if (!traces.has(axis.name)) traces.set(axis.name, new Trace(LIVE_S));
  const trace = traces.get(axis.name);
  trace.push(performance.now() / 1000, place.value, axis.target ? axis.target.value : null);
  if (!shown.querySelector("details").open) return;
  const turns = place.unit === "deg";
  const { position, deviation } = trace.lines(turns ? 3600 : 1000);
  const span = { x: "s", spanX: [-LIVE_S, 0] };
  draw(shown.querySelector(".live-position"), position, { ...span, y: unit(place), leastY: 1e-4 });
  draw(shown.querySelector(".live-deviation"), deviation, { ...span, y: turns ? "arcsec from the target" : "µm from the target", leastY: 0.1 });
}

// What a calibration adds, in the unit of small things.
const correction = (it, of) => (of === "deg" ? `${(it * 3600).toFixed(3)} arcsec` : `${(it * 1e3).toFixed(3)} µm`);

function element(name, text, kind) {
  const made = document.createElement(name);
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

function button(text, act) {
  const made = element("button", text, "command");
  made.disabled = token === null;
  made.addEventListener("click", () => told(act()));
  return made;
}

// What a run asks, with a button for each answer, and a line for what was read.
function asking(run) {
  const { number: question, text, answers, takes_text: takes, safety } = run.question;
  const shown = element("div", "", "question");
  const say = (answer) => ask("POST", `/v1/runs/${run.id}/answers`, { question, answer });
  shown.append(...text.split("\n").map((line) => element("p", line)));
  if (safety) shown.append(element("p", safety, "failed"));
  if (takes) {
    const [form, input] = [document.createElement("form"), document.createElement("input")];
    input.required = true;
    input.setAttribute("aria-label", "answer");
    const send = element("button", "Answer", "command");
    send.disabled = token === null;
    form.append(input, " ", send);
    form.addEventListener("submit", (event) => { event.preventDefault(); told(say(input.value)); });
    shown.append(form);
  }
  shown.append(...answers.map((answer) => button(answer, () => say(answer))));
  shown.dataset.number = question;
  return shown;
}

// What was asked for before an event came may arrive after it: a run that was begun less often then, or, of those that were
// begun as often, what is older than a state:
const UNDER_WAY = ["planned", "running", "stopping", "paused"];
const OLDER = { planned: [], running: ["planned"], stopping: ["planned", "running"], paused: ["planned", "running", "stopping"],
  done: UNDER_WAY, stopped: UNDER_WAY, failed: UNDER_WAY, timed_out: UNDER_WAY };

function showRun(run) {
  const known = plans.get(run.id);
  const before = known ? run.begun - known.begun : 1;
  if (before < 0 || (before === 0 && OLDER[known.state].includes(run.state))) return;
  plans.set(run.id, run);
  // What is typed for a question stays while the question does.
  const there = byId(`run-${run.id}`);
  const asked = there && there.querySelector(".question");
  const shown = there || byId("runs").insertBefore(document.createElement("article"), byId("runs").firstChild);
  shown.id = `run-${run.id}`;
  const { points, travel, seconds_at_least: seconds, asks } = run.plan;
  const parts = [element("h3", `${run.kind} ${run.of || run.axes.join(", ")} · ${run.id}`), element("p", run.state, run.state)];
  const way = travel ? `, ${number(travel, 0)}` : "";
  if (points) parts.push(element("p", `${points} points${way}${seconds ? `, ${seconds.toFixed(0)} s at least` : ""}`));
  if (run.state === "planned" && asks.length) {
    const list = document.createElement("ol");
    list.append(...asks.map((it) => element("li", it)));
    parts.push(element("p", "A person is asked:"), list);
  }
  const loads = Object.entries(run.plan.bus_load || {});
  if (run.state === "planned" && loads.length) {
    parts.push(element("p", `bus load ${loads.map(([name, share]) => `${name} ${(100 * share).toFixed(0)} %`).join(", ")}`));
  }
  if (run.state === "planned" && run.plan.departure) {
    const { size, at_s: when, lines } = run.plan.departure;
    parts.push(element("p", `at most ${number(size, 3)} from the straight joins of its rows, at ${when.toFixed(3)} s (lines ${lines.join(" to ")})`));
  }
  if (run.said && run.said.length) {
    const said = element("div", "", "said");
    said.append(...run.said.map((it) => element("p", it)));
    parts.push(said);
  }
  if (run.reached && run.reached.length) parts.push(element("p", run.reached.at(-1)));
  if (run.question) {
    const same = asked && asked.dataset.number === String(run.question.number);
    parts.push(same ? asked : asking(run));
  }
  if (run.steps && run.state === "running") {
    const bar = document.createElement("progress");
    [bar.max, bar.value] = [run.steps, run.steps_done];
    parts.push(bar);
  }
  if (run.out_of_tolerance) parts.push(element("p", run.out_of_tolerance.cause, "failed"));
  if (run.cause) parts.push(element("p", run.cause.cause, "failed"));
  if (run.stopped) parts.push(element("p", `stopped by ${run.stopped.by}`));
  if (run.result) {
    const rows = Object.entries(run.result).filter(([, it]) => it !== null).flatMap(([name, it]) =>
      [element("dt", name.replaceAll("_", " ")), element("dd", typeof it === "number" ? it.toPrecision(6) : String(it))]);
    const list = document.createElement("dl");
    list.append(...rows);
    parts.push(list);
  }
  const curve = run.state === "done" ? curveOf(run) : [];
  parts.push(...curve);
  const doing = document.createElement("p");
  if (run.state === "planned") doing.append(button("Start", () => ask("POST", `/v1/runs/${run.id}/start`)));
  if (run.state === "running" && run.can_resume) doing.append(button("Pause", () => ask("POST", `/v1/runs/${run.id}/pause`)));
  const ended = ["paused", "stopped", "failed", "timed_out"].includes(run.state);
  if (ended && run.can_resume) doing.append(button("Resume", () => ask("POST", `/v1/runs/${run.id}/resume`)));
  if (["planned", "running", "paused"].includes(run.state)) doing.append(button("Abort", () => ask("POST", `/v1/runs/${run.id}/abort`)));
  shown.replaceChildren(...parts, doing);
  redraw(shown);
}

// What it found, as a curve, and what each line of it is.
function curveOf(run) {
  const others = [...plans.values()].reverse();
  const curve = ofRun(run, others);
  if (!curve || !curve.lines.length) return [];
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  const values = curve.lines.flatMap((it) => it.points.map(([, y]) => y));
  const [low, high] = [Math.min(...values), Math.max(...values)].map((it) => it.toFixed(3));
  canvas.setAttribute("aria-label", `${run.kind} of ${run.of}: from ${low} to ${high} ${curve.y}`);
  canvas.curve = curve;
  const legend = element("ul", "", "legend");
  for (const { name, dashed, colour } of curve.lines) {
    legend.append(element("li", name, [dashed && "dashed", colour === "--soft" && "before"].filter(Boolean).join(" ")));
  }
  return [canvas, legend];
}

// Once it has a size, and whenever that or the colours change.
function redraw(within) {
  for (const canvas of within.querySelectorAll("canvas")) {
    if (canvas.curve) draw(canvas, canvas.curve.lines, { ...canvas.curve, leastY: 1e-3 });
  }
}

function showEvent(event) {
  const text = event.data.text || event.data.state || event.data.stage || event.data.by || event.data.id || "";
  const line = element("li", `${event.at.slice(11, 23)} ${event.kind} ${event.of} ${text}`);
  const list = byId("events");
  list.prepend(line);
  while (list.children.length > EVENTS_SHOWN) list.lastChild.remove();
}

async function showAll() {
  showMachine(await ask("GET", "/v1/machine"));
  showAxes(await ask("GET", "/v1/axes"));
  for (const run of await ask("GET", "/v1/runs")) showRun(run);
  showControl();
}

function lookAtMachine() {
  clearTimeout(lookingAt);
  lookingAt = setTimeout(() => ask("GET", "/v1/machine").then(showMachine).catch(() => {}), TOGETHER_MS);
}

function hear(kind, data) {
  if (kind === "open" || kind === "lost") isLost = kind === "lost";
  if (kind === "open") told(showAll());
  if (kind === "alive") [heard, isLost] = [performance.now(), false];
  if (kind === "open" || kind === "lost" || kind === "alive") {
    showState();
    return;
  }
  const said = JSON.parse(data);
  if (kind === "sample") {
    showAxes(said);
    return;
  }
  showEvent(said);
  // What was before this page listened is in what it asks for.
  if (kind === "machine" || kind === "lease") lookAtMachine();
  if (kind === "run") showRun({ ...plans.get(said.of), ...said.data });
  if (kind === "point" && plans.has(said.of)) showRun({ ...plans.get(said.of), reached: [said.data.text] });
  if (kind === "question") showRun({ ...plans.get(said.of), question: said.data.answer ? null : said.data });
}

// Of the time before nothing was heard here.
function looked() {
  heard = performance.now();
  byId("events").replaceChildren();
}

byId("stop").addEventListener("click", stop);
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !event.repeat) stop(); });
byId("take").addEventListener("click", () => told(take()));
byId("take").addEventListener("blur", () => { sure = false; showTake(); });
byId("give").addEventListener("click", () => told(give()));
byId("reset").addEventListener("click", () => told(ask("POST", "/v1/reset").then(({ warning }) => {
  if (warning) throw new Error(warning);
})));
byId("plan").addEventListener("submit", (event) => {
  event.preventDefault();
  const request = { kind: byId("kind").value };
  const along = ALONG[request.kind];
  if (along) {
    // What it is says which axes follow it.
    request[along[0]] = byId("rows").value;
    if (along[0] === "path" && agreed(byId("uncompensated"))) request.uncompensated = true;
  } else if (byId("axis").value) {
    request.axis = byId("axis").value;
  }
  told(ask("POST", "/v1/runs", request).then(showRun));
});
byId("kind").addEventListener("change", showAlong);
byId("file").addEventListener("change", () => {
  const [file] = byId("file").files;
  if (file) told(file.text().then((text) => { byId("rows").value = text; }));
});
window.addEventListener("resize", () => redraw(document));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw(document));

// A text is asked for where a run needs one.
function showAlong() {
  const along = ALONG[byId("kind").value];
  byId("along").hidden = !along;
  byId("axis-label").hidden = Boolean(along);
  byId("rows").required = Boolean(along);
  byId("uncompensated-label").hidden = !along || along[0] !== "path";
  if (along) byId("along-title").textContent = along[1];
}

showAlong();
showControl();
setInterval(showState, LOOK_MS);
listen(hear, looked);
