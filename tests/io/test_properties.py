"""Properties of every reader: what is written comes back, and a damaged file is told.

A damaged file is refused by a ValueError or an OSError of ours that names it, or what is read of it
is what it could be: the same numbers where a checksum protects them, finite ones of the same
layout where the format has none, since a changed digit is another number.
"""

import dataclasses
import gzip
import json
import math
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.io import case, matrix_files, mesh, netcdf, npz_modes, uff

QUIET = {
    "deadline": None,
    "database": None,
    "derandomize": True,
    "suppress_health_check": list(HealthCheck),
}
SHORT, LONG = 60, 300

# beartype looks at random entries of lists, which Hypothesis takes for a mistake
pytestmark = pytest.mark.filterwarnings("ignore:Do not use the `random` module inside strategies")


# ------------------------------------------------------------------------------------ round trips

FINITE = st.floats(-1e6, 1e6, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 1e-6)
NAMES = st.text(st.characters(codec="ascii", categories=("L", "N")), min_size=1, max_size=6)


@st.composite
def measurements(draw):
    rows, columns, lines = (draw(st.integers(1, n)) for n in (2, 2, 4))
    names = draw(st.lists(NAMES, min_size=rows + columns, max_size=rows + columns, unique=True))
    directions = st.sampled_from([-3, -2, -1, 1, 2, 3])
    channels = [bp.Channel(name, draw(directions)) for name in names]
    count = rows * columns * lines
    real, imaginary = (draw(st.lists(FINITE, min_size=count, max_size=count)) for _ in "ab")
    frf = (np.array(real) + 1j * np.array(imaginary) + 1.0).reshape(rows, columns, lines)
    first, step = draw(st.floats(0.5, 50)), draw(st.floats(0.1, 10))
    return bp.Measurement.from_arrays(
        frf,
        np.round(first + step * np.arange(lines), 3),
        sensors=channels[:rows],
        actuators=channels[rows:],
        quantity=draw(st.sampled_from(["receptance", "mobility", "accelerance"])),
        averages=draw(st.none() | st.integers(1, 999)),
        force_level=draw(st.none() | st.floats(0.01, 100)),
        variance=draw(st.none() | st.just(0.01 * np.abs(frf) ** 2 + 0.5)),
    )


def check_measurement_comes_back(folder, measurement, binary):
    uff.write(folder / "measured.uff", measurement, binary=binary)
    back = uff.read(folder / "measured.uff", require_positions=False)
    np.testing.assert_allclose(back.frf, measurement.frf, rtol=1e-11)
    np.testing.assert_allclose(back.frequency, measurement.frequency, rtol=1e-9)
    assert (back.variance is None) == (measurement.variance is None)
    if measurement.variance is not None:
        np.testing.assert_allclose(back.variance, measurement.variance, rtol=1e-11)
    assert (back.sensors, back.actuators) == (measurement.sensors, measurement.actuators)
    assert (back.averages, back.force_level) == (measurement.averages, measurement.force_level)


@settings(max_examples=30, **QUIET)
@given(measurement=measurements(), binary=st.booleans())
def test_measurements_come_back_from_universal_files(tmp_path_factory, measurement, binary):
    check_measurement_comes_back(tmp_path_factory.mktemp("uff"), measurement, binary)


@pytest.mark.long
@settings(max_examples=LONG, **QUIET)
@given(measurement=measurements(), binary=st.booleans())
def test_many_measurements_come_back_from_universal_files(tmp_path_factory, measurement, binary):
    check_measurement_comes_back(tmp_path_factory.mktemp("uff"), measurement, binary)


@st.composite
def symmetric_matrices(draw):
    size = draw(st.integers(1, 5))
    values = draw(st.lists(FINITE, min_size=size * size, max_size=size * size))
    lower = np.tril(np.reshape(values, (size, size)), -1)
    coupled = lower + lower.T
    diagonal = np.abs(np.diag(np.reshape(values, (size, size)))) + 1.0
    return coupled + np.diag(diagonal + np.abs(coupled).sum(axis=0))  # no negative energy


@settings(max_examples=60, **QUIET)
@given(
    matrix=symmetric_matrices(),
    form=st.sampled_from(["csr", "csc", "coo", "bsr", "dia", "mtx", "mtx.gz"]),
)
def test_matrices_come_back_from_any_file(tmp_path_factory, matrix, form):
    folder = tmp_path_factory.mktemp("matrix")
    if form.startswith("mtx"):
        path = folder / f"K.{form}"
        scipy.io.mmwrite(folder / "K.mtx", scipy.sparse.coo_array(matrix), precision=17)
        if form.endswith("gz"):
            path.write_bytes(gzip.compress((folder / "K.mtx").read_bytes()))
    else:
        path = folder / "K.npz"
        scipy.sparse.save_npz(path, scipy.sparse.coo_array(matrix).asformat(form))
    read = matrix_files.read(path, path)
    np.testing.assert_allclose(read.stiffness.toarray(), matrix, rtol=1e-15)


