"""Measured FRFs of any file: what comes out, what is told, and the lines that are asked for."""

import re
import tomllib

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pytest
import pyuff
import scipy.io

import bayes_placement as bp
from tests.io.arrays.test_arrays import of_matlab, write_matlab_7_3

LINES = 10.0 + 0.5 * np.arange(6)
RANDOM = np.random.default_rng(3)
FRF = RANDOM.standard_normal((2, 1, 6)) + 1j * RANDOM.standard_normal((2, 1, 6))
COHERENCE = RANDOM.uniform(0.5, 1.0, FRF.shape)
GRAVITY = 9.80665
AXES = 'axes = ["frequency", "sensor", "actuator"]'
MAPPING = f"""file = "FILE"
frf = {{ array = "H", {AXES}, unit = "g/N" }}
frequency = {{ array = "f", unit = "Hz" }}
sensors = ["s1+x", "s2-y"]
actuators = ["a1+x"]
coherence = "C"
averages = 8
"""
ARRAYS = {"H": np.moveaxis(FRF, 2, 0), "f": LINES, "C": np.moveaxis(COHERENCE, 2, 0)}


def mapped(folder, name, text=MAPPING):
    path = folder / "mapping.toml"
    path.write_text(text.replace("FILE", name))
    return path


def check_read(imported, factor=GRAVITY):
    measurement = imported.measurement
    np.testing.assert_allclose(measurement.frf, FRF * factor, rtol=1e-9)
    np.testing.assert_allclose(measurement.frequency, LINES, rtol=1e-12)
    assert [channel.label for channel in measurement.sensors] == ["s1+x", "s2-y"]
    assert [channel.label for channel in measurement.actuators] == ["a1+x"]
    assert measurement.quantity == "accelerance"


# ------------------------------------------------------------------- the same FRFs in many formats


def write_mat_5(path):
    scipy.io.savemat(path, ARRAYS)


def write_mat_7(path):
    scipy.io.savemat(path, ARRAYS, do_compression=True)


def write_mat_7_3(path):
    write_matlab_7_3(path, **ARRAYS)


def write_npz(path):
    np.savez_compressed(path, **ARRAYS)


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        for name, values in ARRAYS.items():
            file.create_dataset(name, data=values, compression="gzip", shuffle=True)


@pytest.mark.parametrize(
    ("write", "name"),
    [
        (write_mat_5, "measured.mat"),
        (write_mat_7, "measured.data"),
        (write_mat_7_3, "measured.mat"),
        (write_npz, "measured.data"),
        (write_hdf5, "measured.data"),
    ],
)
def test_arrays_with_a_mapping_are_read(tmp_path, name, write):
    write(tmp_path / "written")
    written = tmp_path / "written"
    if not written.exists():
        written = next(tmp_path.glob("written.*"))
    written.rename(tmp_path / name)
    imported = bp.io.read(mapped(tmp_path, name))
    check_read(imported)
    np.testing.assert_allclose(imported.measurement.coherence, COHERENCE)
    assert imported.measurement.averages == 8
    check_read(bp.io.read(tmp_path / name, tmp_path / "mapping.toml"))
    measurement = bp.io.read_measurement(tmp_path / "mapping.toml")
    np.testing.assert_array_equal(measurement.frf, imported.measurement.frf)


PARTS = {"re": FRF.real, "im": FRF.imag, "dB": 20 * np.log10(np.abs(FRF))}
PARTS["deg"] = np.degrees(np.angle(FRF))
PAIRS = """file = "FILE"
unit = "g/N"
frequency = { array = "f", unit = "Hz" }
[[frf]]
sensor = "s1+x"
actuator = "a1+x"
FIRST = "s1 A"
SECOND = "s1 B"
[[frf]]
sensor = "s2-y"
actuator = "a1+x"
FIRST = 4
SECOND = 5
"""


def columns(first, second):
    return pd.DataFrame(
        {
            "f": LINES,
            "s1 A": PARTS[first][0, 0],
            "s1 B": PARTS[second][0, 0],
            "s2 A": PARTS[first][1, 0],
            "s2 B": PARTS[second][1, 0],
        }
    )


@pytest.mark.parametrize(("first", "second"), [("re", "im"), ("dB", "deg")])
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("a.csv", {}),
        ("a.tsv", {"sep": "\t"}),
        ("a.txt", {"sep": ";", "decimal": ","}),
        ("a.xlsx", None),
    ],
)
def test_columns_with_a_mapping_are_read(tmp_path, first, second, name, options):
    table = columns(first, second)
    if options is None:
        table.to_excel(tmp_path / name, index=False)
    else:
        table.to_csv(tmp_path / name, index=False, **options)
    words = {"re": "real", "im": "imaginary", "dB": "decibel", "deg": "degrees"}
    text = PAIRS.replace("FIRST", words[first]).replace("SECOND", words[second])
    check_read(bp.io.read(mapped(tmp_path, name, text)))


def test_columns_without_heading_are_read_by_number(tmp_path):
    np.savetxt(tmp_path / "a.txt", columns("re", "im").to_numpy())
    text = PAIRS.replace("FIRST", "real").replace("SECOND", "imaginary")
    text = text.replace('"f"', "1").replace('"s1 A"', "2").replace('"s1 B"', "3")
    check_read(bp.io.read(mapped(tmp_path, "a.txt", text)))


def test_columns_that_are_called_by_number_keep_their_units(tmp_path):
    (tmp_path / "a.csv").write_text("f [kHz],A [mm/N],B [mm/N]\n1,2,3\n2,3,4\n")
    pair = {"sensor": "s1", "actuator": "a1", "real": 2, "imaginary": 3}
    measurement = bp.io.read_measurement(
        tmp_path / "a.csv", mapping={"frf": [pair], "frequency": {"array": 1}}
    )
    np.testing.assert_allclose(measurement.frf[0, 0], [2e-3 + 3e-3j, 3e-3 + 4e-3j])
    np.testing.assert_allclose(measurement.frequency, [1e3, 2e3])


