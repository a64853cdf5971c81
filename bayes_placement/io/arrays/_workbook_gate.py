"""Checks of a workbook, a zip of XML: its sizes are counted before anything is read."""

import re
import zipfile
from pathlib import Path

from ..._shared.errors import InputError
from .._limits import check_limit

_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED, _PATCHED, _STRONG = 0x1, 0x20, 0x40
_GREATEST_RATIO = 1100  # deflate packs 1032 bytes into one at most
_ENCODING = re.compile(rb"<\?xml[^<>]*encoding\s*=\s*[\"']([^\"']*)")
_ENCODINGS = (b"utf-8", b"utf-16", b"us-ascii")
_ENTITIES = re.compile(rb"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)


def check(path: Path) -> None:
    """Refuse a workbook whose members are packed otherwise, too large, or define entities.

    Every member is read to its end, where its checksum is compared.
    """
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        names = [member.filename for member in members]
        if len(set(names)) < len(names):
            raise InputError("one of its members occurs twice, and either could be meant")
        total = sum(member.file_size for member in members)
        check_limit("unpacked bytes of a workbook", total)
        for member in members:
            _check_member(member)
            _check_text(member.filename, archive.read(member))


def _check_text(name: str, content: bytes) -> None:
    """Refuse entities, and encodings in which they would not be seen."""
    plain = content.replace(b"\0", b"")  # of UTF-16
    if _ENTITIES.search(plain):
        raise InputError(f"its member {name!r} defines entities")
    encoding = _ENCODING.search(plain)
    if encoding and encoding[1].lower() not in _ENCODINGS:
        raise InputError(f"its member {name!r} is not encoded in UTF-8 or UTF-16")


def _check_member(member: zipfile.ZipInfo) -> None:
    name = member.filename
    if name.startswith("/") or ".." in Path(name).parts or "\\" in name:
        raise InputError(f"its member {name!r} leads out of it")
    if member.compress_type not in _PACKINGS:
        raise InputError(f"its member {name!r} is packed in a way that workbooks do not use")
    if member.flag_bits & (_ENCRYPTED | _PATCHED | _STRONG):
        raise InputError(f"its member {name!r} is encrypted or patched")
    if member.file_size > _GREATEST_RATIO * (member.compress_size + 1):
        raise InputError(
            f"its member {name!r} announces {member.file_size} bytes in {member.compress_size}"
        )
