// The point under the cursor: hysteresis loop, states, spectrum, time history.

const TICKS = [[0, Math.PI / 2, Math.PI, 1.5 * Math.PI, PERIOD], ["0", "π/2", "π", "3π/2", "2π"]];
const STATE_DASHES = { "stick": undefined, "slip+": undefined, "slip-": [7, 3], "separation": [2, 3] };

class Panels {
  constructor(host, app) {
    Object.assign(this, { host, app });
    const panel = (key, title) => {
      const tools = element("div", { class: "tools" }), plot = element("div", { class: "plot" }), note = element("div", { class: "note" });
      const card = element("section", { class: "card panel", id: key, "aria-labelledby": `${key}-title` },
        element("div", { class: "panel-head" }, element("h3", { id: `${key}-title` }, title), tools), plot, note);
      this[key] = { card, tools, plot, note };
      return card;
    };
    this.title = element("h2", {});
    this.pick = element("div", { class: "tools" });
    host.append(element("div", { class: "panel-head" }, this.title, this.pick),
      element("div", { class: "panels" }, panel("loop", "Friction loop"), panel("plane", "Motion in the plane"), panel("states", "Stick, slip, separation"),
        panel("history", "One period"), panel("spectrum", "Harmonics"), panel("worn", "Worn depth")));
  }

  draw() {
    const { app } = this, { view, result } = app;
    this.host.hidden = !result.points;
    if (this.host.hidden) return;
    this.title.textContent = `${app.model.results.length > 1 ? `${result.label}, at` : "At"} ${app.where()}`;
    this.drawPick(result);
    const law = view.contact ? result.element(view.point, view.contact) : null;
    const plane = law || !view.contact ? null : result.plane(view.point, view.contact);
    const ported = law || !view.contact ? null : result.ported(view.point, view.contact);
    const orbit = view.contact ? result.orbit(view.point, view.contact) : null;
    this.loop.card.hidden = !(law || plane || orbit || ported);
    this.plane.card.hidden = !plane;
    this.states.card.hidden = !result.friction && !result.planar && !result.orbits;
    this.worn.card.hidden = !result.curve("worn_depth") || result.content.analysis !== "wear" || result.contacts.length < 2; // one contact has its curve; before any chart is drawn: it is as wide as its card
    this.arrange();
    if (plane) this.drawPlane(plane);
    else if (orbit) this.drawOrbit(orbit);
    else if (law || ported) this.drawLoop(law, ported);
    if (!this.states.card.hidden) this.drawStates(result);
    this.drawHistory(law, ported, plane);
    this.drawSpectrum(law, ported);
    this.drawWorn();
  }

  /** Of an odd number of cards the last three stand in one row, so that none is as wide as the page. */
  arrange() {
    const shown = ["loop", "plane", "states", "history", "spectrum", "worn"].map((key) => this[key].card).filter((card) => !card.hidden);
    const odd = shown.length > 1 && shown.length % 2 === 1;
    shown[0].parentNode.toggleAttribute("data-odd", odd);
    shown.forEach((card, i) => card.toggleAttribute("data-last", i >= shown.length - 3));
  }

  drawPick(result) {
    const { app } = this, { view } = app;
    const select = (id, label, names, chosen, change) => (names.length ? [element("label", { for: id }, label), element("select", { id, onchange: (event) => app.set(change(event.target.value)) },
      ...names.map((name) => element("option", { value: name, selected: name === chosen }, name)))] : []);
    fill(this.pick, ...select("at-contact", "contact", result.contacts, view.contact, (contact) => ({ contact })),
      ...select("at-dof", "dof", result.dofs, view.dof, (dof) => ({ dof })));
  }

  /** Lines whose coordinates are lengths of the results, in the unit lengths are shown in: what forces are made from stays as it is. */
  inLengths(lines, ...axes) {
    const { factor } = this.app.result.content.dofs;
    return factor === 1 ? lines : lines.map((line) => ({ ...line, ...Object.fromEntries(axes.map((axis) => [axis, Array.from(line[axis], (value) => value * factor)])) }));
  }

  units(kind) {
    const { content } = this.app.result;
    return kind === "force" ? content.contacts.force_units : kind === "length" ? content.dofs.units : this.app.result.unitOf(this.app.view.dof);
  }

