"""Names that most files of effects need, from one place."""

# ruff: noqa: F401

from .._ranges import (
    ANGLE,
    DELAY,
    NOT_NEGATIVE,
    ORDER,
    POSITIVE,
    RATE,
    RELATIVE,
    SHARE_LOST,
    SHARE_OF_CRITICAL,
    SIGNED_LOSS_FACTOR,
    SIZE,
)
from .._sites import STANDS_FOR, is_unknown, unit
from .._types import InputError, Parameter, Receptance
from ..laws import Dashpot, Law, Mass, Spring
from ..modes.modes import Modes
from ..modes.points import Points
from .amplitude_attachment import AmplitudeAttachment
from .effect import (
    OF_CHANNELS,
    AtPlace,
    Direction,
    GlobalChange,
    Hinged,
    Location,
    Modulus,
    NetworkAttachment,
    Omega,
    OnPorts,
    Place,
    Stiffness,
    StructureEffect,
    placed,
)
from .instrument_effect import Factor, InstrumentEffect
from .instruments import Instruments, Number
from .on_rotation import Footprint, OnRotation, bending_scale
from .over_extent import Extent, OverExtent
from .scales import Scales
from .signed import log_uniform_of_either_sign
