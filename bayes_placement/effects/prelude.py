"""Names that most files of effects need, from one place."""

# ruff: noqa: F401

from equinox import field
from numpyro.distributions import LogUniform, Uniform

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import (
    NOT_NEGATIVE,
    POSITIVE,
    RATE,
    RELATIVE,
    SIGNED_LOSS_FACTOR,
    log_uniform_of_either_sign,
    negative_log_uniform,
)
from .._shared.sites import unit
from ..laws import Dashpot, Law, Mass, Spring, Springpot
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import PortLaw
from ..positions.places import coordinates
from .effect import (
    OF_CHANNELS,
    Footprint,
    GlobalChange,
    Hinged,
    Location,
    Modulus,
    NetworkAttachment,
    Omega,
    OnRotation,
    Stiffness,
    StructureEffect,
    at_each,
    bending_scale,
    check_rotation,
)
from .instrument_effect import Factor, InstrumentEffect
from .instruments import Instruments, Number
from .on_transducer import OfSide, OnTransducer, channels
from .scales import Scales
