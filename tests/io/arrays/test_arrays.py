"""Named arrays of MATLAB, HDF5, NumPy, text and workbooks, most written by other programs."""

import pickle
import struct
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pytest
import scipy.io
import scipy.io.matlab

from bayes_placement.io import _gate, arrays

OF_MATLAB = Path(scipy.io.matlab.__file__).parent / "tests/data"
OF_H5PY = Path(h5py.__file__).parent / "tests/data_files"
THETA = np.pi / 4 * np.arange(9)


def load(path):
    loaded = arrays.load(Path(path))
    return loaded.arrays


def of_matlab(name):
    path = OF_MATLAB / name
    if not path.is_file():
        pytest.skip(f"this build of SciPy comes without its MATLAB files: there is no {path}")
    return path


# ------------------------------------------------------- written by MATLAB itself, on three systems

VERSIONS = ["6.1_SOL2", "6.5.1_GLNX86", "7.1_GLNX86", "7.4_GLNX86"]


@pytest.mark.parametrize("version", VERSIONS)
def test_files_of_matlab_6_and_7_are_read(version):
    double = load(of_matlab(f"testdouble_{version}.mat"))["testdouble"]
    np.testing.assert_allclose(double, THETA)
    complex_numbers = load(of_matlab(f"testcomplex_{version}.mat"))["testcomplex"]
    np.testing.assert_allclose(complex_numbers, np.exp(1j * THETA), atol=1e-15)
    cube = load(of_matlab(f"test3dmatrix_{version}.mat"))["test3dmatrix"]
    np.testing.assert_array_equal(cube, np.arange(1, 25).reshape((2, 3, 4), order="F"))
    structure = load(of_matlab(f"teststruct_{version}.mat"))
    np.testing.assert_allclose(structure["teststruct.doublefield"], np.sqrt([2, np.e**2, np.pi**2]))
    assert str(structure["teststruct.stringfield"]) == "Rats live on no evil star."
    names = load(of_matlab(f"teststringarray_{version}.mat"))["teststringarray"]
    assert names.tolist() == ["one  ", "two  ", "three"]


def test_a_file_of_matlab_7_3_is_read():
    double = load(of_matlab("testhdf5_7.4_GLNX86.mat"))["testdouble"]
    np.testing.assert_allclose(double, THETA)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("testobject_7.4_GLNX86.mat", "object of a class"),
        ("testfunc_7.4_GLNX86.mat", "function"),
        ("testsparse_7.4_GLNX86.mat", "sparse"),
        ("testcell_7.4_GLNX86.mat", "neither numbers nor text"),
    ],
)
def test_what_is_not_read_of_matlab_says_why(name, reason):
    loaded = arrays.load(of_matlab(name))
    assert not loaded.arrays
    [(_, why)] = loaded.left_out.items()
    assert reason in why


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("corrupted_zlib_checksum.mat", "cannot be unpacked"),
        ("corrupted_zlib_data.mat", "another length"),
        ("malformed1.mat", "the file ends too early: an element has 658840 bytes and"),
        ("bad_miuint32.mat", "no sizes"),
        ("testdouble_4.2c_SOL2.mat", "is in no format that is known by its first bytes"),
    ],
)
def test_damaged_files_of_matlab_are_refused(name, reason):
    with pytest.raises(ValueError, match=rf"{name}.*{reason}"):
        arrays.load(of_matlab(name))


# ----------------------------------------------------------------------- written by other libraries


def test_files_of_h5py_are_read():
    path = OF_H5PY / "compound-dtype-complex.h5"
    if not path.is_file():
        pytest.skip(f"this build of h5py comes without its files: there is no {path}")
    loaded = load(path)
    assert {values.dtype.kind for values in loaded.values()} == {"c"}
    with h5py.File(path) as file:
        places = {name: file[name].id.get_offset() for name in loaded}
    for name in ("<c16", "<c8", ">c16", ">c8"):  # the bytes as they lie in the file
        stored = np.fromfile(path, name, count=100, offset=places[name])
        np.testing.assert_array_equal(loaded[name], stored)


