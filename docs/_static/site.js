// SPDX-License-Identifier: MIT
// Marks code and tables that go on beyond the edges of their box, for site.css to show.
const mark = box => {
  box.classList.toggle("more-left", box.scrollLeft > 1);
  box.classList.toggle("more-right", box.scrollLeft + box.clientWidth < box.scrollWidth - 1);
};
const boxes = ".bd-article pre, .bd-article .pst-scrollable-table-container";
addEventListener("load", () => {
  const resized = new ResizeObserver(entries => entries.forEach(entry => mark(entry.target)));
  for (const box of document.querySelectorAll(boxes)) {
    box.addEventListener("scroll", () => mark(box), { passive: true });
    resized.observe(box); // and once at the start
  }
});
