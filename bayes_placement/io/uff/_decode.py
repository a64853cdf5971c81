"""Datasets of a universal file as fields by name, each of them checked in its columns.

Columns are those of the descriptions of SDRC and of the University of Cincinnati; names of fields
are those of pyuff.
"""

import re
from collections.abc import Callable, Sequence
from itertools import accumulate, chain, pairwise
from typing import Any

import numpy as np

INTEGER = re.compile(r"\s*[+-]?\d+\s*|\s*", re.ASCII)
"""A whole number in its columns, or blanks, which stand for zero."""

NUMBER = re.compile(r"\s*[+-]?(\d++\.?\d*+|\.\d++)([eEdD][+-]?\d++|[+-]\d{3})?\s*", re.ASCII)
"""A real number in its columns; Fortran has no letter before an exponent of three digits."""

_NO_LETTER = re.compile(r"(?<=[\d.])(?=[+-]\d{3}$)")
_INTEGER_WORD = re.compile(r"[+-]?\d{1,17}|\d{18}", re.ASCII)  # an integer of 64 bits holds it

HEAD_LINES = 11
REAL, _OF_TWO_PARTS = 2, 5
NORMAL, COMPLEX = 2, (3, 7)
"""Analysis types of modes: real ones, and complex ones of the first and of the second order."""

LAYOUT = {2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)}
"""Bytes of a number and numbers of an ordinate, by the ordinate data type of dataset 58."""

_UNUSED = {
    "func_id": ("function number", 5, 15),
    "ver_num": ("version", 15, 20),
    "load_case_id": ("load case", 20, 30),
}
_STATED = {
    "func_type": ("function type", 0, 5),
    "rsp_node": ("response node", 41, 51),
    "rsp_dir": ("response direction", 51, 55),
    "ref_node": ("reference node", 66, 76),
    "ref_dir": ("reference direction", 76, 80),
}
_ENTITIES = {"rsp_ent_name": slice(31, 41), "ref_ent_name": slice(56, 66)}
_FORM = {
    "ord_data_type": ("ordinate type", 0, 10),
    "num_pts": ("count", 10, 20),
    "abscissa_spacing": ("spacing", 20, 30),
}
_STEPS = {"abscissa_min": ("first abscissa", 30, 43), "abscissa_inc": ("abscissa step", 43, 56)}
_AXES = {7: "abscissa", 8: "ordinate", 9: "orddenom"}
_AXIS = ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
_KINDS = (
    "model_type",
    "analysis_type",
    "data_ch",
    "spec_data_type",
    "data_type",
    "n_data_per_node",
)
_NODE = ("node_nums", "def_cs", "disp_cs", "color", "x", "y", "z")

Lines = Sequence[str]
Fields = dict[str, Any]


class FormatError(Exception):
    """What is against the format: the line of the dataset, from 1, and a sentence without end."""


def columns(line: str, widths: Sequence[int]) -> list[str]:
    """Cut a line into fields of some widths."""
    return [line[low:high] for low, high in pairwise([0, *accumulate(widths)])]


def real(text: str) -> float:
    """Return a number that Fortran wrote; blanks are zero."""
    plain = text.strip().upper().replace("D", "E")
    return float(_NO_LETTER.sub("E", plain) or 0.0)


def _integer(text: str) -> int:
    return int(text.strip() or 0)


def _cells(line: str, *widths: int) -> list[str]:
    return columns(line.ljust(80), widths)


def _titles(lines: Lines) -> Fields:
    return {f"id{number}": lines[number - 1].strip() for number in range(1, 6)}


def _in_columns(
    lines: Lines, number: int, fields: dict[str, tuple[str, int, int]], noun: str = "whole number"
) -> Fields:
    """Fields of a line, of which each is in its columns."""
    line, values = lines[number].ljust(80), {}
    is_integer = noun == "whole number"
    for key, (name, low, high) in fields.items():
        text = line[low:high]
        if not (INTEGER if is_integer else NUMBER).fullmatch(text):
            what = f"the {name} (columns {low + 1} to {high}) is {text!r}, no {noun}"
            raise FormatError(number + 1, what)
        values[key] = _integer(text) if is_integer else real(text)
    return values


