"""Universal files: what is read, what is written and read back, and what is refused."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
import pyuff

from bayes_placement.experiment.measurement import Channel, Measurement
from bayes_placement.io import uff
from tests.io.uff.hand_typed import typed

# Most files here have no dataset 164; that this is told has tests of its own.
pytestmark = pytest.mark.filterwarnings("ignore:.* states no units")

SHARED = (Path(__file__).parents[3] / "../shared/data").resolve()
FREQUENCY = np.arange(5.0, 9.0)
FRF = np.array([1.0 - 2.0j, -0.5 + 0.25j, 3e-7 + 1e3j, -4.0 - 1.0 / 3.0 * 1j])

# Typed by hand after the text of the format: FORTRAN columns, not the code of any library.
HAND_TYPED = """\
    -1
    15
         1         0         0        11  2.50000e-01  0.00000e+00 -1.00000e-01
       101         0         0        11  3.00000e-01  0.00000e+00  0.00000e+00
    -1
    -1
    58
Driving point
NONE
NONE
NONE
NONE
    4         1    0         0       NONE         1  -3       NONE       101   1
         5         4         1  1.00000e+01  2.50000e+00  0.00000e+00
        18    0    0    0       Frequency                   Hz
         8    0    0    0    Displacement                   mm
        13    0    0    0           Force                    N
         0    0    0    0            NONE                 NONE
  1.00000e+00 -2.00000e+00  3.00000e+00  4.00000e+00 -5.00000e+00  6.00000e+00
  7.00000e+00  8.00000e+00
    -1
