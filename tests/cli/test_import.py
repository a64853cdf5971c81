"""`bayes-placement import`: from files of a laboratory to a named effect."""

import json
import re

import numpy as np
import pytest
import scipy.io
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli.app import app
from tests.cli.test_criticism import HIDDEN, MEASUREMENT, MODEL, written
from tests.io.mapped.test_importing import write_table

CASE = """
averages = 16
[case]
sensor_setup = "fixed"
estimator = "H1"
noise_level = { ratio = 0.01 }
[case.structure]
type = "axial bar"
length_m = 1.0
area_m2 = 1e-3
boundary_conditions = "fixed at x=0 and x=L"
motion = "axial displacement u(x), direction 1"
youngs_modulus_Pa = 1e9
density_kg_m3 = 9000.0
damping = { model = "modal viscous, the same ratio for every mode", ratio = 0.04 }
[[case.uncertain_parameters]]
name = "modal_damping_ratio"
prior = { type = "uniform", low = 0.02, high = 0.06 }
"""
MAPPING = """frf = { array = "H", axes = ["frequency", "sensor", "actuator"], unit = "mm/s/N" }
frequency = { first = 100.0, step = 30.0, unit = "Hz" }
sensors = ["s1", "s2"]
actuators = ["a1"]
"""
TABLE = [
    ["name", "role", "node", "x [mm]", "y [mm]", "z [mm]", "direction", "tolerance [mm]"],
    ["s1", "sensor", 5, 200, 0, 0, "+x", 10],
    ["s2", "sensor", 6, 600, 0, 0, "+x", 10],
    ["a1", "actuator", 7, 300, 0, 0, "+x", 0],
]


def run(*words):
    return CliRunner().invoke(app, [*map(str, words)])


def hidden_mass():
    """FRFs [m/s/N] of the bar of the case with a mass of 0.3 kg at 0.42 m, noise of 1 %."""
    modes = bp.beams.bar(40, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.035)),
        sensors=[bp.Sensor("s1", at=0.205), bp.Sensor("s2", at=0.596)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=100.0 + 30.0 * np.arange(20),
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(1e-5),
    )
    frf = (experiment + bp.effects.point_mass(0.42, 0.3)).nominal_measurement().frf
    random = np.random.default_rng(8)
    error = random.standard_normal(frf.shape) + 1j * random.standard_normal(frf.shape)
    return frf * (1 + 0.01 * error / np.sqrt(2))


def check_names_the_mass(text):
    """The ledger names the mass of 0.3 kg at 0.42 m and nothing else."""
    [verdict] = [line for line in text.splitlines() if line.startswith("- Missing: ")]
    assert verdict.startswith("- Missing: point_mass, 0.")
    sentences = " ".join(text.split())
    interval = r"([\d.]+) {} \(95 %: ([\d.]+) to ([\d.]+)\)"
    parameters = rf"at {interval.format('mm')}, mass {interval.format('kg')}"
    numbers = re.search(parameters, sentences).groups()
    place, *ends_of_place, mass, low, high = map(float, numbers)
    assert ends_of_place[0] < place < ends_of_place[1] and low < mass < high
    assert abs(place - 420) < 20 and abs(mass - 0.3) < 0.1
    assert abs(place - 420) < 2.5 * (ends_of_place[1] - ends_of_place[0])


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """A folder with a matrix [mm/s/N], a channel table and a mapping."""
    folder = tmp_path_factory.mktemp("laboratory")
    scipy.io.savemat(folder / "H.mat", {"H": np.moveaxis(hidden_mass(), 2, 0) * 1e3, "run": 7.0})
    write_table(folder / "channels.xlsx", TABLE)
    (folder / "mapping.toml").write_text(MAPPING + CASE)
    return folder


def test_a_folder_becomes_a_case_and_the_report_says_how(laboratory, tmp_path):
    done = run("import", laboratory, "--out", tmp_path / "case")
    assert done.exit_code == 0, done.output
    for sentence in (
        "FRFs: H, 20 x 2 numbers as frequency, sensor, actuator.",
        "Unit: mobility, times 0.001 to (m/s)/N.",
        "Left out: run, since the mapping does not name it.",
        f"Next: bayes-placement improve {tmp_path / 'case'}",
    ):
        assert sentence in done.output
    report = (tmp_path / "case/import_report.txt").read_text()
    assert "FRFs: H, 20 x 2 numbers" in report
    case = bp.io.case.read(tmp_path / "case")
    np.testing.assert_allclose(case.measurement.frf, hidden_mass(), rtol=1e-12)
    fields = json.loads((tmp_path / "case/case.json").read_text())
    assert fields["sensors"][1]["position_m"] == [0.6, 0.0, 0.0]
    assert fields["sensors"][1]["tolerance_m"] == [0.01, 0.0, 0.0]
    assert fields["measurement"]["quantity"] == "mobility"


