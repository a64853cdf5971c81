"""Words of which a field of an effect takes one."""

from collections.abc import Sequence
from typing import Any

from .._types import InputError, shown


def check_one_of(effect: Any, field: str, words: Sequence[str]) -> None:
    """Refuse a word that is none of those that are possible."""
    given = getattr(effect, field)
    if given not in words:
        raise InputError(
            f'Effect "{effect.name}": {field}={shown(given)} was given; '
            f"{' or '.join(repr(word) for word in words)} is needed, since the structure has no "
            f'other here: {field}="{words[0]}".'
        )
