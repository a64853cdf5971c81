"""What a file is, by its first bytes: suffixes are wrong too often."""

import codecs
import re
import zipfile
from pathlib import Path

UNIVERSAL, MAT, MAT_HDF5, HDF5 = "universal file", "MATLAB 5 to 7", "MATLAB 7.3", "HDF5"
NPZ, WORKBOOK, TEXT = "NumPy archive", "workbook", "text"
MATRIX_MARKET, ABAQUS_MATRIX, PDF = "Matrix Market", "Abaqus matrix", "PDF"
NPY, NETCDF_3, CALCULIX = "NumPy array", "netCDF 3", "CalculiX results"
WAV, TDMS, MDF, LABVIEW = "WAV", "TDMS", "MDF", "LabVIEW text"
UNKNOWN = ""
WIDE = "text in UTF-16 or UTF-32, which an editor saves as UTF-8"

_ARRAYS = "bp.io.read(path, mapping) for FRFs, bp.time_records.read(path, channels) for records"
_RECORDS = "bp.time_records.read(path, channels) as time records (then frf_of makes FRFs)"
READERS = {
    UNIVERSAL: "bp.io.read for FRFs, bp.time_records.read for time histories, bp.io.read_modes for "
    "modes of a model, bp.io.modal_parameters.read for measured ones, bp.io.mesh.read for meshes",
    MAT: f"{_ARRAYS}, bp.io.modal_parameters.read for modes, bp.io.read_matrices for K and M",
    MATRIX_MARKET: "bp.io.read_matrices(stiffness, mass)",
    NETCDF_3: "bp.io.mesh.read, where it is a mesh (Exodus)",
    CALCULIX: "bp.io.mesh.read",
    **dict.fromkeys((MAT_HDF5, HDF5, NPZ, NPY, WORKBOOK, TEXT), _ARRAYS),
    **dict.fromkeys((WAV, TDMS, MDF, LABVIEW), _RECORDS),
}
"""What reads a file, by what it is."""

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HDF5_OFFSETS = (0, 512, 1024, 2048)  # behind a user block
_MAT_VERSIONS = (b"\x00\x01IM", b"\x01\x00MI")
_BEGINNINGS = {
    b"    -1": UNIVERSAL,
    b"%%MatrixMarket": MATRIX_MARKET,
    b"%PDF-": PDF,
    b"\x93NUMPY": NPY,
    b"CDF\x01": NETCDF_3,
    b"CDF\x02": NETCDF_3,
    b"    1C": CALCULIX,
    b"    2C": CALCULIX,
    **dict.fromkeys((b"RIFF", b"RIFX", b"RF64"), WAV),
    b"TDSm": TDMS,
    b"MDF ": MDF,
    b"LabVIEW Measurement": LABVIEW,
}
_WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_ABAQUS = re.compile(
    rb"(?:\s*\*[^\n]*\n)*\s*(?:\d+\s*,\s*){4}[-+\d.eEdD]+\s*\r?\n"
)  # comments, entry
HEAD_BYTES = 4096
_CONTROLS = set(range(32)) - {9, 10, 12, 13, 26}


def content_of(path: Path) -> str:
    """Return what a file is, one of the names of this module; empty where it is not known."""
    head = _head(path)
    for beginning, content in _BEGINNINGS.items():
        if head.lstrip(b"\r\n").startswith(beginning):
            return content
    if any(head[offset:].startswith(_HDF5_SIGNATURE) for offset in _HDF5_OFFSETS):
        return MAT_HDF5 if head.startswith(b"MATLAB 7.3") else HDF5
    if head[124:128] in _MAT_VERSIONS:
        return MAT
    if head.startswith(b"PK\x03\x04"):
        return _content_of_zip(path)
    text = decoded(head)
    if not head or _CONTROLS & set(map(ord, text)):
        return UNKNOWN
    if text.startswith("LabVIEW Measurement"):  # behind a mark of UTF-8 or UTF-16
        return LABVIEW
    return ABAQUS_MATRIX if _ABAQUS.match(head.lstrip()) else TEXT


def head_of(path: Path) -> str:
    """Return the beginning of a file as text."""
    return decoded(_head(path))


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEAD_BYTES)


def is_wide(data: bytes) -> bool:
    """Whether the beginning of a file is text of two or four bytes a letter, marked or not."""
    letters = data.replace(b"\0", b"")
    has_gaps = 0 < 2 * len(letters) <= len(data) + 1 and letters.isascii()
    return data.startswith(_WIDE) or (has_gaps and not _CONTROLS & {*letters})


def decoded(data: bytes) -> str:
    """Text of bytes in UTF-8, in UTF-16 with its mark, or else in Latin-1."""
    if data.startswith(_WIDE):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def described(path: Path) -> str:
    """Say what a file is, and what reads it."""
    if not path.stat().st_size:
        return "is empty (0 bytes)"
    content = content_of(path)
    if content == UNKNOWN and is_wide(_head(path)):
        return f"is {WIDE}"
    if content == PDF:
        return "is a PDF, whose pages hold no arrays"
    if content not in READERS:
        return "is in no format that is known by its first bytes"
    return f"is {content} by its first bytes, which is read by {READERS[content]}"


def _content_of_zip(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except Exception:  # noqa: BLE001, damaged archives raise any exception
        return UNKNOWN
    if "[Content_Types].xml" in names and any(name.startswith("xl/") for name in names):
        return WORKBOOK
    return NPZ if names and all(name.endswith(".npy") for name in names) else UNKNOWN
