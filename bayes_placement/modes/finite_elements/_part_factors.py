"""Parts of the matrices: ranges of their factors, and their matrices over the modes."""

from collections.abc import Collection, Mapping
from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution

from ..._shared.compiled import compiled, of_jax
from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ..._shared.sites import is_unknown
from ...positions.channel import printable_name

TAIL = 1e-4
"""Probability on either side of the range of a distribution."""

DRAWS = 20000  # of a distribution whose quantiles have no closed form
SLACK = 1e-3  # by which a range is widened, so that that of a number is not empty

Range: TypeAlias = tuple[float | int, float | int]
Powers: TypeAlias = Mapping[str, Mapping[str, float | int]]
"""For each part of the matrices, the power of each parameter in its factor."""


def complete(powers: Powers, parts: Collection[str], parameters: Collection[str]) -> Powers:
    """Powers of all parts; by default 1, of the parameter of the same name."""
    completed = {part: powers.get(part, {part: 1}) for part in parts}
    unknown_parts = [part for part in powers if part not in completed]
    if unknown_parts:
        raise InputError(
            f'powers names "{unknown_parts[0]}", but the parts that can be scaled are '
            f'{_quoted(parts)}. Give its matrix: stiffness={{"{unknown_parts[0]}": ...}}, or mass.'
        )
    for part, of_part in completed.items():
        unknown = [name for name in of_part if name not in parameters]
        if unknown or not of_part:
            raise InputError(
                f'The part "{part}" is scaled by {_quoted(unknown)}, but the parameters are '
                f"{_quoted(parameters)}; each part needs at least one of them. State which: "
                f'powers={{"{part}": {{"{next(iter(parameters), "thickness")}": 1}}}}.'
            )
    unused = set(parameters) - {name for of_part in completed.values() for name in of_part}
    if unused:
        raise InputError(
            f"The parameter {_quoted(sorted(unused))} scales nothing; the parts are "
            f"{_quoted(parts)}. A parameter needs the name of a region or a matrix of its own, "
            f'since it would have no effect: stiffness={{"{min(unused)}": ...}}, or mass.'
        )
    return completed


def ranges(
    parameters: Mapping[str, Parameter], powers: Powers, known: Mapping[str, Range]
) -> dict[str, tuple[float, float]]:
    """Least and greatest factor of each part [1], by powers of parameters.

    The range of a distribution lies between two quantiles, where it is not known otherwise.
    """
    limits = {
        name: _checked(name, known.get(name) or _range(value)) for name, value in parameters.items()
    }
    return {part: _product(limits, of_part) for part, of_part in powers.items()}


def _product(limits: Mapping[str, Range], powers: Mapping[str, float | int]) -> tuple[float, float]:
    ends = np.array([sorted(end**power for end in limits[name]) for name, power in powers.items()])
    low, high = np.prod(ends, axis=0)
    return float(low * (1 - SLACK)), float(high * (1 + SLACK))


def _range(value: Parameter) -> Range:
    if not is_unknown(value):
        return float(value), float(value)
    try:
        low, high = compiled(_quantiles)(value)
    except (NotImplementedError, ImportError):  # some need a library that is not required
        low, high = compiled(_extremes)(value)
    return float(low), float(high)


def _quantiles(distribution: Distribution) -> Float[Array, "2"]:
    return distribution.icdf(jnp.array([TAIL, 1 - TAIL]))


def _extremes(distribution: Distribution) -> tuple[Float[Array, ""], Float[Array, ""]]:
    draws = distribution.sample(jax.random.PRNGKey(0), (DRAWS,))
    return jnp.min(draws), jnp.max(draws)


def _checked(name: str, limits: Range) -> Range:
    low, high = limits
    if not 0 < low <= high < np.inf:
        raise InputError(
            f'The parameter "{name}" ranges from {low:g} to {high:g}; values over the nominal one '
            "are needed, positive, since stiffness and mass are scaled by them. Give a "
            "distribution "
            f'of positive values, or its range: ranges={{"{name}": (0.8, 1.25)}}.'
        )
    return limits


def _quoted(names: Collection[str]) -> str:
    return ", ".join(f'"{name}"' for name in names) or "none"


class NamedMatrices(eqx.Module):
    """Matrices over the modes, each named after a part of the structure."""

    matrices: Float[Array, "part mode mode"]
    names: tuple[str, ...] = eqx.field(static=True)

    def __repr__(self) -> str:
        return ", ".join(self.names) or "none"

    @classmethod
    def of(cls, parts: Mapping[str, np.ndarray], count: int) -> "NamedMatrices":
        """Stack matrices over `count` modes by name; there may be none."""
        for name, part in parts.items():
            printable_name("A part of the name", name)
            if np.shape(part) != (count, count):
                raise InputError(
                    f'The part "{name}" has the shape {np.shape(part)}; a matrix of {count} rows '
                    "and columns is needed, one for each mode, since it is over the modes: "
                    "shape.T @ part @ shape."
                )
        stacked = np.stack(list(parts.values())) if parts else np.zeros((0, count, count))
        return cls(of_jax(stacked), tuple(parts))