# ------------------------------------------------------------------------------------ damaged files


@dataclasses.dataclass(repr=False)
class Reader:
    """A reader with a valid file.

    Parameters
    ----------
    name
        Name of the damaged file.
    content
        Its valid content.
    read
        Reads the file in a folder.
    summary
        Arrays of what is read.
    exact
        Whether a damaged file is refused or reads the same, to the last digit.
    """

    name: str
    content: bytes
    read: Callable[[Path], Any]
    summary: Callable[[Any], dict[str, np.ndarray]]
    exact: bool = False


def measurement():
    random = np.random.default_rng(7)
    frf = random.standard_normal((2, 1, 6)) + 1j * random.standard_normal((2, 1, 6))
    return bp.Measurement.from_arrays(
        frf,
        np.arange(5.0, 11.0),
        sensors=["s1+x", "s2-y"],
        actuators=["a1+x"],
        quantity="accelerance",
        coherence=random.uniform(0.3, 1.0, frf.shape),
        averages=8,
        positions={"s1": (0.1, 0.0, 0.0), "a1": (0.5, 0.0, 0.0)},
    )


def of_measurement(read):
    known = {} if read.coherence is None else {"coherence": read.coherence}
    return {"frf": read.frf[read.measured], "frequency": read.frequency, **known}


def of_model(read):
    return {name: getattr(read, name) for name in ("position", "shape", "natural_frequency")}


def of_matrices(read):
    return {"stiffness": read.stiffness.toarray(), "mass": read.mass.toarray()}


def of_tree(read):
    return {
        f"{group.path}/{name}": np.asarray(values)
        for group in read.subtree
        for name, values in group.variables.items()
    }


def of_case(study):
    return of_measurement(study.measurement)


def of_mesh(read):
    corners = {name: nodes.astype(float) for name, nodes in read.elements.items()}
    return {"position": read.position, **corners}


def written(path, write):
    write(path)
    return path.read_bytes()


MODES = b"""    -1
   164
         1                  SI         1
  1.0000000000000000D+00  1.0000000000000000D+00  1.0000000000000000D+00
  0.0000000000000000D+00
    -1
    -1
    15
         1         0         0        11  0.00000e+00  0.00000e+00  0.00000e+00
         2         0         0        11  1.00000e+00  0.00000e+00  0.00000e+00
    -1
    -1
    55
NONE
NONE
NONE
NONE
NONE
         1         2         2         8         2         3
         2         4         1         1
  1.25000e+01  1.00000e+00  2.00000e-02  0.00000e+00
         1
  1.00000e+00  0.00000e+00  5.00000e-01
         2
 -2.00000e+00  0.00000e+00  2.50000e-01
    -1
"""

HISTORIES = b"""    -1
    58
NONE
NONE
NONE
NONE
NONE
    1         1    1         0 NONE               1   3 NONE               0   0
         2         6         1  0.00000E+00  5.00000E-01  0.00000E+00
        17    0    0    0 Time                 s
        12    0    0    0 Acceleration         m/s2
         0    0    0    0 NONE                 NONE
         0    0    0    0 NONE                 NONE
  1.00000E+00 -2.00000E+00  3.00000E+00  4.50000E+00 -5.00000E-01  0.00000E+00
    -1
"""

LABVIEW = b"""LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t.
X_Columns\tOne
***End_of_Header***\t
\t
Channels\t2
Samples\t4\t4
Y_Unit_Label\tN\tm/s^2
X_Dimension\tTime\tTime
X0\t0.0\t0.0
Delta_X\t0.5\t0.5
***End_of_Header***
X_Value\tF\tacc\tComment
0.0\t1.5\t-2.0
0.5\t2.5\t1.0
1.0\t3.5\t0.25
1.5\t4.5\t0.5
"""

RF64 = (
    b"RF64\xff\xff\xff\xffWAVEds64" + struct.pack("<IQQQI", 28, 88, 16, 8, 0)
    + b"fmt " + struct.pack("<IHHIIHH", 16, 1, 1, 512, 1024, 2, 16)
    + b"data\xff\xff\xff\xff" + np.arange(-4, 4, dtype="<i2").tobytes()
)  # fmt: skip

UNIVERSAL_MESH = (
    MODES[: MODES.index(b"    -1\n    55")]
    + b"""    -1
  2412
         1        21         1         1         7         2
         0         1         1
         1         2
    -1
"""
)

CALCULIX = b"""    1C
    2C                             3                                     1
 -1         1 0.00000E+00 0.00000E+00 0.00000E+00
 -1         2 1.00000E+00 0.00000E+00 0.00000E+00
 -1         5 1.00000E+00-1.00000E+00 0.00000E+00
 -3
    3C                             1                                     1
 -1         1    7    0    1
 -2         1         2         5
 -3
 9999
"""

