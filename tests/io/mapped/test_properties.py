"""Properties of the readers of arrays: what is written comes back, and a damaged file is told."""

import numpy as np
import openpyxl
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of

import bayes_placement as bp
from bayes_placement.io.mapped import channel_table
from tests.io.arrays.test_arrays import write_matlab_7_3
from tests.io.mapped.test_importing import (
    ARRAYS,
    MAPPING,
    TABLE,
    write_hdf5,
    write_mat_5,
    write_mat_7,
    write_npz,
    write_table,
)
from tests.io.test_properties import (
    CHANGES,
    FINITE,
    LONG,
    QUIET,
    SHORT,
    Reader,
    Readers,
    check_damage_is_told,
    of_measurement,
    valid,
)

# beartype looks at random entries of lists, which Hypothesis takes for a mistake
pytestmark = pytest.mark.filterwarnings("ignore:Do not use the `random` module inside strategies")

AXES = ("frequency", "sensor", "actuator")


@st.composite
def blocks(draw):
    """FRFs (sensor, actuator, frequency), lines, and the order of the axes in the file."""
    shape = tuple(draw(st.integers(1, n)) for n in (3, 2, 5))
    parts = arrays_of.arrays(float, shape, elements=FINITE)
    frf = draw(parts) + 1j * draw(parts)
    steps = draw(st.lists(st.floats(0.01, 10), min_size=shape[2], max_size=shape[2]))
    return frf, np.cumsum(steps), draw(st.permutations(AXES))


def write_blocks(folder, form, frf, frequency, order):
    """Write FRFs in a form, and a mapping that says what they are."""
    axes = ("sensor", "actuator", "frequency")
    block = np.transpose(frf, [axes.index(axis) for axis in order])
    content = {"H": block, "f": frequency}
    if form == "npz":
        np.savez(folder / "a.npz", **content)
    elif form == "mat 7.3":
        write_matlab_7_3(folder / "a.mat", **content)
    else:
        scipy.io.savemat(folder / "a.mat", content, do_compression=form == "mat 7")
    name = "a.npz" if form == "npz" else "a.mat"
    return folder / name, {
        "frf": {"array": "H", "axes": list(order), "unit": "m/N"},
        "frequency": {"array": "f", "unit": "Hz"},
        "sensors": [f"s{row}" for row in range(frf.shape[0])],
        "actuators": [f"a{column}" for column in range(frf.shape[1])],
    }


def check_block_comes_back(folder, form, block):
    frf, frequency, _ = block
    measurement = bp.io.read(*write_blocks(folder, form, *block)).measurement
    np.testing.assert_array_equal(measurement.frf, frf)
    np.testing.assert_array_equal(measurement.frequency, frequency)


@settings(max_examples=60, **QUIET)
@given(block=blocks(), form=st.sampled_from(["npz", "mat 5", "mat 7"]))
def test_blocks_come_back_from_any_file(tmp_path_factory, block, form):
    check_block_comes_back(tmp_path_factory.mktemp("block"), form, block)


@settings(max_examples=4, **QUIET)  # each starts a process
@given(block=blocks())
def test_blocks_come_back_from_matlab_7_3(tmp_path_factory, block):
    check_block_comes_back(tmp_path_factory.mktemp("block"), "mat 7.3", block)


@pytest.mark.long
@pytest.mark.longest
@settings(max_examples=LONG, **QUIET)
@given(block=blocks(), form=st.sampled_from(["npz", "mat 5", "mat 7"]))
def test_many_blocks_come_back_from_any_file(tmp_path_factory, block, form):
    check_block_comes_back(tmp_path_factory.mktemp("block"), form, block)


@settings(max_examples=60, **QUIET)
@given(
    block=blocks(),
    separator=st.sampled_from([",", ";", "\t", "; "]),
    decimal=st.sampled_from([".", ","]),
    book=st.booleans(),
)
def test_columns_come_back_from_any_file(tmp_path_factory, block, separator, decimal, book):
    frf, frequency, _ = block
    heading, columns = ["frequency [Hz]"], [frequency]
    for row, column in np.ndindex(frf.shape[:2]):
        pair = f"s{row}/a{column}"
        heading += [f"{pair} real [m/N]", f"{pair} imaginary [m/N]"]
        columns += [frf[row, column].real, frf[row, column].imag]
    path = tmp_path_factory.mktemp("columns") / ("a.xlsx" if book else "a.csv")
    rows = [[float(value) for value in line] for line in zip(*columns, strict=True)]
    if book:
        workbook = openpyxl.Workbook()
        for line in (heading, *rows):
            workbook.active.append(line)
        workbook.save(path)
    else:
        point = decimal if separator != "," else "."
        texts = [[repr(value).replace(".", point) for value in line] for line in rows]
        path.write_text("\n".join(separator.join(line) for line in (heading, *texts)))
    measurement = bp.io.read(path).measurement
    precision = 1e-15 if book else 0.0  # workbooks hold sixteen digits
    np.testing.assert_allclose(measurement.frf.real, frf.real, rtol=precision)
    np.testing.assert_allclose(measurement.frf.imag, frf.imag, rtol=precision)
    np.testing.assert_allclose(measurement.frequency, frequency, rtol=precision)


