// The page of a study: peaks over its parameters, the curves behind them, every case in a table.

const CIVIDIS = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];
let [WIDE, HIGH] = [560, 380]; // as wide as the card, so that letters keep their size
const [LEFT, RIGHT, TOP, BOTTOM] = [74, 14, 14, 52];
const OVER_DECADES = 30;

const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;

/** A colour for a part between 0 and 1, none that the card hides. */
function shade(part) {
  const [first, last] = isDark() ? [0.25, 1] : [0, 0.94], inside = first + Math.max(0, Math.min(1, part)) * (last - first);
  const at = inside * (CIVIDIS.length - 1), i = Math.min(CIVIDIS.length - 2, Math.floor(at));
  return `rgb(${CIVIDIS[i].map((c, k) => Math.round(c + (at - i) * (CIVIDIS[i + 1][k] - c))).join(",")})`;
}

const finite = (values) => Array.from(values).filter(Number.isFinite);

/** Where values lie between 0 and 1: logarithmically where they spread over decades. */
class Scale {
  constructor(values, air = 0) {
    const known = finite(values), low = Math.min(...known), high = Math.max(...known);
    this.log = known.length > 1 && low > 0 && high / low > OVER_DECADES;
    [this.low, this.high] = known.length ? (this.log ? [Math.log10(low), Math.log10(high)] : [low, high]) : [0, 1];
    if (this.low === this.high) [this.low, this.high] = [this.low - 0.5 * (Math.abs(this.low) || 1), this.high + 0.5 * (Math.abs(this.high) || 1)];
    const spread = this.high - this.low;
    [this.low, this.high] = [this.low - air * spread, this.high + air * spread];
  }

  /** Cells around sorted values, half way between, and the scale widened to hold them. */
  cells(values) {
    const at = values.map((v) => (this.log ? Math.log10(v) : v)), middle = at.slice(1).map((a, i) => (a + at[i]) / 2);
    const all = at.length === 1 ? [this.low, this.high] : [2 * at[0] - middle[0], ...middle, 2 * at[at.length - 1] - middle[middle.length - 1]];
    [this.low, this.high] = [all[0], all[all.length - 1]];
    const part = (a) => (a - this.low) / (this.high - this.low);
    return new Map(values.map((v, i) => [v, [part(all[i]), part(all[i + 1])]]));
  }

  at(value) { return ((this.log ? Math.log10(value) : value) - this.low) / (this.high - this.low); }

