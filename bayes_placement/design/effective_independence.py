"""Effective independence: sensor places at which mode shapes are most independent."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
from jaxtyping import Array, Float

from .._shared.arguments import arguments_checked
from .._shared.compiled import compiled
from .._shared.dimensions import Shapes
from .._shared.errors import InputError
from .._shared.reprs import notebook_html
from ..experiment.experiment import Experiment
from ..experiment.transducers import Transducer
from ..modes.modes import Modes, frequencies_of
from ..positions.bounds import position_text
from ..positions.places import Cartesian
from ._candidates import Candidates, Recordings, candidates

Rows = Float[np.ndarray, "place channel mode"]


@dataclass(frozen=True, repr=False)
class EffectiveIndependence:
    """Places at which mode shapes are most independent, by effective independence.

    Parameters
    ----------
    positions
        Recorded place of each sensor [m], by name.
    table
        One row for each place to try, those kept first, then the others, the last removed first:
        place [m], `effective_independence` among the places that remained when it was removed, or
        at the end (1 where modes become dependent without it), and `kept`.
    log_determinant
        Logarithm of the determinant of the Fisher information with all places, then after each
        removal. Shapes are mass-normalised.
    modes
        Numbers of the modes, counted from one.

    Examples
    --------
    >>> chosen = bp.design.effective_independence(experiment, {"s1": [0.1, 0.3, 0.5]}, modes=[1])
    >>> float(chosen.positions["s1"])
    0.5
    """

    positions: Recordings
    table: pd.DataFrame
    log_determinant: np.ndarray
    modes: tuple[int, ...]

    @property
    def places(self) -> dict[str, list[float | Float[np.ndarray, "3"]]]:
        """Each place as the only candidate, so that `place` estimates its information gain."""
        return {name: [at] for name, at in self.positions.items()}

    def __repr__(self) -> str:
        """State the places."""
        return f"EffectiveIndependence: {self}"

    def _repr_html_(self) -> str:
        return notebook_html(str(self), self.table)

    def __str__(self) -> str:
        """State the places and the modes."""
        where = ", ".join(f"{name} at {position_text(at)} m" for name, at in self.positions.items())
        return (
            f"{len(self.positions)} of {len(self.table)} places by effective independence of modes "
            f"{', '.join(map(str, self.modes))}: {where}; log determinant "
            f"{self.log_determinant[-1]:.3g}."
        )


@arguments_checked
def effective_independence(
    experiment: Experiment,
    places: Mapping[str, Sequence[object] | np.ndarray],
    *,
    modes: Sequence[int] | None = None,
) -> EffectiveIndependence:
    """Place sensors by effective independence, a fast classical baseline.

    Of all places to try, the one is removed that contributes least to the determinant of the Fisher
    information of the modal coordinates, until as many remain as there are sensors (Kammer 1991,
    DOI 10.2514/3.20636). It uses mode shapes only: neither damping, unknowns, tolerances of the
    positions nor actuators. A place with several directions is removed with all of them.
    Stepwise removal need not end at the largest determinant of all choices.

    Parameters
    ----------
    experiment
        The experiment; its shapes are those at nominal parameters and recorded orientations.
    places
        Places to try [m], the same list for each sensor named. All other sensors are mounted.
    modes
        Numbers of the modes, counted from one; by default those whose natural frequency lies
        between the least and the greatest line.

    Returns
    -------
    EffectiveIndependence
        Places that are kept, the modes, and a table with a row for each place to try.

    Raises
    ------
    InputError
        If sensors or their places differ, or there are too few of them for the modes.

    Examples
    --------
    >>> chosen = bp.design.effective_independence(experiment, {"s1": [0.1, 0.3, 0.5]}, modes=[1])
    >>> chosen.table["kept"].tolist()
    [True, False, False]
    """
    moved = candidates(experiment, places)
    _check_alike(experiment, moved)
    nominal = experiment.nominal()
    modes_of_structure = nominal.structure.proper_modes()
    if modes is None:
        chosen = _in_band(experiment, modes_of_structure)
    else:
        chosen = _numbered(modes_of_structure, modes)
    mounted = [
        _shapes_read(sensor, np.array([sensor.recorded]), modes_of_structure)[0]
        for name, sensor in nominal.sensor.items()
        if name not in places
    ]
    count, tried = len(moved), moved[0].recorded
    rows = _shapes_read(nominal.sensor[moved[0].name], tried, modes_of_structure)[..., chosen]
    base = np.concatenate([np.zeros((0, len(chosen))), *(shapes[:, chosen] for shapes in mounted)])
    _check_rank(rows, base, count)
    order, independence, log_determinant = _ranked(rows, base, count)
    best = tried[np.sort(order[:count])]
    table = pd.DataFrame([coordinates(place) for place in tried[order]])
    table["effective_independence"] = independence
    table["kept"] = np.arange(len(order)) < count
    return EffectiveIndependence(
        {sensor.name: place for sensor, place in zip(moved, best, strict=True)},
        table,
        log_determinant,
        tuple(int(number) + 1 for number in chosen),
    )


def coordinates(at: float | Float[np.ndarray, "3"]) -> dict[str, float]:
    """Columns of a place: one, or three."""
    names = ["place"] if np.ndim(at) == 0 else list("xyz")
    return dict(zip(names, np.ravel(at).tolist(), strict=True))


def _ranked(rows: Rows, base: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places by falling effective independence, its values, and log determinants [removed]."""
    remaining = np.arange(len(rows))
    removed: list[int] = []
    independence_removed: list[float] = []
    log_determinants = []
    while True:
        independence, log_determinant = _independence(rows[remaining], base)
        log_determinants.append(log_determinant)
        if len(remaining) == count:
            break
        # Places of equal independence differ by rounding: the first of them is removed.
        least = int(np.argmin(np.round(independence, 9)))
        removed.insert(0, int(remaining[least]))
        independence_removed.insert(0, float(independence[least]))
        remaining = np.delete(remaining, least)
    best_first = np.argsort(-independence, kind="stable")
    order = np.array([*remaining[best_first], *removed], dtype=int)
    return (
        order,
        np.array([*independence[best_first], *independence_removed]),
        np.array(log_determinants),
    )