  drawLoop(law, ported) {
    const { app } = this, { view } = app, over = view.loop;
    document.getElementById("loop-title").textContent = law ? "Friction loop" : "Force over motion";
    fill(this.loop.tools, !law ? null : choice("Motion of the loop", { total: "over x + u", motion: "over x" }, over, (loop) => app.set({ loop })));
    const own = colourOf(app.model, "contact", view.contact, app.result), lines = this.inLengths(law ? loopLines(law, over) : portedLoop(ported, app.result.orders, own), "x");
    const label = over === "total" ? "Sliding motion x + u" : "Vibration x";
    const ranges = (axis) => rangeOf(lines.map((line) => line[axis]), { air: 0.07 });
    chart(this.loop.plot, { x: { label: law ? label : `Motion along ${ported.port}`, units: this.units("length"), range: ranges("x") }, y: { label: law ? "Friction force" : `Force along ${ported.port}`, units: this.units("force"), range: ranges("y") },
      lines, height: 300, name: `loop of ${view.contact} at ${app.where()}`, marks: zeroLine });
    this.loop.note.textContent = this.inWords(law ? `μ ${short(law.mu)}` : "its law is not stored: force and motion as the harmonics kept");
  }

  /** The contact at the cursor: its power, what it dissipates a period, and what else there is to say. */
  inWords(more) {
    const { view, result } = this.app, power = result.values("dissipated_power", view.contact), curve = result.curve("dissipated_power");
    const energy = power ? (power[view.point] * PERIOD) / result.omegaAt(view.point) : NaN;
    const says = [`${view.contact}`, power ? `power ${short(power[view.point])}${curve.after}` : "", power ? `energy a period ${short(energy)}${result.content.contacts.energy_units}` : "", more];
    return says.filter(Boolean).join(" · ");
  }

  /** The friction force in the plane within the circle of its limit, and beside it the vibration. */
  drawPlane(plane) {
    const { app } = this, tau = times(0, PERIOD, 361);
    const [low, high] = plane.limit, radii = high - low <= 1e-9 * high ? [high] : [low, high];
    const circles = radii.map((r) => ({ x: tau.map((t) => r * Math.cos(t)), y: tau.map((t) => r * Math.sin(t)), stroke: colour("text-faint"), dash: [6, 4], width: 1.2, name: "friction limit μ N" }));
    fill(this.loop.tools);
    document.getElementById("loop-title").textContent = "Friction force in the plane";
    this.drawPath(this.loop.plot, "Friction force", "force", [...circles, ...pathLines(plane, (t) => plane.force.map((values) => between(values, t)))]);
    this.drawPath(this.plane.plot, "Vibration", "length", pathLines(plane, (t) => plane.motion.map((X) => series(X, plane.orders, t))));
    this.loop.note.textContent = this.inWords(`μ ${short(plane.mu)} · dashed: limit μ N ${radii.map((r) => short(r)).join(" to ")} · dot: ωt = 0`);
    this.plane.note.textContent = "colours: stick, slip, separation as beside · dot: ωt = 0";
  }

  /** The centre of a rotor within the circle of its clearance, and how long it touches. */
  drawOrbit(orbit) {
    const { dofs } = this.app.result.content, tau = times(0, PERIOD, 361), touching = orbit.states.reduce((sum, [a, b, state]) => sum + (state === "separation" ? 0 : (b - a) / PERIOD), 0);
    const circle = { x: tau.map((t) => orbit.gap * Math.cos(t)), y: tau.map((t) => orbit.gap * Math.sin(t)), stroke: colour("text-faint"), dash: [6, 4], width: 1.2, name: "clearance" };
    fill(this.loop.tools);
    document.getElementById("loop-title").textContent = "Orbit in the clearance";
    this.drawPath(this.loop.plot, "Motion", "length", [circle, ...pathLines(orbit, (t) => orbit.motion.map((X) => series(X, orbit.orders, t)))], ["along x", "along y"]);
    this.loop.note.textContent = this.inWords(`in contact ${touching > 0 && touching < 0.005 ? "< 1" : short(100 * touching, 3)} % of the time · μ ${short(orbit.mu)} · dashed: clearance ${short(orbit.gap * dofs.factor)}${dofs.after} · orange: in contact, grey: free · dot: ωt = 0`);
  }

