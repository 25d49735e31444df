// Run inside the page by test_page.py: move the slider in every way and tell what moved.
const state = () => ({
  where: document.getElementById("where").textContent,
  picture: document.querySelector("#overlay image").getAttribute("href"),
  shownPicture: document.querySelector("#overlay image").style.display !== "none",
  edges: document.querySelector("#overlay path.edges").getAttribute("d"),
  profile: document.querySelector("#plot-profile path").getAttribute("d"),
  card: document.getElementById("card").textContent,
  marks: [...document.querySelectorAll(".now")].map((line) => line.getAttribute("x1")),
});
const slider = document.getElementById("slider");
const to = (i) => { slider.value = i; slider.dispatchEvent(new Event("input")); return state(); };
const out = { first: to(8), second: to(15), plots: document.querySelectorAll("#plot-kymograph svg, .plots:not(#confronted) svg[role=img]").length };
const key = (k) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key: k, bubbles: true }));
key("ArrowLeft"); out.left = slider.value; key("ArrowRight"); key("ArrowRight"); out.right = slider.value;
key("["); out.home = slider.value; key("]"); out.end = slider.value;
out.broken = to(5);
const plot = document.querySelector("#plot-diameter svg .pick"), box = plot.getBoundingClientRect();
plot.dispatchEvent(new PointerEvent("pointerdown", { clientX: box.left + box.width / 2, clientY: box.top + 5, bubbles: true }));
out.clicked = +slider.value;
document.querySelector("[data-shows=edges]").click();
out.hidden = document.querySelector("#overlay path.edges").style.display;
out.overflow = document.documentElement.scrollWidth - innerWidth;
out.unnamed = [...document.querySelectorAll("svg[role=img]")].filter((s) => !s.getAttribute("aria-label")).length;
out.confronted = document.querySelectorAll("#confronted rect, #confronted circle").length;
return out;
