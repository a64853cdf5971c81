"""positions: where a thing may sit on a structure, and how it may be turned."""

from .orientation import rotation
from .tolerances import Ball, Box, Member, Nodes, Patch, Segment

__all__ = ["Ball", "Box", "Member", "Nodes", "Patch", "Segment", "rotation"]