def test_columns_that_say_what_they_are_need_no_mapping(tmp_path):
    heading = ["frequency [Hz]"]
    for sensor in ("s1+x", "s2-y"):
        pair = f"{sensor}/a1+x"
        heading += [f"{pair} real [g/N]", f"{pair} imaginary [g/N]", f"{pair} coherence"]
    values = [LINES]
    for row in range(2):
        values += [FRF[row, 0].real, FRF[row, 0].imag, COHERENCE[row, 0]]
    np.savetxt(tmp_path / "a.csv", np.column_stack(values), delimiter=",", header=",".join(heading))
    imported = bp.io.read(tmp_path / "a.csv")
    check_read(imported)
    np.testing.assert_allclose(imported.measurement.coherence, COHERENCE)


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("Frequency [Hz]", 1.0),
        ("frequency_hz", 1.0),
        ("FREQUENCY (HZ)", 1.0),
        ("f [Hz]", 1.0),
        ("Freq kHz", 1e3),
    ],
)
def test_a_heading_of_the_frequency_may_be_written_in_many_ways(tmp_path, heading, factor):
    unit = "[(m/s^2)/N]"
    columns = {heading: LINES, f"s1/a1 real {unit}": LINES, f"s1/a1 imaginary {unit}": LINES}
    pd.DataFrame(columns).to_csv(tmp_path / "measured.csv", index=False)
    read = bp.io.read_measurement(tmp_path / "measured.csv")
    np.testing.assert_allclose(read.frequency, factor * LINES)


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_arrays_that_say_what_they_are_need_no_mapping(tmp_path, suffix):
    content = {
        "frf": FRF,
        "frequency": LINES,
        "sensors": np.array(["s1+x", "s2-y"]),
        "actuators": np.array(["a1+x"]),
        "quantity": np.array("accelerance"),
        "coherence": COHERENCE,
    }
    write = np.savez if suffix == ".npz" else lambda path, **arrays: scipy.io.savemat(path, arrays)
    write(tmp_path / f"a{suffix}", **content)
    imported = bp.io.read(tmp_path / f"a{suffix}")
    check_read(imported, factor=1.0)
    np.testing.assert_allclose(imported.measurement.coherence, COHERENCE)


def test_a_unit_that_columns_leave_open_is_that_of_the_mapping(tmp_path):
    heading = "frequency [Hz],s1/a1 real,s1/a1 imaginary"
    (tmp_path / "a.csv").write_text(f"{heading}\n1,2,3\n2,3,4\n")
    measurement = bp.io.read_measurement(tmp_path / "a.csv", mapping={"unit": "mm/N"})
    np.testing.assert_allclose(measurement.frf[0, 0], [2e-3 + 3e-3j, 3e-3 + 4e-3j])
    assert measurement.quantity == "receptance"


def test_a_unit_that_is_not_that_of_the_file_is_refused(tmp_path):
    names = {"sensors": np.array(["s1"]), "actuators": np.array(["a1"])}
    stated = {"frf": FRF[:1], "frequency": LINES, "quantity": np.array("accelerance"), **names}
    np.savez(tmp_path / "a.npz", **stated)
    assert bp.io.read_measurement(tmp_path / "a.npz", mapping={"unit": "m/s²/N"}).frf.shape[2] == 6
    with pytest.raises(ValueError, match=r"the FRFs are in 'g/N' and .*a\.npz says '.m/s.2./N'"):
        bp.io.read(tmp_path / "a.npz", {"unit": "g/N"})


def test_universal_files_of_another_writer_are_read(tmp_path):
    path = tmp_path / "pyuff.uff"
    _write_by_pyuff(path)
    imported = bp.io.read(path, {"averages": 4})
    np.testing.assert_allclose(imported.measurement.frf[0, 0], FRF[0, 0], rtol=1e-5)
    assert imported.measurement.averages == 4
    assert "dataset 151 (1), since it holds neither FRFs" in str(imported.report)
    mapping = {"convention": "exp(-i w t)", "force_level": 2.5}
    other = bp.io.read(path, mapping)
    np.testing.assert_array_equal(other.measurement.frf, imported.measurement.frf.conj())
    assert other.measurement.force_level == 2.5
    assert "in SI by its units, conjugated, since the file is under exp(-i w t)." in str(other)
    with pytest.raises(ValueError, match=r"has the field unit, and .* is a universal file"):
        bp.io.read(path, {"unit": "g/N"})


def _write_by_pyuff(path, reference=7):
    file = pyuff.UFF(str(path))
    file.write_sets(
        pyuff.prepare_151(
            model_name="m",
            description="d",
            db_app="a",
            program="p",
            date_db_created="1-Jan-25",
            time_db_created="10:00:00",
            version_db1=0,
            version_db2=0,
            file_type=0,
            date_db_saved="1-Jan-25",
            time_db_saved="10:00:00",
            date_db_written="1-Jan-25",
            time_db_written="10:00:00",
        ),
        "overwrite",
    )
    file.write_sets(
        {
            "type": 58,
            "func_type": 4,
            "binary": 0,
            "data": FRF[0, 0],
            "x": LINES,
            "rsp_node": 5,
            "rsp_dir": 3,
            "ref_node": reference,
            "ref_dir": -3,
            "abscissa_spec_data_type": 18,
            "ordinate_spec_data_type": 12,
            "orddenom_spec_data_type": 13,
        },
        "add",
    )


@pytest.mark.parametrize(
    "name",
    ["testcomplex_6.1_SOL2.mat", "testcomplex_6.5.1_GLNX86.mat", "testcomplex_7.4_GLNX86.mat"],
)
def test_files_that_matlab_wrote_are_read_with_a_mapping(name):
    mapping = {
        "frf": {"array": "testcomplex", "unit": "mm/s/N"},
        "frequency": {"first": 0.1, "step": 0.2, "unit": "kHz"},
        "sensors": ["s1"],
        "actuators": ["a1"],
    }
    measurement = bp.io.read(of_matlab(name), mapping).measurement
    theta = np.pi / 4 * np.arange(9)
    np.testing.assert_allclose(measurement.frf[0, 0], 1e-3 * np.exp(1j * theta), atol=1e-18)
    np.testing.assert_allclose(measurement.frequency, 100 + 200 * np.arange(9))
    assert measurement.quantity == "mobility"


# ------------------------------------------------------------------------ units, signs, sensitivity


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        ("(m/s^2)/N", "accelerance", 1.0),
        ("m/s²/N", "accelerance", 1.0),
        ("g/kN", "accelerance", GRAVITY / 1e3),
        ("(mm/s)/N", "mobility", 1e-3),
        ("um/N", "receptance", 1e-6),
        ("in/lbf", "receptance", 0.0254 / 4.4482216152605),
    ],
)
def test_units_give_quantity_and_factor(tmp_path, unit, quantity, factor):
    np.savez(tmp_path / "a.npz", **ARRAYS)
    imported = bp.io.read(mapped(tmp_path, "a.npz", MAPPING.replace("g/N", unit)))
    assert imported.measurement.quantity == quantity
    np.testing.assert_allclose(imported.measurement.frf, FRF * factor)


