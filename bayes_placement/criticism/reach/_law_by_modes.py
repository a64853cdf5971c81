"""A law that is free at each line, at places of a structure of many nodes, by motions of modes."""

import functools

import numpy as np
from jaxtyping import Float

from ...effects.effect import OnPorts
from ...inference.engines.least_squares import STEP
from ...inference.residuals import Problem
from ._free_factor import Responses
from ._free_law import AtPort, Channels, FreeLaw, Lines, Points, over
from ._motions import Motions, form
from ._slopes import Slopes, Sparsity


class LawByModes:
    """What `FreeLaw` is, each receptance to a place being a product of its shapes with motions.

    `base` is the problem without the port, `free` with it; the effect is the port of `base` and a
    law.
    """

    def __init__(self, base: Problem, free: FreeLaw, effect: OnPorts):
        self.problem, self.held = free.problem, free.held
        self._base, self._free, self._effect = base, free, effect
        self._responses = Responses(base)
        places = free.problem.coordinates.places
        columns = [
            np.arange(places[name].start, places[name].stop) for name in base.coordinates.places
        ]
        self._columns = np.concatenate([np.zeros(0, dtype=int), *columns])
        self._place = {
            each.name: f"{each.field}.{each.component}".rstrip(".")
            for each in free.problem.experiment.unknowns_of(effect)
            if each.field in effect.place_fields
        }

    def size(self) -> float:
        """Median of 1 / |h| over the lines, at the medians of all priors."""
        return self._free.size()

    @functools.cached_property
    def sparsity(self) -> Sparsity:
        """Which residuals each unknown changes; none what is held."""
        return self._free.sparsity

    def at(self, points: Points) -> AtPort:
        """What a law does at points; motions are computed once for those that share all else."""
        others, which = np.unique(points[:, self._columns], axis=0, return_inverse=True)
        parts = [self._at(other, points[which == number]) for number, other in enumerate(others)]
        order = np.argsort(np.argsort(which, kind="stable"), kind="stable")
        return AtPort(*(np.concatenate(each)[order] for each in zip(*parts, strict=True)))

    def _at(self, other: Float[np.ndarray, "coordinate"], points: Points) -> AtPort:
        residual, response = (each[0] for each in self._responses.at(other[None]))
        motions, named = Motions(self._base, other), self.problem.coordinates.named(points)
        values = {component: named[name] for name, component in self._place.items()}
        moved = np.ascontiguousarray(np.swapaxes(motions.at_lines(slice(None)), 0, 1))
        read, driven = moved[: motions.sensors], moved[motions.sensors :]
        channels = len(read), len(driven), -1
        weight = over(
            response.reshape(channels), np.einsum("sk,akl->sal", motions.at_sensors, driven)
        )
        (shapes,) = motions.readings([self._effect], values)
        to_place, from_place = form(shapes, read), form(shapes, driven)
        slope = -np.einsum("sal,spl,apl->psal", weight, to_place, from_place, optimize=True)
        return AtPort(
            np.repeat(residual[None], len(points), axis=0),
            slope.reshape(len(points), *residual.shape),
            motions.receptances(self._effect, values),
        )

    def about(self, points: Points, stiffness: Lines) -> AtPort:
        """Return the same, which is so for any law."""
        return self.at(points)

    def residuals(self, points: Points, numerator: Lines, denominator: Lines) -> Channels:
        """Residuals with a law, numerator over denominator."""
        at = self.at(points)
        return at.left(numerator / (denominator + at.receptance * numerator))

    def slopes(self, points: Points, numerator: Lines, denominator: Lines) -> Slopes:
        """Slopes of the residuals along all unknowns, the law held; zero along what is held."""
        directions = self.problem.squares.column_groups.directions()
        directions[:, self.held] = 0.0
        steps = np.concatenate([np.zeros((1, points.shape[1])), STEP * directions])
        around = (points[:, None] + steps).reshape(-1, points.shape[1])
        laws = (np.repeat(part, len(steps), axis=0) for part in (numerator, denominator))
        residual = self.residuals(around, *laws)
        residual = residual.reshape(len(points), len(steps), *residual.shape[1:])
        return Slopes((residual[:, 1:] - residual[:, :1]) / STEP, self.sparsity)

    def typical(self, at: AtPort) -> Lines:
        """The free law."""
        return at.best()

    def released(self) -> "LawByModes":
        """Return the same: the place stays one of the nodes, between which shapes may step."""
        return self
