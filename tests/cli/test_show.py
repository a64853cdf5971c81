"""`show` before anything is fitted, and `init`: a model file to begin with."""

import json

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli import init
from bayes_placement.cli.app import app
from models import bar
from tests.cli.studies import EXPERIMENT

TABLE = """name,role,x [mm],y [mm],z [mm],tolerance [mm],direction
left,sensor,120,0,0,5,
right,sensor,700,0,0,0,
hammer,actuator,400,0,0,10,
"""


def run(*words):
    done = CliRunner().invoke(app, [*map(str, words)])
    assert "Traceback" not in done.output
    return done


def test_a_model_is_shown_with_channels_places_and_frfs(tmp_path):
    path = tmp_path / "study.py"
    path.write_text(EXPERIMENT + "measurement = experiment.nominal_measurement()\n")
    done = run("show", path, "--out", tmp_path / "out")
    assert done.exit_code == 0, (done.output, done.exception)
    for piece in ("Uniform(0.02, 0.06)", "s1+x", "0.25", "within=0.04", "exact"):
        assert piece in done.output
    table = pd.read_csv(tmp_path / "out" / "channels.csv", index_col=0)
    assert table.loc["s1", "recorded [m]"] == 0.25 and table.loc["a1", "kind"] == "Actuator"
    names = {file.name for file in (tmp_path / "out").iterdir()}
    assert names == {"channels.csv", "geometry.png", "frf_1.png", "run.json"}


def test_a_sensor_and_an_actuator_may_share_a_name(tmp_path):
    """Universal files call response and reference of a driving point by one number."""
    path = tmp_path / "study.py"
    model = EXPERIMENT.replace('"s1"', '"1"').replace('"a1"', '"1"')
    path.write_text(model + "measurement = experiment.nominal_measurement()\n")
    run("show", path, "--out", tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "channels.csv")
    assert list(table["kind"]) == ["Sensor", "Actuator"]
    assert list(table["unknown"].fillna("")) == ["position", ""]
    done = run("check", path, "--report", "--out", tmp_path / "checked")
    assert done.exit_code in (0, 1), (done.output, done.exception)
    assert (tmp_path / "checked" / "report.html").is_file()