  /** Lines in a plane, the same scale along both axes. */
  drawPath(host, what, kind, path, ways = ["first direction", "second direction"]) {
    const lines = kind === "length" ? this.inLengths(path, "x", "y") : path, height = 340, ranges = sameScale(lines, Math.max(host.clientWidth, 220) - 60, height - 60), units = this.units(kind);
    const like = [-1, 1].map((sign) => sign * Math.max(...ranges.flat().map(Math.abs))); // one power of ten for both axes
    const axis = (which, range) => ({ label: `${what}, ${which}`, units, range, like });
    chart(host, { x: axis(ways[0], ranges[0]), y: axis(ways[1], ranges[1]), lines, height, name: `${what.toLowerCase()} of ${this.app.view.contact} at ${this.app.where()}`, marks: zeroLine });
  }

  drawStates(result) {
    const { app } = this, { view } = app;
    const rows = result.contacts.map((name) => [name, result.stated(view.point, name)]);
    strip(this.states.plot, view.all ? rows : rows.slice(0, MOST_ROWS), view.contact, (contact) => app.set({ contact }));
    const drawing = () => svgOfDrawing(this.states.plot.querySelector("svg"));
    const table = () => [["contact", "from [rad]", "to [rad]", "state"], ...rows.flatMap(([name, own]) => (own ? pieces(own).map(([a, b, state]) => [name, a, b, state]) : []))];
    saver(this.states.plot, () => `states at ${app.where()}`, { PNG: () => pngOfDrawing(drawing()), SVG: drawing, CSV: () => csvOf(table()) });
    const stated = view.contact ? result.stated(view.point, view.contact) : null;
    const law = stated ? result.element(view.point, view.contact) : null;
    fill(this.states.note, stateKey(result), statesInWords(view.contact, stated),
      stated ? factsOf(stated, law, law ? null : result.plane(view.point, view.contact), result.content.contacts.force_after) : null);
  }

  drawHistory(law, ported, plane) {
    const { app } = this, { view, result } = app, kinds = { dof: "motion" };
    if (law || ported) kinds.force = law ? "friction force" : "force";
    if (law) kinds.normal = "normal load";
    const kind = kinds[view.history] ? view.history : "dof";
    fill(this.history.tools, chosenAmong("Quantity over one period", kinds, kind, (history) => app.set({ history })));
    const tau = times(0, PERIOD, 721), own = colourOf(app.model, "contact", view.contact, result);
    const lines = kind === "dof" ? this.motions(tau) : plane ? forcesInPlane(plane, own) : forcesInTime(law, ported, kind, result.orders, own);
    chart(this.history.plot, { x: { label: "Phase ωt [rad]", units: "", range: [0, PERIOD], ticks: TICKS },
      y: { label: kind === "dof" ? "Motion" : kinds[kind].replace(/^./, (c) => c.toUpperCase()), units: this.units(kind === "dof" ? "dof" : "force"), range: rangeOf(lines.map((line) => line.y), { air: 0.07 }) },
      lines, height: 300, name: `${kinds[kind]} at ${app.where()}`, marks: zeroLine });
    fill(this.history.note, named(lines));
  }

  /** Motions of the dofs shown. */
  motions(tau) {
    const { view, result, model } = this.app;
    return shownDofs(view, result).map((name) => {
      const X = result.displacement(view.point, name);
      return { x: tau, y: tau.map((t) => series(X, result.orders, t)), stroke: colourOf(model, "dof", name, result), name };
    });
  }

  drawSpectrum(law, ported) {
    const { app } = this, { view, result } = app, kinds = { dof: "motion" };
    if (law || ported) kinds.force = law ? "friction force" : "force";
    const kind = kinds[view.spectrum] ? view.spectrum : "dof";
    fill(this.spectrum.tools, chosenAmong("Quantity of the harmonics", kinds, kind, (spectrum) => app.set({ spectrum })));
    const groups = kind === "dof" ? this.harmonicsOfDofs() : [{ name: view.contact, sizes: law ? amplitudes((t) => frictionAt(law, t), result.orders) : sizesOf(ported.F), stroke: colourOf(app.model, "contact", view.contact, result) }];
    const orders = result.orders, half = barHalf(orders.length) / Math.max(1, groups.length);
    const lines = groups.map((group, i) => ({ kind: "bars", log: true, x: orders.map((_, j) => j + (2 * i + 1 - groups.length) * half), y: group.sizes.map(Math.abs), half, fill: group.stroke, stroke: group.stroke, width: 0, name: group.name }));
    const most = Math.max(...lines.flatMap((line) => line.y), 0), every = Math.ceil(orders.length / 24);
    const range = most > 0 ? [most * 1e-6, most * 2] : [1e-6, 1];
    lines.forEach((line) => { line.y = line.y.map((v) => (v > range[0] ? v : NaN)); });
    chart(this.spectrum.plot, { x: { label: "Harmonic", units: "", range: [-0.6, orders.length - 0.4], ticks: [orders.map((_, j) => j).filter((j) => j % every === 0), orders.filter((_, j) => j % every === 0).map(String)] },
      y: { label: kind === "dof" ? "Amplitude" : law ? "Friction force" : `Force along ${ported.port}`, units: this.units(kind), log: true, range }, lines, height: 300, name: `harmonics of ${kinds[kind]} at ${app.where()}` });
    fill(this.spectrum.note, named(lines));
  }

