// The deflected shape of a body at the point under the cursor, moving: triangles painted from back to front.

const RAMP = [[96, 92, 156], [62, 112, 165], [36, 155, 150], [105, 203, 98], [253, 231, 37]]; // viridis, lighter at its dark end
const SHOWN = 0.08; // the largest displacement is drawn as this part of the body's size
const SECONDS = 2.4;

/** Let the phase of a panel run, or stop it; painted where it is seen and there is something to paint. */
function animate(panel, playing, ready) {
  panel.playing = playing;
  panel.play.textContent = playing ? "❚❚ pause" : "▶ play";
  cancelAnimationFrame(panel.frame);
  let last = performance.now();
  const step = (now) => {
    if (!panel.playing) return;
    if (panel.visible && ready()) {
      panel.tau = (panel.tau + (PERIOD * Math.min(now - last, 100)) / (1000 * SECONDS)) % PERIOD;
      panel.phase.value = (360 * panel.tau) / PERIOD;
      panel.paint();
    }
    last = now;
    panel.frame = requestAnimationFrame(step);
  };
  if (playing) panel.frame = requestAnimationFrame(step);
}

class Body {
  constructor(host, app) {
    Object.assign(this, { host, app, tau: Math.PI / 2, factor: 1, visible: true, playing: !matchMedia("(prefers-reduced-motion: reduce)").matches });
    if (!app.model.results.some((result) => result.content.shape)) {
      host.hidden = true;
      return;
    }
    this.canvas = element("canvas", { class: "body", tabindex: 0, role: "img", onkeydown: (event) => this.key(event),
      onpointerdown: (event) => this.grab(event), onpointermove: (event) => this.drag(event) });
    this.play = element("button", { type: "button", onclick: () => this.run(!this.playing) });
    this.phase = element("input", { type: "range", min: 0, max: 360, value: 90, "aria-label": "Phase, degrees", oninput: () => {
      this.run(false);
      this.tau = (this.phase.value * PERIOD) / 360;
      this.paint();
    } });
    this.size = element("input", { type: "range", min: -10, max: 10, value: 0, "aria-label": "How much the motion is magnified", oninput: () => {
      this.factor = 2 ** (this.size.value / 3);
      this.paint();
    } });
    this.note = element("div", { class: "note" });
    this.pick = element("span", {});
    host.append(element("div", { class: "panel-head" }, element("h2", { id: "body-title" }, "Shape"),
      element("div", { class: "tools" }, this.pick, this.play, element("label", {}, "phase ", this.phase), element("label", {}, "magnified ", this.size))),
      element("div", { class: "card plot" }, this.canvas, this.note));
    saver(host.lastChild, () => `shape at ${app.where()}`, { PNG: () => pngOfCanvas(this.canvas) });
    new IntersectionObserver(([entry]) => { this.visible = entry.isIntersecting; }).observe(this.canvas);
    this.run(this.playing);
  }

  run(playing) {
    animate(this, playing, () => this.shape);
  }

  grab(event) {
    this.held = [event.clientX, event.clientY, ...this.app.view.turn];
    this.canvas.setPointerCapture(event.pointerId);
  }

  drag(event) {
    if (!this.held || !this.canvas.hasPointerCapture(event.pointerId)) return;
    const [x, y, yaw, pitch] = this.held;
    this.turn(yaw + 0.5 * (event.clientX - x), pitch + 0.5 * (event.clientY - y));
  }

