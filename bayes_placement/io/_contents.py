"""What a file is, by its first bytes: suffixes are wrong too often."""

import re
import zipfile
from pathlib import Path

UNIVERSAL, MAT, MAT_HDF5, HDF5 = "universal file", "MATLAB 5 to 7", "MATLAB 7.3", "HDF5"
NPZ, WORKBOOK, TEXT = "NumPy archive", "workbook", "text"
MATRIX_MARKET, ABAQUS_MATRIX, PDF = "Matrix Market", "Abaqus matrix", "PDF"
UNKNOWN = ""

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HDF5_OFFSETS = (0, 512, 1024, 2048)  # behind a user block
_MAT_VERSIONS = (b"\x00\x01IM", b"\x01\x00MI")
_BEGINNINGS = {b"    -1": UNIVERSAL, b"%%MatrixMarket": MATRIX_MARKET, b"%PDF-": PDF}
_ABAQUS = re.compile(
    rb"(?:\s*\*[^\n]*\n)*\s*(?:\d+\s*,\s*){4}[-+\d.eEdD]+\s*\r?\n"
)  # comments, entry
HEAD_BYTES = 4096
_CONTROLS = set(range(32)) - {9, 10, 12, 13, 26}


def content_of(path: Path) -> str:
    """Return what a file is, one of the names of this module; empty where it is not known."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    for beginning, content in _BEGINNINGS.items():
        if head.lstrip(b"\r\n").startswith(beginning):
            return content
    if any(head[offset:].startswith(_HDF5_SIGNATURE) for offset in _HDF5_OFFSETS):
        return MAT_HDF5 if head.startswith(b"MATLAB 7.3") else HDF5
    if head[124:128] in _MAT_VERSIONS:
        return MAT
    if head.startswith(b"PK\x03\x04"):
        return _content_of_zip(path)
    if not head or _CONTROLS & set(head):
        return UNKNOWN
    return ABAQUS_MATRIX if _ABAQUS.match(head.lstrip()) else TEXT


def _content_of_zip(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except Exception:  # noqa: BLE001, damaged archives raise any exception
        return UNKNOWN
    if "[Content_Types].xml" in names and any(name.startswith("xl/") for name in names):
        return WORKBOOK
    return NPZ if names and all(name.endswith(".npy") for name in names) else UNKNOWN
