"""The server answers the page alone: who knows the token, from this address, with its messages."""

import asyncio
import gc
import json
import os
import random
import signal
import string
import threading
import time
import urllib.error
import urllib.request

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
import websockets

import bayes_placement as bp
from bayes_placement._shared.compiled import programs_kept
from bayes_placement._shared.errors import InfeasibleError, InputError
from bayes_placement.criticism.missing.fitted_model import FittedModel
from bayes_placement.explorer.background import Newest, lines_within
from bayes_placement.explorer.candidates import added
from bayes_placement.explorer.live import LivePage
from bayes_placement.explorer.messages import LONGEST, Message, MessageError, parsed
from bayes_placement.explorer.response import ResponseOf
from bayes_placement.explorer.steps import as_drawn
from bayes_placement.explorer.worker import Told
from bayes_placement.page.frames import packed, unpacked
from tests.criticism import small

ASKED = []
"""Tasks and experiments that workers were asked for."""


class IdleWorker:
    """A worker that is asked and never answers."""

    def __init__(self, hear):
        self.count = 0

    def begin(self, task, **arguments):
        ASKED.append((task, arguments["asked"].experiment))
        self.count += 1
        return self.count

    def stop(self):
        self.count = 0


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patched:
        for room in ("live", "background"):
            patched.setattr(f"bayes_placement.explorer.{room}.Worker", IdleWorker)
        store = tmp_path_factory.mktemp("store")
        opened = bp.explore(small.experiment(), small.measured(), store=store, browser=False)
        yield opened
        opened.close()


def status(address, **headers):
    request = urllib.request.Request(address, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=5) as answer:
            return answer.status, dict(answer.headers)
    except urllib.error.HTTPError as error:
        return error.code, dict(error.headers)


def socket_address(page):
    return page.address.replace("http:", "ws:") + "socket"


def origin(page):
    return page.address.rsplit("/", 2)[0]


async def heard(socket, word, **wanted):
    """The next frame of a word, and of its fields."""
    while True:
        header, arrays = unpacked(await asyncio.wait_for(socket.recv(), 120))
        if header["is"] == word and wanted.items() <= header.items():
            return header, arrays


def talk(page, conversation):
    async def run():
        async with websockets.connect(
            socket_address(page), origin=origin(page), max_size=None
        ) as socket:
            return await conversation(socket)

    return asyncio.run(run())


def test_the_page_and_its_files_are_there_for_who_knows_the_address(page):
    code, headers = status(page.address)
    assert code == 200 and headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in headers["content-security-policy"]
    assert headers["referrer-policy"] == "no-referrer"
    assert status(page.address + "app.js")[0] == 200
    assert status(page.address + "vendor/uplot.js")[0] == 200


def test_other_tokens_hosts_origins_and_paths_are_refused(page):
    root = origin(page)
    token = page.address.rsplit("/", 2)[1]
    other = random.Random(0)
    tokens = ["", "x", token[:-1], token + "x", token.swapcase()]
    tokens += ["".join(other.choices(string.ascii_letters, k=32)) for _ in range(1000)]
    assert {status(f"{root}/{each}/")[0] for each in tokens} == {403}
    assert status(root)[0] == 403
    for host in ("evil.example", "127.0.0.1", "127.0.0.1:1", f"evil.example:{root[-5:]}"):
        assert status(page.address, Host=host)[0] == 403
    for from_where in ("http://evil.example", "null", "https" + root[4:], root + "0"):
        assert status(page.address, Origin=from_where)[0] == 403
    for path in ("../live.py", "..%2flive.py", "vendor/../../live.py", "style.css/", "a.js"):
        assert status(page.address + path)[0] == 404


@pytest.mark.parametrize("wrong", ["origin", "no origin", "token"])
def test_sockets_of_others_are_refused(page, wrong):
    address = socket_address(page)
    if wrong == "token":
        address = address.replace(page.address.rsplit("/", 2)[1], "x" * 32)
    from_where = {"origin": "http://evil.example", "no origin": None, "token": origin(page)}[wrong]

    async def connect():
        async with websockets.connect(address, origin=from_where):
            pass

    with pytest.raises(websockets.InvalidStatus, match="403"):
        asyncio.run(connect())