def test_a_file_under_the_other_sign_is_conjugated(tmp_path):
    np.savez(tmp_path / "a.npz", **{**ARRAYS, "H": np.conj(ARRAYS["H"])})
    text = MAPPING + 'convention = "exp(-i w t)"\n'
    imported = bp.io.read(mapped(tmp_path, "a.npz", text))
    check_read(imported)
    assert "conjugated, since the file is under exp(-i w t)" in str(imported.report)


def test_lines_in_radians_become_hertz(tmp_path):
    np.savez(tmp_path / "a.npz", **{**ARRAYS, "f": 2 * np.pi * LINES})
    check_read(bp.io.read(mapped(tmp_path, "a.npz", MAPPING.replace('"Hz"', '"rad/s"'))))


def test_numbers_of_an_even_axis_may_stand_in_the_file(tmp_path):
    np.savez(tmp_path / "a.npz", **ARRAYS, start=np.array(10.0), increment=np.array(0.5))
    text = MAPPING.replace('array = "f"', 'first = "start", step = "increment"')
    check_read(bp.io.read(mapped(tmp_path, "a.npz", text)))


TABLE = [
    ["name", "role", "node", "x [mm]", "y [mm]", "z [mm]", "direction", "tolerance [mm]",
     "sensitivity", "unit"],
    ["s1", "sensor", 5, 250, 0, 0, "+x", 10, 100, "mV/g"],
    ["s2", "sensor", 6, 500, 0, 0, "-y", 10, 10, "mV/(m/s^2)"],
    ["a1", "actuator", 7, 100, 0, 0, "+x", 5, 2, "mV/N"],
]  # fmt: skip


def write_table(path, rows=TABLE):
    if path.suffix == ".xlsx":
        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        book.save(path)
    else:
        path.write_text("\n".join(";".join(map(str, row)) for row in rows))


@pytest.mark.parametrize("name", ["channels.xlsx", "channels.csv"])
def test_voltages_are_divided_by_the_sensitivities(tmp_path, name):
    by_sensor = np.array([0.1 / GRAVITY, 0.01])[:, None, None]
    volts = FRF * by_sensor / 2e-3
    np.savez(tmp_path / "a.npz", **{**ARRAYS, "H": np.moveaxis(volts, 2, 0)})
    write_table(tmp_path / name)
    text = MAPPING.replace("g/N", "V/V") + f'channels = "{name}"\n'
    imported = bp.io.read(mapped(tmp_path, "a.npz", text))
    check_read(imported, factor=1.0)
    assert imported.measurement.positions["s2"] == (0.5, 0.0, 0.0)
    millivolts = text.replace("V/V", "mV/V")
    np.testing.assert_allclose(
        bp.io.read(mapped(tmp_path, "a.npz", millivolts)).measurement.frf, FRF / 1e3
    )


def test_a_folder_with_data_table_and_mapping_is_read(tmp_path):
    scipy.io.savemat(tmp_path / "H.mat", ARRAYS)
    write_table(tmp_path / "channels.xlsx")
    mapped(tmp_path, "", MAPPING.replace('file = "FILE"\n', "").replace("s1+x", "s1"))
    imported = bp.io.read(tmp_path)
    check_read(imported)  # the direction of s1 is that of the table
    assert [row.tolerance for row in imported.channels] == [(0.01,) * 3] * 2 + [(0.005,) * 3]
    why = "since the FRFs are in units of motion and force already."
    assert f"Left out: sensitivity of s1+x, s2-y, a1+x, {why}" in imported.report.words()


def test_a_workbook_may_hold_channels_and_columns(tmp_path):
    book = openpyxl.Workbook()
    for row in TABLE:
        book.active.append([*row, None])
    second = book.create_sheet("FRF")
    table = columns("re", "im")
    for row in (list(table.columns), *table.to_numpy().tolist()):
        second.append(row)
    book.save(tmp_path / "a.xlsx")
    text = PAIRS.replace("FIRST", "real").replace("SECOND", "imaginary")
    for number, name in ((4, "s2 A"), (5, "s2 B")):
        text = text.replace(f"= {number}", f'= "{name}"')
    for name in ("f", "s1 A", "s1 B", "s2 A", "s2 B"):
        text = text.replace(f'"{name}"', f'"FRF!{name}"')
    imported = bp.io.read(mapped(tmp_path, "a.xlsx", 'channels = "a.xlsx"\n' + text))
    check_read(imported)
    assert imported.measurement.positions["s1"] == (0.25, 0.0, 0.0)


def test_a_channel_table_names_the_nodes_of_a_universal_file(tmp_path):
    _write_by_pyuff(tmp_path / "measured.uff")
    rows = [list(row) for row in TABLE]
    rows[1][6], rows[3][6] = "+z", "-z"
    write_table(tmp_path / "channels.csv", rows)
    imported = bp.io.read(tmp_path)
    measurement = imported.measurement
    assert measurement.sensors == (bp.Channel("s1", 3),)
    assert measurement.actuators == (bp.Channel("a1", -3),)
    assert measurement.positions["s1"] == (0.25, 0.0, 0.0)
    assert "Left out: channel s2-y of the table, since no FRF is of it." in str(imported)


def test_axes_of_a_channel_table_that_the_file_contradicts_are_refused(tmp_path):
    rows = [list(row) for row in TABLE]
    rows[1][6] = "+y"
    write_table(tmp_path / "channels.csv", rows)
    np.savez(tmp_path / "a.npz", **ARRAYS)
    text = MAPPING + 'channels = "channels.csv"\n'
    words = r"holds FRFs of s1\+{} and the channel table has s1\+y; the axes must agree"
    with pytest.raises(ValueError, match=words.format("x")):
        bp.io.read(mapped(tmp_path, "a.npz", text))
    _write_by_pyuff(tmp_path / "a.uff")
    with pytest.raises(ValueError, match=words.format("z")):
        bp.io.read(mapped(tmp_path, "a.uff", 'file = "FILE"\nchannels = "channels.csv"\n'))
    rows[1][6] = "-x"  # against the file's own direction, which has the last word
    write_table(tmp_path / "channels.csv", rows)
    assert bp.io.read(mapped(tmp_path, "a.npz", text)).measurement.sensors[0].label == "s1+x"


