"""Places of sensors, actuators and effects, recorded and inferred; outline and mode shapes."""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array

from ..._shared.compiled import compiled
from ...effects.effect import Effect
from ...experiment.experiment import Experiment
from ...experiment.natural_modes import natural_modes
from ...experiment.transducers import Transducer
from ...inference.alternative_explanation import JointDraws
from ...inference.symmetries import Values
from ...modes.finite_elements.outline import outline
from ...positions.bounds import in_space
from ...positions.places import coordinates
from ...positions.vectors import unit_vector
from ..fitted import with_arrays
from ..locations import locations_as_read

DRAWS = 400
"""Draws of a position that are kept."""

AXES = (1, 2, 3)
Row: TypeAlias = dict[str, str | np.ndarray]


def places(
    experiment: Experiment, prior: JointDraws, posterior: JointDraws, values: Mapping[str, float]
) -> xr.Dataset:
    """Return positions and orientations of all instruments, and positions of effects.

    Draws are [draw, ...] by name; means of the unknowns, elements of arrays one by one, stand for
    draws that are not known. By instrument or effect (`item`, with its `kind`) the result has
    `recorded`, `prior` and `posterior` coordinates [m]; `tilt`, the angle [deg] of the first
    channel against its record, and `direction_recorded`, `direction` as inferred. NaN where there
    is none; coordinates that a line does not have are zero.
    """
    rows = [
        _row(experiment, kind, transducer, (prior, posterior))
        for kind, side in (("sensor", experiment.sensor), ("actuator", experiment.actuator))
        for transducer in side.values()
    ]
    known = posterior or {name: np.array([value]) for name, value in values.items()}
    rows += [
        _effect_row(effect, experiment, known)
        for effect in experiment.effects
        if effect.place_fields
    ]
    names = [row.pop("name") for row in rows]
    kinds = [row.pop("kind") for row in rows]
    dimensions = {
        "recorded": ("item", "axis"),
        "prior": ("item", "draw", "axis"),
        "posterior": ("item", "draw", "axis"),
        "tilt": ("item", "draw"),
        "direction_recorded": ("item", "axis"),
        "direction": ("item", "axis"),
    }
    units = {"tilt": "deg", "direction": "1", "direction_recorded": "1"}
    variables = {
        word: (of, np.stack([row[word] for row in rows]), {"units": units.get(word, "m")})
        for word, of in dimensions.items()
    }
    labels = {"item": names, "kind": ("item", kinds), "axis": ["x", "y", "z"]}
    return xr.Dataset(variables, coords=labels)


def _row(
    experiment: Experiment, kind: str, transducer: Transducer, draws: tuple[JointDraws, JointDraws]
) -> Row:
    """Record and draws of one instrument."""
    (prior, _), (posterior, directions) = (_drawn(experiment, kind, transducer, d) for d in draws)
    recorded = np.asarray(unit_vector(transducer.directions[0]), float)
    row: Row = {
        "name": transducer.name,
        "kind": kind,
        "recorded": _three(np.asarray(transducer.recorded, float)),
        "prior": prior,
        "posterior": posterior,
        "tilt": np.full(DRAWS, np.nan),
        "direction_recorded": recorded,
        "direction": np.full(3, np.nan),
    }
    if transducer.angles is not None:
        cosine = np.clip(directions @ recorded, -1.0, 1.0)
        row["tilt"] = np.degrees(np.arccos(cosine))
        mean = directions.mean(axis=0)
        row["direction"] = mean / np.linalg.norm(mean)
    return row


def _effect_row(effect: Effect, experiment: Experiment, draws: JointDraws) -> Row:
    """Draws of the place of one effect."""
    count = min([DRAWS, *map(len, draws.values())])
    thinned = {
        name: np.asarray(values)[_rows(len(values), count)] for name, values in draws.items()
    }
    positions = locations_as_read(effect, experiment, thinned, count)
    on_line = np.isnan(positions[:, 1:]).all() and np.isfinite(positions[:, 0]).all()
    filled = np.where(np.isnan(positions), 0.0, positions) if on_line else positions
    nowhere = np.full((DRAWS, 3), np.nan)
    return {
        "name": effect.name,
        "kind": "effect",
        "recorded": nowhere[0],
        "prior": nowhere,
        "posterior": filled[_rows(count, DRAWS)],
        "tilt": nowhere[:, 0],
        "direction_recorded": nowhere[0],
        "direction": nowhere[0],
    }


