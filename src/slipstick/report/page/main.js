// The page: one view, and everything that is drawn from it.

class App {
  constructor(content) {
    this.model = modelOf(content.results);
    this.start = startOf(this.model);
    this.view = viewFrom(location.hash, this.model);
    head(document.getElementById("head"), content);
    inputs(document.getElementById("inputs"), this.model.results);
    foot(document.getElementById("foot"), content);
    this.curves = new Curves(document.getElementById("response"), this);
    this.panels = new Panels(document.getElementById("point"), this);
    this.disc = new Disc(document.getElementById("disc"), this);
    this.interface = new Interface(document.getElementById("interface"), this);
    this.body = new Body(document.getElementById("body"), this);
    this.diagram = new Diagram(document.getElementById("diagram"), this);
    this.ranking = new Ranking(document.getElementById("contacts"), this);
    this.draw();
  }

  get result() { return this.model.results[this.view.result]; }

  /** Where the cursor is, in words: "4.26 rad/s". */
  where() {
    if (!this.result.points) return "no point";
    return this.result.content.abscissae.slice(0, 1).map((own) => this.said(own, this.result.at(own.key)[this.view.point]))[0];
  }

  unitsOf(own, result = this.result) { return result.unitsOf(own, this.view.unit, this.view.dof); }

  /** A value of a quantity in words: "4.26 rad/s", "damper.mu 0.3". */
  said(own, value) {
    const [factor, units] = this.unitsOf(own);
    return own.key === "omega" ? `${short(value * factor)} ${units}` : `${own.key === "parameter" ? own.label : quantityOf(own).toLowerCase()} ${short(value)}${own.after}`;
  }

  /** What this page leaves out of the results, in words. */
  leftOut(over) {
    const { dofs, contacts } = this.result.content, about = over === "dof" ? dofs : over === "contact" ? contacts : null;
    if (!about || about.count === about.names.length) return "";
    const which = over === "dof" ? "the dofs that move most" : "the contacts that dissipate most";
    return `${about.names.length} of ${about.count}: ${which}; more with slipstick report --${over}s ${about.count}`;
  }

  /** Change the view; what only moves the cursor leaves the curves as they are drawn. */
  set(change) {
    const moves = Object.keys(change).every((key) => ["point", "result", "dof", "contact", "loop", "spectrum", "history", "all", "turn", "blade", "disc", "colour"].includes(key));
    const drawn = this.curves.drawn();
    this.view = settled({ ...this.view, ...change }, this.model, this.start);
    this.view.point = Math.min(this.view.point, Math.max(0, this.result.points - 1));
    history.replaceState(null, "", addressOf(this.view));
    if (moves && drawn === this.curves.drawn()) this.curves.move();
    else this.curves.draw();
    if (!moves || "result" in change) this.diagram.draw();
    this.drawPoint();
  }

  /** The body from another side; nothing else changes. */
  turn(angles) {
    this.view.turn = angles;
    history.replaceState(null, "", addressOf(this.view));
  }

  turnContact(by) {
    const known = this.result.contacts, at = known.indexOf(this.view.contact);
    if (known.length) this.set({ contact: known[(at + by + known.length) % known.length] });
  }

  draw() {
    this.curves.draw();
    this.diagram.draw();
    this.drawPoint();
  }

  drawPoint() {
    this.panels.draw();
    this.disc.draw();
    this.interface.draw();
    this.body.draw();
    this.ranking.draw();
  }
}

async function start() {
  const text = (id) => document.getElementById(id).textContent;
  STORE.buffer = await inflated(text("numbers"));
  const app = new App(JSON.parse(text("content")));
  let width = innerWidth, waiting = 0;
  addEventListener("resize", () => {
    if (innerWidth === width) return;
    width = innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(() => app.draw(), 100);
  });
  addEventListener("hashchange", () => {
    app.view = viewFrom(location.hash, app.model);
    app.draw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.draw());
  for (const [event, paper] of [["beforeprint", true], ["afterprint", false]]) {
    addEventListener(event, () => {
      document.documentElement.toggleAttribute("data-paper", paper);
      app.draw();
    });
  }
  return app;
}

start().then((app) => {
  window.slipstick = {
    /** One period of a friction contact, as `Branch.loop` of the Python package gives it. */
    loop: (result, point, contact, samples = 721) => period(app.model.results[result].element(point, contact), times(0, PERIOD, samples)),
    states: (result, point, contact) => app.model.results[result].stated(point, contact).states,
    /** Friction force of a contact in its plane over one period, and the smallest and largest limit. */
    plane: (result, point, contact) => app.model.results[result].plane(point, contact),
    /** Lines of the chart and of those below it, with what they are of: [quantity, result, name, x, y]. */
    drawn: () => [[app.curves.curve, app.curves.lines], ...app.curves.below.map(({ curve, lines }) => [curve, lines])]
      .flatMap(([curve, lines]) => (curve ? (lines ?? []).map(({ result, name, x, y }) => [curve.key, result.index, name, [...x], [...y]]) : [])),
    view: () => ({ ...app.view }),
    set: (change) => app.set(change),
  };
  document.documentElement.toggleAttribute("data-ready", true);
});
