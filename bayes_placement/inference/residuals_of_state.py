"""Residuals of one state of a structure, compiled once for all experiments of one form."""

import functools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from .._shared.compiled import Bound, compiled
from .._shared.sites import Unknown
from ..effects.effect import Modulus, take_long
from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ..experiment.with_effects_applied import AppliedLaw, AppliedModulus
from .batches import (
    BATCH,
    BatchedFunction,
    Form,
    batch,
    distinct_rows,
    threaded_map,
    without_priors,
)
from .coordinates import Coordinates
from .engines.least_squares import ParameterPoints
from .output_residuals import Logarithmic, standardised_residual

AtPoints = Float[Array, "point unknown"]
Standardised = tuple[Float[Array, "point datum"], Float[Array, "point"]]


class State(NamedTuple):
    """An experiment, and what was measured in it."""

    experiment: Experiment
    """The experiment."""
    data: Data
    """Measured outputs."""
    unknowns: frozenset[str] = frozenset()
    """Names of unknowns that have values of their own in this state."""


class ResidualsOfState:
    """Compiled residuals of one state, at points in the coordinates of a problem.

    Sizes of its model error are known; `effort` is how much the compiler tries.
    """

    def __init__(self, state: State, number: int, coordinates: Coordinates, effort: int):
        mine = coordinates_of(state.experiment, standard_normal=False)
        places = [
            coordinates.places[name_in_state(name, number) if name in state.unknowns else name]
            for name in mine.places
        ]
        columns = [np.arange(place.start, place.stop) for place in places]
        self.columns = np.concatenate([np.zeros(0, dtype=int), *columns])
        self._state, self._effort, self._coordinates = state, effort, mine
        self._declared = without_priors(state.experiment)
        self._batch = compiled(batch).bound(self._declared, effort=0)
        self._batched = BatchedFunction(self._of_batch)

    @property
    def size(self) -> int:
        """Number of residuals, zero where nothing was measured."""
        return int(np.size(self._state.data.z))

    def fill(
        self, arrays: tuple[np.ndarray, np.ndarray], points: ParameterPoints, logarithmic: bool
    ) -> None:
        """Write residuals [point, datum] and sums of logs [point] into arrays."""
        mine = points[:, self.columns]
        # What another state alone has does not change this one: each point is computed once.
        first, which = distinct_rows(mine)
        if len(first) == len(mine):
            self._batched.fill(arrays, mine, logarithmic)
            return
        fewer = tuple(np.empty_like(array[: len(first)]) for array in arrays)
        self._batched.fill(fewer, mine[first], logarithmic)
        for array, values in zip(arrays, fewer, strict=True):
            array[:] = values[which]

    def _of_batch(self, points: ParameterPoints, logarithmic: bool) -> Standardised:
        return self._residuals(self._numbers(points), logarithmic)

    def _numbers(self, points: ParameterPoints) -> list[object]:
        """Numbers of the experiments at a batch of points."""
        return self._batch(self._coordinates.numbers(points)).numbers

    def with_laws(
        self, points: ParameterPoints, laws: Complex[np.ndarray, "point law pair frequency"]
    ) -> Float[np.ndarray, "point law datum"]:
        """Residuals at points with other laws on the ports of the last effect, or in its modulus.

        Points are in the coordinates of the problem. A law is a numerator and a denominator at each
        line, over those of the law that the effect has: of a law of one, these say how it acts
        there.
        """
        mine, count = points[:, self.columns], laws.shape[1]
        parts = laws if len(self._law_leaves) > 1 else laws[:, :, :1] / laws[:, :, 1:]
        residual = np.empty((len(points), count, self.size))

        def of(begin: int) -> None:
            rows = np.minimum(np.arange(begin, begin + BATCH), len(points) - 1)
            numbers = self._numbers(mine[rows])
            units = [np.asarray(numbers[leaf]) for leaf in self._law_leaves]
            for law in range(count):
                for part, (leaf, unit) in enumerate(zip(self._law_leaves, units, strict=True)):
                    numbers[leaf] = parts[rows, law, part] * unit
                values = np.asarray(self._residuals(numbers, False)[0])
                residual[begin : begin + BATCH, law] = values[: len(points) - begin]

        begins = range(0, len(points), BATCH)
        of(begins[0])  # alone, since two threads would both compile
        threaded_map(of, begins[1:])
        return residual

    @property
    def _any_values(self) -> Float[np.ndarray, "point number"]:
        """Values of the shapes of a batch."""
        return np.zeros((BATCH, self._coordinates.count))

    @functools.cached_property
    def _law_leaves(self) -> list[int]:
        """Places of the law of the last effect among the numbers of a batch.

        Of its numerator and its denominator; of a modulus of what is added to it.
        """
        form = self._batch.outcome(self._any_values).form
        leaves = jax.tree.unflatten(form.structure, range(len(form.sources)))
        declared = [*self._state.experiment.structure.effects.values()]
        is_modulus = isinstance(declared[-1], Modulus)
        kind = AppliedModulus if is_modulus else AppliedLaw
        effects = leaves.structure.effects.values()
        last: Any = [effect for effect in effects if isinstance(effect, kind)][-1]
        law = [last.excess] if is_modulus else [last.numerator, last.denominator]
        inputs = [leaf for leaf, source in enumerate(form.sources) if source is None]
        return [inputs.index(leaf) for leaf in law]

    def prepare(self) -> None:
        """Compile them, unless that is done. Any thread may."""
        self._batch.prepare(self._any_values)
        self._residuals.prepare(self._batch.outcome(self._any_values).numbers, False)

    @functools.cached_property
    def _residuals(self) -> Bound[Standardised]:
        """Residuals of experiments of this form: one function for all hypotheses that share it."""
        form = self._batch.outcome(self._any_values).form
        shared, data = form.shared(self._declared), self._state.data
        # With many ports the matrices of one point fill the cache of a core, those of a batch
        # memory that is new at each call.
        one_by_one = take_long(self._state.experiment.effects)
        return compiled(_residuals).bound(
            form.apart_from_declared(), shared, data, one_by_one, effort=self._effort
        )


