"""Tasks shared among processes: the same results, whatever becomes of a helper."""

import atexit
import gc
import os
import resource
import sys
import textwrap
import threading
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import loky
import numpy as np
import numpyro.distributions as dist
import pytest
from loky import get_reusable_executor
from threadpoolctl import threadpool_info, threadpool_limits

import bayes_placement as bp
from bayes_placement._shared import parts as _parts
from bayes_placement._shared import processes as _processes
from bayes_placement._shared.garbage import RARELY, rare_garbage_collection
from bayes_placement.criticism.kept_fits import NO_RIVAL
from bayes_placement.criticism.missing._errors_as_identified import given_with_errors
from bayes_placement.criticism.missing._fits_with_errors import fitted_with_errors_in_processes
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._more_effects import single_effects, with_channels
from bayes_placement.inference.chi2 import LEVEL
from bayes_placement.io import model
from tests.criticism.small import MASS, experiment, measured


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(loky, "cpu_count", lambda: 2)
    monkeypatch.setattr(_processes, "_alone", False)


def end_helpers():
    get_reusable_executor().shutdown(kill_workers=True)


@pytest.fixture(scope="module", autouse=True)
def ended_at_last():
    """Tests share a helper, which takes more than a second to start."""
    yield
    end_helpers()


@pytest.fixture
def ended():
    """No other test has the helper of this one, which is spoiled."""
    end_helpers()
    yield
    end_helpers()


def where(number):
    """A number and the process that was given it; each takes long enough for the other to help."""
    time.sleep(0.05)
    return number, os.getpid()


def only_here(number, parent):
    if os.getpid() != parent:
        raise ValueError("This is a helper.")
    time.sleep(0.05)
    return number


def dies_elsewhere(number, parent):
    if os.getpid() != parent:
        os._exit(3)
    time.sleep(0.05)
    return number


def refuses(number):
    raise KeyError(number)


def kinds_and_process(experiment):
    time.sleep(0.05)
    return [type(effect).__name__ for effect in experiment.structure.effects.values()], os.getpid()


def frozen_at_its_end():
    """Whether what runs at the end of this process keeps Python from looking for garbage."""
    atexit._run_exitfuncs()
    return gc.get_freeze_count() > 0


def kept_megabytes(count, kept=[]):  # noqa: B006  it stays
    kept.append(np.ones(count * 2**17))


def awaited_helper():
    helpers, _ = _processes.started_helpers()
    helpers.submit(os.getpid).result()


def test_results_are_in_order_and_of_two_processes():
    awaited_helper()
    done = []
    results = _parts.shared(where, [(n,) for n in range(20)], done.append)
    assert [number for number, _ in results] == list(range(20))
    assert len({process for _, process in results}) == 2
    assert sorted(done) == list(range(20))


def test_helpers_have_begun_before_this_process_does_something_else():
    awaited_helper()
    done, waited = [], []

    def meanwhile():
        waited.append(time.sleep(0.5))

    results = _parts.shared(where, [(n,) for n in range(4)], done.append, meanwhile)
    assert {process for _, process in results} != {os.getpid()}
    assert len(waited) == 1 and sorted(done) == list(range(4))


@pytest.mark.parametrize(("compiled_in", "processes"), [(0.01, 2), (60.0, 1)])
def test_an_idle_helper_takes_parts_of_what_is_done_meanwhile_where_these_take_long(
    compiled_in, processes, monkeypatch
):
    _processes.started_helpers()[0].submit(where, 0).result()  # it has imported this module
    monkeypatch.setattr(_parts, "COMPILED_IN", compiled_in)
    inner, sharing = [], []

    def meanwhile():
        inner.extend(_parts.shared(where, [(n,) for n in range(20)], lambda _: None))
        sharing.append(_processes.is_sharing())

    outer = _parts.shared(where, [(n,) for n in range(2)], lambda _: None, meanwhile)
    assert [number for number, _ in inner] == list(range(20))
    assert len({process for _, process in inner}) == processes
    assert [number for number, _ in outer] == [0, 1]
    assert sharing == [True] and not _processes.is_sharing()


def test_what_a_helper_cannot_do_is_done_here():
    awaited_helper()
    tasks = [(n, os.getpid()) for n in range(6)]
    assert _parts.shared(only_here, tasks, lambda _: None) == list(range(6))


@pytest.mark.usefixtures("ended")
def test_a_helper_that_dies_leaves_its_tasks_and_no_other_is_started():
    awaited_helper()
    tasks = [(n, os.getpid()) for n in range(6)]
    assert _parts.shared(dies_elsewhere, tasks, lambda _: None) == list(range(6))
    assert _processes.started_helpers() == (None, 0)


