// What was computed, in tables of words: model, modes, loads, contacts.

function inputs(host, results) {
  const known = results.filter((result) => result.content.inputs.length);
  host.hidden = !known.length;
  if (host.hidden) return;
  fill(host, element("div", { class: "inputs-head" }, element("h2", { id: "inputs-title" }, "Inputs")),
    ...known.flatMap((result) => [results.length > 1 ? element("h3", {}, result.label) : null, element("div", { class: "inputs" }, ...result.content.inputs.map(inputCard))]));
}

function inputCard({ title, head, rows }) {
  const cells = (row) => row.map((text, i) => element(i ? "td" : "th", i ? { class: /^-?[\d.]/.test(text) && text.length < (head.length > 5 ? 24 : 16) ? "number" : null } : { scope: "row" }, text));
  return element("div", { class: head.length > 5 ? "card wide" : "card" }, element("h3", {}, title), element("div", { class: "scroll rows", tabindex: 0 }, element("table", {},
    head.length ? element("thead", {}, element("tr", {}, ...head.map((text) => element("th", { scope: "col" }, text)))) : null,
    element("tbody", {}, ...rows.map((row) => element("tr", {}, ...cells(row)))))));
}
