// The curves of a branch with their cursor: moved by click, by arrow keys, or by the list of points of note.

class Curves {
  constructor(host, app) {
    Object.assign(this, { host, app });
    this.plotHost = element("div", { class: "plot", id: "curves", tabindex: 0, role: "slider", "aria-label": "Cursor along the curve",
      "aria-valuemin": 0, onkeydown: (event) => this.key(event), onclick: (event) => this.click(event, this.plotHost) });
    this.otherHosts = ["companion", "companion-2"].map((id) => element("div", { class: "plot companion", id, onclick: (event) => this.click(event, event.currentTarget) }));
    this.below = [];
    this.tools = element("div", { class: "tools" });
    this.legend = element("div", { class: "legend" });
    this.side = element("aside", { class: "peaks", "aria-label": "Points of note" });
    this.readout = element("p", { class: "readout", "aria-live": "polite" });
    this.whole = element("div", { class: "with-side" }, element("div", { class: "card" }, this.plotHost, ...this.otherHosts, this.legend, this.readout), this.side);
    new ResizeObserver(() => { this.side.style.maxHeight = innerWidth > 980 ? `${this.whole.firstChild.offsetHeight}px` : ""; }).observe(this.whole.firstChild);
    this.cursors = [this.plotHost, ...this.otherHosts].map((plotHost) => ({ plotHost, dot: element("div", { class: "cursor-dot" }), rule: element("div", { class: "cursor-rule" }) }));
    host.append(this.tools, this.whole);
  }

  get curve() { return this.app.model.curves.find((curve) => curve.key === this.app.view.curve); }

  /** The quantities drawn below: the rest of the result of a tracked peak, a mode, a limit cycle, wear. */
  get companions() {
    const { model, view } = this.app;
    const keys = model.results[0].content.companions.filter((key) => key !== view.over).map((key) => (key === view.curve ? "amplitude" : key));
    return keys.filter((key) => key !== view.curve).map((key) => model.curves.find((curve) => curve.key === key)).filter(Boolean);
  }

  /** Names of the curves that are drawn: of dofs, of contacts, or of none where there is one for the whole branch. */
  names(curve) {
    const { model, view } = this.app, { over, total } = curve;
    if (over === "") return [""];
    // what has no sum over all contacts shows the contact at the cursor in its place
    const chosen = over === "dof" ? view.dofs : [...new Set(view.contacts.map((name) => name || (total ? "" : view.contact)))];
    const known = (name) => model.results.some((result) => result.known(curve.key, name));
    return chosen.some(known) ? chosen : model[`${over}s`].filter(known);
  }

  /** Whether contacts of any result can stick, so that there is a limit of every contact stuck. */
  get bothLimits() { return this.app.model.results.some((result) => result.content.references.length > 1); }

  /** What is drawn, in one word: the same word, the same curves. */
  drawn() {
    return JSON.stringify([this.curve, ...this.companions].map((curve) => (curve ? this.names(curve) : [])));
  }

  /** Every line of a quantity: result, name, places and values, colour. */
  linesOf(curve) {
    const { model, view } = this.app, found = [];
    for (const name of this.names(curve)) {
      for (const result of model.results.filter((own) => own.known(curve.key, name))) {
        const [x, y] = [this.scaled(result.abscissa(view.over), result.at(view.over), result), this.scaled(curve, result.values(curve.key, name), result)];
        found.push({ result, name, x, y, stroke: colourOf(model, curve.over, name, result) });
      }
    }
    return found;
  }

  scaled(own, values, result) {
    const [factor] = result.unitsOf(own, this.app.view.unit);
    return factor === 1 ? values : Float64Array.from(values, (value) => value * factor);
  }

  /** The line under the cursor. */
  current(lines = this.lines, over = this.curve?.over) {
    const { view } = this.app, name = over === "dof" ? view.dof : view.contact;
    const own = lines.filter((line) => line.result.index === view.result);
    return own.find((line) => line.name === name) ?? own.find((line) => line.name === "") ?? own[0] ?? null;
  }

  currentOf(own) { return own ? this.current(own.lines, own.curve.over) : null; }

