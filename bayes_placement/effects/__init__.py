"""Physical effects that a structure or its instruments may have, one a file."""

from ..laws import Dashpot, LossySpring, Mass, Spring, Springpot, Tabulated
from .amplitude_attachment import AmplitudeAttachment
from .effect import Attachment, Effect, GlobalChange, Hinged, Modulus, NetworkAttachment, OnPorts
from .instrument_effect import InstrumentEffect
from .library import EFFECTS, Library, library
from .on_transducer import OnTransducer
from .registry import *  # noqa: F403
from .scales import Scales

__all__ = [
    "EFFECTS",
    "AmplitudeAttachment",
    "Attachment",
    "Dashpot",
    "Effect",
    "GlobalChange",
    "Hinged",
    "InstrumentEffect",
    "Library",
    "LossySpring",
    "Mass",
    "Modulus",
    "NetworkAttachment",
    "OnPorts",
    "OnTransducer",
    "Scales",
    "Spring",
    "Springpot",
    "Tabulated",
    "library",
]
__all__ += [*EFFECTS]