BLOCKS = b"".join(
    b"Signal:\t%s\nX-Axis unit:\tHz\n1\t2.0\t-1.5\n2\t3.0\t2.5\n" % name for name in (b"A", b"B")
)


def of_channels(name, **settings):
    """Read one channel of accelerations."""
    signal = bp.time_records.Signal(name, "m/s^2")
    return lambda path: bp.time_records.read(path, {"s1": signal}, **settings)


def of_recording(read):
    return {"rate": np.array(read.rate), "s1": read["s1"]}


def read_blocks(path):
    pair = {"sensor": "s1", "actuator": "a1", "unit": "m/N"}
    pair |= {"real": "A column 2", "imaginary": "A column 3"}
    frequency = {"array": "B column 2", "unit": "Hz"}
    return bp.io.read(path, {"frf": [pair], "frequency": frequency}).measurement


CASE = {
    "structure": {
        "type": "axial bar",
        "length_m": 1.0,
        "area_m2": 1e-3,
        "boundary_conditions": "fixed at x=0 and x=L",
        "motion": "axial displacement u(x), direction 1",
        "youngs_modulus_Pa": 1e9,
        "density_kg_m3": 9000.0,
        "damping": {"model": "modal viscous, the same ratio for every mode", "ratio": 0.04},
    },
    "nominal_fe_model": None,
    "sensors": [
        {
            "id": "s1",
            "uff_node": 1,
            "position_m": [0.25, 0.0, 0.0],
            "tolerance_m": [0.04, 0.0, 0.0],
            "directions": [1],
            "angle_tolerance_rad": 0.0,
        }
    ],
    "actuators": [
        {
            "id": "a1",
            "uff_node": 101,
            "position_m": [0.5, 0.0, 0.0],
            "tolerance_m": [0.0, 0.0, 0.0],
            "directions": [1],
            "angle_tolerance_rad": 0.0,
        }
    ],
    "uncertain_parameters": [
        {
            "name": "modal_damping_ratio",
            "nominal": 0.04,
            "prior": {"type": "uniform", "low": 0.02, "high": 0.06},
        }
    ],
    "frequency": {"band_hz": [5.0, 10.0], "n_lines": 6},
    "measurement": {
        "quantity": "accelerance",
        "units": "(m/s^2)/N",
        "convention": "exp(+i w t)",
        "estimator": "H1",
        "n_averages": 8,
        "out_channels": [["s1", 1]],
        "in_channels": [["a1", 1]],
        "sensor_setup": "all sensors mounted all the time",
        "force_levels_N": None,
    },
}


def bar_measurement():
    full_measurement = measurement()
    return dataclasses.replace(
        full_measurement.channels(["s1+x"], ["a1+x"]),
        positions={"s1": (0.25, 0.0, 0.0), "a1": (0.5, 0.0, 0.0)},
    )


def read_case(path):
    uff.write(path.parent / "measured.uff", bar_measurement())
    return case.read(path.parent)


def tree():
    draws = (("chain", "draw"), np.linspace(0, 1, 12).reshape(2, 6), {"units": "m"})
    posterior = xr.Dataset({"sensor.s1.position": draws})
    return xr.DataTree.from_dict({"/posterior": posterior, "/prior": posterior})


class Readers(dict):
    """Readers by name, which print briefly where a test fails."""

    def __repr__(self):
        return f"Readers({list(self)})"


