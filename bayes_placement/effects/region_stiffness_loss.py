"""A region of a finite element model that has lost stiffness, and what effects on parts share."""

import abc
from collections.abc import Sequence
from typing import ClassVar, TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Int

from .._shared.errors import InputError
from .._shared.ranges import SHARE_LOST
from ..modes.changed import original_nodal_modes
from ..modes.finite_elements.nodal_modes import NodalModes, nodal_of
from ..modes.flexible_parts import WeakenedRegion
from .effect import Hinged, Location
from .instruments import Instruments
from .prelude import LogUniform, Modes, Parameter, Scales, field, negative_log_uniform, unit

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
        """Name of the part, and what it is where its name does not say so."""
        name = self._name(modes)
        return name if name.startswith(self.part) else f"{self.part} {name}"

    def _name(self, modes: Modes) -> str:
        given = getattr(self, self.part)
        names = self.names(original_nodal_modes(modes))
        return given if isinstance(given, str) else names[int(given)]


class RegionStiffnessLoss(OnPart):
    """A share of the stiffness lost in one region of a finite element model: damage, a bad bond.

    The stiffness is K - loss K_region (Friswell and Mottershead, Finite Element Model Updating in
    Structural Dynamics, ch. 7). Where the matrices are known, it acts on attachment modes of the
    region, or on the modes where these are all that there are; else on the span of the kept modes,
    which describes a loss of a few percent only.

    Parameters
    ----------
    region
        Name of the region, or its number from 0.
    loss
        Share of its stiffness that is lost, less than 1 [1]; negative where it is stiffer.

    Examples
    --------
    >>> modes = bp.finite_elements.modes(matrices, reading, up_to=500.0)
    >>> beam = bp.Structure(modes, damping=bp.damping.Modal(0.02))
    >>> beam + bp.effects.region_stiffness_loss("root", loss=dist.Uniform(0.0, 0.5))
    Structure: NodalModes, Modal damping, with local_stiffness_loss
    """

    absent = ("loss", 0.0)
    if_negative = "stiffer, not softer"
    acts_on = "region"
    part = "region"
    region: str | int | Int[Array | np.ndarray, ""]
    loss: Parameter = field(metadata=unit("1", within=SHARE_LOST))
    name: str = field(static=True, default="local_stiffness_loss", kw_only=True)

    @staticmethod
    def names(nodal: NodalModes) -> tuple[str, ...]:
        """Names of all regions."""
        return nodal.regions.names

    def hinges(self, modes: Modes) -> list[WeakenedRegion]:
        """The region, as a part of the model that becomes softer."""
        return [WeakenedRegion(self.region, self.loss)]  # type: ignore[arg-type]

    @classmethod
    def suggest(cls, scales: Scales) -> list["RegionStiffnessLoss"]:
        """0.3 % to 95 % lost, or 0.3 % to 200 % added, in each region of a finite element model."""
        nodal = nodal_of(scales.modes)
        count = 0 if nodal is None else len(nodal.regions.names)
        losses = LogUniform(0.003, 0.95), negative_log_uniform(0.003, 2.0)
        return [cls(np.asarray(number), loss) for loss in losses for number in range(count)]
