"""Archives of arrays and sparse matrices: sizes and indices are checked before use."""

import gzip
import io
import shutil
import struct
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from typer.testing import CliRunner

from bayes_placement.cli.app import app
from bayes_placement.io import _gate, matrix_files
from bayes_placement.io._npz_archive import NpzArchive

FORMS = ("csr", "csc", "coo", "bsr", "dia")


def dense(size=6):
    random = np.random.default_rng(3)
    values = random.standard_normal((size, size)) * (random.random((size, size)) < 0.4)
    return values @ values.T + np.diag(np.arange(1.0, size + 1))


def npy(header, body=b""):
    text = header.encode() + b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + body


def array(values):
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


def archive(path, members, packing=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", packing) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return path


def refused(path, message, name="a"):
    with pytest.raises(ValueError, match=message) as caught:
        NpzArchive(path, "anything").array(name)
    assert path.name in str(caught.value)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", ["<f8", ">f4", "<i2", "?", "<c16", "<U3", "S2"])
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_arrays_come_back(tmp_path, order, kind, save):
    values = np.asarray(np.arange(6).reshape(2, 3) % 2, order=order).astype(kind)
    save(tmp_path / "a.npz", a=values, b=np.array(3.5))
    archive = NpzArchive(tmp_path / "a.npz", "anything")
    assert archive.names == ["a", "b"]
    assert np.array_equal(archive.array("a"), values) and archive.array("a").dtype == values.dtype
    assert archive.array("b") == 3.5


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (399999999996,)}", "announces 3199999"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}", "announces 48 bytes and"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (3,)}", "holds pickled objects"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-3,)}", r"its shape is \(-3,\)"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (True,)}", "its shape is"),
        ("{'descr': '<f8', 'fortran_order': 3, 'shape': (3,)}", "fortran_order is not a valid"),
        ("{'descr': '<f8'", "array a: "),
    ],
)
def test_a_header_that_its_bytes_contradict_is_refused(tmp_path, header, message):
    path = archive(tmp_path / "bomb.npz", {"a.npy": npy(header, b"\0" * 24)})
    refused(path, message)


def test_more_bytes_than_announced_are_refused(tmp_path):
    path = archive(tmp_path / "long.npz", {"a.npy": array(np.arange(3.0)) + b"\0" * 8})
    refused(path, "announces 24 bytes and holds 24 or more")


@pytest.mark.parametrize("packing", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_packings_are_refused(tmp_path, packing):
    path = archive(tmp_path / "packed.npz", {"a.npy": array(np.arange(3.0))}, packing)
    refused(path, "is packed in a way that numpy does not use")


@pytest.mark.parametrize("name", ["../../a.npy", "/a.npy", "readme.txt", "a/"])
def test_members_that_are_no_arrays_are_refused(tmp_path, name):
    refused(archive(tmp_path / "odd.npz", {name: b""}), "is no array")


@pytest.mark.parametrize(("flag", "message"), [(0x1, "is encrypted"), (0x20, "or patched")])
def test_encrypted_and_patched_members_are_refused(tmp_path, flag, message):
    path = archive(tmp_path / "flag.npz", {"a.npy": array(np.arange(3.0))})
    content = bytearray(path.read_bytes())
    for magic, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(magic) + place] |= flag
    path.write_bytes(content)
    refused(path, message)


def test_a_size_that_no_packing_reaches_is_refused(tmp_path):
    path = archive(tmp_path / "size.npz", {"a.npy": array(np.arange(3.0))})
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, content.index(b"PK\x01\x02") + 24, 2**31)
    path.write_bytes(content)
    refused(path, "announces 2147483648 bytes in")


def test_a_member_that_stands_twice_is_refused(tmp_path):
    path = tmp_path / "twice.npz"
    with zipfile.ZipFile(path, "w") as file, pytest.warns(UserWarning, match="Duplicate name"):
        file.writestr("a.npy", array(np.arange(3.0)))
        file.writestr("a.npy", array(np.arange(4.0)))
    refused(path, "occurs twice, and either could be meant")


