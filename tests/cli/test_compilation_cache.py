"""The compilation cache of the command: reuse, runs at once, unusable directories."""

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bayes_placement.cli import _command
from bayes_placement.cli import results as _user_cache
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT

ROOT = Path(__file__).parents[2]
SMALL = EXPERIMENT + "measurement = experiment.nominal_measurement()\n"
ENGINE = "engine = bp.engines.Importance(draws=60)\n"
TIME = "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"
COMMAND = Path(sys.executable).parent / "bayes-placement"


def started(folder, cache, *options, hash_seed="0"):
    """Start the command in a separate process, with a cache directory of its own."""
    words = ["update", str(folder / "study.py"), "--engine", "importance", *options]
    known = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "TF_CPP_", "XDG_"))}
    return subprocess.Popen(
        [COMMAND, *words],
        env=known
        | {
            "XDG_CACHE_HOME": str(cache),
            "PYTHONPATH": str(ROOT),
            "JAX_DISABLE_MOST_OPTIMIZATIONS": "1",
            # Sets are in another order: what comes of one must not reach a program.
            "PYTHONHASHSEED": hash_seed,
            # Which compilations take long enough to be kept depends on what else runs.
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
    )


def ended(process):
    output, errors = process.communicate()
    assert process.returncode == 0, output
    others = [line for line in errors.splitlines() if not line.startswith("latent importance")]
    assert not others, errors
    return output


def files(cache):
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*-cache")}


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="the cache directory of Linux")
def test_a_second_run_compiles_nothing_and_two_at_once_do_no_harm(tmp_path):
    (tmp_path / "study.py").write_text(SMALL + ENGINE)
    processes = [started(tmp_path, tmp_path / "cache", "--out", name) for name in ("one", "two")]
    assert all("Results are in" in ended(process) for process in processes)
    cached = files(tmp_path / "cache")
    assert cached
    ended(started(tmp_path, tmp_path / "cache", "--out", "three", hash_seed="1"))
    assert files(tmp_path / "cache") == cached
    numbers = {(tmp_path / name / "parameters.csv").read_text() for name in ("one", "three")}
    assert len(numbers) == 1


def test_there_is_no_cache_where_none_is_wanted(monkeypatch, tmp_path):
    used = []
    monkeypatch.setattr(_command, "use_compilation_cache", lambda: used.append(True))
    for options in (("--no-cache",), ()):
        CliRunner().invoke(app, ["update", str(tmp_path / "none.py"), *options])
    assert used == [True]


def folder_of(monkeypatch, cache):
    monkeypatch.setattr(_user_cache, "cache_directory", lambda: cache)
    return _user_cache.cache_folder("jax-0.0")


def test_a_directory_that_cannot_be_made_is_no_cache(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    assert folder_of(monkeypatch, tmp_path / "file") is None


def test_without_a_home_there_is_no_cache(monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert _user_cache.cache_folder("jax-0.0") is None


def test_only_its_owner_may_write_what_is_executed(monkeypatch, tmp_path):
    folder = folder_of(monkeypatch, tmp_path)
    assert folder.parent == tmp_path / "bayes_placement"
    assert folder.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("system", "variables", "expected"),
    [
        ("linux", {}, "home/.cache"),
        ("linux", {"XDG_CACHE_HOME": "elsewhere"}, "elsewhere"),
        ("darwin", {}, "home/Library/Caches"),
        ("win32", {}, "home/AppData/Local"),
        ("win32", {"LOCALAPPDATA": "elsewhere"}, "elsewhere"),
    ],
)
def test_the_cache_directory_is_that_of_the_system(monkeypatch, system, variables, expected):
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(Path, "home", lambda: Path("home"))
    assert _user_cache.cache_directory() == Path(expected)


def test_a_cache_that_the_user_has_chosen_is_kept(monkeypatch):
    import jax

    chosen = jax.config.values["jax_compilation_cache_dir"]
    assert chosen  # by tests/conftest.py
    monkeypatch.setattr(_command, "cache_folder", lambda name: pytest.fail("not asked for"))
    _command.use_compilation_cache()
    assert jax.config.values["jax_compilation_cache_dir"] == chosen


def test_old_files_are_deleted(tmp_path):
    (tmp_path / "jax-0.1").mkdir()
    old, young = (tmp_path / "jax-0.1" / f"{name}-cache" for name in ("old", "young"))
    for file in (old, young):
        file.write_text("")
    past = time.time() - _user_cache.OLDEST_FILE - 1
    os.utime(old, (past, past))
    _user_cache.delete_old_files(tmp_path.glob("*/*-cache"))
    assert young.exists() and not old.exists()


@pytest.mark.parametrize(("chosen", "used"), [({}, 0.01), ({TIME: "0.5"}, 0.5)])
def test_short_compilations_are_kept_whoever_imports_jax_first(chosen, used, tmp_path):
    others = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    code = """
        import jax
        from bayes_placement.cli._command import use_compilation_cache
        use_compilation_cache()
        print(jax.config.values["jax_persistent_cache_min_compile_time_secs"])
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env=others | chosen | {"XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(done.stdout) == used
