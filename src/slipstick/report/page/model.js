// The results of the page: curves, points, contacts, each read from its arrays when it is first asked for.

/** What `make` gives for a key, made once. */
class Kept extends Map {
  of(key, make) {
    if (!this.has(key)) this.set(key, make());
    return this.get(key);
  }
}

/** Curves in the unit of their dof. */
const MOTIONS = ["amplitude", "mean"];
const VERDICTS = ["stable", "unstable", "stability not known"];

class Result {
  constructor(content, index) {
    Object.assign(this, { content, index, label: content.label, orders: content.orders, points: content.points });
    this.dofs = content.dofs.names;
    this.contacts = content.contacts.names;
    this.friction = content.contacts.friction;
    this.planar = content.contacts.planar;
    this.orbits = content.contacts.orbits;
    this.kept = new Kept();
  }

  numbers(key, packed) {
    return this.kept.of(key, () => new Numbers(packed));
  }

  coefficients(key, packed) {
    return this.kept.of(key, () => new Coefficients(packed));
  }

  get omega() {
    return this.numbers("omega", this.content.omega).values;
  }

  omegaAt(point) {
    return this.numbers("omega", this.content.omega).get(point);
  }

  /** What its curves can be drawn over: the quantity of that key, or the one that was followed. */
  abscissa(key) {
    const { abscissae } = this.content;
    return abscissae.find((own) => own.key === key) ?? abscissae[0];
  }

  /** Values of an abscissa. */
  at(key) {
    const own = this.abscissa(key);
    return this.kept.of(`at ${own.key}`, () => this.numbers(`at ${own.key}`, own.values).column());
  }

  /** A quantity in the units it is drawn in, factor and unit: frequencies are in the unit chosen, motion in that of the dof. */
  unitsOf(own, unit, dof) {
    const { factors } = this.content.frequency;
    if (MOTIONS.includes(own.key) && this.dofs.includes(dof)) return [1, this.unitOf(dof)];
    return own.key === "omega" && unit in factors ? [factors[unit], unit] : [1, own.units];
  }

  /** The unit as it stands after a number; nothing where it has no name. */
  afterOf(own, unit, dof) {
    const [, units] = this.unitsOf(own, unit, dof);
    if (units === own.units) return own.after;
    return units === this.content.dofs.units ? this.content.dofs.after : ` ${units}`;
  }

  /** The unit of the motion of a dof: a length, or rad. */
  unitOf(dof) {
    return this.content.dofs.units_of[this.dofs.indexOf(dof)] ?? "";
  }

  /** A frequency as an axis. */
  get frequencyAxis() {
    const { factors } = this.content.frequency;
    return { key: "omega", units: Object.keys(factors).find((unit) => factors[unit] === 1) ?? "" };
  }

  /** Frequencies and amplitudes of a dof in the linear limits; none where they are not known. */
  limits(name) {
    const dof = this.dofs.indexOf(name);
    return this.content.references.map(({ label, omega, amplitude }, i) => ({ label,
      x: this.numbers(`limit ${i}`, omega).values, y: this.numbers(`limit amplitude ${i}`, amplitude).column(dof) }));
  }

  get part() {
    return this.kept.of("part as column", () => this.numbers("part", this.content.part).column());
  }

  kind(point) {
    return this.content.kinds[this.numbers("kind", this.content.kind).get(point)];
  }

  /** "stable", "unstable" or "stability not known" at a point; "" where that was not computed. */
  verdict(point) {
    return this.content.unstable ? VERDICTS[this.numbers("unstable", this.content.unstable).get(point)] : "";
  }

  curve(key) {
    return this.content.curves.find((curve) => curve.key === key);
  }

  names(curve) {
    return curve.over === "dof" ? this.dofs : curve.over === "contact" ? this.contacts : [];
  }

  /** One curve along the branch; the empty name is that of all contacts together. Null where there is none. */
  values(key, name) {
    const curve = this.curve(key);
    if (!curve) return null;
    return this.kept.of(`${key}|${name}`, () => {
      if (curve.total && name === "") return this.numbers(`${key} total`, curve.total).column();
      if (curve.over === "") return this.numbers(key, curve.values).column();
      const at = this.names(curve).indexOf(name);
      return at < 0 ? null : this.numbers(key, curve.values).column(at);
    });
  }

