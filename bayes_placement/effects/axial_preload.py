"""A tension along a uniform beam."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution

from .._shared.compiled import compiled
from ..modes.beams import UniformBeam
from ..modes.changed import ChangedModes, changed, over_changed_modes, required_beam
from .prelude import GlobalChange, Modes, Parameter, Scales, field, log_uniform_of_either_sign, unit

LEAST, COMPRESSION, TENSION = 1e-4, 0.8, 10.0
"""Of the buckling load: the least force that matters, the greatest ones of a default prior."""


class OfBeam(GlobalChange):
    """A change of a uniform beam."""

    of_a_bar: eqx.AbstractClassVar[str]
    instead: eqx.AbstractClassVar[str]
    """Why a bar has it not, and what to use on a finite element model, for errors."""

    def on(self, modes: Modes) -> "OfBeam":
        """Return the effect as it is, on a uniform beam."""
        self.beam(modes)
        return self

    def beam(self, modes: Modes) -> UniformBeam:
        """Beam beneath changed modes."""
        return required_beam(modes, self.kind, self.of_a_bar, self.instead)


class AxialPreload(OfBeam):
    """A tension along a beam, which adds the geometric stiffness T int w'^2 dx.

    Shaker, NASA TN D-8109 (1975). A compression is negative and must stay below buckling.

    Parameters
    ----------
    tension
        Tension [N].

    Examples
    --------
    >>> sizes = {"length": 1.0, "area": 1e-4, "second_moment": 1e-9}
    >>> beam = bp.beams.beam(3, **sizes, youngs_modulus=7e10, density=2700.0, ends="clamped-free")
    >>> wire = bp.Structure(beam, damping=bp.damping.Modal(0.01))
    >>> wire + bp.effects.axial_preload(tension=20.0)
    Structure: UniformBeam, Modal damping, with axial_preload
    """

    absent = ("tension", 0.0)
    of_a_bar = "whose axial motion a preload does not change"
    instead = "Name a member of the model: effects.member_preload(member, tension)."
    tension: Parameter = field(metadata=unit("N"))
    name: str = field(static=True, default="axial_preload", kw_only=True)

    def changed(self, modes: Modes) -> ChangedModes:
        """Modes of the beam under tension."""
        slope = over_changed_modes(modes, self.beam(modes).slope_matrix())
        return changed(modes, self.tension * slope)

    @classmethod
    def suggest(cls, scales: Scales) -> list["AxialPreload"]:
        """80 % of the buckling load in compression to ten times as much in tension.

        Log-uniform from 0.01 % of the buckling load on.
        """
        beam = scales.nominal_modes
        if not isinstance(beam, UniformBeam):
            return []
        return [cls(preload_prior(buckling_load(beam)))]


def preload_prior(load: float) -> Distribution:
    """Prior of a tension [N], for a buckling load [N]."""
    return log_uniform_of_either_sign(LEAST * load, -COMPRESSION * load, TENSION * load)


def buckling_load(beam: UniformBeam) -> float:
    """Least compression at which a beam loses its stiffness [N]."""
    return critical(*compiled(_natural_and_slopes)(beam), beam.rigid_body_modes)


def critical(
    natural: Float[Array | np.ndarray, "mode"],
    slopes: Float[Array | np.ndarray, "mode mode"],
    rigid: int,
) -> float:
    """Least compression at which elastic modes of a geometric stiffness have no stiffness [N]."""
    root = 1 / np.asarray(natural)[rigid:]
    elastic = np.asarray(slopes)[rigid:, rigid:]
    return float(1 / np.linalg.eigvalsh(root[:, None] * elastic * root).max())


def _natural_and_slopes(
    beam: UniformBeam,
) -> tuple[Float[Array, "mode"], Float[Array, "mode mode"]]:
    return beam.angular_frequency(), beam.slope_matrix()
