// The contacts between two surfaces at the point under the cursor: a flat map, points coloured, their areas as sizes.

const MAP = { width: 900, tallest: 420, edge: 26, largest: 15, bolt: 20 };
const OVER_PERIOD = [["text-faint", "no state"], ["stick", "sticks"], ["slip-plus", "slips"], ["slip-minus", "opens"], ["card", "open"]];

class Interface {
  constructor(host, app) {
    Object.assign(this, { host, app, key: null, at: 0 });
    if (!app.model.results.some((result) => result.content.interfaces.length)) {
      host.hidden = true;
      return;
    }
    this.map = element("svg:svg", { class: "map", role: "img" });
    this.pick = element("span", {});
    this.note = element("div", { class: "note" });
    host.append(element("div", { class: "panel-head" }, element("h2", { id: "interface-title" }, "Interface"), element("div", { class: "tools" }, this.pick)),
      element("div", { class: "card plot" }, this.map, this.note));
    const drawing = () => svgOfDrawing(this.map);
    saver(host.lastChild, () => `interface at ${app.where()}`, { PNG: () => pngOfDrawing(drawing()), SVG: drawing, CSV: () => csvOf(this.rows()) });
  }

  get joint() {
    const { interfaces } = this.app.result.content;
    return interfaces[Math.min(this.at, interfaces.length - 1)];
  }

  /** At another point: places stay, colours change. */
  draw() {
    if (!this.map) return;
    const { result, view } = this.app, { interfaces } = result.content;
    this.host.hidden = !interfaces.length || !result.points;
    if (this.host.hidden) return;
    const { joint } = this, shown = joint.of.find((own) => own.key === this.key) ?? joint.of[0];
    const labels = (list, name) => Object.fromEntries(list.map((own, k) => [own.key ?? k, name(own)]));
    fill(this.pick, interfaces.length > 1 ? choice("Pair of surfaces", labels(interfaces, (own) => own.name), String(this.at), (at) => { this.at = Number(at); this.draw(); }) : null,
      choice("Colour of the contacts", labels(joint.of, (own) => own.label), shown.key, (key) => { this.key = key; this.draw(); }));
    this.values = Object.fromEntries(joint.of.map((own) => [own.key, result.onInterface(this.joint, own, view.point)]));
    this.places = result.placesOf(joint);
    const { x, y, area } = this.places, ends = [x, y].map((values) => [Math.min(...values), Math.max(...values)]), spans = ends.map(([a, b]) => b - a);
    const room = MAP.width - 2 * MAP.edge, scale = Math.min(room / (spans[0] || 1), (MAP.tallest - 2 * MAP.edge) / (spans[1] || 1e-9 * (spans[0] || 1)));
    const height = Math.max(spans[1] * scale, 1) + 2 * MAP.edge, left = 0.5 * (MAP.width - scale * spans[0]);
    const most = Math.max(...area), closest = Math.sqrt((room * Math.max(height - 2 * MAP.edge, MAP.edge)) / x.length);
    const radius = (k) => Math.max(1.5, Math.min(MAP.largest, 0.45 * closest) * Math.sqrt(area[k] / most));
    this.map.setAttribute("viewBox", `0 0 ${MAP.width} ${height.toFixed(1)}`);
    this.map.setAttribute("aria-label", `Contacts of ${joint.name} seen along ${"xyz".split("").find((axis) => !joint.axes.includes(axis))}, coloured by ${shown.label} at ${this.app.where()}`);
    const across = (at) => (left + scale * (at - ends[0][0])).toFixed(1), up = (at) => (height - MAP.edge - scale * (at - ends[1][0])).toFixed(1);
    const choose = (name) => () => { if (result.contacts.includes(name)) this.app.set({ contact: name }); };
    fill(this.map, ...Array.from(x, (_, k) => element("svg:circle", { cx: across(x[k]), cy: up(y[k]), r: radius(k).toFixed(1),
      class: joint.names[k] === view.contact ? "spot chosen" : "spot", fill: this.fillOf(shown, k), "data-contact": joint.names[k],
      onclick: choose(joint.names[k]) }, element("svg:title", {}, this.said(k)))),
    ...joint.bolts.map((bolt) => element("svg:circle", { cx: across(bolt.x), cy: up(bolt.y), r: MAP.bolt, class: bolt.name === view.contact ? "bolt chosen" : "bolt",
      "data-contact": bolt.name, onclick: choose(bolt.name) }, element("svg:title", {}, bolt.name))));
    const reach = (axis, [a, b]) => `${joint.axes[axis]} ${short(a, 4)} to ${short(b, 4)}${joint.after}`;
    fill(this.note, element("div", { class: "line-names" }, ...this.legend(shown),
      element("span", {}, `${reach(0, ends[0])}, to the right; ${reach(1, ends[1])}, up; ${short(area.reduce((sum, one) => sum + one, 0), 4)}${joint.area_after} in all, sizes by area`),
      ...(joint.bolts.length ? [element("span", {}, "rings are bolts")] : []), ...(joint.less ? [element("span", {}, joint.less)] : [])));
  }

  fillOf(shown, k) {
    const value = this.values[shown.key][k];
    if (shown.key === "state") return colour(OVER_PERIOD[value][0]);
    return `rgb(${rampAt(shown.most > 0 ? value / shown.most : 0).map(Math.round)})`;
  }

  legend(shown) {
    this.ramp ??= rampOf();
    if (shown.key !== "state") return [element("span", { class: "line-name" }, `${shown.label} 0`, this.ramp, `${short(shown.most, 4)}${shown.after}`)];
    return OVER_PERIOD.flatMap(([name, words], number) => (this.values.state.includes(number) ? [element("span", { class: "line-name" },
      element("svg:svg", { width: 14, height: 14, "aria-hidden": "true" }, element("svg:circle", { cx: 7, cy: 7, r: 6, class: "spot", fill: colour(name) })),
      `${words} (${this.values.state.filter((state) => state === number).length})`)] : []));
  }

  /** One contact in words. */
  said(k) {
    return [this.joint.names[k], ...this.joint.of.map((own) => (own.key === "state" ? OVER_PERIOD[this.values.state[k]][1] : `${own.label} ${short(this.values[own.key][k], 4)}${own.after}`))].join(", ");
  }

  rows() {
    const { joint, places } = this;
    return [["contact", ...joint.axes, "area", ...joint.of.map((own) => withUnits(own.label, own.after.trim()))],
      ...joint.names.map((name, k) => [name, places.x[k], places.y[k], places.area[k], ...joint.of.map((own) => this.values[own.key][k])])];
  }
}
