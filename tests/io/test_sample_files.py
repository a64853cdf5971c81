"""Sample files of other programs, by their origin, read by `bp.io.read` and by the command line.

The first ones were written by MATLAB, in a laboratory or with another package, and come with that
package or with the shared data; the others are written here by another library. Each is compared
with numbers that this package did not read. Files of modes and matrices that Nastran and Ansys
wrote are read in `test_nastran.py` and `test_ansys.py`.
"""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import h5py
import matplotlib
import numpy as np
import openpyxl
import pandas as pd
import pytest
import pyuff
import scipy.io
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli.app import app
from tests.io.arrays.test_arrays import OF_H5PY, OF_MATLAB, write_matlab_7_3

SHARED = (Path(__file__).parents[2] / "../shared/data").resolve()
OF_MATPLOTLIB = Path(matplotlib.get_data_path()) / "sample_data"
OF_SCIPY = Path(scipy.io.__file__).parent / "tests/data"

THETA = np.pi / 4 * np.arange(9)
LINES = 10.0 + 0.5 * np.arange(6)
RANDOM = np.random.default_rng(3)
FRF = RANDOM.standard_normal((2, 1, 6)) + 1j * RANDOM.standard_normal((2, 1, 6))

EVEN = 'frequency = { first = 10.0, step = 0.5, unit = "Hz" }\n'
ONE_PAIR = 'sensors = ["s1"]\nactuators = ["a1"]\n'
TWO_PAIRS = 'sensors = ["s1", "s2"]\nactuators = ["a1"]\n'
AXES = 'axes = ["sensor", "actuator", "frequency"]'
ARRAYS = f'frf = {{ array = "H", {AXES}, unit = "m/s^2/N" }}\n{TWO_PAIRS}'
ARRAYS += 'frequency = { array = "f", unit = "Hz" }\n'
COLUMNS = (
    "frequency [Hz]",
    *(f"s{number}/a1 {part} [(m/s^2)/N]" for number in (1, 2) for part in ("real", "imaginary")),
)


class Sample(NamedTuple):
    """A sample file: where it is, what a mapping has to say of it, and what is in it."""

    path: Callable[[Path], Path]
    mapping: str
    content: Callable[[Path], tuple[np.ndarray, np.ndarray]]
    """Lines [Hz] and FRFs [sensor, actuator, frequency] in SI, from the path."""


def even(count):
    """Lines that `EVEN` states."""
    return 10.0 + 0.5 * np.arange(count)


def carried(folder, name):
    """Where a package or the shared data has a file."""
    return lambda _: folder / name


def of_matlab(version):
    frf = f'frf = {{ array = "testcomplex", unit = "m/s/N" }}\n{EVEN}{ONE_PAIR}'
    path = carried(OF_MATLAB, f"testcomplex_{version}.mat")
    return Sample(path, frf, lambda _: (even(9), np.exp(1j * THETA)))


def of_h5py(name):
    """A hundred complex numbers, as their bytes lie in the file."""

    def stored(path):
        with h5py.File(path) as file:
            offset = file[name].id.get_offset()
        return even(100), np.fromfile(path, name, count=100, offset=offset)

    mapping = f'frf = {{ array = "{name}", unit = "m/s/N" }}\n{EVEN}{ONE_PAIR}'
    return Sample(carried(OF_H5PY, "compound-dtype-complex.h5"), mapping, stored)


def matlab_7_3():
    """Amplitudes 0, 45, ... and phases of as many degrees."""
    parts = 'magnitude = "testdouble", degrees = "testdouble"'
    mapping = f'frf = {{ {parts}, unit = "m/s/N" }}\n{EVEN}{ONE_PAIR}'
    path = carried(OF_MATLAB, "testhdf5_7.4_GLNX86.mat")
    return Sample(path, mapping, lambda _: (even(9), THETA * np.exp(1j * np.deg2rad(THETA))))


