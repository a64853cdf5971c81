"""Arrays of an .npz file; stated sizes are checked against the bytes, and pickles are refused."""

import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from .._shared.errors import InputError
from ._gate import existing
from ._limits import check_limit

_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED, _PATCHED, _STRONG = 0x1, 0x20, 0x40
_GREATEST_RATIO = 1100  # deflate packs 1032 bytes into one at most
_CHUNK = 1 << 20
_KINDS = "biufcSU"  # numbers and texts; objects are pickles


class NpzArchive:
    """An .npz file: named arrays, read one at a time.

    Refused is what is no archive of arrays, and a member that is packed in another way than NumPy
    packs, is encrypted, occurs twice or announces more bytes than it can hold.
    """

    def __init__(self, path: Path, contents: str):
        self.path, self.contents = existing(path, f"a .npz file of {contents}"), contents
        with path.open("rb") as handle:
            members = self._directory(handle)
        self._members = {member.filename.removesuffix(".npy"): member for member in members}

    @property
    def names(self) -> list[str]:
        """Names of the arrays."""
        return list(self._members)

    def array(self, name: str) -> np.ndarray:
        """Read an array of numbers or text that has as many bytes as it announces."""
        try:
            with zipfile.ZipFile(self.path) as archive, archive.open(self._members[name]) as stream:
                return array_in(stream, self._members[name].file_size)
        except Exception as error:  # damaged archives raise any exception
            raise self._refused(f"array {name}: {error}") from error

    def _directory(self, handle: BinaryIO) -> list[zipfile.ZipInfo]:
        if handle.read(6) == npy.MAGIC_PREFIX:
            raise self._refused("it is a single array")
        try:
            with zipfile.ZipFile(handle) as archive:
                members = archive.infolist()
        except Exception as error:  # damaged archives raise any exception
            raise self._refused(str(error)) from error
        for member in members:
            reason = _fault(member)
            if reason:
                raise self._refused(f"its member {member.filename!r} {reason}")
        check_limit("unpacked bytes of a NumPy archive", sum(m.file_size for m in members))
        names = [member.filename for member in members]
        if len(set(names)) < len(names):
            raise self._refused("one of its members occurs twice, and either could be meant")
        return members

    def _refused(self, reason: str) -> InputError:
        return InputError(
            f"{self.path} cannot be read as .npz ({reason}); named arrays are needed, for "
            f"{self.contents}. Write them again with numpy.savez, or copy the file once more."
        )


def _fault(member: zipfile.ZipInfo) -> str:
    """Why a member is not read; empty where it is."""
    if not member.filename.endswith(".npy") or set("/\\") & set(member.filename):
        return "is no array (.npy)"
    if member.compress_type not in _PACKINGS:
        return "is packed in a way that numpy does not use"
    if member.flag_bits & (_ENCRYPTED | _PATCHED | _STRONG):
        return "is encrypted or patched"
    if member.file_size > _GREATEST_RATIO * (member.compress_size + 1):
        return f"announces {member.file_size} bytes in {member.compress_size} packed ones"
    return ""


def array_in(stream: Any, size: int) -> np.ndarray:
    """Read the array of a .npy file of so many bytes, once its header agrees with them."""
    version = npy.read_magic(stream)
    read_header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    if version not in read_header:
        raise InputError(f"version {version} of its header is not known")
    shape, fortran, kind = read_header[version](stream)
    if kind.kind not in _KINDS:
        what = "pickled objects" if kind.kind == "O" else str(kind)
        raise InputError(f"it holds {what}, which are neither numbers nor text")
    if any(type(length) is not int or length < 0 for length in shape):
        raise InputError(f"its shape is {shape}")
    count = 1
    for length in shape:
        count *= length
    announced = count * kind.itemsize
    if announced > size:
        raise InputError(f"it announces {announced} bytes and holds less than {size}")
    flat = np.empty(count, dtype=kind)
    filled = _filled(flat.view(np.uint8), stream) if announced else 0
    if filled < announced or stream.read(1):  # at the end of the member its checksum is compared
        raise InputError(f"it announces {announced} bytes and holds {filled} or more")
    return flat.reshape(shape, order="F" if fortran else "C")


def _filled(content: np.ndarray, stream: Any) -> int:
    """Read bytes into an array, and return how many there were."""
    view, filled = memoryview(content), 0  # type: ignore[arg-type]
    while filled < len(view):
        count = stream.readinto(view[filled : filled + _CHUNK])
        if not count:
            break
        filled += count
    return filled