def test_a_direction_of_a_channel_table_that_was_not_measured_is_told(tmp_path):
    rows = [list(row) for row in TABLE]
    rows.insert(2, [*rows[1][:6], "+z", *rows[1][7:]])
    rows[-1][6] = ""  # may be any
    write_table(tmp_path / "channels.csv", rows)
    np.savez(tmp_path / "a.npz", **ARRAYS)
    imported = bp.io.read(mapped(tmp_path, "a.npz", MAPPING + 'channels = "channels.csv"\n'))
    left_out = [name for name in imported.report.left_out if name.startswith("channel")]
    assert left_out == ["channel s1+z of the table"]


def test_a_sensor_and_an_actuator_at_one_node_both_have_its_position(tmp_path):
    path = tmp_path / "measured.uff"
    _write_by_pyuff(path, reference=5)
    numbers = {name: [0] for name in ("def_cs", "disp_cs", "color")}
    nodes = pyuff.prepare_15(node_nums=[5], **numbers, x=[0.25], y=[0.0], z=[0.0])
    pyuff.UFF(str(path)).write_sets(nodes, "add")
    rows = [["name", "role", "node"], ["s1", "sensor", 5], ["a1", "actuator", 5]]
    write_table(tmp_path / "channels.csv", rows)
    place = (0.25, 0.0, 0.0)
    in_metres = {"length_unit": 1.0}
    assert bp.io.read(tmp_path, in_metres).measurement.positions == {"s1": place, "a1": place}
    np.savez(tmp_path / "a.npz", **ARRAYS)
    with pytest.raises(ValueError, match=r"has the field length_unit, and .* no universal file"):
        bp.io.read(tmp_path / "a.npz", in_metres)


# -------------------------------------------------------------------------------- what is asked for


def lines_asked_for(error):
    """The mapping in an error, behind an empty line."""
    return str(error.value).partition("\n\n")[2]


def test_a_matrix_without_axes_is_refused_with_the_lines_that_are_needed(tmp_path):
    scipy.io.savemat(tmp_path / "measured.mat", {"H": ARRAYS["H"], "note": "plate"})
    sentence = (
        r"measured\.mat holds H \(6 x 2, complex\), note \(1, text\), and nothing says which "
        r"array holds the FRFs, with which axes and unit, nor at which frequencies, nor of which "
        r"sensors, nor of which actuators; a mapping must say so, since nothing is guessed\. Save "
        r"these lines as .*measured\.toml and give that file"
    )
    with pytest.raises(ValueError, match=sentence) as error:
        bp.io.read(tmp_path / "measured.mat")
    lines = lines_asked_for(error)
    assert tomllib.loads(lines).keys() == {"file", "frf", "frequency", "sensors", "actuators"}
    assert len(lines.splitlines()) == 5
    (tmp_path / "measured.toml").write_text(
        lines.replace("s2+x", "s2-y").replace("(m/s^2)/N", "g/N")
    )
    check_read(bp.io.read(tmp_path / "measured.toml"))


@pytest.mark.parametrize("options", [{}, {"do_compression": True}])
def test_structures_of_testlab_are_asked_for_by_their_names(tmp_path, options):
    """The layout in which Simcenter Testlab exports: start, increment, values [line, channel]."""
    axis = {"start_value": 10.0, "increment": 0.5, "number_of_values": 6.0}
    values = {"values": ARRAYS["H"][:, :, 0], "quantity": {"label": "g/N"}}
    content = {"FRF": {"x_values": axis, "y_values": values, "function_record": {"type": "FRF"}}}
    scipy.io.savemat(tmp_path / "run.mat", content, **options)
    with pytest.raises(ValueError, match="nothing says which array holds the FRFs") as error:
        bp.io.read(tmp_path / "run.mat")
    lines = tomllib.loads(lines_asked_for(error))
    assert lines["frf"]["array"] == "FRF.y_values.values"
    assert lines["frequency"]["first"] == "FRF.x_values.start_value"
    corrected = lines_asked_for(error).replace("s2+x", "s2-y").replace("(m/s^2)/N", "g/N")
    (tmp_path / "run.toml").write_text(corrected)
    check_read(bp.io.read(tmp_path / "run.toml"))


def test_blocks_of_one_axis_are_read_by_the_lines_that_are_asked_for(tmp_path):
    """An array of structures, one for each channel, as ME'scope and many scripts write."""
    blocks = np.zeros(2, [("Name", object), ("X", object), ("Y", object)])
    for number, block in enumerate(blocks):
        block["Name"], block["X"] = f"Block {number}", ARRAYS["f"]
        block["Y"] = ARRAYS["H"][:, number, 0]
    scipy.io.savemat(tmp_path / "run.mat", {"blocks": blocks})
    with pytest.raises(ValueError, match="nothing says which array holds the FRFs") as error:
        bp.io.read(tmp_path / "run.mat")
    corrected = lines_asked_for(error).replace("s2+x", "s2-y").replace("(m/s^2)/N", "g/N")
    (tmp_path / "run.toml").write_text(corrected)
    check_read(bp.io.read(tmp_path / "run.toml"))
    blocks[1]["X"] = 2 * ARRAYS["f"]
    scipy.io.savemat(tmp_path / "run.mat", {"blocks": blocks})
    with pytest.raises(ValueError, match="12 lines and the FRFs have 6"):
        bp.io.read(tmp_path / "run.toml")


@pytest.mark.parametrize(
    ("left_out", "asked"),
    [
        ("frequency", r'^frequency = \{ array = "f", unit = "Hz" \}$'),
        ("sensors", r'^sensors = \["s1\+x", "s2-y"\]  # in the order'),
        ("actuators", r'^actuators = \["a1\+x"\]  # in the order'),
        ("frf", r'^frf = \{ array = "H", axes = .*, unit = ".*" \}  # in the order of 6 x 2 x 1'),
    ],
)
def test_only_the_missing_lines_are_asked_for(tmp_path, left_out, asked):
    np.savez(tmp_path / "a.npz", **ARRAYS)
    write_table(tmp_path / "channels.csv")
    text = "".join(line for line in MAPPING.splitlines(True) if not line.startswith(left_out))
    path = mapped(tmp_path, "a.npz", 'channels = "channels.csv"\n' + text)
    with pytest.raises(ValueError, match=r"Add these lines at the top of .*mapping\.toml") as error:
        bp.io.read(path)
    assert re.fullmatch(asked.strip("^$") + ".*", lines_asked_for(error))


