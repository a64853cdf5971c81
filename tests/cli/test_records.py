"""Each run has a folder of its own, and a record of what it was given and has written."""

import hashlib
import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.cli import _result_folder, _run
from bayes_placement.cli._terminal import Screen
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT

MEASUREMENT = "measurement = experiment.nominal_measurement()\n"
ENGINE = "engine = bp.engines.Importance(draws=60)\n"
WORDS = ("update", "--engine", "importance", "--seed", "3")


@pytest.fixture
def model(tmp_path, monkeypatch):
    """A model file in the present folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "study.py"
    path.write_text(EXPERIMENT + ENGINE + MEASUREMENT)
    return path


def record_in(folder, command="update"):
    return json.loads((Path(folder) / "run.json").read_text())[command]


def sha256(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def test_every_run_has_a_new_folder_told_in_the_last_line(model):
    runs = [CliRunner().invoke(app, [*WORDS, "study.py"]) for _ in range(2)]
    assert [done.exit_code for done in runs] == [0, 0], runs[0].output
    folders = [Path("results/study/update-1"), Path("results/study/update-2")]
    for done, folder in zip(runs, folders, strict=True):
        assert done.output.splitlines()[-1] == f"Results are in {folder}/"
        assert (folder / "result.nc").is_file()


def test_every_model_file_has_a_folder_of_its_own(model):
    folders = []
    for folder in (model.parent / "one", model.parent / "two"):
        folder.mkdir()
        file = folder / "model.py"
        file.write_text("")
        with _result_folder.result_folder(file, "check", None) as results:
            begun("check", file, results.path).text("misfit.txt", "first")
        folders.append(str(results.path.relative_to(model.parent)))
    assert folders == ["results/model/check-1", "results/two_model/check-1"]
    with _result_folder.result_folder(file, "check", None) as results:
        assert results.path == Path("results/two_model/check-2").absolute()


def test_the_record_says_what_was_given_and_written(model):
    CliRunner().invoke(app, [*WORDS, "study.py"])
    record = record_in("results/study/update-1")
    assert record["model"] == {"path": str(model), "sha256": sha256(model)}
    assert record["finished"] is True
    assert record["seed"] == 3
    assert record["units"] == "SI"
    assert record["versions"]["bayes_placement"] == bp.__version__
    assert record["settings"]["engine"] == "importance"
    assert record["date"].endswith("+00:00")
    written = {path.name for path in Path("results/study/update-1").iterdir()}
    assert set(record["files"]) | {"run.json"} == written


def test_data_that_a_model_reads_are_in_the_record(model):
    bp.io.uff.write("measured.uff", bp.io.model.read(model).measurement)
    data = "measurement = bp.io.uff.read('measured.uff', require_positions=False)\n"
    model.write_text(EXPERIMENT + ENGINE + data)
    done = CliRunner().invoke(app, [*WORDS, "study.py"])
    assert done.exit_code == 0, done.output
    (file,) = record_in("results/study/update-1")["data"]
    assert file == {"path": str(Path("measured.uff").resolve()), "sha256": sha256("measured.uff")}


def test_results_of_another_model_are_not_replaced(model):
    first = CliRunner().invoke(app, [*WORDS, "study.py", "--out", "mine"])
    assert first.exit_code == 0, first.output
    before = sha256("mine/result.nc")
    Path("other.py").write_text(EXPERIMENT + MEASUREMENT)
    done = CliRunner().invoke(app, [*WORDS, "other.py", "--out", "mine"])
    assert done.exit_code == 2
    assert "holds results of another model" in done.output
    assert "--out mine_other" in done.output
    assert sha256("mine/result.nc") == before


def begun(command, model, out):
    """A run into a folder that may be there already."""
    folder = _result_folder.ResultFolder(out, out)
    return _run.Output(folder).begin(command, model)


def test_a_folder_may_hold_several_commands_and_later_runs_of_one_model(model, tmp_path):
    out = tmp_path / "mine"
    runs = [begun(command, model, out) for command in ("check", "improve")]
    runs[0].text("misfit.txt", "first")
    runs[1].text("ledger.txt", "second")
    assert record_in(out, "check")["files"] == ["misfit.txt"]
    assert record_in(out, "improve")["files"] == ["ledger.txt"]
    model.write_text("changed = True\n")
    begun("check", model, out).text("misfit.csv", "third")
    assert record_in(out, "check")["files"] == ["misfit.csv"]
    assert record_in(out, "check")["finished"] is False


def test_a_model_that_was_moved_is_the_same(model, tmp_path):
    begun("check", model, tmp_path / "mine").text("misfit.txt", "first")
    moved = model.rename(tmp_path / "moved.py")
    with _result_folder.result_folder(moved, "check", tmp_path / "mine"):
        pass
    moved.write_text("other = True\n")
    with (
        pytest.raises(InputError, match=r"another model.*study\.py"),
        _result_folder.result_folder(moved, "check", tmp_path / "mine"),
    ):
        pass


def test_figures_are_written_by_an_idle_helper_and_listed_once_they_are_there(
    model, tmp_path, monkeypatch
):
    begin, awaited = [], []

    def begun_in_helper(function, *arguments):
        begin.append((function, arguments))
        return lambda: awaited.append(function(*arguments))

    monkeypatch.setattr(_run, "begun_in_helper", begun_in_helper)
    run = begun("show", model, tmp_path / "mine")
    run.figures(lambda: {"first.png": Figure(), "second.png": Figure()})
    run.within("state_1").figures(lambda: {"third.png": Figure()})
    run.text("words.txt", "later")
    assert len(begin) == 3 and run.files == ["words.txt"]
    (path, _), *_ = (arguments for _, arguments in begin)
    assert path == tmp_path / "mine" / "first.png" and not path.exists()
    run.finish(Screen.of(True, False), "It fits.", {})
    assert sorted(run.files) == ["first.png", "second.png", "state_1/third.png", "words.txt"]
    assert len(awaited) == 3 and all((tmp_path / "mine" / file).is_file() for file in run.files)
    assert record_in(tmp_path / "mine", "show")["files"] == run.files


@pytest.mark.parametrize("content", ["", "[]", "{", '{"check": 1}'])
def test_a_record_that_cannot_be_read_is_none(model, tmp_path, content):
    out = tmp_path / "mine"
    out.mkdir()
    (out / "run.json").write_text(content)
    with _result_folder.result_folder(model, "check", out):
        begun("check", model, out).text("misfit.txt", "first")
    assert record_in(out, "check")["files"] == ["misfit.txt"]


def test_parts_of_a_run_are_files_of_its_record(model, tmp_path):
    run = begun("improve", model, tmp_path / "mine")
    run.within("state_1").json("ledger.json", {"record": {"seed": 5}, "verdict": []})
    assert run.files == ["state_1/ledger.json"]
    content = json.loads((tmp_path / "mine" / "state_1" / "ledger.json").read_text())
    assert content["record"]["model"]["path"] == str(model)
    assert "files" not in content["record"]


def test_a_stopped_run_says_which_parts_it_shares_with_the_next(model):
    command = ["place", "study.py", "--places", "2", "--search", "sequential"]
    first = CliRunner().invoke(app, command)
    assert first.exit_code == 0, first.output
    shared = Path("results/study/chunks")
    assert len([*shared.iterdir()]) > 0
    results = _result_folder.ResultFolder(Path("results/study/place-2"), Path("results/study"))
    assert f"in {shared}/" in _result_folder._words_on_kept(results, {})
