"""Benchmarks: the live page, from its command to the first picture, and from a slider to curves.

Run with `python -m pytest tests/benchmarks/test_explore.py -n 0`.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.fresh import environment
from tests.benchmarks.page import ROOT, at_most
from tests.explorer.test_story import browser, explored, is_shown  # noqa: F401  a fixture

BEYOND, SLOWEST, BOUNDED = 3.0, {(12, 800): 100.0, (48, 1600): 200.0}, 100.0
"""Seconds beyond `import jax, numpyro` to the first picture; ms from a slider to the curves, of
channels and lines; ms from a dragged band to its reach."""

MOVES = """async () => {
  const range = document.querySelector("#parameters input[type=range]");
  const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
  const laps = [];
  for (let move = 0; move < 200; move += 1) {
    const before = document.body.dataset.drawn;
    const began = performance.now();
    range.value = 200 + 3 * move;
    range.dispatchEvent(new Event("input", { bubbles: true }));
    while (document.body.dataset.drawn === before) await painted();
    await painted();
    laps.push(performance.now() - began);
  }
  return laps;
}"""
"""Move the first slider, and wait until the curves that belong to it are drawn [ms]."""


BANDS = """async () => {
  const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
  const over = document.querySelector(".u-over");
  const { left, top, width } = over.getBoundingClientRect();
  const at = (kind, share) => {
    const place = { clientX: left + share * width, clientY: top + 40, movementX: 1 };
    over.dispatchEvent(new MouseEvent(kind, { ...place, bubbles: true, view: window, button: 0 }));
  };
  const { dataset } = document.body;
  const words = () => document.querySelector("#by-any").textContent;
  const laps = [];
  at("mousemove", 0.1);
  at("mousedown", 0.1);
  for (let move = 0; move < 100; move += 1) {
    const [began, before] = [performance.now(), dataset.bounded];
    at("mousemove", 0.15 + 0.007 * move);
    while (dataset.bounded === before) await painted();
    await painted();
    laps.push(performance.now() - began);
  }
  return [words(), laps];
}"""
"""Drag a band over a chart, and wait until its reach is drawn [ms]."""

MOVED, HOUR, LARGEST, DRIVEN = 200, 36_000, 300.0, 600.0
"""Moves between two looks at the memory; moves in an hour, ten a second; MB of the page; seconds
for which it is driven as fast as it answers."""


def megabytes(shown):
    """Memory of the program of a page, after what nobody holds was given back [MB]."""
    session = shown.context.new_cdp_session(shown)
    session.send("HeapProfiler.enable")
    session.send("HeapProfiler.collectGarbage")
    return session.send("Runtime.getHeapUsage")["usedSize"] / 1e6


def resident(browser):  # noqa: F811
    """Memory of its own that the largest process of a page has [MB]."""
    session = browser.new_browser_cdp_session()
    told = session.send("SystemInfo.getProcessInfo")["processInfo"]
    pages = [process["id"] for process in told if process["type"] == "renderer"]
    lines = [Path(f"/proc/{number}/status").read_text() for number in pages]
    return max(float(re.search(r"RssAnon:\s+(\d+)", text)[1]) for text in lines) / 1e3


def imports():
    """Seconds of `import jax, numpyro` in a process of its own."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import jax, numpyro"], check=True)
    return time.perf_counter() - began


def test_the_first_picture(page, tmp_path, browser, monkeypatch):  # noqa: F811
    for name, value in environment(tmp_path / "caches").items():
        monkeypatch.setenv(name, value)
    model = str(ROOT / "models/hidden_effect.py")
    for order in ("first", "second"):
        least = imports()
        began = time.perf_counter()
        with explored(tmp_path, model) as (address, _):
            shown = browser.new_page()
            shown.goto(address)
            is_shown(shown, "#chi2", r"15\d{3}")
            took = time.perf_counter() - began - least
        page.add(f"explore, first picture beyond imports, {order} run", took, "s", at_most(BEYOND))


@pytest.mark.parametrize(("channels", "lines"), SLOWEST)
def test_a_slider_is_followed(page, tmp_path, browser, monkeypatch, channels, lines):  # noqa: F811
    monkeypatch.setenv("CHANNELS", str(channels))
    monkeypatch.setenv("LINES", str(lines))
    model = str(ROOT / "tests/benchmarks/large_bars.py")
    with explored(tmp_path, model, "--lines", str(lines)) as (address, _):
        # Functions of a benchmark are text, which the page itself forbids.
        shown = browser.new_context(bypass_csp=True).new_page()
        shown.goto(address)
        is_shown(shown, "#chi2", r"\d")
        shown.locator("#parameters input[type=range]").first.wait_for()
        slowest = float(np.percentile(shown.evaluate(MOVES), 95))
        first = megabytes(shown)
        shown.evaluate(MOVES)
        last = megabytes(shown)
        after = last + max(0.0, last - first) / MOVED * HOUR
    size = f"{channels} channels x {lines} lines"
    page.add(f"page after an hour of moves, as it grows, {size}", after, "MB", at_most(LARGEST))
    words = f"slider to curves, {channels} channels x {lines} lines, 95 %"
    page.add(words, slowest, "ms", at_most(SLOWEST[channels, lines]))


@pytest.mark.long
def test_memory_of_a_page_that_is_driven(page, tmp_path, browser, monkeypatch):  # noqa: F811
    channels, lines = 12, 800
    monkeypatch.setenv("CHANNELS", str(channels))
    monkeypatch.setenv("LINES", str(lines))
    model = str(ROOT / "tests/benchmarks/large_bars.py")
    with explored(tmp_path, model, "--lines", str(lines)) as (address, _):
        shown = browser.new_context(bypass_csp=True).new_page()
        shown.set_default_timeout(600_000)
        shown.goto(address)
        shown.locator("#parameters input[type=range]").first.wait_for()
        laps, began, heap = [], time.perf_counter(), []
        while time.perf_counter() - began < DRIVEN:
            laps += shown.evaluate(MOVES)
            heap.append(megabytes(shown))
            print(f"{len(laps)} moves, heap {heap[-1]:.1f} MB, process {resident(browser):.0f} MB")
        last = resident(browser)
    words = f"after {len(laps)} moves in {DRIVEN:.0f} s, {channels} channels x {lines} lines"
    page.add(f"heap of the page, {words}", max(heap), "MB", at_most(LARGEST))
    page.add(f"process of the page, {words}", last, "MB", at_most(LARGEST))


def test_a_dragged_band_is_bounded(page, tmp_path, browser, monkeypatch):  # noqa: F811
    channels, lines = 12, 800
    monkeypatch.setenv("CHANNELS", str(channels))
    monkeypatch.setenv("LINES", str(lines))
    model = str(ROOT / "tests/benchmarks/large_bars.py")
    with explored(tmp_path, model, "--lines", str(lines)) as (address, _):
        shown = browser.new_context(bypass_csp=True).new_page()
        shown.set_default_timeout(600_000)
        shown.goto(address)
        shown.locator("#kinds button").first.wait_for()
        words, laps = shown.evaluate(BANDS)
    assert "any law" in words
    words = f"bound of reach of a dragged band, {channels} channels x {lines} lines, 95 %"
    page.add(words, float(np.percentile(laps, 95)), "ms", at_most(BOUNDED))