def write_matlab_7_3(path, **variables):
    """Write what MATLAB writes: a block of 512 bytes, then HDF5 with the axes reversed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in variables.items():
            if isinstance(values, str):
                letters = np.frombuffer(values.encode("utf-16-le"), "<u2").reshape(-1, 1)
                file[name], kind = letters, "char"
            elif isinstance(values, dict):
                kind = "struct"
                for field, inner in values.items():
                    file[f"{name}/{field}"] = np.atleast_2d(inner).T
                    file[f"{name}/{field}"].attrs["MATLAB_class"] = np.bytes_("double")
            else:
                stored = np.atleast_2d(values).T
                if np.iscomplexobj(stored):
                    pair = np.empty(stored.shape, [("real", "<f8"), ("imag", "<f8")])
                    pair["real"], pair["imag"] = stored.real, stored.imag
                    stored = pair
                file.create_dataset(name, data=stored, compression="gzip")
                kind = "double"
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(head)


def test_a_file_of_the_documented_layout_of_matlab_7_3_is_read(tmp_path):
    path = tmp_path / "measured.mat"
    frf = np.arange(24.0).reshape(4, 3, 2) * (1 + 2j)
    write_matlab_7_3(path, H=frf, label="plate", axis={"f": [1.0, 2.0, 3.0, 4.0]})
    loaded = arrays.load(path)
    assert loaded.format == "a MATLAB 7.3 file"
    np.testing.assert_array_equal(loaded.arrays["H"], frf)
    np.testing.assert_array_equal(loaded.arrays["axis.f"], [1, 2, 3, 4])
    assert str(loaded.arrays["label"]) == "plate"


def test_structures_in_cells_of_matlab_7_3_are_numbered_as_those_of_matlab_5(tmp_path):
    path, lines = tmp_path / "cells.mat", np.arange(3.0)
    write_matlab_7_3(path, f=lines)
    with h5py.File(path, "r+") as file:
        cells = file.create_dataset("run", (1, 2), dtype=h5py.ref_dtype)
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
        for number in range(2):
            group = file.create_group(f"#refs#/{number}")
            group.attrs["MATLAB_class"] = np.bytes_("struct")
            group["f"] = (number + lines)[:, None]
            group["f"].attrs["MATLAB_class"] = np.bytes_("double")
            cells[0, number] = group.ref
    loaded = load(path)
    assert [*loaded] == ["f", "run.1.f", "run.2.f"]
    np.testing.assert_array_equal(loaded["run.2.f"], 1 + lines)


@pytest.mark.parametrize("options", [{}, {"do_compression": True}])
def test_files_of_scipy_are_read(tmp_path, options):
    content = {"H": np.eye(3) * 1j, "names": ["s1", "s2"], "run": {"f": [1.0, 2.0], "unit": "Hz"}}
    scipy.io.savemat(tmp_path / "a.mat", content, **options)
    loaded = load(tmp_path / "a.mat")
    np.testing.assert_array_equal(loaded["H"], np.eye(3) * 1j)
    assert loaded["names"].tolist() == ["s1", "s2"]
    np.testing.assert_array_equal(loaded["run.f"], [1, 2])
    assert str(loaded["run.unit"]) == "Hz"


def test_lists_that_mix_numbers_and_texts_are_left_out(tmp_path):
    cells = np.array([1.0, "x"], dtype=object)
    scipy.io.savemat(tmp_path / "a.mat", {"mixed": cells, "f": [1.0, 2.0]})
    loaded = arrays.load(tmp_path / "a.mat")
    assert loaded.left_out == {"mixed": "it holds neither numbers nor text"}
    assert list(loaded.arrays) == ["f"]


def test_hdf5_opens_no_other_file(tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["key"] = np.arange(4.0)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["g/f"] = np.arange(3.0)
        file["g/f"].attrs["units"] = "Hz"
        file["g/again"] = file["g"]
        file["packed"] = np.arange(3)
        file["packed"].attrs["scale_factor"] = 0.1
        file["outside"] = h5py.ExternalLink("secret.h5", "/key")
        layout = h5py.VirtualLayout((4,), "f8")
        layout[:] = h5py.VirtualSource(tmp_path / "secret.h5", "key", (4,))
        file.create_virtual_dataset("virtual", layout)
        file.create_dataset(
            "external", (4,), "f8", external=[(str(tmp_path / "secret.h5"), 0, h5py.h5f.UNLIMITED)]
        )
    loaded = arrays.load(tmp_path / "a.h5")
    np.testing.assert_array_equal(loaded.arrays.pop("g/f"), [0, 1, 2])
    assert loaded.units == {"g/f": "Hz"}
    assert not loaded.arrays
    assert loaded.left_out == {
        "g/again": "it is another name of an object that is read already",
        "outside": "it is a link to another place, which is not followed",
        "packed": "it is packed by scale_factor and add_offset, which are not applied",
        "virtual": "its values are in another file, which is not opened",
        "external": "its values are in another file, which is not opened",
    }


def test_hdf5_that_announces_more_than_it_holds_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("H", (1 << 20, 1 << 20), "f8", chunks=(8, 8))  # 8 TiB, none of them
    with pytest.raises(ValueError, match=r"a\.h5 .*/H announces 8796093022208 bytes in 0 stored"):
        arrays.load(tmp_path / "a.h5")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("os.abort()", "its process ended with -6"),
        ("{}[1]", r"HDF5 \(its content is not what its beginning announces"),
    ],
)
def test_a_reader_that_dies_is_told_in_words(tmp_path, monkeypatch, line, words):
    reader = tmp_path / "reader.py"
    reader.write_text(f"import os\ndef read(path, most):\n    {line}\n")
    monkeypatch.setattr(arrays, "_READER", reader)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["f"] = 1.0
    with pytest.raises(ValueError, match=rf"a\.h5 .*{words}"):
        arrays.load(tmp_path / "a.h5")


# --------------------------------------------------------------------------------------------- text


@pytest.mark.parametrize(
    ("content", "columns", "units"),
    [
        ("frequency [Hz],H\n1,2\n3,4e-1\n", {"frequency": [1, 3], "H": [2, 0.4]}, "Hz"),
        ("\ufefffrequency (Hz)\tH\n1\t2\n3\t.4\n", {"frequency": [1, 3], "H": [2, 0.4]}, "Hz"),
        ("frequency [Hz];H\n1,0;2\n3;0,4\n", {"frequency": [1, 3], "H": [2, 0.4]}, "Hz"),
        ("% measured\n% frequency H\n1 2\n\n3 4D-1\n", {"frequency": [1, 3], "H": [2, 0.4]}, None),
        ("1 2\n3 0.4\n", {"column 1": [1, 3], "column 2": [2, 0.4]}, None),
    ],
)
def test_columns_are_read(tmp_path, content, columns, units):
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    loaded = arrays.load(tmp_path / "a.csv")
    assert {name: values.tolist() for name, values in loaded.arrays.items()} == columns
    assert loaded.units.get("frequency") == units


def test_lines_above_the_columns_are_told(tmp_path):
    (tmp_path / "a.txt").write_text("Laboratory; plate 3; 1.5\nf;H\n1,5;2\n2,5;3\n")
    loaded = arrays.load(tmp_path / "a.txt")
    assert loaded.left_out == {"line 'Laboratory plate 3 1.5'": "it is before the columns"}


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("f,H\n1,2\n3\n", "row 3 has 1 column and earlier ones have 2"),
        ("f,H\n1,2\n3,x\n", "the column 'H' holds numbers and 'x'"),
        ("f,f\n1,2\n", "two columns are named 'f'"),
        ("f;H\n1,5;2.5\n", "it holds the number 1,5 and also 2.5, whose comma may be a decimal"),
        ("f\tH\n1,500\t7\n2,500\t8\n", "it holds the number 1,500 and others like it"),
        ("f,H\na,b\n", "no row of it has a number; measured FRFs are needed as columns"),
        ("# nothing\n", "it has no row"),
    ],
)
def test_wrong_columns_are_refused(tmp_path, content, reason):
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(ValueError, match=rf"a\.csv.*{reason}"):
        arrays.load(tmp_path / "a.csv")


def test_too_much_text_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(_gate.LIMITS, "bytes of text", 10)
    (tmp_path / "a.csv").write_text("f,H\n1,2\n3,4\n")
    with pytest.raises(ValueError, match=r"a\.csv.* it has 12 bytes of text or more; at most 10"):
        arrays.load(tmp_path / "a.csv")


# ------------------------------------------------------------------------------ workbooks and NumPy


def test_workbooks_of_pandas_are_read(tmp_path):
    table = pd.DataFrame({"frequency [Hz]": [1.0, 2.0], "name": ["a", "b"]})
    with pd.ExcelWriter(tmp_path / "a.xlsx", engine="openpyxl") as file:
        table.to_excel(file, sheet_name="one", index=False)
    loaded = arrays.load(tmp_path / "a.xlsx")
    np.testing.assert_array_equal(loaded.arrays["frequency"], [1, 2])
    assert loaded.arrays["name"].tolist() == ["a", "b"]
    assert loaded.units == {"frequency": "Hz"}


def test_columns_of_several_sheets_are_told_apart(tmp_path):
    book = openpyxl.Workbook()
    for sheet in (book.active, book.create_sheet("second")):
        sheet.append(["f", "H"])
        sheet.append([1, 2.5])
    book.save(tmp_path / "a.xlsx")
    assert list(load(tmp_path / "a.xlsx")) == ["Sheet!f", "Sheet!H", "second!f", "second!H"]


def test_sheets_that_are_no_tables_of_numbers_are_left_out(tmp_path):
    book = openpyxl.Workbook()
    for row in (["name", "x [mm]"], ["s1", 250], ["s2", ""]):
        book.active.append(row)
    second = book.create_sheet("FRF")
    for row in (["f", "H"], [1, 2.5]):
        second.append(row)
    book.save(tmp_path / "a.xlsx")
    loaded = arrays.load(tmp_path / "a.xlsx")
    assert list(loaded.arrays) == ["f", "H"]
    [(sheet, reason)] = loaded.left_out.items()
    assert sheet == "sheet Sheet"
    assert "the column 'x' holds numbers and ''" in reason


def replaced(path, member, old, new):
    """Replace a text in a member of an archive."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members[member] = members[member].replace(old, new)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def test_a_row_far_below_the_last_one_is_refused(tmp_path):
    book = openpyxl.Workbook()
    for row in (["f"], [1]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    far = b'<row r="99999999999"'
    replaced(tmp_path / "a.xlsx", "xl/worksheets/sheet1.xml", b'<row r="2"', far)
    with pytest.raises(ValueError, match=r"a\.xlsx.* has 200001 rows of a workbook or more"):
        arrays.load(tmp_path / "a.xlsx")


def test_names_that_cannot_be_printed_are_left_out(tmp_path):
    np.savez(tmp_path / "a.npz", **{"H\x1b[2J": [1.0], "f": [1.0], "x" * 600: [1.0]})
    loaded = arrays.load(tmp_path / "a.npz")
    assert list(loaded.arrays) == ["f"]
    assert "'H\\x1b[2J'" in loaded.left_out


def with_member(path, name, content, **options):
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, content, **options)


