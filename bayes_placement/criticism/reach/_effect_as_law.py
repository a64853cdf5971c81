"""An effect of the library with its numbers, where a law would stand."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...inference.units import three_digits
from ...laws.law import Tree


@dataclass(frozen=True, repr=False)
class EffectAsLaw:
    """An effect with its numbers, for what a network is at a port.

    Numbers are value and unit of its unknowns but the place, by name.
    """

    kind: str
    numbers: Mapping[str, tuple[float, str]]

    def in_words(self) -> str:
        """Name and numbers."""
        words = [
            f"{word} {three_digits(value)} {unit}".removesuffix(" 1")
            for word, (value, unit) in self.numbers.items()
        ]
        return f"{self.kind} of {', '.join(words)}"

    def tree(self) -> Tree:
        """Its name."""
        return self.kind

    def __repr__(self) -> str:
        return self.in_words()
