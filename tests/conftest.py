"""Shapes and types of every annotation in the package are checked while tests run.

Most of their time is compilation: it is done with few optimisations, once for all processes.
"""

import gc
import os
import sys
from importlib.metadata import version
from pathlib import Path

# Each worker has one thread for dense algebra: they share the cores. Read when NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
# And one of JAX: handing small functions to idle threads took a seventh of the time.
os.environ.setdefault("PJRT_NPROC", "1")
# Searches have no helpers: the workers of pytest take all cores.
os.environ.setdefault("LOKY_MAX_CPU_COUNT", "1")

import pytest

# Read by JAX when it is imported, here and in every process that a test starts.
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "1")
os.environ.setdefault(
    "JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[1] / ".pytest_cache" / "jax")
)
os.environ.setdefault("MPLCONFIGDIR", str(Path(__file__).parents[1] / ".pytest_cache" / "fonts"))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_TRACEBACK_IN_LOCATIONS_LIMIT", "0")  # of each operation, for profilers

# Without the emitters of fused loops a function compiles in half of the time; compiled in one
# piece, functions that differ by what is zero round alike. A compiler that does not know a flag
# ends the process, so that the flags are given only to that with which they were tried.
if version("jaxlib").startswith("0.10."):
    flags = "--xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=1"
    os.environ.setdefault("XLA_FLAGS", flags)

# Traced functions are made of many small objects that stay: a tenth of the time went to looking for
# garbage among them.
gc.set_threshold(100_000, 50, 50)

# The hook rewrites modules as they are imported; one imported before it would go unchecked.
assert "bayes_placement" not in sys.modules, "bayes_placement was imported before conftest.py"
# Where jaxtyping is switched off by its own variable, what it would wrap costs time for nothing.
if os.environ.get("JAXTYPING_DISABLE", "0") != "1":
    from tests.annotation_checks import check_annotations  # imports JAX, which reads the variables

    check_annotations("bayes_placement")


HAS_ROOM = pytest.StashKey[bool]()


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session):
    """Run all tests below one frame that has room for the frames of whatever they call."""
    if HAS_ROOM in session.stash:
        return None  # pytest goes on with what runs the tests
    session.stash[HAS_ROOM] = True
    return call_with_room(session.config.hook.pytest_runtestloop, session)


def call_with_room(hook, session):
    return hook(session=session)


# Python 3.11 keeps frames in pieces of 16 KB. Calls from the last frame of a piece map and unmap
# the next one each time: an eighth of the time of all tests. A large frame gets a large piece.
call_with_room.__code__ = call_with_room.__code__.replace(co_stacksize=2**17 + 1)


def pytest_sessionfinish():
    """Leave what stays to the end of the process: pytest looks for garbage among it twice."""
    gc.freeze()


@pytest.fixture(scope="module")
def optimised():
    """Functions of a module are compiled to run fast, where running takes longer than compiling."""
    import jax  # only now, once its variables are set

    name = "jax_disable_most_optimizations"
    before = jax.config.values[name]
    jax.config.update(name, False)
    yield
    jax.config.update(name, before)


@pytest.fixture(scope="session", autouse=True)
def caches(tmp_path_factory):
    """Fits of commands are kept for this session alone, and not among those of the user."""
    os.environ["XDG_CACHE_HOME"] = str(tmp_path_factory.mktemp("caches"))


@pytest.fixture(scope="session")
def shared_data():
    folder = (Path(__file__).parents[1] / "../shared/data").resolve()
    if not folder.is_dir():
        pytest.skip(f"the shared data is not on this machine: there is no {folder}")
    return folder
