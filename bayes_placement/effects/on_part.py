"""Effects on a part of a finite element model, which has a name: a support, region or member."""

import abc
from collections.abc import Sequence
from typing import ClassVar, TypeVar

import equinox as eqx
import numpy as np

from .._shared.errors import InputError
from ..modes.changed import original_nodal_modes
from ..modes.finite_elements.nodal_modes import NodalModes
from ..modes.modes import Modes
from .effect import Hinged, Location
from .instruments import Instruments

Kind = TypeVar("Kind", bound="OnPart")


class OnPart(Hinged):
    """An effect on one support, region or member, by its name, or its number from 0."""

    part: ClassVar[str]
    """What it is called, and the name of the field that holds it."""
    source: ClassVar[str] = "finite_elements.modes(matrices, ...)"
    """By what a model has such parts, for the error."""

    @staticmethod
    @abc.abstractmethod
    def names(nodal: NodalModes) -> Sequence[str]:
        """Names of all such parts of a model."""

    def on(self: Kind, modes: Modes) -> Kind:
        """Return the effect with its part by number; an array is one that was found by name."""
        given, names = getattr(self, self.part), self.names(original_nodal_modes(modes))
        if isinstance(given, str | int) and given not in (*names, *range(len(names))):
            raise InputError(
                f'Effect "{self.name}": {self.part}={given!r} was given, but the model has '
                f"{', '.join(names) or 'none'}, counted from 0. Name one of these; they come with "
                f"the model: {self.source}."
            )
        if not isinstance(given, str):
            return self
        number = np.asarray(names.index(given))
        return eqx.tree_at(lambda tree: getattr(tree, self.part), self, number)

    def location(self, modes: Modes, instruments: Instruments) -> Location | None:
        """Centre of the part [m]; None where it is not known."""
        return dict(original_nodal_modes(modes).centres).get(self._name(modes))

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the part."""
        return f"{self.part} {self._name(modes)}"

    def _name(self, modes: Modes) -> str:
        given = getattr(self, self.part)
        names = self.names(original_nodal_modes(modes))
        return given if isinstance(given, str) else names[int(given)]
