"""Laws line by line: what is written is read back, and what is no law is refused."""

import re

import numpy as np
import pandas as pd
import pytest
import pyuff

import bayes_placement as bp
from bayes_placement._shared.errors import InputError

LINES = np.geomspace(8.0, 900.0, 17)
STIFFNESS = 1e4 * (1 + 0.1j) - 0.02 * (2 * np.pi * LINES) ** 2
UNITS = ["N/m", "N m/rad", "m/N", "rad/(N m)"]


def table(unit):
    values = 1 / STIFFNESS if unit[-1] in "N)" else STIFFNESS
    parts = {"frequency": LINES, "real": values.real, "imaginary": values.imag}
    return pd.DataFrame(parts | {"unit": unit})


def write_csv(path, law):
    law.to_csv(path, index=False)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("name", ["law.csv", "law.unv"])
def test_a_law_is_read_back(tmp_path, unit, name):
    (write_csv if name.endswith("csv") else bp.io.write_law)(tmp_path / name, table(unit))
    law = bp.io.read_law(tmp_path / name)
    np.testing.assert_array_equal(law.frequency, LINES)
    np.testing.assert_allclose(law.stiffness, STIFFNESS, rtol=1e-14)


@pytest.mark.parametrize(
    ("headings", "factor"),
    [
        ("Frequency [Hz],Real [N/m],Imaginary [N/m]", 1.0),
        ("frequency_hz,real,imaginary", 1.0),
        ("FREQUENCY (kHz),Real (m/N),Imaginary (m/N)", 1e3),
    ],
)
def test_headings_of_a_law_may_state_units(tmp_path, headings, factor):
    of_unit = table("m/N" if "m/N" in headings else "N/m").drop(columns="unit")
    of_unit["frequency"] /= factor
    of_unit.to_csv(tmp_path / "law.csv", index=False, header=headings.split(","))
    law = bp.io.read_law(tmp_path / "law.csv")
    np.testing.assert_allclose(law.frequency, LINES)
    np.testing.assert_allclose(law.stiffness, STIFFNESS)


@pytest.mark.parametrize(
    ("headings", "words"),
    [
        ("frequency [s],real,imaginary", "frequency is in s; one of Hz"),
        ("frequency,real [kN/m],imaginary [kN/m]", "law is in kN/m; one of N/m"),
        ("frequency,real [N/m],imaginary [m/N]", "law is in N/m and in m/N"),
    ],
)
def test_units_in_headings_of_a_law_are_never_guessed(tmp_path, headings, words):
    (tmp_path / "law.csv").write_text(f"{headings}\n10,1,0\n20,1,0\n")
    with pytest.raises(InputError, match=re.escape(words)):
        bp.io.read_law(tmp_path / "law.csv")


def test_the_header_of_a_universal_file_states_what_it_holds(tmp_path):
    bp.io.write_law(tmp_path / "law.unv", table("N m/rad"))
    held = pyuff.UFF(str(tmp_path / "law.unv")).read_sets(1)
    assert (held["type"], held["func_type"], held["binary"]) == (58, 4, 1)
    assert (held["ordinate_spec_data_type"], held["orddenom_spec_data_type"]) == (13, 8)
    labels = [held[f"{side}_axis_units_lab"] for side in ("abscissa", "ordinate", "orddenom")]
    assert labels == ["Hz", "N m", "rad"]
    np.testing.assert_array_equal(held["data"], STIFFNESS)


def of_pyuff(path, **changed):
    """A file that this package did not write: kN over mm as text."""
    dataset = {
        "type": 58,
        "func_type": 4,
        "rsp_node": 1,
        "rsp_dir": 3,
        "ref_node": 1,
        "ref_dir": 3,
        "x": LINES,
        "data": STIFFNESS / 1e6,
        "abscissa_spec_data_type": 18,
        "abscissa_axis_units_lab": "Hz",
        "ordinate_spec_data_type": 13,
        "ordinate_axis_units_lab": "kN",
        "orddenom_spec_data_type": 8,
        "orddenom_axis_units_lab": "mm",
        "abscissa_spacing": 0,
        "binary": 0,
    }
    pyuff.UFF(str(path)).write_sets(dataset | changed, mode="overwrite")
    return path


def test_a_file_of_another_program_is_read_in_its_units(tmp_path):
    law = bp.io.read_law(of_pyuff(tmp_path / "mount.unv"))
    np.testing.assert_allclose(law.stiffness, STIFFNESS, rtol=1e-4)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"ordinate_spec_data_type": 12}, "a force .13 or 9. over a displacement"),
        ({"ordinate_axis_units_lab": "stone"}, "one of N, mN"),
        ({"func_type": 1}, "one of complex numbers is needed"),
    ],
)
def test_what_is_no_law_is_refused(tmp_path, changed, words):
    with pytest.raises(InputError, match=words):
        bp.io.read_law(of_pyuff(tmp_path / "mount.unv", **changed))


def test_a_table_without_a_column_or_unit_is_refused(tmp_path):
    write_csv(tmp_path / "law.csv", table("N/m").drop(columns="real"))
    with pytest.raises(InputError, match=r"law\.csv.*without the column real"):
        bp.io.read_law(tmp_path / "law.csv")
    with pytest.raises(InputError, match="one of N/m, N m/rad"):
        bp.io.write_law(tmp_path / "law.unv", table("N/m").drop(columns="unit"))