MALFORMED = [
    "",
    "{",
    "[]",
    "null",
    '{"do": []}',
    '{"do": "eval", "code": "1"}',
    '{"do": "undo", "further": 1}',
    '{"do": "move", "values": {"a": 1e999}, "serial": 1}',
    '{"do": "move", "values": {"a": "1"}, "serial": 1}',
    '{"do": "move", "values": {}, "serial": 1}',
    '{"do": "move", "values": {"a": true}, "serial": 1}',
    '{"do": "go", "state": -1}',
    '{"do": "go", "state": 1.5}',
    '{"do": "add", "kind": "", "number": null, "at": null}',
    '{"do": "add", "kind": "x", "number": 1, "at": [0, 0]}',
    '{"do": "save", "what": "../../etc"}',
    "[" * 5000,
    '{"do": "set", "values": {"' + "a" * 300 + '": 1}}',
    " " * (LONGEST + 1),
]


@pytest.mark.parametrize("text", MALFORMED)
def test_a_message_that_no_page_sends_is_refused(text):
    with pytest.raises(MessageError):
        parsed(text)


def test_numbers_that_are_whole_are_numbers_and_counts_stay_whole():
    moved = parsed('{"do": "move", "values": {"a": 1013600000}, "serial": 3}').content
    assert [*map(type, moved["values"].values())] == [float] and type(moved["serial"]) is int
    band = parsed('{"do": "band", "low": 5, "high": 7.5}').content
    assert [*map(type, band.values())] == [float, float]


def test_random_messages_are_refused_without_harm():
    dice = random.Random(0)
    for _ in range(1000):
        text = "".join(dice.choices(string.printable, k=dice.randrange(40)))
        with pytest.raises(MessageError):
            parsed(text)


@pytest.mark.parametrize(
    ("frame", "code"), [("{", 1008), (b"\0\1", 1008), ("x" * (LONGEST + 1), 1009)]
)
def test_a_socket_is_closed_after_a_malformed_or_oversized_frame_and_the_page_goes_on(
    page, frame, code
):
    async def say(socket):
        await heard(socket, "model")
        await socket.send(frame)
        with pytest.raises(websockets.ConnectionClosed):
            while True:
                await asyncio.wait_for(socket.recv(), 120)
        assert socket.close_code == code  # 1009: it was not even read

    talk(page, say)
    assert status(page.address)[0] == 200


def test_the_page_is_told_the_model_and_follows_moves(page):
    ratio = "structure.damping.ratio"

    async def play(socket):
        model, arrays = await heard(socket, "model")
        assert [pair["sensor"] for pair in model["pairs"]] == ["s1+x", "s2+x"]
        assert arrays["measured"].shape == (2, 2, small.LINES.size)
        drawn, _ = await heard(socket, "curves", name="now")
        move = {"do": "move", "values": {ratio: 0.035, "nobody": 1.0}, "serial": 7}
        await socket.send(json.dumps(move))
        moved, _ = await heard(socket, "curves", serial=7)
        assert not moved["is_state"] and moved["chi2"] != drawn["chi2"]
        await socket.send(json.dumps({"do": "set", "values": {ratio: 9.0}}))
        state, _ = await heard(socket, "state", current=1)
        assert state["sliders"][1]["value"] == 0.06  # the end of its prior
        await socket.send(json.dumps({"do": "undo"}))
        back, _ = await heard(socket, "curves", name="now")
        assert back["chi2"] == drawn["chi2"]
        await socket.send(json.dumps({"do": "set", "values": {"nobody": 1.0}}))
        await socket.send(json.dumps({"do": "remove", "effect": "nobody"}))
        await socket.send(json.dumps({"do": "add", "kind": "nobody", "number": 1, "at": None}))
        error, _ = await heard(socket, "error")
        assert "nobody" in error["words"] and "leave out" not in error["words"]
        assert len(page.session.states) == 2

    talk(page, play)


