// What the scripts of the page ask of a browser: elements as a tree, lines and paths as lists of numbers.

class Place {
  constructor(tag) {
    Object.assign(this, { tag, attributes: {}, children: [], listeners: {}, style: {}, parent: null, hidden: false, clientWidth: 800, clientHeight: 400 });
  }
  setAttribute(name, value) { this.attributes[name] = String(value); }
  getAttribute(name) { return this.attributes[name] ?? null; }
  toggleAttribute(name, on) { if (on) this.attributes[name] = ""; else delete this.attributes[name]; }
  addEventListener(name, f) { this.listeners[name] = f; }
  append(...children) {
    for (const child of children) {
      if (child instanceof Place) child.parent = this;
      this.children.push(child);
    }
  }
  replaceChildren(...children) { this.children = []; this.append(...children); }
  replaceWith(other) { this.parent.children[this.parent.children.indexOf(this)] = other; other.parent = this.parent; }
  get lastChild() {
    const last = this.children[this.children.length - 1] ?? null;
    if (last === null || last instanceof Place) return last;
    return { set textContent(text) { this.owner.children[this.owner.children.length - 1] = text; }, owner: this };
  }
  prepend(...children) { for (const child of children) child.parent = this; this.children.unshift(...children); }
  remove() { if (this.parent) this.parent.children = this.parent.children.filter((child) => child !== this); }
  get firstChild() { return this.children[0] ?? null; }
  get parentNode() { return this.parent; }
  focus() { document.activeElement = this; }
  get textContent() { return this.children.map((child) => (child instanceof Place ? child.textContent : String(child))).join(""); }
  set textContent(text) { this.children = text === "" ? [] : [text]; }
  get value() { return this.attributes.value; }
  set value(text) { this.attributes.value = String(text); }
  get all() { return [this, ...this.children.flatMap((child) => (child instanceof Place ? child.all : []))]; }
  /** Whether this is what a selector of one element, such as "tr.chosen" or "[tabindex]", is of. */
  is(wanted) {
    const [, tag, id, name, own] = /^([a-z0-9]*)(?:#([\w-]+))?(?:\.([\w-]+))?(?:\[([\w-]+)\])?$/.exec(wanted);
    return (!tag || this.tag === tag) && (!id || this.attributes.id === id) && (!own || own in this.attributes)
      && (!name || (this.attributes.class ?? "").split(" ").includes(name));
  }
  /** Elements of a list of selectors: one inside another, or, after ":scope >", a child of this. */
  querySelectorAll(wanted) {
    const found = wanted.split(/,\s*/).flatMap((one) => {
      if (one.startsWith(":scope > ")) return this.children.filter((child) => child instanceof Place && child.is(one.slice(9)));
      return one.split(" ").reduce((hosts, step) => [...new Set(hosts.flatMap((host) => host.all.filter((node) => node !== host && node.is(step))))], [this]);
    });
    return this.all.filter((node) => found.includes(node));
  }
  querySelector(wanted) { return this.querySelectorAll(wanted)[0] ?? null; }
  closest(wanted) { return this.is(wanted) ? this : this.parent?.closest(wanted) ?? null; }
  getBoundingClientRect() { return { left: 10, top: 20, width: this.clientWidth, height: this.clientHeight }; }
  setPointerCapture(id) { this.captured = id; }
  hasPointerCapture(id) { return this.captured === id; }
  getContext() { return (this.context ??= new Drawing()); }
}

/** A canvas: every call in its order. */
class Drawing {
  constructor() {
    this.calls = [];
    return new Proxy(this, { get: (own, name) => (name in own ? own[name] : (...given) => { own.calls.push([name, ...given]); }),
      set: (own, name, value) => { own.calls.push([`= ${name}`, value]); own[name] = value; return true; } });
  }
}

class Path2D {
  constructor() { this.steps = []; }
  moveTo(x, y) { this.steps.push(["M", x, y]); }
  lineTo(x, y) { this.steps.push(["L", x, y]); }
  bezierCurveTo(...numbers) { this.steps.push(["C", ...numbers]); }
  rect(x, y, width, height) { this.steps.push(["R", x, y, width, height]); }
  closePath() { this.steps.push(["Z"]); }
  arc(x, y, radius) { this.steps.push(["A", x, y, radius]); }
}

/** The plotting library: a chart of 1000 x 500 whose places are linear or logarithmic in its range. */
class uPlot {
  constructor(options, data, host) {
    Object.assign(this, { options, data, host, over: new Place("div"), bbox: { left: 0, top: 0, width: 1000, height: 500 }, ctx: new Drawing() });
    this.over.attributes.class = "u-over";
    [this.over.clientWidth, this.over.clientHeight] = [1000, 500];
    this.scales = Object.fromEntries(["x", "y"].map((axis) => [axis, { min: options.scales[axis].range[0], max: options.scales[axis].range[1] }]));
    this.paths = options.series.slice(1).map((line) => line.paths(this));
    (options.hooks.drawAxes ?? []).forEach((draw) => draw(this));
    host.uplot = this;
    (options.hooks.draw ?? []).forEach((draw) => draw(this));
  }
  valToPos(value, axis) {
    const { min, max } = this.scales[axis], log = this.options.scales[axis].distr === 3;
    const part = log ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
    return axis === "x" ? 1000 * part : 500 * (1 - part);
  }
  posToVal(place, axis) {
    const { min, max } = this.scales[axis], part = axis === "x" ? place / 1000 : 1 - place / 500;
    return this.options.scales[axis].distr === 3 ? min * (max / min) ** part : min + part * (max - min);
  }
  destroy() { this.destroyed = true; }
}

const IDS = Object.fromEntries(["head", "response", "point", "disc", "body", "interface", "diagram", "contacts", "inputs", "foot", "content", "numbers", "choices", "map", "curves", "band", "amplification", "worst", "cases"].map((id) => {
  const node = new Place("section");
  node.attributes.id = id;
  return [id, node];
}));
const ROOT = new Place("html");
ROOT.append(...Object.values(IDS));
const document = { activeElement: null, documentElement: ROOT, getElementById: (id) => IDS[id] ?? ROOT.querySelector(`#${id}`), createElement: (tag) => new Place(tag),
  createElementNS: (_, tag) => new Place(tag), querySelector: (wanted) => ROOT.querySelector(wanted) };
let innerWidth = 1000;
const window = {}, location = { hash: "" }, devicePixelRatio = 1, heard = {};
const history = { replaceState: (_, __, address) => { location.hash = address; } };
class ResizeObserver { observe() {} }
const addEventListener = (name, f) => { heard[name] = f; };
const getComputedStyle = () => ({ getPropertyValue: (name) => ` ${name.slice(2)} ` });
const matchMedia = () => ({ matches: true, addEventListener: () => null });
class IntersectionObserver { observe() {} }
const requestAnimationFrame = () => 1, cancelAnimationFrame = () => null;

// for the tests: what a reader sees and does
const $ = (id) => document.getElementById(id);
const tagged = (node, tag) => node.all.filter((other) => other.tag === tag);
const classed = (node, name) => node.all.filter((other) => (other.attributes.class ?? "").split(" ").includes(name));
const said = (node) => node.all.filter((other) => other.attributes["aria-label"] !== undefined).map((other) => other.attributes["aria-label"]);
const table = (node) => tagged(node, "tr").map((row) => row.children.map((cell) => cell.textContent));
const button = (node, text) => tagged(node, "button").find((other) => other.textContent === text);
const sent = (key, more = {}) => ({ key, type: "keydown", stopped: false, preventDefault() { this.stopped = true; }, ...more });
const press = (node, key, more) => { const event = sent(key, more); node.listeners.keydown(event); return event.stopped; };
const click = (node, more) => node.listeners.click({ type: "click", target: node, preventDefault() {}, ...more });
const change = (node, value) => node.listeners.change({ target: { value } });
const lines = (host) => host.uplot.data.slice(1).map(([x, y], i) => ({ x: [...x], y: [...y], pen: host.uplot.paths[i].stroke?.steps.map(([s]) => s).join(""), dash: host.uplot.options.series[i + 1].dash ?? null, stroke: host.uplot.options.series[i + 1].stroke ?? null }));
const marks = (node, tag) => tagged(node, tag).map((other) => ({ ...other.attributes, text: other.textContent }));
