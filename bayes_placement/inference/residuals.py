"""An experiment with data as a problem of least squares over standard normal coordinates."""

from collections.abc import Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Complex, Float
from numpyro.distributions import Distribution

from .._shared.compiled import compiled
from .._shared.errors import InputError
from .._shared.sites import Role, Unknown
from ..effects.effect import Effect
from ..experiment.experiment import Experiment
from ..experiment.model_error import shares_size
from ..experiment.noise import Data
from .coordinates import Coordinates
from .engines.least_squares import LeastSquares, ParameterPoints, Residuals
from .residuals_of_state import (
    ResidualsOfState,
    State,
    TracedResiduals,
    coordinates_of,
    name_in_state,
)

Content = tuple[Experiment, Data, dict[str, float], State | None, tuple[State, ...]]


class Problem:
    """Least squares of an experiment with Gaussian noise against data.

    `standard_normal` asks for such priors in the coordinates. `sizes` are those of the model error
    by name, where they are unknown: their joint mode with the errors means nothing, so that they
    are no coordinates but numbers, by default the medians of their priors.

    `baseline` is an earlier state of the same structure: all unknowns that it has are those of the
    experiment, with the same values, and its data are fitted too. `further` are more of these; an
    unknown of theirs that the experiment does not have must be one of their own.

    `effort` is how much the compiler tries, see `Compiled.bound`: by default more where a model
    error makes evaluations take longer than compiling.
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
        self._settings = {"standard_normal": standard_normal, "effort": effort}
        self.sizes = dict(sizes or _medians(self.unknown_sizes))
        self.at_fixed_sizes = experiment.fix(self.sizes)
        earlier = (*(() if baseline is None else (baseline,)), *self.further)
        if effort is None:
            effort = 1 if experiment.model_error is None else 2
        self.further_unknowns = {
            name_in_state(unknown.name, number): unknown
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
            ResidualsOfState(state, number, self.coordinates, effort)
            for number, state in enumerate(self.states)
        ]
        count = sum(int(np.sum(np.asarray(state.data.measured))) for state in self.states)
        traced = TracedResiduals(
            tuple((state.experiment, state.data) for state in self.states),
            tuple(tuple(part.columns.tolist()) for part in self._parts),
        )
        self.squares = LeastSquares(self._evaluated, self.dimension, count, traced, self._alike())

    def __reduce__(self) -> tuple[object, ...]:
        """Another process makes it anew, and compiles it, from what it was made of."""
        return _from_content, (self.content, self._settings)

    def _alike(self) -> np.ndarray:
        """A number for each unknown: the same one for what is alike of each sensor or actuator."""
        unknowns = self.experiment.unknown | self.further_unknowns
        numbers: dict[tuple[object, ...], int] = {}
        kinds = np.zeros(self.dimension, dtype=int)
        for name, place in self.coordinates.places.items():
            unknown = unknowns[name]
            like = (unknown.owner.kind, unknown.field, unknown.path)
            for column in range(place.start, place.stop):
                key = like if unknown.is_of_transducer else (name, column)
                kinds[column] = numbers.setdefault(key, len(numbers))
        return kinds

    def _evaluated(self, points: ParameterPoints, logarithmic: bool) -> Residuals:
        """Residuals of all states, the experiment first, and the sum of logs."""
        return _of_states(self._parts, points, logarithmic)

    @property
    def problem(self) -> "Problem":
        """Itself, which stands for no other one."""
        return self

    @property
    def dimension(self) -> int:
        """Number of unknowns."""
        return self.coordinates.dimension

    @property
    def count(self) -> int:
        """Number of data."""
        return self.squares.count

    @property
    def content(self) -> Content:
        """All that its fits follow from, but for their starts."""
        return self.experiment, self.data, self.sizes, self.baseline, self.further

    def at_sizes(self, sizes: Mapping[str, float]) -> "Problem":
        """Return the problem at other sizes of the model error."""
        problem = self._like(self.experiment, self.data, sizes)
        problem.squares.take_structure(self.squares)
        return problem

    def with_measured(self, measured: np.ndarray) -> "Problem":
        """Return the problem of some of the measured outputs of the experiment."""
        data = eqx.tree_at(lambda data: data.measured, self.data, measured)
        problem = self._like(self.experiment, data, self.sizes)
        problem.squares.take_structure(self.squares)
        return problem

    def with_effect(self, effect: Effect) -> "Problem":
        """Return the problem with one more effect in the experiment, not in its earlier state."""
        return self._like(self.experiment + effect, self.data, self.sizes)

    def _like(self, experiment: Experiment, data: Data, sizes: Mapping[str, float]) -> "Problem":
        """Return the problem of an experiment and data, with the same earlier states."""
        return Problem(experiment, data, sizes=sizes, baseline=self.baseline, further=self.further)

    def weight(self, relative_error: float) -> np.ndarray | None:
        """Weight of each residual once FRFs have a further relative error.

        None without such an error, and where the noise is unknown, which takes it up by itself.
        """
        deviations = self.deviations() if relative_error else None
        if deviations is None:
            return None
        plain, of_relative = deviations
        return plain / np.hypot(plain, relative_error * of_relative)

    def deviations(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Standard deviation of each datum, and that of FRFs with a relative error of 1.

        None where the noise is unknown.
        """
        known = [each for each in map(_deviations, self.states) if each is not None]
        if len(known) < len(self.states):
            return None
        plain, of_relative = (np.concatenate(parts) for parts in zip(*known, strict=True))
        return plain, of_relative

    def of_experiment(self, mask: np.ndarray) -> np.ndarray:
        """Mask of residuals, of which those of the experiment are given and no others are set."""
        further_count = sum(state.data.z.size for state in self.states[1:])
        return np.concatenate([np.ravel(mask), np.zeros(further_count, dtype=bool)])

    def errors_of(self, size: Unknown) -> np.ndarray:
        """Places of the errors that have a size, among the coordinates."""
        unknowns = self.experiment.unknown | self.further_unknowns
        places = [
            np.arange(place.start, place.stop)
            for name, unknown in unknowns.items()
            if shares_size(unknown, size) and name in self.coordinates.places
            for place in [self.coordinates.places[name]]
        ]
        return np.concatenate([np.zeros(0, dtype=int), *places])  # none where no channel errs

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
        parts = [points[:, everything.places[name]] for name in self.coordinates.places]
        return np.concatenate(parts, axis=1)

    def with_laws(
        self, points: ParameterPoints, laws: Complex[np.ndarray, "point law pair frequency"]
    ) -> Float[np.ndarray, "point law datum"]:
        """Residuals of all states, other laws on the last ports of the experiment alone.

        See `ResidualsOfState`.
        """
        later = self._parts[0].with_laws(points, laws)
        earlier, _ = _of_states(self._parts[1:], points, False)
        shared = np.broadcast_to(earlier[:, None], (*later.shape[:2], earlier.shape[1]))
        return np.concatenate([later, shared], axis=2)

    def prepare(self) -> None:
        """Compile the residuals, unless that is done. Any thread may."""
        for part in self._parts:
            part.prepare()