def test_a_file_is_shown_with_what_it_records(tmp_path):
    done = run("show", "models/hidden_effect.uff", "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, (done.output, done.exception)
    content = json.loads(done.stdout)
    assert content["verdict"].startswith("Measurement: accelerance")
    assert "s1 at (0.16, 0, 0) m" in content["result"]["positions"]
    channels = {row["channel"]: row for row in content["result"]["channels"]}
    assert channels["s1+x"] == {
        "channel": "s1+x",
        "kind": "Sensor",
        "recorded [m]": "(0.16, 0, 0)",
    }
    assert (tmp_path / "out" / "channels.csv").is_file()
    assert (tmp_path / "out" / "frf_1.png").is_file()


def test_many_pairs_become_pages():
    measurement = bp.Measurement.from_arrays(
        np.ones((3, 3, 5)),
        np.arange(1.0, 6.0),
        sensors=["s1", "s2", "s3"],
        actuators=["a1", "a2", "a3"],
        quantity="mobility",
    )
    pages = bp.plots.measurement.pages(measurement)
    assert [len(page.axes) for page in pages] == [8, 8, 2]


def test_what_is_not_there_is_a_matter_of_usage(tmp_path):
    done = run("show", tmp_path / "no.py", "--out", tmp_path / "out")
    assert done.exit_code == 2 and "There is no model file" in done.output


def test_the_structure_is_drawn_with_tolerances():
    figure = bp.plots.experiment(bar.experiment)
    assert isinstance(figure, Figure)
    (axes,) = figure.axes
    places = [line.get_xdata() for line in axes.lines if line.get_linewidth() == 5]
    widths = [np.nanmax(place) - np.nanmin(place) for place in places]
    assert widths == pytest.approx([0.08, 0.08])
    assert "[m]" in axes.get_xlabel()


@pytest.mark.parametrize("with_table", [False, True])
def test_a_new_model_can_be_read_and_shown(tmp_path, with_table):
    (tmp_path / "channels.csv").write_text(TABLE)
    words = ("--channels", tmp_path / "channels.csv") if with_table else ()
    done = run("init", tmp_path / "new", *words)
    assert done.exit_code == 0, (done.output, done.exception)
    path = tmp_path / "new" / "model.py"
    assert f"Next: bayes-placement show {path}" in done.output.replace("\n", " ")
    experiment = bp.io.model.read(path).experiment
    if with_table:
        assert [*experiment.sensor] == ["left", "right"]
        assert experiment.sensor["left"].recorded == pytest.approx(0.12)
        names = [unknown.name for unknown in experiment.unknowns if unknown.is_placement]
        assert names == ["sensor.left.position", "actuator.hammer.position"]
    assert "CHANGE" in path.read_text()


def test_a_model_is_not_replaced_by_a_new_one(tmp_path):
    assert run("init", tmp_path).exit_code == 0
    before = (tmp_path / "model.py").read_text()
    done = run("init", tmp_path)
    assert done.exit_code == 2 and "is there already" in done.output
    assert (tmp_path / "model.py").read_text() == before


@pytest.mark.parametrize("with_table", [False, True])
def test_a_new_mapping_and_a_file_of_frfs_become_a_case(tmp_path, with_table):
    lines = np.linspace(100.0, 400.0, 5)
    measurement = bp.Measurement.from_arrays(
        np.ones((2, 1, 5), complex),
        lines,
        sensors=["1+x", "2+x"],
        actuators=["3+x"],
        quantity="accelerance",
        coherence=np.full((2, 1, 5), 0.99),
    )
    folder, words = tmp_path / "new", []
    if with_table:
        table = tmp_path / "instruments.csv"
        table.write_text(init.EXAMPLE_TABLE.replace("600", "610"))
        words = ["--channels", table]
    done = run("init", folder, "--case", *words)
    assert done.exit_code == 0, (done.output, done.exception)
    assert f"bayes-placement import {folder} --out {folder / 'case'}" in " ".join(
        done.output.split()
    )
    bp.io.uff.write(folder / "measured.uff", measurement)
    done = run("import", folder, "--out", folder / "case")
    assert done.exit_code == 0, (done.output, done.exception)
    experiment = bp.io.case.read(folder / "case").experiment
    assert list(experiment.unknown)[:2] == [
        "structure.modes.youngs_modulus",
        "structure.damping.ratio",
    ]
    assert experiment.sensor["s2"].recorded == (0.61 if with_table else 0.6)
    done = run("init", folder, "--case")
    assert done.exit_code == 2
    assert "is there already" in done.output


def test_a_model_as_drawn_is_shown_with_the_data(tmp_path, monkeypatch):
    drawn = []
    pages = bp.plots.measurement.pages
    monkeypatch.setattr(
        bp.plots.measurement, "pages", lambda *args, **kw: drawn.append(kw) or pages(*args, **kw)
    )
    path = tmp_path / "study.py"
    path.write_text(EXPERIMENT)
    study = bp.io.model.read(path)
    heavier = study.experiment + bp.effects.point_mass(0.4, 0.5)
    bp.io.uff.write(tmp_path / "measured.uff", heavier.nominal_measurement())
    done = run("show", path, "--data", tmp_path / "measured.uff", "--out", tmp_path / "out")
    assert done.exit_code == 0, (done.output, done.exception)
    (given,) = drawn
    np.testing.assert_allclose(given["model"].frf, study.experiment.nominal_measurement().frf)
    done = run("show", tmp_path / "measured.uff", "--data", tmp_path / "measured.uff")
    assert done.exit_code == 2 and "drawn with the data" in done.output