  /** Worn depth of every contact at the cursor, a bar each, on the scale of all cycles; the contact looked at stands out. */
  drawWorn() {
    const { app } = this, { view, result } = app, curve = result.curve("worn_depth");
    if (this.worn.card.hidden) return;
    const names = result.contacts, all = names.map((name) => result.values("worn_depth", name)), depths = all.map((values) => values[view.point]);
    const bars = (some, fill, name) => ({ kind: "bars", x: some, y: some.map((i) => depths[i]), half: barHalf(names.length), fill, stroke: fill, width: 0, name });
    const at = names.indexOf(view.contact), places = names.map((_, i) => i), every = Math.ceil(names.length / 16);
    const lines = [bars(places.filter((i) => i !== at), colour("text-faint"), ""), ...(at < 0 ? [] : [bars([at], colourOf(app.model, "contact", view.contact, result), view.contact)])];
    const ticks = places.filter((i) => i % every === 0);
    chart(this.worn.plot, { x: { label: "Contact", units: "", range: [-0.6, names.length - 0.4], ticks: [ticks, ticks.map((i) => names[i])] },
      y: { label: "Worn depth", units: curve.units, range: rangeOf(all, { zero: true }) }, lines, height: 300, name: `worn depth at ${app.where()}` });
    const load = result.values("normal_load", view.contact), less = app.leftOut("contact");
    this.worn.note.textContent = [at < 0 ? "" : `${view.contact} · worn depth ${short(depths[at])}${curve.after}`, at >= 0 && load ? `normal load ${short(load[view.point])}${result.curve("normal_load").after}` : "", less].filter(Boolean).join(" · ");
  }

  harmonicsOfDofs() {
    const { view, result, model } = this.app;
    return shownDofs(view, result).map((name) => ({ name, sizes: sizesOf(result.displacement(view.point, name)), stroke: colourOf(model, "dof", name, result) }));
  }
}

/** Dofs shown in the panels: the one at the cursor, then the others that are drawn above. */
function shownDofs(view, result) {
  return [...new Set([view.dof, ...view.dofs])].filter((name) => result.points && result.dofs.includes(name));
}

/** Half the width of a bar among so many places one apart: few bars are no blocks. */
const barHalf = (count) => Math.min(0.38, 0.06 * count);

/** Smallest and largest forces of a contact over the period, and its shares of the period, as pairs of words. */
function factsOf(stated, law, plane, units) {
  const tau = times(0, PERIOD, 361), shares = {};
  for (const [a, b, state] of stated.states) shares[state] = (shares[state] ?? 0) + (b - a) / PERIOD;
  const span = (values) => `${[...new Set([Math.min(...values), Math.max(...values)].map((value) => short(value, 4)))].join(" to ")}${units}`;
  const said = Object.entries(shares).map(([state, part]) => [STATE_WORDS[state], `${short(100 * part, 3)} %`]);
  if (law) said.push(["normal load", span(tau.map((t) => law.kn * Math.max(series(law.Y, law.orders, t) - law.gap, 0)))], ["friction force", span(tau.map((t) => frictionAt(law, t)))]);
  if (plane) said.push(["friction force", span(Array.from(plane.force[0], (f, i) => Math.hypot(f, plane.force[1][i])))]);
  return element("div", { class: "facts-of" }, ...said.map(([name, text]) => element("div", {}, element("span", { class: "soft" }, name), text)));
}

function sizesOf(X) {
  return Array.from({ length: (X.length + 1) / 2 }, (_, j) => (j === 0 ? X[0] : Math.hypot(X[2 * j - 1], X[2 * j])));
}