@pytest.mark.parametrize(
    ("name", "content", "options", "reason"),
    [
        ("xl/bomb.xml", bytes(50_000_000), {"compress_type": zipfile.ZIP_BZIP2}, "packed in a way"),
        ("xl/a.xml", b'<!DOCTYPE a [<!ENTITY b "c">]>', {}, "defines entities"),
        ("../a.xml", b"", {}, "leads out of it"),
    ],
)
def test_workbooks_that_are_no_tables_are_refused(tmp_path, name, content, options, reason):
    path = tmp_path / "a.xlsx"
    book = openpyxl.Workbook()
    book.active.append(["f"])
    book.active.append([1])
    book.save(path)
    with_member(path, name, content, **options)
    with pytest.raises(ValueError, match=rf"a\.xlsx.*{reason}"):
        arrays.load(path)


def test_pickles_are_never_loaded(tmp_path):
    class Trap:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "sprung",))

    np.savez(tmp_path / "a.npz", H=np.array([Trap()], dtype=object))
    (tmp_path / "a.mat").write_bytes(pickle.dumps(Trap()))
    for name in ("a.npz", "a.mat"):
        with pytest.raises(ValueError, match=name):
            arrays.load(tmp_path / name)
    assert not (tmp_path / "sprung").exists()


def test_a_matlab_file_of_very_many_elements_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(_gate.LIMITS, "elements of a MATLAB file", 50)
    scipy.io.savemat(tmp_path / "a.mat", {"cells": np.array(["x"] * 30, dtype=object)})
    with pytest.raises(ValueError, match=r"a\.mat.* has 51 elements of a MATLAB file"):
        arrays.load(tmp_path / "a.mat")


