// A disc from the front at the point under the cursor: a blade for every sector, coloured by its amplitude, as long as its motion at an instant.

const FRONT = { size: 440, hub: 62, rest: 158, swing: 34, names: 208 };

class Disc {
  constructor(host, app) {
    Object.assign(this, { host, app, tau: 0, visible: true, playing: false });
    if (!app.model.results.some((result) => result.content.disc)) {
      host.hidden = true;
      return;
    }
    const { size } = FRONT;
    this.front = element("svg:svg", { class: "front", viewBox: `${-size / 2} ${-size / 2} ${size} ${size}`, tabindex: 0, role: "img", onkeydown: (event) => this.key(event) });
    this.play = element("button", { type: "button", onclick: () => this.run(!this.playing) });
    this.phase = element("input", { type: "range", min: 0, max: 360, value: 0, "aria-label": "Phase of the disc, degrees", oninput: () => {
      this.run(false);
      this.tau = (this.phase.value * PERIOD) / 360;
      this.paint();
    } });
    this.pick = element("span", {});
    this.note = element("div", { class: "note", "aria-live": "polite" });
    host.append(element("div", { class: "panel-head" }, element("h2", { id: "disc-title" }, "Disc"),
      element("div", { class: "tools" }, this.pick, this.play, element("label", {}, "phase ", this.phase))),
      element("div", { class: "card plot" }, this.front, this.note));
    const drawing = () => svgOfDrawing(this.front);
    saver(host.lastChild, () => `disc at ${app.where()}`, { PNG: () => pngOfDrawing(drawing()), SVG: drawing, CSV: () => csvOf(this.rows()) });
    new IntersectionObserver(([entry]) => { this.visible = entry.isIntersecting; }).observe(this.front);
    this.run(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  run(playing) {
    animate(this, playing, () => this.blades);
  }

  /** The dof that is shown: as chosen, else that of the dof at the cursor. */
  get dof() {
    const { view, result } = this.app, { dofs } = result.content.disc;
    return [view.disc, view.dof.replace(/@\d+$/, "")].find((name) => dofs.includes(name)) ?? dofs[0];
  }

  key(event) {
    const { sectors } = this.app.result.content.disc, step = { ArrowLeft: 1, ArrowUp: 1, ArrowRight: -1, ArrowDown: -1 }[event.key];
    if (event.key === " ") this.run(!this.playing);
    else if (step) this.choose((this.blade + step + sectors) % sectors);
    else if (event.key === "Home") this.choose(largestBlade(this.blades));
    else return;
    event.preventDefault();
  }

  /** Another blade; the other panels follow where the page has its motion. */
  choose(blade) {
    const name = `${this.dof}@${blade}`, { result } = this.app;
    this.app.set({ blade, disc: this.dof, ...(result.dofs.includes(name) ? { dof: name } : {}) });
  }

  /** At another point: amplitudes, colours and one blade in words. */
  draw() {
    if (!this.front) return;
    const { result, view } = this.app, { disc } = result.content;
    this.host.hidden = !disc || !result.points;
    this.blades = this.host.hidden ? null : result.onDisc(view.point, this.dof);
    if (!this.blades) return;
    this.largest = Math.max(...this.blades.map(({ amplitude }) => amplitude || 0), 0);
    this.blade = view.blade !== null && view.blade < disc.sectors ? view.blade : largestBlade(this.blades);
    fill(this.pick, disc.dofs.length > 1 ? choice("Motion of the disc", Object.fromEntries(disc.dofs.map((name) => [name, name])), this.dof, (name) => this.app.set({ disc: name })) : null);
    this.wedges = this.blades.map(({ amplitude }, s) => element("svg:path", { class: s === this.blade ? "blade chosen" : "blade", "data-blade": s,
      fill: `rgb(${rampAt(this.largest > 0 ? amplitude / this.largest : 0).map(Math.round)})`, onclick: () => this.choose(s) },
    element("svg:title", {}, this.said(s))));
    const every = Math.max(1, Math.ceil(disc.sectors / 30)), names = this.blades.map((_, s) => s).filter((s) => s % every === 0);
    fill(this.front, element("svg:circle", { r: FRONT.hub, class: "hub" }), ...this.wedges.filter((_, s) => s !== this.blade), this.wedges[this.blade],
      element("svg:circle", { r: FRONT.rest, class: "at-rest" }),
      ...names.map((s) => {
        const [x, y] = onCircle(FRONT.names, (PERIOD * s) / disc.sectors);
        return element("svg:text", { x, y: y + 4, class: "blade-name" }, String(s));
      }));
    this.ramp ??= rampOf();
    this.front.setAttribute("aria-label", `Blades 0 to ${disc.sectors - 1} from the front, coloured by the amplitude of ${this.dof} at ${this.app.where()}; ${this.said(this.blade)}; left and right arrow: another blade`);
    const { after } = result.content.dofs;
    fill(this.note, element("div", { class: "line-names" }, element("span", {}, this.said(this.blade)),
      element("span", { class: "line-name" }, "0", this.ramp, `${short(this.largest, 4)}${after ?? ""}`),
      element("span", {}, `amplitude of ${this.dof} at ${this.app.where()}; longer and shorter: its motion at the phase above; numbered counter-clockwise from 0 to ${disc.sectors - 1}${disc.whole ? "" : `; a wave of engine order ${disc.engine_order}`}`)));
    this.paint();
  }

  /** One blade in words, against the mean of all where they differ. */
  said(s) {
    const { content } = this.app.result, sizes = this.blades.map(({ amplitude }) => amplitude), mean = sizes.reduce((sum, size) => sum + size, 0) / sizes.length;
    const against = content.disc.whole && mean > 0 ? `, ${short(sizes[s] / mean, 3)} times the mean of all` : "";
    return `blade ${s}: ${short(sizes[s])}${content.dofs.after ?? ""}${against}`;
  }

  /** The blades at the instant. */
  paint() {
    const { orders } = this.app.result, motions = motionsAt(this.blades, orders, this.tau), most = swingOf(this.blades, orders), half = (0.42 * PERIOD) / this.blades.length;
    this.wedges.forEach((wedge, s) => wedge.setAttribute("d", wedgePath(FRONT.hub, FRONT.rest + (FRONT.swing * motions[s]) / most, (PERIOD * s) / motions.length, half)));
  }

  rows() {
    return [["blade", withUnits(`amplitude of ${this.dof}`, this.app.result.content.dofs.units)], ...this.blades.map(({ amplitude }, s) => [s, amplitude])];
  }
}

const largestBlade = (blades) => blades.reduce((best, { amplitude }, s) => (amplitude > blades[best].amplitude ? s : best), 0);

/** Motion of every blade about its mean at an instant. */
const motionsAt = (blades, orders, tau) => blades.map(({ X, delay }) => series(X, orders, tau - delay) - X[0]);

/** No blade moves further from its mean. */
function swingOf(blades, orders) {
  const swing = ({ X }) => orders.reduce((sum, _, j) => (j ? sum + Math.hypot(X[2 * j - 1], X[2 * j]) : 0), 0);
  return Math.max(...blades.map(swing)) || 1;
}

/** A place on a circle, counter-clockwise from the right; the screen's y points down. */
const onCircle = (radius, angle) => [radius * Math.cos(angle), -radius * Math.sin(angle)];

function wedgePath(inner, outer, angle, half) {
  const at = (radius, side) => onCircle(radius, angle + side * half).map((v) => v.toFixed(2)).join(" ");
  return `M${at(inner, -1)}L${at(outer, -1)}A${outer.toFixed(2)} ${outer.toFixed(2)} 0 0 0 ${at(outer, 1)}L${at(inner, 1)}A${inner} ${inner} 0 0 1 ${at(inner, -1)}Z`;
}
