// The page of a study: peaks over its parameters, the curves behind them, every case in a table.

const CIVIDIS = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];
let [WIDE, HIGH] = [560, 380]; // as wide as the card, so that letters keep their size
const [LEFT, RIGHT, TOP, BOTTOM] = [74, 14, 14, 52];
const OVER_DECADES = 100; // as in figures

const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;

/** A colour for a part between 0 and 1, none that the card hides. */
function shade(part) {
  const [first, last] = isDark() ? [0.25, 1] : [0, 0.94], inside = first + Math.max(0, Math.min(1, part)) * (last - first);
  const at = inside * (CIVIDIS.length - 1), i = Math.min(CIVIDIS.length - 2, Math.floor(at));
  return `rgb(${CIVIDIS[i].map((c, k) => Math.round(c + (at - i) * (CIVIDIS[i + 1][k] - c))).join(",")})`;
}

/** A quantity of a dof in words; "largest" is that of all outputs. */
const ofDof = (what, name) => (name === "largest" ? `largest ${what.toLowerCase()} of all outputs` : `${what} of ${name}`);

const finite = (values) => Array.from(values).filter(Number.isFinite);

/** Where values lie between 0 and 1: in proportion, or, where they spread over decades and are not `linear` ones such as counts, by their logarithm; with 0 or both signs among them by the symmetric one. */
class Scale {
  constructor(values, air = 0, linear = false) {
    const known = finite(values), sizes = known.map(Math.abs).filter((v) => v > 0), least = Math.min(...sizes);
    this.log = !linear && sizes.length > 1 && Math.max(...sizes) / least >= OVER_DECADES;
    this.least = known.every((v) => v > 0) ? 0 : least; // below it, a symmetric logarithm is in proportion
    const ends = known.map((v) => this.of(v));
    [this.low, this.high] = ends.length ? [Math.min(...ends), Math.max(...ends)] : [0, 1];
    if (this.low === this.high) [this.low, this.high] = [this.low - 0.5 * (Math.abs(this.low) || 1), this.high + 0.5 * (Math.abs(this.high) || 1)];
    const spread = this.high - this.low;
    [this.low, this.high] = [this.low - air * spread, this.high + air * spread];
    this.known = [...new Set(known)];
  }

  of(value) {
    if (!this.log) return value;
    return this.least ? Math.sign(value) * Math.log10(1 + Math.abs(value) / this.least) : Math.log10(value);
  }

  at(value) { return (this.of(value) - this.low) / (this.high - this.low); }

  ticks() {
    if (this.log) {
      const powers = [], largest = Math.max(...this.known.map(Math.abs)), smallest = Math.min(...this.known.map(Math.abs).filter((v) => v > 0));
      const [first, last] = [Math.ceil(Math.log10(smallest) - 1e-9), Math.floor(Math.log10(largest) + 1e-9)], every = Math.max(1, Math.ceil((last - first) / (this.least ? 4 : 7)));
      for (let k = last; k >= first; k -= every) powers.unshift(10 ** k);
      const found = this.least ? [...powers.map((v) => -v).reverse(), 0, ...powers] : powers;
      const inside = (v) => this.at(v) > -1e-9 && this.at(v) < 1 + 1e-9, seen = found.filter(inside);
      if (seen.length === 2 && !this.least) return [first - 1, first, last].flatMap((k) => [1, 2, 5].map((m) => m * 10 ** k)).filter(inside);
      return seen.length > 1 ? seen : this.known.length < 12 ? this.known : [Math.min(...this.known), Math.max(...this.known)];
    }
    const rough = (this.high - this.low) / 5, size = 10 ** Math.floor(Math.log10(rough)), step = [1, 2, 5, 10].map((m) => m * size).find((s) => s >= rough);
    const out = [];
    for (let k = Math.ceil(this.low / step - 1e-9); k * step <= this.high + 1e-9 * step; k++) out.push(k * step);
    return out;
  }
}

/** Cells of equal width, one for each value that was computed, in their order. */
class Cells {
  constructor(values) {
    this.values = sorted(finite(values));
    this.count = Math.max(1, this.values.length);
  }

  at(value) { return (this.values.indexOf(value) + 0.5) / this.count; }

  cell(value) {
    const i = this.values.indexOf(value);
    return [i / this.count, (i + 1) / this.count];
  }

