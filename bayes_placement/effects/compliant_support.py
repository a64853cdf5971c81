"""A support of a uniform bar or beam that is softer than assumed."""

from .._shared.errors import InputError
from .._shared.sites import unit
from ..modes.beams.waveguide import Waveguide
from ..modes.changed import original_waveguide, required_waveguide
from ..modes.hinges import Hinge
from .prelude import Hinged, Instruments, Location, LogUniform, Modes, Parameter, Scales, field

_HELD = {"fixed": ("rotation", "translation"), "pinned": ("translation",), "guided": ("rotation",)}


def _unit(support: "CompliantSupport") -> str:
    return "rad/(N m)" if support.motion == "rotation" else "m/N"


class CompliantSupport(Hinged):
    """A support with a compliance: a flexible clamp (rotation) or a soft seat (translation).

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

    Examples
    --------
    >>> seat = bp.effects.compliant_support(1e-8, end="left", motion="translation")
    >>> structure + seat
    Structure: UniformBar, Modal damping, with compliant_support
    """

    absent = ("compliance", 0.0)
    acts_on = "cut"
    compliance: Parameter = field(metadata=unit(_unit))
    end: str = field(static=True, default="left", kw_only=True)
    motion: str = field(static=True, default="rotation", kw_only=True)
    name: str = field(static=True, default="compliant_support", kw_only=True)

    def on(self, modes: Modes) -> "CompliantSupport":
        """Return the effect as it is, on a bar or beam with this support."""
        instead = 'Name a support of the model: effects.soft_support("left foot", ...).'
        possible = supports(required_waveguide(modes, "compliant_support", instead))
        if (self.end, self.motion) not in possible:
            raise InputError(
                f'Effect "{self.name}": the {self.motion} of the {self.end} end was given, but '
                "only what a support holds can be compliant. This structure holds "
                f"{', '.join(f'the {m} of the {e} end' for e, m in possible) or 'nothing'}."
            )
        return self

    def hinges(self, modes: Modes) -> list[Hinge]:
        """One hinge between the structure and its support."""
        waveguide = original_waveguide(modes)
        at = 0.0 if self.end == "left" else waveguide.length
        order = waveguide.half_order + (waveguide.half_order == 2 and self.motion == "translation")
        return [Hinge(at, order, self.compliance)]

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """The end of the structure [m]."""
        return modes.bounds()[self.end == "right"]

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """End of the structure, and the motion that it no longer holds rigidly."""
        return f"{self.end} end, {self.motion}"

    @classmethod
    def suggest(cls, scales: Scales) -> list["CompliantSupport"]:
        """Each support, from ten times the compliance of the structure down.

        A rotation or the seat of a bar is tried down to 1e-5 of the compliance of the structure;
        the seat of a beam, which high modes feel more by powers of their wave number, to 1e-7.
        """
        waveguide = scales.nominal_modes
        if not isinstance(waveguide, Waveguide):
            return []
        variants = []
        for end, motion in supports(waveguide):
            power = 2 * waveguide.half_order - 1 if motion == "translation" else 1
            structure = float(waveguide.length) ** power / float(waveguide.stiffness)
            compliance = LogUniform(10.0 ** -(power + 4) * structure, 10 * structure)
            variants.append(cls(compliance, end=end, motion=motion))
        return variants


def supports(waveguide: Waveguide) -> list[tuple[str, str]]:
    """Ends and motions that are held."""
    motions = _HELD if waveguide.half_order == 2 else {"fixed": ("translation",)}
    pairs = zip(("left", "right"), waveguide.ends, strict=True)
    return [(end, motion) for end, word in pairs for motion in motions.get(word, ())]
