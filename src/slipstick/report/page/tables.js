// Contacts ranked by the power they dissipate at the cursor.

const MOST_ROWS = 12;
const ROUNDING = 1e-11; // less of all power is none

class Ranking {
  constructor(host, app) {
    Object.assign(this, { host, app });
  }

  draw() {
    const { app } = this, { view, result } = app;
    this.host.hidden = !result.contacts.length || !result.points;
    if (this.host.hidden) return;
    const ranked = result.contacts.map((name) => ({ name, power: this.at("dissipated_power", name) })).sort((a, b) => b.power - a.power);
    const shown = view.all ? ranked : ranked.slice(0, MOST_ROWS), total = this.at("dissipated_power", "");
    const columns = this.columns();
    const head = element("tr", {}, ...["", "contact", withUnits("power", result.curve("dissipated_power")?.units ?? ""), "share", ...columns.map((c) => withUnits(c.title, c.units)), "stick · slip · separation"]
      .map((text) => element("th", { scope: "col" }, text)));
    const rows = shown.map((row, i) => this.row(row, i, total, columns));
    const more = ranked.length > MOST_ROWS ? element("button", { type: "button", onclick: () => app.set({ all: !view.all }) }, view.all ? `the first ${MOST_ROWS}` : `all ${ranked.length} contacts`) : null;
    const rest = total - ranked.reduce((sum, row) => sum + (row.power || 0), 0), less = app.leftOut("contact");
    fill(this.host, element("div", { class: "panel-head" }, element("h2", {}, "Contacts by dissipated power"), element("div", { class: "tools" }, more)),
      element("div", { class: "card scroll" }, element("table", { class: "ranking" }, element("thead", {}, head), element("tbody", {}, ...rows))),
      less ? element("p", { class: "soft" }, `${less}; the others dissipate ${short(Math.max(rest, 0))} together here`) : null);
  }

  at(key, name) {
    const values = this.app.result.values(key, name);
    return values ? values[this.app.view.point] : NaN;
  }

  columns() {
    return [["friction_coefficient", "μ"], ["temperature", "temperature"]].filter(([key]) => this.app.result.curve(key))
      .map(([key, title]) => ({ key, title, units: this.app.result.curve(key).units }));
  }

  row({ name, power }, i, total, columns) {
    const { app } = this, chosen = name === app.view.contact;
    const meter = element("svg:svg", { width: 90, height: 8, viewBox: "0 0 90 8", preserveAspectRatio: "none", "aria-hidden": "true" }, element("svg:rect", { width: 90, height: 8, rx: 2, class: "meter" }),
      element("svg:rect", { width: Math.max(0, 90 * Math.min(1, power / total || 0)), height: 8, rx: 2, class: "meter-full" }));
    return element("tr", { class: chosen ? "chosen" : "" }, element("td", {}, i + 1),
      element("td", {}, element("button", { type: "button", class: "plain", "aria-pressed": String(chosen), onclick: () => app.set({ contact: name }) }, name)),
      element("td", {}, short(Math.abs(power) < ROUNDING * total ? 0 : power, 4)), element("td", {}, meter, ` ${total ? Math.round((100 * power) / total) : 0} %`),
      ...columns.map((column) => element("td", {}, short(this.at(column.key, name), 4))), element("td", {}, this.shares(name)));
  }

  /** Fractions of the period in each state, as one bar with a word for those who do not see it. */
  shares(name) {
    const law = this.app.result.stated(this.app.view.point, name);
    if (!law) return "–";
    const parts = { "stick": 0, "slip": 0, "slip+": 0, "slip-": 0, "separation": 0 };
    for (const [a, b, state] of law.states) parts[state] += (b - a) / PERIOD;
    const bar = element("svg:svg", { width: 120, height: 12, viewBox: "0 0 120 12", preserveAspectRatio: "none", role: "img", "aria-label": Object.entries(parts).filter(([, part]) => part > 0).map(([state, part]) => `${STATE_WORDS[state]} ${Math.round(100 * part)} %`).join(", ") });
    let left = 0;
    for (const [state, part] of Object.entries(parts)) {
      bar.append(element("svg:rect", { x: 120 * left, width: 120 * part, height: 12, ...fillOf(state) }));
      left += part;
    }
    return bar;
  }
}
