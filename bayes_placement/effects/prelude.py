"""Names that most files of effects need, from one place."""

# ruff: noqa: F401

from equinox import field
from numpyro.distributions import LogUniform, Uniform

from .._shared.dimensions import Parameter, Receptance
from .._shared.errors import InputError
from .._shared.ranges import (
    ANGLE,
    DELAY,
    LOSS_FACTOR,
    NOT_NEGATIVE,
    ORDER,
    POSITIVE,
    RATE,
    RELATIVE,
    SHARE_LOST,
    SHARE_OF_CRITICAL,
    SIGNED_LOSS_FACTOR,
    SIZE,
    log_uniform_of_either_sign,
    negative_log_uniform,
)
from .._shared.sites import is_unknown, unit
from ..laws import Dashpot, Law, LossySpring, Mass, Spring, Springpot
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import PortLaw
from ..positions.places import coordinates
from .amplitude_attachment import AmplitudeAttachment, circle_segment, limited_share, tried_places
from .effect import (
    OF_CHANNELS,
    AtPlace,
    Attachment,
    Direction,
    Footprint,
    GlobalChange,
    Hinged,
    Location,
    Modulus,
    NetworkAttachment,
    Omega,
    OnPorts,
    OnRotation,
    Place,
    Stiffness,
    StructureEffect,
    at_each,
    bending_scale,
    check_rotation,
    placed,
)
from .instrument_effect import Factor, InstrumentEffect
from .instruments import Instruments, Number
from .on_transducer import OfSide, OnTransducer, channels, sides_that_differ
from .scales import Scales