def test_an_effect_is_dropped_dragged_and_taken_away(page):
    async def play(socket):
        await heard(socket, "state")
        drop = {"do": "add", "kind": "point_mass", "number": None, "at": [0.3, 0.0, 0.0]}
        await socket.send(json.dumps(drop))
        curves, arrays = await heard(socket, "curves", name="now", is_state=True)
        while ["effect", "point_mass"] not in curves["items"]:
            curves, arrays = await heard(socket, "curves", name="now", is_state=True)
        assert arrays["places"][-1, 0] == pytest.approx(0.3)
        drag = {"do": "drag", "effect": "point_mass", "at": [0.5, 0.0, 0.0], "serial": 9}
        await socket.send(json.dumps(drag))
        curves, arrays = await heard(socket, "curves", serial=9)
        assert arrays["places"][-1, 0] == pytest.approx(0.5)
        await socket.send(json.dumps({"do": "remove", "effect": "point_mass"}))
        state, _ = await heard(socket, "state")
        while state["effects"]:
            state, _ = await heard(socket, "state")

    talk(page, play)


def test_modes_are_told_with_and_without_what_was_added(page):
    async def play(socket):
        await heard(socket, "state")
        await socket.send('{"do": "modes"}')
        modes, _ = await heard(socket, "modes")
        assert modes["beside"] == "as drawn"
        drop = {"do": "add", "kind": "point_mass", "number": None, "at": [0.3, 0.0, 0.0]}
        await socket.send(json.dumps(drop))
        heavy = {"structure.effects.point_mass.mass": 5.0}
        await socket.send(json.dumps({"do": "set", "values": heavy}))
        await socket.send('{"do": "modes"}')
        modes, _ = await heard(socket, "modes")
        assert modes["beside"] == "without point_mass"
        now, before = (modes[word]["frequency"][0] for word in ("now", "before"))
        assert now < before  # a mass makes a structure slower
        first = [np.ravel(modes[word]["shape"][0]) for word in ("now", "before")]
        product = np.prod([part @ part for part in first])
        assert modes["mac"][0][0] == pytest.approx((first[0] @ first[1]) ** 2 / product, rel=1e-4)
        await socket.send(json.dumps({"do": "go", "state": 0}))

    talk(page, play)


def test_a_step_of_a_search_is_shown_while_it_runs(page):
    """The model as it stands is on its own again once the search is stopped."""

    async def play(socket):
        await heard(socket, "state")
        live = page._server.page
        await socket.send('{"do": "search"}')
        await heard(socket, "task", task="search")
        heavier = live.session.model.experiment + bp.effects.point_mass(
            dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 1.0)
        )
        fit = 1.0, 0.5, 0.0, None, 0.0
        step = FittedModel(
            "point_mass", ("point_mass",), {}, *fit, errors=as_drawn(heavier), experiment=heavier
        )
        live._hear_at_hand(Told(live._task[0], "step", step))
        curves, arrays = await heard(socket, "curves", task="search")
        assert curves["title"] == "search: + point_mass" and curves["added"] == ["point_mass"]
        assert arrays["places"][-1, 0] == pytest.approx(0.5)
        await socket.send('{"do": "stop"}')
        curves, _ = await heard(socket, "curves", is_state=True)
        assert curves["added"] == []

    talk(page, play)


