"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const SVG = "http://www.w3.org/2000/svg", byId = (id) => document.getElementById(id);
const view = byId("view"), form = byId("form"), { width: W, height: H } = data.picture;
const image = view.querySelector("image"), frame = byId("frame"), slide = byId("slide");
const start = data.fields;

// Handles in the frame's own pixels: two corners of the region, two ends of the ruler, and the
// axis from the separator's face to the motor's connector.
const roi = start["view.roi_px"] || [Math.round(W * 0.04), Math.round(H * 0.1), Math.round(W * 0.92), Math.round(H * 0.8)];
const axis = start["view.axis_px"] || [[W * 0.15, H * 0.5], [W * 0.85, H * 0.5]];
const points = start["camera.points_px"] || [[W * 0.3, H * 0.9], [W * 0.7, H * 0.9]];
const handles = {
  "region, top left": { x: roi[0], y: roi[1], colour: "#F0E442" },
  "region, bottom right": { x: roi[0] + roi[2], y: roi[1] + roi[3], colour: "#F0E442" },
  "axis, at the separator's face": { x: axis[0][0], y: axis[0][1], colour: "#CC79A7" },
  "axis, at the connector": { x: axis[1][0], y: axis[1][1], colour: "#CC79A7" },
  "ruler, one end": { x: points[0][0], y: points[0][1], colour: "#ffffff" },
  "ruler, other end": { x: points[1][0], y: points[1][1], colour: "#ffffff" },
};
const [A, B, F, C, P, Q] = Object.values(handles);

function region() {
  const x = Math.round(Math.min(A.x, B.x)), y = Math.round(Math.min(A.y, B.y));
  return [x, y, Math.max(1, Math.round(Math.abs(A.x - B.x))), Math.max(1, Math.round(Math.abs(A.y - B.y)))];
}

const scaleKind = () => form.elements.scale.value;
const number = (text) => Number(String(text).trim().replace(",", "."));

// The fields as rig.toml has them; what is empty is unknown.
function fields() {
  const out = {};
  for (const key in start)
    if (!key.startsWith("view.") && !/^camera\.(mm_per_px|mm_per_px_sd|scale_from|length_mm|points_px|board)$/.test(key)) out[key] = start[key];
  for (const input of form.elements)
    if (/^(strings|actuator)\./.test(input.name)) out[input.name] = input.value.trim();
  out["view.separator_side"] = form.elements["view.separator_side"].value;
  if (byId("use-region").checked) out["view.roi_px"] = region();
  const tenths = (...ends) => ends.map((p) => [p.x, p.y].map((v) => Math.round(v * 10) / 10));
  if (byId("use-axis").checked) out["view.axis_px"] = tenths(F, C);
  const kind = scaleKind();
  if (kind === "given") {
    out["camera.mm_per_px"] = form.elements["camera.mm_per_px"].value.trim();
    if (out["camera.mm_per_px"] === String(start["camera.mm_per_px"])) out["camera.mm_per_px_sd"] = start["camera.mm_per_px_sd"];
  }
  if (kind === "hole_distance") out["camera.scale_from"] = kind;
  if (kind === "length") {
    out["camera.scale_from"] = kind;
    out["camera.length_mm"] = form.elements["camera.length_mm"].value.trim();
    out["camera.points_px"] = tenths(P, Q);
  }
  if (kind === "kept")
    for (const key of ["camera.scale_from", "camera.board", "camera.length_mm", "camera.points_px"]) out[key] = start[key];
  return out;
}

function draw() {
  const [x, y, w, h] = region(), rect = byId("region");
  const on = byId("use-region").checked;
  for (const [key, value] of Object.entries({ x, y, width: w, height: h })) rect.setAttribute(key, value);
  byId("shade").setAttribute("d", on ? `M${-1} ${-1}H${W}V${H}H-1ZM${x} ${y}v${h}h${w}v${-h}Z` : "");
  rect.style.opacity = on ? 1 : 0.45;
  for (const [id, from, to] of [["ruler", P, Q], ["axis", F, C]])
    for (const line of byId(id).children)
      for (const [key, value] of Object.entries({ x1: from.x, y1: from.y, x2: to.x, y2: to.y })) line.setAttribute(key, value);
  byId("axis").style.opacity = byId("use-axis").checked ? 1 : 0.3;
  byId("ruler").style.opacity = scaleKind() === "length" ? 1 : 0.45;
  for (const h of Object.values(handles)) { h.node.setAttribute("cx", h.x); h.node.setAttribute("cy", h.y); }
  const px = Math.hypot(P.x - Q.x, P.y - Q.y), mm = number(form.elements["camera.length_mm"].value);
  byId("scale-text").textContent = scaleKind() !== "length" ? "" : `The ruler spans ${px.toFixed(1)} px` + (mm > 0 ? `: ${(mm / px).toPrecision(4)} mm per px.` : ".");
}

function place(event) {
  const where = view.getBoundingClientRect();
  return [((event.clientX - where.left) / where.width) * W - 0.5, ((event.clientY - where.top) / where.height) * H - 0.5];
}

function move(handle, x, y) {
  handle.x = Math.min(Math.max(x, 0), W - 1);
  handle.y = Math.min(Math.max(y, 0), H - 1);
  if (handle === A || handle === B) byId("use-region").checked = true;
  else if (handle === F || handle === C) byId("use-axis").checked = true;
  else form.elements.scale.value = "length";
  draw();
}