def test_columns_are_asked_for_by_their_names(tmp_path):
    (tmp_path / "a.csv").write_text("Freq,re,im\n1,2,3\n2,3,4\n")
    with pytest.raises(ValueError, match="nothing says which array holds the FRFs") as error:
        bp.io.read(tmp_path / "a.csv")
    lines = tomllib.loads(lines_asked_for(error))
    assert lines["frf"][0] | {"real": "re", "imaginary": "im"} == lines["frf"][0]
    assert lines["frequency"] == {"array": "Freq", "unit": "Hz"}
    (tmp_path / "a.toml").write_text(lines_asked_for(error))
    measurement = bp.io.read_measurement(tmp_path / "a.toml")
    np.testing.assert_array_equal(measurement.frf[0, 0], [2 + 3j, 3 + 4j])


VALUE = 0.5 * np.exp(0.25j)
FORMS = {
    "re": VALUE.real,
    "im": VALUE.imag,
    "mag": abs(VALUE),
    "dB": 20 * np.log10(abs(VALUE)),
    "deg": np.degrees(0.25),
    "rad": 0.25,
    "coherence": 0.75,
}


def write_headings(path, headings, forms):
    """Two lines of the FRF `VALUE` in the forms of its columns."""
    cells = [f"{FORMS[form]!r}".removeprefix("np.float64(").rstrip(")") for form in forms.split()]
    rows = [";".join(["1.0", *cells]), ";".join(["2.0", *cells])]
    path.write_text("\n".join([headings, *rows]))


HEADINGS = [
    ("f;H dB;H deg", "dB deg"),
    ("f;H_deg;H_dB", "deg dB"),
    ("f;Magnitude (dB);Phase (deg)", "dB deg"),
    ("f;Magnitude (dB);Phase (degrees)", "dB deg"),
    ("f;H [dB];H [°]", "dB deg"),
    ("f;H decibel;H rad", "dB rad"),
    ("f;phase [rad];amplitude", "rad mag"),
    ("f;mag;phase degrees;coh", "mag deg coherence"),
    ("f;H [dB re 1 (m/s^2)/N];phase [deg]", "dB deg"),
    ("f;Re(H);Im(H)", "re im"),
    ("f [Hz];H_im;H_re;coherence", "im re coherence"),
    ("f;s1 re;s1 im;s1 mag;s1 deg", "re im mag deg"),
    ("f;s1 re;s2 re;s1 im;s2 im", "re mag im deg"),
    ("frequency [Hz];s1+x/a1+x Magnitude [dB];s1+x/a1+x Phase [deg]", "dB deg"),
    ("frequency [Hz];s1+x/a1+x decibel;s1+x/a1+x degrees", "dB deg"),
    ("frequency [Hz];s1+x/a1+x [dB];s1+x/a1+x [deg]", "dB deg"),
]


@pytest.mark.parametrize(("headings", "forms"), HEADINGS)
def test_the_lines_that_are_asked_for_read_each_form_of_heading_right(tmp_path, headings, forms):
    write_headings(tmp_path / "a.csv", headings, forms)
    with pytest.raises(ValueError, match="nothing says") as error:
        bp.io.read(tmp_path / "a.csv")
    (tmp_path / "a.toml").write_text(lines_asked_for(error))
    measurement = bp.io.read_measurement(tmp_path / "a.toml")
    np.testing.assert_allclose(measurement.frf[0, 0], [VALUE, VALUE])
    np.testing.assert_array_equal(measurement.frequency, [1.0, 2.0])
    assert (measurement.coherence is not None) == ("coherence" in forms)


LINES_OF_ANALYSER = np.linspace(0.0, 5.0, 6)[:, None]
SPECTRA = FRF[:2, 0].T  # (line, pair)


@pytest.mark.parametrize(
    ("arrays", "chosen"),
    [
        ({"Hf_chan_2": 0, "Hf_Cross_Spec_chan_2": 1}, ["Hf_chan_2"]),
        ({"Gxy": 1, "H1_2": 0}, ["H1_2"]),
        ({"FRF_1": 0, "FRF_2": 1}, ["FRF_1", "FRF_2"]),
        ({"data": 0}, ["data"]),
        ({"cross_spectrum": 1}, []),
        ({"first": 0, "second": 1}, []),
    ],
)
def test_names_decide_which_complex_array_is_the_frf(tmp_path, arrays, chosen):
    content = {name: SPECTRA[:, column : column + 1] for name, column in arrays.items()}
    content |= {"Freq_domain": LINES_OF_ANALYSER, "coh": np.full((6, 1), 0.9), "PSD": np.ones(6)}
    scipy.io.savemat(tmp_path / "a.mat", content)
    with pytest.raises(ValueError, match="nothing says which array") as error:
        bp.io.read(tmp_path / "a.mat")
    lines = lines_asked_for(error)
    stated = tomllib.loads(lines)
    assert [pair["array"] for pair in stated.get("frf", [])] == chosen
    (tmp_path / "a.toml").write_text(lines)
    if not chosen:
        with pytest.raises(ValueError, match="nothing says which array"):
            bp.io.read(tmp_path / "a.toml")
        row = next(row for row in lines.splitlines() if row.startswith("# frf"))
        (tmp_path / "a.toml").write_text(lines.replace(row, row[2:]))
    measurement = bp.io.read_measurement(tmp_path / "a.toml")
    pairs = [arrays[name] for name in chosen or [*arrays][:1]]
    np.testing.assert_array_equal(measurement.frf[:, 0], SPECTRA[:, pairs].T)
    np.testing.assert_array_equal(measurement.frequency, LINES_OF_ANALYSER[:, 0])


def test_arrays_that_are_no_frfs_are_sent_to_their_readers(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"K0": np.eye(3), "M0": np.eye(3)})
    with pytest.raises(ValueError, match=r"matrices by bp\.io\.read_matrices, time records by bp"):
        bp.io.read(tmp_path / "a.mat")
    (tmp_path / "a.wav").write_bytes(b"RF64" + b"\0" * 40)
    with pytest.raises(ValueError, match=r"a\.wav is WAV by its first bytes, .* by bp\.time"):
        bp.io.read(tmp_path / "a.wav")


