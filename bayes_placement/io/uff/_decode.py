"""Datasets of a universal file as fields by name, once the gate found nothing wrong with them.

Columns are those of the descriptions of SDRC and of the University of Cincinnati; names of fields
are those of pyuff.
"""

import re
from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ._gate import (
    COMPLEX,
    HEAD_LINES,
    LAYOUT,
    NORMAL,
    REAL,
    columns,
    lines_of_node,
    value_widths,
    words_of_node,
)

_NO_LETTER = re.compile(r"(?<=[\d.])(?=[+-]\d{3}$)")  # Fortran leaves it out before three digits
_KINDS = (
    "model_type",
    "analysis_type",
    "data_ch",
    "spec_data_type",
    "data_type",
    "n_data_per_node",
)
_AXES = {7: "abscissa", 8: "ordinate", 9: "orddenom"}
_ENDS = {
    "func_type": (0, 5),
    "rsp_node": (41, 51),
    "rsp_dir": (51, 55),
    "ref_node": (66, 76),
    "ref_dir": (76, 80),
}
_DIMENSIONS = ("len", "force", "temp")

Lines = Sequence[str]
Fields = dict[str, Any]


class Binary(NamedTuple):
    """Values of a binary dataset: bytes, and their order, `<` or `>`."""

    content: bytes
    order: str


def real(text: str) -> float:
    """Return a number that Fortran wrote; blanks are zero."""
    plain = text.strip().upper().replace("D", "E")
    return float(_NO_LETTER.sub("E", plain) or 0.0)


def _integer(text: str) -> int:
    return int(text.strip() or 0)


def function_head(lines: Lines) -> Fields:
    """Fields of the eleven lines before the values of a function (dataset 58)."""
    fields: Fields = {f"id{number}": lines[number - 1].strip() for number in range(1, 6)}
    line = lines[5].ljust(80)
    fields |= {name: _integer(line[low:high]) for name, (low, high) in _ENDS.items()}
    form = columns(lines[6].ljust(80), (10, 10, 10, 13, 13))
    fields["ord_data_type"], fields["num_pts"], fields["abscissa_spacing"] = map(_integer, form[:3])
    fields["abscissa_min"], fields["abscissa_inc"] = map(real, form[3:])
    for number, side in _AXES.items():
        kind, *exponents = columns(lines[number].ljust(80), (10, 5, 5, 5))
        fields[f"{side}_spec_data_type"] = _integer(kind)
        for dimension, text in zip(_DIMENSIONS, exponents, strict=True):
            fields[f"{side}_{dimension}_unit_exp"] = _integer(text)
        fields[f"{side}_axis_units_lab"] = lines[number][46:66].strip()
    return fields


def function(lines: Lines, binary: Binary | None = None) -> Fields:
    """Fields of a function, with its abscissa `x` and its values `data`."""
    fields = function_head(lines)
    kind, even = fields["ord_data_type"], fields["abscissa_spacing"]
    size, parts = LAYOUT[kind]
    if binary is not None:
        values = np.frombuffer(binary.content, f"{binary.order}f{size}").astype(float)
    else:
        widths = value_widths(kind, even)
        texts = chain.from_iterable(columns(line, widths) for line in lines[HEAD_LINES:])
        values = np.array([real(text) for text in texts if text.strip()])
    rows = values.reshape(fields["num_pts"], -1)
    steps = fields["abscissa_min"] + fields["abscissa_inc"] * np.arange(len(rows))
    ordinate = rows[:, rows.shape[1] - parts :]
    data = ordinate[:, 0] + 1j * ordinate[:, 1] if parts == 2 else ordinate[:, 0]
    return fields | {"x": steps if even else rows[:, 0], "data": data}


def _nodes(words: list[list[str]]) -> Fields:
    """Fields of nodes, from number, two coordinate systems, colour and three coordinates."""
    names = ("node_nums", "def_cs", "disp_cs", "color", "x", "y", "z")
    table = [[*map(int, row[:4]), *map(real, row[4:])] for row in words]
    return dict(zip(names, zip(*table, strict=True) if table else [()] * len(names), strict=True))


def _nodes_15(lines: Lines) -> Fields:
    return _nodes([words_of_node(line) for line in lines if line.strip()])


def _nodes_2411(lines: Lines) -> Fields:
    stated = [line.split() for line in lines if line.strip()]
    return _nodes([first + second for first, second in zip(stated[::2], stated[1::2], strict=True)])


def _units_164(lines: Lines) -> Fields:
    length, force, temperature, offset = map(real, " ".join(lines[1:]).split())
    return {"length": length, "force": force, "temp": temperature, "temp_offset": offset}


def _data_at_nodes(lines: Lines) -> Fields:
    """Fields of dataset 55; of other results than modes their kinds alone."""
    fields: Fields = {f"id{number}": lines[number - 1].strip() for number in range(1, 6)}
    fields |= dict(zip(_KINDS, map(_integer, columns(lines[5].ljust(80), (10,) * 6)), strict=True))
    if fields["analysis_type"] not in (NORMAL, *COMPLEX):
        return fields
    numbers = columns(lines[6].ljust(80), (10,) * 4)
    fields["load_case"], fields["mode_n"] = map(_integer, numbers[2:])
    reals = list(map(real, columns(lines[7].ljust(80), (13,) * 6)))
    if fields["analysis_type"] == NORMAL:
        fields |= dict(zip(("freq", "modal_m", "modal_damp_vis"), reals, strict=False))
    else:
        fields |= {"eig": complex(*reals[:2]), "modal_a": complex(*reals[2:4])}
    return fields | _records(lines[8:], fields)


def _records(lines: Lines, fields: Fields) -> Fields:
    """Numbers of the nodes, and each of their values as an array `r1`, `r2` and so on."""
    count, data_type = fields["n_data_per_node"], fields["data_type"]
    step = 1 + lines_of_node(count, data_type)
    rows = [lines[place + 1 : place + step] for place in range(0, len(lines), step)]
    texts = [chain.from_iterable(columns(line, (13,) * 6) for line in row) for row in rows]
    values = np.array([[real(text) for text in row if text.strip()] for row in texts])
    values = values.reshape(len(rows), -1)
    if data_type != REAL:
        values = values[:, ::2] + 1j * values[:, 1::2]
    nodes = np.array([_integer(line) for line in lines[::step]], dtype=np.int64)
    return {"node_nums": nodes} | {f"r{k + 1}": values[:, k] for k in range(count)}


DECODERS: dict[int, Callable[[Lines], Fields]] = {
    15: _nodes_15,
    2411: _nodes_2411,
    164: _units_164,
    58: function,
    55: _data_at_nodes,
}
"""Decoders of datasets as text, from the lines after the one with the number."""
