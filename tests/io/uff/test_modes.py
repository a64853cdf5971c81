"""Universal files: modes of other programs, compared with the arrays they were made of."""

import numpy as np
import pytest
import pyuff

from bayes_placement import io
from bayes_placement.io import npz_modes, uff
from tests.io.uff.hand_typed import typed

# Most files here have no dataset 164; that this is told has tests of its own.
pytestmark = pytest.mark.filterwarnings("ignore:.* states no units")

# Typed by hand after the text of the format: FORTRAN columns, not the code of any library.
HAND_TYPED = """\
    -1
   164
         1                  SI         1
  1.0000000000000000D+00  1.0000000000000000D+00  1.0000000000000000D+00
  0.0000000000000000D+00
    -1
    -1
    15
         7         0         0        11  2.50000e-01  0.00000e+00 -1.00000e-01
       101         0         0        11  3.00000e-01  1.00000e+00  0.00000e+00
    -1
    -1
    55
beam
NONE
NONE
NONE
mode 1
         1         2         2         8         2         3
         2         4         1         1
  1.25000e+01  4.00000e+00  2.00000e-02  0.00000e+00
         7
 -2.00000e+00  0.00000e+00  1.00000e-10
       101
  6.00000e+00  0.00000e+00 -8.00000e-01
    -1
"""


def hand_typed(folder, *changes):
    return typed(folder, HAND_TYPED, *changes)


def nodes(*numbers, kind=2411):
    zeros = np.zeros(len(numbers), dtype=int)
    return {
        "type": kind,
        "node_nums": np.array(numbers),
        "def_cs": zeros,
        "disp_cs": zeros,
        "color": zeros,
        "x": np.array(numbers, dtype=float),
        "y": zeros.astype(float),
        "z": zeros + 0.5,
    }


def units(length, force):
    """Dataset 164 with the factors from SI to the units of the file."""
    return {
        "type": 164,
        "units_code": 9,
        "units_description": "USER",
        "temp_mode": 1,
        "length": length,
        "force": force,
        "temp": 1.0,
        "temp_offset": 0.0,
    }


def mode(number, frequency, numbers=(1, 2), axes=6, scale=1.0, **changes):
    values = scale * (np.arange(len(numbers) * axes) + 10.0 * number).reshape(-1, axes)
    fields = {
        "type": 55,
        "analysis_type": 2,
        "data_ch": 3 if axes == 6 else 2,
        "spec_data_type": 8,
        "data_type": 2,
        "n_data_per_node": axes,
        "load_case": 1,
        "mode_n": number,
        "freq": frequency,
        "modal_m": 1.0,
        "modal_damp_vis": 0.0,
        "node_nums": np.array(numbers),
    }
    return fields | {f"r{axis + 1}": values[:, axis] for axis in range(axes)} | changes


def by_pyuff(folder, *sets):
    path = folder / "pyuff.uff"
    pyuff.UFF(str(path)).write_sets(list(sets), mode="overwrite")
    return path


def test_a_hand_typed_file(tmp_path):
    model = uff.read_modes(hand_typed(tmp_path))
    assert model.node.tolist() == [7, 101]
    assert model.position.tolist() == [[0.25, 0.0, -0.1], [0.3, 1.0, 0.0]]
    assert model.dof.tolist() == [[7, 1], [7, 3], [101, 1], [101, 3]]  # nothing moves along y
    assert model.shape[:, 0].tolist() == [-1.0, 5e-11, 3.0, -0.4]  # modal mass 4 kg
    assert model.natural_frequency.tolist() == [12.5]
    assert model.damping_ratio.tolist() == [0.02]


@pytest.mark.parametrize("name", ["portal", "plate"])
def test_handed_over_models_agree_with_their_arrays(shared_data, name):
    folder = shared_data / "cases" / "models" / name
    if not folder.is_dir():
        pytest.skip(f"cases/models/{name} of the shared data is not on this machine")
    ours, arrays = uff.read_modes(folder / "nominal.uff"), npz_modes.read(folder / "nominal.npz")
    lowest = arrays.count(ours.natural_frequency.size)
    row = {tuple(dof): number for number, dof in enumerate(arrays.dof.tolist())}
    rows = [row[tuple(dof)] for dof in ours.dof.tolist()]
    # the twist of the plate has no place in a universal file
    assert len(rows) == np.count_nonzero(arrays.dof[:, 1] != 7)
    np.testing.assert_array_equal(ours.position, arrays.position)
    np.testing.assert_allclose(ours.natural_frequency, lowest.natural_frequency, rtol=6e-6)
    np.testing.assert_allclose(ours.shape, lowest.shape[rows], rtol=6e-6, atol=1e-9)
    np.testing.assert_allclose(ours.damping_ratio, lowest.damping_ratio)


@pytest.mark.parametrize("axes", [3, 6])
def test_files_by_pyuff(tmp_path, axes):
    sets = [mode(2, 30.0, axes=axes), mode(1, 20.0, axes=axes, modal_m=4.0)]  # not in order
    model = uff.read_modes(by_pyuff(tmp_path, nodes(1, 2, 3), *sets))
    assert model.node.tolist() == [1, 2]  # node 3 is in no mode
    assert model.natural_frequency.tolist() == [20.0, 30.0]
    assert model.damping_ratio is None
    expected = np.arange(2 * axes) + 10.0
    np.testing.assert_allclose(model.shape, np.column_stack([expected / 2, expected + 10]))


