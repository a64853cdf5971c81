"""_part_factors: in, parameters and powers of them; out, the range of each part's factor.

Not known here: matrices, modes, which physical quantity a parameter is.
"""

from collections.abc import Collection, Mapping
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from ..._sites import is_unknown
from ..._types import InputError, Parameter

TAIL = 1e-4
"""Probability to either side of the range of a law."""

DRAWS = 20000  # of a law whose quantiles are not known in closed form
SLACK = 1e-3  # by which a range is widened, so that a number has one

Range: TypeAlias = tuple[float | int, float | int]
Powers: TypeAlias = Mapping[str, Mapping[str, float | int]]
"""For each part of the matrices, the power of each parameter in its factor."""


def complete(powers: Powers, parts: Collection[str], parameters: Collection[str]) -> Powers:
    """Powers of all parts: one, of the parameter of the same name, where nothing was said.

    Raises
    ------
    ValueError
        If a power belongs to no part, a part to no parameter, or a parameter to no part.
    """
    found = {part: powers.get(part, {part: 1}) for part in parts}
    strange = [part for part in powers if part not in found]
    if strange:
        raise InputError(
            f'powers names "{strange[0]}", but the parts that can be scaled are '
            f'{_listed(parts)}. Give its matrix: stiffness={{"{strange[0]}": ...}}, or mass.'
        )
    for part, each in found.items():
        unknown = [name for name in each if name not in parameters]
        if unknown or not each:
            raise InputError(
                f'The part "{part}" is scaled by {_listed(unknown)}, but the parameters are '
                f"{_listed(parameters)}; each part needs at least one of them. Say which: "
                f'powers={{"{part}": {{"{next(iter(parameters), "thickness")}": 1}}}}.'
            )
    idle = set(parameters) - {name for each in found.values() for name in each}
    if idle:
        raise InputError(
            f"The parameter {_listed(sorted(idle))} scales nothing; the parts are "
            f"{_listed(parts)}. A parameter needs the name of a region or a matrix of its own, "
            f'since it would have no effect: stiffness={{"{min(idle)}": ...}}, or mass.'
        )
    return found


def ranges(
    parameters: Mapping[str, Parameter], powers: Powers, given: Mapping[str, Range]
) -> dict[str, tuple[float, float]]:
    """Least and greatest factor of each part [1].

    Parameters
    ----------
    parameters
        Numbers, which are their own range, or laws, whose range lies between two quantiles.
    powers
        Powers of the parameters in the factor of each part.
    given
        Ranges of some parameters that are known better.

    Raises
    ------
    ValueError
        If a range is not positive.
    """
    known = {
        name: _checked(name, given.get(name) or _range(value)) for name, value in parameters.items()
    }
    return {part: _product(known, each) for part, each in powers.items()}


def _product(known: Mapping[str, Range], each: Mapping[str, float | int]) -> tuple[float, float]:
    ends = np.array([sorted(end**power for end in known[name]) for name, power in each.items()])
    low, high = np.prod(ends, axis=0)
    return float(low * (1 - SLACK)), float(high * (1 + SLACK))


def _range(value: Parameter) -> Range:
    if not is_unknown(value):
        return float(value), float(value)
    try:
        low, high = jax.jit(lambda: value.icdf(jnp.array([TAIL, 1 - TAIL])))()
    except (NotImplementedError, ImportError):  # some need a library that is not required
        draws = jax.jit(lambda: value.sample(jax.random.PRNGKey(0), (DRAWS,)))()
        low, high = jnp.min(draws), jnp.max(draws)
    return float(low), float(high)


def _checked(name: str, limits: Range) -> Range:
    low, high = limits
    if not 0 < low <= high < np.inf:
        raise InputError(
            f'The parameter "{name}" ranges from {low:g} to {high:g}; values over the nominal one '
            "are needed, positive, since stiffness and mass are scaled by them. Give a law that "
            f'stays positive, or say the range: ranges={{"{name}": (0.8, 1.25)}}.'
        )
    return limits


def _listed(names: Collection[str]) -> str:
    return ", ".join(f'"{name}"' for name in names) or "none"