def test_a_few_lines_that_are_no_measurement_are_left_out(tmp_path):
    coherence = np.full((6, 2, 1), 0.9)
    coherence[1, 0], coherence[4, 1] = 1.2, -0.1
    frf = np.array(ARRAYS["H"])
    frf[5] = np.inf
    np.savez(tmp_path / "a.npz", **ARRAYS | {"C": coherence, "H": frf})
    path = mapped(tmp_path, "a.npz")
    with pytest.raises(ValueError, match=r"a\.npz"):  # half of the lines are not a few
        bp.io.read(path)
    frf[5] = ARRAYS["H"][5]
    np.savez(tmp_path / "a.npz", **ARRAYS | {"C": coherence, "H": frf})
    with pytest.warns(UserWarning, match=r"a\.npz: 2 of 6 lines were left out"):
        imported = bp.io.read(path)
    np.testing.assert_array_equal(imported.measurement.frequency, LINES[[0, 2, 3, 5]])
    assert "Left out: 2 lines, since their coherence or their FRFs" in str(imported)


def test_a_frequency_in_kilohertz_is_asked_for_in_its_unit(tmp_path):
    write_headings(tmp_path / "a.csv", "freq. KHZ;H dB;H deg", "dB deg")
    with pytest.raises(ValueError, match="nothing says") as error:
        bp.io.read(tmp_path / "a.csv")
    assert 'frequency = { array = "freq. KHZ", unit = "kHz" }' in lines_asked_for(error)


@pytest.mark.parametrize(
    ("headings", "forms", "line"),
    [
        ("f;A;B", "re im", 'real = "A", imaginary = "B"'),
        ("f;mag;phase", "mag deg", 'magnitude = "mag", degrees = "phase"'),
        ("f;H dB;B", "dB rad", 'decibel = "H dB", radians = "B"'),
    ],
)
def test_lines_that_headings_leave_open_read_nothing_before_one_is_chosen(
    tmp_path, headings, forms, line
):
    write_headings(tmp_path / "a.csv", headings, forms)
    with pytest.raises(ValueError, match="nothing says") as error:
        bp.io.read(tmp_path / "a.csv")
    (tmp_path / "a.toml").write_text(lines_asked_for(error))
    with pytest.raises(ValueError, match="nothing says which array holds the FRFs"):
        bp.io.read(tmp_path / "a.toml")
    [chosen] = [row for row in lines_asked_for(error).splitlines() if line in row]
    (tmp_path / "a.toml").write_text(lines_asked_for(error).replace(chosen, chosen[2:]))
    measurement = bp.io.read_measurement(tmp_path / "a.toml")
    np.testing.assert_allclose(measurement.frf[0, 0], [VALUE, VALUE])


@pytest.mark.parametrize(
    ("headings", "said", "sentence"),
    [
        (
            "f;H dB;H deg",
            {"real": "H dB", "imaginary": "H deg"},
            r"'H dB' for real and its name says decibel; .* Write decibel = \"H dB\", degrees = "
            r"\"H deg\" in the mapping",
        ),
        ("f;A;H deg", {"real": "A", "imaginary": 3}, "3 for imaginary and its name says degrees"),
        (
            "f;Magnitude (dB);Phase (deg)",
            {"real": 2, "imaginary": 3},
            r"2 for real and the file says that it is in 'dB'; .* Write decibel = 2, degrees = 3",
        ),
    ],
)
def test_decibels_and_degrees_are_no_real_and_imaginary_parts(tmp_path, headings, said, sentence):
    write_headings(tmp_path / "a.csv", headings, "dB deg")
    pair = {"sensor": "s1", "actuator": "a1", "unit": "g/N", **said}
    frequency = {"array": "f", "unit": "Hz"}
    with pytest.raises(ValueError, match=sentence):
        bp.io.read(tmp_path / "a.csv", {"frf": [pair], "frequency": frequency})


@pytest.mark.parametrize(
    "headings", ["Magnitude [dB];{}Phase [deg]", "[dB];{}[deg]", "mag;{}phase"]
)
def test_a_mapping_has_the_last_word_over_headings(tmp_path, headings):
    columns = headings.format("s1+x/a1+x ")
    write_headings(tmp_path / "a.csv", f"frequency [Hz];s1+x/a1+x {columns}", "dB deg")
    pair = {"sensor": "s9", "actuator": "a9", "decibel": 2, "degrees": 3, "unit": "m/N"}
    measurement = bp.io.read_measurement(tmp_path / "a.csv", mapping={"frf": [pair]})
    np.testing.assert_allclose(measurement.frf[0, 0], [VALUE, VALUE])
    assert measurement.sensors[0].label == "s9"


@pytest.mark.parametrize(
    ("headings", "forms", "sentence"),
    [
        ("s1/a1 mag;s1/a1 phase", "mag deg", r"has 's1/a1 mag' and 's1/a1 phase' of s1/a1 alone.*"
         r"\"s1/a1 phase \[deg\]\" or \[rad\]; .* degrees = \"s1/a1 phase\" }], or radians"),
        ("s1/a1 mag", "mag", "has 's1/a1 mag' of s1/a1 alone; .* Export the other part too"),
        ("s1/a1 re;s1/a1 real;s1/a1 im", "re re im", "both are the real of s1/a1, and either"),
    ],
)  # fmt: skip
def test_headings_that_are_no_complex_numbers_are_refused(tmp_path, headings, forms, sentence):
    write_headings(tmp_path / "a.csv", f"frequency [Hz];{headings}", forms)
    with pytest.raises(ValueError, match=sentence):
        bp.io.read(tmp_path / "a.csv")


