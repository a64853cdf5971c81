"""Sheets of a workbook (.xlsx) as rows and as named arrays, by openpyxl."""

import contextlib
import io
import re
import warnings
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

from ..._shared.errors import InputError
from .._gate import check_limit, existing, reading
from .._npz_archive import fault_of_packing
from .named_arrays import NamedArrays
from .text import is_number, of_rows

if TYPE_CHECKING:
    from openpyxl.worksheet._read_only import ReadOnlyWorksheet

FORM = "a workbook"
_REMEDY = "Save it again as .xlsx, with numbers and texts only."


def load(path: Path) -> NamedArrays:
    """Read the columns of all sheets; those of further sheets are `sheet!column`."""
    with reading(path, FORM, _REMEDY):
        sheets = {title: rows for title, rows in read_sheets(path).items() if len(rows) > 1}
        tables: dict[str, NamedArrays] = {}
        left_out: dict[str, str] = {}
        for title, rows in sheets.items():
            try:
                tables[title] = of_rows(path, FORM, _heading(title, rows[0]), rows[1:], ())
            except InputError as error:  # such as a channel table, with empty cells
                left_out[f"sheet {title}"] = f"it is no table of numbers: {error}"
        if left_out and not tables:
            raise InputError(next(iter(left_out.values())))
        alone = len(tables) == 1
        return NamedArrays(
            path,
            FORM,
            {_name(t, n, alone): v for t, table in tables.items() for n, v in table.arrays.items()},
            {_name(t, n, alone): u for t, table in tables.items() for n, u in table.units.items()},
            left_out,
        )


def _name(sheet: str, column: str, alone: bool) -> str:
    return column if alone else f"{sheet}!{column}"


def read_sheets(path: Path) -> dict[str, list[list[str]]]:
    """Rows of each sheet as texts; empty rows, and empty columns at the end, are left out.

    A formula is what it was when the workbook was saved.
    """
    import openpyxl

    with (
        reading(path, FORM, _REMEDY),
        warnings.catch_warnings(),
        contextlib.redirect_stdout(io.StringIO()),  # openpyxl prints where it finds a wrong style
    ):
        warnings.simplefilter("ignore")  # of styles and extensions that are not read
        _check_archive(existing(path, FORM))
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        try:
            return {sheet.title: _rows(sheet) for sheet in book.worksheets}
        finally:
            book.close()


def _rows(sheet: "ReadOnlyWorksheet") -> list[list[str]]:
    sheet.reset_dimensions()  # which a file may state wrongly
    rows, count = [], 0
    for number, row in enumerate(sheet.iter_rows(values_only=True), start=1):
        cells = [_cell(value) for value in row]
        count += len(cells)
        check_limit("cells of a workbook", count)
        check_limit("rows of a workbook", number)
        if any(cells):
            rows.append(cells)
    width = max((n for row in rows for n, cell in enumerate(row, start=1) if cell), default=0)
    return [[*row[:width], *[""] * (width - len(row))] for row in rows]


def _cell(value: object) -> str:
    if isinstance(value, float | int) and not isinstance(value, bool):
        return repr(value)
    return "" if value is None else str(value).strip()


def _heading(title: str, row: list[str]) -> list[str]:
    if any(is_number(cell) or not cell for cell in row):
        raise InputError(
            f"the first row of the sheet {title!r} names no columns: it holds {row[:8]}"
        )
    return row


_ENCODING = re.compile(rb"<\?xml[^<>]*encoding\s*=\s*[\"']([^\"']*)")
_ENCODINGS = (b"utf-8", b"utf-16", b"us-ascii")
_ENTITIES = re.compile(rb"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)


def _check_archive(path: Path) -> None:
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
    fault = fault_of_packing(member, "workbooks do")
    if fault:
        raise InputError(f"its member {name!r} {fault}")
