"""structure: in, modes and a damping law; out, one structure whose response can be asked for.

Not known here: sensors, actuators, probability.
"""

import equinox as eqx

from .damping import Damping
from .modes import Modes


class Structure(eqx.Module):
    """A vibrating structure: its modes and how they lose energy.

    Parameters
    ----------
    modes
        Natural frequencies and mode shapes, for example `beams.bar(...)`.
    damping
        Damping law, for example `damping.Modal([0.04])`.
    """

    modes: Modes
    damping: Damping

    def __init__(self, modes: Modes, *, damping: Damping):
        self.modes = modes
        self.damping = damping
