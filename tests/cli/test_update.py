"""What `bayes-placement update` answers, writes and refuses; its help loads nothing heavy."""

import subprocess
import sys
import warnings

import numpy as np
import pytest
from pandas import DataFrame, read_csv
from rich.console import Console
from typer.testing import CliRunner
from xarray import DataTree

import bayes_placement as bp
from bayes_placement._shared.labels import ABOUT
from bayes_placement.cli import _run
from bayes_placement.cli import update as commands
from bayes_placement.cli.app import app
from bayes_placement.inference import cross_check
from bayes_placement.inference.infer import InferenceWarning
from tests.plots.test_posterior import many_parameters

MODEL = """
import numpyro.distributions as dist
import bayes_placement as bp

modes = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal([dist.Uniform(0.02, 0.06)])),
    sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency=[150.0, 166.0],
    observe=bp.observe.LogAmplitude("velocity"),
    noise=bp.noise.Gaussian(0.05),
)
"""
ENGINE = "engine = bp.engines.Importance(draws=60)\n"
MEASUREMENT = "measurement = experiment.nominal_measurement()\n"
KDE = ("--engine", "importance", "--marginal", "kde")


def run(*words):
    return CliRunner().invoke(app, ["update", *map(str, words)])


def written(folder, text):
    path = folder / "study.py"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """A finished run: its folder, with the model in it, and what it said."""
    folder = tmp_path_factory.mktemp("run")
    model = written(folder, MODEL + ENGINE + MEASUREMENT)
    done = run(model, *KDE, "--out", folder / "out", "--seed", 3)
    assert done.exit_code == 0, done.output
    return folder, done.output


COMMANDS = ("update", "check", "explain", "improve", "place", "show", "init")


def test_help_lists_the_commands():
    answer = CliRunner().invoke(app, ["--help"])
    assert answer.exit_code == 0
    for command in COMMANDS:
        assert command in answer.output


def test_help_and_init_answer_without_loading_anything_heavy(tmp_path):
    words = [*([command, "--help"] for command in COMMANDS), ["init", str(tmp_path / "new")]]
    program = (
        "import sys; from typer.testing import CliRunner; from bayes_placement.cli.app import app; "
        f"assert not any(CliRunner().invoke(app, each).exit_code for each in {words}); "
        "heavy = {'jax', 'numpyro', 'numpy', 'scipy', 'xarray', 'pandas', 'matplotlib'}; "
        "sys.exit(' '.join(heavy & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_run_writes_result_tables_and_figures(first):
    folder, _ = first
    assert sorted(path.name for path in (folder / "out").iterdir()) == [
        "findings.nc",
        "intervals.png",
        "measured_against_band.png",
        "parameters.csv",
        "parameters.png",
        "placement.png",
        "result.nc",
        "run.json",
    ]
    for path in (folder / "out").glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
    table = read_csv(folder / "out" / "parameters.csv", index_col=0)
    ratio = table.loc["structure.damping.ratio.1"]
    assert 0.02 < ratio["low_95"] < ratio["mean"] < ratio["high_95"] < 0.06
    assert 0 < ratio["sd"] < 0.02 and ratio["unit"] == "1"


def test_a_run_shows_priors_figures_and_where_the_results_are(first):
    folder, output = first
    for piece in (
        "Uniform(0.02, 0.06)",
        "kde importance",
        "95 % interval",
        "100 %, took",
    ):
        assert piece in output
    assert output.splitlines()[-1] == f"Results are in {folder / 'out'}/"


def test_the_result_is_bit_for_bit_what_infer_returns_for_that_seed(first):
    folder, _ = first
    result = bp.io.netcdf.read(folder / "out" / "result.nc")
    study = bp.io.model.read(folder / "study.py")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InferenceWarning)  # the tables say the same
        expected = bp.infer(
            study.experiment,
            study.measurement,
            engine=bp.engines.Importance(draws=60),
            marginal=bp.marginals.KDE(),
            key=3,
        )
    for group in expected.children:
        assert result[group].to_dataset().identical(expected[group].to_dataset())
    for name in set(expected.attrs) - {"seconds", "date"}:
        np.testing.assert_array_equal(np.ravel(result.attrs[name]), np.ravel(expected.attrs[name]))