@pytest.mark.parametrize("node", [5, ""])  # an empty cell makes a column of numbers and texts
def test_a_channel_table_is_not_taken_for_data(tmp_path, node):
    rows = [list(row) for row in TABLE]
    rows[1][2] = node
    write_table(tmp_path / "table.csv", rows)
    with pytest.raises(
        ValueError, match=r"is a channel table: .*: channels = \"table\.csv\""
    ) as error:
        bp.io.read(tmp_path / "table.csv")
    assert "frf =" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", r"is empty \(0 bytes\)"),
        (b"%PDF-1.4\n1 0 obj\n2 0 obj\n", "is a PDF, whose pages hold no arrays"),
        (b"f;A;B\n1;2;3\n", "a column or an array of at least two numbers is needed"),
    ],
)
def test_no_mapping_is_asked_for_where_there_are_no_numbers(tmp_path, content, reason):
    (tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(ValueError, match=reason) as error:
        bp.io.read(tmp_path / "a.csv")
    assert "frf =" not in str(error.value)


WRONG = {
    'unit = "g/N"': {
        'unit = "lb/N"': "the unit of the FRFs is 'lb/N'",
        'unit = "V/V"': "there is no sensor in a channel table",
    },
    'array = "H"': {
        'array = "G"': "has no array 'G' that is read; it has H, f, C. The nearest",
        'real = "H", imaginary = "H"': "H holds complex numbers; real numbers are needed",
        'real = "f", imaginary = "C"': r"f and C have the sizes \(6,\) and \(6, 2, 1\)",
        'real = "f"': 'frf names real; one of these .* write real = "f", imaginary = "Im"',
    },
    AXES: {
        'axes = ["sensor", "frequency", "actuator"]': "H has 6 x 2 x 1 numbers, but the mapping",
        'axes = ["frequency"]': "H has 6 x 2 x 1 numbers, but the mapping makes them 6",
        'axes = ["time"]': r"frf\.axes is \['time'\]",
        'axis = ["frequency"]': r"the field frf\.axis is not known; the nearest known one is",
    },
    '{ array = "f", unit = "Hz" }': {
        '{ array = "f", unit = "octaves" }': "the unit of the frequency is 'octaves'",
        '{ array = "C", unit = "Hz" }': "the frequency has 12 lines and the FRFs have 6",
        '{ first = 3.0, step = -0.5, unit = "Hz" }': "it must increase from line to line",
        "{ first = 3.0 }": "either an array, or first and step, is needed",
    },
    '["s1+x", "s2-y"]': {
        '["s1+x"]': "the frequency has 6 lines and the FRFs have 12 for each pair",
        '["s1+x", "s1+x"]': "was given twice",
        '"H"': "H holds complex numbers; texts are needed",
        "3": "sensors is 3; a list of labels",
    },
    "averages = 8": {
        "averages = 0": "averages is 0; a whole number of at least 1",
        "averges = 8": 'the field averges is not known; the nearest known one is "averages"',
        'convention = "exp(iwt)"': r"convention is 'exp\(iwt\)'; one of exp",
    },
    'file = "FILE"': {
        'file = "../FILE"': "a name of a file in the folder|the name of a file in the folder",
        'file = "other.mat"': r"There is no file .*other\.mat",
        "": "names no file; the name of the data is needed",
    },
    'coherence = "C"': {
        'coherence = "H"': "H holds complex numbers; real numbers are needed there",
        'coherence = { array = "C", axes = ["sensor"] }': "C has 6 x 2 x 1 numbers, but",
    },
}
CASES = [(old, new, reason) for old, changes in WRONG.items() for new, reason in changes.items()]


@pytest.mark.parametrize(("old", "new", "reason"), CASES)
def test_wrong_mappings_are_refused_in_a_sentence(tmp_path, old, new, reason):
    np.savez(tmp_path / "a.npz", **ARRAYS)
    path = mapped(tmp_path, "a.npz", MAPPING.replace(old, new, 1))
    with pytest.raises((ValueError, FileNotFoundError), match=reason) as error:
        bp.io.read(path)
    sentence = str(error.value).partition("\n\n")[0]
    assert str(tmp_path) in sentence and "\n" not in sentence


def test_a_mapping_that_is_no_toml_is_refused(tmp_path):
    (tmp_path / "a.toml").write_text("frf = {")
    with pytest.raises(ValueError, match=r"a\.toml cannot be read as TOML"):
        bp.io.read(tmp_path / "a.toml")
    with pytest.raises(ValueError, match="mapping=3 was given; the path of a TOML file"):
        bp.io.read(tmp_path / "a.npz", 3)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"C": ARRAYS["C"] * 3}, "it must lie between 0 and 1"),
        ({"f": LINES[::-1]}, "it must increase from line to line"),
        ({"f": np.full(6, np.nan)}, "must be finite"),
        ({"H": ARRAYS["H"] * np.nan}, "holds nothing but NaN"),
        ({"H": np.abs(ARRAYS["H"])}, "H holds real numbers; the complex FRFs are needed there"),
        ({"H": ARRAYS["H"] * 1e40}, "finite numbers up to 1e\\+30"),
        ({"H": np.where(ARRAYS["f"][:, None, None] > 11, np.inf, ARRAYS["H"])}, "finite value"),
    ],
)
def test_numbers_that_cannot_be_are_refused(tmp_path, changed, reason):
    np.savez(tmp_path / "a.npz", **{**ARRAYS, **changed})
    with pytest.raises(ValueError, match=rf"a\.npz.*{reason}"):
        bp.io.read(mapped(tmp_path, "a.npz"))


def test_a_folder_of_which_nobody_says_what_is_what_is_refused(tmp_path):
    for name in ("a.npz", "b.npz"):
        np.savez(tmp_path / name, **ARRAYS)
    with pytest.raises(ValueError, match=r"holds a\.npz, b\.npz, and nothing says which is which"):
        bp.io.read(tmp_path)


def test_units_that_contradict_each_other_are_refused(tmp_path):
    (tmp_path / "a.csv").write_text("f [kHz],re [m/N],im [m/N]\n1,2,3\n2,3,4\n")
    pair = '[[frf]]\nsensor = "s1"\nactuator = "a1"\nreal = "re"\nimaginary = "im"\n'
    path = mapped(tmp_path, "a.csv", f'file = "FILE"\nunit = "g/N"\nfrequency = "f"\n{pair}')
    with pytest.raises(ValueError, match="says that the FRFs are in 'g/N' and the file says 'm/N'"):
        bp.io.read(path)
    path = mapped(tmp_path, "a.csv", f'file = "FILE"\nfrequency = "f"\n{pair}')
    measurement = bp.io.read(path).measurement
    assert (measurement.quantity, measurement.frequency.tolist()) == ("receptance", [1e3, 2e3])


