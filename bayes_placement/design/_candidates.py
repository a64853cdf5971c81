"""_candidates: in, an experiment and places to try; out, the laws there as stacks of numbers.

Not known here: how information is estimated, in what order placements are tried.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from .._sites import unknowns
from .._types import InputError
from ..experiment.experiment import Experiment
from ..experiment.transducers import Transducer
from ..positions.tolerances import Tolerance
from ..positions.vectors import triple

Tree = Any


class Candidates(NamedTuple):
    """Places at which one transducer is tried.

    Parameters
    ----------
    name
        Its name.
    recorded
        Recorded positions [m], [candidate] or [candidate, 3].
    laws
        Its position at each of them: numbers and laws.
    nominal
        Nominal value of its unknown coordinates, by name, at each of them.
    """

    name: str
    recorded: np.ndarray
    laws: list[Tree]
    nominal: list[dict[str, float | int]]

    def points(self) -> np.ndarray:
        """Recorded places [candidate, coordinate] [m]."""
        return self.recorded.reshape(len(self.laws), -1)

    def kinds(self) -> np.ndarray:
        """Number of the kind of each candidate; those of one kind differ in numbers only."""
        known: dict[Any, int] = {}
        return np.array([known.setdefault(_kind(law), len(known)) for law in self.laws])

    def chosen(self, numbers: np.ndarray) -> "Candidates":
        """Return some of them, in this order; each may be there several times."""
        laws, nominal = ([them[i] for i in numbers] for them in (self.laws, self.nominal))
        return Candidates(self.name, self.recorded[numbers], laws, nominal)

    def along_with(self, other: "Candidates") -> "Candidates":
        """Return these and then others."""
        recorded = np.concatenate([self.recorded, other.recorded])
        return Candidates(self.name, recorded, self.laws + other.laws, self.nominal + other.nominal)

    def stacked(self, chosen: np.ndarray) -> tuple[Tree, dict[str, np.ndarray]]:
        """Laws and nominal values of candidates of one kind, each number an array of them all."""
        laws = jax.tree.map(lambda *leaves: np.stack(leaves), *(self.laws[i] for i in chosen))
        names = self.nominal[chosen[0]]
        return laws, {name: np.array([self.nominal[i][name] for i in chosen]) for name in names}


def candidates(experiment: Experiment, places: Mapping[str, Any]) -> list[Candidates]:
    """Places to try for each transducer named, clipped to the structure with their tolerance.

    Raises
    ------
    ValueError
        If there is no such transducer, nothing to try, or a place lies outside the structure.
    """
    if not places:
        raise InputError(
            "No places to try were given; those of at least one transducer are needed: "
            '{"s1": np.linspace(0.04, 0.96, 47)}.'
        )
    return [_candidates(experiment, name, several) for name, several in places.items()]


def _candidates(experiment: Experiment, name: str, places: Any) -> Candidates:
    one = transducer(experiment, name)
    if isinstance(places, Tolerance):
        raise InputError(
            f'{one.kind} "{name}" was given {places} to sit anywhere in; here a list of places to '
            f'try is needed: {{"{name}": [0.25, 0.5]}}. search=design.Evolutionary() searches all '
            "of a support."
        )
    moved = [one.moved(_place(each), experiment.structure.modes) for each in places]
    if not moved:
        raise InputError(
            f'{one.kind} "{name}" was given no place to try; at least one is needed: '
            f'{{"{name}": [0.25, 0.5]}}.'
        )
    return _as_candidates(experiment, name, moved)


def where_it_is(experiment: Experiment, name: str) -> Candidates:
    """The present place of a transducer, as the only one to try."""
    return _as_candidates(experiment, name, [transducer(experiment, name)])


def _as_candidates(experiment: Experiment, name: str, moved: Sequence[Transducer]) -> Candidates:
    where = ".".join([*_path(experiment, name), "position"])
    nominal = [
        {
            ".".join([where, unknown.name]).rstrip("."): np.asarray(
                each.at_record(unknown.name)
            ).item()
            for unknown in unknowns(each.position)
        }
        for each in moved
    ]
    recorded = np.array([each.recorded for each in moved])
    return Candidates(name, recorded, [each.position for each in moved], nominal)


def _kind(law: Tree) -> Any:
    return jax.tree.structure(law), tuple(np.shape(leaf) for leaf in jax.tree.leaves(law))


def _place(given: Any) -> Any:
    if isinstance(given, Tolerance):
        return given
    return float(given) if np.ndim(given) == 0 else triple(given)


def transducer(experiment: Experiment, name: str) -> Transducer:
    """Transducer of this name.

    Raises
    ------
    ValueError
        If there is none.
    """
    known = {**experiment.sensor, **experiment.actuator}
    if name not in known:
        raise InputError(
            f'Places of "{name}" were given, but the experiment has no such transducer. It has '
            f"{', '.join(known)}."
        )
    return known[name]


def _path(experiment: Experiment, name: str) -> tuple[str, str]:
    return ("sensor" if name in experiment.sensor else "actuator", name)


def placed(experiment: Experiment, positions: Mapping[str, Tree]) -> Experiment:
    """Return the experiment with some transducers elsewhere, by name."""
    return _with(experiment, {_path(experiment, name): at for name, at in positions.items()})


def _with(experiment: Experiment, positions: Mapping[tuple[str, str], Tree]) -> Experiment:
    return eqx.tree_at(
        lambda tree: [getattr(tree, side)[name].position for side, name in positions],
        experiment,
        list(positions.values()),
        is_leaf=lambda leaf: leaf is None,
    )
