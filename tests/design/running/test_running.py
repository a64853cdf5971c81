"""Chunks in files, computed by any executor; lost workers; killed runs."""

import io
import os
import sys
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial

import loky
import numpy as np
import numpyro.distributions as dist
import pytest
from threadpoolctl import threadpool_info

import bayes_placement as bp
from bayes_placement import information
from bayes_placement._shared import parts as _parts
from bayes_placement._shared import processes as _processes
from bayes_placement._shared.executors import WorkerProcesses
from bayes_placement.design.information.estimator import Estimator
from bayes_placement.design.running import chunks as chunking
from bayes_placement.design.running import evaluation
from bayes_placement.experiment.content_hash import content_hash
from bayes_placement.io.model import read
from models import bar
from tests.design import at_work, killed, small_maps
from tests.design.small_maps import CELLS, computed


@pytest.fixture(scope="module")
def full_map():
    return computed()


MANY = "7"
"""Threads that this process is said to have, more than a worker's share of the cores."""


@pytest.fixture(scope="module")
def processes():
    with pytest.MonkeyPatch.context() as changed:
        changed.setenv("PJRT_NPROC", MANY)  # which JAX read here before
        changed.setenv("OPENBLAS_NUM_THREADS", MANY)
        with bp.design.workers(2) as executor:
            yield executor


@pytest.fixture(scope="module")
def full_store(tmp_path_factory, full_map):
    folder = tmp_path_factory.mktemp("kept")
    assert computed(store=folder).identical(full_map)
    return folder


@pytest.fixture
def store(full_store, tmp_path):
    """A store of its own that holds the full map."""
    for path in full_store.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


@pytest.fixture
def counted(monkeypatch):
    """Chunks that were computed here."""
    computed_chunks = []

    def count(chunk):
        computed_chunks.append(chunk)
        return chunking.compute(chunk)

    monkeypatch.setattr(evaluation, "compute", count)
    return computed_chunks


# Results in files.


def test_only_what_is_missing_is_computed(store, full_map, counted):
    names = sorted(store.iterdir())
    assert len(names) == CELLS
    shares = []
    assert computed(store=store, progress=shares.append).identical(full_map)
    assert not counted and shares == [1.0]
    names[3].unlink()
    assert computed(store=str(store), progress=shares.append).identical(full_map)
    assert len(counted) == 1 and shares[1:] == [11 / 12, 1.0]


def test_a_file_says_by_itself_what_is_in_it(full_store, full_map):
    cells = []
    for path in full_store.iterdir():
        with np.load(path) as arrays:
            assert "'estimator': 'KernelGain'" in str(arrays["settings"])
            assert "'draws': 128" in str(arrays["settings"])
            where = {name: float(arrays[f"recorded.{name}"][0]) for name in ("s1", "a1")}
            cell = full_map.sel(where)
            assert arrays["information_gain"][0] == cell["information_gain"]
            jackknife = arrays["information_gain_jackknife"][0]
            np.testing.assert_array_equal(jackknife, cell["information_gain_jackknife"])
            cells.append(tuple(where.values()))
    assert len(set(cells)) == CELLS