def test_reach_within_a_band_is_looked_for_once_at_a_time(page):
    looked, told = [], []
    chosen = Newest(looked.append)
    for low in (1.0, 2.0, 3.0):
        chosen.choose((low, 9.0))
    assert looked == [(1.0, 9.0)]  # those chosen meanwhile wait
    told += [chosen.ended(), chosen.ended()]
    assert looked == [(1.0, 9.0), (3.0, 9.0)] and told == [((1.0, 9.0), False), ((3.0, 9.0), True)]
    experiment = small.experiment()
    low, *_, high = small.LINES
    assert lines_within(experiment, (low, high)).tolist() == [*range(small.LINES.size)]

    async def play(socket):
        await socket.send(json.dumps({"do": "band", "low": low, "high": low}))
        told, _ = await heard(socket, "background", task="band", share=1.0)
        assert "which has 1 lines; more than 5 are needed" in told["words"]
        ASKED.clear()  # a first page asks for more
        await socket.send(json.dumps({"do": "band", "low": low, "high": high}))
        await socket.send(json.dumps({"do": "band", "low": 2 * low, "high": high}))
        await socket.send('{"do": "modes"}')
        await heard(socket, "modes")
        assert [task for task, _ in ASKED] == ["band"]

    talk(page, play)


class Bounded:
    """A reach that gives back the band it is asked for."""

    in_bands = ()

    def any_law_within(self, *band):
        return np.array(band)


def test_reach_follows_bands_and_what_is_moved_of_models_the_newest_alone(page):
    """Beside the model of which reach was looked for, that reach stands."""
    background = page._server.page._background

    async def play(socket):
        await heard(socket, "state")
        for serial, reach in enumerate((None, Bounded()), 1):
            background._reach = reach
            band = {"low": 30.0, "high": 90.0}
            await socket.send(json.dumps({"do": "bound", **band, "serial": serial}))
            bound, _ = await heard(socket, "bound", serial=serial)
            assert bound["shares"] == ([] if reach is None else [30.0, 90.0])
            assert bound["band"] == [*band.values()]
        await socket.send('{"do": "go", "state": 0}')
        await socket.send('{"do": "port", "acts_on": "displacement"}')
        beside, _ = await heard(socket, "beside")
        assert beside["acts_on"] == ""  # nothing is known of any port yet
        background._read_by_line = ["displacement"]
        await socket.send('{"do": "port", "acts_on": "displacement"}')
        await heard(socket, "beside")
        ASKED.clear()
        name = "structure.damping.ratio"
        for serial, ratio in enumerate((0.03, 0.031, 0.05), 1):
            move = {"do": "move", "values": {name: ratio}, "serial": serial}
            await socket.send(json.dumps(move))
            await heard(socket, "curves", serial=serial)
        assert [task for task, _ in ASKED] == ["beside"]
        header = {"acts_on": "displacement", "places": []}
        number = background._worker.count
        background._hear(Told(number, "done", (header, {"given": np.ones(3)})))
        beside, arrays = await heard(socket, "beside", acts_on="displacement")
        assert arrays["given"].tolist() == [1.0] * 3
        assert [task for task, _ in ASKED] == ["beside", "beside"]
        (model,) = background._models._looked
        assert model.values[name] == 0.05
        await socket.send(json.dumps({"do": "go", "state": 0}))
        await heard(socket, "beside", acts_on="")

    talk(page, play)
    background._read_by_line = []


def test_a_later_call_takes_the_page_up(page, tmp_path, monkeypatch):
    for room in ("live", "background"):
        monkeypatch.setattr(f"bayes_placement.explorer.{room}.Worker", IdleWorker)
    experiment, measurement = small.experiment(), small.measured()
    first = bp.explore(experiment, measurement, store=tmp_path, browser=False)
    first.session.do(added(experiment, "point_mass", at=(0.3, 0.0, 0.0)))
    token = first.address.rsplit("/", 2)[1]
    first.close()
    again = bp.explore(experiment, measurement, store=tmp_path, browser=False)
    try:
        assert len(again.session.states) == 2 and again.address.rsplit("/", 2)[1] == token
        (secret,) = (tmp_path / "explored").glob("*.token")
        assert secret.stat().st_mode & 0o077 == 0
        ASKED.clear()

        async def play(socket):
            await socket.send(json.dumps({"do": "compare", "state": 0}))
            await heard(socket, "curves", title="0. as drawn")

        talk(again, play)
        again._server._turns.submit(again._server.page.handle, Message("undo", {})).result()
        (kept,) = (tmp_path / "explored").glob("*.json")  # also of a process that is killed now
        assert json.loads(kept.read_text())["current"] == 0
        tasks = [task for task, _ in ASKED]
        assert tasks == ["offered", "check_data", "as_given", "reach"]
        # What is fitted as given has none of the effects that were taken up.
        assert all(not asked.effects for _, asked in ASKED)
    finally:
        again.close()


