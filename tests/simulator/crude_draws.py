"""Measurements of structures whose model is wrong as a whole, before and after a change, by seed.

What every real structure has (`imperfect_scenes`), and besides one fault of the drawing: a support
that is none, a size off by 5 to 15 %, a stiffener left out, a mesh too coarse. Independent of
bayes_placement.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.simulator.fine_elements import NOTHING, Effect, plant
from tests.simulator.hidden_scenes import COARSE, log_uniform
from tests.simulator.hidden_structures import Instrument, Record, record
from tests.simulator.imperfect_draws import AVERAGES
from tests.simulator.imperfect_effects import EFFECTS, made
from tests.simulator.imperfect_scenes import FORMS, MODES, PIECES, Scene, Structure, drawn
from tests.simulator.ritz_plates import Plate, plate_plant

CHANGES = ("point_mass", "ground_spring", "local_stiffness_loss")
"""What may have come between two records: what moves natural frequencies."""

SHIFT = (0.05, 0.12)
"""Greatest change of one of the natural frequencies in the band [1]."""

PARTS = 60
"""Modes of which those of the changed structure are made."""


@dataclass(frozen=True)
class CrudeDraw:
    """What is given to the engineer (nominal, priors, instruments, records), and the truth."""

    form: str
    fault: str
    nominal: Structure
    cells: tuple[int, int] | None  # of the mesh of a plate; None for a fine one
    priors: dict[str, tuple[float, float]]
    sensors: tuple[Instrument, ...]
    actuators: tuple[Instrument, ...]
    records: tuple[Record, ...]  # one, later
    baseline: Record
    true: Structure
    hidden: Effect
    shift: float


def size(generator: np.random.Generator) -> float:
    """Factor of a size that is off by 5 to 15 %, either way."""
    return float((1 + generator.uniform(0.05, 0.15)) ** generator.choice([-1.0, 1.0]))


def longer(generator: np.random.Generator, true: Structure) -> Structure:
    """A line longer than drawn: all instruments are on it."""
    return replace(true, length=true.length * (1 + generator.uniform(0.05, 0.15)))


def soft_support(generator: np.random.Generator, true: Structure) -> Structure:
    """A bar held by a spring in the place of a wall."""
    stiffness = log_uniform(generator, 2.0, 20.0) * true.rigidity / true.length
    return replace(true, ends="free-free", suspension=((0.0, stiffness),))


def stiff_suspension(generator: np.random.Generator, true: Structure) -> Structure:
    """A beam that hangs on springs at about its quarter points, drawn as free."""
    stiffness = log_uniform(generator, 20.0, 300.0) * true.rigidity / true.length**3
    places = generator.uniform([0.15, 0.7], [0.3, 0.85]) * true.length
    return replace(true, suspension=tuple((place, stiffness) for place in places.tolist()))


def other_thickness(generator: np.random.Generator, true: Structure) -> Structure:
    factor = size(generator)
    if isinstance(true, Plate):
        return replace(true, thickness=factor * true.thickness)
    return replace(true, area=factor * true.area, second_moment=factor**3 * true.second_moment)


def stiffener(generator: np.random.Generator, true: Structure) -> Structure:
    """Two neighbouring pieces of a line, or a row of patches of a plate, stiffer than drawn."""
    pieces = np.array(true.pieces)
    if isinstance(true, Plate):
        columns, rows = true.grid
        stiffer = np.arange(columns) + columns * int(generator.integers(rows))
    else:
        stiffer = int(generator.integers(PIECES - 1)) + np.arange(2)
    pieces[stiffer] *= generator.uniform(1.5, 3.0)
    return replace(true, pieces=tuple(pieces.tolist()))


def clamped(generator: np.random.Generator, true: Structure) -> Structure:
    """A plate clamped along one pair of edges, drawn as supported."""
    return replace(true, ends="clamped-clamped")


def as_drawn(generator: np.random.Generator, true: Structure) -> Structure:
    return true


COARSE_CELLS = (4, 3)

FAULTS: Mapping[str, Mapping[str, Callable[[np.random.Generator, Structure], Structure]]] = {
    "bar": {"support": soft_support, "length": longer, "stiffener": stiffener},
    "beam": {"support": stiff_suspension, "thickness": other_thickness, "stiffener": stiffener},
    "plate": {
        "support": clamped,
        "thickness": other_thickness,
        "stiffener": stiffener,
        "mesh": as_drawn,
    },
}
"""Faults of the drawing of each form: what the true structure is."""


def draw(seed: int, is_changed: bool) -> CrudeDraw:
    """Draw a structure of a crude model; forms and faults take turns with the seed."""
    form = FORMS[seed % len(FORMS)]
    fault = [*FAULTS[form]][seed // len(FORMS) % len(FAULTS[form])]
    for attempt in range(80):
        key = (seed, attempt)
        scene = drawn(key, form)
        true = FAULTS[form][fault](np.random.default_rng([*key, 9]), scene.true)
        scene = replace(scene, true=true)
        hidden, shift = change(key, scene) if is_changed else (NOTHING, 0.0)
        if hidden is not None:
            return measured(scene, fault, hidden, shift, np.random.default_rng([*key, 1]))
    raise ValueError(f"No change moves a natural frequency as asked, seed {seed}.")


def change(key: tuple[int, int], scene: Scene) -> tuple[Effect | None, float]:
    """A change that moves one natural frequency by a share within `SHIFT`, and that share."""
    name = CHANGES[int(np.random.default_rng([key[0], 10]).integers(len(CHANGES)))]
    target = np.random.default_rng([*key, 11]).uniform(*SHIFT)
    low, high = EFFECTS[name].strengths
    for _ in range(30):
        strength = float(np.sqrt(low * high))
        hidden = made(key, scene, name, strength)
        shift = moved(scene, hidden)
        if abs(shift - target) < 0.05 * target:
            return hidden, shift
        low, high = (strength, high) if shift < target else (low, strength)
    return None, 0.0


def moved(scene: Scene, hidden: Effect) -> float:
    """Greatest relative change of a natural frequency in the band."""
    before, after = (natural(scene, each)[:MODES] for each in (NOTHING, hidden))
    elastic = before > 1e-3 * before[-1]
    return float(np.max(np.abs(after[elastic] / before[elastic] - 1)))


def natural(scene: Scene, hidden: Effect) -> np.ndarray:
    """Natural angular frequencies [rad/s] with an effect."""
    is_plate = isinstance(scene.true, Plate)
    system = plate_plant(scene.true, hidden) if is_plate else plant(scene.true, hidden, COARSE)
    values = dict(hidden.pairs)
    stiffness, mass = np.diag(system.natural[:PARTS] ** 2), np.eye(PARTS)
    if hidden.name in ("point_mass", "ground_spring"):
        row = system.rows([values["at"]])[:, :PARTS]
        stiffness = stiffness + values.get("stiffness", 0.0) * row.T @ row
        mass = mass + values.get("mass", 0.0) * row.T @ row
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real
    return np.sqrt(np.maximum(np.sort(squares), 0.0))


def measured(
    scene: Scene, fault: str, hidden: Effect, shift: float, generator: np.random.Generator
) -> CrudeDraw:
    before, after = (
        record(scene.response(each), scene.frequency, generator, AVERAGES)
        for each in (NOTHING, hidden)
    )
    return CrudeDraw(
        form=scene.form,
        fault=fault,
        nominal=scene.nominal,
        cells=COARSE_CELLS if fault == "mesh" else None,
        priors=scene.priors,
        sensors=scene.sensors,
        actuators=scene.actuators,
        records=(after,),
        baseline=before,
        true=scene.true,
        hidden=hidden,
        shift=shift,
    )