def test_an_error_is_raised_here_and_ends_the_helpers():
    with pytest.raises(KeyError):
        _parts.shared(refuses, [(n,) for n in range(4)], lambda _: None)
    assert not _processes.has_one_core() or os.environ.get("PJRT_NPROC") == "1"


def test_one_core_has_no_helper(monkeypatch):
    monkeypatch.setattr(loky, "cpu_count", lambda: 1)
    assert _processes.started_helpers() == (None, 0)
    results = _parts.shared(where, [(n,) for n in range(3)], lambda _: None)
    assert {process for _, process in results} == {os.getpid()}


class Losing(Executor):
    """Loses the worker of each third part that it is given."""

    given = 0

    def submit(self, fn, /, *arguments):
        self.given += 1
        future = Future()
        if self.given % 3:
            future.set_result(fn(*arguments))
        else:
            future.set_exception(BrokenExecutor("a process ended"))
        return future


def test_a_part_whose_worker_is_lost_is_given_to_the_executor_again():
    executor, done = Losing(), []
    with _parts.done_by(executor):
        results = _parts.shared(where, [(n,) for n in range(8)], done.append)
    assert [number for number, _ in results] == list(range(8)) == sorted(done)
    assert executor.given == 8 + 3


def thread_of(number):
    return number, threading.get_ident()


def test_an_executor_does_all_parts_but_those_that_are_shared_meanwhile():
    here, meanwhile = threading.get_ident(), []

    def look():
        meanwhile.extend(_parts.shared(thread_of, [(7,), (8,)], lambda _: None))

    with ThreadPoolExecutor(1) as threads, _parts.done_by(threads):
        results = _parts.shared(thread_of, [(n,) for n in range(3)], lambda _: None, look)
        with pytest.raises(KeyError):
            _parts.shared(refuses, [(3,)], lambda _: None)
    assert meanwhile == [(7, here), (8, here)]
    assert [number for number, _ in results] == [0, 1, 2]
    assert here not in {thread for _, thread in results}


def at_work_until(begun, go_on):
    begun.touch()
    while not go_on.exists():
        time.sleep(0.01)
    return os.getpid()


def test_what_is_begun_in_a_helper_is_awaited_later_and_what_waits_there_is_done_here(tmp_path):
    awaited_helper()
    begun, go_on = tmp_path / "begun", tmp_path / "go on"
    at_work = _parts.begun_in_helper(at_work_until, begun, go_on)
    others = [_parts.begun_in_helper(where, number) for number in range(6)]
    while not begun.exists():
        time.sleep(0.01)
    assert others[-1]() == (5, os.getpid())
    go_on.touch()
    process = at_work()
    assert process != os.getpid() and at_work() == process
    assert [other()[0] for other in others] == [*range(6)]


def test_nothing_is_begun_in_a_helper_where_no_search_has_started_any(monkeypatch):
    monkeypatch.setattr(_processes, "_started_before", False)
    calls = []
    awaited = _parts.begun_in_helper(calls.append, 3)
    assert calls == [3]
    assert awaited() is None and calls == [3]


def test_what_a_helper_begins_and_cannot_do_is_done_here_when_it_is_awaited():
    awaited_helper()
    assert _parts.begun_in_helper(only_here, 3, os.getpid())() == 3
    awaited = _parts.begun_in_helper(refuses, 3)
    with pytest.raises(KeyError):
        awaited()


@pytest.mark.usefixtures("ended")
def test_the_end_of_a_helper_is_not_waited_for():
    """Half a second else, in which Python looks for garbage among all that it frees anyway."""
    awaited_helper()
    helpers, _ = _processes.started_helpers()
    assert helpers.submit(frozen_at_its_end).result()


def test_where_helpers_cannot_start_there_are_none(monkeypatch):
    def fails(**_):
        raise OSError("No space left on device")

    monkeypatch.setattr(loky, "get_reusable_executor", fails)
    results = _parts.shared(where, [(n,) for n in range(3)], lambda _: None)
    assert {process for _, process in results} == {os.getpid()}
    monkeypatch.undo()


@pytest.mark.usefixtures("ended")
def test_a_helper_that_keeps_much_is_not_replaced():
    """Compiled functions take hundreds of megabytes; Loky takes 300 for a leak."""
    awaited_helper()
    helpers, _ = _processes.started_helpers()
    before = helpers.submit(os.getpid).result()
    helpers.submit(kept_megabytes, 400).result()
    time.sleep(1.1)  # it looks once a second, after a task
    helpers.submit(os.getpid).result()
    assert helpers.submit(os.getpid).result() == before


