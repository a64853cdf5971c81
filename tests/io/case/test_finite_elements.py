"""case with a finite element model: the folder becomes an experiment in space, or says why not."""

import json
import shutil

import jax
import numpy as np
import pytest

from bayes_placement import effects
from bayes_placement.criticism.missing._hypotheses import alone
from bayes_placement.io import case


@pytest.fixture
def folder(shared_data, tmp_path):
    """A copy of a case and of the model that it names, to be spoilt."""
    for name in ("10_plate-02", "models/plate"):
        shutil.copytree(shared_data / "cases" / name, tmp_path / name, copy_function=shutil.copy)
        for one in [tmp_path / name, *(tmp_path / name).iterdir()]:
            one.chmod(0o755)
    return tmp_path / "10_plate-02"


def rewritten(file, change):
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("name", "size", "mounted", "unknowns"),
    [
        ("02_plate-01", (4, 1, 361), "fixed", 13),
        ("04_portal-01", (9, 2, 400), "roving", 22),
        ("08_portal-02", (12, 1, 400), "fixed", 22),
        ("10_plate-02", (3, 2, 361), "roving", 13),
    ],
)
def test_a_shared_case_is_read(shared_data, name, size, mounted, unknowns):
    study = case.read(shared_data / "cases" / name)
    experiment = study.experiment
    assert experiment.data(study.measurement).z.shape == (*size[:2], 2, size[2])
    assert (experiment.sensors_mounted, len(experiment.unknowns)) == (mounted, unknowns)
    kind = "plate" if "plate" in name else "portal"
    given = np.load(shared_data / f"cases/models/{kind}/nominal.npz")["freqs_hz"]
    modes = experiment.nominal().structure.modes
    natural = np.asarray(jax.jit(lambda: modes.angular_frequency())()) / (2 * np.pi)
    np.testing.assert_allclose(natural, given[: natural.size], rtol=1e-6)
    assert natural[-1] > 4 * experiment.frequency[-1]


def test_every_angle_of_a_triaxial_sensor_is_unknown(shared_data):
    experiment = case.read(shared_data / "cases/08_portal-02").experiment
    assert experiment.sensor["s4"].directions == (1, 2, 3)
    laws = {one.name: one.law for one in experiment.unknowns}
    assert [laws[f"sensor.s4.angles.{n}"].high for n in (1, 2, 3)] == [0.2] * 3
    assert [laws[f"actuator.a1.angles.{n}"].high for n in (1, 2, 3)] == [0.1] * 3
    assert laws["sensor.s4.position.x"].low == pytest.approx(0.48)


def test_effects_may_sit_on_every_member_or_on_the_plate(shared_data):
    portal = case.read(shared_data / "cases/08_portal-02").experiment.structure.modes
    assert [str(one) for one in portal.members.names] == [
        "left column",
        "crossbar",
        "right column",
    ]
    assert len(portal.anywhere()) == 3
    plate = case.read(shared_data / "cases/10_plate-02").experiment.structure.modes
    (surface,) = plate.anywhere()
    assert (surface.x.high, surface.y.high, surface.z) == (0.4, 0.3, 0.0)
    assert len(plate.regions.names) == 12


def test_feet_and_edges_may_give_way(shared_data):
    """Candidates know them by their place; each bending rotation of a foot, each edge held."""
    for name, where in (
        (
            "08_portal-02",
            ["of the left column at (0, 0, 0) m", "of the right column at (1.2, 0, 0"],
        ),
        ("10_plate-02", [f"along {side} m" for side in ("x = 0", "x = 0.4", "y = 0", "y = 0.3")]),
    ):
        experiment = case.read(shared_data / "cases" / name).experiment
        found = effects.compliant_support.suggest(experiment)
        said = sorted(one.setting(experiment) for one in found)
        assert len(said) == len(where)
        assert all(f"support {at}" in one for at, one in zip(where, said, strict=True))


def test_orientation_matters(shared_data):
    study = case.read(shared_data / "cases/08_portal-02")
    data = study.experiment.data(study.measurement)
    angles = {one.name: 0.0 for one in study.experiment.unknowns if ".angles." in one.name}
    assert len(angles) == 15
    assert alone(study.experiment.fix(angles), data).chi2_per_datum > 5
    assert 1.0 < alone(study.experiment, data).chi2_per_datum < 1.1


def test_a_model_of_another_kind_is_refused(folder):
    rewritten(folder / "case.json", lambda it: it["structure"].update(type="a shell"))
    with pytest.raises(case.CaseError, match=r'structure.type is "a shell".*thin Kirchhoff plate'):
        case.read(folder)


def test_a_model_of_another_structure_is_refused(folder):
    rewritten(folder / "case.json", lambda it: it["structure"].update(thickness_m=0.005))
    with pytest.raises(case.CaseError, match=r"structure.thickness_m is 0.004.*says 0.005; both"):
        case.read(folder)


def test_a_model_that_is_not_there_is_refused(folder):
    rewritten(folder / "case.json", lambda it: it.update(nominal_fe_model="../models/shell"))
    with pytest.raises(FileNotFoundError, match=r"shell"):
        case.read(folder)


def test_matrices_of_another_model_are_refused(folder):
    from scipy.sparse import load_npz, save_npz

    file = folder.parent / "models/plate/K.npz"
    save_npz(file, 1.1 * load_npz(file))
    message = r"have mode 1 at 178\..* hands it over at 169\.8.*Export both from the same model"
    with pytest.raises(case.CaseError, match=message):
        case.read(folder)


def test_matrices_that_are_none_are_refused(folder):
    file = folder.parent / "models/plate/M.npz"
    np.savez(file, nothing=np.zeros(3))
    with pytest.raises(case.CaseError, match=r"models/plate cannot be used: .*M\.npz"):
        case.read(folder)


def test_a_place_beside_the_model_is_refused(folder):
    rewritten(folder / "case.json", lambda it: it["sensors"][0].update(position_m=[0.5, 0.1, 0]))
    with pytest.raises(case.CaseError, match=r"position_m .*coordinates \[m\] among the nodes"):
        case.read(folder)


def test_a_direction_in_which_a_plate_does_not_move_is_refused(folder):
    rewritten(folder / "case.json", lambda it: it["sensors"][0].update(directions=[1]))
    with pytest.raises(
        case.CaseError, match=r"directions of \"s1\" is \[1\]; a list of directions"
    ):
        case.read(folder)