def test_a_matlab_file_that_announces_too_much_is_refused(tmp_path):
    """A variable of 2^31 - 1 squared numbers, of which eight bytes are there."""
    flags = struct.pack("<IIII", 6, 8, 6, 0)
    sizes = struct.pack("<IIii", 5, 8, 2**31 - 1, 2**31 - 1)
    name = struct.pack("<HH4s", 1, 1, b"H")
    values = struct.pack("<IId", 9, 8, 1.0)
    body = flags + sizes + name + values
    element = struct.pack("<II", 14, len(body)) + body
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (tmp_path / "a.mat").write_bytes(head + element)
    with pytest.raises(ValueError, match=r"a\.mat.* announces 4611686014132420609 numbers"):
        arrays.load(tmp_path / "a.mat")
    packed = zlib.compress(element)
    packed_element = struct.pack("<II", 15, len(packed)) + packed
    (tmp_path / "a.mat").write_bytes(head + packed_element)
    with pytest.raises(ValueError, match=r"a\.mat.* announces 4611686014132420609 numbers"):
        arrays.load(tmp_path / "a.mat")


def analyser_text(points, decimal="."):
    """Blocks as an analyser writes them: a head of keys, then number, line, real, imaginary."""
    blocks = []
    for point in points:
        head = {"Function": "H1", "Signal": point, "X-Axis unit": "Hz", "Y-Axis unit": "(m/s^2)/N"}
        head |= {"X-Axis first": 10.0, "X-Axis delta": 2.5, "Averages": 5}
        blocks += [f"{key}:\t{value}" for key, value in head.items()]
        blocks += [f"{k + 1}\t{10 + 2.5 * k}\t{0.5 + k}\t{-1.5 * k}" for k in range(4)]
    return "\n".join(blocks).replace(".", decimal)