  draw() {
    const { model } = this.app;
    this.lines = this.curve ? this.linesOf(this.curve) : [];
    if (!this.lines.length) { // a quantity without a number is not offered, so there is none at all
      fill(this.host, element("h2", { id: "response-title" }, "Response"), element("p", { class: "card" }, "No point was found, so there is no curve."));
      return;
    }
    this.drawNotes(); // as wide as its rows; the charts have what is left
    const { companions } = this, height = Math.round(Math.min(460, Math.max(260, 0.5 * this.plotHost.clientWidth)));
    this.drawChart(this.plotHost, this.curve, this.lines, companions.length ? Math.round(0.72 * height) : height);
    this.below = companions.map((curve, i) => ({ curve, host: this.otherHosts[i], lines: this.linesOf(curve) })).filter(({ lines }) => lines.length);
    for (const host of this.otherHosts) host.hidden = !this.below.some((own) => own.host === host);
    for (const own of this.below) this.drawChart(own.host, own.curve, own.lines, Math.round(0.55 * height));
    this.drawTools();
    this.drawLegend();
    this.move();
    document.getElementById("response-title").textContent = TITLES[model.results[0].content.analysis] ?? "Response";
  }

  drawChart(host, curve, lines, height) {
    const { view, model } = this.app, { log } = view, first = lines[0].result, over = first.abscissa(view.over);
    const limits = this.limits(curve, lines, log), own = lines.flatMap((line) => [...this.banded(curve, line, log), ...this.styled(line, log)]);
    const range = (of, axis, zero) => rangeOf([...lines, ...limits].map((line) => line[of]), { log: log.includes(axis), air: of === "x" ? 0.015 : this.companions.length ? 0.12 : 0.06, zero });
    const inside = range("x", "x", false);
    chart(host, {
      x: { label: over.label, units: this.app.unitsOf(over, first)[1], log: log.includes("x"), range: inside },
      y: { label: quantityOf(curve), units: this.app.unitsOf(curve, first)[1], log: log.includes("y"), letters: this.companions.length ? LETTERS : 2, range: range("y", "y", curve.key === "amplitude" || curve.key === "mean") },
      lines: [...limits, ...own, ...this.rings(curve, lines, log)], height, zoom: true, name: `${quantityOf(curve)} over ${over.label}`,
      hooks: { draw: [() => this.place()] }, marks: zeroLine,
    });
    const cursor = this.cursors.find(({ plotHost }) => plotHost === host);
    host.uplot.over.append(cursor.rule, cursor.dot);
    if (model.results.length > 1) for (const line of own) line.name = `${line.result.label} ${line.name}`.trim();
  }

  /** One line, and where stability was computed two more: a stretch is dashed where it is unstable, dotted where nobody knows. */
  styled(line, log) {
    const { part, content, points } = line.result;
    const broken = Uint8Array.from(part, (p, i) => (i > 0 && part[i - 1] === p ? 1 : 0));
    const smooth = SMOOTH.includes(content.analysis) ? Uint8Array.from(part, (_, i) => (CORNERS.includes(line.result.kind(i)) ? 1 : 0)) : null;
    const base = { result: line.result, x: line.x, y: line.y, log, stroke: line.stroke, width: 2, name: line.name, smooth };
    if (!content.unstable) return [{ ...base, pen: broken }];
    const verdict = Array.from({ length: points }, (_, i) => line.result.verdict(i));
    const of = (i) => [verdict[i], verdict[i - 1]].find((own) => own !== "stable") ?? "stable";
    const pen = (own) => broken.map((b, i) => (b && of(i) === own ? 1 : 0));
    return [{ ...base, pen: pen("stable") }, { ...base, pen: pen("unstable"), dash: [6, 5], width: 1.6, repeated: true },
      { ...base, pen: pen("stability not known"), dash: [2, 4], width: 1.6, repeated: true }];
  }

  /** Thin lines round an amplitude: what tolerances of parameters make of it. */
  banded(curve, line, log) {
    if (curve.key !== "amplitude") return [];
    const { part } = line.result, pen = Uint8Array.from(part, (p, i) => (i > 0 && part[i - 1] === p ? 1 : 0));
    return line.result.band(line.name).map((y, i) => ({ result: line.result, x: line.x, y, log, stroke: line.stroke, width: 1, dash: [1, 3], pen, name: `${line.name} ${i ? "highest" : "lowest"}` }));
  }

  /** Thin grey lines: amplitudes without contact and with every contact stuck. */
  limits(curve, lines, log) {
    const { view } = this.app;
    if (!view.limits || curve.key !== "amplitude" || view.over !== "omega") return [];
    return lines.flatMap((line) => line.result.limits(line.name).map(({ label, x, y }, i) => ({ x: this.scaled(line.result.abscissa("omega"), x, line.result), y, log,
      stroke: colour("text-faint"), width: i ? 1.1 : 1.8, name: `${line.name}, ${label}` })));
  }