  /** Whether there is anything to draw of a curve. */
  known(key, name) {
    return this.kept.of(`known ${key}|${name}`, () => this.points > 0 && (this.values(key, name)?.some(Number.isFinite) ?? false));
  }

  /** Lowest and highest amplitudes of a dof that tolerances allow; none where no tolerances were given. */
  band(name) {
    const { bands } = this.content, at = this.dofs.indexOf(name);
    return bands && at >= 0 ? ["low", "high"].map((side) => this.numbers(`band ${side}`, bands[side]).column(at)) : [];
  }

  /** Coefficients of a dof's motion. */
  displacement(point, name) {
    const at = this.dofs.indexOf(name);
    return at < 0 ? null : this.coefficients("displacement", this.content.dofs.displacement).row(point, at);
  }

  /** The friction element of a contact at a point as `law.js` takes it; null for another law. */
  element(point, name) {
    const f = this.friction, m = f ? f.of.indexOf(this.contacts.indexOf(name)) : -1;
    if (m < 0) return null;
    const L = 2 * this.orders.length - 1;
    const one = (key) => this.numbers(`friction ${key}`, f[key]).get(point, m);
    const X = this.coefficients("motion", f.motion).row(point, m);
    const U = this.numbers("rubbing", f.rubbing).row(point, m * L, L);
    return {
      orders: this.orders, X, W: X.map((x, i) => x + U[i]), Y: this.coefficients("normal", f.normal).row(point, m),
      v: one("drift"), kt: one("kt"), mu: one("mu"), kn: one("kn"), gap: one("gap"), mean: one("mean"),
      states: this.states("friction", point, m),
    };
  }

  /** A contact at a point that slides in a plane: vibration, both friction forces over the period, the smallest and largest limit; null for another law. */
  plane(point, name) {
    const p = this.planar, m = p ? p.of.indexOf(this.contacts.indexOf(name)) : -1;
    if (m < 0) return null;
    const row = (key) => this.coefficients(`planar ${key}`, p[key]).row(point, m), force = row("force"), half = force.length / 2;
    return {
      orders: this.orders, motion: [row("tangential"), row("second")], force: [force.subarray(0, half), force.subarray(half)],
      limit: [...this.numbers("planar limit", p.limit).row(point, 2 * m, 2)], mu: this.numbers("planar mu", p.mu).get(point, m),
      states: this.states("planar", point, m),
    };
  }

  /** A rotor in its stator at a point: motion of the centre, clearance and states; null for another law. */
  orbit(point, name) {
    const o = this.orbits, m = o ? o.of.indexOf(this.contacts.indexOf(name)) : -1;
    if (m < 0) return null;
    const row = (key) => this.coefficients(`orbit ${key}`, o[key]).row(point, m), one = (key) => this.numbers(`orbit ${key}`, o[key]).get(point, m);
    return { orders: this.orders, motion: [row("x"), row("y")], gap: one("gap"), mu: one("mu"), states: this.states("orbits", point, m) };
  }

  /** What is known of the states of a contact at a point; null where its law has none. */
  stated(point, name) {
    return this.element(point, name) ?? this.plane(point, name) ?? this.orbit(point, name);
  }

  /** Intervals [start, end, state] of contact m of a kind at a point. */
  states(kind, point, m) {
    const { starts, codes, counts } = this[kind].states, many = this[kind].of.length;
    const [begins, code] = [this.numbers(`${kind} starts`, starts), this.numbers(`${kind} codes`, codes)];
    const offsets = this.kept.of(`${kind} offsets`, () => this.offsets(new Numbers(counts), many));
    const [from, to] = [offsets[point * many + m], offsets[point * many + m + 1]];
    const start = (i) => begins.get(i);
    return Array.from({ length: to - from }, (_, i) => [
      start(from + i),
      from + i + 1 < to ? start(from + i + 1) : start(from) + PERIOD,
      this.content.states[code.get(from + i)],
    ]);
  }

