"use strict";
// A small plot: axes with names and units, lines, bands, marks. Numbers that are null are gaps.
const SVG = "http://www.w3.org/2000/svg";

function svg(name, attributes, parent) {
  const node = document.createElementNS(SVG, name);
  for (const key in attributes) node.setAttribute(key, attributes[key]);
  if (parent) parent.appendChild(node);
  return node;
}

function html(name, attributes, parent, text) {
  const node = document.createElement(name);
  for (const key in attributes || {}) node.setAttribute(key, attributes[key]);
  if (text !== undefined) node.textContent = text;
  if (parent) parent.appendChild(node);
  return node;
}

const known = (v) => v !== null && v !== undefined && Number.isFinite(v);

function span(...lists) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) for (const v of list) if (known(v)) { low = Math.min(low, v); high = Math.max(high, v); }
  if (low > high) return [0, 1];
  if (low === high) { const room = Math.abs(low) * 0.1 || 0.5; return [low - room, high + room]; }
  const room = (high - low) * 0.06;
  return [low - room, high + room];
}

function ticks(low, high, about) {
  const raw = (high - low) / Math.max(about, 1), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
  const out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-9; v += step) out.push(v);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return out.map((v) => [v, v.toFixed(digits).replace(/^-0(\.0*)?$/, "0$1").replace("-", "\u2212")]);
}

class Plot {
  // spec: {name, x: {label, range}, y: {label, range}, height, layers: [...], pick: f(x)}
  constructor(host, spec) {
    this.host = host;
    this.spec = spec;
    this.marked = null;
    this.root = svg("svg", { role: "img", "aria-label": spec.name });
    host.appendChild(this.root);
    this.draw();
    let width = host.clientWidth;
    // On paper there is no width to ask for: a column of the page, or all of it.
    addEventListener("beforeprint", () => { this.paper = host.closest(".plots") ? 340 : 700; this.draw(); });
    addEventListener("afterprint", () => { this.paper = 0; this.draw(); });
    new ResizeObserver(() => {
      if (this.paper) return;
      if (Math.abs(host.clientWidth - width) > 1) { width = host.clientWidth; requestAnimationFrame(() => this.draw()); }
    }).observe(host);
  }

  draw() {
    const { spec, root } = this;
    root.replaceChildren();
    this.width = this.paper || Math.max(260, this.host.clientWidth || 640);
    this.height = spec.height || 250;
    let yTicks = ticks(...spec.y.range, this.height / 45);
    if (spec.y.whole) yTicks = yTicks.filter(([v]) => Number.isInteger(v)).map(([v]) => [v, String(v)]);
    const rows = (spec.layers || []).filter((l) => l.kind === "onset").map((l) => (l.row || 0) + 1);
    this.strip = rows.length ? 9 * Math.max(...rows) + 4 : 0;  // onsets lie below all data
    const widest = Math.max(...yTicks.map((t) => t[1].length), 2);
    this.box = { left: 30 + 7 * widest, right: this.width - (this.levels().length ? 54 : 12), top: 24, bottom: this.height - 40 };
    root.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.clip = `clip-${Plot.count = (Plot.count || 0) + 1}`;
    const clip = svg("clipPath", { id: this.clip }, svg("defs", {}, root));
    const { left, right, top, bottom } = this.box;
    svg("rect", { x: left, y: top, width: right - left, height: bottom - top }, clip);
    this.under = svg("g", { "clip-path": `url(#${this.clip})` }, root);
    this.drawAxes(yTicks);
    this.inside = svg("g", { "clip-path": `url(#${this.clip})` }, root);
    for (const layer of spec.layers || []) this["layer_" + layer.kind](layer);
    this.drawLevels();
    this.markGroup = svg("g", {}, root);
    if (spec.pick) this.drawPick();
    if (this.marked) this.mark(...this.marked);
  }

  px(x) { const [a, b] = this.spec.x.range; return this.box.left + ((x - a) / (b - a)) * (this.box.right - this.box.left); }
  py(y) { const [a, b] = this.spec.y.range, low = this.box.bottom - this.strip; return low - ((y - a) / (b - a)) * (low - this.box.top); }

