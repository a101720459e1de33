// The response curves with their cursor: moved by click, by arrow keys, or by the list of peaks.

class Curves {
  constructor(host, app) {
    Object.assign(this, { host, app });
    this.plotHost = element("div", { class: "plot", id: "curves", tabindex: 0, role: "slider", "aria-label": "Cursor along the curve",
      "aria-valuemin": 0, onkeydown: (event) => this.key(event), onclick: (event) => this.click(event) });
    this.tools = element("div", { class: "tools" });
    this.legend = element("div", { class: "legend" });
    this.side = element("aside", { class: "peaks", "aria-label": "Peaks" });
    this.readout = element("p", { class: "readout", "aria-live": "polite" });
    host.append(this.tools, element("div", { class: "with-side" }, element("div", { class: "card" }, this.plotHost, this.legend, this.readout), this.side));
    this.dot = element("div", { class: "cursor-dot" });
    this.rule = element("div", { class: "cursor-rule" });
  }

  get curve() { return this.app.model.curves.find((curve) => curve.key === this.app.view.curve); }

  /** Every curve shown: result, name, colour. */
  shown() {
    const { model, view } = this.app, over = this.curve?.over;
    const names = over === "dof" ? view.dofs : over === "contact" ? view.contacts : [""];
    const found = [];
    for (const name of names) {
      for (const result of model.results) {
        const values = result.points ? result.values(view.curve, name) : null;
        if (values?.some(Number.isFinite)) found.push({ result, name, values, stroke: curveColour(found.length) });
      }
    }
    return found;
  }

  /** The curve under the cursor. */
  current() {
    const { view } = this.app, name = this.curve?.over === "dof" ? view.dof : view.contact;
    const own = this.lines.filter((line) => line.result.index === view.result);
    return own.find((line) => line.name === name) ?? own.find((line) => line.name === "") ?? own[0] ?? null;
  }

  unitsOf(result) {
    const { followed, frequency } = result.content, { unit } = this.app.view;
    return followed.key === "omega" && unit in frequency.factors ? [frequency.factors[unit], unit] : [1, followed.units];
  }

  abscissa(result) {
    const [factor] = this.unitsOf(result);
    return factor === 1 ? result.at : result.at.map((value) => value * factor);
  }

  draw() {
    const { view, model } = this.app, log = view.log;
    this.lines = this.curve ? this.shown().map((line) => ({ ...line, x: this.abscissa(line.result), y: line.values })) : [];
    if (!this.lines.length) {
      fill(this.host, element("h2", { id: "response-title" }, "Response"), element("p", { class: "card" }, "No point was found, so there is no curve."));
      return;
    }
    const drawn = this.lines.flatMap((line) => [...this.banded(line, log), ...this.styled(line, log)]);
    const rings = this.rings(log);
    const first = (this.lines[0]?.result ?? model.results[0]), followed = first.content.followed;
    const label = followed.key === "omega" ? "Frequency" : followed.label;
    const range = (of, axis, zero) => rangeOf(this.lines.map((line) => line[of]), { log: log.includes(axis), air: of === "x" ? 0.015 : 0.06, zero });
    chart(this.plotHost, {
      x: { label, units: this.unitsOf(first)[1], log: log.includes("x"), range: range("x", "x", false) },
      y: { label: quantityOf(this.curve), units: this.curve.units, log: log.includes("y"), range: range("y", "y", this.curve.key === "amplitude" || this.curve.key === "mean") },
      lines: [...drawn, ...rings], height: Math.round(Math.min(460, Math.max(260, 0.5 * this.plotHost.clientWidth))), zoom: true,
      hooks: { draw: [() => this.place()] }, marks: zeroLine,
    });
    this.plotHost.uplot.over.append(this.rule, this.dot);
    this.drawTools();
    this.drawLegend();
    this.drawPeaks();
    this.move();
  }

  /** One line, and where stability was computed two more: a stretch is dashed where it is unstable, dotted where nobody knows. */
  styled(line, log) {
    const { part, content, points } = line.result;
    const broken = Uint8Array.from(part, (p, i) => (i > 0 && part[i - 1] === p ? 1 : 0));
    const base = { x: line.x, y: line.y, log, stroke: line.stroke, width: 2 };
    if (!content.unstable) return [{ ...base, pen: broken }];
    const verdict = Array.from({ length: points }, (_, i) => line.result.verdict(i));
    const of = (i) => [verdict[i], verdict[i - 1]].find((own) => own !== "stable") ?? "stable";
    const pen = (own) => broken.map((b, i) => (b && of(i) === own ? 1 : 0));
    return [{ ...base, pen: pen("stable") }, { ...base, pen: pen("unstable"), dash: [6, 5], width: 1.6 },
      { ...base, pen: pen("stability not known"), dash: [2, 4], width: 1.6 }];
  }