def _of_states(
    parts: Sequence[ResidualsOfState], points: ParameterPoints, logarithmic: bool
) -> Residuals:
    """Residuals of some states one after the other, and the sum of logs."""
    ends = np.cumsum([0, *(part.size for part in parts)])
    residual = np.empty((len(points), ends[-1]))
    log_scale = np.empty((len(points), len(parts)))
    for number, part in enumerate(parts):
        columns = slice(*ends[number : number + 2])
        part.fill((residual[:, columns], log_scale[:, number]), points, logarithmic)
    return residual, log_scale.sum(axis=1)


def at_known_noise(problem: Problem, point: np.ndarray) -> tuple[Problem, np.ndarray]:
    """Return a problem of one state with the noise of a point, and the point in it.

    What makes squares alone small would make unknown noise large.
    """
    values = problem.coordinates.named(point[None])
    of_noise = {
        unknown.name: np.asarray(values[unknown.name][0])
        for unknown in problem.experiment.unknowns
        if unknown.role is Role.OUTPUT_ERROR
    }
    if not of_noise or problem.baseline is not None or problem.further:
        return problem, point
    known = Problem(problem.experiment.fix(of_noise), problem.data, sizes=problem.sizes)
    return known, point_in_problem(problem, point, known)


def point_in_problem(
    before: Problem, point: np.ndarray, problem: Problem, onto: np.ndarray | None = None
) -> np.ndarray:
    """Coordinates of a point, for a problem with further effects; what is new as in `onto`, or 0.

    By their names: effects are in the order of theirs, and so is what their attachments add to a
    model error.
    """
    transferred = np.zeros(problem.dimension) if onto is None else onto.copy()
    for name, place in before.coordinates.places.items():
        if name in problem.coordinates.places:
            transferred[problem.coordinates.places[name]] = point[place]
    return transferred


def fields_of(effect: Effect, problem: Problem) -> dict[str, str]:
    """Field of an effect that each of its unknowns belongs to, by the name of the unknown."""
    return {unknown.name: unknown.field for unknown in problem.experiment.unknowns_of(effect)}


def _from_content(content: Content, settings: Mapping[str, Any]) -> Problem:
    experiment, data, sizes, baseline, further = content
    return Problem(experiment, data, sizes=sizes, baseline=baseline, further=further, **settings)


def _deviations(state: State) -> tuple[np.ndarray, np.ndarray] | None:
    noise, observe = state.experiment.noise, state.experiment.observe
    deviation = None if noise is None else noise.deviation(state.data)
    if deviation is None:
        return None
    of_relative = observe.relative(np.asarray(state.data.z))
    plain = np.broadcast_to(np.asarray(deviation), of_relative.shape)
    return np.ravel(plain), np.ravel(of_relative)


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


def _scores(
    distribution: Distribution, values: Float[Array, "point"]
) -> Float[Array, "point coordinate"]:
    """Coordinates of values [point] of one unknown."""
    coordinates = Coordinates({"value": distribution})
    return jax.vmap(lambda value: coordinates.vector({"value": value}))(values)