  /** So many values as can be read. */
  ticks() {
    const every = Math.ceil(this.count / 10);
    return this.values.filter((_, i) => i % every === 0);
  }
}

const across = (scale, value) => LEFT + scale.at(value) * (WIDE - LEFT - RIGHT);
const upwards = (scale, value) => HIGH - BOTTOM - scale.at(value) * (HIGH - TOP - BOTTOM);

/** Frame, ticks and labels. */
function frame(x, y, xLabel, yLabel, title) {
  const svg = element("svg:svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "group", "aria-label": title });
  svg.append(element("svg:rect", { x: LEFT, y: TOP, width: WIDE - LEFT - RIGHT, height: HIGH - TOP - BOTTOM, class: "axis" }));
  for (const v of x.ticks()) {
    svg.append(element("svg:line", { x1: across(x, v), x2: across(x, v), y1: HIGH - BOTTOM, y2: HIGH - BOTTOM + 5, class: "axis" }),
      element("svg:text", { x: across(x, v), y: HIGH - BOTTOM + 19, "text-anchor": "middle" }, short(v, 4)));
  }
  for (const v of y.ticks()) {
    svg.append(element("svg:line", { x1: LEFT - 5, x2: LEFT, y1: upwards(y, v), y2: upwards(y, v), class: "axis" }),
      element("svg:text", { x: LEFT - 8, y: upwards(y, v) + 4, "text-anchor": "end" }, short(v, 4)));
  }
  svg.append(element("svg:text", { x: (LEFT + WIDE - RIGHT) / 2, y: HIGH - 10, "text-anchor": "middle" }, xLabel),
    element("svg:text", { x: 14, y: (TOP + HIGH - BOTTOM) / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${(TOP + HIGH - BOTTOM) / 2})` }, yLabel));
  return svg;
}

/** A name that may go on in a new line after each of its points. */
const broken = (name) => name.split(/(?<=\.)/).flatMap((part, i) => (i ? [element("wbr"), part] : [part]));

const sorted = (values) => [...new Set(values)].sort((a, b) => a - b);

class Study {
  constructor(content) {
    this.content = content;
    this.parameters = content.parameters.map((own) => ({ ...own, values: new Numbers(own.values).column() }));
    this.peaks = content.dofs.map((own) => ({ ...own, peak: new Numbers(own.peak).column(), at: new Numbers(own.at).column() }));
    this.curves = content.curves.map((own) => ({ case: own.case, x: new Numbers(own.x).column(), y: own.y.map((y) => new Numbers(y).column()), part: new Numbers(own.part).column() }));
    const { band } = content, column = (own) => new Numbers(own).column();
    this.band = band && { ...band, x: column(band.x), dofs: band.dofs.map((own) => ({ y: own.y.map(column), peak: column(own.peak), at: column(own.at) })) };
    this.scatter = content.scatter && { ...content.scatter, values: column(content.scatter.values) };
    this.view = this.viewFrom(location.hash);
    head(document.getElementById("head"), { ...content, results: [] });
    document.getElementById("head").append(this.outcome());
    inputs(document.getElementById("inputs"), [{ content }]);
    foot(document.getElementById("foot"), content);
    document.querySelector("#foot p").lastChild.textContent = "Choose a case in the map, the curves or the table; the address keeps the choice.";
    this.draw();
  }

  viewFrom(text) {
    const given = new URLSearchParams(text.replace(/^#/, "")), names = this.parameters.map((p) => p.name);
    const known = (key, list, otherwise) => (list.includes(given.get(key)) ? given.get(key) : otherwise);
    const number = Number(given.get("case"));
    const over = known("over", names, names[0]);
    return {
      dof: known("dof", this.peaks.map((d) => d.name), this.content.first), over,
      by: known("by", ["", ...names], names.find((name) => name !== over) ?? ""),
      unit: known("unit", Object.keys(this.content.frequency.factors), this.content.frequency.unit),
      case: given.get("case") && this.content.cases[number] ? number : null, show: known("show", ["", "bad"], ""), words: given.get("words") ?? "",
      sort: known("sort", ["number", ...names, "amplification", "peak", "outcome", "seconds"], "number"), down: given.get("down") === "1",
    };
  }

  set(change) {
    this.view = { ...this.view, ...change };
    if (this.view.by === this.view.over) this.view.by = "";
    const out = new URLSearchParams(Object.entries(this.view).filter(([k, v]) => v !== null && (v !== "" || k === "by") && v !== false).map(([k, v]) => [k, v === true ? "1" : v]));
    history.replaceState(null, "", `#${out}`);
    this.draw(!("words" in change));
  }

  /** What the curves are over, in the unit chosen: factor and unit. */
  get over() {
    const { frequency, followed } = this.content;
    return followed.key === "omega" && this.view.unit in frequency.factors ? [frequency.factors[this.view.unit], this.view.unit] : [1, followed.units];
  }

  get dof() { return this.peaks.find((own) => own.name === this.view.dof); }
  parameter(name) { return this.parameters.find((own) => own.name === name); }
  bad(i) { return this.content.cases[i].outcome !== "COMPLETED"; }

  outcome() {
    const { content } = this, { outcome } = content, failed = content.cases.filter((own) => own.outcome && own.outcome !== "COMPLETED").length;
    const facts = [`${content.cases.length} cases`, content.seconds ? `${short(content.seconds, 3)} s` : "", failed ? `${failed} did not complete` : "", content.method, content.case_file].filter(Boolean);
    return element("section", { class: "outcome", "aria-label": "Outcome" },
      element("p", { class: `verdict ${outcome.ok ? "good" : "early"}` }, element("strong", {}, outcome.ok ? "✓" : "!"), ` ${outcome.text}`),
      element("p", { class: "facts" }, facts.join(" · ")),
      ...content.warnings.map((text) => element("p", { class: "warning" }, element("strong", {}, "Warning: "), text)),
      element("div", { class: "folds" }, fold("Provenance", about(content.about)), content.case ? fold("Case file", element("pre", { tabindex: 0 }, content.case)) : null));
  }

  draw(tools = true) {
    const card = document.getElementById("curves").clientWidth - 30;
    [WIDE, HIGH] = [Math.max(300, card), Math.round(Math.max(280, 0.66 * card))];
    this.choices();
    this.map();
    this.drawCurves();
    this.drawBand();
    this.drawAmplification();
    this.drawDisc();
    this.table(tools);
  }

  choose(label, key, names, titles = names) {
    const select = element("select", { onchange: (event) => this.set({ [key]: event.target.value }) },
      ...names.map((name, i) => element("option", { value: name, selected: name === this.view[key] }, titles[i])));
    return element("label", {}, `${label} `, select);
  }

  choices() {
    const names = this.parameters.map((own) => own.name), others = names.filter((name) => name !== this.view.over);
    fill(document.getElementById("choices"), element("div", { class: "tools-row" },
      this.choose("peak of", "dof", this.peaks.map((own) => own.name)), this.choose("over", "over", names),
      others.length ? this.choose("and", "by", ["", ...others], ["nothing else", ...others]) : null, this.units()), this.chosen());
  }

  units() {
    const known = Object.keys(this.content.frequency.factors);
    return known.length > 1 ? choice("Unit of frequency", Object.fromEntries(known.map((u) => [u, u])), this.view.unit, (unit) => this.set({ unit })) : null;
  }

  /** The case chosen, in words, and how its loops and states are had. */
  chosen() {
    const { view, content } = this;
    if (view.case === null) return null;
    const [factor, unit] = this.over, at = this.dof.at[view.case];
    const where = Number.isFinite(at) ? ` at ${content.followed.key === "omega" ? "" : `${content.followed.label} `}${short(at * factor)}${unit ? ` ${unit}` : ""}` : "";
    const how = content.file ? ["Its loops, states and harmonics: ", element("code", {}, `slipstick report ${content.file} --case ${view.case}`), " computes this case again and writes its own page."]
      : ["Its loops, states and harmonics are in the branch of this case; compute it in Python and call branch.report(...)."];
    return element("div", { class: "card", id: "chosen" }, element("p", {}, element("strong", {}, `${this.says(view.case)}${where}`), " ",
      element("button", { type: "button", class: "plain", onclick: () => this.set({ case: null }) }, "none")), element("p", { class: "soft" }, ...how));
  }

  /** Cases that are drawn: in a grid those that share the other parameters with the case chosen, else with the smallest peak. */
  shown() {
    const { view } = this, all = this.content.cases.map((_, i) => i);
    if (!this.content.grid) return { cases: all, fixed: [] };
    const rest = this.parameters.filter((own) => own.name !== view.over && own.name !== view.by);
    const smallest = all.reduce((best, i) => (this.dof.peak[i] < this.dof.peak[best] || Number.isNaN(this.dof.peak[best]) ? i : best), 0);
    const like = view.case ?? smallest;
    return { cases: all.filter((i) => rest.every((own) => own.values[i] === own.values[like])), fixed: rest.map((own) => `${own.name} = ${short(own.values[like])}`) };
  }

  map() {
    const { view, dof } = this, host = document.getElementById("map"), over = this.parameter(view.over), by = view.by ? this.parameter(view.by) : null;
    const { cases, fixed } = this.shown(), grid = this.content.grid && by;
    const x = grid ? new Cells(over.values) : this.along(over, 0.05), value = new Scale(cases.map((i) => dof.peak[i]), by ? 0 : 0.08);
    const y = !by ? value : grid ? new Cells(by.values) : this.along(by, 0.05);
    const cells = grid ? [x, y] : null;
    const peakLabel = withUnits(ofDof("peak", dof.name), dof.units), yLabel = by ? withUnits(by.name, by.units) : peakLabel;
    const svg = frame(x, y, withUnits(over.name, over.units), yLabel, `${peakLabel} over ${view.over}`);
    const place = (i) => [across(x, over.values[i]), upwards(y, by ? by.values[i] : dof.peak[i])];
    if (!by && this.content.grid) {
      const line = cases.filter((i) => Number.isFinite(dof.peak[i])).sort((a, b) => over.values[a] - over.values[b]);
      svg.append(element("svg:path", { class: "line", stroke: colour("curve-0"), d: line.map((i, k) => `${k ? "L" : "M"}${place(i).map((v) => v.toFixed(1)).join(" ")}`).join("") }));
    }
    const at = (i) => (cells ? this.cell(cells, over.values[i], by.values[i]) : place(i));
    for (const i of cases) svg.append(...this.mark(i, at(i), by ? value : null));
    if (cases.includes(view.case)) svg.append(...this.chosenMark(at(view.case)));
    const bar = by ? this.bar(value, peakLabel) : null;
    fill(host, element("h2", { id: "map-title" }, "Peaks"), element("div", { class: "card plot" }, svg, bar),
      fixed.length ? element("p", { class: "soft" }, `at ${fixed.join(", ")}; choose a case to see the others like it`) : null);
    this.saved(host, () => `peaks of ${dof.name} over ${view.over}`, () => this.peakRows(cases));
  }

  /** The menu that saves the drawing of a card and its numbers. */
  saved(host, name, rows) {
    const card = host.querySelector(".card"), drawing = () => svgOfDrawing(card.querySelector("svg"));
    saver(card, name, { PNG: () => pngOfDrawing(drawing()), SVG: drawing, CSV: () => csvOf(rows()) });
  }

  peakRows(cases) {
    const [factor, unit] = this.over;
    return [["case", ...this.parameters.map((p) => withUnits(p.name, p.units)), withUnits(ofDof("peak", this.dof.name), this.dof.units), withUnits(`at ${this.content.followed.label}`, unit), "outcome"],
      ...cases.map((i) => [i, ...this.parameters.map((p) => p.values[i]), this.dof.peak[i], this.dof.at[i] * factor, this.content.cases[i].outcome])];
  }

  cell([columns, rows], px, py) {
    const [[l, r], [b, t]] = [columns.cell(px), rows.cell(py)], width = WIDE - LEFT - RIGHT, height = HIGH - TOP - BOTTOM;
    return [LEFT + l * width, HIGH - BOTTOM - t * height, (r - l) * width, (t - b) * height];
  }

  /** A case in the map: a cell or a dot with its colour; a cross where it did not complete. */
  mark(i, at, scale) {
    const own = this.content.cases[i], peak = this.dof.peak[i], known = Number.isFinite(peak);
    const fillWith = known ? (scale ? shade(scale.at(peak)) : colour("curve-0")) : null;
    const act = () => this.set({ case: this.view.case === i ? null : i });
    const given = { class: known ? "mark" : "mark missing", fill: fillWith, tabindex: 0, role: "button", "aria-label": this.says(i), onclick: act,
      onkeydown: (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); act(); } } };
    const { x, y, shape } = this.placed(at), out = [shape(given)];
    out[0].append(element("svg:title", {}, this.says(i)));
    if (own.outcome && this.bad(i)) out.push(element("svg:path", { class: "failed", "pointer-events": "none", d: `M${x - 5} ${y - 5}L${x + 5} ${y + 5}M${x - 5} ${y + 5}L${x + 5} ${y - 5}` }));
    return out;
  }

  /** Middle and shape of a cell [x, y, width, height] or a dot [x, y]; a peak that is not known stands at the bottom. */
  placed(at) {
    if (at.length === 4) return { x: at[0] + at[2] / 2, y: at[1] + at[3] / 2, shape: (more) => element("svg:rect", { x: at[0], y: at[1], width: at[2], height: at[3], ...more }) };
    const [cx, cy] = [at[0], Number.isFinite(at[1]) ? at[1] : HIGH - BOTTOM - 8];
    return { x: cx, y: cy, shape: (more) => element("svg:circle", { cx, cy, r: 5.5, ...more }) };
  }

  /** Round the case chosen, over all others. */
  chosenMark(at) {
    const { shape } = this.placed(at);
    return [shape({ class: "chosen-mark around" }), shape({ class: "chosen-mark" })];
  }

  says(i) {
    const own = this.content.cases[i];
    if (this.scatter) return `disc ${i}: ${own.outcome ? (this.bad(i) ? own.message : `amplification ${short(this.scatter.values[i])}, largest amplitude ${short(this.dof.peak[i])}${this.dof.after} of ${this.scatter.outputs[i]}`) : "not computed yet"}`;
    const where = this.parameters.map((p) => `${p.name} = ${short(p.values[i])}`).join(", ");
    return `case ${i}: ${where}; ${own.outcome ? (this.bad(i) ? own.message : `peak ${short(this.dof.peak[i])}${this.dof.after}`) : "not computed yet"}`;
  }

  bar(scale, label) {
    const svg = element("svg:svg", { viewBox: `0 0 ${WIDE} 48`, role: "img", "aria-label": `Colours of ${label}` }), n = 60, width = WIDE - LEFT - RIGHT;
    for (let k = 0; k < n; k++) svg.append(element("svg:rect", { x: LEFT + (k / n) * width, y: 4, width: width / n + 0.5, height: 10, fill: shade((k + 0.5) / n) }));
    for (const v of scale.ticks()) svg.append(element("svg:text", { x: LEFT + scale.at(v) * width, y: 27, "text-anchor": "middle" }, short(v, 4)));
    svg.append(element("svg:text", { x: LEFT + width / 2, y: 41, "text-anchor": "middle" }, label));
    return svg;
  }

  /** Values of a parameter; samples about 0 in proportion. */
  along(parameter, air) { return new Scale(parameter.values, air, Boolean(this.content.band) && parameter.values.some((v) => v < 0)); }

  drawCurves() {
    const { view, content } = this, host = document.getElementById("curves"), over = this.parameter(view.over), d = this.peaks.indexOf(this.dof);
    const among = new Set(this.shown().cases), drawn = this.curves.filter((own) => among.has(own.case));
    const [factor, unit] = this.over, xs = new Map(drawn.map((own) => [own, factor === 1 ? own.x : own.x.map((v) => v * factor)]));
    const x = new Scale(drawn.flatMap((own) => finite(xs.get(own)))), y = new Scale(drawn.flatMap((own) => finite(own.y[d])), 0.04), by = this.along(over, 0);
    const svg = frame(x, y, withUnits(content.followed.label, unit), withUnits(ofDof("amplitude", this.dof.name), this.dof.units), "Curves");
    const order = [...drawn].sort((a, b) => (a.case === view.case) - (b.case === view.case));
    for (const own of order) {
      const chosen = own.case === view.case;
      const path = element("svg:path", { class: chosen ? "chosen-line" : "line mark", stroke: chosen ? null : shade(by.at(over.values[own.case])), onclick: () => this.set({ case: own.case }),
        d: Array.from(xs.get(own), (v, k) => `${k === 0 || own.part[k] !== own.part[k - 1] ? "M" : "L"}${across(x, v).toFixed(1)} ${upwards(y, own.y[d][k]).toFixed(1)}`).join("") });
      path.append(element("svg:title", {}, this.says(own.case)));
      svg.append(path);
    }
    const less = content.left_out ? element("p", { class: "soft" }, content.left_out) : null;
    fill(host, element("h2", { id: "curves-title" }, "Curves"), element("div", { class: "card plot" }, svg, this.bar(by, withUnits(over.name, over.units))), less);
    this.saved(host, () => `curves of ${this.dof.name}`, () => [["case", withUnits(content.followed.label, unit), withUnits(ofDof("amplitude", this.dof.name), this.dof.units)],
      ...drawn.flatMap((own) => Array.from(xs.get(own), (v, k) => [own.case, v, own.y[d][k]]))]);
  }

  /** How sure the curves of samples are: percentiles of the amplitude as a band, of the peaks in words. */
  drawBand() {
    const { band, content } = this, host = document.getElementById("band");
    host.hidden = !band;
    if (!band) return;
    const own = band.dofs[this.peaks.indexOf(this.dof)], [factor, unit] = this.over, xs = Array.from(band.x, (v) => v * factor), [low, mid, high] = own.y;
    const x = new Scale(xs), y = new Scale(own.y.flatMap((values) => finite(values)), 0.04), known = xs.map((_, k) => k).filter((k) => Number.isFinite(low[k]));
    const svg = frame(x, y, withUnits(content.followed.label, unit), withUnits(ofDof("amplitude", this.dof.name), this.dof.units), "Percentiles");
    const points = (values, order) => order.map((k) => `${across(x, xs[k]).toFixed(1)} ${upwards(y, values[k]).toFixed(1)}`).join("L");
    const [first, middle, last] = band.percentiles;
    svg.append(element("svg:path", { class: "band", fill: colour("curve-0"), d: `M${points(low, known)}L${points(high, [...known].reverse())}Z` }),
      element("svg:path", { class: "line", stroke: colour("curve-0"), d: `M${points(mid, known)}` }));
    const said = (values, by, after) => `${short(values[1] * by)}${after} (${short(values[0] * by)} to ${short(values[2] * by)})`;
    const text = `${ofDof("Peak", this.dof.name)}: ${said(own.peak, 1, this.dof.after)} at ${said(own.at, factor, unit ? ` ${unit}` : "")}: ${middle} % of the samples, and from ${first} to ${last} %.`;
    fill(host, element("h2", { id: "band-title" }, "Percentiles"), element("div", { class: "card plot" }, svg), element("p", { class: "soft" }, text));
    this.saved(host, () => `percentiles of ${this.dof.name}`, () => [[withUnits(content.followed.label, unit), ...band.percentiles.map((p) => `${p} %`)], ...xs.map((v, k) => [v, low[k], mid[k], high[k]])]);
  }

  /** How many discs have which amplification, and its percentiles. */
  drawAmplification() {
    const { scatter } = this, host = document.getElementById("amplification");
    host.hidden = !scatter?.bins;
    if (host.hidden) return;
    const { edges, counts } = scatter.bins, shown = Object.entries(scatter.percentiles);
    const x = new Scale(edges, 0, true), y = new Scale([0, ...counts], 0, true);
    const svg = frame(x, y, "amplification", "discs", "Histogram of the amplification");
    counts.forEach((count, k) => {
      const [l, r, t] = [across(x, edges[k]), across(x, edges[k + 1]), upwards(y, count)];
      const bar = element("svg:rect", { class: "blade", fill: colour("curve-0"), x: l, y: t, width: r - l, height: HIGH - BOTTOM - t });
      bar.append(element("svg:title", {}, `${short(edges[k])} to ${short(edges[k + 1])}: ${count} discs`));
      svg.append(bar);
    });
    shown.forEach(([, value], k) => svg.append(element("svg:line", { class: "percentile", stroke: colour(`curve-${k + 1}`), x1: across(x, value), x2: across(x, value), y1: TOP, y2: HIGH - BOTTOM })));
    const listed = (values) => Object.entries(values).map(([percent, value]) => `${percent} % ${short(value, 4)}`).join(", ");
    const fit = scatter.fitted ? ` By the Weibull distribution of maxima fitted to them: ${listed(scatter.fitted)}.` : "";
    fill(host, element("h2", { id: "amplification-title" }, "Amplification"), element("div", { class: "card plot" }, svg),
      element("p", { class: "soft" }, `Largest amplitude of ${scatter.discs} discs over that of the tuned disc, ${short(scatter.tuned)}${this.dof.after}: ${listed(scatter.percentiles)}.${fit}`));
    this.saved(host, () => "amplification", () => [["case", "amplification", "output"], ...Array.from(scatter.values, (v, i) => [i, v, scatter.outputs[i]])]);
  }

  /** Deviations of the blades of the disc chosen, else of the worst. */
  drawDisc() {
    const { scatter, view } = this, host = document.getElementById("worst");
    host.hidden = !scatter?.worst;
    if (host.hidden) return;
    const i = view.case ?? scatter.worst.case, values = this.parameters.map((p) => p.values[i]), sector = Number(scatter.outputs[i].split("@").at(-1) || NaN);
    const x = new Scale([-0.5, values.length - 0.5], 0, true), y = new Scale([0, ...values], 0.06, true);
    const svg = frame(x, y, `blade (0 to ${values.length - 1})`, "deviation of stiffness", `Deviations of disc ${i}`), zero = upwards(y, 0);
    values.forEach((value, s) => {
      const [l, r, t] = [across(x, s - 0.4), across(x, s + 0.4), upwards(y, value)];
      const bar = element("svg:rect", { class: "blade", fill: colour(s === sector ? "curve-1" : "curve-0"), x: l, y: Math.min(t, zero), width: r - l, height: Math.abs(zero - t) });
      bar.append(element("svg:title", {}, `blade ${s}: ${short(value)}`));
      svg.append(bar);
    });
    svg.append(element("svg:line", { class: "axis", x1: LEFT, x2: WIDE - RIGHT, y1: zero, y2: zero }));
    const which = i === scatter.worst.case ? "the worst" : "the one chosen";
    fill(host, element("h2", { id: "worst-title" }, `Disc ${i}, ${which}`), element("div", { class: "card plot" }, svg), element("p", { class: "soft" }, this.says(i)));
    this.saved(host, () => `disc ${i}`, () => [["blade", "deviation"], ...values.map((v, s) => [s, v])]);
  }

  columns() {
    if (this.scatter) {
      const [factor, unit] = this.over;
      return [{ key: "number", title: "disc", of: (i) => i }, { key: "amplification", title: "amplification", of: (i) => this.scatter.values[i] },
        { key: "peak", title: withUnits("largest amplitude", this.dof.units), of: (i) => this.dof.peak[i] }, { key: "", title: "of", of: (i) => this.scatter.outputs[i] },
        { key: "", title: withUnits(`at ${this.content.followed.key === "omega" ? "frequency" : this.content.followed.label}`, unit), of: (i) => this.dof.at[i] * factor },
        ...this.times()];
    }
    const own = this.parameters.map((p) => ({ key: p.name, title: withUnits(p.name, p.units), of: (i) => p.values[i] }));
    return [{ key: "number", title: "case", of: (i) => i }, ...own, { key: "peak", title: withUnits(ofDof("peak", this.dof.name), this.dof.units), of: (i) => this.dof.peak[i] },
      { key: "", title: withUnits(`at ${this.content.followed.key === "omega" ? "frequency" : this.content.followed.label}`, this.over[1]), of: (i) => this.dof.at[i] * this.over[0] },
      ...this.times()];
  }

  /** The time of each case, where any has one of its own: cases followed in lockstep share one. */
  times() {
    const of = (i) => this.content.cases[i].seconds ?? NaN;
    return this.content.cases.some((_, i) => Number.isFinite(of(i))) ? [{ key: "seconds", title: "time [s]", of }] : [];
  }

  /** Which cases a filter lets through: words, and conditions such as "velocity=0" or "mu >= 0.3" of parameters. */
  filter(text) {
    const tests = [];
    const words = text.replace(/([\w.*-]+)\s*(<=|>=|=|<|>)\s*([-+]?[\d.]+(?:e[-+]?\d+)?)/gi, (whole, name, sign, number) => {
      const own = this.parameters.find((p) => p.name === name) ?? this.parameters.find((p) => p.name.split(".").at(-1) === name), value = Number(number);
      if (!own || !Number.isFinite(value)) return whole;
      const near = (v) => Math.abs(v - value) <= 1e-9 * Math.max(Math.abs(v), Math.abs(value));
      tests.push((i) => { const v = own.values[i]; return sign === "=" ? near(v) : sign === "<=" ? v < value || near(v) : sign === ">=" ? v > value || near(v) : sign === "<" ? v < value && !near(v) : v > value && !near(v); });
      return " ";
    }).toLowerCase().split(/[\s,]+/).filter(Boolean);
    return (i) => tests.every((test) => test(i)) && words.every((word) => `${this.says(i)} ${this.content.cases[i].outcome}`.toLowerCase().includes(word));
  }

  table(tools) {
    const { view, content } = this, host = document.getElementById("cases"), columns = this.columns();
    const by = columns.find((c) => c.key === view.sort) ?? { of: (i) => content.cases[i].outcome };
    const fits = this.filter(view.words), rows = content.cases.map((_, i) => i).filter((i) => (!view.show || this.bad(i)) && fits(i));
    const order = (a, b) => (a < b ? -1 : a > b ? 1 : Number(Number.isNaN(a)) - Number(Number.isNaN(b)));
    rows.sort((a, b) => (view.down ? -1 : 1) * order(by.of(a), by.of(b)) || a - b);
    const heads = [...columns, { key: "outcome", title: "outcome" }].map(({ key, title }) => element("th", { scope: "col", class: key === "outcome" ? "words" : null, "aria-sort": key && key === view.sort ? (view.down ? "descending" : "ascending") : null },
      key ? element("button", { type: "button", onclick: () => this.set({ sort: key, down: view.sort === key && !view.down }) }, ...broken(title)) : title));
    const body = rows.map((i) => {
      const own = content.cases[i], text = !own.outcome ? "not computed yet" : this.bad(i) ? `${own.outcome}: ${own.message}` : "completed";
      const link = element("a", { href: `#case=${i}`, onclick: (event) => { event.preventDefault(); this.set({ case: i }); } }, String(i));
      return element("tr", { class: `${this.bad(i) ? "bad" : ""} ${view.case === i ? "chosen" : ""}`.trim(), id: `case-${i}` }, element("td", {}, link),
        ...columns.slice(1).map((c) => element("td", {}, typeof c.of(i) === "string" ? c.of(i) : short(c.of(i)))), element("td", { class: "words" }, text));
    });
    const count = element("span", { class: "soft", id: "count" }, `${rows.length} of ${content.cases.length}`);
    const inside = element("div", { class: "card scroll tall", tabindex: 0, role: "region", "aria-label": "Table of cases" }, element("table", { class: "cases" }, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...body)));
    if (!tools && host.lastChild) { // the word being typed keeps its place
      host.querySelector("#count").replaceWith(count);
      host.lastChild.replaceWith(inside);
      this.reveal(inside);
      return;
    }
    const search = element("input", { type: "search", placeholder: "filter: velocity=0, mu>0.3, words", "aria-label": "Filter cases", value: view.words, oninput: (event) => this.set({ words: event.target.value }) });
    fill(host, element("h2", { id: "cases-title" }, "Cases"),
      element("div", { class: "tools-row" }, search, this.choose("show", "show", ["", "bad"], ["all", "those that did not complete"]), count), inside);
    this.reveal(inside);
  }

  /** The case chosen within the part of the table that is seen; the page itself stays where it is. */
  reveal(inside) {
    const row = inside.querySelector("tr.chosen");
    if (row) inside.scrollTop = row.offsetTop - inside.clientHeight / 2;
  }
}

async function start() {
  const text = (id) => document.getElementById(id).textContent;
  STORE.buffer = await inflated(text("numbers"));
  const app = new Study(JSON.parse(text("content")));
  addEventListener("hashchange", () => {
    app.view = app.viewFrom(location.hash);
    app.draw();
  });
  let width = innerWidth, waiting = 0;
  addEventListener("resize", () => {
    if (innerWidth === width) return;
    width = innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(() => app.draw(), 100);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.draw());
  return app;
}

start().then((app) => {
  window.slipstick = { drawn: () => ({ peaks: app.peakRows(app.shown().cases), curves: app.curves.filter((own) => app.shown().cases.includes(own.case)).map((own) => [own.case, [...own.x], own.y.map((y) => [...y])]) }), view: () => ({ ...app.view }), set: (change) => app.set(change) };
  document.documentElement.toggleAttribute("data-ready", true);
});
