"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const X = data.x, S = data.series, unit = data.unit;
const byId = (id) => document.getElementById(id);
const words = (phase) => (phase || "").replaceAll("_", " ");
const xRange = tight(X);
const plots = [];  // {plot, values: f(position) -> [[x, y, colour], ...], x: f(position)}
let current = 0;

function tight(values) {
  const [low, high] = span(values), room = (high - low) * 0.06 / 1.12;
  return [low + room - (high - low) * 0.02, high - room + (high - low) * 0.02];
}

function bands() {
  return { kind: "bands", bands: data.bands.map(([a, b, phase]) => [a, b, data.phase_colours[phase] || "#999999", words(phase)]) };
}

function onsets() {
  const colours = { "overtwist": "overtwist", "local overtwist": "local_overtwist", "knots": "knotted", "irreversible knots": "irreversible" };
  if (data.x_label === "frame") return [];
  const seen = Object.entries(data.onsets).filter(([, o]) => o.status !== "not_observed" && (known(o.turns) || known(o.low)));
  return seen.map(([name, o], row) => ({
    kind: "onset", row, turns: o.status === "observed" ? o.turns : null,
    low: o.low, high: o.high,
    colour: data.phase_colours[colours[name]] || "#999999", name: `onset of ${name}`,
  }));
}

function against(id, name, label, layers, lists, values, floor, whole) {
  const host = byId(id);
  if (!host) return null;
  const range = span(...lists);
  if (floor !== undefined) range[0] = floor;
  range[0] -= (range[1] - range[0]) * 0.04;
  const plot = new Plot(host, {
    name, x: { label: data.x_label, range: xRange }, y: { label, range, whole },
    layers: [bands(), ...layers, ...onsets()], pick: (x) => show(nearest((at) => X[at], x)),
  });
  plots.push({ plot, x: (at) => X[at], values });
  return plot;
}

function nearest(place, x) {
  let best = current, away = Infinity;
  data.shown.forEach((frame, i) => {
    const d = Math.abs(place(frame.at) - x);
    if (d < away || (d === away && Math.abs(i - current) < Math.abs(best - current))) { away = d; best = i; }
  });
  return best;
}

function measuredLayers(y, sd, colour) {
  return [
    { kind: "ribbon", x: X, y, sd, colour }, { kind: "line", x: X, y, colour, wide: 1 },
    { kind: "points", x: X, y, colour, hollow: data.flagged, squares: data.unwinding },
  ];
}

const edge = (y, sd, sign) => y.map((v, i) => (known(v) ? v + sign * 2 * (known(sd[i]) ? sd[i] : 0) : null));

function drawSeries() {
  const one = (key, colour) => (at) => [[X[at], S[key][at], colour]];
  against("plot-diameter", "outer diameter against turns", `outer diameter D (${unit})`,
    measuredLayers(S.diameter, S.diameter_sd, "var(--series)"),
    [edge(S.diameter, S.diameter_sd, 1), edge(S.diameter, S.diameter_sd, -1)], one("diameter"));
  against("plot-angle", "helix angle against turns", "helix angle β (°)",
    measuredLayers(S.angle, S.angle_sd, "var(--series)"),
    [edge(S.angle, S.angle_sd, 1), edge(S.angle, S.angle_sd, -1)], one("angle"));
  against("plot-knots", "number of knots against turns", "knots in view (count)", [
    { kind: "line", x: X, y: S.knots, colour: "var(--knots)", wide: 1 },
    { kind: "points", x: X, y: S.knots, colour: "var(--knots)", hollow: data.flagged, squares: data.unwinding },
  ], [S.knots, [0, 1.2]], one("knots"), 0, true);
  against("plot-phase", "coil amplitude and unevenness against turns", "share (1)", [
    { kind: "line", x: X, y: S.coil, colour: "var(--series)" }, { kind: "points", x: X, y: S.coil, colour: "var(--series)" },
    { kind: "line", x: X, y: S.unevenness, colour: "var(--second)", dash: "5 3" },
    { kind: "points", x: X, y: S.unevenness, colour: "var(--second)", square: true },
    { kind: "level", y: 0.05, label: "", colour: "var(--series)" },
    { kind: "level", y: 0.08, label: "", colour: "var(--second)" },
  ], [S.coil, S.unevenness, [0, 0.1]], (at) => [[X[at], S.coil[at]], [X[at], S.unevenness[at]]], 0);
  for (const [key, label] of [["turn_budget", "turns seen − motor turns (turns)"], ["string_budget", "string seen − L − displacement (mm)"]])
    against(`plot-${key}`, label, label,
      [{ kind: "level", y: 0, label: "", colour: "var(--soft)", dash: "1 0" }, ...measuredLayers(S[key], S[key + "_sd"], "var(--series)")],
      [[0], edge(S[key], S[key + "_sd"], 1), edge(S[key], S[key + "_sd"], -1)], one(key));
  drawDisplacement();
}

