"""The uniform waveguide, beam or finite element model that lies beneath changed modes."""

from .._shared.errors import InputError
from .beams.beams import UniformBeam
from .beams.waveguide import Waveguide
from .changed import DerivedModes
from .finite_elements.nodal_modes import NodalModes, nodal_of
from .modes import Modes


def original(modes: Modes) -> Modes:
    """Return the modes before all changes."""
    return original(modes.modes) if isinstance(modes, DerivedModes) else modes


def original_waveguide(modes: Modes) -> Waveguide:
    """Return the uniform bar or beam beneath changed modes."""
    waveguide = original(modes)
    if isinstance(waveguide, Waveguide):
        return waveguide
    raise InputError(
        f"This effect was added to {type(waveguide).__name__}, but it needs to know the section of "
        "a uniform bar or beam, which those modes do not tell. Use beams.bar or beams.beam."
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


def required_waveguide(modes: Modes, effect: str, alternative: str) -> Waveguide:
    """Return the waveguide that an effect needs; an FE model takes an alternative to it."""
    if nodal_of(modes) is not None:
        raise InputError(
            f"{effect} was added to a finite element model, but it needs the section of a uniform "
            f"bar or beam, which a model does not tell. {alternative}"
        )
    return original_waveguide(modes)


def required_beam(modes: Modes, effect: str, reason: str, alternative: str) -> UniformBeam:
    """Return the beam that an effect needs; the reason says what a bar lacks."""
    waveguide = required_waveguide(modes, effect, alternative)
    if not isinstance(waveguide, UniformBeam):
        raise InputError(f"{effect} was added to a bar, {reason}. Use it on beams.beam.")
    return waveguide
