"""The uniform line, beam or finite element model that lies beneath changed modes."""

from .._shared.errors import InputError
from .beams.beams import UniformBeam
from .beams.uniform_line import UniformLine
from .changed import DerivedModes
from .finite_elements.nodal_modes import NodalModes, nodal_of
from .modes import Modes


def original(modes: Modes) -> Modes:
    """Return the modes before all changes."""
    return original(modes.modes) if isinstance(modes, DerivedModes) else modes


def original_line(modes: Modes) -> UniformLine:
    """Return the uniform bar or beam beneath changed modes."""
    line = original(modes)
    if isinstance(line, UniformLine):
        return line
    raise InputError(
        f"This effect was added to {type(line).__name__}, but it needs to know the section of a "
        "uniform bar or beam, which those modes do not tell. Use beams.bar or beams.beam."
    )


def original_nodal_modes(modes: Modes) -> NodalModes:
    """Return the modes of the finite element model beneath changed ones."""
    nodal = nodal_of(original(modes))
    if nodal is not None:
        return nodal
    raise InputError(
        f"This effect was added to {type(original(modes)).__name__}, but it needs the matrices of "
        "a finite element model. Use finite_elements.modes(matrices, ...)."
    )


def required_line(modes: Modes, effect: str, alternative: str) -> UniformLine:
    """Return the line that an effect needs; a finite element model takes an alternative to it."""
    if nodal_of(modes) is not None:
        raise InputError(
            f"{effect} was added to a finite element model, but it needs the section of a uniform "
            f"bar or beam, which a model does not tell. {alternative}"
        )
    return original_line(modes)


def required_beam(modes: Modes, effect: str, reason: str, alternative: str) -> UniformBeam:
    """Return the beam that an effect needs; the reason says what a bar lacks."""
    line = required_line(modes, effect, alternative)
    if not isinstance(line, UniformBeam):
        raise InputError(f"{effect} was added to a bar, {reason}. Use it on beams.beam.")
    return line
