"""What a person does on the page, in a browser: the page and Python agree, nothing hangs."""

from functools import partial
from threading import Event

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import bayes_placement as bp
from tests.criticism import small
from tests.explorer.test_server import IdleWorker
from tests.explorer.test_session import named, run_script
from tests.explorer.test_story import browser, opened  # noqa: F401  a fixture

RATIO = "structure.damping.ratio"


@pytest.fixture
def explorer(monkeypatch):
    for room in ("live", "background"):
        monkeypatch.setattr(f"bayes_placement.explorer.{room}.Worker", IdleWorker)
    explorer = bp.explore(small.experiment(), small.measured(), browser=False)
    palette = [
        {"kind": kind, "settings": [""], "is_placed": is_placed}
        for kind, is_placed in (("point_mass", True), ("ground_spring", True))
    ]
    explorer._server.page.tell_found("palette", {"kinds": palette})
    yield explorer
    explorer.close()


@pytest.fixture
def page(explorer, browser):  # noqa: F811
    page = opened(browser, explorer.address)
    page.locator("#parameters input[type=range]").first.wait_for()
    page.locator("#kind option").first.wait_for(state="attached")
    return page


def at(page, slider, share):
    """Place on the screen of a share of the range of a slider."""
    box = slider.bounding_box()
    return box["x"] + 8 + (box["width"] - 16) * share, box["y"] + box["height"] / 2


def until(page, is_so):
    for _ in range(2000):
        if is_so():
            return
        page.wait_for_timeout(10)
    raise AssertionError(f"it waits for ever; the page had trouble {page.trouble}")


def test_a_slider_that_is_dragged_and_brought_back_is_let_go(explorer, page):
    """Its value is that of the state, so that the browser tells of no change."""
    ratio = page.get_by_role("slider", name="ratio")
    begin = ratio.input_value()
    page.mouse.move(*at(page, ratio, int(begin) / 1000))
    page.mouse.down()
    page.mouse.move(*at(page, ratio, 0.9))
    until(page, lambda: "preview" in page.locator("#preview").inner_text())
    page.mouse.move(*at(page, ratio, int(begin) / 1000))
    page.mouse.up()
    until(page, lambda: "preview" not in page.locator("#preview").inner_text())
    field = page.get_by_role("textbox", name="ratio in %")
    field.fill("2.5")
    field.press("Enter")
    until(page, lambda: explorer.session.model.values[RATIO] == 0.025)
    until(page, lambda: ratio.input_value() == "125")  # it follows


SOCKETS = """
const Before = WebSocket;
window.sockets = [];
window.WebSocket = class extends Before {
  constructor(address) { super(address); sockets.push(this); }
};
"""


@pytest.mark.parametrize("is_open", [True, pytest.param(False, marks=pytest.mark.long)])
def test_a_slider_that_is_moved_while_nobody_answers_is_followed_once_one_does(
    explorer,
    browser,  # noqa: F811
    is_open,
):
    """Its socket is lost before it moves, or with the move on its way."""
    page = browser.new_page()
    page.add_init_script(SOCKETS)
    page.goto(explorer.address)
    page.locator("#parameters input[type=range]").first.wait_for()
    page.trouble = []
    ratio = page.get_by_role("slider", name="ratio")
    page.mouse.move(*at(page, ratio, int(ratio.input_value()) / 1000))
    page.mouse.down()
    if is_open:  # the program takes the move and its answer is lost
        page.evaluate("sockets[0].onmessage = null")
        page.mouse.move(*at(page, ratio, 0.9))
        page.evaluate("sockets[0].close()")
    else:
        page.evaluate("sockets[0].close()")
        page.mouse.move(*at(page, ratio, 0.9))
    until(page, lambda: page.evaluate("sockets.length") == 2)
    until(page, lambda: page.locator("#preview").inner_text() == "preview, not a verdict")
    page.mouse.up()
    until(page, lambda: explorer.session.model.values[RATIO] > 0.05)


def test_what_is_no_number_changes_nothing(explorer, page):
    field = page.get_by_role("textbox", name="ratio in %")
    before = field.input_value()
    for text in ("", "  ", "abc", "1e999"):
        field.fill(text)
        field.press("Enter")
        until(page, lambda: field.input_value() == before)
        assert len(explorer.session.states) == 1


def test_no_word_stays_of_a_structure_that_was_compiled_to_be_compared(explorer, page):
    page.locator("#add").click()
    page.locator("fieldset.effect").wait_for()
    explorer._server.page._response_of._kept.clear()
    page.locator("#steps li button").first.click(modifiers=["Shift"])
    page.locator("#legend button", has_text="0. as drawn").wait_for()
    assert page.locator("#progress").is_hidden()


def test_the_mouse_may_be_on_a_structure_that_is_not_drawn_yet(explorer, page):
    page.locator("#add").click()
    page.locator("fieldset.effect").wait_for()
    page.evaluate("window.requestAnimationFrame = () => 0")
    explorer._server._turns.submit(explorer._server.page.greet).result()
    page.wait_for_timeout(300)
    box = page.locator("#structure").bounding_box()
    page.mouse.move(box["x"] + 40, box["y"] + 40)
    page.wait_for_timeout(100)
    assert page.trouble == []


def test_what_went_wrong_is_told_until_the_next_step(explorer, page):
    explorer._server._turns.submit(explorer._server.page.tell, "error", words="It failed.").result()
    page.locator("#trouble", has_text="It failed.").wait_for()
    page.locator("#matrix button").first.click()  # asks for nothing
    assert page.locator("#trouble").is_visible()
    page.locator("#add").click()
    page.locator("fieldset.effect").wait_for()
    assert page.locator("#trouble").is_hidden()


