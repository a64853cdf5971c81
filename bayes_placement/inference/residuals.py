"""An experiment with data as a problem of least squares over standard normal coordinates."""

import functools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution

from .._compiled import Bound, compiled
from .._sites import Role, Unknown
from .._types import InputError
from ..effects.effect import Effect
from ..experiment.experiment import Experiment
from ..experiment.model_error import shares_size
from ..experiment.noise import Data
from .batches import Form, batch
from .coordinates import Coordinates
from .engines.least_squares import LeastSquares
from .in_batches import BATCH, InBatches
from .standardised_residual import standardised_residual


class State(NamedTuple):
    """An experiment, and what was measured in it.

    Parameters
    ----------
    experiment
        The experiment.
    data
        Measured outputs.
    unknowns
        Names of unknowns that have values of their own in this state.
    """

    experiment: Experiment
    data: Data
    unknowns: frozenset[str] = frozenset()


class Problem:
    """Least squares of an experiment against data.

    Parameters
    ----------
    experiment
        Experiment with Gaussian noise.
    data
        Measured outputs.
    standard_normal
        Whether the prior has to be standard normal in the coordinates.
    sizes
        Sizes of the model error by name, where they are unknown: their joint mode with the errors
        means nothing, so that they are no coordinates but numbers. By default the medians of their
        priors.
    baseline
        An earlier state of the same structure: all unknowns that it has are those of the
        experiment, with the same values. Its data are fitted with those of the experiment.
    effort
        How much the compiler tries, see `Compiled.bound`. By default more where a model error
        makes evaluations take longer than compiling.
    further
        Further earlier states, the same way. An unknown of theirs that the experiment does not have
        must be one of their own.

    Raises
    ------
    InfeasibleError
        If the prior has to be standard normal, and has no inverse distribution function.
    """

    def __init__(
        self,
        experiment: Experiment,
        data: Data,
        *,
        standard_normal: bool = True,
        sizes: Mapping[str, float] | None = None,
        baseline: State | None = None,
        further: Sequence[State] = (),
        effort: int | None = None,
    ):
        if experiment.noise is None:
            raise InputError(
                "The experiment has noise=None, so residuals cannot be compared with the noise. "
                "Give it noise.Gaussian(sigma) or noise.FromCoherence()."
            )
        experiment.noise.check(data)
        self.experiment = experiment
        self.data = data
        self.baseline = baseline
        self.further = tuple(further)
        self.unknown_sizes: Sequence[Unknown] = sizes_of(experiment)
        self.sizes = dict(sizes or _medians(self.unknown_sizes))
        self.at_fixed_sizes = experiment.fix(self.sizes)
        earlier = (*(() if baseline is None else (baseline,)), *self.further)
        if effort is None:
            effort = 1 if experiment.model_error is None else 2
        self.further_unknowns = {
            own_name(unknown.name, number): unknown
            for number, state in enumerate(earlier, 1)
            for unknown in state.experiment.unknowns
            if unknown.name in state.unknowns
        }
        self.coordinates = coordinates_of(
            self.at_fixed_sizes, standard_normal=standard_normal, further=self.further_unknowns
        )
        self.states = [State(self.at_fixed_sizes, data)]
        for state in earlier:
            self.states.append(state._replace(experiment=state.experiment.fix(self.sizes)))
        self._parts = [
            _Part(state, number, self.coordinates, effort)
            for number, state in enumerate(self.states)
        ]
        count = sum(int(np.sum(np.asarray(state.data.measured))) for state in self.states)
        traced = _TracedResiduals(
            tuple((state.experiment, state.data) for state in self.states),
            tuple(tuple(part.columns.tolist()) for part in self._parts),
        )
        self.squares = LeastSquares(self._evaluated, self.dimension, count, traced)

    def _evaluated(self, points: Any, logarithmic: Any) -> tuple[Any, Any]:
        """Residuals of all states, the experiment first, and the sum of logs."""
        return _joined([part(points, logarithmic) for part in self._parts], np.concatenate)

    @property
    def dimension(self) -> int:
        """Number of unknowns."""
        return self.coordinates.dimension

    @property
    def count(self) -> int:
        """Number of data."""
        return self.squares.count

    @property
    def content(self) -> tuple[Any, ...]:
        """All that its fits follow from, but for their starts."""
        return self.experiment, self.data, self.sizes, self.baseline, self.further

    def at_sizes(self, sizes: Mapping[str, float]) -> "Problem":
        """Return the problem at other sizes of the model error."""
        problem = Problem(
            self.experiment,
            self.data,
            sizes=sizes,
            baseline=self.baseline,
            further=self.further,
        )
        problem.squares.take_structure(self.squares)
        return problem

    def with_effect(self, effect: Effect) -> "Problem":
        """Return the problem with one more effect in the experiment, not in its earlier state."""
        return Problem(
            self.experiment + effect,
            self.data,
            sizes=self.sizes,
            baseline=self.baseline,
            further=self.further,
        )

    def weight(self, relative_error: float) -> np.ndarray | None:
        """Weight of each residual once FRFs have a further relative error.

        None without such an error, and where the noise is unknown, which takes it up by itself.
        """
        weights = [_weight(state, relative_error) for state in self.states]
        known = [weight for weight in weights if weight is not None]
        return np.concatenate(known) if relative_error and len(known) == len(weights) else None

    def of_experiment(self, mask: np.ndarray) -> np.ndarray:
        """Mask of residuals, of which those of the experiment are given and no others are set."""
        others = sum(state.data.z.size for state in self.states[1:])
        return np.concatenate([np.ravel(mask), np.zeros(others, dtype=bool)])

    def errors_of(self, size: Unknown) -> np.ndarray:
        """Places of the errors that have a size, among the coordinates."""
        unknowns = self.experiment.unknown | self.further_unknowns
        places = [
            np.arange(place.start, place.stop)
            for name, unknown in unknowns.items()
            if shares_size(unknown, size) and name in self.coordinates.places
            for place in [self.coordinates.places[name]]
        ]
        return np.concatenate(places)

    def with_sizes(self, points: np.ndarray, sizes: Mapping[str, np.ndarray]) -> np.ndarray:
        """Coordinates of all unknowns of the experiment, from those here and sizes by name."""
        everything = coordinates_of(self.experiment)
        vectors = np.zeros((len(points), everything.dimension))
        for name, place in everything.places.items():
            if name in self.coordinates.places:
                vectors[:, place] = points[:, self.coordinates.places[name]]
        for size in self.unknown_sizes:
            scores = compiled(_scores)(size.distribution, np.asarray(sizes[size.name]))
            vectors[:, everything.places[size.name]] = np.asarray(scores)
        return vectors

    def without_sizes(self, points: np.ndarray) -> np.ndarray:
        """Coordinates here, from those of all unknowns of the experiment."""
        everything = coordinates_of(self.experiment)
        kept = [points[:, everything.places[name]] for name in self.coordinates.places]
        return np.concatenate(kept, axis=1)

    def prepare(self) -> None:
        """Compile the residuals, unless that is done. Any thread may."""
        for part in self._parts:
            part.prepare()