def test_an_effect_of_a_model_file_reaches_a_helper(tmp_path):
    file = tmp_path / "with_own_effect.py"
    file.write_text(
        textwrap.dedent("""
        import bayes_placement as bp
        from tests.criticism.small import experiment as bar

        class Spring(bp.effects.ground_spring):
            pass

        experiment = bar() + Spring(0.4, 1e4, name="own")
        """)
    )
    study = model.read(file)
    awaited_helper()
    results = _parts.shared(kinds_and_process, [(study.experiment,)] * 10, lambda _: None)
    assert all(kinds == ["Spring"] for kinds, _ in results)
    assert len({process for _, process in results}) == 2


@pytest.mark.long
def test_a_search_of_two_processes_is_that_of_one(monkeypatch):
    candidates = (
        bp.effects.point_mass(dist.Uniform(0.05, 0.95), dist.LogUniform(1e-3, 1.0)),
        bp.effects.gain_error("s1", dist.Uniform(-0.5, 0.5)),
        bp.effects.gain_error("s2", dist.Uniform(-0.5, 0.5)),
    )
    data = experiment().data(measured(MASS, seed=2))
    null = null_hypothesis(experiment(), data)
    shared = with_channels(single_effects(null, candidates, lambda: None), LEVEL, needs_all=True)
    monkeypatch.setattr(loky, "cpu_count", lambda: 1)
    alone = with_channels(single_effects(null, candidates, lambda: None), LEVEL, needs_all=True)
    assert [h.kinds for h in shared.hypotheses] == [h.kinds for h in alone.hypotheses]
    for one, other in zip(shared.hypotheses, alone.hypotheses, strict=True):
        np.testing.assert_allclose(one.fit.log_evidence, other.fit.log_evidence, atol=1e-6)
    for one, other in zip(shared.candidates, alone.candidates, strict=True):
        np.testing.assert_allclose(one.scores["score"], other.scores["score"], atol=1e-6)


@pytest.mark.long
def test_hypotheses_are_the_same_with_a_model_error_fitted_elsewhere():
    setup = experiment()
    data = setup.data(measured(MASS, seed=1))
    errors = setup.with_model_error(bp.model_error.Embedded(shape=None, modes=3)).model_error
    exact = [
        null_hypothesis(setup + effect, data) for effect in (MASS, bp.effects.point_mass(0.3, 0.2))
    ]
    together = fitted_with_errors_in_processes(exact, errors, NO_RIVAL, [None] * len(exact))
    with ThreadPoolExecutor(1) as threads, _parts.done_by(threads):
        together += fitted_with_errors_in_processes(exact, errors, NO_RIVAL, [None] * len(exact))
    for each, alone in zip(
        together, [given_with_errors(each, errors) for each in exact] * 2, strict=True
    ):
        assert each.has_errors and each.problem.sizes == pytest.approx(alone.problem.sizes)
        assert each.fit.log_evidence == pytest.approx(alone.fit.log_evidence, abs=1e-6)
        assert each.chi2_when_exact == alone.chi2_when_exact
        np.testing.assert_allclose(each.fit.point, alone.fit.point, atol=1e-6)


@pytest.fixture
def usual():
    before = gc.get_threshold()
    gc.set_threshold(700, 10, 10)
    yield gc.get_threshold()
    gc.set_threshold(*before)


@rare_garbage_collection()
def thresholds(depth=1):
    return [gc.get_threshold(), *(thresholds(depth - 1) if depth else [])]


def test_it_is_seldom_while_it_runs_and_as_often_as_before_afterwards(usual):
    assert thresholds() == [RARELY, RARELY]
    assert gc.get_threshold() == usual
    with pytest.raises(KeyError), rare_garbage_collection():
        raise KeyError
    assert gc.get_threshold() == usual


def test_threads_of_blas_do_not_wait_for_each_other_while_a_model_is_fitted(monkeypatch):
    threads, run = [], bp.engines.MAP.run

    def noted(*arguments, **options):
        threads.extend(pool["num_threads"] for pool in threadpool_info())
        return run(*arguments, **options)

    monkeypatch.setattr(bp.engines.MAP, "run", noted)
    with threadpool_limits(2):
        bp.infer(experiment(), measured(), engine=bp.engines.MAP(starts=1), key=0)
        assert {pool["num_threads"] for pool in threadpool_info()} == {2}
    assert threads and set(threads) == {1}


@pytest.mark.skipif(sys.platform != "linux", reason="another allocator")
def test_memory_of_large_arrays_is_reused_while_it_runs():
    with rare_garbage_collection():
        first, second = (faults_of_arrays(count) for count in (1, 10))
    assert second < max(first, 1000)


def faults_of_arrays(count):
    """Pages that the system gave while so many arrays of 16 MB came and went."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(count):
        np.ones(2**21)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
