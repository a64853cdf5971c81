"""One kind of port on one piece: what any law there could do, and what a law of few numbers."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from jaxtyping import Float

from ..._shared.dimensions import Spectrum
from ...experiment.variants import evenly_spread
from ...inference.engines.levenberg_marquardt import minimise
from ...inference.residuals import Problem, point_in_problem
from ...laws.rows import NUMBERS
from ..kept_fits import NONE, Tree, stored_or_computed
from ..locations import ends
from ..screening_lines import at_about, at_lines_of_descents
from ._asked import NETWORK, PLACE, Asked, LawsAsked, Networks, Rows
from ._channels import NOWHERE, ChannelPort
from ._filters import FILTERS
from ._free_factor import FreeFactor
from ._free_law import AnyLaw, Free, FreeLaw, Point, Points, tells_phase
from ._free_law_of_many import STEPS, FreeLawOfMany
from ._law_by_modes import LawByModes
from ._laws_at_places import Fitted, laws_at_places
from ._laws_in_full import LawsInFull
from ._laws_of_amplitudes import laws_of_amplitudes
from ._ports import Port, grid, largest, place_columns
from ._scanned import Scanned

MOST_LINES = 128
"""Lines at which laws are fitted at all places: they only say which places are best."""

FOLLOWED = 8
"""Draws of laws that are followed at each place."""

OfPlaces = Float[np.ndarray, "place"]
Places = Float[np.ndarray, "place coordinate"]
"""Coordinates of places."""

AnyPort: TypeAlias = Port | ChannelPort
"""Where a law or a factor acts."""


PLACES = ("x", "y", "z", "to_x", "to_y", "to_z")
"""Columns of places [m]: where a law acts, and the other end of a strut."""


class ReachOfPort(NamedTuple):
    """What laws at a kind of port, or channels, can do, by place.

    Points [place, unknown] are fits with the law free at each line, `squares` their sums of
    squares; `squares_of_law` are those of the best law of a few numbers at each place, priors
    included, which has the log evidence.
    """

    port: AnyPort
    free: Free
    points: Points
    squares: OfPlaces
    squares_of_law: OfPlaces
    log_evidence: OfPlaces

    @property
    def problem(self) -> Problem:
        """The problem with a law at the port."""
        return self.free.problem

    def rows(self) -> Rows:
        """The laws of few numbers of the kind of port."""
        return rows_of(self.port, self.free)


def reach_of_port(
    base: Problem, point: Point, port: Port, places: Places | None = None
) -> ReachOfPort:
    """Fit all else at each place with a free law, then laws of a few numbers there.

    The point is the fit of the model; places are all over the structure by default.
    """
    problem = base.with_effect(port.effect)
    columns = place_columns(port, problem)
    start = point_in_problem(base, point, problem)
    which = np.array(largest(port.trees()))
    tried = grid(port, len(columns)) if places is None else places
    at_places = at_lines_of_descents(problem) if port.is_of_many else at_about(problem, MOST_LINES)
    fewer = at_places.problem
    reach = _reach_at(port, port.free(fewer, columns), start, tried, which)
    each = problem.count / fewer.count  # a line counts for several
    return reach._replace(
        free=port.free(problem, columns),
        squares=each * reach.squares,
        squares_of_law=each * reach.squares_of_law,
    )


def reach_of_scanned(base: Problem, point: Point, port: Port, scanned: Scanned) -> ReachOfPort:
    """Fit laws of a few numbers at the places that a scan leaves; all else is linear there."""
    problem = base.with_effect(port.effect)
    free = FreeLaw(problem, place_columns(port, problem))
    points = np.repeat(point_in_problem(base, point, problem)[None], len(scanned.places), axis=0)
    points[:, free.held] = scanned.places
    by_modes = LawByModes(base, free, port.effect_in(problem.experiment))
    return _with_laws(port, by_modes, points, scanned.squares, np.array(largest(port.trees())))


def reach_of_channel(point: Point, port: ChannelPort, free: FreeFactor) -> ReachOfPort:
    """Fit all else with a free factor on channels, then filters of a few numbers."""
    return _reach_at(port, free, point, np.zeros((1, 0)), np.arange(len(FILTERS)))


def reach_at_fit(point: Point, port: ChannelPort, free: FreeFactor, squares: float) -> ReachOfPort:
    """Return the same to first order: all else is linear, at the fit of the model.

    The sum of squares is without the data of these channels.
    """
    which = np.arange(len(FILTERS))
    return _with_laws(port, free, point[None], np.array([squares]), which)


def _reach_at(
    port: AnyPort, free: Free, start: Point, places: Places, which: Networks
) -> ReachOfPort:
    starts = _starts(start, free, places)
    if tells_phase(free.problem):
        points, squares = kept(
            lambda: _with_free_law(starts, free, len(places)), (NONE, NONE), free, port, starts
        )
    else:
        points, squares = starts, np.full(len(places), np.nan)
    return _with_laws(port, free, points, squares, which)


def _with_laws(
    port: AnyPort, free: Free, points: Points, squares: OfPlaces, which: Networks
) -> ReachOfPort:
    """Fit laws of a few numbers at points, of amplitudes one or two of each place."""
    found = fitted_laws(port, free, rows_of(port, free), points, which, -FOLLOWED, MOST_LINES)
    laws, cost, evidence = (_by_place(each, len(squares)) for each in found)
    best = np.argmax(evidence, axis=1)
    each = np.arange(len(squares))
    of_problem = laws[each, best, : free.problem.dimension]
    return ReachOfPort(port, free, of_problem, squares, 2 * cost[each, best], evidence[each, best])


def _by_place(values: np.ndarray, places: int) -> np.ndarray:
    """Values [point, start, ...] of points that go through all places one or more times."""
    return np.concatenate(np.split(values, len(values) // places), axis=1)


def _starts(start: Point, free: Free, places: Places) -> Points:
    """At each place the fit without a law; then at each the medians of priors.

    The fit may have taken up what is missing; but not one that an earlier state tells.
    """
    fitted = np.repeat(start[None], len(places), axis=0)
    fitted[:, free.held] = places
    if free.problem.baseline is not None:
        return fitted
    medians = np.zeros_like(fitted)
    medians[:, free.held] = places
    return np.concatenate([fitted, medians])


def _with_free_law(starts: Points, free: Free, places: int) -> tuple[np.ndarray, OfPlaces]:
    """All else fitted at each place, from all starts there."""
    steps = STEPS if isinstance(free, FreeLawOfMany) else 12
    ends, normal = minimise(AnyLaw(free), starts, steps=steps)
    costs = np.nan_to_num(normal.cost, nan=np.inf).reshape(-1, places)
    best, numbers = np.argmin(costs, axis=0), np.arange(places)
    chosen = best * places + numbers
    return ends[chosen], normal.squares[chosen]


def kept(
    compute: Callable[[], Tree], like: Tree, free: Free, port: AnyPort, *inputs: object
) -> Tree:
    """What a file holds of a port, or is computed; see `stored_or_computed`."""
    return stored_or_computed(compute, like, free.problem, port, *inputs)


def fitted_laws(
    port: AnyPort, free: Free, rows: Rows, points: Points, which: Networks, starts: int, most: int
) -> Fitted:
    """Laws at points, in the coordinates of `LawsInFull`.

    With their costs and log evidence. All else is fitted to first order, to amplitudes in full.

    Points are coordinates of the problem, each of a place; `which` are numbers of the networks.
    `starts` draws of the prior are followed at each, see `laws_at_places`; `most` lines are taken.
    """

    def found() -> Fitted:
        if not tells_phase(free.problem):
            in_full = LawsInFull(free, rows, omega_of(free), port.is_cut)
            return laws_of_amplitudes(in_full, which, points, starts)
        objective = asked_of_laws(free, points, rows, port, most)
        laws, cost, evidence = laws_at_places(objective, which, len(points), starts)
        of_problem = points[laws[..., PLACE].astype(int)]
        ends = [of_problem, laws[..., :NUMBERS], laws[..., NETWORK, None]]
        return np.concatenate(ends, axis=2), cost, evidence

    return kept(found, (NONE, NONE, NONE), free, port, points, which, starts, most)


def asked_of_laws(free: Free, points: Points, rows: Rows, port: AnyPort, most: int) -> LawsAsked:
    """Laws at places, at no more lines than are needed to choose among them."""
    omega = omega_of(free)
    lines = evenly_spread(omega.size, most) if omega.size > most else np.arange(omega.size)
    return LawsAsked(Asked.at(free, points, lines), rows, omega[lines], port.is_cut)


def rows_of(port: AnyPort, free: Any) -> Rows:
    """Laws of few numbers that may act at a port."""
    return port.rows(free, omega_of(free))


def omega_of(free: Free) -> Spectrum:
    return 2 * np.pi * np.asarray(free.problem.experiment.frequency, float)


def where(port: AnyPort, problem: Problem, points: Points) -> pd.DataFrame:
    """Return kind, setting and places of a port at points."""
    experiment = problem.experiment
    effect = port.effect_in(experiment)
    values = problem.coordinates.named(points)
    places = ends(effect, experiment, values, len(points))
    unused = [np.full((len(points), 3), np.nan)] * (2 - len(places))
    table = pd.DataFrame(np.concatenate([*places, *unused], axis=1), columns=list(PLACES))
    table.insert(0, "setting", port.setting(experiment))
    table.insert(0, "acts_on", port.acts_on)
    return table


def ends_in_metres(row: pd.Series) -> list[list[float]]:
    """Return the places of a row, each a list of coordinates [m]."""
    places = [[float(row[name]) for name in names] for names in (PLACES[:3], PLACES[3:])]
    known = [[number for number in place if np.isfinite(number)] for place in places]
    return [place for place in known if place]


def subject_in_words(acts_on: object, row: pd.Series) -> str:
    """Kind of port and place of a row in words, or its channels."""
    is_nowhere = acts_on in NOWHERE
    return row["setting"].replace("sensor", "channel", 1) if is_nowhere else f"{acts_on}{_at(row)}"


def _at(row: pd.Series) -> str:
    """Place of a row in words: one where both ends round to the same."""
    texts = [
        ", ".join(f"{1e3 * coordinate:.0f}" for coordinate in end) for end in ends_in_metres(row)
    ]
    pairs = zip(("at", "to"), dict.fromkeys(texts), strict=False)
    return "".join(f" {word} {text} mm" for word, text in pairs)
