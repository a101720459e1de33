// Outcome and provenance, at the top; what the page is, at its foot.

function head(host, content) {
  fill(host, element("p", { class: "brand" }, "slipstick"), element("h1", {}, content.title),
    ...authored(content.results.length === 1 ? content.results[0] : content),
    element("div", { class: content.results.length > 1 ? "outcomes" : "" }, ...content.results.map((result) => outcome(result, content.results.length > 1))));
}

function outcome(result, several) {
  const found = (name) => result.about.find(([key]) => key === name)?.[1];
  const facts = [`${result.points} points`, found("Newton iterations") ? `${found("Newton iterations")} Newton iterations` : "", found("seconds") ? `${short(Number(found("seconds")), 3)} s` : "",
    `harmonics ${orders(result.orders)}`, result.contacts.count ? `${result.contacts.count} contact${result.contacts.count > 1 ? "s" : ""}` : "no contacts", result.case_file];
  return element("section", { class: "outcome", "aria-label": `Outcome${several ? ` of ${result.label}` : ""}` },
    several ? element("h2", {}, result.label) : null, ...(several ? authored(result) : []),
    element("p", { class: `verdict ${result.outcome.ok ? "good" : "early"}` }, element("strong", {}, result.outcome.ok ? "✓" : "!"), ` ${result.outcome.text}`),
    element("p", { class: "facts" }, facts.filter(Boolean).join(" · ")),
    ...result.warnings.map((text) => element("p", { class: "warning" }, element("strong", {}, "Warning: "), text)),
    element("div", { class: "folds" }, fold("Provenance", about(result.about)), result.case ? fold("Case file", element("pre", { tabindex: 0 }, result.case)) : null));
}

/** Author and remarks of the case file. */
function authored({ author, remarks }) {
  return [author ? element("p", { class: "author" }, author) : null, remarks ? element("p", { class: "remarks" }, remarks.trim()) : null];
}

function fold(title, inside) {
  return element("details", {}, element("summary", {}, title), inside);
}

function about(pairs) {
  return element("dl", {}, ...pairs.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
}

/** "0..10", or the orders themselves. */
function orders(list) {
  const run = list.length > 2 && list.every((m, i) => i === 0 || m === list[i - 1] + 1);
  return run ? `${list[0]}..${list[list.length - 1]}` : list.join(", ");
}

function foot(host, content) {
  fill(host, element("p", {}, `Written by slipstick ${content.version}, ${content.written}. This file needs no network and no server. `,
    "Keys on the curve: ← → move, with shift by 10; ↑ ↓ another curve or contact; Home, End. Drag to zoom; the address keeps the view."));
}