  /** Points of note as rings on the lines. */
  rings(curve, lines, log) {
    return lines.map((line) => {
      const at = line.result.content.notes.filter(([, dof]) => dof < 0 || (curve.key === "amplitude" && line.result.dofs[dof] === line.name)).map(([point]) => point);
      return { kind: "rings", log, x: at.map((p) => line.x[p]), y: at.map((p) => line.y[p]), stroke: line.stroke, fill: colour("card"), width: 1.6 };
    });
  }

  /** Put dot, rule and words where the cursor is. */
  move() {
    const line = this.current(), { view } = this.app;
    this.plotHost.setAttribute("aria-valuemax", Math.max(0, this.app.result.points - 1));
    this.plotHost.setAttribute("aria-valuenow", view.point);
    const words = line ? this.words(line) : "";
    this.plotHost.setAttribute("aria-valuetext", words);
    this.readout.textContent = words;
    this.place();
  }

  place() {
    for (const { plotHost, dot, rule } of this.cursors) {
      const plot = plotHost.uplot, line = plotHost === this.plotHost ? this.current() : this.currentOf(this.below.find(({ host }) => host === plotHost));
      if (!plot || !line || plotHost.hidden) continue;
      const [x, y] = [plot.valToPos(line.x[this.app.view.point], "x"), plot.valToPos(line.y[this.app.view.point], "y")];
      const inside = x >= -1 && x <= plot.over.clientWidth + 1 && y >= -1 && y <= plot.over.clientHeight + 1;
      rule.hidden = dot.hidden = !inside;
      if (!inside) continue;
      rule.style.left = `${x}px`;
      dot.style.left = `${x}px`;
      dot.style.top = `${y}px`;
      dot.style.background = line.stroke;
    }
  }

  /** The point under the cursor in words: where, the quantity, what else is known there. */
  words(line) {
    const { view } = this.app, { result } = line, verdict = result.verdict(view.point), kind = result.kind(view.point);
    const name = line.name || (this.curve.over === "contact" ? "all contacts" : "");
    const after = result.afterOf(this.curve, view.unit, line.name);
    const beside = [...this.companions, this.curve.key === "amplitude" ? result.curve("phase") : null].filter(Boolean)
      .map((own) => [own, result.values(own.key, own.over === "dof" ? (this.curve.over === "dof" ? line.name : view.dof) : own.over === "contact" ? view.contact : "")?.[view.point]]).filter(([, value]) => Number.isFinite(value))
      .map(([own, value]) => (own.key === "omega" ? this.app.said(own, value) : `${quantityOf(own).toLowerCase()} ${short(value)}${result.afterOf(own, view.unit, line.name)}`));
    const said = [
      `point ${view.point} (0 to ${result.points - 1})`, this.app.where(),
      `${name ? `${name}: ` : ""}${quantityOf(this.curve).toLowerCase()} ${short(line.y[view.point])}${after}`, ...beside,
      kind && kind !== "regular" ? kind : "", verdict,
      this.app.model.results.length > 1 ? result.label : "",
    ];
    return said.filter(Boolean).join(" · ");
  }

  /** The drawn point nearest to a click becomes the cursor. */
  click(event, host) {
    const plot = host.uplot, { lines, curve } = host === this.plotHost ? this : this.below.find((own) => own.host === host) ?? { lines: [] };
    if (!plot || !event.target.closest(".u-over")) return;
    const box = plot.over.getBoundingClientRect(), [cx, cy] = [event.clientX - box.left, event.clientY - box.top];
    let best = null;
    for (const line of lines) {
      for (let i = 0; i < line.x.length; i++) {
        const distance = Math.hypot(plot.valToPos(line.x[i], "x") - cx, plot.valToPos(line.y[i], "y") - cy);
        if (!best || distance < best.distance) best = { distance, line, i };
      }
    }
    if (best) this.choose(best.line, best.i, curve.over);
  }

  choose(line, point, over = this.curve.over) {
    this.app.set({ result: line.result.index, point, ...(over && line.name ? { [over]: line.name } : {}) });
  }

