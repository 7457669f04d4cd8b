// Curves on a small canvas, with round numbers at their axes. Sides and states differ by dashes and words, too: nobody has to
// see a colour.
"use strict";

const COLOURS = ["--accent", "--second", "--soft"];
const MARGIN = { left: 66, right: 10, top: 22, bottom: 22 };

// Round steps: 1, 2 or 5 times a power of ten.
function step(span, count) {
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((it) => it * power).find((it) => it >= rough) || 10 * power;
}

// From the lowest to the highest, a little more on both sides, and never nothing.
function range(values, least) {
  let [low, high] = [Math.min(...values), Math.max(...values)];
  if (!(high - low > least)) [low, high] = [(low + high - least) / 2, (low + high + least) / 2];
  const more = (high - low) * 0.06;
  return [low - more, high + more];
}

const digits = (size) => Math.max(0, Math.min(9, -Math.floor(Math.log10(size) + 1e-9)));

// Draws `lines` ({points: [[x, y], …], name}) on `canvas`; `x` and `y` are their units, and the least that each axis spans.
export function draw(canvas, lines, { x, y, leastX = 1e-9, leastY = 1e-9, spanX = null }) {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const scale = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * scale)) canvas.width = Math.round(width * scale);
  if (canvas.height !== Math.round(height * scale)) canvas.height = Math.round(height * scale);
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  const all = lines.flatMap((it) => it.points);
  const style = getComputedStyle(canvas);
  const colour = (name) => style.getPropertyValue(name).trim();
  pen.font = `12px ${style.fontFamily}`;
  pen.fillStyle = colour("--soft");
  if (!all.length) {
    pen.fillText("nothing yet", MARGIN.left, height / 2);
    return;
  }
  const [fromX, toX] = spanX || range(all.map((it) => it[0]), leastX);
  const [fromY, toY] = range(all.map((it) => it[1]), leastY);
  const atX = (it) => MARGIN.left + ((it - fromX) / (toX - fromX)) * (width - MARGIN.left - MARGIN.right);
  const atY = (it) => height - MARGIN.bottom - ((it - fromY) / (toY - fromY)) * (height - MARGIN.top - MARGIN.bottom);
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  grid(fromX, toX, Math.max(2, Math.floor(width / 110)), (it, text) => {
    pen.beginPath(); pen.moveTo(atX(it), MARGIN.top); pen.lineTo(atX(it), height - MARGIN.bottom); pen.stroke();
    pen.textAlign = "center";
    pen.fillText(text, atX(it), height - MARGIN.bottom + 15);
  });
  grid(fromY, toY, 4, (it, text) => {
    pen.beginPath(); pen.moveTo(MARGIN.left, atY(it)); pen.lineTo(width - MARGIN.right, atY(it)); pen.stroke();
    pen.textAlign = "right";
    pen.fillText(text, MARGIN.left - 5, atY(it) + 4);
  });
  // The units stand where no line is.
  pen.textAlign = "right";
  pen.fillText(x, MARGIN.left - 22, height - MARGIN.bottom + 15);
  pen.textAlign = "left";
  pen.fillText(y, MARGIN.left, 14);
  lines.forEach((line, number) => {
    pen.strokeStyle = colour(line.colour || COLOURS[number % COLOURS.length]);
    pen.setLineDash(line.dashed ? [6, 4] : []);
    pen.lineWidth = 2;
    pen.beginPath();
    line.points.forEach(([px, py], at) => (at ? pen.lineTo(atX(px), atY(py)) : pen.moveTo(atX(px), atY(py))));
    pen.stroke();
    if (line.points.length > 40) return;
    pen.fillStyle = pen.strokeStyle;
    for (const [px, py] of line.points) { pen.beginPath(); pen.arc(atX(px), atY(py), 2.5, 0, 7); pen.fill(); }
    pen.fillStyle = colour("--soft");
  });
  pen.setLineDash([]);
}