def test_data_from_a_file_take_the_place_of_the_models_own(first, tmp_path, monkeypatch):
    monkeypatch.setattr(_run.Run, "figures", lambda run, *drawings: None)
    folder, _ = first
    nominal = bp.io.model.read(folder / "study.py").measurement
    louder = bp.Measurement.from_arrays(
        10 * nominal.frf,
        nominal.frequency,
        sensors=nominal.sensors,
        actuators=nominal.actuators,
        quantity="mobility",
        positions={"s1": (0.25, 0.0, 0.0), "a1": (0.3, 0.0, 0.0)},
    )
    bp.io.uff.write(tmp_path / "louder.uff", louder)
    done = run(
        written(tmp_path, MODEL + ENGINE),
        "--data",
        tmp_path / "louder.uff",
        *("--engine", "importance", "--out", tmp_path),
    )
    assert done.exit_code == 0, done.output
    seen, original = (
        bp.io.netcdf.read(place / "result.nc")["observed_data"]["measured"].values
        for place in (tmp_path, folder / "out")
    )
    np.testing.assert_allclose(seen, original + 1, rtol=1e-5)


def test_a_model_that_does_not_explain_the_data_is_told_with_what_to_do_next(tmp_path, monkeypatch):
    monkeypatch.setattr(_run.Run, "figures", lambda run, *drawings: None)
    wrong = "measurement = experiment.nominal_measurement()\n" + MODEL.replace("1e9", "1.4e9")
    model = written(tmp_path, MODEL + wrong + ENGINE)
    done = run(model, "--engine", "map", "--quiet", "--out", tmp_path / "out")
    assert done.exit_code == 0, (done.output, done.exception)
    (said, _) = done.output.splitlines()
    assert said.startswith("The model fails: reduced chi-square is ")
    assert "is expected of a correct model (p " in said
    assert "Intervals of a model that fails cannot be trusted" in said
    for command in ("check", "improve"):
        assert f"`bayes-placement {command} {model}`" in said
    assert "2 unknowns are inferred by latent map" in said
    saved = bp.io.netcdf.read(tmp_path / "out" / "result.nc")
    assert said.startswith(bp.check(saved).verdict())


def test_a_model_that_explains_the_data_is_told_no_such_thing(first):
    assert "fails" not in first[1]


@pytest.mark.long
def test_figures_of_many_unknowns_are_written_on_pages():
    tree = many_parameters(61)
    kept = DataTree()
    kept.attrs[ABOUT] = '{"models": []}'
    figures = {}
    for draw in commands._drawings({"one": tree, "two": tree}, {}, kept):
        figures |= draw()
    assert sorted(figures) == [
        *("intervals.png", "intervals_2.png", "intervals_3.png", "intervals_4.png"),
        "measured_against_band.png",
        *("methods.png", "methods_2.png", "methods_3.png"),
        *("parameters.png", "parameters_2.png", "parameters_3.png"),
        "placement.png",
    ]
    assert max(figure.get_figheight() for figure in figures.values()) < 11.0 + 1e-9


def refused(*words, code=2):
    done = run(*words)
    assert done.exit_code == code
    assert "Traceback" not in done.output
    return " ".join(done.output.replace("│", " ").split())


def test_an_unknown_model_is_refused(tmp_path):
    message = refused(tmp_path / "nothing.py")
    assert message.startswith("error: There is no model file")
    assert "for example models/bar.py" in message


def test_a_model_without_data_asks_for_them(tmp_path):
    model = written(tmp_path, MODEL)
    message = refused(model, "--out", tmp_path / "out")
    assert "declares no `measurement`" in message
    assert f"bayes-placement update {model} --data measured.uff" in message
    assert not (tmp_path / "out").exists()


def test_a_missing_data_file_is_refused(tmp_path):
    assert "There is no file" in refused(written(tmp_path, MODEL), "--data", tmp_path / "no.uff")


def test_data_that_lack_a_line_are_refused(first, tmp_path):
    study = MODEL.replace("166.0", "170.0") + ENGINE
    measurement = "other = bp.io.model.read({!r}).measurement\nmeasurement = other\n"
    text = study + measurement.format(str(first[0] / "study.py"))
    words = (written(tmp_path, text), "--engine", "importance", "--out", tmp_path)
    assert "170" in refused(*words, code=3)


@pytest.mark.parametrize(
    ("option", "known"), [("--engine", "importance"), ("--marginal", "quadrature")]
)
def test_an_unknown_word_is_answered_with_the_known_ones(tmp_path, option, known):
    message = refused(written(tmp_path, MODEL + MEASUREMENT), option, "guess")
    assert "'guess' is not one of" in message
    assert known in message


