"""A dimension of a uniform bar or beam, or the scale of a model, that is not as drawn."""

from collections.abc import Mapping

import equinox as eqx

from .._shared.ranges import SIZE, log_uniform_of_either_sign
from ..modes.beams import UniformBar, UniformBeam
from ..modes.beams.waveguide import Waveguide
from ..modes.finite_elements.nodal_modes import NodalModes
from .prelude import GlobalChange, InputError, Instruments, Modes, Parameter, Scales, field, unit

LEAST, GREATEST = 1e-4, 0.15
"""Relative errors [1]: the least that matters, and the greatest of a default prior."""

OF_BAR = {"length": {"length": 1}, "section": {"area": 1}}
OF_BEAM_WITH_RADIUS = OF_BAR | {"thickness": {"area": 1, "radius_of_gyration": 1}}
OF_BEAM_WITH_MOMENT = {
    "length": {"length": 1},
    "section": {"area": 1, "second_moment": 1},
    "thickness": {"area": 1, "second_moment": 3},
}
OF_MODEL = {"scale": {"youngs_modulus": 1, "density": 3}}
"""Power of 1 + error with which quantities grow, by dimension.

A body that is s times as large in every direction has the stiffness s K, as a modulus s times as
great gives, and the mass s^3 M (Langhaar, Dimensional Analysis and Theory of Models, 1951).
"""


class DimensionError(GlobalChange):
    """A relative error of one dimension of a uniform bar or beam, or of all of a model.

    Its length; the thickness of a beam in the plane of bending, with which the area grows as
    1 + error and the second moment as its cube; or the section: the area, at the same radius of
    gyration. All other effects act on the structure of the true dimension. Sensors, actuators and
    effects stay where they are, in metres from the left end. Where these lie beyond the end of a
    shorter one its closed-form shapes go on.

    The scale of a finite element model multiplies all of its coordinates, sections and thicknesses,
    as of a model in a wrong unit of length or a part that shrank; what sits on it stays at the same
    nodes. It is exact where all of the model is elastic, without springs to the ground or masses
    of its own. One wall, hole or thickness alone changes K and M in a way that they do not tell.

    Parameters
    ----------
    error
        True dimension over that as drawn, minus 1 [1].
    dimension
        `length`, `section`, or `thickness` of a beam; `scale` of a finite element model.

    Examples
    --------
    >>> longer = structure + bp.effects.dimension_error(0.02, dimension="length")
    >>> ratio = longer.proper_modes().natural_frequency / structure.modes.natural_frequency
    >>> np.asarray(ratio[:2]).round(4)
    array([0.9804, 0.9804])
    """

    changes_size = True
    absent = ("error", 0.0)
    error: Parameter = field(metadata=unit("1", within=SIZE))
    dimension: str = field(static=True, default="length", kw_only=True)
    name: str = field(static=True, default="dimension_error", kw_only=True)

    def on(self, modes: Modes) -> "DimensionError":
        """Return the effect as it is, on a structure that has this dimension."""
        possible = powers(modes)
        if not possible:
            raise InputError(
                f'Effect "{self.name}" was added to {type(modes).__name__}; a uniform bar or beam, '
                "or a finite element model without soft supports and members, is needed, since "
                "others do not tell how they change with a dimension. Make density or "
                "youngs_modulus unknown instead, or use finite_elements.modes(matrices, ...)."
            )
        if self.dimension not in possible:
            raise InputError(
                f'Effect "{self.name}": dimension={self.dimension!r} was given; one of '
                f"{', '.join(possible)} is needed, since {type(modes).__name__} has no other: "
                f'effects.dimension_error(0.01, dimension="{next(iter(possible))}").'
            )
        return self

    def changed(self, modes: Modes) -> Modes:
        """Modes of the structure of the true dimension."""
        factor = 1 + self.error
        grown = powers(modes)[self.dimension]
        values = [getattr(modes, name) * factor**power for name, power in grown.items()]
        return eqx.tree_at(lambda tree: [getattr(tree, name) for name in grown], modes, values)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Which dimension."""
        return self.dimension

    @classmethod
    def suggest(cls, scales: Scales) -> list["DimensionError"]:
        """Each dimension of a bar or beam, up to 15 % to either side, log-uniform from 0.01 % on.

        None of a finite element model: its modulus and density say the same and more.
        """
        prior = log_uniform_of_either_sign(LEAST, -GREATEST, GREATEST)
        possible = powers(scales.modes) if isinstance(scales.modes, Waveguide) else ()
        return [cls(prior, dimension=dimension) for dimension in possible]


def powers(modes: Modes) -> Mapping[str, Mapping[str, int]]:
    """Dimensions of a structure, and how its quantities grow with each; none of other modes.

    Compliances of supports and tensions of members grow otherwise, and such models are left out.
    """
    if isinstance(modes, UniformBar):
        return OF_BAR
    if isinstance(modes, UniformBeam):
        return OF_BEAM_WITH_RADIUS if modes.second_moment is None else OF_BEAM_WITH_MOMENT
    if isinstance(modes, NodalModes) and not (modes.static_shapes.supports or modes.members.names):
        return OF_MODEL
    return {}
