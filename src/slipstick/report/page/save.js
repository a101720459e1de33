// Any chart as PNG, SVG or CSV: a small menu in its corner.

/** The menu of a chart: `kinds` names what makes each file, `{ PNG: () => blob, SVG: () => text, CSV: () => text }`, perhaps later. */
function saver(host, name, kinds) {
  const types = { PNG: "image/png", SVG: "image/svg+xml", CSV: "text/csv" };
  const keep = async (kind) => {
    const made = await kinds[kind](), blob = made instanceof Blob ? made : new Blob([made], { type: types[kind] });
    const link = element("a", { href: URL.createObjectURL(blob), download: `${name().replace(/[^\w.,=+-]+/g, "_").replace(/^_+|_+$/g, "") || "chart"}.${kind.toLowerCase()}` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  };
  const buttons = Object.keys(kinds).map((kind) => element("button", { type: "button", class: "plain", onclick: () => keep(kind) }, kind));
  const menu = element("details", { class: "save" }, element("summary", { "aria-label": "Save this chart", title: "Save this chart" }, "save"), element("span", {}, ...buttons));
  host.querySelector(":scope > .save")?.remove();
  host.append(menu);
}

/** Rows of texts and numbers as CSV. */
function csvOf(rows) {
  const cell = (value) => (typeof value === "number" ? String(value) : /[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value);
  return `${rows.map((row) => row.map(cell).join(",")).join("\n")}\n`;
}

/** A canvas on the colour of the card. */
function pngOfCanvas(canvas) {
  const paper = element("canvas", { width: canvas.width, height: canvas.height }), ctx = paper.getContext("2d");
  ctx.fillStyle = colour("card");
  ctx.fillRect(0, 0, paper.width, paper.height);
  ctx.drawImage(canvas, 0, 0);
  return new Promise((done) => paper.toBlob(done, "image/png"));
}

const SAVED_STYLE = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "opacity", "font-size", "font-family", "font-weight", "text-anchor", "display"];

/** A drawing with the style it has on the page as attributes, since the page allows no style within elements; the card behind it. */
function svgOfDrawing(drawing) {
  const copy = drawing.cloneNode(true), { width, height } = drawing.getBoundingClientRect();
  const [from, to] = [drawing, copy].map((own) => [own, ...own.querySelectorAll("*")]);
  to.forEach((node, i) => {
    const style = getComputedStyle(from[i]);
    for (const key of SAVED_STYLE) node.setAttribute(key, style.getPropertyValue(key));
  });
  copy.setAttribute("xmlns", SVG);
  if (!copy.hasAttribute("viewBox")) copy.setAttribute("viewBox", `0 0 ${width} ${height}`);
  copy.setAttribute("width", width);
  copy.setAttribute("height", height);
  copy.prepend(element("svg:rect", { width: "100%", height: "100%", fill: colour("card") }));
  return new XMLSerializer().serializeToString(copy);
}

/** The same as PNG, twice as fine. */
async function pngOfDrawing(text) {
  const picture = new Image();
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  await picture.decode();
  const paper = element("canvas", { width: 2 * picture.width, height: 2 * picture.height });
  paper.getContext("2d").drawImage(picture, 0, 0, paper.width, paper.height);
  return new Promise((done) => paper.toBlob(done, "image/png"));
}

/** A chart as a drawing: the same axes, lines, bars and rings. */
function svgOfChart(plot, { x, y, lines }, [xTicks, yTicks]) {
  const { left, top, width, height } = plot.over.getBoundingClientRect(), outer = plot.root.getBoundingClientRect();
  const [l, t] = [left - outer.left, top - outer.top], at = (v, axis) => plot.valToPos(v, axis);
  const drawing = element("svg:svg", { xmlns: SVG, viewBox: `0 0 ${outer.width} ${outer.height}`, width: outer.width, height: outer.height, "font-family": "sans-serif", "font-size": 12 },
    element("svg:rect", { width: "100%", height: "100%", fill: colour("card") }));
  const inside = element("svg:svg", { x: l, y: t, width, height });
  for (const [value, text] of xTicks) {
    inside.append(element("svg:line", { x1: at(value, "x"), x2: at(value, "x"), y1: 0, y2: height, stroke: colour("grid") }));
    drawing.append(element("svg:text", { x: l + at(value, "x"), y: t + height + 17, "text-anchor": "middle", fill: colour("text-soft") }, text));
  }
  for (const [value, text] of yTicks) {
    inside.append(element("svg:line", { x1: 0, x2: width, y1: at(value, "y"), y2: at(value, "y"), stroke: colour("grid") }));
    drawing.append(element("svg:text", { x: l - 7, y: t + at(value, "y") + 4, "text-anchor": "end", fill: colour("text-soft") }, text));
  }
  for (const line of lines) inside.append(...shapesOf(line, at, height));
  drawing.append(inside, element("svg:rect", { x: l, y: t, width, height, fill: "none", stroke: colour("edge") }),
    element("svg:text", { x: l + width / 2, y: outer.height - 6, "text-anchor": "middle", fill: colour("text-soft") }, x.said),
    element("svg:text", { "text-anchor": "middle", fill: colour("text-soft"), transform: `translate(13 ${t + height / 2}) rotate(-90)` }, y.said));
  return new XMLSerializer().serializeToString(drawing);
}

function shapesOf(line, at, height) {
  const places = Array.from(line.x, (x, i) => [at(x, "x"), at(line.y[i], "y")]), seen = ([a, b]) => Number.isFinite(a) && Number.isFinite(b);
  if (line.kind === "bars") {
    const ground = Math.min(height, at(0, "y") || height);
    return Array.from(line.x, (x, i) => [x, places[i][1]]).filter(([, b]) => Number.isFinite(b)).map(([x, b]) => {
      const [from, to] = [at(x - line.half, "x"), at(x + line.half, "x")];
      return element("svg:rect", { x: from, width: to - from, y: Math.min(b, ground), height: Math.abs(ground - b), fill: line.fill });
    });
  }
  if (line.kind === "rings") return places.filter(seen).map(([cx, cy]) => element("svg:circle", { cx, cy, r: 3.6, fill: line.fill, stroke: line.stroke, "stroke-width": line.width }));
  const path = stepsOf(places, line).map(([step, ...numbers]) => `${step}${numbers.map((v) => v.toFixed(2)).join(" ")}`).join("");
  const shapes = [element("svg:path", { d: path, fill: "none", stroke: line.stroke, "stroke-width": line.width ?? 1.8, "stroke-dasharray": line.dash?.join(" ") })];
  for (const head of arrowHeads(line, (v, axis) => at(v, axis), 1)) shapes.push(element("svg:path", { d: `M${head.map((p) => p.join(" ")).join("L")}Z`, fill: line.stroke }));
  return shapes;
}