  key(event) {
    const step = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key], [yaw, pitch] = this.app.view.turn;
    if (event.key === " ") this.run(!this.playing);
    else if (step) this.turn(yaw + step[0], pitch + step[1]);
    else return;
    event.preventDefault();
  }

  turn(yaw, pitch) {
    this.app.turn([Math.round(yaw) % 360, Math.max(-90, Math.min(90, Math.round(pitch)))]);
    this.paint();
  }

  /** At another point: its motion, and how much of it is shown. */
  draw() {
    if (!this.canvas) return;
    const { result, view } = this.app;
    this.shape = result.points ? result.shape : null;
    this.host.hidden = !this.shape;
    if (!this.shape) return;
    this.motion = result.fieldMotion(view.point);
    this.extent = extentOf(this.shape.nodes);
    this.largest = Math.max(...times(0, PERIOD, 25).map((tau) => largestOf(this.displacement(tau, result))), 0);
    this.coloured(result, view);
    const { chosen } = this, most = chosen ? `, coloured by ${chosen.label}, up to ${short(this.values.reduce((a, b) => Math.max(a, b), 0))}${chosen.after}` : "";
    this.canvas.setAttribute("aria-label", `Deflected shape, largest displacement ${short(this.largest)} ${result.content.dofs.units}${most}; drag or use the arrow keys to turn it`);
    this.ramp ??= rampOf();
    this.paint();
  }

  /** What colours the body: its motion, or a quantity of the contacts on it; of wear first the worn depth. */
  coloured(result, view) {
    const { on } = this.shape, of = new Map((on?.of ?? []).map((own) => [own.key, own]));
    const first = result.content.analysis === "wear" && of.has("worn_depth") ? "worn_depth" : "motion";
    const asked = view.colour === "motion" || of.has(view.colour) ? view.colour : first;
    this.chosen = of.get(asked) ?? null;
    this.values = this.chosen ? result.atNodes(this.chosen, view.point) : null;
    const keys = [first, ...["motion", ...of.keys()].filter((key) => key !== first)], label = (key) => of.get(key)?.label ?? key;
    const options = Object.fromEntries(keys.map((key) => [key === first ? "" : key, label(key)]));
    fill(this.pick, of.size ? choice("Colour of the body", options, asked === first ? "" : asked, (colour) => {
      const away = of.has(colour) && view.turn.every((angle, k) => angle === TURN[k]); // towards the contacts, unless it was turned
      this.app.set(away ? { colour, turn: on.turn } : { colour });
    }) : null);
  }

  /** Displacement of all nodes, three numbers each. */
  displacement(tau, result = this.app.result) {
    const out = new Float64Array(this.shape.nodes.length);
    this.shape.fields.forEach((field, k) => {
      const size = series(this.motion[k], result.orders, tau);
      for (let i = 0; i < out.length; i++) out[i] += size * field[i];
    });
    return out;
  }

  paint() {
    const { canvas, shape, extent } = this, ratio = devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!shape || !width) return;
    if (canvas.width !== Math.round(width * ratio)) [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const u = this.displacement(this.tau), magnified = this.largest > 0 ? (SHOWN * this.factor * extent.size) / this.largest : 0;
    const scale = (0.86 * Math.min(width, height)) / extent.size;
    const still = seen(shape.nodes, null, 0, extent, this.app.view.turn, scale, width, height);
    const moved = seen(shape.nodes, u, magnified, extent, this.app.view.turn, scale, width, height);
    const ctx = canvas.getContext("2d");
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, width, height);
    outline(ctx, still, shape.triangles);
    const { chosen, values } = this;
    faces(ctx, moved, shape.triangles, chosen ? (i) => values[i] / chosen.most : (i) => Math.hypot(u[3 * i], u[3 * i + 1], u[3 * i + 2]) / (this.largest || 1));
    const { dofs } = this.app.result.content, { after } = chosen ?? dofs;
    fill(this.note, element("div", { class: "line-names" }, element("span", {}, `motion magnified ${short(magnified, 2)} times, grey: at rest`),
      element("span", { class: "line-name" }, chosen ? `${chosen.label} 0` : "0", this.ramp, `${short(chosen ? chosen.most : this.largest * dofs.factor, 4)}${after ?? ""}`), element("span", {}, `phase ${Math.round((360 * this.tau) / PERIOD)}°`),
      ...(shape.less ? [element("span", {}, shape.less)] : [])));
  }
}

function extentOf(nodes) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  nodes.forEach((value, i) => { low[i % 3] = Math.min(low[i % 3], value); high[i % 3] = Math.max(high[i % 3], value); });
  return { middle: low.map((value, i) => 0.5 * (value + high[i])), size: Math.hypot(...high.map((value, i) => value - low[i])) || 1 };
}