  key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
    const turn = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    const last = this.app.result.points - 1;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (step) this.app.set({ point: Math.max(0, Math.min(last, this.app.view.point + step * (event.shiftKey ? 10 : 1))) });
    else if (event.key === "Home") this.app.set({ point: 0 });
    else if (event.key === "End") this.app.set({ point: last });
    else if (turn) this.turn(turn);
    else return;
    event.preventDefault();
  }

  /** On to another curve, at the place nearest to where the cursor is; where there is one curve, to another contact. */
  turn(by) {
    if (this.lines.length < 2) { this.app.turnContact(by); return; }
    const at = this.lines.indexOf(this.current()), { over, point } = this.app.view;
    const next = this.lines[(at + by + this.lines.length) % this.lines.length];
    const here = this.lines[at].result;
    this.choose(next, next.result === here ? point : nearest(next.result.at(over), here.at(over)[point]));
  }

  drawTools() {
    const { view, model } = this.app, app = this.app;
    const select = (id, label, all, chosen) => [element("label", { for: id, class: "hidden" }, label), element("select", { id, onchange: (event) => app.set({ [id]: event.target.value }) },
      ...all.map((own) => element("option", { value: own.key, selected: own.key === chosen }, id === "over" ? `over ${quantityOf(own)}` : quantityOf(own))))];
    const log = (axis) => element("button", { type: "button", "aria-pressed": String(view.log.includes(axis)), onclick: () =>
      app.set({ log: ["x", "y"].filter((a) => (a === axis) !== view.log.includes(a)).join("") }) }, `log ${axis}`);
    const known = view.curve === "amplitude" && view.over === "omega" && model.results.some((result) => result.content.references.length);
    const frequency = [view.over, view.curve, ...this.companions.map(({ key }) => key)].includes("omega") && model.frequencies.length > 1;
    fill(this.tools,
      element("h2", { id: "response-title" }, "Response"), ...select("curve", "Quantity", model.curves, view.curve),
      ...(model.overs.length > 1 ? select("over", "Over", model.overs, view.over) : []),
      frequency ? choice("Unit of frequency", Object.fromEntries(model.frequencies.map((u) => [u, u])), view.unit, (unit) => app.set({ unit })) : null,
      element("span", { class: "choice", role: "group", "aria-label": "Logarithmic axes" }, log("x"), log("y")),
      known ? element("button", { type: "button", id: "limits", "aria-pressed": String(view.limits), onclick: () => app.set({ limits: !view.limits }) }, this.bothLimits ? "free and stuck" : "without contact") : null,
      element("button", { type: "button", class: "plain", onclick: () => this.draw() }, "whole range"));
  }

  /** Buttons that show and hide curves of dofs or contacts; with several results each line is named below. */
  drawLegend() {
    const { model, view } = this.app, { over, total } = this.curve, names = this.names(this.curve);
    const known = (name) => model.results.some((result) => result.known(view.curve, name));
    const offered = over === "dof" ? model.dofs : over === "contact" ? [...(total ? [""] : []), ...model.contacts] : [];
    const toggle = (name) => {
      const next = names.includes(name) ? names.filter((other) => other !== name) : [...names, name];
      this.app.set({ [`${over}s`]: next.length ? next : [name], ...(names.includes(name) || !name ? {} : { [over]: name }) });
    };
    const several = model.results.length > 1;
    const chips = offered.filter(known).map((name) => element("button", { type: "button", class: "chip", "aria-pressed": String(names.includes(name)), onclick: () => toggle(name) },
      ...(several ? [] : this.lines.filter((line) => line.name === name).map(swatch)), name || "all contacts"));
    const labels = several ? this.lines.map((line) => element("span", { class: "line-name" }, swatch(line), `${line.result.label}${line.name ? ` · ${line.name}` : ""}`)) : [];
    const judged = new Set(model.results.flatMap((result) => (result.content.unstable ? Array.from({ length: result.points }, (_, i) => result.verdict(i)) : [])));
    const verdicts = [["stable", "solid: stable"], ["unstable", "dashed: unstable"], ["stability not known", "dotted: not known"]].filter(([own]) => judged.has(own)).map(([, said]) => said);
    const dashed = verdicts.length ? [element("span", { class: "line-name" }, verdicts.join(", "))] : [];
    const grey = view.limits && this.curve.key === "amplitude" && view.over === "omega" ? [element("span", { class: "line-name" }, this.bothLimits ? "grey, thick: without contact; thin: every contact stuck" : "grey: without contact")] : [];
    const less = this.app.leftOut(over);
    fill(this.legend,
      element("div", { class: "chips", role: "group", "aria-label": "Curves" }, ...chips, less ? element("span", { class: "soft" }, less) : null),
      element("div", { class: "line-names" }, ...labels, ...dashed, ...grey, ...this.bandNames()));
  }

  /** What the thin lines are of. */
  bandNames() {
    if (this.curve.key !== "amplitude") return [];
    const said = new Set(this.app.model.results.map((result) => result.content.bands?.said).filter(Boolean));
    return [...said].map((text) => element("span", { class: "line-name" }, `dotted: ${text}`));
  }

  /** Peaks, optima, load factors, bifurcations: a row each, which moves the cursor there. */
  drawNotes() {
    const { model, view } = this.app, found = [];
    for (const result of model.results) {
      for (const [point, dof, kind] of result.content.notes) {
        const name = dof < 0 ? "" : result.dofs[dof], of = dof < 0 ? soughtOf(result).name : name;
        found.push({ result, point, name, kind, size: result.values("amplitude", of)?.[point] ?? NaN, unit: result.unitOf(of) });
      }
    }
    const rank = ({ kind }) => (kind === "optimum" ? 0 : kind === "peak" ? 1 : 2);
    found.sort((a, b) => rank(a) - rank(b) || (a.kind === "peak" ? (a.unit === "rad") - (b.unit === "rad") || b.size - a.size : a.result.index - b.result.index || a.point - b.point));
    const { analysis } = model.results[0].content, first = model.results[0], units = [...new Set(model.results.flatMap((result) => result.content.dofs.units_of))];
    const peaked = analysis === "response" || analysis === "parameter";
    this.side.hidden = !peaked && !found.length;
    this.whole.toggleAttribute("data-alone", this.side.hidden);
    const columns = [...model.overs.slice(0, 1), ...(peaked ? [] : model.curves.filter(({ key }) => ["omega", "modal_damping"].includes(key)))];
    const heads = [...(model.results.length > 1 ? ["result"] : []), "", ...columns.map((own, i) => withUnits(own.key === "omega" && i === 0 ? "at" : own.key === "parameter" && own.label.length < 12 ? own.label : BRIEF[own.key] ?? own.label, this.app.unitsOf(own, first)[1])), withUnits(`amplitude${peaked ? "" : ` of ${soughtOf(first).name}`}`, units.length > 1 ? "" : units[0] ?? "")];
    const rows = found.map((note) => this.noteRow(note, columns, model.results.length > 1, units.length > 1));
    fill(this.side, element("h3", {}, found.some(({ kind }) => kind !== "peak") || !peaked ? "Points of note" : "Peaks"),
      rows.length ? element("table", { class: "list" }, element("thead", {}, element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)))), element("tbody", {}, ...rows))
        : element("p", { class: "soft" }, "No peak was located on these curves."));
  }

  noteRow({ result, point, name, kind, size, unit }, columns, several, mixed) {
    const { view } = this.app;
    const go = () => this.app.set({ result: result.index, point, ...(name ? { curve: "amplitude", dof: name, dofs: view.dofs.includes(name) ? view.dofs : [...view.dofs, name] } : {}) });
    const verdict = result.verdict(point), stable = verdict && verdict !== "stable" ? ` (${verdict})` : "", load = result.values("load_factor", "")?.[point];
    const said = kind === "peak" ? name : kind !== "requested" ? kind : Number.isFinite(load) ? `loads × ${short(load, 4)}` : "as asked";
    const values = columns.map((own) => {
      const values = own === columns[0] ? result.at(own.key) : result.values(own.key, "");
      return element("td", {}, short((values?.[point] ?? NaN) * this.app.unitsOf(own, result)[0]));
    });
    return element("tr", {}, ...[several ? element("td", { class: "soft" }, result.label) : null,
      element("td", {}, element("button", { type: "button", class: "plain", onclick: go }, said)), ...values, element("td", {}, `${short(size)}${mixed ? ` ${unit}` : ""}${stable}`)].filter(Boolean));
  }
}

/** Results of few points, each far from the next: their lines are smooth but for corners. */
const SMOOTH = ["track", "modes"], CORNERS = ["tie", "corner"];
const BRIEF = { modal_amplitude: "amplitude of the mode", omega: "frequency", modal_damping: "damping", parameter: "parameter" };
/** Room for the numbers of two charts, one below the other, so that places are. */
const LETTERS = 6;
const TITLES = { response: "Response", parameter: "Response over the parameter", track: "Peak over the parameter", modes: "Nonlinear mode", cycles: "Self-excited vibration", wear: "Wear over cycles" };

function swatch(line) {
  return element("svg:svg", { width: 18, height: 8, "aria-hidden": "true" },
    element("svg:line", { x1: 1, x2: 17, y1: 4, y2: 4, stroke: line.stroke, "stroke-width": 2.5, "stroke-linecap": "round" }));
}