# ------------------------------------------------------------------------------------ damaged files


def with_mapping(path):
    """Read a file with the mapping of the tests, which names all of its arrays."""
    fields = {
        "frf": {"array": "H", "axes": list(AXES), "unit": "g/N"},
        "frequency": {"array": "f", "unit": "Hz"},
        "sensors": ["s1+x", "s2-y"],
        "actuators": ["a1+x"],
        "coherence": "C",
        "averages": 8,
    }
    return bp.io.read(path, fields).measurement


def read_mapping(path):
    write_npz(path.parent / "a.npz")
    return bp.io.read(path).measurement


def of_rows(rows):
    places = [row.position for row in rows if row.position]
    return {"position": np.array(places, dtype=float).reshape(-1, 3)}


def in_columns(path):
    columns = [ARRAYS["f"], ARRAYS["H"][:, 0, 0].real, ARRAYS["H"][:, 0, 0].imag]
    heading = "frequency [Hz],s1/a1 real [g/N],s1/a1 imaginary [g/N]"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=heading, comments="")


def in_workbook(path):
    book = openpyxl.Workbook()
    book.active.append(["frequency [Hz]", "s1/a1 real [g/N]", "s1/a1 imaginary [g/N]"])
    for line, value in zip(ARRAYS["f"], ARRAYS["H"][:, 0, 0], strict=True):
        book.active.append([float(line), float(value.real), float(value.imag)])
    book.save(path)


def written(folder, name, write):
    write(folder / name)
    return (folder / name).read_bytes()


@pytest.fixture(scope="module")
def readers(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    mapping = MAPPING.replace("FILE", "a.npz").encode()
    forms = {
        "mat 5": ("a.mat", write_mat_5, with_mapping, False),
        "mat 7": ("b.mat", write_mat_7, with_mapping, True),
        "npz": ("a.npz", write_npz, with_mapping, True),
        "hdf5": ("a.h5", write_hdf5, with_mapping, False),
        "mat 7.3": (
            "c.mat",
            lambda path: write_matlab_7_3(path, **ARRAYS),
            with_mapping,
            False,
        ),
        "csv": ("a.csv", in_columns, lambda path: bp.io.read(path).measurement, False),
        "xlsx": ("a.xlsx", in_workbook, lambda path: bp.io.read(path).measurement, True),
    }
    readers_by_name = {
        form: Reader(name, written(folder, name, write), read, of_measurement, exact=exact)
        for form, (name, write, read, exact) in forms.items()
    }
    readers_by_name["mapping"] = Reader("a.toml", mapping, read_mapping, of_measurement)
    for name in ("channels.csv", "channels.xlsx"):
        content = written(folder, name, lambda path: write_table(path, TABLE))
        exact = name.endswith("xlsx")
        readers_by_name[name] = Reader(name, content, channel_table.read, of_rows, exact=exact)
    return Readers(
        (name, (reader, valid(folder, reader))) for name, reader in readers_by_name.items()
    )


FAST = ("mat 5", "mat 7", "npz", "csv", "xlsx", "mapping", "channels.csv", "channels.xlsx")
SLOW = ("hdf5", "mat 7.3")


@pytest.mark.parametrize("name", FAST)
@settings(max_examples=SHORT, **QUIET)
@given(changes=CHANGES)
def test_damage_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)


@pytest.mark.parametrize("name", SLOW)
@settings(max_examples=6, **QUIET)  # each starts a process
@given(changes=CHANGES)
def test_damage_of_hdf5_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["mat 5", *(pytest.param(name, marks=pytest.mark.longest) for name in FAST[1:])]
)
@settings(max_examples=LONG, **QUIET)
@given(changes=CHANGES)
def test_much_damage_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)


@pytest.mark.long
@pytest.mark.longest
@pytest.mark.parametrize("name", SLOW)
@settings(max_examples=150, **QUIET)
@given(changes=CHANGES)
def test_much_damage_of_hdf5_is_told(readers, tmp_path_factory, name, changes):
    check_damage_is_told(tmp_path_factory.mktemp("damaged"), *readers[name], changes)
