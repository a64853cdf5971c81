"""Parts of a model over its modes: ranges of their factors, matrices, masses of cells of nodes."""

from collections.abc import Collection, Mapping
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpyro.distributions import Distribution

from ..._shared.compiled import compiled, of_jax
from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ..._shared.sites import is_unknown
from ...positions.channel import printable_name
from .matrices import Matrices
from .modal_model import ModalModel

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


CELLS = 36
"""Most cells."""

ROUNDING = 1e-9
"""Distance of nodes that share their place, over the length of the model."""


def cell_masses(matrices: Matrices, model: ModalModel) -> Float[np.ndarray, "cell mode mode"]:
    """Mass of each cell over the modes; that of all cells is the mass of the model.

    Regions are made for stiffness, and few. What is forgotten of the mass sits at a point, and
    modes of half-waves as long as a region feel where in it.
    """
    cell = _cells(matrices.position)[matrices.node_index]
    inertia = matrices.mass @ model.shape
    masses = []
    for number in np.unique(cell):
        rows = cell == number
        product = model.shape[rows].T @ inertia[rows]
        # What couples nodes of two cells belongs to both by halves.
        masses.append((product + product.T) / 2)
    return np.stack(masses)


def checked_cell_masses(
    masses: np.ndarray | None, count: int
) -> Float[np.ndarray, "cell mode mode"]:
    """Return masses of cells over so many modes; by default all is one cell."""
    if masses is None:
        return np.eye(count)[None]
    if np.ndim(masses) != 3 or np.shape(masses)[1:] != (count, count) or not len(masses):
        raise InputError(
            f"cell_masses of shape {np.shape(masses)} was given; [cell, {count}, {count}] is "
            "needed, since the mass of each cell is over the modes: "
            "np.stack([shape.T @ part @ shape for part in parts])."
        )
    return np.asarray(masses)


def _cells(position: Float[np.ndarray, "node 3"]) -> Int[np.ndarray, "node"]:
    """Cell of each node: the longest cell is halved, until there are enough.

    By its length, not by the number of nodes: a mesh may be finer somewhere.
    """
    cells = [_Cell.of(np.arange(len(position)), position)]
    least = ROUNDING * cells[0].length
    while len(cells) < min(CELLS, len(position)):
        longest = int(np.argmax([cell.length for cell in cells]))
        if cells[longest].length <= least:  # the nodes that are left share their places
            break
        cells[longest : longest + 1] = [_Cell.of(half, position) for half in cells[longest].halves]
    cell_of_node = np.empty(len(position), dtype=int)
    for number, cell in enumerate(cells):
        cell_of_node[np.concatenate(cell.halves)] = number
    return cell_of_node


class _Cell(NamedTuple):
    """Length of the longest side of the box about some nodes [m], and these beside its middle."""

    length: float
    halves: tuple[Int[np.ndarray, "below"], Int[np.ndarray, "beyond"]]

    @classmethod
    def of(cls, nodes: Int[np.ndarray, "node"], position: Float[np.ndarray, "all 3"]) -> "_Cell":
        """Return the cell of some nodes."""
        low, high = position[nodes].min(axis=0), position[nodes].max(axis=0)
        side = int(np.argmax(high - low))
        is_beyond = position[nodes, side] > (low + high)[side] / 2
        return cls(float(high[side] - low[side]), (nodes[~is_beyond], nodes[is_beyond]))