def function_head(lines: Lines) -> Fields:
    """Fields of the eleven lines before the values of a function (dataset 58)."""
    if len(lines) < HEAD_LINES:
        raise FormatError(len(lines), "its head has less than eleven lines")
    fields = _titles(lines) | _in_columns(lines, 5, _STATED | _UNUSED)
    _check_gaps(lines[5].ljust(80))
    fields |= {key: lines[5][columns].strip() for key, columns in _ENTITIES.items()}
    fields |= _in_columns(lines, 6, _FORM) | _in_columns(lines, 6, _STEPS, "number")
    for number, side in _AXES.items():
        cells = _cells(lines[number], 10, 5, 5, 5)
        wrong = [text for text in cells if not INTEGER.fullmatch(text)]
        if wrong:
            name = side.replace("orddenom", "ordinate denominator")
            raise FormatError(number + 1, f"a type or unit exponent of the {name} is {wrong[0]!r}")
        keys = [f"{side}_{key}" for key in _AXIS]
        fields |= dict(zip(keys, map(_integer, cells), strict=True))
        fields[f"{side}_axis_units_lab"] = lines[number][46:66].strip()
    return fields


def _check_gaps(line: str) -> None:
    """Refuse record 6 where it is shifted by a column: its numbers then end in the gaps."""
    for name, low, high in _STATED.values():
        field = f"the {name} (columns {low + 1} to {high})"
        if not line[low:high].strip():
            raise FormatError(6, f"{field} is blank")
        if line[high - 1].isspace():
            raise FormatError(6, f"{field} ends before its columns do")
    if line[80:].strip():
        raise FormatError(6, f"{line[80:].strip()!r} stands behind its last field")
    for column in (30, 55):
        if line[column].strip():
            raise FormatError(6, f"column {column + 1} between two fields holds {line[column]!r}")


def function(lines: Lines, content: bytes | None = None, order: str = "<") -> Fields:
    """Fields of a function, with its abscissa `x` and its values `data`.

    Binary values are bytes of an order, `<` or `>`.
    """
    fields = function_head(lines)
    if content is None:
        values = np.array(_values(lines[HEAD_LINES:], fields))
    else:
        size = LAYOUT[fields["ord_data_type"]][0]
        values = np.frombuffer(content, f"{order}f{size}").astype(float)
    parts = LAYOUT[fields["ord_data_type"]][1]
    rows = values.reshape(fields["num_pts"], -1)
    steps = fields["abscissa_min"] + fields["abscissa_inc"] * np.arange(len(rows))
    ordinate = rows[:, rows.shape[1] - parts :]
    data = ordinate[:, 0] + 1j * ordinate[:, 1] if parts == 2 else ordinate[:, 0]
    return fields | {"x": steps if fields["abscissa_spacing"] else rows[:, 0], "data": data}


def _values(lines: Lines, fields: Fields) -> list[float]:
    """Values of dataset 58 as text."""
    kind, count, even = (fields[key] for key in _FORM)
    if kind not in LAYOUT or even not in (0, 1) or count < 1:
        what = f"type {kind}, count {count} and spacing {even} are not those of values"
        raise FormatError(7, what)
    values, widths = list[float](), _value_widths(kind, even)
    for number, line in enumerate(lines, start=HEAD_LINES + 1):
        texts = [text for text in columns(line, widths) if text.strip()]
        for text in texts:
            if not NUMBER.fullmatch(text):
                raise FormatError(number, f"{text!r} is no number in its columns")
        if surplus := line[sum(widths) :].strip():
            raise FormatError(number, f"{surplus!r} stands behind them")
        if len(line.rstrip()) not in (0, *accumulate(widths)):
            raise FormatError(number, "its last number is cut off")
        values += map(real, texts)
    announced = count * (LAYOUT[kind][1] + (even == 0))
    if len(values) != announced:
        raise FormatError(7, f"{announced} numbers are announced and {len(values)} are there")
    return values


def _value_widths(kind: int, even: int) -> tuple[int, ...]:
    """Widths of the numbers of a line, by ordinate type and spacing."""
    if kind in (2, 5):
        return (13,) * 6
    if even:
        return (20,) * 4
    return (13, 20, 20) if kind == 6 else (13, 20, 13, 20)


def _free(number: int, words: Sequence[str], integers: int, reals: int) -> list[int | float]:
    """Numbers of a line in free columns: so many whole ones, then so many real ones."""
    if len(words) != integers + reals:
        what = f"{integers + reals} numbers are needed and {len(words)} are there"
        raise FormatError(number, what)
    for place, word in enumerate(words):
        is_integer = place < integers
        if not (_INTEGER_WORD if is_integer else NUMBER).fullmatch(word):
            raise FormatError(number, f"{word!r} is no {'whole ' if is_integer else ''}number")
    return [*map(int, words[:integers]), *map(real, words[integers:])]


def _nodes(rows: list[list[int | float]]) -> Fields:
    """Fields of nodes, from number, two coordinate systems, colour and three coordinates."""
    table = zip(*rows, strict=True) if rows else [()] * len(_NODE)
    return dict(zip(_NODE, table, strict=True))


def _nodes_15(lines: Lines) -> Fields:
    stated = [(number, line) for number, line in enumerate(lines, 1) if line.strip()]
    return _nodes([_free(number, _words_of_node(line), 4, 3) for number, line in stated])


