"""Places on a structure of many nodes: a scan leaves a hundred of each kind of port.

Where descents at a few places would already take long, all nodes are scanned to first order, at all
lines. What follows is done at the places of the greatest share that any law there could remove.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri

from ..._shared.sites import is_unknown
from ...experiment.noise import Data
from ...experiment.variants import evenly_spread
from ...inference.engines.levenberg_marquardt import LARGEST
from ...inference.residuals import Problem
from ...modes.finite_elements.nodal_modes import nodal_of
from ...modes.finite_elements.outline import outline
from ...positions.places import Cartesian
from ._by_modes import BEST, ScanByModes
from ._free_law import tells_phase
from ._ports import Port, grid

MOST_NUMBERS = 2**22
"""Residuals at all places of a grid above which a scan comes first: descents there take minutes."""

MOST_DATA, FEWEST_LINES = 2**17, 64
"""Data to which laws are fitted, of which a sample of lines tells as much; and lines at least."""

Nodes = Float[np.ndarray, "place end 3"]
"""Positions of one or two ends [m]."""


class Scanned(NamedTuple):
    """Places of a kind of port that a scan leaves, those of the least cost.

    `squares` are the least sums of squares with any law there, priors included; `scanned` places
    were scanned, each as probable as the others.
    """

    places: Float[np.ndarray, "place coordinate"]
    squares: Float[np.ndarray, "place"]
    scanned: int


def step_of_fits(data: Data) -> int:
    """Number of lines of which one is taken where laws are fitted."""
    step = -(-data.z.size // MOST_DATA)
    return max(1, min(step, data.z.shape[-1] // FEWEST_LINES))


def scanned(
    problem: Problem, point: Float[np.ndarray, "unknown"], ports: Sequence[Port], whole: Problem
) -> list[Scanned | None]:
    """Scan the places of each kind of port; None of those whose places are a small grid.

    The problem is at the lines at which laws are fitted, `whole` at all; the point is the fit of
    the model.
    """
    nodes = [_nodes(port, whole) for port in ports]
    found: list[Scanned | None] = [None] * len(ports)
    if all(each is None for each in nodes):
        return found
    scan = ScanByModes(whole, point)
    for alike in _alike(ports, nodes):
        at = nodes[alike[0]]
        placed = [_Placed(ports[number], problem, at) for number in alike if at is not None]
        values = placed[0].of_effect()
        shapes = scan.motions.readings([each.effect for each in placed], values)
        for number, each, of_port in zip(alike, placed, shapes, strict=True):
            costs = scan.costs(of_port)
            best = np.argsort(costs)[:BEST]
            found[number] = Scanned(
                each.coordinates()[best], 2 * costs[best] * problem.count / whole.count, len(costs)
            )
    return found


class _Placed:
    """A port at many places, in the problem without it; `nodes` are its one or two ends [m]."""

    def __init__(self, port: Port, base: Problem, nodes: Nodes):
        experiment = base.with_effect(port.effect).experiment
        self.effect, fields = port.effect_in(experiment), port.effect.place_fields
        self._unknowns = [
            each for each in experiment.unknowns_of(self.effect) if each.field in fields
        ]
        self._values = [
            nodes[:, fields.index(each.field), "xyz".index(each.component)]
            for each in self._unknowns
        ]

    def of_effect(self) -> dict[str, Float[np.ndarray, "place"]]:
        """Values of the unknowns of its place, by their names in the effect."""
        return {
            f"{each.field}.{each.component}": value
            for each, value in zip(self._unknowns, self._values, strict=True)
        }

    def coordinates(self) -> Float[np.ndarray, "place coordinate"]:
        """Coordinates of the problem, a little inside of the edges of priors."""
        columns = [
            ndtri(np.asarray(each.distribution.cdf(value)))
            for each, value in zip(self._unknowns, self._values, strict=True)
        ]
        return np.clip(np.stack(columns, axis=1), -LARGEST, LARGEST)


def _nodes(port: Port, whole: Problem) -> Nodes | None:
    """Positions of the ends of a port, all nodes of a mesh or as many pairs; None of a small grid.

    None too where a law comes in otherwise than by the modes alone.
    """
    ends: list[object] = [getattr(port.effect, field) for field in port.effect.place_fields]
    count = sum(len(_free_axes(end)) for end in ends)
    is_small = count == 0 or len(grid(port, count)) * whole.count < MOST_NUMBERS
    if is_small or port.is_cut or not _is_plain(whole):
        return None
    lines, _ = outline(whole.experiment.structure.modes)
    nodes = np.unique(lines[np.isfinite(lines).all(axis=1)], axis=0)
    if len(ends) == 1:
        return nodes[:, None]
    fewer = nodes[evenly_spread(len(nodes), min(len(nodes), int(np.sqrt(2 * len(nodes)))))]
    first, second = np.triu_indices(len(fewer), k=1)
    return np.stack([fewer[first], fewer[second]], axis=1)


def _is_plain(problem: Problem) -> bool:
    """Whether laws change complex FRFs of one exact state by the modes of a mesh alone."""
    experiment = problem.experiment
    is_alone = problem.baseline is None and not problem.further
    is_exact = experiment.model_error is None and not experiment.instrument_effects
    is_meshed = nodal_of(experiment.structure.modes) is not None
    return is_alone and is_exact and is_meshed and tells_phase(problem)


def _free_axes(place: object) -> list[str]:
    """Coordinates of a box that are unknown; none of another place."""
    return (
        [name for name in "xyz" if is_unknown(getattr(place, name))]
        if isinstance(place, Cartesian)
        else []
    )


def _alike(ports: Sequence[Port], nodes: Sequence[Nodes | None]) -> list[list[int]]:
    """Numbers of the ports on the same places."""
    groups: dict[str, list[int]] = {}
    for number, (port, at) in enumerate(zip(ports, nodes, strict=True)):
        if at is not None:
            ends = [getattr(port.effect, field) for field in port.effect.place_fields]
            groups.setdefault(repr(ends), []).append(number)
    return [*groups.values()]
