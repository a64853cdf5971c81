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
    SIGNED_LOSS_FACTOR,
    SIZE,
    Range,
    ends,
)
from .._sites import is_unknown, unit
from .._types import InputError, Parameter
from ..laws import Dashpot, Law, Mass, Spring, Springpot
from ..modes.modes import Modes
from ..modes.points import Points
from ..positions.places import coordinates
from .amplitude_attachment import AmplitudeAttachment
from .effect import (
    OF_CHANNELS,
    Direction,
    GlobalChange,
    Hinged,
    Location,
    Modulus,
    NetworkAttachment,
    Omega,
    Place,
    Stiffness,
    StructureEffect,
    at_each,
)
from .instrument_effect import Factor, InstrumentEffect
from .instruments import Instruments, Number
from .of_side import OfSide
from .on_rotation import Footprint, check_rotation
from .on_transducer import OnTransducer, channels
from .over_extent import Extent, OverExtent
from .port_law import PortLaw
from .scales import Scales
from .signed import log_uniform_of_either_sign, negative_log_uniform, where_negative
