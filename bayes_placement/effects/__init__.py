"""Physical effects that a structure or its instruments may have, one a file."""

from .effect import (
    Attachment,
    CubicAttachment,
    Effect,
    GlobalChange,
    Hinged,
    Modulus,
)
from .instrument_effect import InstrumentEffect
from .library import EFFECTS, Library, library
from .on_transducer import OnTransducer
from .registry import *  # noqa: F403
from .scales import Scales

__all__ = [
    "EFFECTS",
    "Attachment",
    "CubicAttachment",
    "Effect",
    "GlobalChange",
    "Hinged",
    "InstrumentEffect",
    "Library",
    "Modulus",
    "OnTransducer",
    "Scales",
    "library",
]
__all__ += [*EFFECTS]
