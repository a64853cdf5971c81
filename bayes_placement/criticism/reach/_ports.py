"""Kinds of ports at which something may act on a structure, and places to try."""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri

from ..._shared.dimensions import Spectrum
from ...effects.effect import Effect, GlobalChange, Modulus
from ...effects.library import kind_of
from ...effects.registry import attached, inserted, modulus, over, strut
from ...effects.scales import Scales
from ...experiment.experiment import Experiment
from ...experiment.with_effects_applied import needs_other_lines
from ...inference.residuals import Problem, fields_of
from ...laws import Law, Spring
from ...laws.catalogue import leaves, networks
from ...laws.law import Tree
from ...laws.rows import NetworkRows
from ...modes.beams.waveguide import Waveguide
from ...modes.ports import is_beam
from ._free_law import FreeLaw
from ._free_law_of_many import FreeLawOfMany
from ._law_by_modes import LawByModes

PLACES = {1: 25, 2: 9, 3: 5}
"""Places along each coordinate of a port that has so many."""

OF_PARTS = [9, 5]
"""Places of the middle of a part of a line, and extents of it."""

MOST_PIECES = 3
"""Most pieces of a structure between which struts are looked for."""

NAME = "~reach"
"""Name of the effect while its law is free: the last one in order."""

OF_MANY = ("region", "structure")
"""What laws act on that act at many places at once."""

PLAIN: Sequence[Tree] = (
    "k",
    "c",
    "m",
    ["|", "c", "k"],
    ["|", "k", "m"],
    ["|", "c", "m"],
    ["-", "c", "k"],
    ["-", "k", "m"],
    ["-", "c", "m"],
    ["|", "k", ["-", "c", "k"]],
    ["|", "c", ["-", "c", "k"]],
    ["|", "m", ["-", "c", "k"]],
    ["|", "k", ["-", "k", "m"]],
    ["|", "c", ["-", "k", "m"]],
    ["|", "m", ["-", "k", "m"]],
    ["|", "k", ["-", "c", "m"]],
    ["|", "c", ["-", "c", "m"]],
    ["|", "m", ["-", "c", "m"]],
    ["|", "c", "k", "m"],
    ["-", "m", ["|", "c", "k"]],
    ["-", "c", ["|", "k", "m"]],
    ["-", "k", ["|", "c", "m"]],
    ["-", "c", "k", "m"],
)
"""Networks of at most three springs, dashpots and masses that can be built, one of each of the 23
classes: what `classes` finds of them, which takes seconds."""


class Port(NamedTuple):
    """A kind of port on a piece of a structure.

    `acts_on` is `displacement`, `rotation`, `cut`, `relative`, `region` or `structure`, which is
    its modulus; the effect has a prior of its place and any law.
    """

    acts_on: str
    effect: Any

    @property
    def is_cut(self) -> bool:
        """Whether laws are inserted."""
        return self.acts_on == "cut"

    @property
    def place_fields(self) -> tuple[str, ...]:
        """Fields of the effect that say where it is, of a region with how much there is of it."""
        fields: tuple[str, ...] = self.effect.place_fields
        return (*fields, "extent") if self.acts_on == "region" else fields

    @property
    def is_of_many(self) -> bool:
        """Whether a law acts at many places at once."""
        return self.acts_on in OF_MANY

    def free(self, problem: Problem, held: Sequence[int] = ()) -> FreeLaw:
        """Return the problem, which has the effect, with a law there that is free at each line."""
        return (FreeLawOfMany if self.is_of_many else FreeLaw)(problem, held)

    @property
    def unit(self) -> str:
        """Unit of the dynamic stiffness of a law, of one in a cut of its compliance.

        Of the modulus that of what is added, over the modulus as drawn.
        """
        if self.acts_on == "structure":
            return "1"
        if self.is_cut:
            return "rad/(N m)" if self.effect.motion == "rotation" else "m/N"
        return "N m/rad" if self.acts_on == "rotation" else "N/m"

    def effect_in(self, experiment: Experiment) -> Any:
        """Return the effect as an experiment has it."""
        return next(each for each in experiment.effects if each.name == self.effect.name)

    def setting(self, experiment: Experiment) -> str:
        """Piece of the structure and direction, in words."""
        if self.acts_on == "structure":
            return "modulus"
        effect = self.effect_in(experiment)
        return str(effect.setting(experiment.structure.modes, experiment.instruments))

    def rows(self, free: FreeLaw | LawByModes, omega: Spectrum) -> NetworkRows:
        """Networks that may act there, about the size of what the port feels."""
        size = 1 / free.size() if self.is_cut else free.size()
        size = float(f"{size:.3g}")  # the same prior in every state, whatever is rounded
        return NetworkRows(self.trees(), size, float(np.sqrt(omega[0] * omega[-1])))

    def with_law(self, law: Law, name: str) -> Effect:
        """Return the effect with a law and a name."""
        return dataclasses.replace(self.effect, law=law, name=name)

    def name(self) -> str:
        """Name of an effect on it."""
        return kind_of(self.effect)

    def trees(self) -> Sequence[Tree]:
        """Networks that may act there, one of each class; a mass moves against the ground."""
        return trees_at(self.acts_on)