  ticks() {
    if (this.log) {
      const out = [];
      for (let k = Math.ceil(this.low); k <= this.high; k++) out.push(10 ** k);
      return out.length > 1 ? out : [10 ** this.low, 10 ** this.high];
    }
    const rough = (this.high - this.low) / 5, size = 10 ** Math.floor(Math.log10(rough)), step = [1, 2, 5, 10].map((m) => m * size).find((s) => s >= rough);
    const out = [];
    for (let k = Math.ceil(this.low / step); k * step <= this.high; k++) out.push(k * step);
    return out;
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

const sorted = (values) => [...new Set(values)].sort((a, b) => a - b);

class Study {
  constructor(content) {
    this.content = content;
    this.parameters = content.parameters.map((own) => ({ ...own, values: new Numbers(own.values).column() }));
    this.peaks = content.dofs.map((own) => ({ ...own, peak: new Numbers(own.peak).column(), at: new Numbers(own.at).column() }));
    this.curves = content.curves.map((own) => ({ case: own.case, x: new Numbers(own.x).column(), y: own.y.map((y) => new Numbers(y).column()), part: new Numbers(own.part).column() }));
    this.view = this.viewFrom(location.hash);
    head(document.getElementById("head"), { title: content.title, results: [] });
    document.getElementById("head").append(this.outcome());
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
      case: given.get("case") && this.content.cases[number] ? number : null, show: known("show", ["", "bad"], ""), words: given.get("words") ?? "",
      sort: known("sort", ["number", ...names, "peak", "outcome", "seconds"], "number"), down: given.get("down") === "1",
    };
  }

  set(change) {
    this.view = { ...this.view, ...change };
    if (this.view.by === this.view.over) this.view.by = "";
    const out = new URLSearchParams(Object.entries(this.view).filter(([, v]) => v !== null && v !== "" && v !== false).map(([k, v]) => [k, v === true ? "1" : v]));
    history.replaceState(null, "", `#${out}`);
    this.draw(!("words" in change));
  }

  get dof() { return this.peaks.find((own) => own.name === this.view.dof); }
  parameter(name) { return this.parameters.find((own) => own.name === name); }
  bad(i) { return this.content.cases[i].outcome !== "COMPLETED"; }

  outcome() {
    const { content } = this, { outcome } = content, failed = content.cases.filter((own) => own.outcome && own.outcome !== "COMPLETED").length;
    const facts = [`${content.cases.length} cases`, failed ? `${failed} did not complete` : "", content.method, content.case_file].filter(Boolean);
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
      others.length ? this.choose("and", "by", ["", ...others], ["nothing else", ...others]) : null));
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
    const x = new Scale(over.values, grid ? 0 : 0.05), value = new Scale(cases.map((i) => dof.peak[i]), by ? 0 : 0.08);
    const y = by ? new Scale(by.values, grid ? 0 : 0.05) : value;
    const cells = grid ? [x.cells(sorted(over.values)), y.cells(sorted(by.values))] : null;
    const peakLabel = withUnits(`peak of ${dof.name}`, this.content.units), yLabel = by ? withUnits(by.name, by.units) : peakLabel;
    const svg = frame(x, y, withUnits(over.name, over.units), yLabel, `${peakLabel} over ${view.over}`);
    const place = (i) => [across(x, over.values[i]), upwards(y, by ? by.values[i] : dof.peak[i])];
    if (!by && this.content.grid) {
      const line = cases.filter((i) => Number.isFinite(dof.peak[i])).sort((a, b) => over.values[a] - over.values[b]);
      svg.append(element("svg:path", { class: "line", stroke: colour("curve-0"), d: line.map((i, k) => `${k ? "L" : "M"}${place(i).map((v) => v.toFixed(1)).join(" ")}`).join("") }));
    }
    for (const i of cases) svg.append(...this.mark(i, cells ? this.cell(cells, over.values[i], by.values[i]) : place(i), by ? value : null));
    const bar = by ? this.bar(value, peakLabel) : null;
    fill(host, element("h2", { id: "map-title" }, "Peaks"), element("div", { class: "card" }, svg, bar),
      fixed.length ? element("p", { class: "soft" }, `at ${fixed.join(", ")}; choose a case to see the others like it`) : null);
  }

  cell([columns, rows], px, py) {
    const [[l, r], [b, t]] = [columns.get(px), rows.get(py)], width = WIDE - LEFT - RIGHT, height = HIGH - TOP - BOTTOM;
    return [LEFT + l * width, HIGH - BOTTOM - t * height, (r - l) * width, (t - b) * height];
  }

  /** A case in the map: a cell or a dot with its colour; a cross where it did not complete. */
  mark(i, at, scale) {
    const own = this.content.cases[i], peak = this.dof.peak[i], known = Number.isFinite(peak);
    const fillWith = known ? (scale ? shade(scale.at(peak)) : colour("curve-0")) : null;
    const act = () => this.set({ case: this.view.case === i ? null : i });
    const given = { class: known ? "mark" : "mark missing", fill: fillWith, tabindex: 0, role: "button", "aria-label": this.says(i), onclick: act,
      onkeydown: (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); act(); } } };
    const [x, y] = at.length === 4 ? [at[0] + at[2] / 2, at[1] + at[3] / 2] : [at[0], Number.isFinite(at[1]) ? at[1] : HIGH - BOTTOM - 8];
    const shape = at.length === 4 ? (more) => element("svg:rect", { x: at[0], y: at[1], width: at[2], height: at[3], ...more }) : (more) => element("svg:circle", { cx: x, cy: y, r: 5.5, ...more });
    const out = [shape(given)];
    out[0].append(element("svg:title", {}, this.says(i)));
    if (own.outcome && this.bad(i)) out.push(element("svg:path", { class: "failed", "pointer-events": "none", d: `M${x - 5} ${y - 5}L${x + 5} ${y + 5}M${x - 5} ${y + 5}L${x + 5} ${y - 5}` }));
    if (this.view.case === i) out.push(shape({ class: "chosen-mark" }));
    return out;
  }

  says(i) {
    const own = this.content.cases[i], where = this.parameters.map((p) => `${p.name} = ${short(p.values[i])}`).join(", ");
    return `case ${i}: ${where}; ${own.outcome ? (this.bad(i) ? own.message : `peak ${short(this.dof.peak[i])}${this.content.after}`) : "not computed yet"}`;
  }

  bar(scale, label) {
    const svg = element("svg:svg", { viewBox: `0 0 ${WIDE} 48`, role: "img", "aria-label": `Colours of ${label}` }), n = 60, width = WIDE - LEFT - RIGHT;
    for (let k = 0; k < n; k++) svg.append(element("svg:rect", { x: LEFT + (k / n) * width, y: 4, width: width / n + 0.5, height: 10, fill: shade((k + 0.5) / n) }));
    for (const v of scale.ticks()) svg.append(element("svg:text", { x: LEFT + scale.at(v) * width, y: 27, "text-anchor": "middle" }, short(v, 4)));
    svg.append(element("svg:text", { x: LEFT + width / 2, y: 41, "text-anchor": "middle" }, label));
    return svg;
  }

  drawCurves() {
    const { view, content } = this, host = document.getElementById("curves"), over = this.parameter(view.over), d = this.peaks.indexOf(this.dof);
    const among = new Set(this.shown().cases), drawn = this.curves.filter((own) => among.has(own.case));
    const x = new Scale(drawn.flatMap((own) => finite(own.x))), y = new Scale(drawn.flatMap((own) => finite(own.y[d])), 0.04), by = new Scale(over.values);
    const svg = frame(x, y, withUnits(content.followed.label, content.followed.units), withUnits(`amplitude of ${this.dof.name}`, content.units), "Curves");
    const order = [...drawn].sort((a, b) => (a.case === view.case) - (b.case === view.case));
    for (const own of order) {
      const chosen = own.case === view.case;
      const path = element("svg:path", { class: chosen ? "chosen-line" : "line mark", stroke: chosen ? null : shade(by.at(over.values[own.case])), onclick: () => this.set({ case: own.case }),
        d: Array.from(own.x, (v, k) => `${k === 0 || own.part[k] !== own.part[k - 1] ? "M" : "L"}${across(x, v).toFixed(1)} ${upwards(y, own.y[d][k]).toFixed(1)}`).join("") });
      path.append(element("svg:title", {}, this.says(own.case)));
      svg.append(path);
    }
    const less = content.left_out ? element("p", { class: "soft" }, content.left_out) : null;
    fill(host, element("h2", { id: "curves-title" }, "Curves"), element("div", { class: "card" }, svg, this.bar(by, withUnits(over.name, over.units))), less);
  }

  columns() {
    const own = this.parameters.map((p) => ({ key: p.name, title: withUnits(p.name, p.units), of: (i) => p.values[i] }));
    return [{ key: "number", title: "case", of: (i) => i }, ...own, { key: "peak", title: withUnits(`peak of ${this.dof.name}`, this.content.units), of: (i) => this.dof.peak[i] },
      { key: "", title: withUnits(`at ${this.content.followed.label}`, this.content.followed.units), of: (i) => this.dof.at[i] },
      { key: "seconds", title: "time [s]", of: (i) => this.content.cases[i].seconds ?? NaN }];
  }

  table(tools) {
    const { view, content } = this, host = document.getElementById("cases"), columns = this.columns();
    const by = columns.find((c) => c.key === view.sort) ?? { of: (i) => content.cases[i].outcome };
    const words = view.words.toLowerCase();
    const rows = content.cases.map((_, i) => i).filter((i) => (!view.show || this.bad(i)) && (!words || `${this.says(i)} ${content.cases[i].outcome}`.toLowerCase().includes(words)));
    const order = (a, b) => (a < b ? -1 : a > b ? 1 : Number(Number.isNaN(a)) - Number(Number.isNaN(b)));
    rows.sort((a, b) => (view.down ? -1 : 1) * order(by.of(a), by.of(b)) || a - b);
    const heads = [...columns, { key: "outcome", title: "outcome" }].map(({ key, title }) => element("th", { scope: "col", class: key === "outcome" ? "words" : null, "aria-sort": key && key === view.sort ? (view.down ? "descending" : "ascending") : null },
      key ? element("button", { type: "button", onclick: () => this.set({ sort: key, down: view.sort === key && !view.down }) }, title) : title));
    const body = rows.map((i) => {
      const own = content.cases[i], text = !own.outcome ? "not computed yet" : this.bad(i) ? `${own.outcome}: ${own.message}` : "completed";
      const link = element("a", { href: `#case=${i}`, onclick: (event) => { event.preventDefault(); this.set({ case: i }); } }, String(i));
      return element("tr", { class: `${this.bad(i) ? "bad" : ""} ${view.case === i ? "chosen" : ""}`.trim(), id: `case-${i}` }, element("td", {}, link),
        ...columns.slice(1).map((c) => element("td", {}, short(c.of(i)))), element("td", { class: "words" }, text));
    });
    const count = element("span", { class: "soft", id: "count" }, `${rows.length} of ${content.cases.length}`);
    const inside = element("div", { class: "card scroll tall", tabindex: 0, role: "region", "aria-label": "Table of cases" }, element("table", { class: "cases" }, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...body)));
    if (!tools && host.lastChild) { // the word being typed keeps its place
      host.querySelector("#count").replaceWith(count);
      host.lastChild.replaceWith(inside);
      return;
    }
    const search = element("input", { type: "search", placeholder: "filter", "aria-label": "Filter cases", value: view.words, oninput: (event) => this.set({ words: event.target.value }) });
    fill(host, element("h2", { id: "cases-title" }, "Cases"),
      element("div", { class: "tools-row" }, search, this.choose("show", "show", ["", "bad"], ["all", "those that did not complete"]), count), inside);
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
  window.slipstick = { view: () => ({ ...app.view }), set: (change) => app.set(change) };
  document.documentElement.toggleAttribute("data-ready", true);
});
