"""`results`: what is kept of each model, and what may go."""

import json

import pytest
from typer.testing import CliRunner

from bayes_placement.cli import results as _user_cache
from bayes_placement.cli.app import app

FIT = f"{'0a' * 32}.npz"


FITS = "bayes_placement/fits-1"


@pytest.fixture
def kept(tmp_path, monkeypatch):
    monkeypatch.setattr(_user_cache, "cache_directory", lambda: tmp_path)
    run_of_bar = "results/bar/improve-1/run.json"
    for name in (run_of_bar, f"{FITS}/{FIT}", f"{FITS}/mine.npz", f"other/{FIT}"):
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(bytes(2_000_000))
    return tmp_path


def run(*words):
    done = CliRunner().invoke(app, ["results", *map(str, words)])
    assert done.exit_code == 0, (done.output, done.exception)
    return done.stdout


def test_age_and_sizes_are_told(kept):
    (row,) = json.loads(run(kept / "results", "--json"))["result"]["models"]
    assert row == {
        "model": "bar",
        "runs": "1",
        "latest [days]": "0.0",
        "results [MB]": "2.0",
    }
    told = f"1 fit, 2.0 MB, the oldest of 0.0 days, in {kept / 'bayes_placement'}; --clean deletes"
    assert told in run(kept / "results")
    assert (kept / FITS / FIT).exists()


def test_fits_are_deleted_and_nothing_else(kept):
    before = {path for path in kept.rglob("*") if path.is_file()}
    assert "Deleted: 1 fit, 2.0 MB" in run(kept / "results", "--clean")
    gone = before - set(kept.rglob("*"))
    assert gone == {kept / FITS / FIT}


def test_no_results_are_a_sentence(tmp_path):
    assert "No results are in" in run(tmp_path / "nowhere")
