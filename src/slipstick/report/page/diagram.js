// Frequencies without contacts and engine orders: the Campbell diagram of a rotor, the interference diagram of a disc.

class Diagram {
  constructor(host, app) {
    Object.assign(this, { host, app });
    this.title = element("h2", { id: "diagram-title" });
    this.plot = element("div", { class: "plot" });
    this.note = element("div", { class: "note" });
    host.append(element("div", { class: "panel-head" }, this.title), element("div", { class: "card" }, this.plot, this.note));
  }

  draw() {
    const { app } = this, { diagram } = app.result.content;
    this.host.hidden = !diagram;
    if (!diagram) return;
    this.title.textContent = diagram.title;
    const [factor, units] = app.unitsOf(app.result.frequencyAxis), across = diagram.x.frequency ? factor : 1;
    const lines = diagramLines(diagram, across, factor), x = { label: diagram.x.label, units: diagram.x.frequency ? units : "" };
    const ranges = (axis) => rangeOf(lines.map((line) => line[axis]), { air: 0.05, zero: axis === "y" || diagram.x.frequency });
    chart(this.plot, { x: { ...x, range: ranges("x") }, y: { label: diagram.y, units, range: ranges("y") }, lines, height: 340, name: diagram.title });
    const rows = diagram.met.map(({ x: at, y, said }) => element("li", {}, `${said}: ${short(y * factor)} ${units}${diagram.x.frequency ? ` at a speed of ${short(at * across)} ${units}` : ""}`));
    fill(this.note, named(lines.filter(({ dash }) => !dash)), element("p", {}, `Without contacts; dashed: ${diagram.dashed}. `, diagram.met.length ? `Rings, where frequencies are met (${diagram.met.length}):` : "No frequency is met in this range."), rows.length ? element("ul", { class: "met", tabindex: "0" }, ...rows) : null);
  }
}

/** Modes, engine orders dashed, and rings where they meet. */
function diagramLines(diagram, across, up) {
  const lines = diagram.lines.map(({ name, x, y, colour: own }) => ({ name, x: x.map((v) => v * across), y: y.map((v) => v * up),
    ...(own < 0 ? { stroke: colour("text-faint"), dash: [6, 4], width: 1.8 } : { stroke: curveColour(own) }) }));
  const rings = { kind: "rings", name: "", x: diagram.met.map(({ x }) => x * across), y: diagram.met.map(({ y }) => y * up), stroke: colour("text"), fill: "transparent", width: 1.6 };
  return [...lines, rings];
}