class _Part:
    """Compiled residuals of one state, at points in the coordinates of a problem.

    Parameters
    ----------
    state
        The state, its model error of known sizes.
    number
        Its number among the states of the problem.
    coordinates
        Coordinates of the problem.
    effort
        How much the compiler tries.
    """

    def __init__(self, state: State, number: int, coordinates: Coordinates, effort: int):
        mine = coordinates_of(state.experiment, standard_normal=False)
        places = [
            coordinates.places[own_name(name, number) if name in state.unknowns else name]
            for name in mine.places
        ]
        columns = [np.arange(place.start, place.stop) for place in places]
        self.columns = np.concatenate([np.zeros(0, dtype=int), *columns])
        self.is_all = np.array_equal(self.columns, np.arange(coordinates.dimension))
        self._state, self._effort = state, effort
        self._batch = compiled(batch).bound(state.experiment, effort=0)
        self._in_batches = InBatches(self._of_batch)

    def __call__(
        self, points: Float[np.ndarray, "point unknown"], logarithmic: Any
    ) -> tuple[np.ndarray, ...]:
        """Residuals [point, datum] and sums of logs [point]."""
        if self.is_all:
            return self._in_batches(points, logarithmic)
        # What another state alone has does not change this one: each point is computed once.
        mine = points[:, self.columns]
        different, places = np.unique(mine, axis=0, return_inverse=True)
        if len(different) == len(mine):
            return self._in_batches(mine, logarithmic)
        return tuple(values[places.ravel()] for values in self._in_batches(different, logarithmic))

    def _of_batch(self, points: Any, logarithmic: Any) -> tuple[Array, Array]:
        return self._residuals(self._batch(points).numbers, logarithmic)

    def prepare(self) -> None:
        """Compile them, unless that is done. Any thread may."""
        points = np.zeros((BATCH, len(self.columns)))
        self._batch.prepare(points)
        self._residuals.prepare(self._batch.outcome(points).numbers, False)

    @functools.cached_property
    def _residuals(self) -> Bound[tuple[Array, Array]]:
        """Residuals of experiments of this form: one function for all hypotheses that share it."""
        form = self._batch.outcome(np.zeros((BATCH, len(self.columns)))).form
        shared, data = form.shared(self._state.experiment), self._state.data
        return compiled(_residuals).bound(
            form.apart_from_declared(), shared, data, effort=self._effort
        )