const MODEL_COLOURS = ["var(--second)", "var(--separator)", "var(--near)", "var(--knots)", "var(--soft)"];
const MODEL_DASHES = ["", "7 3", "2 3", "9 3 2 3"];
const modelLook = (i) => [MODEL_COLOURS[i % MODEL_COLOURS.length], MODEL_DASHES[i % MODEL_DASHES.length]];

// Every model on the shelf that the rig allows; the paper's and the best are shown at first.
function drawDisplacement() {
  const x = S.displacement;
  if (!byId("plot-displacement")) return;
  const models = Object.entries(data.predicted).map(([title, y], i) => {
    const rest = x.map((v, k) => (known(v) && known(y[k]) ? v - y[k] : null)), sure = rest.filter(known);
    const rmse = sure.length ? Math.sqrt(sure.reduce((sum, r) => sum + r * r, 0) / sure.length) : Infinity;
    return { title, y, rest, rmse, count: sure.length, look: modelLook(i), on: i === 0 };
  });
  // A model without a value for some turns cannot be the best of those that have one.
  const most = Math.max(0, ...models.map((m) => m.count)), whole = models.filter((m) => m.count === most);
  const best = whole.reduce((a, b) => (b.rmse < a.rmse ? b : a), whole[0]);
  if (best) best.on = true;
  const points = { kind: "points", x: X, y: x, colour: "var(--series)", hollow: data.flagged, squares: data.unwinding };
  const zero = { kind: "level", y: 0, label: "", colour: "var(--soft)", dash: "1 0" };
  const seen = () => models.filter((m) => m.on);
  const line = (m, y) => ({ kind: "line", x: X, y, colour: m.look[0], dash: m.look[1] });
  const dots = (m) => ({ kind: "points", x: X, y: m.rest, colour: m.look[0] });
  const both = [
    against("plot-displacement", "measured and predicted displacement", "displacement (mm)", [],
      [near(x, models.flatMap((m) => m.y), x)], (at) => [[X[at], x[at]]]),
    against("plot-residual", "measured minus predicted displacement", "measured − predicted (mm)", [],
      [near([0], models.flatMap((m) => m.rest), x)], (at) => seen().map((m) => [X[at], m.rest[at]])),
  ];
  const fill = () => {
    const layers = [
      [...seen().map((m) => line(m, m.y)), points],
      [zero, ...seen().flatMap((m) => [line(m, m.rest), dots(m)])],
    ];
    both.forEach((plot, i) => { plot.spec.layers = [bands(), ...layers[i], ...onsets()]; plot.draw(); });
  };
  const legend = byId("legend-models");
  legendItem(legend, "var(--series)", "measured (hollow: flagged)");
  for (const m of models) {
    const label = legendItem(legend, m.look[0], `${m.title}: ${errorText(m, most)}`, m.look[1], "label");
    const box = html("input", { type: "checkbox" });
    box.checked = m.on;
    box.addEventListener("change", () => { m.on = box.checked; fill(); });
    label.prepend(box);
  }
  fill();
}

function legendItem(host, colour, text, dash, kind) {
  const item = html(kind || "span", {}, host), line = svg("svg", { viewBox: "0 0 24 6", style: "width:24px;height:6px;flex:none" }, item);
  svg("line", { x1: 0, x2: 24, y1: 3, y2: 3, stroke: colour, "stroke-width": 3, "stroke-dasharray": dash || "" }, line);
  html("span", {}, item, text);
  return item;
}

