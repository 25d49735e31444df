// What lies upon what: pairs of texts of one plot that overlap, texts that leave their plot, blocks
// that overlap, plots without the name of an axis, onset marks that reach into the data.
const out = { texts: [], outside: [], blocks: [], unnamed: [], marks: [], seen: [0, 0, 0] };
const shown = (e) => !e.closest("details:not([open])");
const boxes = (list) => [...list].filter(shown).map((e) => [e, e.getBoundingClientRect()]).filter(([, b]) => b.width > 0 && b.height > 0);
const meet = (a, b, by = 1.5) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > by && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > by;
for (const plot of document.querySelectorAll("figure div > svg[role=img]:not(#overlay)")) {
  const name = plot.getAttribute("aria-label"), whole = plot.getBoundingClientRect();
  if (!whole.width) continue;
  const texts = boxes(plot.querySelectorAll("text"));
  texts.forEach(([a, box], i) => {
    if (box.left < whole.left - 1 || box.right > whole.right + 1 || box.bottom > whole.bottom + 1) out.outside.push(`${name}: ${a.textContent}`);
    for (const [b, other] of texts.slice(i + 1)) if (meet(box, other)) out.texts.push(`${name}: ${a.textContent} | ${b.textContent}`);
  });
  const words = texts.map(([e]) => e.textContent).filter((t) => /[a-zβ]/i.test(t));
  if (words.length < 2) out.unnamed.push(`${name}: ${words}`);
  const marks = boxes(plot.querySelectorAll(".onset"));
  const data = boxes(plot.querySelectorAll(".data"));
  out.seen = [out.seen[0] + texts.length, out.seen[1] + marks.length, out.seen[2] + data.length];
  for (const [, mark] of marks) for (const [, dot] of data) if (meet(mark, dot)) { out.marks.push(name); break; }
}
const blocks = boxes(document.querySelectorAll("figure, table, h2, .answers li, .legend"));
blocks.forEach(([a, box], i) => {
  for (const [b, other] of blocks.slice(i + 1))
    if (!a.contains(b) && !b.contains(a) && meet(box, other)) out.blocks.push(`${a.tagName} ${a.textContent.slice(0, 30)} | ${b.tagName} ${b.textContent.slice(0, 30)}`);
});
return out;
