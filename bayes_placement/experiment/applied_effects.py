"""What effects are at the lines of an experiment, once they are applied; no candidates."""

from collections import OrderedDict
from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Complex, Float, Inexact

from ..effects.effect import Effect, Hinged, Modulus, Omega, OnPorts, Stiffness
from ..effects.instrument_effect import InstrumentEffect
from ..effects.instruments import Instruments
from ..effects.scales import Scales
from ..modes.hinges import Hinge
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import PortLaw


class Applied(Effect):
    """What effects are at the lines of an experiment; no candidate."""

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["Applied"]:
        """Return none."""
        return []


class AppliedLaw(Applied, OnPorts):
    """A law of which the ports and the dynamic stiffness at each line are known."""

    absent: ClassVar[tuple[str, float]] = ("numerator", 0.0)
    points: Points
    numerator: Complex[Array, "*port frequency"] = eqx.field(metadata={"unit": "N/m"})
    denominator: Complex[Array, "*port frequency"] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, kw_only=True)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The ports and the law on each, as they were applied."""
        return [PortLaw(self.points, self.numerator, self.denominator)]


class AppliedModulus(Applied, Modulus):
    """A modulus that is known at each line."""

    absent: ClassVar[tuple[str, float]] = ("excess", 0.0)
    excess: Complex[Array, "frequency"] = eqx.field(metadata={"unit": "1"})
    kept: Float[Array, ""] = eqx.field(metadata={"unit": "1"})
    name: str = eqx.field(static=True, default="applied.modulus", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What is added at the lines [1]."""
        return self.excess

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping law that remains [1]."""
        return self.kept


class AppliedHinges(Applied, Hinged):
    """Hinges of which the places and the compliances are known."""

    absent: ClassVar[tuple[str, float]] = ("compliance", 0.0)
    at: Float[Array, "hinge"] = eqx.field(metadata={"unit": "m"})
    compliance: Float[Array, "hinge"] = eqx.field(metadata={"unit": "m/N"})
    orders: tuple[int, ...] = eqx.field(static=True)
    name: str = eqx.field(static=True, default="applied.hinges", kw_only=True)

    def hinges(self, modes: Modes) -> list[Hinge]:
        """The hinges, as they were applied."""
        return [Hinge(*hinge) for hinge in zip(self.at, self.orders, self.compliance, strict=True)]


class AppliedLines(Applied, InstrumentEffect):
    """A record of which it is known at what s / i each line is."""

    absent: ClassVar[tuple[str, float]] = ("known", 0.0)
    known: Complex[Array, "frequency"] = eqx.field(metadata={"unit": "rad/s"})
    name: str = eqx.field(static=True, default="applied.lines", kw_only=True)

    def laplace(self, omega: Omega) -> Complex[Array, "frequency"]:
        """Variable s / i at the lines [rad/s]."""
        return self.known


class AppliedLoads(Applied, InstrumentEffect):
    """The dynamic stiffness of each transducer at each line, of those sides that load."""

    absent: ClassVar[tuple[str, float]] = ("known", 0.0)
    known: OrderedDict[str, Complex[Array, "transducer frequency"]] = eqx.field(
        metadata={"unit": "N/m"}
    )
    name: str = eqx.field(static=True, default="applied.loads", kw_only=True)

    @property
    def loads(self) -> tuple[str, ...]:  # type: ignore[override]
        """Sides that load the structure where they sit."""
        return tuple(self.known)

    def load(self, side: str, number: int, omega: Omega) -> Stiffness:
        """Dynamic stiffness of a transducer at the lines [N/m]."""
        return self.known[side][number]


class AppliedRecord(Applied, InstrumentEffect):
    """What is added to each FRF, and a factor on it that is known at each line."""

    absent: ClassVar[tuple[str, float]] = ("factor", 1.0)
    factor: Complex[Array, "sensor actuator frequency"] = eqx.field(metadata={"unit": "1"})
    flexibility: Inexact[Array, "sensor actuator #frequency"] = eqx.field(metadata={"unit": "m/N"})
    name: str = eqx.field(static=True, default="applied.record", kw_only=True)

    def added(self, omega: Omega) -> Inexact[Array, "sensor actuator #frequency"]:
        """Receptance that is added [m/N]."""
        return self.flexibility

    def channel_factor(
        self, omega: Omega, instruments: Instruments
    ) -> Complex[Array, "sensor actuator frequency"]:
        """Factor at the lines [1]."""
        return self.factor