function errorText(m, most) {
  if (!m.count) return "no value here";
  const digits = m.rmse < 1 ? 2 : m.rmse < 10 ? 1 : 0;
  return `${m.rmse.toFixed(digits)} mm RMSE` + (m.count < most ? ` over the ${m.count} of ${most} frames where it has a value` : "");
}

// A model may run far away; the plot shows it no farther than the measured values' own span.
function near(sure, others, measured) {
  const [low, high] = span(sure), [a, b] = span(measured), reach = b - a;
  const [from, to] = span(sure, others);
  return [Math.max(from, low - reach), Math.min(to, high + reach)];
}

function drawKymograph() {
  const map = data.kymograph, host = byId("plot-kymograph");
  if (!map || !host) return;
  const place = map.by_frame ? (at) => data.frames[at] : (at) => X[at];
  const step = (map.x[1] - map.x[0]) / Math.max(X.length - 1, 1) / 2;
  const boxes = map.knots.filter((k) => known(k[0]) && known(k[1]) && known(k[2])).map(([x, s, length, d]) =>
    [Math.max(x - step * 0.7, map.x[0]), Math.min(x + step * 0.7, map.x[1]), s - length / 2, s + length / 2, `knot at ${s.toFixed(2)} mm, largest diameter ${known(d) ? d.toFixed(3) : "?"} mm`]);
  const plot = new Plot(host, {
    name: "envelope against turns and position", height: 340,
    x: { label: map.x_label, range: map.by_frame ? map.x : xRange },
    y: { label: `position s from the separator (${unit})`, range: map.s },
    layers: [{ kind: "image", href: map.href, x: map.x, y: map.s }, { kind: "boxes", boxes, colour: "#F07A2B" }],
    pick: (x) => show(nearest(place, x)),
  });
  plots.push({ plot, x: place, values: () => [] });
  const bar = byId("bar");
  html("span", {}, bar, `${unit === "mm" ? "E(s)" : "w(s)"} from ${map.value[0].toFixed(2)}`);
  html("img", { src: map.bar, alt: "", style: "width:8rem;height:.7rem" }, bar);
  html("span", {}, bar, `to ${map.value[1].toFixed(2)} ${unit}`);
}

// What the verdict leaves: measured minus base and minus extended model, one plot an observable.
function drawConfronted() {
  const host = byId("confronted");
  if (!host) return;
  for (const { name, unit: of, turns, base, extended } of data.confronted) {
    const figure = html("figure", {}, host);
    html("h3", {}, figure, `Residual of the ${name}`);
    html("figcaption", {}, figure, "Measured minus model, before and after the causes are put in.");
    new Plot(html("div", {}, figure), {
      name: `residual of the ${name}`, x: { label: "motor turns", range: tight(turns) },
      y: { label: `measured − model${of ? ` (${of})` : ""}`, range: span([0], base, extended) },
      layers: [
        { kind: "level", y: 0, label: "", colour: "var(--soft)", dash: "1 0" },
        { kind: "points", x: turns, y: base, colour: "var(--second)", square: true },
        { kind: "points", x: turns, y: extended, colour: "var(--series)" },
      ],
    });
    const legend = html("div", { class: "legend" }, figure);
    legendItem(legend, "var(--second)", "base model (squares)");
    legendItem(legend, "var(--series)", "extended (dots)");
  }
}

let profilePlot = null;
function drawProfile(frame) {
  const all = data.shown.flatMap((f) => [...f.profile.w, ...f.profile.e]);
  const places = data.shown.flatMap((f) => f.profile.s);
  const p = frame.profile, d = p.diameter, layers = [];
  layers.push({ kind: "bands", opacity: 0.14, bands: [[...p.near, "var(--near)", "near-separator region"]] });
  layers.push({ kind: "bands", opacity: 0.2, bands: p.knots.map(([s, l]) => [s - l / 2, s + l / 2, "var(--knots)", "knot"]) });
  layers.push({ kind: "line", x: p.s, y: p.w, colour: "var(--series)", wide: 1.2 });
  layers.push({ kind: "line", x: p.s, y: p.e, colour: "var(--envelope)", wide: 2.2 });
  layers.push({ kind: "level", y: d, label: "D", colour: "var(--soft)" });
  if (known(d)) layers.push({ kind: "level", y: 1.4 * d, label: "1.40 D", colour: "var(--knots)" });
  if (known(p.baseline)) layers.push({ kind: "level", y: 1.15 * p.baseline, label: "1.15 E₀", colour: "var(--envelope)" });
  const spec = {
    name: "width and envelope along the bundle", height: 260, layers,
    x: { label: `position s from the separator (${unit})`, range: tight(places) },
    y: { label: `width (${unit})`, range: [0, span(all, data.shown.map((f) => f.profile.diameter * 1.4))[1]] },
  };
  if (!profilePlot) profilePlot = new Plot(byId("plot-profile"), spec);
  else { profilePlot.spec = spec; profilePlot.draw(); }
}

