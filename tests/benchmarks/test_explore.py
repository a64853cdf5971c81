"""Benchmarks: the live page, from its command to the first picture, and from a slider to curves.

Run with `python -m pytest tests/benchmarks/test_explore.py -n 0`.
"""

import subprocess
import sys
import time

import numpy as np
import pytest

from tests.benchmarks.fresh import environment
from tests.benchmarks.page import ROOT, at_most
from tests.explorer.test_story import browser, explored, is_shown  # noqa: F401  a fixture

BEYOND, SLOWEST = 3.0, {(12, 800): 100.0, (48, 1600): 200.0}
"""Seconds beyond `import jax, numpyro` to the first picture; ms from a slider to the curves, of
channels and lines."""

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
    words = f"slider to curves, {channels} channels x {lines} lines, 95 %"
    page.add(words, slowest, "ms", at_most(SLOWEST[channels, lines]))
