"""Small files that ask for much are refused before they get it, and what is allowed is stated."""

import contextlib
import importlib
import itertools
import pkgutil
import re
import signal
import time
import zipfile
from importlib.util import find_spec
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

import bayes_placement as bp
from bayes_placement._shared.errors import InputError, UsageError
from bayes_placement.io import _gate, arrays
from bayes_placement.io._gate import reading
from bayes_placement.io.arrays import workbook
from bayes_placement.io.arrays.text import LONGEST_NAME
from bayes_placement.io.case._json_fields import integer, load, positive
from bayes_placement.io.mapped import _toml_fields


def zeros(path, count):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("frf.npy", b"\0" * count)


def test_an_archive_of_zeros_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(_gate.LIMITS, "unpacked bytes of a NumPy archive", 10_000)
    zeros(tmp_path / "a.npz", 20_000)
    words = r"it has 20000 unpacked bytes of a NumPy archive or more; at most 10000 are read"
    with pytest.raises(InputError, match=words):
        arrays.load(tmp_path / "a.npz")
    monkeypatch.setenv(_gate.VARIABLE, "2")
    with pytest.raises(InputError, match="array frf"):  # which holds no array
        arrays.load(tmp_path / "a.npz")
    monkeypatch.setenv(_gate.VARIABLE, "many")
    with pytest.raises(UsageError, match="=many stands in the environment; a whole number"):
        arrays.load(tmp_path / "a.npz")


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("H", data=np.zeros(200_000), compression="gzip")


def write_mat(path):
    scipy.io.savemat(path, {"H": np.zeros(200_000)}, do_compression=True)


@pytest.mark.parametrize(("of", "write"), [("an HDF5", write_hdf5), ("a MATLAB", write_mat)])
def test_files_that_unpack_to_much_are_refused(tmp_path, monkeypatch, of, write):
    monkeypatch.setitem(_gate.LIMITS, f"unpacked bytes of {of} file", 1_000_000)
    write(tmp_path / "a.dat")
    words = rf"a.dat.* it has 1[06].{{5}} unpacked bytes of {of} file or more; at most 1000000"
    with pytest.raises(InputError, match=words):
        arrays.load(tmp_path / "a.dat")
    monkeypatch.setenv(_gate.VARIABLE, "2")
    assert arrays.load(tmp_path / "a.dat").arrays["H"].size == 200_000


@pytest.mark.parametrize("separator", [",", " "])
def test_cells_are_counted_before_they_are_made(tmp_path, monkeypatch, separator):
    monkeypatch.setitem(_gate.LIMITS, "cells of text", 10)
    (tmp_path / "a.csv").write_text(separator.join(["1"] * 100))
    with pytest.raises(InputError, match=r"it has (99|100) cells of text or more; at most 10"):
        arrays.load(tmp_path / "a.csv")


@pytest.mark.parametrize("what", ["rows", "cells"])
def test_rows_and_cells_of_a_workbook_are_counted(tmp_path, monkeypatch, what):
    import openpyxl

    book = openpyxl.Workbook()
    for _ in range(20):
        book.active.append([1.0, 2.0])
    book.save(tmp_path / "a.xlsx")
    monkeypatch.setitem(_gate.LIMITS, f"{what} of a workbook", 10)
    with pytest.raises(InputError, match=rf"it has 1[12] {what} of a workbook or more"):
        arrays.load(tmp_path / "a.xlsx")


ENTITY = '<?xml version="1.0" encoding="{}"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp500"])
def test_entities_are_seen_in_any_encoding(tmp_path, encoding):
    path, text = tmp_path / "a.xlsx", ENTITY.format(encoding)
    if encoding == "cp500":  # letters of which ASCII sees none behind the declaration
        head = f'<?xml version="1.0" encoding="{encoding}"?>'
        content = head.encode() + text.removeprefix(head).encode(encoding)
    else:
        content = text.encode(encoding)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/workbook.xml", content)
    with pytest.raises(InputError, match=r"defines entities|is not encoded in UTF-8"):
        workbook.read_sheets(path)