  drawAxes(yTicks) {
    const { left, right, top, bottom } = this.box, root = this.root;
    for (const [v, text] of yTicks) {
      const y = this.py(v);
      svg("line", { x1: left, x2: right, y1: y, y2: y, class: "grid" }, root);
      svg("text", { x: left - 6, y: y + 4, "text-anchor": "end" }, root).textContent = text;
    }
    for (const [v, text] of ticks(...this.spec.x.range, (right - left) / 65)) {
      const x = this.px(v);
      svg("line", { x1: x, x2: x, y1: bottom, y2: bottom + 5, class: "frame" }, root);
      svg("text", { x, y: bottom + 18, "text-anchor": "middle" }, root).textContent = text;
    }
    svg("rect", { x: left, y: top, width: right - left, height: bottom - top, class: "frame" }, root);
    svg("text", { x: (left + right) / 2, y: this.height - 5, "text-anchor": "middle", class: "soft" }, root).textContent = this.spec.x.label;
    svg("text", { x: 4, y: 14, class: "soft" }, root).textContent = this.spec.y.label;
  }

  levels() { return (this.spec.layers || []).filter((l) => l.kind === "level" && l.label && known(l.y)); }

  // The names of levels stand right of the plot, each beside its line and none upon another.
  drawLevels() {
    const { right, top, bottom } = this.box;
    let last = Infinity;
    const seen = this.levels().map((l) => [this.py(l.y), l.label]).filter(([y]) => y >= top && y <= bottom);
    for (const [y, label] of seen.sort((a, b) => b[0] - a[0])) {
      last = Math.min(y + 4, last - 13);
      svg("text", { x: right + 4, y: last, class: "soft" }, this.root).textContent = label;
    }
  }

  drawPick() {
    const { left, right, top, bottom } = this.box;
    const area = svg("rect", { x: left, y: top, width: right - left, height: bottom - top, fill: "transparent", class: "pick" }, this.root);
    const at = (event) => {
      const where = this.root.getBoundingClientRect();
      const x = ((event.clientX - where.left) / where.width) * this.width;
      const [a, b] = this.spec.x.range;
      this.spec.pick(a + ((x - left) / (right - left)) * (b - a));
    };
    area.addEventListener("pointerdown", at);
    area.addEventListener("pointermove", (event) => { if (event.buttons) at(event); });
  }

  // A vertical line at x, and rings at the points [[x, y, colour], ...].
  mark(x, points) {
    this.marked = [x, points];
    this.markGroup.replaceChildren();
    if (known(x)) {
      const at = this.px(x);
      svg("line", { x1: at, x2: at, y1: this.box.top, y2: this.box.bottom, stroke: "var(--mark)", "stroke-width": 1.5, class: "now", "pointer-events": "none" }, this.markGroup);
    }
    for (const [px, py, colour] of points || [])
      if (known(px) && known(py))
        svg("circle", { cx: this.px(px), cy: this.py(py), r: 6, fill: "none", stroke: colour || "var(--mark)", "stroke-width": 2.5, "pointer-events": "none" }, this.markGroup);
  }

  layer_bands({ bands, opacity }) {
    const { top, bottom } = this.box;
    for (const [a, b, colour, name] of bands) {
      if (!known(a) || !known(b)) continue;
      const x = this.px(a), width = Math.max(0.5, this.px(b) - x);
      const place = { x, width, fill: colour };
      const rect = svg("rect", { ...place, y: top, height: bottom - top, style: `fill-opacity:${opacity || "var(--band)"}` }, this.under);
      svg("title", {}, rect).textContent = name;
      if (!opacity) svg("rect", { ...place, y: top, height: 5 }, this.under);
    }
  }

  layer_line({ x, y, colour, dash, wide }) {
    let d = "", pen = false;
    x.forEach((v, i) => {
      if (!known(v) || !known(y[i])) { pen = false; return; }
      d += `${pen ? "L" : "M"}${this.px(v).toFixed(1)} ${this.py(y[i]).toFixed(1)}`;
      pen = true;
    });
    svg("path", { d, fill: "none", stroke: colour, "stroke-width": wide || 1.8, "stroke-dasharray": dash || "", "stroke-linejoin": "round" }, this.inside);
  }

