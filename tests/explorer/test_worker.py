"""The worker fits and searches in a process of its own, tells of its steps, and can be stopped."""

import json
import os
import queue
import signal
import time

import jax
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import forget_programs
from bayes_placement._shared.garbage import give_memory_back, memory_in_use
from bayes_placement.explorer.candidates import added
from bayes_placement.explorer.found import actions_of, ledger_for_page, reach_for_page
from bayes_placement.explorer.session import Session
from bayes_placement.explorer.steps import chi2, fit
from bayes_placement.explorer.worker import AskedOfWorker, Worker
from bayes_placement.page.frames import packed, unpacked
from tests.criticism import small

MASS = bp.effects.point_mass(0.3, 0.5)


def heard(told, word):
    """The next that is told of a word, and all before it."""
    before = []
    while True:
        before.append(told.get(timeout=120))
        if before[-1].word in (word, "failed"):
            return before


@pytest.fixture
def worker():
    told = queue.SimpleQueue()
    started = Worker(told.put)
    yield started, told
    started.stop()


@pytest.mark.long
def test_a_fit_is_told_step_by_step_and_is_that_of_the_script(worker):
    started, told = worker
    measurement = small.measured(MASS)
    session = Session(small.experiment(), measurement)
    session.do(added(session.model.experiment, "point_mass", at=(0.33, 0.0, 0.0)))
    experiment, values = session.model
    asked = AskedOfWorker(experiment, measurement, None, None)
    number = started.begin("fit", asked=asked, values=dict(values))
    *steps, done = heard(told, "done")
    assert done.word == "done" and done.number == number
    errors = [chi2(experiment, measurement, step.content) for step in steps]
    assert errors[0] > 10 * errors[-1]
    assert chi2(experiment, measurement, done.content) == pytest.approx(1.0, abs=0.3)
    again = fit(experiment, measurement, values)
    assert done.content == pytest.approx(again, rel=1e-6)


@pytest.mark.long
def test_reach_beside_given_values_is_told_and_what_a_task_is_about_is_sent_once(worker):
    started, told = worker
    asked = AskedOfWorker(small.experiment(), small.measured(MASS), None, None)
    for ratio in (0.035, 0.05):
        values = small.TRUTH | {"structure.damping.ratio": ratio}
        started.begin("beside", asked=asked, acts_on="displacement", values=values)
    started.begin("beside", asked=asked, acts_on="nothing", values=small.TRUTH)
    (header, right), (_, wrong) = (heard(told, "done")[-1].content for _ in range(2))
    error = np.sum(wrong["given"]) / np.sum(wrong["measured"])
    assert error == pytest.approx(chi2(*asked[:2], values), rel=1e-6)
    assert np.sum(right["left"], axis=1).min() < np.sum(wrong["left"], axis=1).min()
    nearest = header["places"][int(np.argmin(np.sum(right["left"], axis=1)))]
    assert nearest[0][0] == pytest.approx(0.3, abs=0.02)
    assert heard(told, "failed")[-1].word == "failed"


@pytest.mark.long
def test_a_worker_says_what_is_wrong_goes_on_and_is_stopped(worker):
    started, told = worker
    asked = AskedOfWorker(small.experiment(), small.measured(), None, None)
    started.begin("fit", asked=asked, values={})
    (failed,) = heard(told, "failed")
    assert "KeyError" in failed.content
    started.begin("check_data", asked=asked)
    assert heard(told, "done")[-1].content == []
    started.begin("search", asked=asked)
    process = started._process
    time.sleep(0.5)
    started.stop()
    assert process.poll() is not None
    assert not {"done", "failed"} & {told.get().word for _ in range(told.qsize())}
    started.begin("check_data", asked=asked)  # another one starts
    assert heard(told, "done")[-1].content == []


@pytest.mark.long
def test_tasks_of_a_worker_that_was_killed_are_told_as_failed(worker):
    started, told = worker
    asked = AskedOfWorker(small.experiment(), small.measured(), None, None)
    for task in ("check_data", "search"):
        number = started.begin(task, asked=asked)
    heard(told, "done")
    os.killpg(started._process.pid, signal.SIGKILL)
    failed = heard(told, "failed")[-1]
    assert failed.number == number and "has ended" in failed.content
    started.begin("check_data", asked=asked)  # another one starts
    assert heard(told, "done")[-1].content == []


@pytest.mark.long
@pytest.mark.parametrize(
    "error", [None, pytest.param(bp.model_error.Embedded(), marks=pytest.mark.longest)]
)
def test_steps_of_a_search_are_states_with_its_numbers(error):
    measurement = small.measured(MASS)
    experiment = small.experiment().with_model_error(error)
    candidates = bp.effects.library(experiment, ["point_mass", "ground_spring"])
    ledger = bp.improve(experiment, measurement, candidates=candidates, model_error=None)
    session = Session(experiment, measurement)
    for action, step in zip(actions_of(ledger, experiment), ledger.steps, strict=True):
        session.go(0)
        session.do(action)
        as_script = chi2(step.experiment, measurement, dict(step.values))
        assert chi2(*session.model[:1], measurement, session.model.values) == as_script
    assert session.states[-1].title == "search: + point_mass"
    again = Session(experiment, measurement)
    again.take_up(json.loads(json.dumps(session.to_json())))
    assert again.model.values == session.model.values
    header, _ = unpacked(packed(ledger_for_page(ledger), {}))
    assert header["probabilities"]["point_mass"] > 0.9
    for told, step in zip(header["steps"], ledger.steps, strict=True):
        assert told["model_error"] == {kind: size.mean for kind, size in step.model_error.items()}


@pytest.mark.long
@pytest.mark.longest
def test_reach_is_laid_out_kind_by_kind():
    found = bp.reach(small.experiment(), small.measured(MASS))
    header, _ = unpacked(packed(reach_for_page(found), {}))
    best = header["kinds"][0]
    assert best["acts_on"] == "displacement" and not best["is_channel"]
    assert best["best"]["place_m"][0][0] == pytest.approx(0.3, abs=0.01)
    (along,) = np.nonzero(found.curves["acts_on"] == "displacement")
    assert best["rows"] == along.tolist() and len(best["curve"]) == len(along)
    assert header["is_bounded"]
    bound = found.any_law_within(small.LINES[0], small.LINES[-1])
    np.testing.assert_allclose(bound[along], found.curves["any_law"][along], atol=1e-2)
    law = best["measured"]
    size = np.hypot(law["law_real"], law["law_imaginary"])
    np.testing.assert_allclose(size, 0.5 * (2 * np.pi * small.LINES) ** 2, rtol=0.05)


@pytest.mark.long
@pytest.mark.longest
def test_what_a_process_compiled_is_forgotten_and_the_same_when_it_is_compiled_anew():
    """Programs of searches would fill the memory."""
    experiment, measurement = small.experiment(), small.measured(MASS)
    assert memory_in_use() > 5e7
    before, programs = chi2(experiment, measurement, small.TRUTH), len(live_programs())
    forget_programs()
    give_memory_back()
    assert len(live_programs()) < programs
    assert chi2(experiment, measurement, small.TRUTH) == before


def live_programs():
    return jax.devices()[0].client.live_executables()
