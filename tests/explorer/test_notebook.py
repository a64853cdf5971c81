"""The page in a cell of a notebook: the module of the widget, held by a page as JupyterLab does."""

import base64
import queue
import time

import pytest

import bayes_placement as bp
from tests.criticism import small
from tests.explorer.test_server import IdleWorker
from tests.explorer.test_story import browser  # noqa: F401  a fixture

HOLDER = """async (text) => {
  const heard = [];
  window.tell = (letters) => {
    const bytes = Uint8Array.from(atob(letters), (letter) => letter.charCodeAt(0));
    for (const each of heard) each({}, [new DataView(bytes.buffer)]);
  };
  window.said = [];
  const model = { send: (words) => window.said.push(words), on: (_, each) => heard.push(each) };
  const module = await import(URL.createObjectURL(new Blob([text], { type: "text/javascript" })));
  module.default.render({ model, el: document.body });
}"""
"""A cell: its model sends what it is given, and tells what comes."""

SECONDS = 120.0


@pytest.fixture
def opened(monkeypatch):
    for room in ("live", "background"):
        monkeypatch.setattr(f"bayes_placement.explorer.{room}.Worker", IdleWorker)
    page = bp.explore(small.experiment(), small.measured(), browser=False)
    yield page
    page.close()


def test_a_cell_shows_the_page_and_its_messages_go_over_the_kernel(opened, browser):  # noqa: F811
    pytest.importorskip("anywidget", reason="anywidget is not installed: pip install anywidget")
    from bayes_placement.explorer.opened import widget_of

    widget, frames = widget_of(opened._server), queue.SimpleQueue()
    widget.send = lambda content, buffers: frames.put(buffers[0])
    cell = browser.new_page()
    cell.evaluate(HOLDER, widget._esm)
    inner = cell.frame_locator("iframe")

    def wait_until(is_so):
        ends = time.monotonic() + SECONDS
        while not is_so():
            assert time.monotonic() < ends
            for words in cell.evaluate("said.splice(0)"):
                widget._handle_custom_msg(words, [])
            while not frames.empty():
                cell.evaluate("tell", base64.b64encode(frames.get()).decode())
            cell.wait_for_timeout(20)

    chi2 = inner.locator("#chi2")
    wait_until(lambda: chi2.inner_text()[:1].isdigit())
    first = chi2.inner_text()
    ratio = inner.get_by_role("textbox", name="ratio in %")
    wait_until(lambda: ratio.count())
    ratio.fill("2.5")
    ratio.press("Enter")
    wait_until(lambda: opened.session.current == 1)
    wait_until(lambda: chi2.inner_text() != first)
    assert opened.session.model.values["structure.damping.ratio"] == pytest.approx(0.025)
    opened._server.page.tell("error", words="It failed.")
    trouble = inner.locator("#trouble")
    wait_until(trouble.is_visible)
    assert trouble.bounding_box()["y"] < cell.viewport_size["height"] / 2  # not at the far end
    widget._handle_custom_msg('{"do": "eval"}', [])  # is left
    assert "application/vnd.jupyter.widget-view+json" in opened._repr_mimebundle_()[0]


def test_without_anywidget_the_address_is_shown(opened, monkeypatch):
    monkeypatch.setattr("bayes_placement.explorer.opened.find_spec", lambda name: None)
    assert opened._repr_mimebundle_() is None  # then a notebook asks for HTML
    assert opened.address in opened._repr_html_()