class _TracedResiduals(eqx.Module):
    """Residuals of all states, for compiled functions that serve all problems of one form.

    Parameters
    ----------
    states
        Experiment and data of each state, the experiments' model errors of known sizes.
    columns
        Coordinates of the problem that are those of each state.
    """

    states: tuple[tuple[Experiment, Data], ...]
    columns: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    def __call__(self, points: Any, logarithmic: Any) -> tuple[Array, Array]:
        """Residuals [point, datum] and sums of logs [point]."""
        parts = zip(self.states, self.columns, strict=True)
        return _joined(
            [_at_points(*state, points[:, list(kept)], logarithmic) for state, kept in parts]
        )


def _joined(parts: Sequence[Any], concatenate: Any = jnp.concatenate) -> tuple[Any, Any]:
    """Residuals and sums of logs of all states from those of each."""
    residuals, log_scales = zip(*parts, strict=True)
    residual = residuals[0] if len(parts) == 1 else concatenate(residuals, axis=1)
    return residual, sum(log_scales[1:], log_scales[0])


def _weight(state: State, relative_error: float) -> np.ndarray | None:
    noise, observe = state.experiment.noise, state.experiment.observe
    deviation = None if noise is None else noise.deviation(state.data)
    if deviation is None:
        return None
    known = np.asarray(deviation)
    return np.ravel(
        known / np.hypot(known, relative_error * observe.relative(np.asarray(state.data.z)))
    )


def sizes_of(experiment: Experiment) -> tuple[Unknown, ...]:
    """Sizes of the model error that are unknown."""
    return tuple(
        unknown
        for unknown in experiment.unknowns
        if unknown.role is Role.MODEL_ERROR and unknown.field == "size"
    )


def _medians(unknowns: Sequence[Unknown]) -> dict[str, float]:
    priors = {unknown.name: unknown.distribution for unknown in unknowns}
    coordinates = Coordinates(priors)
    return {
        name: float(value[0])
        for name, value in coordinates.named(np.zeros((1, coordinates.dimension))).items()
    }


def own_name(name: str, number: int) -> str:
    """Name of an unknown that has a value of its own in one of the states."""
    return f"{name} of state {number}"


def coordinates_of(
    experiment: Experiment,
    *,
    standard_normal: bool = True,
    further: Mapping[str, Unknown] = MappingProxyType({}),
) -> Coordinates:
    """Coordinates of the unknowns of an experiment, and of further ones after them.

    Raises
    ------
    InfeasibleError
        If the prior has to be standard normal, and one has no inverse distribution function.
    """
    distributions = {unknown.name: unknown.distribution for unknown in experiment.unknowns}
    distributions |= {name: unknown.distribution for name, unknown in further.items()}
    return Coordinates(distributions, standard_normal=standard_normal)


def _scores(distribution: Distribution, values: Any) -> Float[Array, "point coordinate"]:
    """Coordinates of values [point] of one unknown."""
    coordinates = Coordinates({"value": distribution})
    return jax.vmap(lambda value: coordinates.vector({"value": value}))(values)


def _residuals(
    form: Form, shared: Sequence[Any], data: Data, numbers: Sequence[Array], logarithmic: Any
) -> tuple[Array, Array]:
    """Residuals of a batch of experiments, all their numbers being inputs."""

    def of(numbers: Sequence[Array]) -> tuple[Array, Array]:
        return standardised_residual(form.filled(numbers, shared), data, logarithmic)

    return jax.vmap(of)(numbers)


def _at_points(
    experiment: Experiment, data: Data, points: Float[Array, "point unknown"], logarithmic: Any
) -> tuple[Array, Array]:
    """Residuals of a batch of points, for a function that is compiled around them."""
    coordinates = coordinates_of(experiment, standard_normal=False)

    def at(point: Float[Array, "unknown"]) -> tuple[Array, Array]:
        return standardised_residual(experiment.fix(coordinates.values(point)), data, logarithmic)

    return jax.vmap(at)(points)