def trees_at(acts_on: str) -> Sequence[Tree]:
    """Networks that may act on a kind of port; a mass moves against the ground."""
    return ATTACHED if acts_on in ("displacement", "rotation", "region") else INNER


def ports_of(experiment: Experiment) -> list[Port]:
    """Kinds of ports that a structure has, on each of its pieces."""
    scales, law = Scales(experiment), Spring(1.0)
    ports = [
        Port("displacement", attached(at, law, direction=direction, name=NAME))
        for at, direction in scales.places_and_directions()
    ]
    ports += [Port("relative", effect) for effect in _struts(scales, law)]
    if not isinstance(scales.nominal_modes, Waveguide):
        return ports
    (at,) = scales.places()
    if is_beam(scales.nominal_modes):
        ports.append(Port("rotation", attached(at, law, motion="rotation", name=NAME)))
        ports.append(Port("cut", inserted(at, law, name=NAME)))
    else:
        ports.append(Port("cut", inserted(at, law, motion="displacement", name=NAME)))
    return ports


def ports_of_many(experiment: Experiment) -> list[Port]:
    """Kinds of ports at which a law acts at many places at once: what takes long to try.

    Of regions those of lines: on a patch of a plate every response takes a hundred times as long.
    """
    scales, law = Scales(experiment), Spring(1.0)
    parts = scales.extents(lines_alone=True)
    ports = [Port("region", over(*part, law, name=NAME)) for part in parts]
    if experiment.structure.of_kind(Modulus):
        return ports
    return [*ports, Port("structure", modulus(law, name=NAME))]


def every_port(experiment: Experiment) -> list[Port]:
    """All kinds of ports."""
    return [*ports_of(experiment), *ports_of_many(experiment)]


def can_be_reached(problem: Problem) -> bool:
    """Whether laws can be tried on what was measured: FRFs of one force level.

    A model error takes up much of what a free law does, unless an earlier state tells it.

    The problem is exact where there is no earlier state.
    """
    experiment = problem.experiment
    is_plain = not experiment.observe.is_modal and experiment.force_levels is None
    is_known = experiment.model_error is None or problem.baseline is not None
    return is_plain and is_known and _is_applied(experiment)


def _is_applied(experiment: Experiment) -> bool:
    """Whether laws come in as numbers at the lines."""
    changes_size = any(change.changes_size for change in experiment.structure.of_kind(GlobalChange))
    return not changes_size and not needs_other_lines(experiment)


def _struts(scales: Scales, law: Law) -> list[Effect]:
    places = scales.places()
    if len(places) > MOST_PIECES:
        return []
    pairs = itertools.combinations_with_replacement(places, 2)
    return [strut(one, other, law, name=NAME) for one, other in pairs]


def place_columns(port: Port, problem: Problem) -> list[int]:
    """Coordinates of the problem that are coordinates of the place."""
    return field_columns(port.effect, problem, port.place_fields)


def field_columns(effect: Effect, problem: Problem, wanted: Sequence[str]) -> list[int]:
    """Coordinates of the problem that are of some fields of an effect."""
    names = [name for name, word in fields_of(effect, problem).items() if word in wanted]
    return [column for name in names for column in _columns(problem, name)]


def grid(port: Port, count: int) -> np.ndarray:
    """Standard normal coordinates of places to try, in the middle of cells of equal probability."""
    is_part = port.acts_on == "region"
    each = OF_PARTS if is_part else [PLACES.get(count, 3)] * count
    middles = [(np.arange(number) + 0.5) / number for number in each]
    shares = np.array(list(itertools.product(*middles)))
    ends = [getattr(port.effect, field) for field in port.effect.place_fields]
    if len(ends) == 2 and count == 2 and _are_alike(*ends):
        shares = shares[shares[:, 0] < shares[:, 1]]  # a strut has no first end
    return ndtri(shares)


def _are_alike(one: object, other: object) -> bool:
    return one is other or repr(one) == repr(other)


def _columns(problem: Problem, name: str) -> Iterator[int]:
    place = problem.coordinates.places[name]
    yield from range(place.start, place.stop)


def _of_two(letters: str, wanted: str) -> list[Tree]:
    """Networks of at most two elements, one of a letter."""
    return [tree for tree in networks(letters, 2) if leaves(tree).count(wanted) == 1]


def largest(trees: Sequence[Tree]) -> list[int]:
    """Numbers of the networks of most elements: with small or large ones these are the others."""
    sizes = [len(leaves(tree)) for tree in trees]
    return [number for number, size in enumerate(sizes) if size == max(sizes)]


ATTACHED = (*PLAIN, *_of_two("kcmp", "p"), "h", ["-", "h", "m"], ["|", "h", "m"])
"""Networks that are tried between a port and the ground."""

INNER = (*(t for t in PLAIN if "m" not in leaves(t)), *_of_two("kcp", "p"), "h")
"""Networks that are tried between two sides or places: a mass there would be an inerter."""