def test_a_long_cell_is_a_sentence(tmp_path):
    (tmp_path / "a.csv").write_text(f"f,H\n1,{'x' * 200_000}\n2,3\n")
    with pytest.raises(InputError, match="one of its cells has more than 131072 letters"):
        arrays.load(tmp_path / "a.csv")


def test_an_object_of_many_fields_is_read_in_a_moment(tmp_path, monkeypatch):
    monkeypatch.setattr(_gate, "SECONDS", 1.0)
    fields = ",".join(f'"a{number}":1' for number in range(70_000))
    (tmp_path / "case.json").write_text(f"{{{fields}}}")
    assert len(load(tmp_path / "case.json").content) == 70_000


@pytest.mark.parametrize("key", ["a", "'a'"])
def test_a_key_of_many_parts_is_refused(tmp_path, key):
    (tmp_path / "a.toml").write_text(f"# {'.' * 200}\n{'.'.join([key] * 1000)} = 1\n")
    with pytest.raises(InputError, match=r"a.toml: a key of it has more than 100 parts; fields of"):
        _toml_fields.load(tmp_path / "a.toml")


def test_a_refusal_does_not_repeat_a_long_cell(tmp_path):
    (tmp_path / "a.csv").write_text(f"f,H\n1,{'1' * 130_000}x\n2,3\n")
    with pytest.raises(InputError, match=r"a.csv: .* \.\.\. .*, which is none") as told:
        arrays.load(tmp_path / "a.csv")
    assert len(str(told.value)) < 2000


def test_an_integer_of_many_digits_is_no_number(tmp_path):
    (tmp_path / "case.json").write_text(f'{{"length_m": 1{"0" * 400}}}')
    (tmp_path / "a.toml").write_text(f"length = 1{'0' * 400}\n")
    with pytest.raises(InputError, match=r"the field length_m is 1000.*; a positive number"):
        load(tmp_path / "case.json").value("length_m", positive("m", 1.0))
    with pytest.raises(InputError, match=r"length is 1000.*; a finite number is needed"):
        _toml_fields.load(tmp_path / "a.toml").number("length", "1.0")


def test_an_integer_of_many_digits_is_no_count(tmp_path):
    (tmp_path / "case.json").write_text(f'{{"uff_node": 1{"0" * 400}}}')
    with pytest.raises(InputError, match=r"field uff_node is 1000.*; numbers up to 1e\+30 are"):
        load(tmp_path / "case.json").value("uff_node", integer(1, 1))


def test_a_number_that_python_does_not_read_is_a_sentence(tmp_path):
    for name, text in (("case.json", '{{"note": {}}}'), ("a.toml", "note = {}")):
        (tmp_path / name).write_text(text.format("1" * 6000))
        reader = load if name == "case.json" else _toml_fields.load
        with pytest.raises(InputError, match=rf"{name}.*the number 1111.* of 1000 digits or more"):
            reader(tmp_path / name)


def test_a_hundred_thousand_channels_are_read_in_a_moment(tmp_path):
    names = [f"s{number}" for number in range(100_000)]
    measured = bp.Measurement.from_arrays(
        np.ones((len(names), 1, 1)) * 1j,
        [1.0],
        sensors=names,
        actuators=["a1"],
        quantity="mobility",
    )
    assert len(measured.sensors) == len(names)


WIDE = ("utf-16", "utf-16-le", "utf-32-be")
WIDE_FILES = {
    "a.csv": ("f,H\n1,2\n2,3\n", arrays.load),
    "a.uff": ("    -1\n    15\n    -1\n", bp.io.uff.read),
    "case.json": ('{"structure": {}}', load),
    "a.toml": ("frequency = 1\n", _toml_fields.load),
    "study.py": ("experiment = 1\n", bp.io.model.read),
}