function makeHandles() {
  const size = () => { for (const h of Object.values(handles)) h.node.setAttribute("r", (11 * W) / Math.max(view.clientWidth, 200)); };
  for (const [name, handle] of Object.entries(handles)) {
    const node = document.createElementNS(SVG, "circle");
    for (const [key, value] of Object.entries({ fill: handle.colour, "fill-opacity": 0.75, tabindex: 0, role: "slider", "aria-label": name })) node.setAttribute(key, value);
    node.addEventListener("pointerdown", (event) => { node.setPointerCapture(event.pointerId); node.focus(); });
    node.addEventListener("pointermove", (event) => { if (node.hasPointerCapture(event.pointerId)) move(handle, ...place(event)); });
    node.addEventListener("keydown", (event) => {
      const step = event.shiftKey ? 10 : 1;
      const by = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
      if (by) { event.preventDefault(); move(handle, handle.x + by[0], handle.y + by[1]); }
    });
    handle.node = node;
    byId("handles").appendChild(node);
  }
  size();
  new ResizeObserver(() => requestAnimationFrame(size)).observe(view);
}

async function post(name) {
  const sent = { ...fields(), frame: shown };
  const reply = await fetch(name, { method: "POST", body: JSON.stringify(sent) });
  if (!reply.ok) throw new Error("the program did not answer; is it still running?");
  return reply.json();
}

let shown = data.picture.frame;

function show(picture) {
  shown = picture.frame;
  image.setAttribute("href", picture.href);
  byId("file").textContent = `of 0 to ${data.frames - 1}: ${picture.file}`;
  frame.value = slide.value = shown;
}

// Another frame: the picture first, then what is found in it.
async function choose(number) {
  if (!Number.isInteger(number) || number === shown) return;
  const before = shown;
  shown = number;
  try {
    const picture = await post("frame");
    if (!picture.problem && picture.width === W && picture.height === H) { show(picture); return await look(); }
    shown = before;
    say(picture.problem || "That frame is of another size.");
  } catch (problem) { shown = before; say(problem.message); }
  frame.value = slide.value = shown;
}

function say(text) { byId("message").textContent = text; }

async function look() {
  say("Looking …");
  byId("try").disabled = true;
  try {
    const found = await post("try");
    if (found.problem) return say(found.problem);
    for (const path of view.querySelectorAll("path[data-lines]"))
      path.setAttribute("d", path.dataset.lines.split(" ").map((k) => found.paths[k] || "").join("") || "M0 0");
    const body = byId("card");
    body.replaceChildren();
    for (const [label, text] of [...found.card, ...(found.flags.length ? [["flags", found.flags.join(", ")]] : [])]) {
      const line = body.insertRow();
      line.insertCell().textContent = label;
      line.insertCell().textContent = text;
      for (const cell of line.cells) cell.className = "word";
    }
    // What was found is where a person's hand begins, unless the person has been there already.
    const [face, far] = found.axis;
    if (face && far && !byId("use-axis").checked) { [F.x, F.y] = face; [C.x, C.y] = inside(face, far); }
    draw();
    say(found.found ? "Found; is it right?" : "No bundle was found: choose a frame in which the strings are twisted, draw the region around it, or name the separator's side.");
  } catch (problem) { say(problem.message); }
  finally { byId("try").disabled = false; }
}

// The found line may end outside the picture; its handle must not.
function inside([x0, y0], [x1, y1]) {
  let t = 1;
  for (const [from, to, most] of [[x0, x1, W - 1], [y0, y1, H - 1]])
    if (to > most) t = Math.min(t, (most - from) / (to - from));
    else if (to < 0) t = Math.min(t, from / (from - to));
  return [x0 + t * (x1 - x0), y0 + t * (y1 - y0)];
}

async function save(event) {
  event.preventDefault();
  try {
    const done = await post("save");
    if (done.problem) return say(done.problem);
    say(`Saved to ${done.saved}. You can close this page.`);
    for (const button of document.querySelectorAll("button")) button.disabled = true;
  } catch (problem) { say(problem.message); }
}

function fill() {
  for (const key in start) { const input = form.elements[key]; if (input && !(input instanceof RadioNodeList)) input.value = start[key]; }
  byId("use-region").checked = "view.roi_px" in start;
  byId("use-axis").checked = "view.axis_px" in start;
  const from = start["camera.scale_from"];
  let kind = "camera.mm_per_px" in start ? "given" : from === "hole_distance" ? from : from === "length" && start["camera.points_px"] ? "length" : "none";
  if (from && kind === "none") {
    const label = document.createElement("label"), radio = document.createElement("input");
    Object.assign(radio, { type: "radio", name: "scale", value: "kept" });
    label.append(radio, ` as rig.toml says: ${from}`);
    byId("scale-text").before(label);
    kind = "kept";
  }
  form.elements.scale.value = kind;
}

view.setAttribute("viewBox", `-0.5 -0.5 ${W} ${H}`);
for (const [key, value] of Object.entries({ x: -0.5, y: -0.5, width: W, height: H })) image.setAttribute(key, value);
frame.max = slide.max = data.frames - 1;
show(data.picture);
byId("frames").hidden = data.frames < 2;
frame.addEventListener("change", () => choose(frame.valueAsNumber));
slide.addEventListener("change", () => choose(slide.valueAsNumber));
makeHandles();
fill();
draw();
form.addEventListener("input", draw);
form.addEventListener("submit", save);
byId("try").addEventListener("click", look);
look();