def test_what_has_no_curves_or_no_noise_is_refused():
    modes = bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2])
    structure = small.experiment().structure
    observe = bp.observe.ModalData(modes)
    observing = bp.Experiment(structure, sensors=[], observe=observe, noise=None)
    with pytest.raises(InfeasibleError, match="FRFs are needed"):
        bp.explore(observing, modes, browser=False)
    with pytest.raises(InputError, match="noise=None"):
        bp.explore(bp.Experiment(
            structure,
            sensors=[bp.Sensor("s1", at=0.2)],
            actuators=[bp.Actuator("a1", at=0.4)],
            frequency=small.LINES,
            observe=bp.observe.Complex("acceleration"),
            noise=None,
        ), small.measured(), browser=False)  # fmt: skip


def compiled_responses():
    """How many responses stay compiled, and objects that run them."""
    gc.collect()
    programs = jax.devices()[0].client.live_executables()
    names = [module.name for program in programs for module in program.hlo_modules()]
    runners = [one for one in gc.get_objects() if type(one) is ResponseOf]
    return sum("_response" in name for name in names), len(runners)


@pytest.mark.long
@pytest.mark.longest
def test_only_structures_that_were_last_used_stay_compiled(page, monkeypatch):
    """Undo among them compiles nothing; the curves of others are compiled anew, and the same."""
    monkeypatch.setattr("bayes_placement.explorer.response.MOST", 2)
    programs = programs_kept(2)
    monkeypatch.setattr("bayes_placement.explorer.response.PROGRAMS", programs)
    opened = bp.explore(small.experiment(), small.measured(), browser=False)
    live, turns = opened._server.page, opened._server._turns

    def do(word, **content):
        turns.submit(live.handle, Message(word, content)).result()
        return live.session.chi2[live.session.current]

    drawn = do("go", state=0)
    before = compiled_responses()
    for kind in ("point_mass", "ground_spring", "gain_error"):
        do("go", state=0)
        last = do("add", kind=kind, number=1, at=None)
    after = compiled_responses()
    assert after[0] - before[0] == 1 and after[1] - before[1] == 1
    misses = programs.cache_info().misses
    assert do("undo") == drawn and do("redo") == last
    assert programs.cache_info().misses == misses
    first = do("go", state=1)
    assert programs.cache_info().misses == misses + 1
    assert first == live.session.chi2[1] and first != last
    opened.close()


def test_a_fit_follows_from_where_it_began(page):
    """What is done meanwhile is another branch: a script would fit another model."""
    opened = bp.explore(small.experiment(), small.measured(), browser=False)
    live, turns = opened._server.page, opened._server._turns
    given = live.session.model.values
    turns.submit(live.handle, Message("fit", {})).result()
    task = live._task[0]
    add = {"kind": "point_mass", "number": 1, "at": None}
    turns.submit(live.handle, Message("add", add)).result()
    turns.submit(live._hear_at_hand, Told(task, "seen", given)).result()
    turns.submit(live._hear_at_hand, Told(task, "done", given)).result()
    last = live.session.states[-1]
    assert (last.title, last.parent) == ("fit", 0) and not last.model.experiment.effects
    assert [state.title for state in live.session.states][1:2] == ["+ point_mass"]
    opened.close()