def _words_of_node(line: str) -> list[str]:
    """Numbers of a node of dataset 15, by their columns where no blank parts them."""
    words = line.split()
    if len(words) == 7:
        return words
    return [text.strip() for text in columns(line, (10,) * 4 + (13,) * 3)]


def _nodes_2411(lines: Lines) -> Fields:
    stated = [(number, line.split()) for number, line in enumerate(lines, 1) if line.strip()]
    if len(stated) % 2:
        raise FormatError(stated[-1][0], "a node has no line of coordinates")
    kinds = [_free(*line, 4, 0) for line in stated[::2]]
    places = [_free(*line, 0, 3) for line in stated[1::2]]
    return _nodes([[*kind, *place] for kind, place in zip(kinds, places, strict=True)])


def _units_164(lines: Lines) -> Fields:
    if not lines or not INTEGER.fullmatch(lines[0][:10]):
        raise FormatError(1, "the code of the units is no whole number")
    factors = _free(2, " ".join(lines[1:]).split(), 0, 4)
    return dict(zip(("length", "force", "temp", "temp_offset"), factors, strict=True))


def _data_at_nodes(lines: Lines) -> Fields:
    """Fields of dataset 55; of other results than modes their kinds alone."""
    if len(lines) < 8:
        raise FormatError(len(lines), "its head has less than eight lines")
    kinds = _cells(lines[5], *(10,) * 6)
    if not all(map(INTEGER.fullmatch, kinds)):
        raise FormatError(6, "a kind of its data is no whole number")
    fields = _titles(lines) | dict(zip(_KINDS, map(_integer, kinds), strict=True))
    if fields["analysis_type"] not in (NORMAL, *COMPLEX):
        return fields
    return fields | _numbers_of_mode(lines, fields) | _records(lines[8:], fields)


def _numbers_of_mode(lines: Lines, fields: Fields) -> Fields:
    """Number, frequency or pole, modal mass or modal A, and damping of a mode."""
    is_normal = fields["analysis_type"] == NORMAL
    integers, reals = _cells(lines[6], *(10,) * 4), _cells(lines[7], *(13,) * 6)
    if not all(map(INTEGER.fullmatch, integers)):
        raise FormatError(7, "the load case or the number of the mode is no whole number")
    needed = 3 if is_normal else 4
    stated = [*reals[:needed], *filter(str.strip, reals[needed:])]
    if not all(map(NUMBER.fullmatch, stated)):
        raise FormatError(8, "the frequency, modal mass or damping is no number")
    load_case, mode = map(_integer, integers[2:])
    first, second, third, fourth = map(real, reals[:4])
    values = (
        {"freq": first, "modal_m": second, "modal_damp_vis": third}
        if is_normal
        else {"eig": complex(first, second), "modal_a": complex(third, fourth)}
    )
    return {"load_case": load_case, "mode_n": mode} | values


def _records(lines: Lines, fields: Fields) -> Fields:
    """Numbers of the nodes, and each of their values as an array `r1`, `r2` and so on.

    A line with the number of a node stands before those with its values, six in each.
    """
    count, data_type = fields["n_data_per_node"], fields["data_type"]
    if data_type not in (REAL, _OF_TWO_PARTS) or count < 1:
        what = f"{count} numbers of data type {data_type} are no values of a node"
        raise FormatError(6, what)
    needed = count * (1 if data_type == REAL else 2)
    nodes, values, step = list[int](), list[list[float]](), 1 + -(-needed // 6)
    for index in range(0, len(lines), step):
        node, *rows = lines[index : index + step]
        if not node.strip() or not INTEGER.fullmatch(node):
            raise FormatError(index + 9, f"{node.strip()!r} is no number of a node")
        cells = chain.from_iterable(columns(row, (13,) * 6) for row in rows)
        words = [text for text in cells if text.strip()]
        surplus = any(row[78:].strip() for row in rows)
        if len(words) != needed or surplus or not all(map(NUMBER.fullmatch, words)):
            what = f"{needed} numbers of a node are announced, not {' '.join(rows)!r}"
            raise FormatError(index + 10, what)
        nodes.append(_integer(node))
        values.append(list(map(real, words)))
    table = np.array(values).reshape(len(nodes), -1)
    if data_type != REAL:
        table = table[:, ::2] + 1j * table[:, 1::2]
    return {"node_nums": np.array(nodes, np.int64)} | {
        f"r{axis + 1}": table[:, axis] for axis in range(count)
    }


DECODERS: dict[int, Callable[[Lines], Fields]] = {
    15: _nodes_15,
    2411: _nodes_2411,
    164: _units_164,
    58: function,
    55: _data_at_nodes,
}
"""Decoders of datasets as text, from the lines after the one with the number."""