def _independence(rows: Rows, base: np.ndarray) -> tuple[np.ndarray, float]:
    """Effective independence of each place, and the logarithm of the determinant with all.

    Without a place the determinant of Q = sum of R'R is smaller by det(I - R inv(Q) R'), which is
    one less the effective independence; R inv(Q) R' comes from an orthonormal basis of all rows.
    """
    places, channels, modes = rows.shape
    basis, triangle = np.linalg.qr(np.concatenate([rows.reshape(-1, modes), base]))
    of_places = basis[: places * channels].reshape(places, channels, -1)
    without = np.linalg.det(np.eye(channels) - of_places @ np.swapaxes(of_places, 1, 2))
    return 1 - without, float(2 * np.sum(np.log(np.abs(np.diag(triangle)))))


def _shapes_read(sensor: Transducer, places: np.ndarray, modes: Modes) -> Rows:
    """Mode shapes that a sensor measures at places."""
    return np.asarray(_shapes_at(sensor, modes, jnp.asarray(places, float)))


@compiled
def _shapes_at(
    sensor: Transducer, modes: Modes, places: Float[Array, "place *coordinate"]
) -> Float[Array, "place channel mode"]:
    def shapes(at: Float[Array, "*coordinate"]) -> Shapes:
        position = at if at.ndim == 0 else Cartesian(*at)
        return eqx.tree_at(lambda tree: tree.position, sensor, position).shapes(modes)

    return jax.vmap(shapes)(places)


def _in_band(experiment: Experiment, modes: Modes) -> np.ndarray:
    natural = frequencies_of(modes)
    low, high = np.min(experiment.frequency), np.max(experiment.frequency)
    inside = np.flatnonzero((natural >= low) & (natural <= high))
    if not inside.size:
        raise InputError(
            f"No natural frequency lies in the band of {low:g} to {high:g} Hz; shapes of at least "
            "one mode are needed. Choose modes by number: modes=(1, 2)."
        )
    return inside


def _numbered(modes: Modes, numbers: Sequence[int]) -> np.ndarray:
    count = jax.eval_shape(lambda: modes.natural_frequency).shape[0]
    if not numbers or min(numbers) < 1 or max(numbers) > count:
        raise InputError(
            f"modes={tuple(numbers)} was given; numbers of modes from 1 to {count} are needed, as "
            "many as the structure has: modes=(1, 2)."
        )
    return np.array(sorted(set(numbers))) - 1


def _check_alike(experiment: Experiment, moved: Sequence[Candidates]) -> None:
    for sensor in moved:
        if sensor.name not in experiment.sensor:
            raise InputError(
                f'Places of the actuator "{sensor.name}" were given; those of sensors are needed, '
                "since effective independence does not depend on the actuators. "
                "bp.place(...) places actuators as well."
            )
    first = moved[0]
    for other in moved[1:]:
        pair = [experiment.sensor[name] for name in (first.name, other.name)]
        fields = [(sensor.directions, sensor.angles) for sensor in pair]
        if not np.array_equal(other.recorded, first.recorded) or not eqx.tree_equal(*fields):
            raise InputError(
                f'Sensors "{first.name}" and "{other.name}" have different places to try or '
                "directions; equal sensors and one list of places are needed, from which places "
                f'are removed one by one: {{"{first.name}": places, "{other.name}": places}}.'
            )


def _check_rank(rows: Rows, base: np.ndarray, count: int) -> None:
    channels, modes = rows.shape[1:]
    measured = count * channels + len(base)
    if len(rows) < count:
        raise InputError(
            f"{len(rows)} places for {count} sensors were given; at least as many places as "
            "sensors are needed, since no two sensors share a place."
        )
    if measured < modes:
        raise InputError(
            f"{measured} channels were given for {modes} modes; at least as many channels as modes "
            "are needed, since otherwise modes are dependent at any placement. Choose fewer modes: "
            f"modes={tuple(range(1, measured + 1))}."
        )
    rank = np.linalg.matrix_rank(np.concatenate([rows.reshape(-1, modes), base]))
    if rank < modes:
        raise InputError(
            f"With a sensor at each of the {len(rows)} places only {rank} of {modes} modes are "
            "independent; more places are needed, or fewer modes: modes=(1, 2)."
        )