def test_a_marginal_goes_with_one_engine(tmp_path):
    words = ("--engine", "all", "--marginal", "kde")
    message = refused(written(tmp_path, MODEL + MEASUREMENT), *words)
    assert "--engine smc --marginal kde" in message


SMALL = {"smc": {"particles": 80, "populations": 2, "moves": 2}, "nuts": {"warmup": 8, "draws": 8}}


@pytest.mark.long
@pytest.mark.longest
def test_methods_are_shown_and_written_as_they_come(tmp_path, monkeypatch):
    small = cross_check.SIZES | SMALL | {"importance": {"draws": 50}, "quadrature": {"nodes": 16}}
    monkeypatch.setattr(cross_check, "SIZES", small)
    infer, seen = commands.infer_posterior, []

    def watched(*arguments):
        seen.append(sorted(path.name for path in (tmp_path / "out").glob("*.nc")))
        return infer(*arguments)

    monkeypatch.setattr(commands, "infer_posterior", watched)
    monkeypatch.setattr(_run.Run, "figures", lambda run, *drawings: None)
    done = run(written(tmp_path, MODEL + MEASUREMENT), "--engine", "all", "--out", tmp_path / "out")
    assert done.exit_code == 0, (done.output, done.exception)
    nuts, kde = "result_latent_nuts.nc", "result_kde_importance.nc"
    assert seen == [[], ["result.nc"], ["result.nc", nuts], ["result.nc", kde, nuts]]
    assert "Left to do: latent nuts, kde importance, quadrature grid." in done.output
    assert "Left to do: quadrature grid." in done.output
    table = read_csv(tmp_path / "out" / "cross_check.csv")
    assert table["value"].dtype == table["standard_error"].dtype == float
    assert set(table["method"]) >= {"latent smc", "quadrature grid", "latent nuts"}
    assert "kde importance" in (tmp_path / "out" / "cross_check.txt").read_text()


def test_a_method_that_cannot_be_done_alone_is_refused(tmp_path):
    text = MODEL.replace("dist.Uniform(0.02, 0.06)", "dist.Uniform(0.02, 0.06)")
    text = text.replace("at=0.3", "at=bp.positions.Segment(0.3, within=0.04)").replace(
        'bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))',
        '*(bp.Sensor(name, at=bp.positions.Segment(0.25, within=0.04)) for name in "pqr")',
    )
    words = ("--engine", "grid", "--marginal", "latent", "--out", tmp_path / "out")
    message = refused(written(tmp_path, text + MEASUREMENT), *words, code=3)
    assert "latent grid is left out: engines.Grid(24) over 5 unknowns has 8e+06 nodes" in message
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_a_file_is_refused_before_anything_is_computed(tmp_path):
    model = written(tmp_path, MODEL + MEASUREMENT)
    message = refused(model, "--out", model)
    assert "is a file. A folder is needed" in message
    assert "Uniform" not in message


def test_an_engine_that_the_model_sizes_keeps_its_size(tmp_path):
    study = bp.io.model.read(written(tmp_path, MODEL + ENGINE))
    (method,) = commands._chosen_methods(study, "importance", None)
    (other,) = commands._chosen_methods(study, "smc", None)
    assert method.engine == bp.engines.Importance(draws=60)
    (default,) = commands._chosen_methods(study, None, None)
    assert other.engine == bp.engines.SMC(particles=1000)
    assert default.engine == bp.engines.Importance(draws=60)


@pytest.mark.parametrize(("width", "tables"), [(80, 2), (140, 1)])
def test_tables_are_as_wide_as_the_terminal(width, tables, capsys):
    unknown = "structure.damping.ratio.1"
    of_unknowns = {f"{unknown} {word}": (unknown, word) for word in ("mean", "variation")}
    figures = [*of_unknowns, "their mean"]
    row = ["0.03505 ± 0.00003", "0.0393 ± 0.0006", "12.3"]
    table = DataFrame([row] * 4, [f"method {n}" for n in range(4)], figures)
    console = Console(width=width)
    for part in commands._tables(console, table, of_unknowns):
        console.print(part)
    output = capsys.readouterr().out
    assert output.count("figure") == tables
    assert output.count("0.03505 ± 0.00003") == 4  # none is broken into two lines
    assert max(map(len, output.splitlines())) <= width
    assert output.count("structure.damping.ratio.1") == tables
    assert output.count("their mean") == tables  # a figure of no unknown stays whole