def of_matplotlib():
    """Columns of x, x² and x³."""
    pair = '[[frf]]\nsensor = "s1"\nactuator = "a1"\nunit = "m/N"\nreal = 2\nimaginary = 3\n'
    mapping = f'frequency = {{ array = 1, unit = "Hz" }}\n{pair}'
    x = np.arange(11.0)
    path = carried(OF_MATPLOTLIB, "data_x_x2_x3.csv")
    return Sample(path, mapping, lambda _: (x, x**2 + 1j * x**3))


def measured_beam():
    def read(path):
        sets = [one for one in pyuff.UFF(str(path)).read_sets() if one["type"] == 58]
        ordered = sorted(sets, key=lambda one: one["ref_node"])
        return ordered[0]["x"], np.array([[one["data"] for one in ordered]])

    return Sample(carried(SHARED, "measured/free_free_beam/measured.uff"), "", read)


def of_archive(path):
    """What NumPy reads of a measurement."""
    with np.load(path) as archive:
        return archive["frequency_hz"], archive["frf"]


def measured_bookcase():
    labels = ", ".join(f'"{number}+y"' for number in range(9))
    mapping = (
        'frf = { array = "frf", axes = ["sensor", "frequency"], unit = "m/s^2/N" }\n'
        'frequency = { array = "frequency_hz", unit = "Hz" }\n'
        f'sensors = [{labels}]\nactuators = ["9+y"]\n'
    )
    path = carried(SHARED, "measured/bookcase/measured.npz")
    return Sample(path, mapping, of_archive)


def measured_plane():
    sensors = ", ".join(f'"acc{number}"' for number in range(3))
    actuators = ", ".join(f'"hit{number}"' for number in range(74))
    mapping = (
        f'frf = {{ array = "frf", {AXES}, unit = "m/s^2/N" }}\ncoherence = "coherence"\n'
        'frequency = { array = "frequency_hz", unit = "Hz" }\n'
        f"sensors = [{sensors}]\nactuators = [{actuators}]\n"
    )
    path = carried(SHARED, "measured/plane/measured.npz")
    return Sample(path, mapping, of_archive)


def written(name, write, mapping=ARRAYS):
    """A file that another library writes here."""

    def path(folder):
        write(folder / name)
        return folder / name

    return Sample(path, mapping, lambda _: (LINES, FRF))


def table():
    parts = [values for pair in FRF[:, 0] for values in (pair.real, pair.imag)]
    return pd.DataFrame(dict(zip(COLUMNS, [LINES, *parts], strict=True)))


def write_workbook(path):
    book = openpyxl.Workbook()
    for row in [COLUMNS, *table().to_numpy().tolist()]:
        book.active.append(row)
    book.save(path)


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        file["H"], file["f"] = FRF, LINES


def write_universal(path):
    """By pyuff, in ASCII: one FRF of each sensor."""
    sets = [
        {
            "type": 58,
            "func_type": 4,
            "binary": 0,
            "data": frf,
            "x": LINES,
            "rsp_node": number,
            "rsp_dir": 3,
            "ref_node": 7,
            "ref_dir": -3,
            "abscissa_spec_data_type": 18,
            "ordinate_spec_data_type": 12,
            "orddenom_spec_data_type": 13,
        }
        for number, frf in enumerate(FRF[:, 0], 1)
    ]
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")