@pytest.fixture(scope="module")
def readers(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    matrix = scipy.sparse.csc_array(np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0, -1, 1.0]]))
    model = {
        "position": np.arange(6.0).reshape(2, 3),
        "shape": np.array([[[1.0], [0.5], [0.0]], [[0.2], [0.0], [1.0]]]),
        "natural_frequency": np.array([12.0]),
        "modal_mass": np.array([1.0]),
    }

    def read_matrices(path):
        return matrix_files.read(path, path)

    readers_by_name = {
        "uff": Reader(
            "measured.uff",
            written(folder / "a.uff", lambda path: uff.write(path, measurement())),
            lambda path: uff.read(path, require_positions=False),
            of_measurement,
        ),
        "uff binary": Reader(
            "measured.uff",
            written(folder / "b.uff", lambda path: uff.write(path, measurement(), binary=True)),
            lambda path: uff.read(path, require_positions=False),
            of_measurement,
        ),
        "uff modes": Reader("modes.unv", MODES, uff.read_modes, of_model),
        "npz modes": Reader(
            "modes.npz",
            written(folder / "m.npz", lambda path: np.savez_compressed(path, **model)),
            npz_modes.read,
            of_model,
        ),
        "npz matrices": Reader(
            "K.npz",
            written(folder / "K.npz", lambda path: scipy.sparse.save_npz(path, matrix)),
            read_matrices,
            of_matrices,
        ),
        "mtx": Reader(
            "K.mtx",
            written(folder / "K.mtx", lambda path: scipy.io.mmwrite(path, matrix)),
            read_matrices,
            of_matrices,
        ),
        "netcdf": Reader(
            "result.nc",
            written(folder / "r.nc", lambda path: netcdf.write(tree(), path)),
            netcdf.read,
            of_tree,
            exact=True,
        ),
        "case": Reader("case.json", json.dumps(CASE, indent=1).encode(), read_case, of_case),
        "time histories": Reader("hits.uff", HISTORIES, of_channels("1+z"), of_recording),
        "labview": Reader("hits.lvm", LABVIEW, of_channels("acc"), of_recording),
        "npy": Reader(
            "hits.npy",
            written(folder / "n.npy", lambda path: np.save(path, np.linspace(-1, 1, 12))),
            of_channels("hits", rate=512.0),
            of_recording,
        ),
        "wav": Reader("hits.wav", RF64, of_channels("channel 1"), of_recording),
        "universal mesh": Reader("part.unv", UNIVERSAL_MESH, mesh.read, of_mesh),
        "calculix": Reader("part.frd", CALCULIX, mesh.read, of_mesh),
        "mat matrices": Reader(
            "K.mat",
            written(folder / "K.mat", lambda path: scipy.io.savemat(path, {"K": matrix})),
            read_matrices,
            of_matrices,
        ),
        "text in blocks": Reader("a.txt", BLOCKS, read_blocks, of_measurement),
        "mesh": Reader(
            "part.vtk",
            b"# vtk DataFile Version 4.2\npart\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n"
            b"0 0 0 1 0 0 1 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n",
            mesh.read,
            of_mesh,
        ),
    }
    return Readers(
        (name, (reader, valid(folder, reader))) for name, reader in readers_by_name.items()
    )


def valid(folder, reader):
    """Summary of the whole file."""
    (folder / "whole").mkdir(exist_ok=True)
    path = folder / "whole" / reader.name
    path.write_bytes(reader.content)
    return reader.summary(reader.read(path))


PIECES = st.sampled_from(
    [b" ", b"-", b"\n", b"    -1\n", b"0", b"9" * 12, b"nan", b"1e300", b"x", b"\0", b"{", b"1,5"]
) | st.binary(min_size=1, max_size=8)


@st.composite
def edits(draw):
    """A change at a share of the length: what is left out there, and what is put in its place."""
    place = draw(st.floats(0, 1, exclude_max=True))
    removed = draw(st.sampled_from([0, 0, 1, 1, 2, 8, 80, 10**9]))
    return place, removed, draw(PIECES | st.just(b""))


def damaged(content, changes):
    for place, removed, put in changes:
        start = math.floor(place * len(content))
        content = content[:start] + put + content[start + removed :]
    return content


def check_damage_is_told(folder, reader, expected, changes):
    content = damaged(reader.content, changes)
    path = folder / reader.name
    path.write_bytes(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a mesh that is read as far as it goes
            read = reader.summary(reader.read(path))
    except (InputError, FileNotFoundError) as error:
        assert str(folder) in str(error), "an error names the file"
        return
    if reader.exact or content == reader.content:
        assert read.keys() == expected.keys()
        for name, values in expected.items():
            np.testing.assert_array_equal(read[name], values)
    for name, values in read.items():
        assert np.all(np.isfinite(values) | np.isnan(expected.get(name, np.nan)).any())
        assert np.all(np.abs(values) <= 1e30)


CHANGES = st.lists(edits(), min_size=1, max_size=3)
FAST = ("uff", "uff binary", "uff modes", "npz modes", "npz matrices", "mtx", "netcdf", "case")
FAST += ("time histories", "labview", "npy", "wav", "mat matrices", "text in blocks")
MESHES = ("mesh", "universal mesh", "calculix")


@pytest.mark.parametrize("name", FAST)
@settings(max_examples=SHORT, **QUIET)
@given(changes=CHANGES)
def test_damage_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)


@pytest.mark.parametrize("name", MESHES)
@settings(max_examples=6, **QUIET)  # each may start a process
@given(changes=CHANGES)
def test_damage_of_a_mesh_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["uff", *(pytest.param(name, marks=pytest.mark.longest) for name in FAST[1:])]
)
@settings(max_examples=LONG, **QUIET)
@given(changes=CHANGES)
def test_much_damage_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)


@pytest.mark.long
@pytest.mark.longest
@settings(max_examples=30, **QUIET)
@given(changes=CHANGES)
def test_much_damage_of_a_mesh_is_told(readers, tmp_path_factory, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers["mesh"], changes)
