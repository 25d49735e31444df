"use strict";
// Lines of many recordings: colour and dash together tell them apart; a row picks its line out.
const runs = JSON.parse(document.getElementById("data").textContent).recordings;
const COLOURS = ["var(--series)", "var(--knots)", "var(--near)", "var(--separator)", "var(--second)", "var(--soft)"];
const DASHES = ["", "7 3", "2 3", "9 3 2 3"];
const look = (i) => ({ colour: COLOURS[i % COLOURS.length], dash: DASHES[Math.floor(i / COLOURS.length) % DASHES.length] });

function layers(key, picked) {
  const order = runs.map((_, i) => i).filter((i) => i !== picked);
  if (picked !== null) order.push(picked);
  return order.map((i) => {
    const faint = picked !== null && i !== picked;
    const { colour, dash } = look(i);
    return { kind: "line", x: runs[i].x, y: runs[i][key], dash, wide: i === picked ? 3.5 : 1.6, colour: faint ? "var(--line)" : colour };
  });
}

const all = (key) => runs.flatMap((r) => (r.x.length ? r[key] : []));
const plots = [["diameter", "outer diameter D (mm)"], ["angle", "helix angle β (°)"]].map(([key, label]) => {
  const plot = new Plot(document.getElementById("plot-" + key), {
    name: label + " against turns, one line a recording",
    x: { label: "motor turns", range: span(runs.flatMap((r) => r.x)) },
    y: { label, range: span(all(key)) }, layers: layers(key, null),
  });
  return { key, plot };
});

function pick(i) {
  for (const { key, plot } of plots) { plot.spec.layers = layers(key, i); plot.draw(); }
}

document.querySelectorAll("tr[data-row]").forEach((row) => {
  const i = +row.dataset.row, { colour, dash } = look(i);
  svg("line", { x1: 1, x2: 25, y1: 4, y2: 4, stroke: colour, "stroke-width": 3, "stroke-dasharray": dash }, row.querySelector(".swatch"));
  for (const event of ["pointerenter", "focusin"]) row.addEventListener(event, () => pick(i));
  for (const event of ["pointerleave", "focusout"]) row.addEventListener(event, () => pick(null));
});