def _drawn(
    experiment: Experiment, kind: str, transducer: Transducer, draws: JointDraws
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates [draw, 3] and direction [draw, 3] of the first channel at draws."""
    names = [
        unknown.name
        for unknown in experiment.unknowns
        if unknown.owner == (kind, transducer.name) and unknown.field in ("position", "angles")
    ]
    missing = [name for name in names if name not in draws]
    if missing:
        return np.full((DRAWS, 3), np.nan), np.full((DRAWS, 3), np.nan)
    chosen = {name: np.asarray(draws[name])[_rows(len(draws[name]), DRAWS)] for name in names}
    path = (kind, transducer.name)
    if not names:
        position, direction = (np.asarray(part)[None] for part in _mounted(experiment, path, {}))
    else:
        position, direction = map(np.asarray, compiled(_at_draws)(experiment, path, chosen))
    rows = _rows(len(position), DRAWS)
    return np.stack([_three(row) for row in position])[rows], direction[rows]


def _at_draws(experiment: Experiment, path: tuple[str, str], draws: Values) -> tuple[Array, Array]:
    return jax.vmap(lambda values: _mounted(experiment, path, values))(draws)


def _mounted(experiment: Experiment, path: tuple[str, str], values: Values) -> tuple[Array, Array]:
    """Coordinates of the transducer at a path, and direction of its first channel."""
    kind, name = path
    there = getattr(experiment.fix(values), kind)[name]
    direction = jnp.asarray(there.points(AXES).direction)[0]
    return jnp.atleast_1d(coordinates(there.position)), direction


def _rows(count: int, wanted: int) -> np.ndarray:
    """Numbers of `wanted` of `count` draws, evenly spread, some of them repeated where few."""
    return (np.arange(wanted) * count) // wanted


def _three(coordinates: np.ndarray) -> np.ndarray:
    """Three coordinates; those that a line does not have are zero."""
    return np.pad(np.atleast_1d(coordinates), (0, 3 - np.size(coordinates)))


POINTS_ON_A_LINE = 121

MOST_LINES = 2500
"""Lines of a mesh, or nodes, that are kept."""

FEWEST_LINES = 240
"""Lines at least, into which those of a frame are divided, so that they bend."""

SAME = 1e-9
"""Share of the size of a structure within which two points are one."""

MOST_MODES = 6

BEYOND = 1.3
"""Natural frequencies up to so many times the greatest line are sought."""


class Outline(NamedTuple):
    """Points of a structure and the lines between them."""

    points: np.ndarray
    """Points [place, 3] [m]."""
    lines: np.ndarray
    """Numbers of both ends of each line [line, 2]."""
    on_a_line: bool
    """Whether the structure is a line along x."""


def outline_of(experiment: Experiment) -> "xr.Dataset":
    """Return the points of a structure [m] and the pairs of them that are joined, with labels."""
    return _labelled(*points_and_lines(experiment))


def points_and_lines(experiment: Experiment) -> Outline:
    """Return the points of a structure [m] and the pairs of them that are joined."""
    modes = experiment.structure.modes
    if not in_space(modes.bounds()):
        low, high = map(float, modes.bounds())
        points = np.zeros((POINTS_ON_A_LINE, 3))
        points[:, 0] = np.linspace(low, high, POINTS_ON_A_LINE)
        numbers = np.arange(POINTS_ON_A_LINE)
        lines = np.stack([numbers[:-1], numbers[1:]], axis=1)
        return Outline(points, lines, on_a_line=True)
    drawn, style = outline(modes)
    if style == "-":
        ends = drawn.reshape(-1, 3, 3)[:, :2]
        ends = ends[:: -(-len(ends) // MOST_LINES)]
        points, lines = _joined(_subdivided(ends))
    else:
        points, lines = drawn[:: -(-len(drawn) // MOST_LINES)], np.zeros((0, 2), int)
    return Outline(points, lines, on_a_line=False)


def _subdivided(ends: np.ndarray) -> np.ndarray:
    """Ends [line, end, 3] of shorter lines, where there are so few that they would not bend."""
    parts = max(1, FEWEST_LINES // len(ends))
    along = np.linspace(0.0, 1.0, parts + 1)[:, None]
    points = ends[:, :1] + along * (ends[:, 1:] - ends[:, :1])
    return np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)


def _joined(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that differ [point, 3], and the numbers of both ends of each line [line, 2]."""
    size = float(np.ptp(ends.reshape(-1, 3), axis=0).max()) or 1.0
    cells = np.round(ends.reshape(-1, 3) / (SAME * size))
    _, first, numbers = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    return ends.reshape(-1, 3)[first], numbers.reshape(-1, 2)


def shapes(
    experiment: Experiment, values: Mapping[str, float], outline: "xr.Dataset"
) -> "xr.Dataset":
    """Return the first natural modes, up to a little above the band, at the points of an outline.

    The outline is that of `outline_of`; elements of arrays are given one by one.
    """
    import xarray as xr

    structure = experiment.fix(with_arrays(experiment, values)).structure
    points = outline["point"].values
    at = points[:, 0] if outline.attrs["on_a_line"] else points
    modes = natural_modes(structure, at, BEYOND * float(np.max(experiment.frequency)), MOST_MODES)
    variables = {
        "natural_frequency": ("mode", modes.frequency, {"units": "Hz"}),
        "shape": (("mode", "place", "axis"), modes.shape, {"units": "1"}),
    }
    return xr.Dataset(variables, coords={"axis": ["x", "y", "z"]}).assign_attrs(
        axes=[int(axis) for axis in structure.modes.axes]
    )


def _labelled(points: np.ndarray, lines: np.ndarray, on_a_line: bool) -> "xr.Dataset":
    import xarray as xr

    variables = {
        "point": (("place", "axis"), points, {"units": "m"}),
        "line": (("line_number", "end"), lines),
    }
    return xr.Dataset(variables, coords={"axis": ["x", "y", "z"]}).assign_attrs(
        on_a_line=int(on_a_line)
    )