SAMPLES = {
    "MATLAB 6.1 on Solaris": of_matlab("6.1_SOL2"),
    "MATLAB 6.5.1 on Linux": of_matlab("6.5.1_GLNX86"),
    "MATLAB 7.1 on Linux": of_matlab("7.1_GLNX86"),
    "MATLAB 7.4 on Linux": of_matlab("7.4_GLNX86"),
    "MATLAB 7.4 on Linux, format 7.3": matlab_7_3(),
    "tests of h5py, little-endian": of_h5py("<c16"),
    "tests of h5py, big-endian": of_h5py(">c8"),
    "sample data of matplotlib, CSV": of_matplotlib(),
    "measured beam, universal file": measured_beam(),
    "measured bookcase, npz": measured_bookcase(),
    "measured plane, npz": measured_plane(),
    "pyuff, universal file": written("a.uff", write_universal, ""),
    "pandas, CSV": written("a.csv", lambda path: table().to_csv(path, index=False), ""),
    "pandas, TSV": written("a.tsv", lambda path: table().to_csv(path, index=False, sep="\t"), ""),
    "openpyxl, workbook": written("a.xlsx", write_workbook, ""),
    "scipy, MATLAB 5": written("a.mat", lambda p: scipy.io.savemat(p, {"H": FRF, "f": LINES})),
    "documented layout of MATLAB 7.3": written(
        "a.mat", lambda path: write_matlab_7_3(path, H=FRF, f=LINES)
    ),
    "numpy, npz": written("a.npz", lambda path: np.savez(path, H=FRF, f=LINES)),
    "h5py, HDF5": written("a.h5", write_hdf5),
}


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # pyuff leaves files open
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("origin", SAMPLES)
def test_a_sample_file_is_read_and_imported(origin, tmp_path):
    sample = SAMPLES[origin]
    path = sample.path(tmp_path)
    if not path.is_file():
        pytest.skip(f"what brings this file is not on this machine: there is no {path}")
    stated = tmp_path / "mapping.toml"
    stated.write_text(sample.mapping)
    mapping = stated if sample.mapping else None
    measurement = bp.io.read(path, mapping).measurement
    lines, frf = sample.content(path)
    expected = np.asarray(frf, complex).reshape(measurement.frf.shape)
    digits = {"rtol": 1e-5 if origin.startswith("pyuff") else 1e-12, "atol": 1e-15}
    np.testing.assert_allclose(measurement.frf, expected, **digits)
    np.testing.assert_allclose(measurement.frequency, lines, rtol=1e-12)
    options = ["--mapping", str(mapping)] if mapping else []
    words = ["import", str(path), *options, "--out", str(tmp_path / "imported")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    imported = bp.io.read_measurement(tmp_path / "imported/measured.uff")
    np.testing.assert_allclose(imported.frf, expected, **digits)
    np.testing.assert_allclose(imported.frequency, lines, rtol=1e-12, atol=1e-12)


RECORDS = {
    "test-44100Hz-2ch-32bit-float-le.wav": ("<f", 1.0, 0.0),
    "test-44100Hz-2ch-32bit-float-be.wav": (">f", 1.0, 0.0),
    "test-8000Hz-le-2ch-1byteu.wav": ("<B", 128.0, 128.0),
    "test-44100Hz-le-1ch-4bytes.wav": ("<i", 2.0**31, 0.0),
}
"""Sample files of SciPy: how a sample is stored, its full scale and its zero."""


@pytest.mark.parametrize("name", RECORDS)
def test_sample_recordings_of_scipy_are_read(name):
    path = OF_SCIPY / name
    if not path.is_file():
        pytest.skip(f"this build of SciPy comes without its WAV files: there is no {path}")
    stored, full, zero = RECORDS[name]
    content, order = path.read_bytes(), stored[0]
    place = content.index(b"data")
    (size,) = struct.unpack_from(f"{order}I", content, place + 4)
    count = 2 if "2ch" in name else 1
    samples = np.frombuffer(
        content, stored, offset=place + 8, count=size // struct.calcsize(stored)
    )
    signal = bp.time_records.Signal(f"channel {count}", "m/s^2")
    recording = bp.time_records.read(path, {"s1": signal})
    assert recording.rate == float(name.split("Hz")[0].removeprefix("test-"))
    np.testing.assert_allclose(
        recording.samples["s1"], (samples[count - 1 :: count] - zero) / full, rtol=1e-12
    )
