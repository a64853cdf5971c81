"""Case folders with a finite element model: read as experiments in space, or refused."""

import functools
import json
import shutil

import jax
import numpy as np
import pytest
import scipy.sparse

from bayes_placement import effects
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.io import case


@pytest.fixture(scope="module")
def study(shared_data):
    """Cases by name, each read once."""
    return functools.cache(lambda name: case.read(shared_data / "cases" / name))


def copied(cases, folder, case, model):
    """Copy a case and the model that it names, to be damaged."""
    for name in (case, f"models/{model}"):
        shutil.copytree(cases / name, folder / name, copy_function=shutil.copy)
        for path in [folder / name, *(folder / name).iterdir()]:
            path.chmod(0o755)
    return folder / case


@pytest.fixture
def folder(shared_data, tmp_path):
    return copied(shared_data / "cases", tmp_path, "10_plate-02", "plate")


def rewritten(file, change):
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "size", "mounted", "unknowns"),
    [
        ("02_plate-01", (4, 1, 361), "fixed", 13),
        ("04_portal-01", (9, 2, 400), "roving", 22),
        ("08_portal-02", (12, 1, 400), "fixed", 22),
        ("10_plate-02", (3, 2, 361), "roving", 13),
    ],
)
def test_a_shared_case_is_read(study, shared_data, name, size, mounted, unknowns):
    experiment, measurement, *_ = study(name)
    assert experiment.data(measurement).z.shape == (*size[:2], 2, size[2])
    assert (experiment.sensors_mounted, len(experiment.unknowns)) == (mounted, unknowns)
    kind = "plate" if "plate" in name else "portal"
    stated = np.load(shared_data / f"cases/models/{kind}/nominal.npz")["freqs_hz"]
    modes = experiment.nominal().structure.modes
    natural = np.asarray(jax.jit(lambda: modes.angular_frequency())()) / (2 * np.pi)
    np.testing.assert_allclose(natural, stated[: natural.size], rtol=1e-6)
    assert natural[-1] > 4 * experiment.frequency[-1]


def test_every_angle_of_a_triaxial_sensor_is_unknown(study):
    experiment = study("08_portal-02").experiment
    assert experiment.sensor["s4"].directions == (1, 2, 3)
    distributions = {item.name: item.distribution for item in experiment.unknowns}
    assert [distributions[f"sensor.s4.angles.{n}"].high for n in (1, 2, 3)] == [0.2] * 3
    assert [distributions[f"actuator.a1.angles.{n}"].high for n in (1, 2, 3)] == [0.1] * 3
    assert distributions["sensor.s4.position.x"].low == pytest.approx(0.48)


@pytest.mark.long
def test_effects_may_sit_on_every_member_or_on_the_plate(study):
    portal = study("08_portal-02").experiment.structure.modes
    assert [str(name) for name in portal.members.names] == [
        "left column",
        "crossbar",
        "right column",
    ]
    assert len(portal.anywhere()) == 3
    plate = study("10_plate-02").experiment.structure.modes
    (surface,) = plate.anywhere()
    assert (surface.x.high, surface.y.high, surface.z) == (0.4, 0.3, 0.0)
    assert len(plate.regions.names) == 12


def test_clamped_ends_and_edges_may_be_compliant(study):
    """Candidates name them by position: each bending rotation of an end, each supported edge."""
    for name, where in (
        (
            "08_portal-02",
            ["of the left column at (0, 0, 0) m", "of the right column at (1.2, 0, 0"],
        ),
        ("10_plate-02", [f"along {side} m" for side in ("x = 0", "x = 0.4", "y = 0", "y = 0.3")]),
    ):
        experiment = study(name).experiment
        candidates = effects.library(experiment, ["compliant_support"]).effects
        modes, instruments = experiment.structure.modes, experiment.instruments
        settings = sorted(candidate.setting(modes, instruments) for candidate in candidates)
        assert len(settings) == len(where)
        assert all(f"support {at}" in words for at, words in zip(where, settings, strict=True))


