"""How nouns and results are shown: a line, a table in a notebook, and what is completed."""

import dataclasses
import types
from collections.abc import Mapping, Sequence
from functools import partial
from html import escape
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import jax
import numpy as np
from numpyro.distributions import Distribution

from .ranges import described
from .sites import Role, Unknown, stated_unit, unknowns

if TYPE_CHECKING:
    import pandas as pd

PRIOR_HEADINGS = ("unknown", "prior", "unit", "role")
"""Headings of a table of priors."""

LONGEST, LONGEST_VALUE, LONGEST_NESTED = 170, 80, 60
"""Characters of all fields, of the value of one, and of a noun within another noun."""

MOST_ENTRIES = 4
"""Entries of a list that are written in full."""

Kind = TypeVar("Kind", bound=type)

_PLAIN = (str, bool, int, float, type(None))


def with_short_repr(kind: Kind) -> Kind:
    """Show objects of a class and of those derived from it in one line, and in a notebook as HTML.

    The line of decoration stands above that of a dataclass, whose own `repr` it replaces.
    """
    shown: Any = kind
    shown.__repr__, shown._repr_html_ = short_repr, noun_html
    return kind


def short_repr(noun: object) -> str:
    """Write a noun in one line: its class, and its fields that differ from their defaults.

    Numbers have four digits, and units where their fields state them; arrays are written by their
    shape. Fields that are empty or declared with `repr=False` are left out, and the last ones where
    there is no room.
    """
    fields = [field for field in _fields(noun) if not _is_default(field)]
    written = [f"{field.name}={_with_unit(field)}" for field in fields]
    ends = np.cumsum([len(words) + 2 for words in written])
    shown = written[: int(np.sum(ends <= LONGEST))]
    rest = ["..."] if len(shown) < len(written) else []
    return f"{type(noun).__name__}({', '.join([*shown, *rest])})"


def noun_html(noun: object) -> str:
    """Return HTML of a noun: its line, and the table of its priors, or of its fields without."""
    priors = unknowns(noun)
    return notebook_html(repr(noun), prior_frame(priors) if priors else _field_frame(noun))


def notebook_html(
    title: str, table: "pd.DataFrame", sentences: Sequence[str] = (), drawing: str = ""
) -> str:
    """Return HTML that a notebook shows in the place of `repr`.

    A drawing, SVG, stands above the table, sentences below.
    """
    rows = table.rename_axis(columns=None).reset_index() if table.index.name else table
    shown = rows.to_html(index=False, border=0, na_rep="") if len(rows) else ""
    further = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    list_items = f"<ul>{further}</ul>" if further else ""
    return f"<div><p><b>{escape(title)}</b></p>{drawing}{shown}{list_items}</div>"


def prior_frame(priors: Sequence[Unknown]) -> "pd.DataFrame":
    """Return the rows of a table of priors, for a notebook."""
    import pandas as pd

    return pd.DataFrame(prior_rows(priors), columns=[*PRIOR_HEADINGS])


def prior_rows(priors: Sequence[Unknown]) -> list[tuple[str, ...]]:
    """Return a row for each unknown: name, prior, unit, role; for all standard errors a single one.

    The standard errors of a model error are many.
    """
    rows: list[tuple[str, ...]] = [
        (unknown.name, described(unknown.distribution), unknown.unit, unknown.role.value)
        for unknown in priors
        if not _is_standard_error(unknown)
    ]
    errors = [unknown for unknown in priors if _is_standard_error(unknown)]
    count = sum(int(np.prod(unknown.distribution.shape())) for unknown in errors)
    if count:
        rows.append(("model_error.*.standard", f"{count} Normal(0, 1)", "1", errors[0].role.value))
    return rows


def _is_standard_error(unknown: Unknown) -> bool:
    return unknown.role is Role.MODEL_ERROR and unknown.field == "standard"


class _Field(NamedTuple):
    """A field of a noun: its value, its default (itself where it has none) and its unit."""

    name: str
    value: object
    default: object = dataclasses.MISSING
    unit: str = ""


def _fields(noun: Any) -> list[_Field]:
    """Fields of a dataclass, an Equinox module or a named tuple."""
    if isinstance(noun, tuple):
        kind: Any = type(noun)
        defaults = [kind._field_defaults.get(name, dataclasses.MISSING) for name in kind._fields]
        return [*map(_Field, kind._fields, noun, defaults)]
    # Those that are given by their names come last, as in a call.
    in_order = sorted(dataclasses.fields(noun), key=lambda field: bool(field.kw_only))
    return [
        _Field(field.name, getattr(noun, field.name, None), _default(field), _unit(field, noun))
        for field in in_order
        if field.repr and not field.name.startswith("_")
    ]


