"""Formats of files: each line of the registry reads, and the recipe for a new one works."""

import doctest
import importlib
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse

import bayes_placement as bp
from bayes_placement.io import formats

CONTRIBUTING = Path(__file__).parents[2] / "CONTRIBUTING.md"
FREQUENCY = np.arange(5.0, 9.0)
MEASUREMENT = bp.Measurement.from_arrays(
    np.array([1.0 - 2.0j, -0.5 + 0.25j, 3.0 + 4.0j, -4.0 + 1.0j]),
    FREQUENCY,
    sensors="s1",
    actuators="a1",
    quantity="accelerance",
)
MODES = bp.finite_elements.ModalModel.from_arrays(
    position=np.zeros((2, 3)),
    shape=np.ones((2, 3, 1)),
    natural_frequency=[12.5],
    modal_mass=1,
)


@pytest.mark.parametrize("known", formats.FORMATS, ids=lambda known: known.reader)
def test_each_line_names_a_reader_and_what_it_reads(known):
    module, function = known.reader.split(".")
    assert callable(getattr(importlib.import_module(f"bayes_placement.io.{module}"), function))
    assert known.contents in ("measurement", "modes", "matrices")
    assert all(suffix == suffix.lower() and suffix[0] == "." for suffix in known.suffixes)


def test_a_suffix_tells_one_format():
    suffixes = [(known.contents, suffix) for known in formats.FORMATS for suffix in known.suffixes]
    assert len(set(suffixes)) == len(suffixes)


@pytest.mark.parametrize("name", ["measured.uff", "measured.UNV", "measured.txt"])
def test_a_measurement_is_read_by_suffix_or_first_bytes(tmp_path, name):
    bp.io.uff.write(tmp_path / name, MEASUREMENT)
    np.testing.assert_allclose(bp.io.read_measurement(tmp_path / name).frf, MEASUREMENT.frf)


def test_options_reach_the_reader(tmp_path):
    bp.io.uff.write(tmp_path / "measured.uff", MEASUREMENT)
    assert bp.io.read_measurement(tmp_path / "measured.uff", averages=7).averages == 7
    with pytest.raises(bp.io.uff.MeasurementFileError, match="without coordinates"):
        bp.io.read_measurement(tmp_path / "measured.uff", require_positions=True)


def test_modes_and_matrices_are_read(tmp_path):
    bp.io.npz_modes.write(tmp_path / "modes.npz", MODES)
    assert bp.io.read_modes(tmp_path / "modes.npz").natural_frequency.tolist() == [12.5]
    scipy.sparse.save_npz(tmp_path / "K.npz", scipy.sparse.csr_array(2 * np.eye(2)))
    scipy.sparse.save_npz(tmp_path / "M.npz", scipy.sparse.csr_array(np.eye(2)))
    matrices = bp.io.read_matrices(tmp_path / "K.npz", tmp_path / "M.npz")
    assert (matrices.stiffness.sum(), matrices.mass.sum()) == (4.0, 2.0)


@pytest.mark.parametrize("read", [bp.io.read_measurement, bp.io.read_modes, bp.io.read_matrices])
def test_unknown_formats_and_missing_files_are_refused(tmp_path, read):
    with pytest.raises(FileNotFoundError, match=r"There is no file .*none\.xyz; a file with"):
        read(tmp_path / "none.xyz")
    (tmp_path / "table.xyz").write_bytes(b"\0\1\2")
    with pytest.raises(ValueError, match=r"table\.xyz is in no format .* is needed here, by"):
        read(tmp_path / "table.xyz")


def blocks(heading):
    """Code blocks of a section of CONTRIBUTING.md."""
    section = CONTRIBUTING.read_text().split(f"## {heading}\n")[1].split("\n## ")[0]
    return re.findall(r"```(?:python|text)\n(.*?)```", section, flags=re.DOTALL)


def test_the_recipe_for_a_format_works_as_it_stands(tmp_path, monkeypatch, capsys):
    reader, line, use = blocks("Add a file format")
    path = re.match(r"# bayes_placement/io/(\w+\.py)\n", reader)
    (tmp_path / path[1]).write_text(reader)
    monkeypatch.setattr(bp.io, "__path__", [*bp.io.__path__, str(tmp_path)])
    entry = eval(line.strip().removesuffix(","), {"Format": formats.Format})
    monkeypatch.setattr(formats, "FORMATS", [*formats.FORMATS, entry])
    table = np.column_stack([FREQUENCY, MEASUREMENT.frf[0, 0].real, MEASUREMENT.frf[0, 0].imag])
    np.savetxt(tmp_path / "measured.frf", table)
    monkeypatch.chdir(tmp_path)
    names = {"bp": bp}
    exec(use, names)
    np.testing.assert_allclose(names["measurement"].frf, MEASUREMENT.frf)
    assert names["measurement"].quantity == "accelerance"
    np.savetxt(tmp_path / "narrow.frf", table[:, :2])
    with pytest.raises(ValueError, match=r"narrow\.frf .* three columns"):
        bp.io.read_measurement("narrow.frf")
    example = importlib.import_module(f"bayes_placement.io.{path[1].removesuffix('.py')}").read
    doctest.run_docstring_examples(example, {"bp": bp, "np": np})
    assert not capsys.readouterr().out, "what the example shows is not what it says"
