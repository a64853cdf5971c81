"""A report takes long: a worker writes it, sliders are answered meanwhile, and it is stopped."""

import json
import threading
import time
from functools import partial

import pytest

from bayes_placement.explorer.opened import Given, opened
from bayes_placement.explorer.page_frames import LongSave
from tests.criticism import small
from tests.explorer.test_server import heard, page, talk  # noqa: F401  a fixture

RATIO = "structure.damping.ratio"
SAVE = json.dumps({"do": "save", "what": "report"})


def written(folder, values, progress):
    """Say the half, and wait until the page has what it asked for meanwhile."""
    progress(0.5)
    while not (folder / "go_on").exists():
        time.sleep(0.01)
    path = folder / "report.html"
    path.write_text(json.dumps(values))
    return path


class WaitingReport(LongSave):
    """A report that waits for a file."""

    def __init__(self, folder):
        self.folder = folder

    def writer(self, page):  # noqa: F811
        return partial(written, self.folder, dict(page.session.model.values))

    def take_over(self, written):
        return written


@pytest.fixture
def reported(tmp_path):
    given = Given(report=WaitingReport(tmp_path))
    explorer = opened(small.experiment(), small.measured(), None, given)
    explorer._server.page._has_begun = True  # nothing else is looked at
    yield explorer
    explorer.close()


async def begun(socket):
    model, _ = await heard(socket, "model")
    assert model["saves"] == ["report"]
    await socket.send(SAVE)
    task, _ = await heard(socket, "task", share=0.5)
    assert task["task"] == "report"


@pytest.mark.long
@pytest.mark.longest
def test_sliders_are_answered_while_a_report_is_written_of_the_model_as_it_was(reported, tmp_path):
    drawn = dict(reported.session.model.values)

    async def play(socket):
        await begun(socket)
        move = {"do": "move", "values": {RATIO: 0.035}, "serial": 3}
        await socket.send(json.dumps(move))
        await heard(socket, "curves", serial=3)
        await socket.send(json.dumps({"do": "set", "values": {RATIO: 0.05}}))
        await heard(socket, "state", current=1)
        (tmp_path / "go_on").touch()
        await heard(socket, "task", task="")
        saved, _ = await heard(socket, "saved")
        assert saved["words"] == f"Report written: {tmp_path / 'report.html'}"

    talk(reported, play)
    assert json.loads((tmp_path / "report.html").read_text()) == drawn
    assert reported.session.current == 1


@pytest.mark.long
def test_a_report_is_stopped_and_written_again(reported, tmp_path):
    async def play(socket):
        await begun(socket)
        await socket.send('{"do": "stop"}')
        await heard(socket, "task", task="")
        (tmp_path / "go_on").touch()
        await socket.send(SAVE)
        await heard(socket, "saved")

    talk(reported, play)


def test_a_task_is_stopped_while_the_page_is_at_something_else(page):  # noqa: F811
    """A step of a search may be compiled, which takes seconds."""
    live, is_compiled = page._server.page, threading.Event()

    async def play(socket):
        await heard(socket, "state")
        await socket.send('{"do": "search"}')
        await heard(socket, "task", task="search")
        page._server._post(is_compiled.wait)
        count = live._at_hand.count
        assert count
        await socket.send('{"do": "stop"}')
        await heard(socket, "task", task="")
        assert live._at_hand.count == 0 and not is_compiled.is_set()
        is_compiled.set()
        await heard(socket, "state")

    try:
        talk(page, play)
    finally:
        is_compiled.set()