  // Two standard uncertainties: bars, or where they would touch a band.
  layer_ribbon({ x, y, sd, colour }) {
    if (x.length > 150) {
      const at = x.map((v, i) => i).filter((i) => known(x[i]) && known(y[i]) && known(sd[i]));
      const side = (sign) => (i) => `${this.px(x[i]).toFixed(1)} ${this.py(y[i] + sign * 2 * sd[i]).toFixed(1)}`;
      if (at.length > 1) svg("path", { d: `M${at.map(side(1)).join("L")}L${at.reverse().map(side(-1)).join("L")}Z`, fill: colour, opacity: 0.25 }, this.inside);
      return;
    }
    x.forEach((v, i) => {
      if (!known(v) || !known(y[i]) || !known(sd[i])) return;
      const at = this.px(v), low = this.py(y[i] - 2 * sd[i]), high = this.py(y[i] + 2 * sd[i]);
      svg("line", { x1: at, x2: at, y1: low, y2: high, stroke: colour, "stroke-width": 1.2, opacity: 0.65 }, this.inside);
    });
  }

  layer_points({ x, y, colour, hollow, square, squares }) {
    if (x.length > 300) return this.dots(x, y, colour, hollow);
    const r = 3;
    x.forEach((v, i) => {
      if (!known(v) || !known(y[i])) return;
      const look = { fill: hollow && hollow[i] ? "var(--panel)" : colour, stroke: colour, "stroke-width": 1.5, class: "data" };
      const cx = this.px(v), cy = this.py(y[i]);
      if (square || (squares && squares[i])) svg("rect", { x: cx - r, y: cy - r, width: 2 * r, height: 2 * r, ...look }, this.inside);
      else svg("circle", { cx, cy, r, ...look }, this.inside);
    });
  }

  // Many points as one path, flagged ones paler: a thousand circles would be slow.
  dots(x, y, colour, hollow) {
    for (const flagged of [false, true]) {
      let d = "";
      x.forEach((v, i) => {
        if (known(v) && known(y[i]) && Boolean(hollow && hollow[i]) === flagged) d += `M${this.px(v).toFixed(1)} ${this.py(y[i]).toFixed(1)}h0`;
      });
      if (d) svg("path", { d, stroke: colour, "stroke-width": 3, "stroke-linecap": "round", opacity: flagged ? 0.35 : 1 }, this.inside);
    }
  }

  layer_level({ y, colour, dash }) {
    if (!known(y)) return;
    const at = this.py(y), { left, right } = this.box;
    svg("line", { x1: left, x2: right, y1: at, y2: at, stroke: colour, "stroke-dasharray": dash || "6 4" }, this.inside);
  }

  // An onset: a triangle on the lower border, its interval as a bar.
  layer_onset({ turns, low, high, colour, name, row }) {
    const y = this.box.bottom - 5 - 9 * (row || 0);
    const group = svg("g", { class: "onset" }, this.inside);
    svg("title", {}, group).textContent = name;
    if (known(low) && known(high)) svg("line", { x1: this.px(low), x2: this.px(high), y1: y, y2: y, stroke: "var(--soft)", "stroke-width": 6, "stroke-linecap": "round" }, group);
    if (known(low) && known(high)) svg("line", { x1: this.px(low), x2: this.px(high), y1: y, y2: y, stroke: colour, "stroke-width": 4, "stroke-linecap": "round" }, group);
    if (known(turns)) {
      const x = this.px(turns);
      svg("path", { d: `M${x - 5} ${y + 5}h10l-5 -10z`, fill: colour, stroke: "var(--ink)", "stroke-width": 0.8 }, group);
    }
  }

  layer_image({ href, x, y }) {
    const left = this.px(x[0]), top = this.py(y[1]);
    svg("image", { href, x: left, y: top, width: this.px(x[1]) - left, height: this.py(y[0]) - top, preserveAspectRatio: "none", style: "image-rendering:pixelated" }, this.inside);
  }

  layer_boxes({ boxes, colour }) {
    for (const [x0, x1, y0, y1, name] of boxes) {
      if (this.px(x1) - this.px(x0) < 8) {  // close together: their ends along s alone
        for (const [colourOf, wide] of [["#000", 3], [colour, 1.5]])
          svg("path", { d: [y0, y1].map((y) => `M${this.px(x0)} ${this.py(y)}H${this.px(x1)}`).join(""), stroke: colourOf, "stroke-width": wide }, this.inside);
        continue;
      }
      const place = { x: this.px(x0), y: this.py(y1), width: Math.max(2, this.px(x1) - this.px(x0)), height: Math.max(2, this.py(y0) - this.py(y1)), fill: "none" };
      svg("rect", { ...place, stroke: "#000", "stroke-width": 3 }, this.inside);
      const rect = svg("rect", { ...place, stroke: colour, "stroke-width": 1.5 }, this.inside);
      svg("title", {}, rect).textContent = name;
    }
  }
}
