// Stick, slip and separation of all contacts over one period: a row each, told apart by colour, pattern and letter.

const STATES = { "stick": ["stick", "●"], "slip": ["slip-plus", "~"], "slip+": ["slip-plus", "+"], "slip-": ["slip-minus", "−"], "separation": ["separation", "○"] };
const STATE_WORDS = { "stick": "stick", "slip": "slip", "slip+": "slip +", "slip-": "slip −", "separation": "separation" };

function patterns() {
  const bar = (id, turn) => element("svg:pattern", { id: `pattern-${id}`, width: 7, height: 7, patternUnits: "userSpaceOnUse", patternTransform: `rotate(${turn})` },
    element("svg:rect", { width: 7, height: 7, class: `state-${id}` }), element("svg:line", { x1: 0, y1: 0, x2: 0, y2: 7, class: "hatch" }));
  const dots = element("svg:pattern", { id: "pattern-separation", width: 6, height: 6, patternUnits: "userSpaceOnUse" },
    element("svg:rect", { width: 6, height: 6, class: "state-separation" }), element("svg:circle", { cx: 3, cy: 3, r: 1, class: "hatch-dot" }));
  return element("svg:defs", {}, bar("slip-plus", 45), bar("slip-minus", -45), dots);
}

const fillOf = (state) => (state === "stick" ? { class: "state-stick" } : { fill: `url(#pattern-${STATES[state][0]})` });

/** The strip of `rows` [name, element], each a button that chooses its contact. */
function strip(host, rows, chosen, choose) {
  const width = Math.max(host.clientWidth, 260), left = Math.min(140, Math.max(...rows.map(([name]) => 7.8 * name.length)) + 16);
  const gap = 6, bar = Math.max(20, Math.min(140, 200 / rows.length - gap)), top = 4, height = top + rows.length * (bar + gap) + 22;
  const x = (tau) => left + ((width - left - 12) * tau) / PERIOD;
  const drawing = element("svg:svg", { width, height, role: "group", "aria-label": "States of the contacts over one period" }, patterns());
  rows.forEach(([name, law], i) => drawing.append(stripRow(name, law, name === chosen, top + i * (bar + gap), bar, left, x, choose)));
  ["0", "π/2", "π", "3π/2", "2π"].forEach((label, i) => drawing.append(
    element("svg:text", { x: x((i * PERIOD) / 4), y: height - 5, "text-anchor": "middle", class: "tick" }, label)));
  fill(host, drawing);
}

function stripRow(name, law, chosen, y, bar, left, x, choose) {
  const spans = law ? pieces(law) : [];
  const said = spans.map(([a, b, state]) => `${state} from ${short(a, 3)} to ${short(b, 3)}`).join(", ") || "its law has no such states";
  const act = (event) => {
    if (event.type === "click" || event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(name); }
  };
  const row = element("svg:g", { class: chosen ? "strip-row chosen" : "strip-row", role: "button", tabindex: 0, "aria-pressed": String(chosen),
    "data-contact": name, "aria-label": `${name}: ${said}`, onclick: act, onkeydown: act },
    element("svg:text", { x: left - 8, y: y + bar / 2 + 4, "text-anchor": "end", class: "name" }, name.length > 16 ? `${name.slice(0, 15)}…` : name));
  for (const [a, b, state] of spans) {
    row.append(element("svg:rect", { x: x(a), y, width: Math.max(x(b) - x(a), 0.5), height: bar, ...fillOf(state), "data-state": state }));
    if (x(b) - x(a) > 18) row.append(letter(STATES[state][1], (x(a) + x(b)) / 2, y + bar / 2, state));
  }
  row.append(element("svg:rect", { x: left, y, width: x(PERIOD) - left, height: bar, class: "frame" }));
  return row;
}

function letter(text, x, y, state) {
  return element("svg:g", {}, element("svg:circle", { cx: x, cy: y, r: 7, class: `badge-${STATES[state][0]}` }),
    element("svg:text", { x, y: y + 4, "text-anchor": "middle", class: `letter letter-${STATES[state][0]}` }, text));
}

/** The states of one contact in words, one after the other, with their fraction of the period. */
function statesInWords(name, law) {
  const part = (share) => (share < 0.005 ? "< 1 %" : `${Math.round(100 * share)} %`);
  const spans = law ? law.states.map(([a, b, state]) => `${STATE_WORDS[state]} ${short(since(a, 0), 3)} to ${short(since(a, 0) + b - a, 3)} rad (${part((b - a) / PERIOD)})`) : [];
  return spans.length ? element("p", { class: "soft" }, `${name}: ${spans.slice(0, 12).join(", ")}${spans.length > 12 ? ` and ${spans.length - 12} more` : ""}`) : null;
}

/** What the colours mean, of the states that contacts of a result may have: along a line, in a plane. */
function stateKey(result) {
  const of = { "stick": result.friction ?? result.planar, "slip": result.planar ?? result.orbits, "slip+": result.friction, "slip-": result.friction };
  return element("div", { class: "line-names" }, ...Object.keys(STATES).filter((state) => of[state] !== null).map((state) => element("span", { class: "line-name" },
    element("svg:svg", { width: 26, height: 14, "aria-hidden": "true" }, element("svg:rect", { width: 26, height: 14, ...fillOf(state) })), `${STATES[state][1]} ${STATE_WORDS[state]}`)));
}
