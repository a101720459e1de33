// What is looked at: kept in the part of the address after #, so that a copied address shows the same.

const CHOICES = {
  loop: ["total", "motion"], spectrum: ["dof", "force"], history: ["dof", "force", "normal"],
  log: ["", "y", "x", "xy"], colour: ["", "motion", "worn_depth", "normal_load", "normal_force", "slip_fraction", "separation_fraction", "dissipated_power"],
};

/** The view with defaults for what a stranger's address leaves out or says wrongly. */
function viewFrom(text, model) {
  const given = new URLSearchParams(text.replace(/^#/, ""));
  const listed = (key, known) => (given.has(key) ? given.getAll(key).filter((name) => known.includes(name)) : []);
  const start = startOf(model);
  const result = whole(given.get("result"), model.results.length, start.result);
  const own = model.results[result];
  const view = {
    curve: model.curves.some((c) => c.key === given.get("curve")) ? given.get("curve") : start.curve,
    over: model.overs.some((own) => own.key === given.get("over")) ? given.get("over") : model.overs[0].key,
    limits: given.get("limits") === "1",
    result,
    point: whole(given.get("point"), own.points, result === start.result ? start.point : 0),
    dofs: listed("dof", model.dofs), contacts: listed("contact", ["", ...model.contacts]),
    dof: given.get("at-dof"), contact: given.get("at-contact"),
    disc: own.content.disc?.dofs.find((name) => name === given.get("disc")) ?? "", blade: whole(given.get("blade"), own.content.disc?.sectors ?? 0, null),
    all: given.get("all") === "1", turn: turned(given.get("turn"), own.content.analysis === "wear" ? own.content.shape?.on?.turn : undefined),
  };
  for (const [key, known] of Object.entries(CHOICES)) {
    view[key] = known.includes(given.get(key)) ? given.get(key) : known[0];
  }
  view.unit = model.frequencies.includes(given.get("unit")) ? given.get("unit") : start.unit;
  return settled(view, model, start);
}

const TURN = [-35, 20];

/** Angles the body is seen under, degrees: round the vertical, and from above. */
function turned(text, otherwise = TURN) {
  const angles = String(text ?? "").split(",").map(Number);
  return angles.length === 2 && angles.every(Number.isFinite) ? [angles[0] % 360, Math.max(-90, Math.min(90, angles[1]))] : otherwise;
}

function whole(text, below, otherwise) {
  const number = Number(text);
  return text !== null && Number.isInteger(number) && number >= 0 && number < below ? number : otherwise;
}

/** The view with something chosen wherever there is something to choose. */
function settled(view, model, start) {
  const own = model.results[view.result];
  if (!view.dofs.length) view.dofs = start.dofs;
  if (!view.contacts.length) view.contacts = [""];
  if (!own.dofs.includes(view.dof)) view.dof = view.dofs.find((name) => own.dofs.includes(name)) ?? own.dofs[0] ?? "";
  // dofs of another unit than the one looked at are not drawn on its axis
  const unit = own.unitOf(view.dof), alike = view.dofs.filter((name) => !own.dofs.includes(name) || own.unitOf(name) === unit);
  if (alike.length < view.dofs.length) view.dofs = alike.length ? alike : [view.dof];
  if (!own.contacts.includes(view.contact)) view.contact = start.contact(own);
  return view;
}

function addressOf(view) {
  const out = new URLSearchParams({ curve: view.curve, over: view.over, result: view.result, point: view.point });
  for (const name of view.dofs) out.append("dof", name);
  for (const name of view.contacts) out.append("contact", name);
  out.set("at-dof", view.dof);
  out.set("at-contact", view.contact);
  for (const key of [...Object.keys(CHOICES), "unit"]) if (view[key]) out.set(key, view[key]);
  if (view.disc) out.set("disc", view.disc);
  if (view.blade !== null) out.set("blade", view.blade);
  out.set("turn", view.turn.join(","));
  for (const key of ["all", "limits"]) if (view[key]) out.set(key, "1");
  return `#${out}`;
}

/** Of the dofs asked for, else of all, the one that moves most: its name, and the point where it does. */
function soughtOf(result) {
  const asked = result.content.asked.map((place) => result.dofs[place]);
  const among = asked.length ? asked : result.dofs, alike = among.filter((name) => result.unitOf(name) !== "rad"); // rad and lengths are not compared
  return largest(result, "amplitude", alike.length ? alike : among);
}

/** What is shown first: the dof that was sought, or the result that was; the contact that dissipates most there. */
function startOf(model) {
  const first = model.results.find((result) => result.points) ?? model.results[0];
  const peak = soughtOf(first);
  const sought = first.content.notes.find(([, , kind]) => kind === "optimum" || (kind === "requested" && first.content.analysis === "modes"));
  return {
    curve: model.curves[0]?.key ?? "", result: first.index, point: first.content.analysis === "wear" ? Math.max(0, first.points - 1) : sought ? sought[0] : peak.point,
    dofs: peak.name ? [peak.name] : model.dofs.slice(0, 1),
    contact: (result) => largest(result, "dissipated_power", result.contacts).name ?? "",
    unit: first.content.frequency.unit,
  };
}

function largest(result, key, names) {
  let best = { point: 0, name: names[0], value: -Infinity };
  for (const name of names) {
    result.values(key, name)?.forEach((value, point) => { if (value > best.value) best = { point, name, value }; });
  }
  return best;
}
