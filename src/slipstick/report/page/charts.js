// Charts: uPlot with axes that read well, lines that may turn back, gaps, and bars. A chart is drawn anew when it changes.

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes, children and listeners (`onclick`); texts are texts, never markup. */
function element(tag, attributes = {}, ...children) {
  const node = tag.startsWith("svg:") ? document.createElementNS(SVG, tag.slice(4)) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

const CONTROLS = "button, select, input, [tabindex]";

/** New children in place of the old ones; null stands for none. The control that has the focus keeps it. */
function fill(host, ...children) {
  const at = [...host.querySelectorAll(CONTROLS)].indexOf(document.activeElement);
  host.replaceChildren(...children.filter((child) => child !== null && child !== undefined));
  if (at >= 0) host.querySelectorAll(CONTROLS)[at]?.focus({ preventScroll: true });
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const COLOURS = 12;
const curveColour = (i) => colour(`curve-${i % COLOURS}`);

/** The colour of a dof or contact of a result, the same wherever it is drawn; the empty name is that of all together. */
function colourOf(model, over, name, result) {
  const place = name === "" ? 0 : Math.max(0, model[`${over}s`].indexOf(name));
  return curveColour(place * model.results.length + result.index);
}

/** A number to so many digits, as short as can be. */
function short(value, digits = 5) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${Number(mantissa)}×10${raised(Number(exponent))}`;
  }
  return String(Number(value.toPrecision(digits)));
}

const raised = (exponent) => String(exponent).replace(/./g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)]));
const withUnits = (label, units) => (units ? `${label} [${units}]` : label);
const quantityOf = (curve) => curve.label.split(/ \(|: /)[0];

/** Range of values with some air; of positive ones on a logarithmic axis. */
function rangeOf(arrays, { log = false, air = 0.05, zero = false } = {}) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of arrays) {
    for (const v of values) if (Number.isFinite(v) && (!log || v > 0)) { low = Math.min(low, v); high = Math.max(high, v); }
  }
  if (low > high) return log ? [1, 10] : [0, 1];
  if (log) {
    const grow = high > low * (1 + 1e-6) ? (high / low) ** air : 1.3;
    return [low / grow, high * grow];
  }
  if (zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const spread = high - low, size = Math.max(Math.abs(low), Math.abs(high));
  if (spread <= 1e-6 * size) return size === 0 ? [-1, 1] : [low - 0.2 * size, high + 0.2 * size]; // rounding is not magnified
  return [low === 0 && zero ? 0 : low - air * spread, high === 0 && zero ? 0 : high + air * spread];
}

/** A common power of ten for the numbers of an axis that would be long. */
function powerOf([low, high]) {
  const exponent = Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high))));
  return exponent < -2 || exponent > 3 ? 3 * Math.floor(exponent / 3) : 0;
}

/** Label of an axis, and how its ticks are written. */
function axisWords({ label, units, log, like }, range) {
  const power = log ? 0 : powerOf(like ?? range);
  return { power, said: power ? `${label} [10${raised(power)}${units ? ` ${units}` : ""}]` : withUnits(label, units) };
}

/** Ticks of an axis from low to high as [value, text], about `most` of them. */
function ticksOf(axis, range, low, high, most) {
  if (axis.ticks) return axis.ticks[0].map((v, i) => [v, axis.ticks[1][i]]);
  if (axis.log) {
    const powers = logTicks(low, high);
    const ticks = powers.length > 2 ? powers : evenTicks(low, high, Math.min(most, 6)).filter((v) => v > 0);
    return ticks.map((v) => [v, decimal(v)]);
  }
  const { power } = axisWords(axis, range), step = stepOf(low, high, most), places = placesOf(step / 10 ** power);
  return evenTicks(low, high, most).map((v) => [v, (v / 10 ** power).toFixed(places)]);
}

/** A round step for about `most` ticks. */
function stepOf(low, high, most) {
  const rough = (high - low) / Math.max(1, most), size = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 2.5, 5, 10].map((m) => m * size).find((m) => m >= rough * (1 - 1e-9)) ?? 0;
}

function evenTicks(low, high, most) {
  const step = stepOf(low, high, most), found = [];
  if (!(step > 0)) return found;
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && found.length < 100; k++) found.push(k * step);
  return found;
}

function axisOf(axis, range, vertical) {
  const { said } = axisWords(axis, range), { ticks, log } = axis;
  const own = (u, low, high) => ticksOf(axis, range, low, high, Math.max(2, Math.floor((vertical ? u.height - 60 : u.width - 80) / (vertical ? 38 : 76))));
  return {
    scale: vertical ? "y" : "x", label: said, labelSize: 20, labelGap: 2, gap: 5, space: vertical ? 34 : 56,
    font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", stroke: colour("text-soft"),
    grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("grid"), width: 1, size: 4 },
    splits: (u, _, low, high) => own(u, low, high).map(([value]) => value),
    values: (u, splits) => {
      const { min, max } = u.scales[vertical ? "y" : "x"], texts = new Map(own(u, min, max));
      return splits.map((value) => texts.get(value) ?? "");
    },
    size: vertical ? (u, values) => 14 + 7 * Math.max(axis.letters ?? 2, ...(values ?? []).map((v) => v.length)) : 30,
    ...(ticks || log ? { filter: (u, splits) => splits } : {}),
  };
}

/** Decimal places that say a step exactly. */
function placesOf(step) {
  for (let places = 0; places < 12; places++) {
    const shifted = step * 10 ** places;
    if (Math.abs(shifted - Math.round(shifted)) < 1e-6 * shifted) return places;
  }
  return 12;
}

/** Powers of ten within a range, so many that they can be read; with 2 and 5 times them where they would be few. */
function logTicks(low, high) {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const every = Math.max(1, Math.ceil((last - first) / 7)), found = [];
  for (let e = first - 1; e <= last; e++) {
    for (const m of last - first < 2 ? [1, 2, 5] : [1]) {
      const value = Number(`${m}e${e}`);
      if (value >= low && value <= high && (e - first) % every === 0) found.push(value);
    }
  }
  return found;
}

function decimal(value) {
  const exponent = Math.floor(Math.log10(value) + 1e-9), mantissa = Number((value / 10 ** exponent).toPrecision(3));
  if (exponent >= -2 && exponent <= 3) return String(Number(value.toPrecision(5)));
  return mantissa === 1 ? `10${raised(exponent)}` : `${mantissa}·10${raised(exponent)}`;
}

/** Steps of a pen through places in their own order; it is lifted where a number is missing, or by `pen`. A line with `smooth`, 1 where it
 * has a corner, runs along cubics that pass every place and do not overshoot. */
function stepsOf(places, line) {
  const seen = places.map((place) => place.every(Number.isFinite));
  const joined = places.map((_, i) => i > 0 && seen[i] && seen[i - 1] && line.pen?.[i] !== 0);
  const bends = line.smooth ? bendsOf(places, joined, line.smooth) : [];
  return places.map((place, i) => (joined[i] ? (bends[i] ? ["C", ...bends[i], ...place] : ["L", ...place]) : ["M", ...place])).filter((_, i) => seen[i]);
}

/** The two inner points of the cubic that ends at each place; none where a straight line will do. */
function bendsOf(places, joined, corner) {
  const bends = new Array(places.length), length = places.map(([x, y], i) => (joined[i] ? Math.hypot(x - places[i - 1][0], y - places[i - 1][1]) : 0));
  const stretch = (from, to) => {
    if (to - from < 2) return;
    const h = length.slice(from + 1, to + 1), slopes = [0, 1].map((axis) => slopesOf(h, places.slice(from, to + 1).map((place) => place[axis])));
    for (let i = from; i < to; i++) {
      const third = length[i + 1] / 3, inner = (at, k, sign) => [0, 1].map((axis) => places[at][axis] + sign * third * slopes[axis][k]);
      bends[i + 1] = [...inner(i, i - from, 1), ...inner(i + 1, i + 1 - from, -1)];
    }
  };
  let from = 0;
  for (let i = 1; i <= places.length; i++) {
    const goes = i < places.length && length[i] > 0;
    if (goes && !corner[i]) continue;
    stretch(from, goes ? i : i - 1);
    from = i;
  }
  return bends;
}

/** Slopes of a cubic through values at steps h of arclength that is monotone wherever they are (Fritsch and Butland 1984). */
function slopesOf(h, values) {
  const m = h.map((step, i) => (values[i + 1] - values[i]) / step), last = m.length - 1;
  const end = (h0, h1, m0, m1) => {
    const slope = ((2 * h0 + h1) * m0 - h0 * m1) / (h0 + h1);
    if (slope * m0 <= 0) return 0;
    return m0 * m1 <= 0 && Math.abs(slope) > 3 * Math.abs(m0) ? 3 * m0 : slope;
  };
  const inner = m.slice(1).map((m1, i) => {
    const [m0, w0, w1] = [m[i], 2 * h[i + 1] + h[i], h[i + 1] + 2 * h[i]];
    return m0 * m1 <= 0 ? 0 : (w0 + w1) / (w0 / m0 + w1 / m1);
  });
  return [end(h[0], h[1], m[0], m[1]), ...inner, end(h[last], h[last - 1], m[last], m[last - 1])];
}

const PEN = { M: "moveTo", L: "lineTo", C: "bezierCurveTo" };

/** A line as the canvas takes it, with the heads of its arrows. */
function linePath(line) {
  return (u) => {
    const path = new Path2D(), at = (v, axis) => (line.log?.includes(axis) && !(v > 0) ? NaN : u.valToPos(v, axis, true));
    for (const [step, ...numbers] of stepsOf(Array.from(line.x, (x, i) => [at(x, "x"), at(line.y[i], "y")]), line)) path[PEN[step]](...numbers);
    const heads = new Path2D();
    for (const [tip, ...others] of arrowHeads(line, (v, axis) => u.valToPos(v, axis, true), devicePixelRatio)) {
      heads.moveTo(...tip);
      for (const corner of others) heads.lineTo(...corner);
      heads.closePath();
    }
    return { stroke: path, fill: line.arrows ? heads : null, flags: 0 };
  };
}

/** Heads of arrows along a line that has some: three corners each, in the order in which the points are passed. */
function arrowHeads(line, place, ratio) {
  if (!line.arrows) return [];
  const at = Array.from(line.x, (x, i) => [place(x, "x"), place(line.y[i], "y")]), size = 5 * ratio, found = [];
  let since = 0.5 * ARROWS * ratio;
  for (let i = 1; i < at.length; i++) {
    const [dx, dy] = [at[i][0] - at[i - 1][0], at[i][1] - at[i - 1][1]], length = Math.hypot(dx, dy);
    if (!Number.isFinite(length)) { since = 0.5 * ARROWS * ratio; continue; }
    since += length;
    if (since < ARROWS * ratio || length === 0) continue;
    since = 0;
    const [ux, uy] = [dx / length, dy / length], [x, y] = at[i];
    found.push([[x + size * ux, y + size * uy], [x - size * ux - 0.8 * size * uy, y - size * uy + 0.8 * size * ux], [x - size * ux + 0.8 * size * uy, y - size * uy - 0.8 * size * ux]]);
  }
  return found;
}

/** Arrows are so many pixels apart. */
const ARROWS = 110;

function barPath(bars) {
  return (u) => {
    const path = new Path2D(), ground = u.valToPos(Math.max(0, u.scales.y.min), "y", true);
    bars.x.forEach((x, i) => {
      if (!Number.isFinite(bars.y[i]) || (bars.log && bars.y[i] <= 0)) return;
      const [a, b] = [x - bars.half, x + bars.half].map((v) => u.valToPos(v, "x", true));
      const top = u.valToPos(bars.y[i], "y", true);
      path.rect(a, Math.min(top, ground), Math.max(b - a, 1), Math.abs(ground - top));
    });
    return { stroke: null, fill: path, flags: 0 };
  };
}

/** Rings at points, over the lines. */
function ringPath(rings) {
  return (u) => {
    const path = new Path2D(), radius = 3.6 * devicePixelRatio;
    rings.x.forEach((x, i) => {
      if (!Number.isFinite(rings.y[i]) || (rings.log?.includes("y") && rings.y[i] <= 0)) return;
      const [px, py] = [u.valToPos(x, "x", true), u.valToPos(rings.y[i], "y", true)];
      path.moveTo(px + radius, py);
      path.arc(px, py, radius, 0, PERIOD);
    });
    return { stroke: path, fill: path, flags: 0 };
  };
}

const PATHS = { line: linePath, bars: barPath, rings: ringPath };

/** Draw into a host: `x`, `y` { label, units, range, log, ticks } and `lines` { x, y, kind, name, stroke, fill, width, dash }. */
function chart(host, { x, y, lines, height, name, zoom = false, hooks = {}, marks = null }) {
  host.uplot?.destroy();
  const scale = (axis) => ({ time: false, range: axis.range, distr: axis.log ? 3 : 1 });
  const size = { width: Math.max(host.clientWidth, 220), height };
  const reading = element("div", { class: "reading", hidden: true });
  const plot = new uPlot({
    ...size, mode: 2, legend: { show: false }, padding: [10, 14, 0, 0],
    cursor: { x: true, y: true, points: { show: false }, drag: { x: zoom, y: zoom, setScale: zoom, dist: 8 }, bind: { dblclick: () => null } },
    scales: { x: scale(x), y: scale(y) },
    axes: [axisOf(x, x.range, false), axisOf(y, y.range, true)],
    series: [null, ...lines.map((line) => ({
      paths: PATHS[line.kind ?? "line"](line), stroke: line.stroke, fill: line.arrows ? line.stroke : line.fill, width: line.width ?? 1.8, dash: line.dash,
      cap: line.dash ? "butt" : "round", points: { show: false }, auto: false,
    }))],
    hooks: { ...hooks, drawAxes: marks ? [marks] : [], setCursor: [(u) => read(u, reading, x, y)] },
  }, [null, ...lines.map((line) => [line.x, line.y])], host);
  plot.over.append(reading);
  host.uplot = plot;
  const drawing = () => svgOfChart(plot, { x: { said: axisWords(x, x.range).said }, y: { said: axisWords(y, y.range).said }, lines },
    [[x, "x", plot.width / 76], [y, "y", plot.height / 38]].map(([axis, key, most]) => ticksOf(axis, axis.range, plot.scales[key].min, plot.scales[key].max, most)));
  saver(host, () => name, { PNG: () => pngOfCanvas(plot.ctx.canvas), SVG: drawing, CSV: () => csvOf(rowsOf({ x, y, lines })) });
  return plot;
}

/** Every number of a chart: name of the line, x, y. */
function rowsOf({ x, y, lines }) {
  const own = lines.filter((line) => line.kind !== "rings" && !line.repeated);
  return [["curve", withUnits(x.label, x.units), withUnits(y.label, y.units)], ...own.flatMap((line) => Array.from(line.x, (v, i) => [line.name ?? "", v, line.y[i]]))];
}

/** The place of the pointer in the units of the axes. */
function read(u, reading, x, y) {
  const { left, top } = u.cursor;
  reading.hidden = !(left >= 0 && top >= 0);
  if (reading.hidden) return;
  const said = (axis, key, at) => (axis.ticks ? "" : `${short(u.posToVal(at, key), 4)}${axis.units ? ` ${axis.units}` : ""}`);
  reading.textContent = [said(x, "x", left), said(y, "y", top)].filter(Boolean).join(", ");
}

/** A thin line at zero. */
function zeroLine(u) {
  if (!(u.scales.y.min < 0 && u.scales.y.max > 0)) return;
  const [y, { ctx, bbox }] = [u.valToPos(0, "y", true), u];
  ctx.save();
  ctx.strokeStyle = colour("text-faint");
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
}

/** A row of buttons of which one is pressed. */
function choice(label, options, chosen, choose) {
  const buttons = Object.entries(options).map(([value, text]) =>
    element("button", { type: "button", "aria-pressed": String(value === chosen), onclick: () => choose(value) }, text));
  return element("span", { class: "choice", role: "group", "aria-label": label }, ...buttons);
}