def cut(content):
    return content[: len(content) // 2]


def flipped(content):
    """One bit of a number that is stored is another."""
    with np.load(io.BytesIO(content)) as arrays:
        number = arrays["information_gain_jackknife"][0, 2]
    place = content.find(number.tobytes())
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def foreign(content):
    stream = io.BytesIO()
    np.savez(stream, information_gain=[1.0])
    return stream.getvalue()


@pytest.mark.parametrize(
    "harm", [lambda content: b"", cut, lambda content: content[:-1], flipped, foreign]
)
def test_a_damaged_file_is_computed_anew_and_said(harm, store, full_map, counted):
    path = sorted(store.iterdir())[5]
    content = path.read_bytes()
    path.write_bytes(harm(content))
    assert path.read_bytes() != content
    with pytest.warns(UserWarning, match=rf"{path.name} is damaged \(.*computed again"):
        assert computed(store=store).identical(full_map)
    assert len(counted) == 1
    assert computed(store=store).identical(full_map) and len(counted) == 1


def test_a_file_that_was_copied_under_the_name_of_another_is_not_believed(store, full_map, counted):
    first, second, *_ = sorted(store.iterdir())
    second.write_bytes(first.read_bytes())
    with pytest.warns(UserWarning, match=rf"{second.name} is damaged \(it holds another part"):
        assert computed(store=store).identical(full_map)
    assert len(counted) == 1


def test_what_a_killed_writer_left_is_of_no_consequence(store, full_map, counted):
    for path in list(store.iterdir())[:2]:
        (store / f".{path.stem}-abc.npz").write_bytes(b"half")
        path.unlink()
    assert computed(store=store).identical(full_map) and len(counted) == 2


def test_a_file_that_may_not_be_read_is_an_error(store, monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(evaluation.Path, "read_bytes", refuse)
    with pytest.raises(PermissionError, match="Permission denied"):
        computed(store=store)


def test_two_runs_may_write_one_file_at_once(tmp_path):
    chunk = small_maps.chunks()[0]
    result = np.linspace(1, 2, 5)[None]
    results = []

    def write():
        for _ in range(10):
            evaluation.Store(tmp_path).write(chunk, result)
            results.append(evaluation.Store(tmp_path).read(chunk))

    threads = [threading.Thread(target=write) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    np.testing.assert_array_equal(results, [result] * 20)
    assert len(list(tmp_path.iterdir())) == 1


def test_a_file_in_the_place_of_a_folder_is_refused(tmp_path):
    path = tmp_path / "file"
    path.touch()
    with pytest.raises(ValueError, match=r"file' is a file. A folder is needed"):
        computed(store=path)


# Names of files.


def test_names_are_the_same_in_any_process(processes):
    structures = small_maps.structures()
    in_worker = processes.submit(small_maps.hashes, structures).result()
    assert in_worker == small_maps.hashes(structures) and len(set(in_worker)) == 3


def test_each_that_determines_a_result_is_in_its_name(monkeypatch):
    name = evaluation._key
    first, *further = small_maps.chunks()
    places = {"s1": small_maps.PLACES["s1"][:3], "a1": small_maps.PLACES["a1"]}
    (pair, *_), variants = small_maps.chunks(size=2), further
    variants += [
        small_maps.chunks(seed=1)[0],
        small_maps.chunks(information.KernelGain(draws=128, placement_draws=65))[0],
        small_maps.chunks(information.KernelGain(draws=128, placement_draws=64, sampling="plain"))[
            0
        ],
        small_maps.chunks(places=places)[0],
        pair,
        pair._replace(cells=pair.cells[:1]),  # filled up: of another length
    ]
    names = {name(variant) for variant in [first, *variants]}
    assert len(names) == 1 + len(variants)
    assert name(small_maps.chunks()[0]) in names
    monkeypatch.setattr(evaluation, "VERSION", "0.0.0")
    assert name(first) not in names


def test_the_random_points_do_not_depend_on_where_candidates_are():
    first = small_maps.chunks()[0].task
    places = {name: at + 0.01 for name, at in small_maps.PLACES.items()}
    moved = small_maps.chunks(places=places)[0].task
    fewer = small_maps.chunks(places={"s1": places["s1"][:2], "a1": places["a1"]})[0].task
    another = small_maps.chunks(seed=1)[0].task
    assert moved == first == fewer != another
    assert len({task.content for task in (first, moved, fewer, another)}) == 4
    assert chunking._plan(moved) is chunking._plan(first)


DISTRIBUTIONS = [
    dist.Uniform(0.0, 1.0),
    dist.Uniform(0.0, 2.0),
    dist.Uniform(np.zeros(1), 1.0),
    dist.LogUniform(1.0, 2.0),
    dist.LogUniform(1.0, 3.0),
    dist.TruncatedNormal(0.0, 1.0, low=0.0),
    dist.TruncatedNormal(0.0, 1.0, low=0.1),
    dist.Normal(0.0, 1.0).expand([3]),
    dist.Normal(0.0, 1.0).expand([3]).to_event(1),
    dist.MixtureSameFamily(dist.Categorical(np.array([0.4, 0.6])), dist.Normal(np.arange(2.0), 1)),
    dist.MixtureSameFamily(dist.Categorical(np.array([0.6, 0.4])), dist.Normal(np.arange(2.0), 1)),
    dist.MixtureSameFamily(dist.Categorical(np.array([0.6, 0.4])), dist.Normal(np.arange(2.0), 2)),
]
VALUES = [
    np.zeros(4),
    np.zeros((2, 2)),
    np.zeros((4, 1)),
    np.zeros(4, np.int64),
    np.zeros(8, np.float32),
    np.array(["a", "bc"]),
    np.array(["ab", "c"]),
    np.array(["ab", "c"], object),
    ["a", "bc"],
    ["ab", "c"],
    ("ab", "c"),
    {"a": 1, "b": 2},
    {"b": 2, "a": 1},
    {1, 2},
    0,
    0.0,
    False,
    None,
    "",
    b"",
    "None",
    np.sin,
    cut,
    foreign,
    dist.Normal,
    range(3),
    range(4),
]


@pytest.mark.parametrize("values", [DISTRIBUTIONS, VALUES])
def test_content_that_differs_has_another_name(values):
    names = [content_hash(value) for value in values]
    assert len(set(names)) == len(names)
    assert names == [content_hash(value) for value in values]


USER_CLASS = """
import equinox as eqx

class Own(eqx.Module):
    factor: float = 1.0

    def value(self):
        return self.factor * 2.0
"""


def test_the_text_of_a_class_of_the_user_is_in_the_name(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    hashes = []
    for number, text in enumerate(
        [USER_CLASS, USER_CLASS.replace("2.0", "3.0"), USER_CLASS.replace("2.0", "4.0")]
    ):
        (tmp_path / f"own_{number}.py").write_text(text)
        user_class = __import__(f"own_{number}").Own
        user_class.__module__ = "own"
        monkeypatch.setitem(sys.modules, "own", sys.modules[f"own_{number}"])
        hashes.append(content_hash(user_class()))
    assert len(set(hashes)) == 3


# Executors.


def test_threads_and_processes_find_the_same_bit_for_bit(full_map, processes):
    with ThreadPoolExecutor(2) as threads:
        assert computed(executor=threads).identical(full_map)
    shares = []
    assert computed(executor=processes, progress=shares.append).identical(full_map)
    np.testing.assert_allclose(shares, np.arange(CELLS + 1) / CELLS)


@pytest.fixture
def helped(monkeypatch):
    """Processes in which chunks are computed where this one may have a helper."""
    monkeypatch.setattr(loky, "cpu_count", lambda: 2)
    monkeypatch.setattr(_processes, "_alone", False)
    monkeypatch.setattr(evaluation, "LEAST_SHARED", CELLS)
    monkeypatch.setattr(evaluation, "compute_packed", small_maps.where)
    helpers, _ = _processes.started_helpers()
    helpers.submit(os.getpid).result()
    yield
    loky.get_reusable_executor().shutdown(kill_workers=True)


def test_a_large_map_is_shared_with_helpers(helped):
    processes = computed()["information_gain"].values
    assert np.unique(processes).size == 2 and os.getpid() in processes


def test_what_helpers_find_is_the_same_and_kept(helped, full_map, store, counted, monkeypatch):
    monkeypatch.setattr(evaluation, "compute_packed", chunking.compute_packed)
    for path in list(store.iterdir()):
        path.unlink()
    assert computed(store=store).identical(full_map)
    assert not counted and len(list(store.iterdir())) == CELLS


def test_what_cannot_travel_is_computed_here(helped, counted):
    class Inner(information.KernelGain):
        """A class that no other process can import."""

    cells = bp.information_map(
        bar.placed(0.3, 0.3, None), small_maps.PLACES, estimator=Inner(128, 64), chunk=1
    )
    assert len(counted) == CELLS and cells["information_gain"].notnull().all()


def test_a_task_is_packed_once():
    first, second, *_ = small_maps.chunks()
    assert first.packed().task is second.packed().task
    unpacked = chunking._unpacked(first.packed().task)
    assert unpacked.content == first.task.content
    assert chunking._unpacked(second.packed().task) is unpacked


def test_few_chunks_are_submitted_at_once(full_map, monkeypatch):
    monkeypatch.setattr(_parts, "IN_FLIGHT", 3)
    submitted, running = set(), []

    class Few(Executor):
        def submit(self, fn, /, *args):
            future = threads.submit(fn, *args)
            submitted.add(future)
            running.append(sum(not chunk.done() for chunk in submitted))
            return future

    with ThreadPoolExecutor(1) as threads:
        assert computed(executor=Few()).identical(full_map)
    assert len(running) == CELLS and max(running) <= 3


def test_a_chunk_that_was_filled_up_is_cut(monkeypatch):
    monkeypatch.setattr(evaluation, "compute_packed", lambda packed: packed.candidates)
    chunks = small_maps.chunks(size=5)
    for chunk, gain in evaluation._computed(chunks, Breaking(9)):
        np.testing.assert_array_equal(gain, chunk.candidates[: len(chunk.cells)])
    assert [len(chunk.cells) for chunk in chunks] == [5, 5, 2]


class Stopped(BaseException):
    """Somebody stops a run."""


@pytest.mark.parametrize("error", [KeyboardInterrupt, Stopped])
def test_nothing_is_left_waiting_when_a_run_is_stopped(error, monkeypatch):
    futures = []
    monkeypatch.setattr(evaluation, "compute_packed", small_maps.slowly)

    def stop(share):
        if share > 0:
            raise error

    class Noting(Executor):
        def submit(self, fn, /, *args):
            futures.append(threads.submit(fn, *args))
            return futures[-1]

    with ThreadPoolExecutor(1) as threads:
        with pytest.raises(error):
            computed(executor=Noting(), progress=stop)
        # The only thread may just have one in hand.
        unfinished = [future for future in futures if not future.done()]
        assert len(futures) == CELLS and len(unfinished) <= 1
        assert all(future.running() for future in unfinished)
    assert sum(future.cancelled() for future in futures) >= CELLS - 4


def test_an_error_in_a_worker_arrives_in_words(processes, tmp_path, monkeypatch):
    monkeypatch.setattr(evaluation, "compute_packed", small_maps.fail)
    with pytest.raises(ValueError, match="Stiffness was given as zero"):
        computed(executor=processes, store=tmp_path)
    assert 1 <= len(list(tmp_path.iterdir())) < CELLS - 2  # what came before is kept


def test_what_cannot_travel_is_refused(processes):
    class Inner(Estimator):
        replicates: int = 4

        def typical(self):
            return {}

        def plan(self, experiment, seed, moved=()):
            return information.KernelGain(draws=8, placement_draws=8).plan(experiment, seed)

    with pytest.raises(ValueError, match=r"cannot be sent to another process: .*Inner"):
        bp.information_map(
            bar.placed(0.3, 0.3, None), {"s1": [0.2]}, estimator=Inner(), executor=processes
        )


MODEL = """
import equinox as eqx
import numpy as np
from bayes_placement.design.information import KernelGain
from bayes_placement.design.information.estimator import Estimator
from models import bar

class Mine(Estimator):
    replicates: int = eqx.field(static=True, default=4)

    def typical(self):
        return {}

    def plan(self, experiment, seed, moved=()):
        return KernelGain(draws=64, placement_draws=32).plan(experiment, seed)

mine = Mine()
experiment = bar.placed(0.3, 0.3, None)
"""


def test_a_class_that_workers_cannot_import_is_named(processes, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MODEL)
    experiment = read(path).experiment
    mine = sys.modules["_model_mine"].mine
    with pytest.raises(RuntimeError, match=r"No module named '_model_mine'. Classes of your own"):
        bp.information_map(experiment, {"s1": [0.2]}, estimator=mine, executor=processes)


# Lost workers, killed runs.


@pytest.fixture
def numbered(monkeypatch):
    """Chunks of which a number is sent and nothing else, so that workers need no JAX."""
    monkeypatch.setattr(chunking.Chunk, "packed", lambda chunk: int(chunk.cells[0]))
    return small_maps.chunks()


TENS = [(number, 10 * number) for number in range(CELLS)]


class Breaking(Executor):
    """Breaks once it was given so many, and then takes no more."""

    def __init__(self, count):
        self.left = count

    def submit(self, fn, /, *args):
        self.left -= 1
        future = Future()
        if self.left < -1:
            raise BrokenProcessPool("a process ended")
        if self.left < 0:
            future.set_exception(BrokenProcessPool("a process ended"))
        else:
            future.set_result(fn(*args))
        return future

    def shutdown(self, wait=True, **_):
        """Nothing runs."""


@pytest.mark.long
def test_a_lost_worker_is_replaced(numbered, tmp_path, monkeypatch):
    marker = tmp_path / "killed"
    monkeypatch.setattr(evaluation, "compute_packed", partial(at_work.stop_once, marker))
    with bp.design.workers(1) as executor:
        results = list(evaluation._computed(numbered, executor))
        assert executor.submit(os.getpid).result() != int(marker.read_text())
    assert sorted((int(chunk.cells[0]), int(ten[0])) for chunk, ten in results) == TENS


@pytest.fixture
def breaking(numbered, monkeypatch):
    """Results of workers whose pools break once they were given so many."""
    monkeypatch.setattr(evaluation, "compute_packed", lambda number: np.array([10 * number]))

    def results(count):
        monkeypatch.setattr(WorkerProcesses, "_new_pool", lambda self: Breaking(count))
        with bp.design.workers(1) as executor:
            return list(evaluation._computed(numbered, executor))

    return results


def test_workers_that_are_lost_are_replaced(breaking):
    assert sorted((int(chunk.cells[0]), int(ten[0])) for chunk, ten in breaking(2)) == TENS


def test_workers_that_are_lost_again_and_again_are_given_up(breaking):
    with pytest.raises(RuntimeError, match=r"A worker was lost.* same store.*may lack memory"):
        breaking(0)


def test_another_pool_that_breaks_leaves_what_was_finished(full_map, tmp_path, counted):
    with pytest.raises(RuntimeError, match=r"A worker was lost.* same store"):
        computed(executor=Breaking(5), store=tmp_path)
    assert len(list(tmp_path.iterdir())) == 5
    assert computed(store=tmp_path).identical(full_map) and len(counted) == CELLS - 5


@pytest.mark.long
def test_a_run_that_is_killed_goes_on(full_map, tmp_path, counted):
    before, _ = killed.killed_half_way(tmp_path)

    def run_again():
        assert computed(store=tmp_path / "store").identical(full_map)

    killed.goes_on(tmp_path, before, run_again, counted)


@pytest.mark.long
def test_workers_end_with_the_process_that_began_them(tmp_path):
    log = tmp_path / "log"
    with killed.begun("at_work", log) as process:
        killed.until(lambda: log.exists() and len(log.read_text().splitlines()) == 2)
        killed.kill(process)
    for worker in log.read_text().split():
        killed.until(lambda worker=worker: killed.gone(int(worker)), seconds=10)


# Workers.


def test_none_is_this_process():
    with bp.design.workers() as executor:
        assert executor is None


def test_each_worker_takes_its_share_of_the_cores(processes):
    share = max(1, os.cpu_count() // 2)
    assert int(processes.submit(os.getenv, "PJRT_NPROC").result()) == share
    libraries = processes.submit(threadpool_info).result()
    assert libraries and {library["num_threads"] for library in libraries} == {share}
    assert os.getenv("PJRT_NPROC") == MANY  # here nothing has changed


def test_less_than_one_worker_is_refused():
    with pytest.raises(ValueError, match=r"0 workers were asked for; at least one is needed"):
        bp.design.workers(0)
