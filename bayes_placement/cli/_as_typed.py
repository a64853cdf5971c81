"""Effects as a person types them: their numbers, priors and places in plain Python."""

import dataclasses
import re
from collections.abc import Mapping

import numpy as np
from numpyro import distributions
from numpyro.distributions import Distribution

from .._shared.ranges import described
from ..effects.effect import Effect
from ..effects.library import EFFECTS
from ..laws.elements import ELEMENTS
from ..laws.law import Law
from ..positions.places import Straight

PRIOR = re.compile(r"([A-Z]\w*)\([-+.\de, ]*\)")
"""A distribution of plain numbers."""

NAME = re.compile(r"\b([A-Z]\w*)\(")
"""What is called in a text."""


def effect_as_typed(effect: Effect) -> str | None:
    """Return the call that makes an effect, a field a line; None where a field has no text.

    Fields of their defaults are left out.
    """
    word = next((word for word, kind in EFFECTS.items() if kind is type(effect)), None)
    fields = _fields(effect)
    if word is None or fields is None:
        return None
    lines = (f"    {name}={text},\n" for name, text in fields.items())
    return f"bp.effects.{word}(\n{''.join(lines)})"


def imports_of(text: str) -> str:
    """Lines that import the distributions and the elements of laws that a text names."""
    named = {*NAME.findall(text)}
    modules = {"bayes_placement.effects": ELEMENTS, "numpyro.distributions": dir(distributions)}
    found = {module: sorted(named & {*names}) for module, names in modules.items()}
    lines = (
        f"from {module} import {', '.join(names)}\n" for module, names in found.items() if names
    )
    return "".join(lines)


def _fields(made: Effect | Straight) -> Mapping[str, str] | None:
    """Texts of the fields that are not as by default; None where one has no text."""
    texts = {
        field.name: as_typed(getattr(made, field.name))
        for field in sorted(dataclasses.fields(made), key=lambda field: bool(field.kw_only))
        if not _is_default(field, getattr(made, field.name))
    }
    known = {name: text for name, text in texts.items() if text is not None}
    return known if len(known) == len(texts) else None


def _is_default(field: "dataclasses.Field[object]", value: object) -> bool:
    plain = value is None or isinstance(value, str | int | float | tuple)
    return plain and bool(value == field.default)


def as_typed(value: object) -> str | None:
    """Return a value as text that makes it again; None where there is none."""
    if value is None or isinstance(value, bool | int | str):
        return repr(value)
    if isinstance(value, float | np.floating | np.integer):
        return repr(value.item() if isinstance(value, np.generic) else value)
    if isinstance(value, tuple | list):
        parts = [as_typed(part) for part in value]
        comma = "," if len(parts) == 1 else ""
        return None if None in parts else f"({', '.join(map(str, parts))}{comma})"
    if isinstance(value, Distribution):
        return _prior(value)
    if isinstance(value, Law):
        return _law(value)
    return _place(value) if isinstance(value, Straight) else None


def _prior(prior: Distribution) -> str | None:
    words = described(prior)
    of = PRIOR.fullmatch(words)
    return words if of and not prior.shape() and of[1] in dir(distributions) else None


def _law(law: Law) -> str | None:
    """Text of a law whose elements and priors have names."""
    known = {*ELEMENTS, *dir(distributions)}
    return repr(law) if {*NAME.findall(repr(law))} <= known else None


def _place(place: Straight) -> str | None:
    fields = _fields(place)
    if fields is None:
        return None
    arguments = ", ".join(f"{name}={text}" for name, text in fields.items())
    return f"bp.positions.{type(place).__name__}({arguments})"