function grid(from, to, count, each) {
  const size = step(to - from, count);
  for (let at = Math.ceil(from / size); at * size <= to; at += 1) each(at * size, (at * size).toFixed(digits(size)));
}

// What a run found of an axis, as lines: where the stage was before anything corrected it, and what is left.
export function ofRun(run, others) {
  const value = (run.told && run.told.value) || {};
  const linear = (rows, at, of, name) => ["forward", "reverse"].map((side) => ({
    name: `${name}, ${side}`,
    dashed: side === "reverse",
    points: rows.filter((it) => it[of] && it[of][side] !== null && it[of][side] !== undefined).map((it) => [it[at], it[of][side]]),
  })).filter((it) => it.points.length);
  const found = (it) => linear(it.fit.nodes, "position_mm", "deviation_um", "as found");
  const mm = { x: "mm", y: "µm" };
  if (value.fit && value.fit.nodes) return { lines: paint(found(value), "--soft"), ...mm };
  const left = (value.as_left && value.as_left.targets) || null;
  if (left) {
    // Beside what the last calibration found of the same axis.
    const before = others.find((it) => it.kind === "calibrate" && it.of === run.of && it.told && it.told.value.fit);
    const lines = paint(linear(left, "target_mm", "mean_deviation", "as left"), "--accent");
    return { lines: [...(before ? paint(found(before.told.value), "--soft") : []), ...lines], ...mm };
  }
  const asFound = (value.as_found && value.as_found.targets) || null;
  if (asFound) return { lines: paint(linear(asFound, "target_mm", "mean_deviation", "as found"), "--soft"), ...mm };
  return ofTable(value) || ofLine(value);
}

const paint = (lines, colour) => lines.map((it) => ({ ...it, colour }));

// A rotary table: a deviation for each line of its plate.
function ofTable(value) {
  const around = (list) => list.map((it, at) => [(at * 360) / list.length, it]).filter(([, it]) => it !== null);
  const [found, left] = ["as_found", "as_left"].map((it) => value[it] && value[it].deviation_arcsec);
  const lines = [];
  if (value.table_error_arcsec) lines.push({ name: "as found", colour: "--soft", points: around(value.table_error_arcsec) });
  if (Array.isArray(found)) lines.push({ name: "as found", colour: "--soft", points: around(found) });
  if (Array.isArray(left)) lines.push({ name: "as left", colour: "--accent", points: around(left) });
  return lines.length ? { lines, x: "°", y: "″" } : null;
}

// Three axes: deviations along one line.
function ofLine(value) {
  const points = Array.isArray(value.points) && value.points.every((it) => Array.isArray(it.at_mm) && "deviation_um" in it)
    ? value.points : [];
  if (points.length < 2) return null;
  const [start] = points.map((it) => it.at_mm);
  const along = (it) => Math.hypot(...it.at_mm.map((mm, k) => mm - start[k]));
  return { lines: [{ name: "along the line", colour: "--accent", points: points.map((it) => [along(it), it.deviation_um]) }], x: "mm", y: "µm" };
}

// The last seconds of an axis, by the machine's clock or the browser's where it does not say.
export class Trace {
  constructor(seconds) {
    this.seconds = seconds;
    this.rows = [];
  }

  push(now, position, target) {
    this.rows.push([now, position, target]);
    while (this.rows.length && this.rows[0][0] < now - this.seconds) this.rows.shift();
  }

  // `now` is at the right end; a deviation is actual − target, in the unit of small things.
  lines(small) {
    const now = this.rows.length ? this.rows[this.rows.length - 1][0] : 0;
    const since = (it) => it[0] - now;
    const position = this.rows.map((it) => [since(it), it[1]]);
    const deviation = this.rows.filter((it) => it[2] !== null).map((it) => [since(it), (it[1] - it[2]) * small]);
    return { position: [{ name: "position", points: position }], deviation: [{ name: "deviation", points: deviation }] };
  }
}