def test_units_of_dataset_164(tmp_path):
    """The same modes in mm, N and tonnes: factors from SI are 1000 for length and 1 for force."""
    in_si = mode(1, 20.0)
    length = [1e3, 1e3, 1e3, 1.0, 1.0, 1.0]  # a motion of 1 m is 1000 mm, a rotation stays
    in_mm = mode(1, 20.0, modal_m=1e3)  # of 1 kg m2 = 1e6 kg mm2 = 1e3 t mm2
    in_mm |= {f"r{k + 1}": in_si[f"r{k + 1}"] * length[k] for k in range(6)}
    place = nodes(1, 2) | {"x": np.array([1000.0, 2000.0]), "z": np.array([500.0, 500.0])}
    expected = uff.read_modes(by_pyuff(tmp_path, nodes(1, 2), in_si))
    converted = uff.read_modes(by_pyuff(tmp_path, units(1e3, 1.0), place, in_mm))
    np.testing.assert_allclose(converted.position, expected.position)
    np.testing.assert_allclose(converted.shape, expected.shape, rtol=1e-5)


def test_what_the_format_leaves_out_is_zero(tmp_path):
    sets = [mode(1, 20.0, axes=3), mode(2, 30.0, numbers=(2,), axes=3)]
    model = uff.read_modes(by_pyuff(tmp_path, nodes(1, 2), *sets))
    assert model.shape[:, 1].tolist() == [0.0, 0.0, 0.0, 20.0, 21.0, 22.0]


def test_other_results_are_passed_over(tmp_path):
    sets = [mode(1, 20.0), mode(1, 20.0, spec_data_type=2), mode(1, 1.0, analysis_type=5)]
    sets[-1] |= {"freq_step_n": 1}
    assert uff.read_modes(by_pyuff(tmp_path, nodes(1, 2), *sets)).natural_frequency.size == 1


def test_modal_masses_are_given_where_the_file_has_none(tmp_path):
    path = by_pyuff(tmp_path, nodes(1, 2), mode(1, 20.0, modal_m=0.0), mode(2, 30.0, modal_m=0.0))
    with pytest.raises(ValueError, match=r"modal_mass of mode 1 is 0 kg.*Files often hold 0"):
        uff.read_modes(path)
    model = uff.read_modes(path, modal_mass=[4.0, 1.0])
    assert model.shape[0].tolist() == [5.0, 20.0]
    assert uff.read_modes(path, modal_mass=1).shape[0].tolist() == [10.0, 20.0]


COMPLEX = mode(1, 20.0, axes=3, data_type=5)
COMPLEX |= {f"r{k}": COMPLEX[f"r{k}"] * (1 + 0.1j) for k in (1, 2, 3)}


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        (
            [mode(1, 20.0, spec_data_type=12)],
            r"holds normal mode of real acceleration; real normal",
        ),
        ([mode(1, 20.0, spec_data_type=0)], r"normal mode of real data type 0; .*as dataset 55"),
        ([COMPLEX], r"holds normal mode of complex displacement; .*undamped modes"),
        ([], r"holds nodes and units alone; real normal modes"),
        ([mode(1, 20.0, axes=3, data_ch=1)], r"data characteristic 1 with 3 values of each node"),
        ([mode(1, 20.0, data_ch=4)], r"characteristic 4 with 6 values .*three translations"),
        ([mode(1, 20.0, numbers=(1, 9))], r"move 1 nodes of which .* no coordinates \(9\); those"),
        ([mode(1, 20.0, numbers=(1, 1))], r"holds a node more than once; each node"),
        ([mode(1, 20.0), mode(1, 20.0)], r"holds mode 1 of load case 1 at 20 Hz .*same mode"),
        ([mode(1, 20.0), mode(2, 30.0, load_case=2)], r"load case 2 at 30 Hz .*one load case"),
        ([mode(1, 20.0), mode(2, 30.0, axes=3)], r"with 3 values of each node, and .*another"),
    ],
)
def test_what_is_refused(tmp_path, sets, message):
    with pytest.raises(uff.MeasurementFileError, match=message):
        uff.read_modes(by_pyuff(tmp_path, nodes(1, 2), *sets))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([("         2         3\n", "         2         2\n")], r"2 numbers of a node are ann"),
        (
            [("2         8         2         3\n", "3         8         2         6\n")],
            r"6 numbers of a node are announced",
        ),
        ([("  1.25000e+01", "  1.25000F+01")], r"damping is no number.*ModalModel.from_arrays"),
        ([(" -8.00000e-01\n    -1\n", " -8.00000e-01\n")], r"the file ends inside this dataset"),
        ([("       101         0         0", "       101         0         5")], r"local coord"),
    ],
)
def test_traps_of_the_decoder(tmp_path, changes, message):
    with pytest.raises(uff.MeasurementFileError, match=message):
        uff.read_modes(hand_typed(tmp_path, *changes))


def test_no_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"There is no file .*none.uff; a universal file"):
        uff.read_modes(tmp_path / "none.uff")


def test_the_former_name_reads_the_same(tmp_path):
    modes = io.uff_modes.read(hand_typed(tmp_path))
    assert np.array_equal(modes.shape, uff.read_modes(hand_typed(tmp_path)).shape)
