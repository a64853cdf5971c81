"""compliant_support: in, an end, a motion and a compliance; out, the hinge that it opens.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import InputError, Parameter
from ..modes._lines import uniform_line
from ..modes.beams.uniform_line import UniformLine
from ..modes.changed import line_of
from ..modes.hinged import Hinge
from ..modes.modes import Modes
from ._effect import Hinged
from .soft_support import supports_of

_HELD = {"fixed": ("rotation", "translation"), "pinned": ("translation",), "guided": ("rotation",)}


class CompliantSupport(Hinged):
    """A support that gives way: a flexible clamp (rotation) or a soft seat (translation).

    Blevins, Formulas for Natural Frequency and Mode Shape, table 8-9, states the stiffness; its
    inverse is used here, so that zero is the support as drawn.

    Parameters
    ----------
    compliance
        Rotation per moment [rad/(N m)], or displacement per force [m/N].
    end
        `left` or `right`.
    motion
        `rotation` or `translation`; a bar has translation only.
    """

    absent: ClassVar[tuple[str, float]] = ("compliance", 0.0)
    compliance: Parameter = eqx.field(metadata=unit("rad/(N m) or m/N"))
    end: str = eqx.field(static=True, default="left", kw_only=True)
    motion: str = eqx.field(static=True, default="rotation", kw_only=True)
    name: str = eqx.field(static=True, default="compliant_support", kw_only=True)

    def on(self, modes: Modes) -> "CompliantSupport":
        """Refuse a support that the structure does not have.

        Raises
        ------
        ValueError
            If the end or the motion is unknown, or nothing holds that motion there.
        """
        instead = 'Name a support of the model: effects.soft_support("left foot", ...).'
        possible = supports(uniform_line(modes, "compliant_support", instead))
        if (self.end, self.motion) not in possible:
            raise InputError(
                f'Effect "{self.name}": the {self.motion} of the {self.end} end was given, but '
                "only what a support holds can give way. This structure holds "
                f"{', '.join(f'the {m} of the {e} end' for e, m in possible) or 'nothing'}."
            )
        return self

    def hinges(self, modes: Modes) -> list[Hinge]:
        """One hinge between the structure and its support."""
        line = line_of(modes)
        at = 0.0 if self.end == "left" else line.length
        order = line.half_order + (line.half_order == 2 and self.motion == "translation")
        return [Hinge(at, order, self.compliance)]

    def setting(self, experiment: Any) -> str:
        """Which end it is about, and which motion of it."""
        return f"{self.end} end, {self.motion}"

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence[Hinged]:
        """Each support, as soft as the structure itself or by powers of ten stiffer.

        Those of a finite element model are `soft_support`. On a line, a rotation or the seat of a
        bar is tried from 1e-5 of the compliance of the structure on; the seat of a beam, which
        high modes feel more by powers of their wave number, from 1e-7 on.
        """
        if not isinstance(experiment.structure.modes, UniformLine):
            return supports_of(experiment.structure.modes)
        line = experiment.nominal().structure.modes
        found: list[Hinged] = []
        for end, motion in supports(line):
            power = 2 * line.half_order - 1 if motion == "translation" else 1
            unit_compliance = float(line.length**power / line.stiffness)
            law = LogUniform(10.0 ** -(power + 4) * unit_compliance, 10 * unit_compliance)
            found.append(cls(law, end=end, motion=motion))
        return found


def supports(line: UniformLine) -> list[tuple[str, str]]:
    """Ends and motions that are held."""
    motions = {word: held for word, held in _HELD.items()}
    if line.half_order == 1:
        motions = {"fixed": ("translation",)}
    pairs = zip(("left", "right"), line.ends, strict=True)
    return [(end, motion) for end, word in pairs for motion in motions.get(word, ())]


compliant_support = CompliantSupport