/** Pieces of the exact loop, one line for each state, and the friction limit. */
function loopLines(law, over) {
  const W = over === "total" ? law.W : law.X, v = over === "total" ? law.v : 0;
  const lines = {};
  for (const [a, b, state, k] of pieces(law)) {
    const line = (lines[state] ??= { x: [], y: [], stroke: colour(STATES[state][0]), dash: STATE_DASHES[state], width: 2.4, name: STATE_WORDS[state], arrows: true });
    for (const tau of times(a, b, Math.max(2, Math.ceil((b - a) * 120)))) {
      line.x.push(series(W, law.orders, tau) + v * tau);
      line.y.push(frictionIn(law, k, tau));
    }
    line.x.push(NaN);
    line.y.push(NaN);
  }
  const tau = times(0, PERIOD, 361), x = tau.map((t) => series(W, law.orders, t) + v * t);
  const limit = (sign) => ({ x, y: tau.map((t) => sign * limitAt(law, t)), stroke: colour("text-faint"), dash: [2, 3], width: 1, name: "" });
  return [limit(1), limit(-1), ...Object.values(lines)];
}

/** A closed path, a line for each state, and a dot where it begins; `place` gives both coordinates at a time. */
function pathLines(stated, place) {
  const lines = {};
  for (const [a, b, state] of pieces(stated)) {
    const stroke = colour(state === "separation" ? "text-faint" : STATES[state][0]);
    const line = (lines[state] ??= { x: [], y: [], stroke, width: 2.4, name: STATE_WORDS[state], arrows: true });
    for (const tau of times(a, b, Math.max(2, Math.ceil((b - a) * 120)))) {
      const [x, y] = place(tau);
      line.x.push(x);
      line.y.push(y);
    }
    line.x.push(NaN);
    line.y.push(NaN);
  }
  const [x, y] = place(0), dot = colour("text");
  return [...Object.values(lines), { kind: "rings", x: [x], y: [y], stroke: dot, fill: dot, width: 1, name: "" }];
}

/** A value at a time between samples that lie evenly over the period, both ends among them. */
function between(values, tau) {
  const at = (tau / PERIOD) * (values.length - 1), i = Math.min(values.length - 2, Math.max(0, Math.floor(at)));
  return values[i] + (at - i) * (values[i + 1] - values[i]);
}

function portedLoop(ported, orders, stroke) {
  const tau = times(0, PERIOD, 721);
  return [{ x: tau.map((t) => series(ported.X, orders, t)), y: tau.map((t) => series(ported.F, orders, t)), stroke, width: 2.2, name: ported.port, arrows: true }];
}

function forcesInTime(law, ported, kind, orders, stroke) {
  const tau = times(0, PERIOD, 721);
  if (!law) return [{ x: tau, y: tau.map((t) => series(ported.F, orders, t)), stroke, name: `force along ${ported.port}` }];
  if (kind === "normal") return [{ x: tau, y: tau.map((t) => law.kn * Math.max(series(law.Y, law.orders, t) - law.gap, 0)), stroke, name: "normal load" }];
  const limit = (sign) => ({ x: tau, y: tau.map((t) => sign * limitAt(law, t)), stroke: colour("text-faint"), dash: [2, 3], width: 1, name: sign > 0 ? "friction limit ± μ N" : "" });
  return [{ x: tau, y: tau.map((t) => frictionAt(law, t)), stroke, width: 2, name: "friction force" }, limit(1), limit(-1)];
}

/** Both friction forces of a plane over the period. */
function forcesInPlane({ force }, stroke) {
  const tau = times(0, PERIOD, force[0].length);
  return force.map((y, i) => ({ x: tau, y, stroke, dash: i ? [7, 3] : undefined, width: 2, name: i ? "second direction, dashed" : "first direction" }));
}

/** Ranges of x and y that show all lines, one unit as long along both axes of a plot of so many pixels. */
function sameScale(lines, width, height) {
  const [x, y] = ["x", "y"].map((axis) => rangeOf(lines.map((line) => line[axis]), { air: 0.07 }));
  const unit = Math.max((x[1] - x[0]) / width, (y[1] - y[0]) / height);
  return [[x, width], [y, height]].map(([[low, high], length]) => [0.5 * (low + high - unit * length), 0.5 * (low + high + unit * length)]);
}

/** A choice where there is more than one option. */
const chosenAmong = (label, options, ...given) => (Object.keys(options).length > 1 ? choice(label, options, ...given) : null);

/** Names of the lines beside their colours. */
function named(lines) {
  return element("div", { class: "line-names" }, ...lines.filter((line) => line.name).map((line) => element("span", { class: "line-name" }, swatch(line), line.name)));
}
