"""Where a transducer or an effect may sit on a structure, and how it may be rotated."""

from .places import AtNode, Cartesian, InBall, OnMember, OnPatch
from .tolerances import Ball, Box, Member, Nodes, Patch, Segment, Tolerance
from .vectors import rotation

__all__ = [
    "AtNode",
    "Ball",
    "Box",
    "Cartesian",
    "InBall",
    "Member",
    "Nodes",
    "OnMember",
    "OnPatch",
    "Patch",
    "Segment",
    "Tolerance",
    "rotation",
]