function largestOf(u) {
  let most = 0;
  for (let i = 0; i < u.length; i += 3) most = Math.max(most, Math.hypot(u[i], u[i + 1], u[i + 2]));
  return most;
}

/** Nodes on the screen: x, y in pixels and depth towards the eye; z of the model is up. */
function seen(nodes, u, magnified, { middle }, [yaw, pitch], scale, width, height) {
  const [a, b] = [yaw, pitch].map((angle) => (angle * Math.PI) / 180), [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
  const out = new Float64Array(nodes.length);
  for (let i = 0; i < nodes.length; i += 3) {
    const [x, y, z] = [0, 1, 2].map((k) => nodes[i + k] - middle[k] + (u ? magnified * u[i + k] : 0));
    const across = ca * x - sa * y, away = sa * x + ca * y;
    out[i] = 0.5 * width + scale * across;
    out[i + 1] = 0.5 * height - scale * (cb * z + sb * away);
    out[i + 2] = scale * (sb * z - cb * away);
  }
  return out;
}

/** Twice the area a triangle shows to the eye, positive where it looks at it; the screen's y points down. */
function facing(p, i, j, k) {
  const [ax, ay, bx, by] = [p[3 * j] - p[3 * i], p[3 * j + 1] - p[3 * i + 1], p[3 * k] - p[3 * i], p[3 * k + 1] - p[3 * i + 1]];
  return ay * bx - ax * by;
}

function triangle(ctx, p, corners) {
  corners.forEach((i, at) => ctx[at ? "lineTo" : "moveTo"](p[3 * i], p[3 * i + 1]));
  ctx.closePath();
}

/** Triangles that look at the eye. */
function seenOf(p, triangles) {
  const found = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const corners = triangles.subarray(t, t + 3);
    if (facing(p, ...corners) > 0) found.push(corners);
  }
  return found;
}

function outline(ctx, p, triangles) {
  ctx.beginPath();
  for (const corners of seenOf(p, triangles)) triangle(ctx, p, corners);
  ctx.globalAlpha = 0.35;
  ctx.fillStyle = colour("text-faint");
  ctx.fill();
  ctx.globalAlpha = 1;
}

/** Triangles from back to front, coloured by how much they move, lighter where they look at the eye. */
function faces(ctx, p, triangles, moved) {
  const drawn = seenOf(p, triangles), depth = ([i, j, k]) => p[3 * i + 2] + p[3 * j + 2] + p[3 * k + 2];
  drawn.sort((a, b) => depth(a) - depth(b));
  ctx.lineWidth = 0.6;
  for (const corners of drawn) {
    const [i, j, k] = corners, light = lightOf(p, i, j, k), [r, g, b] = rampAt((moved(i) + moved(j) + moved(k)) / 3).map((c) => Math.round(c * light));
    ctx.fillStyle = ctx.strokeStyle = `rgb(${r},${g},${b})`;
    ctx.beginPath();
    triangle(ctx, p, corners);
    ctx.fill();
    ctx.stroke();
  }
}

/** Brightness by the angle between the face and the eye. */
function lightOf(p, i, j, k) {
  const [a, b] = [j, k].map((n) => [p[3 * n] - p[3 * i], p[3 * n + 1] - p[3 * i + 1]]);
  const front = Math.abs(facing(p, i, j, k)), [da, db] = [j, k].map((n) => p[3 * n + 2] - p[3 * i + 2]);
  const side = Math.hypot(a[1] * db - b[1] * da, a[0] * db - b[0] * da);
  return 0.62 + 0.38 * (front / (Math.hypot(front, side) || 1));
}

function rampAt(part) {
  const at = Math.max(0, Math.min(1, part)) * (RAMP.length - 1), i = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[i].map((c, k) => c + (at - i) * (RAMP[i + 1][k] - c));
}

function rampOf() {
  const bar = element("svg:svg", { class: "ramp", "aria-hidden": "true" });
  for (let i = 0; i < 24; i++) {
    bar.append(element("svg:rect", { x: 5 * i, width: 5.5, height: 10, fill: `rgb(${rampAt(i / 23).map(Math.round)})` }));
  }
  return bar;
}