"""


def shared(*parts):
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{'/'.join(parts)} of the shared data is not on this machine")
    return path


def hand_typed(folder, *changes):
    return typed(folder, HAND_TYPED, *changes)


def function(**changes):
    """Fields of an FRF as pyuff writes them."""
    fields = {
        "type": 58,
        "func_type": 4,
        "rsp_node": 1,
        "rsp_dir": 3,
        "ref_node": 101,
        "ref_dir": -3,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 13,
        "x": FREQUENCY,
        "data": FRF,
    }
    return fields | changes


def coherence(**changes):
    real = {"func_type": 6, "ordinate_spec_data_type": 0, "orddenom_spec_data_type": 0}
    return function(**(real | {"data": np.array([0.9, 0.8, 0.7, 0.6])} | changes))


def nodes(*numbers, system=0):
    zeros = [0] * len(numbers)
    x = [0.1 * number for number in numbers]
    systems = [system] * len(numbers)
    return {
        "type": 2411,
        "node_nums": list(numbers),
        "def_cs": systems,
        "disp_cs": zeros,
        "color": zeros,
        "x": x,
        "y": zeros,
        "z": zeros,
    }


def units(length=1.0, force=1.0):
    scales = {"length": length, "force": force, "temp": 1.0, "temp_offset": 0.0}
    return {"type": 164, "units_code": 9, "units_description": "any", "temp_mode": 1, **scales}


def by_pyuff(folder, *sets):
    path = folder / "pyuff.uff"
    pyuff.UFF(str(path)).write_sets(list(sets), mode="overwrite")
    return path


def measurement(**changes):
    generator = np.random.default_rng(7)
    frf = generator.standard_normal((2, 2, 4)) + 1j * generator.standard_normal((2, 2, 4))
    frf[1, 0] = np.nan
    arguments = {
        "frf": frf * 10.0 ** generator.integers(-9, 9, 4),
        "frequency": FREQUENCY,
        "sensors": ["wing tip-z", "fin"],
        "actuators": ["a1+x", "a2-y"],
        "quantity": "mobility",
        "coherence": np.where(np.isnan(frf), np.nan, generator.uniform(0.1, 1.0, frf.shape)),
        "averages": 16,
        "positions": {"fin": (0.1, -0.2, 1 / 3), "a1": (0.0, 1e-9, 5.0)},
        "force_level": 0.06,
    }
    return Measurement.from_arrays(**(arguments | changes))


def case_files():
    return sorted(SHARED.glob("cases/*/measured*.uff")) or [SHARED / "cases/any/measured.uff"]


@pytest.mark.parametrize("path", case_files(), ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_cases_are_read_as_their_arrays_say(path):
    path = shared(*path.relative_to(SHARED).parts)
    arrays = np.load(path.with_suffix(".npz"))
    case = json.loads((path.parent / "case.json").read_text())
    instruments = case["sensors"] + case["actuators"]
    names = {item["uff_node"]: item["id"] for item in instruments}
    loaded = uff.read(path, names=names, averages=int(arrays["n_averages"]))
    sensors = [
        Channel(str(n), int(d)) for n, d in zip(arrays["out_ids"], arrays["out_dirs"], strict=True)
    ]
    actuators = [
        Channel(str(n), int(d)) for n, d in zip(arrays["in_ids"], arrays["in_dirs"], strict=True)
    ]
    assert (loaded.sensors, loaded.actuators) == (tuple(sensors), tuple(actuators))
    assert np.allclose(loaded.frf, arrays["frf"], rtol=1e-9, atol=0)
    assert np.allclose(loaded.coherence, arrays["coherence"], rtol=1e-9, atol=0)
    assert np.allclose(loaded.frequency, arrays["frequency_hz"], rtol=1e-12, atol=0)
    assert loaded.positions == {item["id"]: tuple(item["position_m"]) for item in instruments}
    assert loaded.quantity == "accelerance"


def test_the_measured_beam_is_read_without_coordinates():
    path = shared("measured", "free_free_beam", "measured.uff")
    loaded = uff.read(path, require_positions=False)
    assert [channel.label for channel in loaded.sensors] == ["1+x"]
    assert [channel.label for channel in loaded.actuators] == ["1+x", "2+x", "3+x"]
    assert (loaded.frequency[0], loaded.frequency[-1], loaded.frequency.size) == (0, 1000, 1001)
    assert (loaded.quantity, loaded.coherence, loaded.averages, loaded.positions) == (
        ("accelerance", None, None, {})
    )
    driving = abs(loaded.frf[0, 1])
    assert {142, 279, 687} <= set(loaded.frequency[np.argsort(driving)[-20:]])


def test_the_measured_beam_needs_coordinates():
    path = shared("measured", "free_free_beam", "measured.uff")
    with pytest.raises(
        uff.MeasurementFileError, match=r"nodes 1, 2, 3 without coordinates.*none of"
    ):
        uff.read(path)


def test_a_hand_typed_file_is_read_by_its_columns(tmp_path):
    loaded = uff.read(hand_typed(tmp_path))
    assert loaded.frf[0, 0].tolist() == [
        0.001 - 0.002j,
        0.003 + 0.004j,
        -0.005 + 0.006j,
        0.007 + 0.008j,
    ]
    assert loaded.frequency.tolist() == [10, 12.5, 15, 17.5]
    assert (loaded.sensors, loaded.actuators) == ((Channel("1", -3),), (Channel("101", 1),))
    assert loaded.positions == {"1": (0.25, 0.0, -0.1), "101": (0.3, 0.0, 0.0)}
    assert loaded.quantity == "receptance"


def test_dos_line_ends_change_nothing(tmp_path):
    path = hand_typed(tmp_path)
    plain = uff.read(path)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert np.array_equal(uff.read(path).frf, plain.frf)


# pyuff leaves the file open that it has written a binary dataset to.
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("even", [0, 1])
def test_files_by_pyuff_are_read(tmp_path, binary, even):
    layout = {"binary": binary, "abscissa_spacing": even}
    path = by_pyuff(tmp_path, nodes(1, 101), function(**layout), coherence(**layout))
    loaded = uff.read(path, averages=4)
    assert np.allclose(loaded.frf[0, 0], FRF, rtol=1e-11, atol=0)
    assert np.allclose(loaded.coherence[0, 0], [0.9, 0.8, 0.7, 0.6], rtol=1e-11, atol=0)
    assert np.array_equal(loaded.frequency, FREQUENCY)
    assert loaded.averages == 4


def test_other_functions_and_coherences_without_frf_are_passed_over(tmp_path):
    time = function(func_type=1, abscissa_spec_data_type=17, rsp_dir=6, data=FRF.real)
    path = by_pyuff(tmp_path, nodes(1, 101), time, coherence(rsp_dir=1), function())
    assert uff.read(path).coherence is None


def test_coherence_goes_to_its_pair_and_is_unknown_elsewhere(tmp_path):
    functions = function(), function(ref_node=102), coherence(ref_node=102)
    loaded = uff.read(by_pyuff(tmp_path, nodes(1, 101, 102), *functions))
    assert np.isnan(loaded.coherence[0, 0]).all()
    assert loaded.coherence[0, 1].tolist() == [0.9, 0.8, 0.7, 0.6]


def test_a_pair_without_frf_is_not_measured(tmp_path):
    functions = function(), function(rsp_node=2, ref_node=102)
    loaded = uff.read(by_pyuff(tmp_path, nodes(1, 2, 101, 102), *functions))
    assert loaded.measured.tolist() == [[True, False], [False, True]]


@pytest.mark.parametrize(
    ("fields", "file_units", "factor"),
    [
        ({}, None, 1.0),
        ({}, units(), 1.0),
        ({}, units(length=1000.0), 1e-3),
        ({}, units(length=1000.0, force=1000.0), 1.0),
        ({"ordinate_axis_units_lab": "m/s^2", "orddenom_axis_units_lab": "N"}, units(), 1.0),
        ({"ordinate_axis_units_lab": "m/s2"}, None, 1.0),
        ({"ordinate_axis_units_lab": "m/sec**2"}, None, 1.0),
        ({"ordinate_axis_units_lab": "mm/s²"}, units(length=1000.0), 1e-3),
        ({"ordinate_axis_units_lab": "g"}, None, 9.80665),
        ({"ordinate_axis_units_lab": "(m/s2)/N"}, None, 1.0),
        ({"ordinate_axis_units_lab": "g/lbf"}, None, 9.80665 / 4.4482216152605),
        ({"ordinate_axis_units_lab": "g/mN", "orddenom_axis_units_lab": "mN"}, None, 9806.65),
        ({"orddenom_axis_units_lab": "kN"}, None, 1e-3),
        ({"ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "um"}, None, 1e-6),
        ({"ordinate_spec_data_type": 11, "ordinate_axis_units_lab": "in/s"}, None, 0.0254),
        ({"ordinate_len_unit_exp": 1, "orddenom_force_unit_exp": 1}, None, 1.0),
    ],
)
def test_units_are_converted_to_si(tmp_path, fields, file_units, factor):
    sets = [nodes(1, 101), function(**fields)]
    loaded = uff.read(by_pyuff(tmp_path, *([file_units] if file_units else []), *sets))
    assert np.allclose(loaded.frf[0, 0], factor * FRF, rtol=1e-9, atol=0)


def test_coordinates_are_converted_by_the_units_of_the_file(tmp_path):
    loaded = uff.read(by_pyuff(tmp_path, units(length=1000.0), nodes(1, 101), function()))
    assert loaded.positions["101"] == pytest.approx((0.0101, 0.0, 0.0))


def test_mixed_quantities_are_converted_where_asked(tmp_path):
    velocity = function(ref_node=102, ordinate_spec_data_type=11)
    path = by_pyuff(tmp_path, nodes(1, 101, 102), function(), velocity)
    with pytest.raises(
        uff.MeasurementFileError, match=r"mixes accelerance and mobility.*quantity="
    ):
        uff.read(path)
    loaded = uff.read(path, quantity="accelerance")
    assert np.allclose(loaded.frf[0, 0], FRF)
    assert np.allclose(loaded.frf[0, 1], 2j * np.pi * FREQUENCY * FRF)


def test_nodes_are_named_as_given(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 101), function())
    loaded = uff.read(path, names={1: "tip"})
    assert (loaded.sensors[0].name, loaded.actuators[0].name) == ("tip", "101")
    assert set(loaded.positions) == {"tip", "101"}


@pytest.mark.parametrize(
    ("entities", "names"),
    [
        (("tip", "tip", "hammer"), ["tip", "hammer"]),
        (("tip+x", "tip+z", "hammer"), ["tip", "hammer"]),  # channels of one sensor
        (("tip", "root", "hammer"), ["1", "hammer"]),  # a node of two names
        (("wing", "wing", "wing"), ["1", "101"]),  # a component
        (("NONE", "NONE", "a.1"), ["1", "101"]),
    ],
)
def test_entities_name_the_nodes_that_they_tell_apart(tmp_path, entities, names):
    *responses, reference = entities
    frfs = [
        function(rsp_dir=direction, rsp_ent_name=entity, ref_ent_name=reference)
        for direction, entity in zip((1, 3), responses, strict=True)
    ]
    loaded = uff.read(by_pyuff(tmp_path, nodes(1, 101), *frfs))
    assert [loaded.sensors[0].name, loaded.actuators[0].name] == names
    assert {channel.name for channel in loaded.sensors} == {names[0]}
    assert set(loaded.positions) == {*names}


# --- writing ---------------------------------------------------------------------------------


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_what_is_written_comes_back(tmp_path, binary, quantity):
    original = measurement(quantity=quantity)
    uff.write(tmp_path / "ours.uff", original, binary=binary)
    loaded = uff.read(tmp_path / "ours.uff", require_positions=False)
    digits = {"rtol": 0.0 if binary else 1e-12, "atol": 0.0, "equal_nan": True}
    assert np.allclose(loaded.frf.real, original.frf.real, **digits)
    assert np.allclose(loaded.frf.imag, original.frf.imag, **digits)
    assert np.allclose(loaded.coherence, original.coherence, **digits)
    for field in ("sensors", "actuators", "quantity", "averages", "positions", "force_level"):
        assert getattr(loaded, field) == getattr(original, field)


@pytest.mark.parametrize("binary", [False, True])
def test_pyuff_reads_what_is_written(tmp_path, binary):
    original = measurement()
    uff.write(tmp_path / "ours.uff", original, binary=binary)
    sets = pyuff.UFF(str(tmp_path / "ours.uff")).read_sets()
    assert [item["type"] for item in sets] == [164, 2411, 58, 58, 58, 58, 58, 58]
    last = [item for item in sets if item["type"] == 58 and item["func_type"] == 4][-1]
    assert (last["rsp_node"], last["rsp_dir"], last["ref_node"], last["ref_dir"]) == (2, 0, 102, -2)
    assert np.allclose(last["data"], original.frf[1, 1], rtol=1e-12, atol=0)
    assert last["id1"] == "FRF fin / a2-y"
    if binary:
        assert last["n_bytes"] == original.frequency.size * 16


@pytest.mark.parametrize(
    ("frequency", "binary"),
    [
        ([1.0, 2.5, 7.123456, 1000.0], False),
        (np.arange(1, 5) * 4.33, False),
        (np.arange(1, 5) * 1.234567, False),
        ([0.1, 0.2, 0.3, 0.4], True),  # 0.1 + 2 * 0.1 is not 0.3
        ([1 / 3, 2 / 3, np.pi, 1e4 / 3], True),
        (np.linspace(20.0, 1600.0, 4), True),
    ],
)
def test_lines_come_back(tmp_path, frequency, binary):
    uff.write(tmp_path / "ours.uff", measurement(frequency=frequency), binary=binary)
    loaded = uff.read(tmp_path / "ours.uff", require_positions=False)
    assert np.allclose(loaded.frequency, frequency, rtol=0.0 if binary else 1e-9, atol=0)
    assert np.allclose(loaded.frf, measurement().frf, rtol=1e-12, atol=0, equal_nan=True)
    assert np.allclose(loaded.coherence, measurement().coherence, rtol=1e-12, equal_nan=True)


def test_a_line_that_ascii_would_lose_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"3.141592653589793 Hz .* 7 digits.*binary=True"):
        uff.write(tmp_path / "ours.uff", measurement(frequency=[1.0, 2.0, np.pi, 4.0]))


def test_whole_numbers_are_node_numbers(tmp_path):
    original = measurement(
        sensors=["7+z", "12"], actuators=["7+z", "9"], positions={"7": (1, 2, 3)}
    )
    uff.write(tmp_path / "ours.uff", original)
    sets = pyuff.UFF(str(tmp_path / "ours.uff")).read_sets()
    assert [(item["rsp_node"], item["ref_node"]) for item in sets[2:5]] == [(7, 7), (7, 9), (12, 9)]
    assert sets[2]["id5"] == "NONE"
    loaded = uff.read(tmp_path / "ours.uff", require_positions=False)
    assert (loaded.sensors, loaded.actuators) == (original.sensors, original.actuators)


def test_a_name_that_sensor_and_actuator_share_is_one_node(tmp_path):
    original = measurement(sensors=["p+z", "q"], actuators=["p+z", "r"], positions={"p": (1, 2, 3)})
    uff.write(tmp_path / "ours.uff", original)
    loaded = uff.read(tmp_path / "ours.uff", require_positions=False)
    assert (loaded.sensors, loaded.actuators) == (original.sensors, original.actuators)
    assert loaded.positions == original.positions


def test_a_name_too_long_for_its_line_is_refused(tmp_path):
    with pytest.raises(ValueError, match="ID line of a universal file holds 80 characters"):
        uff.write(tmp_path / "ours.uff", measurement(sensors=["s" * 70, "s2"]))


def test_a_channel_that_appears_twice_is_not_written(tmp_path):
    twice = measurement().channels(["fin", "fin"], "a2-y")
    with pytest.raises(ValueError, match="sensor channel fin was given twice"):
        uff.write(tmp_path / "ours.uff", twice)


def test_the_old_file_outlives_a_failed_write(tmp_path, monkeypatch):
    path = tmp_path / "ours.uff"
    uff.write(path, measurement())
    before = path.read_bytes()

    def full(_):
        raise OSError("no space left")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space left"):
        uff.write(path, measurement(averages=99))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


# --- refusals --------------------------------------------------------------------------------


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"There is no file .*none.uff; a universal file"):
        uff.read(tmp_path / "none.uff")


@pytest.mark.parametrize("content", [b"", b"frequency,real,imag\n1.0,2.0,3.0\n", bytes(200)])
def test_what_is_no_universal_file_is_refused(tmp_path, content):
    path = tmp_path / "other.uff"
    path.write_bytes(content)
    with pytest.raises(uff.MeasurementFileError, match=f"its {len(content)} bytes hold no line"):
        uff.read(path)


def test_a_file_without_frf_is_refused_with_what_it_holds(tmp_path):
    with pytest.raises(uff.MeasurementFileError, match="holds nodes and units alone; at least"):
        uff.read(by_pyuff(tmp_path, nodes(1)))
    with pytest.raises(
        uff.MeasurementFileError, match=r"dataset 58 of function type 6 \(1\); at least one FRF"
    ):
        uff.read(by_pyuff(tmp_path, coherence()))


@pytest.mark.parametrize("binary", [False, True])
def test_every_truncation_is_refused(tmp_path, binary):
    path = tmp_path / "ours.uff"
    uff.write(path, measurement(), binary=binary)
    content_of_file = path.read_bytes()
    last_dataset = content_of_file.rindex(b"    -1\n    58")
    for end in range(last_dataset + 7, len(content_of_file) - 1, 13):
        path.write_bytes(content_of_file[:end])
        with pytest.raises(uff.MeasurementFileError, match="file ends inside this dataset"):
            uff.read(path)


def test_missing_values_are_counted(tmp_path):
    path = hand_typed(tmp_path, ("  7.00000e+00  8.00000e+00\n", ""))
    with pytest.raises(uff.MeasurementFileError, match="8 numbers are announced and 6 are there"):
        uff.read(path)


def test_a_field_outside_its_columns_is_refused(tmp_path):
    path = hand_typed(tmp_path, ("  1.00000e+00 -2", " 1.0000 0e+00 -2"))
    with pytest.raises(uff.MeasurementFileError, match=r"block 2 \(dataset 58\) cannot be decoded"):
        uff.read(path)


def test_a_dataset_without_number_is_refused(tmp_path):
    path = hand_typed(tmp_path, ("    58\n", "    5x\n"))
    with pytest.raises(
        uff.MeasurementFileError, match=r"block 2 opens with .*number of its dataset"
    ):
        uff.read(path)


def test_a_binary_layout_that_is_none_is_refused(tmp_path):
    path = hand_typed(
        tmp_path, ("    58\n", "    58b     1     2\n"), ("         5  ", "         9  ")
    )
    with pytest.raises(uff.MeasurementFileError, match=r"has the data form .*2, 4, 5 or 6"):
        uff.read(path)


def test_a_minus_one_that_ends_a_line_ends_no_dataset(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 101) | {"color": [-1, 0]}, function())
    assert set(uff.read(path).positions) == {"1", "101"}


def test_without_dataset_164_the_size_is_told_and_the_unit_can_be_stated(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 101), function())
    told = uff.read(path, length_unit=1.0).positions
    in_millimetres = uff.read(path, length_unit=1e-3).positions
    np.testing.assert_allclose(in_millimetres["101"], 1e-3 * np.array(told["101"]))
    size = np.linalg.norm(np.subtract(told["101"], told["1"]))
    with pytest.warns(UserWarning, match=rf"no units .* extend over {size:.4g} m\..*length_unit"):
        uff.read(path)
    stated = by_pyuff(tmp_path, units(length=1000.0), nodes(1, 101), function())
    with pytest.raises(ValueError, match=r"length_unit=0\.001 was given, and .* Leave length_unit"):
        uff.read(stated, length_unit=1e-3)


def test_nodes_that_are_not_asked_for_are_not_decoded(tmp_path):
    """A value that is none stands where nobody looks."""
    path = by_pyuff(tmp_path, nodes(1, 2, 101), function(), function(rsp_node=2, id1="second"))
    head, second = path.read_text().split("second")
    lines = second.split("\n")
    lines[11] = "  not a number" + lines[11][14:]
    path.write_text("second".join([head, "\n".join(lines)]))
    assert [sensor.name for sensor in uff.read(path, only=[1]).sensors] == ["1"]
    with pytest.raises(uff.MeasurementFileError, match=r"block 3 .* no number in its columns"):
        uff.read(path)


def test_a_node_without_coordinates_is_named(tmp_path):
    path = by_pyuff(tmp_path, nodes(1), function())
    with pytest.raises(
        uff.MeasurementFileError, match=r"nodes 101 without .* place 1\. .*geometry"
    ):
        uff.read(path)
    assert set(uff.read(path, require_positions=False).positions) == {"1"}


def test_local_coordinates_are_refused(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 101, system=11), function())
    with pytest.raises(uff.MeasurementFileError, match="node 1 in the local coordinate system 11"):
        uff.read(path)


def test_a_node_at_two_places_is_refused(tmp_path):
    moved = nodes(1, 101) | {"x": [0.5, 0.5]}
    with pytest.raises(uff.MeasurementFileError, match="node 1 other coordinates than before"):
        uff.read(by_pyuff(tmp_path, nodes(1, 101), moved, function()))


def test_mixed_axes_are_refused(tmp_path):
    other = function(ref_node=102, x=FREQUENCY + 1)
    with pytest.raises(
        uff.MeasurementFileError, match=r"4 lines from 6 to 9 Hz but .* from 5 to 8 Hz"
    ):
        uff.read(by_pyuff(tmp_path, nodes(1, 101, 102), function(), other))
    shifted = coherence(x=FREQUENCY + 1)
    with pytest.raises(uff.MeasurementFileError, match="one frequency axis is needed"):
        uff.read(by_pyuff(tmp_path, nodes(1, 101), function(), shifted))


@pytest.mark.parametrize(
    "twice", [[function(), function()], [function(), coherence(), coherence()]]
)
def test_two_functions_of_one_pair_are_refused(tmp_path, twice):
    with pytest.raises(
        uff.MeasurementFileError, match="hold the same function for response node 1"
    ):
        uff.read(by_pyuff(tmp_path, nodes(1, 101), *twice))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"data": FRF.real}, "FRF of real numbers; complex ones"),
        ({"rsp_dir": 5}, "direction 5 at node 1, a rotation"),
        ({"ordinate_spec_data_type": 2}, "data type 2 per data type 13; displacement"),
        ({"orddenom_spec_data_type": 0}, "data type 12 per data type 0; displacement"),
        ({"ordinate_force_unit_exp": 1}, r"unit exponents \(0, 1, 0\) .* in record 9"),
        ({"orddenom_len_unit_exp": 1}, r"unit exponents \(1, 0, 0\) .* in record 10"),
        ({"abscissa_spec_data_type": 17}, "abscissa of data type 17"),
        ({"abscissa_axis_units_lab": "rad/s"}, "with unit 'rad/s'; frequency"),
        ({"ordinate_axis_units_lab": "V"}, "unit label 'V', which is not known"),
        ({"ordinate_axis_units_lab": "m/s"}, "unit label 'm/s', which is not known"),
        ({"orddenom_axis_units_lab": "V"}, "unit label 'V', which is not known"),
        (
            {"ordinate_axis_units_lab": "g/N", "orddenom_axis_units_lab": "kN"},
            "unit label 'kN', a factor of 1000 to SI, but the file states a factor of 1 elsewhere",
        ),
    ],
)
def test_a_function_that_is_no_frf_of_motion_is_refused(tmp_path, fields, message):
    with pytest.raises(uff.MeasurementFileError, match=message):
        uff.read(by_pyuff(tmp_path, nodes(1, 101), function(**fields)))


def test_labels_and_units_of_the_file_must_agree(tmp_path):
    in_g = function(ordinate_axis_units_lab="g")
    with pytest.raises(
        uff.MeasurementFileError, match=r"'g', a factor of 9.80665 .* factor of 1 else"
    ):
        uff.read(by_pyuff(tmp_path, units(), nodes(1, 101), in_g))
    with pytest.raises(uff.MeasurementFileError, match="states other units than an earlier"):
        uff.read(by_pyuff(tmp_path, units(), units(length=1000.0), nodes(1, 101), function()))
    with pytest.raises(uff.MeasurementFileError, match="factors 0 for length"):
        uff.read(by_pyuff(tmp_path, units(length=0.0), nodes(1, 101), function()))


def test_two_nodes_of_one_name_are_refused(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 101), function())
    with pytest.raises(uff.MeasurementFileError, match="Nodes 1 and 101 would both be named 's1'"):
        uff.read(path, names={1: "s1", 101: "s1"})


def test_two_numbers_of_averages_are_refused(tmp_path):
    datasets = function(id4='{"averages": 4}'), function(ref_node=102, id4='{"averages": 8}')
    with pytest.raises(uff.MeasurementFileError, match="averages=8 and an earlier FRF averages=4"):
        uff.read(by_pyuff(tmp_path, nodes(1, 101, 102), *datasets))


def test_an_id_line_of_others_is_no_note(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 101), function(id4="{run 3}", id5="[wing]"))
    assert uff.read(path).averages is None


@pytest.mark.parametrize("binary", [False, True])
def test_a_stated_variance_comes_back_in_the_quantity_asked_for(tmp_path, binary):
    frf = np.stack([FRF, 2 * FRF, np.full(4, np.nan), 3 * FRF]).reshape(2, 2, 4)
    variance = np.abs(frf) ** 2 * np.linspace(0.01, 0.04, 4)
    variance[0, 1] = np.nan
    measurement = Measurement.from_arrays(
        frf,
        FREQUENCY,
        sensors=["s1+x", "s2+x"],
        actuators=["a1", "a2"],
        quantity="mobility",
        averages=5,
        variance=variance,
    )
    uff.write(tmp_path / "measured.uff", measurement, binary=binary)
    back = uff.read(tmp_path / "measured.uff", require_positions=False)
    np.testing.assert_allclose(back.variance, variance, rtol=1e-11)
    assert (back.averages, back.coherence) == (5, None)
    other = uff.read(tmp_path / "measured.uff", require_positions=False, quantity="accelerance")
    np.testing.assert_allclose(other.variance, variance * (2 * np.pi * FREQUENCY) ** 2, rtol=1e-11)
    assert uff.frfs.left_out(tmp_path / "measured.uff") == {}
