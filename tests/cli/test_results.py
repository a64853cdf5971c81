"""`results`: what is kept of each model, and what may go."""

import json

import pytest
from typer.testing import CliRunner

from bayes_placement.cli.app import app

FIT = f"{'0a' * 32}.npz"


@pytest.fixture
def kept(tmp_path):
    for name in ("bar/improve-1/run.json", f"bar/fits/{FIT}", "bar/fits/mine.npz", f"other/{FIT}"):
        file = tmp_path / "results" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(bytes(2_000_000))
    return tmp_path / "results"


def run(*words):
    done = CliRunner().invoke(app, ["results", *map(str, words)])
    assert done.exit_code == 0, (done.output, done.exception)
    return done.stdout


def test_age_and_sizes_are_told(kept):
    (row,) = json.loads(run(kept, "--json"))["result"]["models"]
    assert row == {
        "model": "bar",
        "runs": "1",
        "latest [days]": "0.0",
        "results [MB]": "2.0",
        "fits": "1",
        "fits [MB]": "2.0",
    }
    assert "1 fits, 2.0 MB, which --clean deletes" in run(kept)
    assert (kept / "bar" / "fits" / FIT).exists()


def test_fits_are_deleted_and_nothing_else(kept):
    before = {path for path in kept.rglob("*") if path.is_file()}
    run(kept, "--clean")
    gone = before - set(kept.rglob("*"))
    assert gone == {kept / "bar" / "fits" / FIT}


def test_no_results_are_a_sentence(tmp_path):
    assert "No results are in" in run(tmp_path / "nowhere")