class TracedResiduals(eqx.Module):
    """Residuals of all states, for compiled functions that serve all problems of one form."""

    states: tuple[tuple[Experiment, Data], ...]
    """Experiment and data of each state, the experiments' model errors of known sizes."""
    columns: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    """Coordinates of the problem that are those of each state."""

    def __call__(self, points: AtPoints, logarithmic: Logarithmic) -> Standardised:
        """Residuals [point, datum] and sums of logs [point]."""
        parts = zip(self.states, self.columns, strict=True)
        return _joined(
            [_at_points(*state, points[:, list(columns)], logarithmic) for state, columns in parts]
        )


def _joined(parts: Sequence[Standardised]) -> Standardised:
    """Residuals and sums of logs of all states from those of each."""
    residuals, log_scales = zip(*parts, strict=True)
    return jnp.concatenate(residuals, axis=1), sum(log_scales[1:], log_scales[0])


def name_in_state(name: str, number: int) -> str:
    """Name of an unknown that has a value of its own in one of the states."""
    return f"{name} of state {number}"


def coordinates_of(
    experiment: Experiment,
    *,
    standard_normal: bool = True,
    further: Mapping[str, Unknown] = MappingProxyType({}),
) -> Coordinates:
    """Coordinates of the unknowns of an experiment, and of further ones after them."""
    distributions = {unknown.name: unknown.distribution for unknown in experiment.unknowns}
    distributions |= {name: unknown.distribution for name, unknown in further.items()}
    return Coordinates(distributions, standard_normal=standard_normal)


def _residuals(
    form: Form,
    shared: Sequence[object],
    data: Data,
    one_by_one: bool,
    numbers: Sequence[Array],
    logarithmic: Logarithmic,
) -> Standardised:
    """Residuals of a batch of experiments, all their numbers being inputs."""

    def of(numbers: Sequence[Array]) -> tuple[Array, Array]:
        return standardised_residual(form.filled(numbers, shared), data, logarithmic)

    return jax.lax.map(of, numbers) if one_by_one else jax.vmap(of)(numbers)


def _at_points(
    experiment: Experiment, data: Data, points: AtPoints, logarithmic: Logarithmic
) -> Standardised:
    """Residuals of a batch of points, for a function that is compiled around them."""
    coordinates = coordinates_of(experiment, standard_normal=False)

    def at(point: Float[Array, "unknown"]) -> tuple[Array, Array]:
        return standardised_residual(experiment.fix(coordinates.values(point)), data, logarithmic)

    return jax.vmap(at)(points)