@pytest.mark.parametrize("encoding", WIDE)
@pytest.mark.parametrize("name", WIDE_FILES)
def test_text_of_wide_letters_is_named_as_what_it_is(tmp_path, name, encoding):
    text, read = WIDE_FILES[name]
    (tmp_path / name).write_bytes(text.encode(encoding))
    if (name, encoding) == ("a.csv", "utf-16"):  # whose mark tells
        assert read(tmp_path / name).arrays["H"].tolist() == [2.0, 3.0]
    else:
        with pytest.raises(InputError, match=rf"{name}.* is text in UTF-16 or UTF-32, which an"):
            read(tmp_path / name)


def test_a_path_with_a_nul_is_refused():
    with pytest.raises(InputError, match=r"path='a.x00b' was given; the path of a file or folder"):
        bp.io.case.read("a\0b")


def patterns():
    """Patterns of all readers by name, and how each is used; without those of other processes."""
    for module in pkgutil.walk_packages(bp.io.__path__, "bayes_placement.io."):
        if not module.name.endswith(("_process", "_child")):
            source = Path(find_spec(module.name).origin).read_text()
            for name, use in re.findall(r"\b([A-Z_]+)\.(\w+)", source):
                pattern = getattr(importlib.import_module(module.name), name, None)
                if isinstance(pattern, re.Pattern):
                    yield f"{module.name}.{name}", pattern, use


PIECES = (*' 1a(.*\n/=_#:"\\,+<', "a ", "1 ", "a/", "/ ", "[(", "1e", "*\n", "dB re", "<?xml ")
BLOCKS = ("***Start_Special***\n", "***End_of_Header***", '<?xml encoding="', " 1,", '"\\')
BOUNDED = {"_UNIT": LONGEST_NAME, "_AMOUNT": 100}
"""Letters of the longest text that some patterns are asked about."""


def test_no_pattern_takes_longer_than_in_proportion_to_its_text():
    """Twenty digits and a letter between two universal datasets took 40 s."""
    for name, pattern, use in patterns():
        longest = BOUNDED.get(name.rpartition(".")[2], 4000)
        for piece, count in itertools.product(PIECES + BLOCKS, (8, 12, 16, 20, longest)):
            for begin in ("", "a"):
                given = (begin + piece * count)[:longest] + "!"
                given = given.encode() if isinstance(pattern.pattern, bytes) else given
                start = time.process_time()
                getattr(pattern, use)(*((given[:0], given) if use == "sub" else (given,)))
                assert time.process_time() - start < 0.1, (name, use, piece, count)


def for_ever(path):
    """Read as a library does that goes on whatever happens."""
    with reading(path, "a table", "Export it again."):
        while True:
            with contextlib.suppress(Exception):
                float("x")


def test_what_computes_for_ever_is_given_up(tmp_path, monkeypatch):
    (tmp_path / "a.csv").write_bytes(bytes(50_000))
    monkeypatch.setattr(_gate, "SECONDS", 0.1)
    monkeypatch.setenv(_gate.VARIABLE, "2")
    start = time.process_time()
    with pytest.raises(
        InputError, match=r"a.csv cannot be read .*\(it did not end within 0\.4 s of"
    ):
        for_ever(tmp_path / "a.csv")
    assert 0.1 < time.process_time() - start < 2  # ticks are counted as whole
    assert signal.getsignal(signal.SIGVTALRM) == signal.SIG_DFL
    assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0, 0)


def test_a_file_that_another_names_has_a_time_of_its_own(tmp_path, monkeypatch):
    (tmp_path / "small").touch()
    (tmp_path / "large").write_bytes(bytes(250_000))
    monkeypatch.setattr(_gate, "SECONDS", 0.1)
    with pytest.raises(InputError, match=r"small .* 0\.1 s"), reading(tmp_path / "small", "", ""):
        with pytest.raises(InputError, match=r"large .* 0\.6 s"):
            for_ever(tmp_path / "large")
        for_ever(tmp_path / "small")
