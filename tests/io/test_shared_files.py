"""Files as programs of laboratories write them, in small: each read as its README says."""

import tomllib

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import MissingExtraError
from bayes_placement.io.time_records import Signal

FREQUENCIES = [118.0, 325.3, 637.7]
DEVIATIONS = dict.fromkeys(("frequency_deviation", "damping_deviation", "shape_deviation"), 0.01)


@pytest.fixture
def files(shared_data):
    folder = shared_data / "files"
    if not folder.is_dir():
        pytest.skip(f"these files are not on this machine: there is no {folder}")
    return folder


@pytest.mark.parametrize(
    ("name", "hammer", "motion", "tolerance"),
    [
        ("hits_comma.lvm", "Hammer", "Acc", 1e-6),
        ("hits_utf16.txt", "Hammer", "Acc", 1e-6),
        ("hits_rf64.wav", "channel 1", "channel 2", 1e-3),
        ("hits_24bit.wav", "channel 1", "channel 2", 1e-3),
        ("hits.npy", ("hits", 1), ("hits", 2), 0.0),
        ("time_histories.uff", "1+z", "2+z", 1e-3),
        ("hits_ni_unit_names.tdms", "Test/Hammer", "Test/Acc", 0.0),
        ("hits_with_scales.tdms", "Test/Hammer", "Test/Acc", 1e-12),
    ],
)
def test_recordings(files, name, hammer, motion, tolerance):
    with np.load(files / "truth.npz") as archive:
        truth = dict(archive)
    units = ("1 N", "1 m/s^2") if name.endswith(".wav") else ("N", "m/s^2")
    channels = {"a1": Signal(hammer, units[0]), "s1": Signal(motion, units[1])}
    settings = {".npy": {"rate": 2048.0}, ".txt": {"time": "time"}}.get(name[-4:], {})
    recording = bp.time_records.read(files / name, channels, **settings)
    assert recording.rate == pytest.approx(2048.0, rel=1e-3)
    for label, known in (("a1", "force"), ("s1", "acc")):
        read = recording[label]
        scale = 1.0 if not name.endswith(".wav") else np.ptp(truth[known]) / np.ptp(read)
        np.testing.assert_allclose(scale * read, truth[known][: read.size], atol=tolerance)


@pytest.mark.parametrize(
    "name",
    [
        "modes_poles_in_hz.uff",
        "modes_poles_in_hz_negative.uff",
        "modes_three_digits.uff",
        "modes_latin1.uff",
        "modes_utf8.uff",
        "modes_mm_without_units.uff",
    ],
)
def test_modes(files, name):
    read = bp.io.modal_parameters.read(files / name, **DEVIATIONS)
    np.testing.assert_allclose(read.natural_frequency, FREQUENCIES, rtol=1e-5)
    assert (read.damping_ratio > 0).all()


def test_arrays_matrices_and_meshes(files):
    read = bp.io.modal_parameters.read(files / "identified_modes.mat", **DEVIATIONS)
    np.testing.assert_allclose(read.natural_frequency, [0.88, 2.75, 4.3])
    system = bp.io.read_matrices(files / "system_matrices.mat")
    assert (system.stiffness.sum(), system.mass.sum()) == (10000.0, 30.0)
    mesh = bp.io.mesh.read(files / "mesh_2411_2412.unv", length_unit=1.0)
    assert mesh.elements["quad"].tolist() == [[1, 2, 5, 4], [2, 3, 6, 5]]
    with pytest.raises((MissingExtraError, ValueError), match=r"netCDF4|cannot be read"):
        bp.io.mesh.read(files / "mesh.exo")


def test_universal_files(files):
    with pytest.warns(UserWarning, match=r"extend over 400 m\. .*length_unit"):
        bp.io.read(files / "frf_nodes_in_mm.uff")
    placed = bp.io.read(files / "frf_nodes_in_mm.uff", {"length_unit": 1e-3}).measurement
    assert placed.positions["1"] == (0.05, 0.0, 0.0)
    bp.io.read(files / "frf_comments_between_datasets.uff", {"length_unit": 1.0})
    for name, words in (
        ("frf_long_entity_name", "response node"),
        ("frf_point_in_name", "hold the same function"),
        ("frf_volts_per_newton", "unit label 'V'"),
        ("frf_without_force", "data type 12 per data type 12"),
    ):
        with pytest.raises(ValueError, match=words):
            bp.io.read(files / f"{name}.uff")


@pytest.mark.filterwarnings("ignore:.* lines were left out")
@pytest.mark.parametrize("name", ["analyser_two_complex_arrays", "analyser_coherence_above_one"])
def test_the_lines_that_files_of_an_analyser_need_take_the_frf(files, name):
    with pytest.raises(ValueError, match="nothing says which array holds the FRFs") as error:
        bp.io.read(files / f"{name}.mat")
    lines = tomllib.loads(str(error.value).partition("\n\n")[2])
    assert [pair["array"] for pair in lines["frf"]] == ["Hf_chan_2"]
    assert bp.io.read(files / f"{name}.mat", lines).measurement.frequency.size > 190