@pytest.mark.parametrize(
    ("words", "heading", "sentence"),
    [
        (("magnitude", "degrees"), "f,A [g/N],B [rad]", r"'B' for degrees and .* in 'rad'"),
        (("magnitude", "radians"), "f,A [g/N],B [deg]", r"'B' for radians and .* in 'deg'"),
        (("magnitude", "degrees"), "f,A [dB],B [deg]", r"'A' for magnitude and .* in 'dB'"),
        (("real", "imaginary"), "f,A [dB],B [g/N]", r"'A' for real and .* in 'dB'"),
    ],
)
def test_parts_in_another_unit_than_their_name_says_are_refused(tmp_path, words, heading, sentence):
    (tmp_path / "a.csv").write_text(f"{heading}\n1,2,3\n2,3,4\n")
    parts = dict(zip(words, ("A", "B"), strict=True))
    pair = {"sensor": "s1", "actuator": "a1", "unit": "g/N", **parts}
    frequency = {"array": "f", "unit": "Hz"}
    with pytest.raises(ValueError, match=sentence):
        bp.io.read(tmp_path / "a.csv", {"frf": [pair], "frequency": frequency})


def test_a_column_whose_name_cannot_be_printed_keeps_its_number(tmp_path):
    (tmp_path / "a.csv").write_text("f,\x7f,A,B\n1,9,2,3\n2,9,3,4\n")
    pair = {"sensor": "s1", "actuator": "a1", "unit": "g/N", "real": 3, "imaginary": 4}
    frequency = {"array": "f", "unit": "Hz"}
    imported = bp.io.read(tmp_path / "a.csv", {"frf": [pair], "frequency": frequency})
    np.testing.assert_allclose(imported.measurement.frf[0, 0], GRAVITY * np.array([2 + 3j, 3 + 4j]))
    assert "Left out: column 2, since the mapping does not name it." in str(imported)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"coherence": "f"}, r"coherence is stated for all FRFs, each of which stands in an array"),
        ({"sensors": ["s2"]}, r"sensors is stated for all FRFs, each of which"),
        ({"frf": {"sensor": "s1", "real": "A", "imaginary": "B"}}, r"frf\.actuator is missing"),
    ],
)
def test_what_single_pairs_name_themselves_is_refused_beside_them(tmp_path, fields, sentence):
    (tmp_path / "a.csv").write_text("f,A,B\n1,2,3\n2,3,4\n")
    pair = {"sensor": "s1", "actuator": "a1", "real": "A", "imaginary": "B"}
    mapping = {"frf": [pair], "unit": "g/N", "frequency": {"array": "f", "unit": "Hz"}, **fields}
    with pytest.raises(ValueError, match=sentence):
        bp.io.read(tmp_path / "a.csv", mapping)


def test_decibels_may_state_their_reference(tmp_path):
    (tmp_path / "a.csv").write_text(
        "frequency [Hz],s1/a1 dB [dB re 1 (m/s^2)/N],s1/a1 degrees [deg]\n1,20,90\n2,0,-90\n"
    )
    measurement = bp.io.read_measurement(tmp_path / "a.csv")
    np.testing.assert_allclose(measurement.frf[0, 0], [10j, -1j], atol=1e-14)
    assert measurement.quantity == "accelerance"


def test_the_report_says_what_was_read_and_what_was_not(tmp_path):
    np.savez(tmp_path / "a.npz", **ARRAYS, picture=np.zeros((2, 2)))
    words = bp.io.read(mapped(tmp_path, "a.npz")).report.words()
    text = "\n".join(words)
    assert re.search(r"a\.npz is a NumPy archive of \d+ bytes, sha256 [0-9a-f]{16}\.", text)
    assert "FRFs: H, 6 x 2 x 1 numbers as frequency, sensor, actuator." in words
    assert "Unit: accelerance, times 9.80665 to (m/s²)/N." in words
    assert "Left out: picture, since the mapping does not name it." in words
    assert "Coherence: read, of 8 averages." in words
    assert words[-1].startswith("Measurement: accelerance")


WRONG_TABLES = [
    (1, 1, "other", "row 2: its name is 's1' and its role 'other'"),
    (1, 2, 0.5, "row 2: its node is '0.5'; a whole number"),
    (1, 3, "far", "row 2: its x is 'far'; a number is needed"),
    (1, 3, "", "row 2: it has some of x, y, z and not all"),
    (1, 6, "up", "row 2: its direction is 'up'"),
    (1, 7, -1, "row 2: its tolerance is .* none may be negative"),
    (1, 9, "mV", "row 2: its sensitivity is 100 in the unit 'mV'"),
    (2, 0, "s1", "two rows of s1 have the node 5 and 6"),
    (0, 3, "x", "the column 'x' has no unit of m, cm, mm"),
    (0, 7, "glue", "the column 'glue' is not known; known are name, role"),
    (0, 2, "name", "two columns are named 'name'"),
]


@pytest.mark.parametrize(("row", "column", "cell", "reason"), WRONG_TABLES)
@pytest.mark.parametrize("name", ["channels.xlsx", "channels.csv"])
def test_wrong_channel_tables_are_refused(tmp_path, name, row, column, cell, reason):
    np.savez(tmp_path / "a.npz", **ARRAYS)
    rows = [list(line) for line in TABLE]
    rows[row][column] = cell
    write_table(tmp_path / name, rows)
    path = mapped(tmp_path, "a.npz", MAPPING + f'channels = "{name}"\n')
    with pytest.raises(ValueError, match=rf"{name}.*{reason}"):
        bp.io.read(path)


@pytest.mark.parametrize(
    ("part", "second"), [("real", "an imaginary part"), ("mag", "a phase in degrees or radians")]
)
def test_columns_of_one_part_alone_are_refused_by_what_is_lacking(tmp_path, part, second):
    """A unit in the heading of the frequency is that of a file that says some of itself."""
    path = tmp_path / "parts.csv"
    path.write_text(f"Frequency (Hz),FRF s1 {part},FRF s2 {part}\n5,1,2\n6,3,4\n")
    with pytest.raises(ValueError, match=f'"FRF s1 {part}", by its .* can be {second}') as error:
        bp.io.read_measurement(path)
    assert "NAME OF" not in str(error.value) and "Export both parts" in str(error.value)


def test_a_column_that_is_not_there_is_asked_for_and_not_looked_up(tmp_path):
    path = tmp_path / "parts.csv"
    path.write_text("Frequency (Hz),FRF s1 imag\n5,1\n6,3\n")
    with pytest.raises(ValueError, match="nothing says which array holds the FRFs"):
        bp.io.read_measurement(path)