function drawOverlay(frame) {
  const root = byId("overlay"), [x, y, w, h] = frame.view;
  root.setAttribute("viewBox", `${x} ${y} ${w} ${h}`);
  root.classList.toggle("empty", !frame.picture);
  const image = root.querySelector("image");
  const p = frame.picture || { href: "data:,", x, y, width: 1, height: 1 };
  if (frame.picture) { for (const key in p) image.setAttribute(key, p[key]); image.style.display = ""; }
  else image.style.display = "none";
  for (const path of root.querySelectorAll("path"))
    path.setAttribute("d", path.dataset.lines.split(" ").map((k) => frame.paths[k] || "").join("") || "M0 0");
  byId("problem").textContent = frame.picture ? "" : `No picture: ${frame.problem || "it could not be read"}.`;
}

function drawCard(frame) {
  const body = byId("card");
  body.replaceChildren();
  for (const [label, text] of frame.card) {
    const line = html("tr", {}, body);
    html("th", { scope: "row" }, line, label);
    html("td", { class: "word" }, line, text);
  }
  if (frame.flags.length) {
    const line = html("tr", {}, body);
    html("th", { scope: "row" }, line, "flags");
    html("td", { class: "word" }, line, frame.flags.join(", "));
  }
}

function show(index) {
  current = Math.min(Math.max(index, 0), data.shown.length - 1);
  const frame = data.shown[current], at = frame.at;
  byId("slider").value = current;
  const turns = data.x_label === "frame" ? "" : known(X[at]) ? `${+X[at].toFixed(2)} turns` : "turns unknown";
  const text = [turns, `frame ${frame.frame}`, words(data.phases[at])].filter(Boolean).join(" · ");
  byId("where").textContent = text;
  byId("slider").setAttribute("aria-valuetext", text);
  drawOverlay(frame);
  drawProfile(frame);
  drawCard(frame);
  for (const { plot, x, values } of plots) plot.mark(x(at), values(at));
}

let timer = null;
function play() {
  const button = byId("play");
  if (timer) { clearInterval(timer); timer = null; button.textContent = "▶"; button.setAttribute("aria-label", "play"); return; }
  button.textContent = "❚❚"; button.setAttribute("aria-label", "pause");
  if (current === data.shown.length - 1) show(0);
  timer = setInterval(() => { if (current === data.shown.length - 1) play(); else show(current + 1); }, 300);
}

function listen() {
  const slider = byId("slider");
  slider.max = data.shown.length - 1;
  slider.addEventListener("input", () => show(+slider.value));
  byId("back").addEventListener("click", () => show(current - 1));
  byId("next").addEventListener("click", () => show(current + 1));
  byId("play").addEventListener("click", play);
  for (const box of document.querySelectorAll("[data-shows]"))
    box.addEventListener("change", () => {
      for (const path of byId("overlay").querySelectorAll(`.${box.dataset.shows}`)) path.style.display = box.checked ? "" : "none";
    });
  byId("large").addEventListener("change", () => byId("overlay").classList.toggle("large", byId("large").checked));
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, button, summary, a")) return;
    if (event.key === " ") { event.preventDefault(); play(); }
    else if (event.key === "ArrowLeft") { event.preventDefault(); show(current - 1); }
    else if (event.key === "ArrowRight") { event.preventDefault(); show(current + 1); }
    else if (event.key === "[") show(0);
    else if (event.key === "]") show(data.shown.length - 1);
  });
}

if (data.shown.length) {
  drawSeries();
  drawKymograph();
  drawConfronted();
  listen();
  show(data.start);
}