def test_a_universal_file_with_a_channel_table_becomes_a_case(laboratory, tmp_path):
    measured = bp.io.read(laboratory).measurement
    bp.io.uff.write(tmp_path / "lab.uff", measured)
    rows = [list(row) for row in TABLE]
    for row, node in zip(rows[1:], (1, 2, 101), strict=True):  # as the writer numbers them
        row[2] = node
    write_table(tmp_path / "channels.csv", rows)
    (tmp_path / "mapping.toml").write_text(CASE.lstrip())
    done = run("import", tmp_path, "--out", tmp_path / "case")
    assert done.exit_code == 0, done.output
    case = bp.io.case.read(tmp_path / "case")
    np.testing.assert_allclose(case.measurement.frf, measured.frf, rtol=1e-9)


def test_the_report_is_one_object_of_json_where_asked(laboratory, tmp_path):
    done = run("import", laboratory, "--json", "--out", tmp_path / "case")
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert (
        "FRFs: H, 20 x 2 numbers as frequency, sensor, actuator." in report["result"]["sentences"]
    )
    assert report["folder"] == str(tmp_path / "case")


@pytest.mark.long
def test_a_laboratory_folder_ends_in_a_named_effect(laboratory, tmp_path):
    assert run("import", laboratory, "--out", tmp_path / "case").exit_code == 0
    done = run(
        "improve", tmp_path / "case", "--effects", "point_mass,ground_spring", "--out", tmp_path
    )
    assert done.exit_code == 0, done.output
    check_names_the_mass((tmp_path / "ledger.txt").read_text())


@pytest.mark.long
@pytest.mark.longest
def test_a_matrix_without_axes_and_five_lines_name_the_effect_in_one_command(tmp_path):
    model = written(tmp_path, MODEL)
    namespace = {}
    exec(compile(MODEL + HIDDEN + MEASUREMENT, "made", "exec"), namespace)
    scipy.io.savemat(
        tmp_path / "measured.mat", {"H": np.moveaxis(namespace["measurement"].frf, 2, 0)}
    )
    refused = run("improve", model, "--data", tmp_path / "measured.mat", "--out", tmp_path / "a")
    assert refused.exit_code == 3
    assert 'frf = { array = "H", axes = ' in refused.output
    mapping = ['file = "measured.mat"', *MAPPING.replace("mm/s/N", "m/s/N").splitlines()]
    assert len(mapping) == 5
    (tmp_path / "measured.toml").write_text("\n".join(mapping))
    options = ("--effects", "point_mass,time_delay", "--out", tmp_path / "results")
    done = run("improve", model, "--data", tmp_path / "measured.toml", *options)
    assert done.exit_code == 0, done.output
    check_names_the_mass((tmp_path / "results/ledger.txt").read_text())


def test_without_a_structure_the_data_alone_are_written(laboratory, tmp_path):
    (tmp_path / "mapping.toml").write_text(MAPPING)
    words = ("import", laboratory / "H.mat", "--mapping", tmp_path / "mapping.toml")
    done = run(*words, "--out", tmp_path / "case")
    assert done.exit_code == 0, done.output
    assert "improve model.py --data" in done.output
    assert "add the line [case] to the mapping" in " ".join(done.output.split())
    assert not (tmp_path / "case/case.json").exists()
    measurement = bp.io.read_measurement(tmp_path / "case/measured.uff")
    np.testing.assert_allclose(measurement.frf, hidden_mass(), rtol=1e-12)


def without(text, beginning):
    return "\n".join(line for line in text.splitlines() if not line.startswith(beginning))


@pytest.mark.parametrize(
    ("mapping", "reason"),
    [
        (MAPPING + without(CASE, "estimator"), 'Nothing says estimator; a case needs .*\n.*= "H1"'),
        (MAPPING + without(CASE, "averages"), "Nothing says of how many averages"),
        (MAPPING + without(CASE, "length_m"), "has no field structure.length_m; a positive"),
        (MAPPING + CASE.replace('"fixed"', '"moved"'), "sensor_setup is 'moved'; one of roving"),
        (MAPPING + CASE.replace("[case]", "[case]\nnose = 1"), "case.nose is not known"),
        (MAPPING.replace("s2", "s3") + CASE, "The sensor channel s3 was requested, but only"),
    ],
)  # fmt: skip
def test_a_case_that_lacks_something_is_refused_before_anything_is_written(
    laboratory, tmp_path, mapping, reason
):
    for name in ("H.mat", "channels.xlsx"):
        (tmp_path / name).write_bytes((laboratory / name).read_bytes())
    (tmp_path / "mapping.toml").write_text(mapping)
    done = run("import", tmp_path, "--out", tmp_path / "case")
    assert done.exit_code == 3
    assert not (tmp_path / "case/case.json").exists()
    assert re.search(reason, done.output, re.DOTALL), done.output


def test_help_says_where_results_go():
    assert "results/FILE/import-1" in "".join(run("import", "--help").output.split())


def test_a_file_that_is_not_there_is_one_sentence(tmp_path):
    done = run("import", tmp_path / "none.mat")
    assert done.exit_code == 2
    assert "There is no file" in done.output