def test_a_single_array_is_refused(tmp_path):
    (tmp_path / "single.npz").write_bytes(array(np.arange(3.0)))
    refused(tmp_path / "single.npz", "it is a single array")


@pytest.mark.parametrize("form", FORMS)
def test_sparse_matrices_come_back(tmp_path, form):
    matrix = scipy.sparse.coo_array(dense()).asformat(form)
    for name in ("K", "M"):
        scipy.sparse.save_npz(tmp_path / f"{name}.npz", matrix)
    read = matrix_files.read(tmp_path / "K.npz", tmp_path / "M.npz")
    assert np.allclose(read.stiffness.toarray(), dense())


def damaged(folder, form, **changes):
    """A matrix file with some of its arrays replaced."""
    scipy.sparse.save_npz(folder / "K.npz", scipy.sparse.coo_array(dense()).asformat(form))
    with np.load(folder / "K.npz") as file:
        arrays = {name: file[name] for name in file.files}
    for name, change in changes.items():
        arrays[name] = change(arrays[name])
    np.savez(
        folder / "K.npz", **{name: value for name, value in arrays.items() if value is not None}
    )
    return folder / "K.npz"


def at(place, value):
    def change(values):
        values = values.copy()
        values[place] = value
        return values

    return change


@pytest.mark.parametrize(
    ("form", "changes", "message"),
    [
        ("csr", {"indices": at(2, 6)}, "indices go from 0 to 6 in a size of 6"),
        ("csc", {"indices": at(2, 1_000_000)}, "indices go from 0 to 1000000 in a size"),
        ("csr", {"indices": at(0, -1)}, "indices go from -1 to 5"),
        ("csr", {"indptr": at(2, 10_000)}, "indptr falls"),
        ("csr", {"indptr": at(-1, 10_000)}, "does not divide"),
        ("csr", {"indptr": lambda x: x[:-1]}, "does not divide"),
        ("csr", {"indices": lambda x: x.astype(float)}, "indices holds float64, no whole numbers"),
        ("csr", {"indices": lambda x: None}, "it has no array indices, which a csr matrix has"),
        ("csr", {"data": lambda x: x[:-1]}, "values have"),
        ("csr", {"data": lambda x: x[:, None]}, "no list"),
        ("coo", {"row": at(0, 6)}, "row go from 0 to 6"),
        ("coo", {"col": at(0, -7)}, "col go from -7"),
        ("bsr", {"data": lambda x: x[:, :, :0]}, "blocks of shape"),
        ("dia", {"offsets": at(0, 99)}, "offsets go from"),
        ("dia", {"offsets": at(0, 0)}, "offsets, each once"),
        ("csr", {"shape": lambda x: x * 10**9}, r"its shape is \[6000000000"),
        ("csr", {"shape": lambda x: x.astype(float)}, "its shape is"),
        ("csr", {"format": lambda x: np.array("lil")}, "its format is 'lil', none of csr"),
        ("csr", {"format": lambda x: None}, "it has no array format"),
        ("csr", {"data": at(0, np.nan)}, "holds nan as values"),
        ("csr", {"data": at(0, 1e31)}, r"holds 1e\+31 as values"),
        ("csr", {"data": lambda x: -x}, "negative value on its diagonal"),
    ],
)
def test_damaged_sparse_matrices_are_refused(tmp_path, form, changes, message):
    path = damaged(tmp_path, form, **changes)
    with pytest.raises(ValueError, match=message) as caught:
        matrix_files.read(path, path)
    assert "K.npz" in str(caught.value)


def test_a_huge_array_in_the_place_of_a_shape_is_refused_at_once(tmp_path):
    path = damaged(tmp_path, "coo", shape=lambda shape: np.zeros(20_000_000, np.int8))
    began = time.perf_counter()
    with pytest.raises(ValueError, match=r"its shape is an array of shape \(20000000,\)"):
        matrix_files.read(path, path)
    assert time.perf_counter() - began < 5


