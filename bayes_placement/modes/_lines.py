"""_lines: in, the modes that an effect was added to; out, the uniform line or beam that it needs.

Not known here: any single effect, data.
"""

from .._types import InputError
from .beams.beams import UniformBeam
from .beams.uniform_line import UniformLine
from .changed import line_of
from .finite_elements.nodal_modes import nodal_of
from .modes import Modes


def uniform_line(modes: Modes, effect: str, instead: str) -> UniformLine:
    """Return the uniform bar or beam that an effect needs.

    Raises
    ------
    ValueError
        If there is none, with what a finite element model takes instead.
    """
    if nodal_of(modes) is not None:
        raise InputError(
            f"{effect} was added to a finite element model, but it needs the section of a uniform "
            f"bar or beam, which a model does not tell. {instead}"
        )
    return line_of(modes)


def uniform_beam(modes: Modes, effect: str, why: str, instead: str) -> UniformBeam:
    """Return the uniform beam that an effect needs.

    Raises
    ------
    ValueError
        If there is none; `why` says what a bar lacks.
    """
    line = uniform_line(modes, effect, instead)
    if not isinstance(line, UniformBeam):
        raise InputError(f"{effect} was added to a bar, {why}. Use it on beams.beam.")
    return line
