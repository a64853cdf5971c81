"""The story in a browser: as drawn, dropped, dragged, fitted, and a script that says the same."""

import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.browser import ARGUMENTS, NAMES

MODELS = Path(__file__).parents[2] / "models"
SECONDS = 1000.0
TRUTH = {
    "youngs modulus in GPa": "1.03",
    "ratio in %": "3.0",
    "s1 position in mm": "171.98",
    "s2 position in mm": "455",
    "s3 position in mm": "728",
    "a1 position in mm": "233",
    "point_mass mass in g": "540",
}
"""What a person who knew it would type, by the names of the fields."""

PROGRAM = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
runpy.run_module("bayes_placement", run_name="__main__", alter_sys=True)
"""


@contextmanager
def explored(folder, *words):
    """Address of the page of a model, and the process that serves it."""
    command = [sys.executable, "-c", PROGRAM, "explore", *words, "--no-browser"]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        lines = iter(process.stdout.readline, "")
        yield next(found[0] for line in lines if (found := re.search(r"http://\S+", line))), process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


@pytest.fixture
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install playwright"
    )
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("there is no Chromium on this machine: apt-get install chromium")
    with playwright.sync_playwright() as started:
        yield started.chromium.launch(executable_path=program, args=ARGUMENTS)


def opened(browser, address, **settings):
    """A page whose errors, and requests to anything else, are in `page.trouble`."""
    page = browser.new_context(viewport={"width": 1280, "height": 900}, **settings).new_page()
    page.set_default_timeout(90 * SECONDS)
    page.trouble = []
    page.on("console", lambda message: page.trouble.append(message.text))
    page.on("pageerror", lambda error: page.trouble.append(error.stack or str(error)))
    own = (address, address.replace("http:", "ws:"), "data:")
    page.on("request", lambda asked: asked.url.startswith(own) or page.trouble.append(asked.url))
    page.goto(address)
    return page


def is_shown(page, selector, words):
    """Wait until an element says something."""
    page.locator(selector, has_text=re.compile(words)).wait_for()


PRESSED = ["#undo", "#search", "#structure", "#kinds", "#add", "#matrix button", "#bands"]
PRESSED += ["#legend button", ".u-over", "#steps"]

WATCH = """(pressed) => {
  window.places = new Set();
  const place = (selector) => {
    const found = document.querySelector(selector);
    const holder = found.closest("header, main").getBoundingClientRect();
    const { left, top, width } = found.getBoundingClientRect();
    return [selector, left - holder.left, top - holder.top, width].join(" ");
  };
  const look = () => {
    pressed.map(place).forEach((each) => places.add(each));
    requestAnimationFrame(look);
  };
  look();
}"""
"""Note, frame by frame, where that is which a person may be pressing."""


def chi2(page):
    return float(page.locator("#chi2").inner_text())


@pytest.mark.long
def test_a_mass_is_dropped_dragged_and_fitted_by_mouse_and_the_script_says_the_same(
    tmp_path, browser
):
    model = shutil.copy(MODELS / "hidden_effect.py", tmp_path)
    for name in ("hidden_effect.uff", "hidden_effect_truth.json"):
        shutil.copy(MODELS / name, tmp_path)
    with explored(tmp_path, model) as (address, _):
        page = opened(browser, address)
        is_shown(page, "#chi2", r"15\d{3}")
        assert page.locator("#matrix button[aria-pressed=true]").get_attribute("aria-label") == (
            "s3+x a1+x"  # the worst channel
        )
        page.locator("#parameters input[type=range]").first.wait_for()
        page.evaluate(WATCH, PRESSED)
        page.locator("#bands").dispatch_event("click", {"clientX": -5, "clientY": 5e3})  # beside
        page.locator("#whole").click()
        page.locator("#kinds button", has_text="force").wait_for()
        box = page.locator("#structure").bounding_box()
        over = page.locator(".u-over").first.bounding_box()
        page.mouse.move(over["x"] + 50, over["y"] + 40)
        page.mouse.down()
        page.mouse.move(over["x"] + 250, over["y"] + 40, steps=4)
        is_shown(page, "#by-any", "upper bound: any law")
        page.mouse.up()
        page.locator("#whole").click()
        height = box["y"] + 0.6 * box["height"]

        def across(place):
            return box["x"] + 34 + (box["width"] - 68) * place

        page.mouse.click(across(0.5), height)
        page.locator("fieldset.effect").wait_for()
        is_shown(page, "#steps li.current", "point_mass")
        page.evaluate("trouble.textContent = 'It failed. '.repeat(20); trouble.hidden = false")
        page.mouse.move(across(0.5), height)
        page.mouse.down()
        for step in range(10):
            page.mouse.move(across(0.5 - 0.013 * (step + 1)), height)
        is_shown(page, "#preview", "preview, not a verdict")
        page.mouse.up()
        is_shown(page, "#steps li.current", "point_mass at 3[67]")
        page.locator("#fit").click()
        is_shown(page, "#steps li.current", "fit")
        assert chi2(page) == pytest.approx(1.0, abs=0.02)
        page.keyboard.press("Control+z")
        is_shown(page, "#steps li.current", "point_mass at 3[67]")
        page.keyboard.press("Control+y")
        is_shown(page, "#steps li.current", "fit")
        fitted, script = chi2(page), page.locator("#script").inner_text()
        page.locator("#save-report").click()
        is_shown(page, "#saved", "Report written")
        page.locator("#save-model").click()
        is_shown(page, "#saved", "Model written")
        assert len(page.evaluate("[...places]")) == len(PRESSED)
        assert page.trouble == []
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert float(done.stdout) == pytest.approx(fitted, abs=0.005)
    (report,) = tmp_path.glob("results/hidden_effect/explore-1/report.html")
    assert "point_mass" in report.read_text()
    assert "point_mass(" in (tmp_path / "hidden_effect_explored_1.py").read_text()


@pytest.mark.long
@pytest.mark.longest
def test_numbers_are_typed_and_a_killed_program_is_taken_up_again(tmp_path, browser):
    model = MODELS / "hidden_effect.py"
    words = (str(model), "--port", "0")
    with explored(tmp_path, *words) as (address, process):
        page = opened(browser, address, color_scheme="dark")
        page.set_viewport_size({"width": 390, "height": 844})
        is_shown(page, "#chi2", r"15\d{3}")
        page.locator("#kind option").first.wait_for(state="attached")
        page.locator("#kinds button", has_text="force").wait_for()
        page.locator("#add").focus()
        page.keyboard.press("Enter")  # at the peak of reach
        page.locator("fieldset.effect").wait_for()
        page.locator("#parameters summary").focus()
        page.keyboard.press("Enter")
        steps = page.locator("#steps li").count()
        page.get_by_role("slider", name="youngs modulus").focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        page.locator("#steps li").nth(steps).wait_for()
        page.wait_for_timeout(1000)  # for a step of each press, if there were one
        assert page.locator("#steps li").count() == steps + 1
        for label, value in TRUTH.items():
            field = page.get_by_role("textbox", name=label)
            field.fill(value)
            field.press("Enter")
        is_shown(page, "#chi2", r"^\d\.\d\d$")
        before = chi2(page)
        assert before < 10
        port = re.search(r":(\d+)/", address)[1]
        os.kill(process.pid, signal.SIGKILL)
        is_shown(page, "#trouble", "does not answer")
        with explored(tmp_path, str(model), "--port", port) as (again, _):
            assert again == address
            page.locator("#trouble").wait_for(state="hidden")
            is_shown(page, "#steps li.current", "point_mass")
            assert chi2(page) == before
            lost = "ERR_CONNECTION_REFUSED"  # while it was not there
            assert [words for words in page.trouble if lost not in words] == []