def _default(field: "dataclasses.Field[object]") -> object:
    factory = field.default_factory
    return field.default if factory is dataclasses.MISSING else factory()


def _unit(field: "dataclasses.Field[object]", noun: object) -> str:
    unit = stated_unit(field.metadata, noun)
    return "" if unit == "1" else unit


def _is_default(field: _Field) -> bool:
    value, default = field.value, field.default
    if default is dataclasses.MISSING:  # what is not there needs no word
        return value is None or (isinstance(value, str | tuple | list | Mapping) and not value)
    if isinstance(value, _PLAIN) and isinstance(default, _PLAIN):
        return value == default
    return in_words(value) == in_words(default)


def _field_frame(noun: object) -> "pd.DataFrame":
    import pandas as pd

    rows = [(field.name, in_words(field.value), field.unit) for field in _fields(noun)]
    return pd.DataFrame(rows, columns=["field", "value", "unit"])


def _with_unit(field: _Field) -> str:
    words = in_words(field.value)
    words = words if len(words) <= LONGEST_VALUE else f"{words[: LONGEST_VALUE - 3]}..."
    bare = field.value is None or isinstance(field.value, str) or _is_noun(field.value)
    if bare or not field.unit:
        return words
    is_sentence = " of " in field.unit or " or " in field.unit  # `unit of z`, `m/N or m2/N`
    return f"{words} [{field.unit}]" if is_sentence else f"{words} {field.unit}"


def _is_noun(value: object) -> bool:
    named_tuple = isinstance(value, tuple) and "_fields" in dir(value)
    return dataclasses.is_dataclass(value) or named_tuple


def in_words(value: object) -> str:
    """Write what a field holds: a number with four digits, a prior by its name and arguments."""
    if isinstance(value, Distribution):
        return described(value)
    if isinstance(value, str | Path):
        return repr(str(value))
    if isinstance(value, float | complex):
        return f"{value:.4g}"
    if isinstance(value, type | types.FunctionType):
        return value.__name__
    if isinstance(value, Mapping):
        return _mapping_in_words(value)
    if isinstance(value, tuple | list) and not _is_noun(value):
        return _list_in_words(value)
    is_array = not _is_noun(value) and isinstance(getattr(value, "shape", None), tuple)
    return _array_in_words(value) if is_array else _nested(value)


def _array_in_words(value: Any) -> str:
    """Write an array, a table or a sparse matrix: a few numbers in full, all else by its shape."""
    sizes = "x".join(map(str, value.shape))
    if isinstance(value, jax.core.Tracer):
        return f"traced array of {sizes}" if sizes else "traced number"
    if not isinstance(value, np.ndarray | np.generic | jax.Array):
        return f"{type(value).__name__} of {sizes}"
    if value.ndim > 1 or value.dtype.kind not in "biuf":
        return f"array of {sizes}" if sizes else str(value)
    return in_words(np.asarray(value).tolist())


def _list_in_words(entries: Sequence[Any]) -> str:
    opening, closing = "()" if isinstance(entries, tuple) else "[]"
    if len(entries) <= MOST_ENTRIES:
        comma = "," if len(entries) == 1 and isinstance(entries, tuple) else ""
        return f"{opening}{', '.join(map(in_words, entries))}{comma}{closing}"
    if all(isinstance(entry, int | float) for entry in entries):
        return f"{len(entries)} values from {min(entries):.4g} to {max(entries):.4g}"
    first, last = in_words(entries[0]), in_words(entries[-1])
    return f"{opening}{first}, ..., {last}{closing} of {len(entries)}"


def _mapping_in_words(entries: Mapping[object, object]) -> str:
    if len(entries) > MOST_ENTRIES:
        return f"{{{', '.join(map(repr, [*entries][:2]))}, ...}} of {len(entries)}"
    pairs = (f"{key!r}: {in_words(value)}" for key, value in entries.items())
    return f"{{{', '.join(pairs)}}}"


def _nested(value: object) -> str:
    """Write a noun within a noun, by its class alone where that is no short word."""
    words = repr(value)
    is_sentence = any(mark in words for mark in ("\n", ": ", " object at 0x"))
    is_short = len(words) <= LONGEST_NESTED and not is_sentence
    return words if is_short else f"{type(value).__name__}(...)"


def offer_own(*modules: ModuleType) -> None:
    """Let modules offer what they define: no constants, and nothing that they import."""
    for module in modules:
        vars(module)["__dir__"] = partial(_own, module)


def _own(module: ModuleType) -> list[str]:
    named = ((name, getattr(item, "__module__", "")) for name, item in vars(module).items())
    own = [name for name, home in named if home == module.__name__ and not name.startswith("_")]
    return [*vars(module).get("__all__", own)]
