"""Formats of files by what they hold: a format is a reader in its own file and a line here."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from ..experiment.measurement import Measurement
from ..modes.finite_elements.modal_model import ModalModel
from . import _contents as content
from ._gate import existing, path_of
from .matrix_files import SystemMatrices


@with_short_repr
class Format(NamedTuple):
    """A format of files.

    Parameters
    ----------
    contents
        What its files hold: `measurement`, `modes` or `matrices`.
    suffixes
        Endings of its files, in lower case.
    reader
        Function in this room that reads a file: `uff.read`.
    options
        Arguments of that function where the caller does not give them.
    content
        What its bytes tell that it is, a name of `io._contents`; they have the last word over the
        suffix. Empty where only the suffix tells.

    Examples
    --------
    >>> bp.io.formats.Format("measurement", (".uff", ".unv"), "uff.read").suffixes
    ('.uff', '.unv')
    """

    contents: str
    suffixes: tuple[str, ...]
    reader: str
    options: Mapping[str, object] = {}
    content: str = ""

    def read(self, path: Path, *others: object, **options: object) -> Any:
        """Read a file; modules of formats are imported here, not before."""
        module, function = self.reader.rsplit(".", 1)
        reader = getattr(importlib.import_module(f".{module}", __package__), function)
        return reader(path, *others, **{**self.options, **options})


UNIVERSAL = (".uff", ".unv", ".bunv", ".uf")

FORMATS = [
    Format("measurement", UNIVERSAL, "uff.read", {"require_positions": False}, content.UNIVERSAL),
    Format("measurement", (".mat",), "mapped.read_measurement", {}, content.MAT),
    Format("measurement", (), "mapped.read_measurement", {}, content.MAT_HDF5),
    Format("measurement", (".npz",), "mapped.read_measurement", {}, content.NPZ),
    Format("measurement", (".h5", ".hdf5"), "mapped.read_measurement", {}, content.HDF5),
    Format("measurement", (".xlsx",), "mapped.read_measurement", {}, content.WORKBOOK),
    Format("measurement", (".toml",), "mapped.read_measurement"),
    Format("measurement", (".csv", ".tsv", ".txt"), "mapped.read_measurement", {}, content.TEXT),
    Format("modes", UNIVERSAL, "uff.read_modes", {}, content.UNIVERSAL),
    Format("modes", (".npz",), "npz_modes.read", {}, content.NPZ),
    Format("modes", (".op2",), "nastran.read_modes"),
    Format("matrices", (".op4",), "nastran.read_matrices"),
    Format("matrices", (".full",), "ansys.read_matrices"),
    Format("matrices", (".inp",), "abaqus.read_matrices", {}, content.ABAQUS_MATRIX),
    Format("matrices", (".npz", ".mtx", ".mtx.gz"), "matrix_files.read", {}, content.MATRIX_MARKET),
    Format("matrices", (".mat",), "matrix_files.read", {}, content.MAT),
    Format("matrices", (), "matrix_files.read", {}, content.MAT_HDF5),
]


@arguments_checked
def read_measurement(path: str | Path, **options: object) -> Measurement:
    """Read measured FRFs in SI.

    Recorded positions are read as far as the file has them, since an experiment states its own.

    Parameters
    ----------
    path
        The file; its bytes, or else its suffix, tell the format.
    **options
        Arguments of the reader of that format.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If its format is not known, or the reader refuses the file.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.read_measurement("measured.uff").quantity
    'mobility'
    """
    return _read("measurement", path_of(path), **options)


@arguments_checked
def read_modes(path: str | Path, **options: object) -> ModalModel:
    """Read nodes and natural modes in SI.

    Parameters
    ----------
    path
        The file; its bytes, or else its suffix, tell the format.
    **options
        Arguments of the reader of that format, such as `modal_mass`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If its format is not known, or the reader refuses the file.

    Examples
    --------
    >>> path = bp.io.npz_modes.write("modes.npz", plane)
    >>> bp.io.read_modes("modes.npz").natural_frequency
    array([120., 300.])
    """
    return _read("modes", path_of(path), **options)


@arguments_checked
def read_matrices(path: str | Path, *others: str | Path, **options: object) -> SystemMatrices:
    """Read stiffness and mass in SI.

    Parameters
    ----------
    path
        The file, or that of the stiffness where each matrix has a file; its suffix tells the
        format.
    *others
        File of the mass, where each matrix has a file.
    **options
        Arguments of the reader of that format, such as `regions`.

    Returns
    -------
    SystemMatrices
        `stiffness`, `mass`, and `dof` and `regions` where the file states them.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If its format is not known, or the reader refuses the file.

    Examples
    --------
    >>> import scipy.sparse
    >>> for name, matrix in (("K.npz", matrices.stiffness), ("M.npz", matrices.mass)):
    ...     scipy.sparse.save_npz(name, matrix)
    >>> bp.io.read_matrices("K.npz", "M.npz").stiffness.shape
    (10, 10)
    """
    return _read("matrices", path_of(path), *others, **options)


def _read(contents: str, path: Path, *others: object, **options: object) -> Any:
    """Read a file that is to hold a measurement, modes or matrices."""
    needed = f"a file with {'a measurement' if contents == 'measurement' else contents}"
    existing(path, needed)
    formats = [known for known in FORMATS if known.contents == contents]
    chosen = _by_content(formats, path) or _by_suffix(formats, path)
    if chosen is not None:
        return chosen.read(path, *others, **options)
    suffixes = dict.fromkeys(suffix for known in formats for suffix in known.suffixes)
    raise InputError(
        f"{path} {content.described(path)}; {needed} is needed here, by its first bytes or by its "
        f"suffix, {', '.join(suffixes)}. Rename the file, or read it with the "
        f"function of its format, such as bp.io.{formats[0].reader}(path)."
    )


def _by_content(formats: list[Format], path: Path) -> Format | None:
    """Format by the first bytes; formats of text by their suffix, where there is one."""
    file_content = content.content_of(path)
    if file_content in (content.TEXT, content.ABAQUS_MATRIX):
        known = _by_suffix(formats, path)  # of text, or told by its suffix alone
        if known is not None and known.content in ("", content.TEXT, content.UNIVERSAL):
            return None
    return next(
        (known for known in formats if file_content and known.content == file_content), None
    )


def _by_suffix(formats: list[Format], path: Path) -> Format | None:
    name = path.name.lower()
    return next((known for known in formats if name.endswith(known.suffixes)), None)