@pytest.mark.parametrize("decimal", [".", ","])
def test_text_in_blocks_is_read_by_what_tells_them_apart(tmp_path, decimal):
    path = tmp_path / "frf.txt"
    path.write_text(analyser_text(["Point 1", "Point 2"], decimal))
    loaded = arrays.load(path)
    columns = ("x-axis", "column 3", "column 4")
    assert [*loaded.arrays] == [f"Point {n} {name}" for n in (1, 2) for name in columns]
    np.testing.assert_array_equal(loaded.arrays["Point 2 x-axis"], [10.0, 12.5, 15.0, 17.5])
    np.testing.assert_array_equal(loaded.arrays["Point 2 column 4"], [0.0, -1.5, -3.0, -4.5])
    assert loaded.units["Point 1 x-axis"] == "Hz"
    assert loaded.units["Point 1 column 3"].startswith("(m/s^2)/N")
    path.write_text(analyser_text(["Point 1", "Point 1"], decimal))
    assert "block 2 column 3" in arrays.load(path).arrays
    path.write_text(analyser_text(["Point 1", "Point 2"], decimal).rpartition("\t")[0])
    with pytest.raises(ValueError, match=r"frf\.txt: row 4 has 3 columns and earlier ones have 4"):
        arrays.load(path)


def test_units_may_stand_in_a_row_below_the_names(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("measured,today,here\nf,H re,\nHz,(m/s^2)/N,-\n1,2,3\n2,3,4\n")
    loaded = arrays.load(path)
    assert [*loaded.arrays] == ["f", "H re", "column 3"]
    assert loaded.units == {"f": "Hz", "H re": "(m/s^2)/N", "column 3": "-"}
