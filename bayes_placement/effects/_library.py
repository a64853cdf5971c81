"""_library: in, an experiment; out, every effect that it may be missing, with default priors.

Not known here: data, how candidates are compared.
"""

import difflib
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from .._types import InputError
from ._effect import Effect
from .axial_preload import AxialPreload
from .compliant_support import CompliantSupport
from .cubic_stiffness import CubicStiffness
from .gain_error import GainError
from .ground_dashpot import GroundDashpot
from .ground_spring import GroundSpring
from .hysteretic_damping import HystereticDamping
from .local_stiffness_loss import LocalStiffnessLoss
from .misplaced_sensor import MisplacedSensor
from .mount_resonance import MountResonance
from .point_mass import PointMass
from .residual_modes import ResidualModes
from .sensor_mass import SensorMass
from .shear_and_rotary_inertia import ShearAndRotaryInertia
from .time_delay import TimeDelay
from .tuned_absorber import TunedAbsorber
from .viscoelastic_modulus import ViscoelasticModulus

KINDS: tuple[type[Effect], ...] = (
    PointMass,
    GroundSpring,
    GroundDashpot,
    TunedAbsorber,
    LocalStiffnessLoss,
    HystereticDamping,
    ViscoelasticModulus,
    CompliantSupport,
    AxialPreload,
    ShearAndRotaryInertia,
    CubicStiffness,
    ResidualModes,
    SensorMass,
    TimeDelay,
    GainError,
    MountResonance,
    MisplacedSensor,
)


class Library(NamedTuple):
    """Effects that an experiment may be missing.

    Parameters
    ----------
    experiment
        The experiment.
    effects
        Candidates with priors; several variants of one kind bear the same name.
    """

    experiment: Any
    effects: tuple[Effect, ...]

    @property
    def kinds(self) -> list[str]:
        """Names of the kinds, each once."""
        return list(dict.fromkeys(one.name for one in self.effects))


def library(
    experiment: Any,
    kinds: Iterable[str | type[Effect]] | None = None,
    *,
    further: Sequence[Effect | type[Effect]] = (),
) -> Library:
    """Collect candidates for `explain` and `improve`.

    Parameters
    ----------
    experiment
        The experiment; default priors are scaled to its structure.
    kinds
        Names of the effects to be tried; by default all that can act on it.
    further
        Effects of your own: classes, whose `suggest` is asked, or effects with priors.

    Raises
    ------
    ValueError
        If a name is unknown.
    """
    chosen = KINDS if kinds is None else [_kind(one) for one in kinds]
    classes: list[Any] = [one for one in [*chosen, *further] if isinstance(one, type)]
    suggested = [one.suggest(experiment) for one in classes]
    given = [one for one in further if not isinstance(one, type)]
    return Library(experiment, (*(effect for each in suggested for effect in each), *given))


def kind_of(effect: Effect) -> str:
    """Return the name of the kind of an effect, whatever its own name."""
    return type(effect).name


def _kind(word: str | type[Effect]) -> type[Effect]:
    if isinstance(word, type):
        return word
    known = {one.name: one for one in KINDS}
    if word not in known:
        near = difflib.get_close_matches(word, known, n=1)
        meant = f" Did you mean {near[0]!r}?" if near else ""
        raise InputError(
            f"There is no effect {word!r}.{meant} The effects are {', '.join(known)}; one of your "
            "own goes in as a class: library(experiment, further=[MyEffect])."
        )
    return known[word]
