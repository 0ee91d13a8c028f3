# SPDX-License-Identifier: MIT
"""What a browser finds wrong with a page: what is cut off, cannot be read, or cannot be reached."""

from __future__ import annotations

# Returns a list of words, one for each problem of the page as it is now.
CUT_OFF = """() => {
  const width = document.documentElement.clientWidth, found = [];
  const told = (what, e) => found.push(
    `${what}: ${e.tagName}.${e.className} ${(e.textContent || "").trim().slice(0, 40)}`);
  if (document.documentElement.scrollWidth > width) found.push("the page is wider than the window");
  const scrolls = e => ["auto", "scroll", "hidden", "clip"].includes(getComputedStyle(e).overflowX);
  const box = e => { while ((e = e.parentElement)) if (scrolls(e)) return e; return null; };
  for (const e of document.querySelectorAll("body *")) {
    const at = e.getBoundingClientRect();
    if (!at.width || !at.height || e.closest("svg")) continue;
    if (e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0) {
      // Only what says so above may be scrolled, and the keyboard must reach it.
      const declared = e.matches(".wide") && e.tabIndex === 0
        && e.previousElementSibling.checkVisibility();
      const around = box(e);
      if (!declared && !(around && around.matches(".wide"))) told("wider than its place", e);
    }
    const next = e.nextElementSibling, flows = ["block", "table", "grid", "flex"];
    if (next && [e, next].every(one => flows.includes(getComputedStyle(one).display)
        && getComputedStyle(one).position === "static")) {
      const below = next.getBoundingClientRect();
      if (below.height && below.top < at.bottom - 1 && below.bottom > at.top + 1
          && below.left < at.right - 1 && below.right > at.left + 1) told("covered by the next", e);
    }
    if (!box(e) && (at.right > width + 1 || at.left < -1)) told("beyond the edge", e);
  }
  const legends = (view, plot) => {
    if (view.model?.type === "Legend" && (view.bbox.left < 0 || view.bbox.right > plot.bbox.width))
      found.push(`a legend is cut off: ${view.bbox.left} to ${view.bbox.right}`);
    for (const child of view.children ? view.children() : []) legends(child, plot);
  };
  for (const root of globalThis.Bokeh?.index.roots ?? []) legends(root, root);
  return found;
}"""

# What has to be scrolled down, but for texts of any length: a listing, and a page in its frame.
SCROLLS = """() => {
  const found = [], page = document.documentElement;
  if (page.scrollHeight > page.clientHeight) found.push(`the page: ${page.scrollHeight} px`);
  const look = root => {
    for (const e of root.querySelectorAll("*")) {
      if (e.shadowRoot) look(e.shadowRoot);
      const held = ["auto", "scroll"].includes(getComputedStyle(e).overflowY) && !e.matches("pre");
      if (held && e.clientHeight && e.scrollHeight > e.clientHeight + 1)
        found.push(`${e.scrollHeight} px in ${e.clientHeight}: ${e.tagName}.${e.className}`);
    }
  };
  look(document);
  return found;
}"""

# Every text against what is behind it, as the contrast ratio of WCAG 2.1; 4.5 is its level AA.
HARD_TO_READ = """() => {
  const parsed = colour => colour.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map(c => c / 255)
    .map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = e => {
    for (; e; e = e.parentElement) {
      const colour = parsed(getComputedStyle(e).backgroundColor);
      if (colour.length < 4 || colour[3] > 0) return colour;
    }
    return [255, 255, 255];
  };
  const found = [];
  for (const e of document.querySelectorAll("body *")) {
    const own = [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.checkVisibility() || e.closest("script, style")) continue;
    const [a, b] = [light(parsed(getComputedStyle(e).color)), light(behind(e))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) found.push(`${contrast.toFixed(1)}: ${e.textContent.trim().slice(0, 40)}`);
  }
  return found;
}"""

# The names of the elements that show something, in the order of the page.
ORDER = """() => [...document.querySelectorAll("body img, body .bars, body .plot, body table")]
  .map(e => e.matches("table") ? "table" : "picture")"""
