// Says so above each table and picture that is wider than the page, and lets the keyboard reach it.
const markWide = () => document.querySelectorAll(".wide").forEach(box => {
  const wide = box.scrollWidth > box.clientWidth + 1;
  box.previousElementSibling.hidden = !wide;
  if (wide) box.tabIndex = 0; else box.removeAttribute("tabindex");
});
addEventListener("load", markWide);
addEventListener("resize", markWide);
// What is folded has no width until it is unfolded; this event does not bubble.
document.addEventListener("toggle", markWide, true);
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(d => { d.open = true; }));
