"""Declarations of a model file, and the errors where they are wrong."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.io import model

EXPERIMENT = """
import bayes_placement as bp

modes = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal([0.04])),
    sensors=[bp.Sensor("s1", at=0.25)],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency=[100.0, 150.0],
    observe=bp.observe.LogAmplitude("velocity"),
    noise=None,
)
"""


def written(folder, text, name="study.py"):
    path = folder / name
    path.write_text(text)
    return path


def test_an_experiment_alone_is_a_study(tmp_path):
    study = model.read(written(tmp_path, EXPERIMENT))
    assert isinstance(study.experiment, bp.Experiment)
    assert (study.measurement, study.engine, study.truth) == (None, None, {})


def test_measurement_engine_and_truth_are_taken_along(tmp_path):
    declarations = """
measurement = experiment.nominal_measurement()
engine = bp.engines.SMC(particles=100)
truth = {"sensor.s1.position": 0.26}
"""
    study = model.read(str(written(tmp_path, EXPERIMENT + declarations)))
    np.testing.assert_array_equal(study.measurement.frequency, [100.0, 150.0])
    assert study.engine == bp.engines.SMC(particles=100)
    assert study.truth == {"sensor.s1.position": 0.26}


def test_measurements_of_several_force_levels_are_taken_along(tmp_path):
    text = EXPERIMENT.replace("noise=None", "noise=None, force_levels=[1.0, 2.0]")
    study = model.read(written(tmp_path, text + "measurement = experiment.nominal_measurement()"))
    assert [at_level.force_level for at_level in study.measurement] == [1.0, 2.0]


def test_a_model_file_knows_where_it_is(tmp_path):
    text = EXPERIMENT + "from pathlib import Path\ntruth = {str(Path(__file__).parent): 1.0}\n"
    assert model.read(written(tmp_path, text)).truth == {str(tmp_path): 1.0}


def test_two_files_of_one_name_are_two_models(tmp_path):
    (tmp_path / "a").mkdir()
    first = written(tmp_path, EXPERIMENT + "truth = {'first': 1.0}")
    second = written(tmp_path / "a", EXPERIMENT + "truth = {'second': 1.0}")
    truths = [model.read(path).truth for path in (first, second, first)]
    assert [list(truth) for truth in truths] == [["first"], ["second"], ["first"]]


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no model file .*study\.py.*`experiment`"):
        model.read(tmp_path / "study.py")


def test_a_folder_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="no model file"):
        model.read(tmp_path)


def test_a_file_of_another_kind_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"study\.uff is no Python file.*models/bar\.py"):
        model.read(written(tmp_path, "    -1\n", "study.uff"))


def test_a_file_without_an_experiment_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"study\.py has no `experiment`.*bp\.Experiment"):
        model.read(written(tmp_path, "answer = 42\n"))


@pytest.mark.parametrize(
    ("name", "value", "type_name", "needed"),
    [
        ("experiment", "modes", "Bar|Modes|Beam", "Experiment"),
        ("measurement", "[1.0, 2.0]", "list", "Measurement"),
        ("engine", "'smc'", "str", "Engine"),
        ("truth", "0.26", "float", "dict"),
    ],
)
def test_something_else_under_a_known_name_is_refused(tmp_path, name, value, type_name, needed):
    path = written(tmp_path, f"{EXPERIMENT}\n{name} = {value}\n")
    with pytest.raises(ValueError, match=rf"`{name}` in .*({type_name}).*; a {needed} is needed"):
        model.read(path)


def test_a_state_whose_label_cannot_be_printed_is_refused(tmp_path):
    path = written(tmp_path, EXPERIMENT + "states = {'new': None, 'a\\n': None}\n")
    with pytest.raises(ValueError, match=r"study.py: a state of the label 'a.*n' was given"):
        model.read(path)


def test_an_error_in_the_file_is_the_users_to_see(tmp_path):
    with pytest.raises(ZeroDivisionError):
        model.read(written(tmp_path, "experiment = 1 / 0\n"))


def test_a_model_imports_modules_beside_it(tmp_path):
    written(tmp_path, "RATIO = 0.03\n", "lab_values.py")
    text = EXPERIMENT + "import lab_values\ntruth = {'ratio': lab_values.RATIO}\n"
    assert model.read(written(tmp_path, text)).truth == {"ratio": 0.03}


def test_modules_of_one_name_beside_two_models_are_two(tmp_path):
    text = EXPERIMENT + "import lab_values\ntruth = {'ratio': lab_values.RATIO}\n"
    for name, ratio in (("a", 0.03), ("b", 0.04)):
        (tmp_path / name).mkdir()
        written(tmp_path / name, f"RATIO = {ratio}\n", "lab_values.py")
        assert model.read(written(tmp_path / name, text)).truth == {"ratio": ratio}


def test_a_model_may_import_from_its_folder_later(tmp_path):
    written(tmp_path, "RATIO = 0.05\n", "later_values.py")
    text = EXPERIMENT + "def late():\n    import later_values\n    return later_values.RATIO\n"
    late = "class Truth(dict):\n    late = staticmethod(late)\n\ntruth = Truth(ratio=0.05)\n"
    assert model.read(written(tmp_path, text + late)).truth.late() == 0.05