  /** Thin lines round an amplitude: what tolerances of parameters make of it. */
  banded(line, log) {
    if (this.curve.key !== "amplitude") return [];
    const { part } = line.result, pen = Uint8Array.from(part, (p, i) => (i > 0 && part[i - 1] === p ? 1 : 0));
    return line.result.band(line.name).map((y) => ({ x: line.x, y, log, stroke: line.stroke, width: 1, dash: [1, 3], pen }));
  }

  rings(log) {
    if (this.curve.key !== "amplitude") return [];
    return this.lines.map((line) => {
      const at = line.result.content.peaks.filter(([, dof]) => line.result.dofs[dof] === line.name).map(([point]) => point);
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
    const plot = this.plotHost.uplot, line = this.lines && this.current();
    if (!plot || !line) return;
    const [x, y] = [plot.valToPos(line.x[this.app.view.point], "x"), plot.valToPos(line.y[this.app.view.point], "y")];
    const inside = x >= -1 && x <= plot.over.clientWidth + 1 && y >= -1 && y <= plot.over.clientHeight + 1;
    this.rule.hidden = this.dot.hidden = !inside;
    if (!inside) return;
    this.rule.style.left = `${x}px`;
    this.dot.style.left = `${x}px`;
    this.dot.style.top = `${y}px`;
    this.dot.style.background = line.stroke;
  }

  words(line) {
    const { view } = this.app, { result } = line, verdict = result.verdict(view.point), kind = result.kind(view.point);
    const name = line.name || (this.curve.over === "contact" ? "all contacts" : "");
    const said = [
      `point ${view.point + 1} of ${result.points}`, this.app.where(),
      `${name ? `${name}: ` : ""}${quantityOf(this.curve).toLowerCase()} ${short(line.y[view.point])}${this.curve.after}`,
      kind && kind !== "regular" ? kind : "", verdict,
      this.app.model.results.length > 1 ? result.label : "",
    ];
    return said.filter(Boolean).join(" · ");
  }

  /** The drawn point nearest to a click becomes the cursor. */
  click(event) {
    const plot = this.plotHost.uplot;
    if (!plot || !event.target.closest(".u-over")) return;
    const box = plot.over.getBoundingClientRect(), [cx, cy] = [event.clientX - box.left, event.clientY - box.top];
    let best = null;
    for (const line of this.lines) {
      for (let i = 0; i < line.x.length; i++) {
        const distance = Math.hypot(plot.valToPos(line.x[i], "x") - cx, plot.valToPos(line.y[i], "y") - cy);
        if (!best || distance < best.distance) best = { distance, line, i };
      }
    }
    if (best) this.choose(best.line, best.i);
  }

  choose(line, point) {
    const change = { result: line.result.index, point };
    if (this.curve.over === "dof") change.dof = line.name;
    if (this.curve.over === "contact" && line.name) change.contact = line.name;
    this.app.set(change);
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
    const at = this.lines.indexOf(this.current());
    const next = this.lines[(at + by + this.lines.length) % this.lines.length];
    const here = this.lines[at].result, point = this.app.view.point;
    this.choose(next, next.result === here ? point : nearest(next.result.at, here.at[point]));
  }

  drawTools() {
    const { view, model } = this.app, app = this.app;
    const select = element("select", { id: "curve", onchange: (event) => app.set({ curve: event.target.value }) },
      ...model.curves.map((curve) => element("option", { value: curve.key, selected: curve.key === view.curve }, quantityOf(curve))));
    const log = (axis) => element("button", { type: "button", "aria-pressed": String(view.log.includes(axis)), onclick: () =>
      app.set({ log: ["x", "y"].filter((a) => (a === axis) !== view.log.includes(a)).join("") }) }, `log ${axis}`);
    fill(this.tools,
      element("h2", { id: "response-title" }, "Response"),
      element("label", { for: "curve", class: "hidden" }, "Quantity"), select,
      model.frequencies.length > 1 ? choice("Unit of frequency", Object.fromEntries(model.frequencies.map((u) => [u, u])), view.unit, (unit) => app.set({ unit })) : null,
      element("span", { class: "choice", role: "group", "aria-label": "Logarithmic axes" }, log("x"), log("y")),
      element("button", { type: "button", class: "plain", onclick: () => this.draw() }, "whole range"));
  }

  /** Buttons that show and hide curves of dofs or contacts; with several results each line is named below. */
  drawLegend() {
    const { model, view } = this.app, over = this.curve.over, key = over === "dof" ? "dofs" : "contacts";
    const known = over === "dof" ? model.dofs : over === "contact" ? [...(this.curve.total ? [""] : []), ...model.contacts] : [];
    const toggle = (name) => {
      const next = view[key].includes(name) ? view[key].filter((other) => other !== name) : [...view[key], name];
      this.app.set({ [key]: next.length ? next : [name], ...(over === "dof" && !view.dofs.includes(name) ? { dof: name } : {}) });
    };
    const several = model.results.length > 1;
    const chips = known.map((name) => element("button", { type: "button", class: "chip", "aria-pressed": String(view[key].includes(name)), onclick: () => toggle(name) },
      ...(several ? [] : this.lines.filter((line) => line.name === name).map(swatch)), name || "all contacts"));
    const labels = several ? this.lines.map((line) => element("span", { class: "line-name" }, swatch(line), `${line.result.label}${line.name ? ` · ${line.name}` : ""}`)) : [];
    const dashed = model.results.some((result) => result.content.unstable) ? [element("span", { class: "line-name" }, "solid: stable, dashed: unstable, dotted: not known")] : [];
    const less = this.app.leftOut(over);
    fill(this.legend,
      element("div", { class: "chips", role: "group", "aria-label": "Curves" }, ...chips, less ? element("span", { class: "soft" }, less) : null),
      element("div", { class: "line-names" }, ...labels, ...dashed, ...this.bandNames()));
  }

  /** What the thin lines are of. */
  bandNames() {
    if (this.curve.key !== "amplitude") return [];
    const said = new Set(this.app.model.results.map((result) => result.content.bands?.said).filter(Boolean));
    return [...said].map((text) => element("span", { class: "line-name" }, `dotted: ${text}`));
  }

  drawPeaks() {
    const { model } = this.app, found = [];
    for (const result of model.results) {
      for (const [point, dof] of result.content.peaks) found.push({ result, point, name: result.dofs[dof], size: result.values("amplitude", result.dofs[dof])[point] });
    }
    found.sort((a, b) => b.size - a.size);
    this.peaks = found.slice(0, 40);
    const [, units] = this.unitsOf(this.lines[0]?.result ?? model.results[0]);
    const rows = this.peaks.map((peak) => peakRow(peak, this, model.results.length > 1));
    const head = element("tr", {}, ...[...(model.results.length > 1 ? ["result"] : []), "dof", withUnits("at", units), withUnits("amplitude", model.results[0].content.dofs.units)].map((text) => element("th", { scope: "col" }, text)));
    fill(this.side, element("h3", {}, "Peaks"),
      rows.length ? element("table", { class: "list" }, element("thead", {}, head), element("tbody", {}, ...rows))
        : element("p", { class: "soft" }, "No peak was located on these curves."));
  }
}

function swatch(line) {
  return element("svg:svg", { width: 18, height: 8, "aria-hidden": "true" },
    element("svg:line", { x1: 1, x2: 17, y1: 4, y2: 4, stroke: line.stroke, "stroke-width": 2.5, "stroke-linecap": "round" }));
}

function peakRow(peak, curves, several) {
  const [factor] = curves.unitsOf(peak.result);
  const go = () => curves.app.set({ curve: "amplitude", result: peak.result.index, point: peak.point, dof: peak.name,
    dofs: curves.app.view.dofs.includes(peak.name) ? curves.app.view.dofs : [...curves.app.view.dofs, peak.name] });
  const verdict = peak.result.verdict(peak.point), stable = verdict && verdict !== "stable" ? ` (${verdict})` : "";
  return element("tr", {}, several ? element("td", { class: "soft" }, peak.result.label) : null,
    element("td", {}, element("button", { type: "button", class: "plain", onclick: go }, peak.name)),
    element("td", {}, short(peak.result.at[peak.point] * factor)), element("td", {}, `${short(peak.size)}${stable}`));
}