  offsets(counts, many) {
    const out = new Uint32Array(this.points * many + 1);
    for (let i = 0; i < out.length - 1; i++) out[i + 1] = out[i] + counts.get(Math.floor(i / many), i % many);
    return out;
  }

  /** The surface of the body and the fields of its motion; null where it is not known. */
  get shape() {
    const { shape } = this.content;
    return shape && this.kept.of("shape", () => ({
      nodes: new Numbers(shape.nodes).values, triangles: new Numbers(shape.triangles).values,
      fields: Array.from({ length: shape.fields.shape[0] }, (_, k) => this.numbers("fields", shape.fields).row(k)),
      less: shape.less, on: shape.on ? { ...shape.on, contact: new Numbers(shape.on.contact).values } : null,
    }));
  }

  /** A quantity of contacts at every node of the surface at a point: that of the contact it lies round, 0 elsewhere. */
  atNodes({ key, most, values }, point) {
    const steps = this.numbers(`${key} on the surface`, values).row(point);
    return Float64Array.from(this.shape.on.contact, (contact) => (contact ? (most * steps[contact - 1]) / 65535 : 0));
  }

  /** Both coordinates and areas of the contacts of a pair of surfaces. */
  placesOf({ x, y, area }) {
    return { x: new Numbers(x).values, y: new Numbers(y).values, area: new Numbers(area).values };
  }

  /** A quantity of the contacts of a pair of surfaces at a point; states by number. */
  onInterface({ name }, { key, most, values }, point) {
    const steps = Array.from(this.numbers(`${key} of ${name}`, values).row(point));
    return key === "state" ? steps : steps.map((step) => (most * step) / 65535);
  }

  /** What each field does at a point: coefficients (0, c1, s1, ...). */
  fieldMotion(point) {
    const { coefficients, fields } = this.content.shape;
    return Array.from({ length: fields.shape[0] }, (_, k) => this.coefficients("field motion", coefficients).row(point, k));
  }

  /** Amplitude and motion at a point of a dof at every sector of a disc: coefficients and the delay of its phase. */
  onDisc(point, name) {
    const { disc } = this.content, { sectors, whole } = disc, first = disc.dofs.indexOf(name) * (whole ? sectors : 1);
    const [sizes, motions] = [this.numbers("disc amplitude", disc.amplitude), this.coefficients("disc motion", disc.displacement)];
    return Array.from({ length: sectors }, (_, s) => {
      const at = first + (whole ? s : 0);
      return { amplitude: sizes.get(point, at), X: motions.row(point, at), delay: (PERIOD * s * disc.engine_order) / sectors };
    });
  }

  /** Motion and force series of a contact of another law, its first port; null where there is none. */
  ported(point, name) {
    const at = this.contacts.indexOf(name), L = 2 * this.orders.length - 1;
    const own = this.content.contacts.series.find((port) => port.of.includes(at));
    if (!own) return null;
    const row = (key) => this.numbers(`${own.port} ${key}`, own[key]).row(point, own.of.indexOf(at) * L, L);
    return { port: own.port, X: row("motion"), F: row("force") };
  }
}

/** The results of a page, and the names and quantities of all of them together. */
function modelOf(contents) {
  const results = contents.map((content, i) => new Result(content, i)), union = (lists) => [...new Set(lists.flat())];
  const curves = results.flatMap((result) => result.content.curves);
  return {
    results, dofs: union(results.map((r) => r.dofs)), contacts: union(results.map((r) => r.contacts)),
    curves: curves.filter((curve, i) => curves.findIndex((other) => other.key === curve.key) === i),
    overs: results[0].content.abscissae, frequencies: union(results.map((r) => Object.keys(r.content.frequency.factors))),
  };
}

/** The point nearest to a value of an abscissa. */
function nearest(values, wanted) {
  let best = 0;
  values.forEach((value, i) => { if (Math.abs(value - wanted) < Math.abs(values[best] - wanted)) best = i; });
  return best;
}
