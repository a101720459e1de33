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

/** New children in place of the old ones; null stands for none. */
function fill(host, ...children) {
  host.replaceChildren(...children.filter((child) => child !== null && child !== undefined));
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const curveColour = (i) => colour(`curve-${i % 7}`);

/** A number to so many digits, as short as it can be said. */
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
const quantityOf = (curve) => curve.label.split(" (")[0];

/** Range of values with some air; of positive ones on a logarithmic axis. */
function rangeOf(arrays, { log = false, air = 0.05, zero = false } = {}) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of arrays) {
    for (const v of values) if (Number.isFinite(v) && (!log || v > 0)) { low = Math.min(low, v); high = Math.max(high, v); }
  }
  if (low > high) return log ? [1, 10] : [0, 1];
  if (log) return [low / 1.3, high * 1.3];
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

function axisOf({ label, units, log, ticks }, range, vertical) {
  const power = log ? 0 : powerOf(range);
  const scaled = power ? `${label} [10${raised(power)}${units ? ` ${units}` : ""}]` : withUnits(label, units);
  const plain = (_, splits, axis, space, step) => splits.map((v) => (v / 10 ** power).toFixed(placesOf(step / 10 ** power)));
  return {
    scale: vertical ? "y" : "x", label: scaled, labelSize: 20, labelGap: 2, gap: 5, space: vertical ? 34 : 56,
    font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", stroke: colour("text-soft"),
    grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("grid"), width: 1, size: 4 },
    values: ticks ? (_, splits) => splits.map((v) => ticks[1][ticks[0].indexOf(v)] ?? "") : log ? (_, splits) => splits.map(decimal) : plain,
    size: vertical ? (u, values) => 14 + 7 * Math.max(2, ...(values ?? []).map((v) => v.length)) : 30,
    ...(ticks ? { splits: () => ticks[0] } : log ? { splits: (_, axis, low, high) => logTicks(low, high) } : {}),
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
  const exponent = Math.floor(Math.log10(value) + 1e-9), mantissa = Math.round(value / 10 ** exponent);
  if (exponent >= -2 && exponent <= 3) return String(Number(value.toPrecision(3)));
  return mantissa === 1 ? `10${raised(exponent)}` : `${mantissa}·10${raised(exponent)}`;
}

/** Path through points in their own order; the pen is lifted where a number is missing, or by `pen`. */
function linePath(line) {
  return (u) => {
    const path = new Path2D();
    let down = false;
    for (let i = 0; i < line.x.length; i++) {
      const [x, y] = [line.x[i], line.y[i]];
      const drawn = Number.isFinite(x) && Number.isFinite(y) && (!line.log?.includes("x") || x > 0) && (!line.log?.includes("y") || y > 0);
      if (drawn) path[down && line.pen?.[i] !== 0 ? "lineTo" : "moveTo"](u.valToPos(x, "x", true), u.valToPos(y, "y", true));
      down = drawn;
    }
    return { stroke: path, fill: null, flags: 0 };
  };
}

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

/** Draw into a host: `x`, `y` { label, units, range, log, ticks } and `lines` { x, y, kind, stroke, fill, width, dash }. */
function chart(host, { x, y, lines, height, zoom = false, hooks = {}, marks = null }) {
  host.uplot?.destroy();
  const scale = (axis) => ({ time: false, range: axis.range, distr: axis.log ? 3 : 1 });
  const size = { width: Math.max(host.clientWidth, 220), height };
  const plot = new uPlot({
    ...size, mode: 2, legend: { show: false }, padding: [10, 14, 0, 0],
    cursor: { x: zoom, y: zoom, points: { show: false }, drag: { x: zoom, y: zoom, setScale: zoom, dist: 8 }, bind: { dblclick: () => null } },
    scales: { x: scale(x), y: scale(y) },
    axes: [axisOf(x, x.range, false), axisOf(y, y.range, true)],
    series: [null, ...lines.map((line) => ({
      paths: PATHS[line.kind ?? "line"](line), stroke: line.stroke, fill: line.fill, width: line.width ?? 1.8, dash: line.dash,
      cap: line.dash ? "butt" : "round", points: { show: false }, auto: false,
    }))],
    hooks: { ...hooks, drawAxes: marks ? [marks] : [] },
  }, [null, ...lines.map((line) => [line.x, line.y])], host);
  host.uplot = plot;
  return plot;
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