def test_a_page_that_reads_nothing_is_left_and_comes_back(page, monkeypatch):
    """Frames that wait for it would fill the memory."""
    monkeypatch.setattr("bayes_placement.explorer.server.MOST_WAITING", 50)
    server = page._server

    async def sleep(socket):
        await heard(socket, "state")
        for _ in range(200):  # more than the operating system keeps as well
            server._broadcast(b"\2\0\0\0{}" + bytes(1_000_000))
        with pytest.raises(websockets.ConnectionClosed):
            while True:
                await asyncio.wait_for(socket.recv(), 120)
        assert socket.close_code == 1013

    talk(page, sleep)
    assert not server._sockets
    talk(page, lambda socket: heard(socket, "state"))


def test_a_page_that_comes_back_is_shown_all_while_another_structure_is_compiled(page):
    is_compiled = threading.Event()
    talk(page, lambda socket: heard(socket, "state"))
    page._server._post(is_compiled.wait)

    async def play(socket):
        for word in ("model", "curves", "state", "task"):
            await heard(socket, word)

    try:
        talk(page, play)
        assert not is_compiled.is_set()
    finally:
        is_compiled.set()


def test_a_page_is_closed_without_what_is_still_in_line(page):
    opened = bp.explore(small.experiment(), small.measured(), browser=False)
    begun, done = threading.Event(), []
    opened._server._post(lambda: begun.set() or time.sleep(1.0) or done.append("begun"))
    opened._server._post(lambda: done.append("in line"))
    begun.wait()
    opened.close()
    assert done == ["begun"]


def test_of_states_that_are_returned_to_at_once_the_last_one_alone_is_shown(page):
    """Each may be of another structure, which is compiled."""
    is_compiled = threading.Event()

    async def play(socket):
        ratio = {"structure.damping.ratio": 0.04}
        await socket.send(json.dumps({"do": "go", "state": 0}))
        await socket.send(json.dumps({"do": "set", "values": ratio}))
        last = len(page.session.states)
        await heard(socket, "state", current=last)
        page._server._post(is_compiled.wait)
        for message in ({"do": "undo"}, {"do": "redo"}, {"do": "go", "state": 0}, {"do": "modes"}):
            await socket.send(json.dumps(message))
        while page._server._taken < 6:
            await asyncio.sleep(0.01)
        is_compiled.set()
        shown = []
        while not shown or shown[-1]["is"] != "state":
            header, _ = unpacked(await asyncio.wait_for(socket.recv(), 120))
            shown.append(header)
        assert [header["is"] for header in shown] == ["modes", "beside", "curves", "state"]
        assert shown[-1]["current"] == 0

    page._server._taken = 0
    try:
        talk(page, play)
    finally:
        is_compiled.set()


def test_a_port_that_is_taken_is_told_in_a_sentence(page):
    port = int(page.address.split(":")[2].split("/")[0])
    with pytest.raises(InputError, match="cannot be used"):
        bp.explore(small.experiment(), small.measured(), port=port, browser=False)


def test_ctrl_c_while_it_waits_leaves_a_server_that_still_ends(page):
    """A thread that is joined meanwhile counts as ended from then on, and runs on."""
    server = page._server
    interrupt = threading.Timer(0.7, os.kill, (os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
    try:
        interrupt.start()
        with pytest.raises(KeyboardInterrupt):
            page.wait()
        interrupt.join()
    finally:
        signal.signal(signal.SIGINT, before)
    assert server._thread.is_alive() and not server._ended.is_set()
    assert status(page.address)[0] == 200


def test_every_message_has_a_method():
    from bayes_placement.explorer.messages import ALLOWED

    methods = {name.removeprefix("_on_") for name in vars(LivePage) if name.startswith("_on_")}
    assert methods == {*ALLOWED}


def test_frames_hold_numbers_of_single_precision_and_no_words_that_json_lacks():
    numbers = np.array([[1.0, np.nan, 2.5]])
    header, arrays = unpacked(packed({"is": "x", "chi2": float("inf")}, {"a": numbers}))
    assert header["chi2"] is None
    np.testing.assert_array_equal(arrays["a"], numbers)