def test_an_index_out_of_range_does_not_end_the_interpreter(tmp_path):
    path = damaged(tmp_path, "csc", indices=at(3, 2_000_000_000))
    script = (
        "import sys; from bayes_placement.io import matrix_files\n"
        "try: matrix_files.read(sys.argv[1], sys.argv[1])\n"
        "except ValueError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
    )
    assert "indices go from 0 to 2000000000 in a size of 6" in done.stdout


HEAD = "%%MatrixMarket matrix coordinate real general\n% a comment\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("no banner\n1 1 1\n1 1 2.0\n", "it begins with b'no banner"),
        (HEAD + "3 3 999999999999\n1 1 2.0\n", "announces 999999999999 values in"),
        (HEAD + "999999999999 3 1\n1 1 2.0\n", "its size is 999999999999 x 3"),
        (HEAD + "3 3\n1 1 2.0\n", "the line of its sizes is b'3 3'"),
        (HEAD, "no line of sizes"),
        (HEAD + "3 3 1\n9 1 2.0\n", "an index is none of 1 to 3 and 1 to 3"),
        (HEAD + "3 3 1\n0 1 2.0\n", "an index is none of 1 to 3"),
        (HEAD + "3 3 1\n1.5 1 2.0\n", "an index is none of 1 to 3"),
        (HEAD + "3 3 2\n1 1 2.0\n", "announces 2 lines of 3 numbers and holds 1 x 3"),
        (HEAD + "3 3 1\n1 1\n", "announces 1 lines of 3 numbers and holds 1 x 2"),
        (HEAD + "3 3 2\n1 1 2.0\n2 2\n", "the number of columns changed"),
        (HEAD + "3 3 1\n1 1 x2.0\n", "could not convert string 'x2.0'"),
        (HEAD.replace("general", "hermitian") + "1 1 1\n1 1 1.0\n", "it is hermitian, and gen"),
        (HEAD + "1 1 1\n1 1 1e300\n", r"holds 1e\+300 as values"),
    ],
)
def test_damaged_files_of_matrix_market_are_refused(tmp_path, content, message):
    path = tmp_path / "K.mtx"
    path.write_text(content)
    with pytest.raises(ValueError, match=message) as caught:
        matrix_files.read(path, path)
    assert "K.mtx" in str(caught.value)


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("kind", [np.asarray, scipy.sparse.coo_array])
@pytest.mark.parametrize("number", [float, int])
def test_files_of_matrix_market_come_back(tmp_path, symmetry, kind, number):
    values = np.round(dense()).astype(number) + np.eye(6, dtype=number)
    scipy.io.mmwrite(tmp_path / "K.mtx", kind(values), symmetry=symmetry, precision=17)
    read = matrix_files.read(tmp_path / "K.mtx", tmp_path / "K.mtx")
    assert np.array_equal(read.stiffness.toarray(), values)


def test_a_packed_file_that_unpacks_without_end_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(_gate.LIMITS, "bytes", 1000)
    path = tmp_path / "K.mtx.gz"
    scipy.io.mmwrite(tmp_path / "K.mtx", scipy.sparse.eye_array(200))
    path.write_bytes(gzip.compress((tmp_path / "K.mtx").read_bytes()))
    with pytest.raises(ValueError, match=r"K\.mtx\.gz .*unpacks to more than 1000 bytes"):
        matrix_files.read(path, path)


def test_the_command_line_says_one_sentence_of_a_truncated_matrix(tmp_path, shared_data):
    for folder in ("04_portal-01", "models/portal"):
        shutil.copytree(shared_data / "cases" / folder, tmp_path / folder)
    path = Path(tmp_path / "models" / "portal" / "K.npz")
    content = path.read_bytes()
    path.chmod(0o644)
    path.write_bytes(content[: len(content) // 2])
    done = CliRunner().invoke(app, ["check", str(tmp_path / "04_portal-01")])
    assert done.exit_code == 3
    assert done.output.startswith("error: ") and "K.npz" in done.output
    assert len(done.output.splitlines()) == 1