def test_a_search_that_has_to_wait_says_so(explorer, page):
    server, started, earlier = explorer._server, Event(), Event()
    server._turns.submit(started.wait, 10.0)
    server._post(partial(server.page.tell_curves, "now", explorer.session.model))
    server._post(partial(server.page.tell, "busy", words="It is compiled."))
    server._post(partial(earlier.wait, 10.0))
    page.locator("#search").click()
    page.locator("#progress", has_text="search waits").wait_for(timeout=5000)
    started.set()
    page.locator("#progress", has_text="compiled. search waits").wait_for(timeout=5000)
    earlier.set()
    page.locator("#progress", has_text="search …").wait_for()


def test_what_is_pressed_by_keys_keeps_the_focus(page):
    for name in ("real and imaginary", "as drawn"):
        page.get_by_role("button", name=name, exact=True).last.focus()
        page.keyboard.press("Enter")
        page.wait_for_timeout(50)
        assert page.evaluate("document.activeElement.textContent") == name
    page.locator("#steps li button").focus()
    page.keyboard.press("Enter")
    page.locator("#steps li.current").wait_for()
    assert "as drawn" in page.evaluate("document.activeElement.textContent")


class Clicks(RuleBasedStateMachine):
    """Random clicks in a browser; after each, the page shows what Python has."""

    explorer, page = None, None

    @initialize()
    def begin(self):
        """From nothing done: a sequence must not depend on those before."""
        server, session, count = self.explorer._server, self.explorer.session, self.told
        del session.states[1:]
        session.go(0)
        server._turns.submit(server.page.greet).result()
        self.wait(count)

    def press(self, selector):
        """Press what is there, and wait until the session was told."""
        count = self.told
        self.page.locator(selector).first.click()
        self.wait(count)

    @property
    def told(self):
        return self.page.evaluate("told")

    def wait(self, count):
        until(self.page, lambda: self.told > count)

    @property
    def effects(self):
        return self.explorer.session.model.experiment.effects

    @rule(kind=st.sampled_from(["point_mass", "ground_spring"]), share=st.floats(0.0, 1.0))
    @precondition(lambda self: not self.effects)
    def drop(self, kind, share):
        count = self.told
        self.page.locator("#kind").select_option(kind)
        box = self.page.locator("#structure").bounding_box()
        height = box["y"] + 0.6 * box["height"]
        self.page.mouse.click(box["x"] + 34 + (box["width"] - 68) * share, height)
        self.wait(count)

    @rule(share=st.floats(0.0, 1.0), number=st.integers(0, 9))
    def slide(self, share, number):
        sliders = self.page.locator("#parameters input[type=range]:visible")
        slider = sliders.nth(number % sliders.count())
        slider.scroll_into_view_if_needed()
        count = self.told
        self.page.mouse.move(*at(self.page, slider, 0.5))
        self.page.mouse.down()
        self.page.mouse.move(*at(self.page, slider, share))
        self.page.mouse.up()
        self.wait(count)

    @rule(word=st.sampled_from(["undo", "redo"]))
    def return_to(self, word):
        if self.page.locator(f"#{word}").is_enabled():
            self.press(f"#{word}")

    @rule()
    @precondition(lambda self: self.effects)
    def remove(self):
        self.press("fieldset.effect legend button")

    @rule(number=st.integers(0, 99))
    def go(self, number):
        steps = self.page.locator("#steps li button")
        count = self.told
        steps.nth(number % steps.count()).click()
        self.wait(count)

    @invariant()
    def both_agree(self):
        session = self.explorer.session
        shown = self.page.evaluate(SHOWN)
        titles = [f"{number}. {state.title}" for number, state in enumerate(session.states)]
        assert shown["steps"] == titles and shown["current"] == session.current
        assert shown["script"] == session.script()
        assert float(shown["chi2"]) == pytest.approx(session.chi2[session.current], rel=6e-3)
        assert shown["effects"] == [effect.name for effect in self.effects]
        assert self.page.trouble == []

    def teardown(self):
        assert run_script(self.explorer.session) == named(self.explorer.session)


SHOWN = """() => {
  const texts = (selector) => [...document.querySelectorAll(selector)].map((e) => e.textContent);
  return {
    steps: texts("#steps li span"),
    current: [...document.querySelectorAll("#steps li")].findIndex((e) => e.matches(".current")),
    script: document.querySelector("#script").textContent,
    chi2: document.querySelector("#chi2").textContent,
    effects: texts("fieldset.effect legend span"),
  };
}"""

COUNT = """() => {
  window.told = 0;
  const script = document.querySelector("#script");
  new MutationObserver(() => (window.told += 1)).observe(script, { childList: true });
}"""
"""Count the states of which the page is told: with each the script is written anew."""


@pytest.mark.long
@pytest.mark.longest
def test_page_and_python_agree_after_each_of_random_clicks(explorer, page):
    page.set_viewport_size({"width": 1280, "height": 2000})
    page.set_default_timeout(60_000)
    page.evaluate(COUNT)

    class OnPage(Clicks):
        """Clicks on this page."""

    OnPage.explorer, OnPage.page = explorer, page
    OnPage.TestCase.settings = settings(
        max_examples=100,
        stateful_step_count=8,
        deadline=None,
        derandomize=True,
        phases=[Phase.generate],  # a shorter sequence would take minutes to find
        suppress_health_check=[*HealthCheck],
    )
    OnPage.TestCase("runTest").runTest()