@pytest.mark.long
def test_orientation_matters(study):
    experiment, measurement, *_ = study("08_portal-02")
    data = experiment.data(measurement)
    names = [unknown.name for unknown in experiment.unknowns if ".angles." in unknown.name]
    assert len(names) == 15
    without = experiment.fix(dict.fromkeys(names, 0.0))
    assert null_hypothesis(without, data).chi2_per_datum > 5
    assert 1.0 < null_hypothesis(experiment, data).chi2_per_datum < 1.1


def test_a_model_of_another_kind_is_refused(folder):
    rewritten(folder / "case.json", lambda content: content["structure"].update(type="a shell"))
    with pytest.raises(case.CaseError, match=r'structure.type is "a shell".*thin Kirchhoff plate'):
        case.read(folder)


def test_a_model_of_another_structure_is_refused(folder):
    rewritten(folder / "case.json", lambda content: content["structure"].update(thickness_m=0.005))
    with pytest.raises(case.CaseError, match=r"structure.thickness_m is 0.004.*says 0.005; both"):
        case.read(folder)


def test_a_model_that_is_not_there_is_refused(folder):
    rewritten(
        folder / "case.json", lambda content: content.update(nominal_fe_model="../models/shell")
    )
    missing = r"nominal_fe_model is '../models/shell', but there is no nominal.npz, K.npz, M.npz"
    with pytest.raises(case.CaseError, match=missing):
        case.read(folder)


def test_matrices_of_another_model_are_refused(shared_data, tmp_path):
    folder = copied(shared_data / "cases", tmp_path, "04_portal-01", "portal")
    file = folder.parent / "models/portal/K.npz"
    scipy.sparse.save_npz(file, 1.1 * scipy.sparse.load_npz(file))
    first = np.load(folder.parent / "models/portal/nominal.npz")["freqs_hz"][0]
    message = (
        rf"have mode 1 at {np.sqrt(1.1) * first:.6g} Hz, but nominal.npz states {first:.6g} Hz"
    )
    with pytest.raises(case.CaseError, match=message):
        case.read(folder)


def test_matrices_that_are_none_are_refused(folder):
    file = folder.parent / "models/plate/M.npz"
    np.savez(file, nothing=np.zeros(3))
    with pytest.raises(case.CaseError, match=r"models/plate cannot be used: .*M\.npz"):
        case.read(folder)


def test_a_place_beside_the_model_is_refused(folder):
    rewritten(
        folder / "case.json", lambda content: content["sensors"][0].update(position_m=[0.5, 0.1, 0])
    )
    with pytest.raises(case.CaseError, match=r"position_m .*coordinates \[m\] among the nodes"):
        case.read(folder)


def test_a_direction_in_which_a_plate_does_not_move_is_refused(folder):
    rewritten(folder / "case.json", lambda content: content["sensors"][0].update(directions=[1]))
    with pytest.raises(
        case.CaseError, match=r"directions of \"s1\" is \[1\]; a list of directions"
    ):
        case.read(folder)


@pytest.mark.parametrize("path", ["/etc", "../../../../etc", "..\0", "", 3])
def test_a_model_elsewhere_is_not_opened(folder, path):
    rewritten(folder / "case.json", lambda content: content.update(nominal_fe_model=path))
    with pytest.raises(
        case.CaseError, match=r"nominal_fe_model is .*; a folder in .*, relative to"
    ):
        case.read(folder)


def test_a_link_that_leads_out_of_a_model_is_refused(folder):
    stiffness = folder.parent / "models" / "plate" / "K.npz"
    stiffness.rename(folder / "K.npz")
    stiffness.symlink_to(folder / "K.npz")
    with pytest.raises(case.CaseError, match=r"K.npz is a link to .*, which is outside"):
        case.read(folder)


def test_a_model_beside_the_folder_of_the_cases_is_opened(shared_data):
    assert case.read(shared_data / "imperfect" / "54_portal").experiment.force_levels is None


def test_regions_that_the_model_does_not_name_are_refused(folder):
    def misspelt(model):
        model["region"] = model.pop("regions")

    rewritten(folder.parent / "models/plate/model.json", misspelt)
    with pytest.raises(case.CaseError, match=r"names 0 regions, and K_region_00.npz lies beside"):
        case.read(folder)
