"""Effects of any kind on a structure: laws at ports, channels, dimensions.

Independent of bayes_placement.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.simulator import law_networks
from tests.simulator.fine_elements import ELEMENTS, Line
from tests.simulator.hidden_scenes import log_uniform
from tests.simulator.imperfect_scenes import place_of, somewhere
from tests.simulator.law_networks import ABSORBER, Tree, dynamic_stiffness, grouped, networks
from tests.simulator.port_plants import Cut, PlateWithPorts, closed, flexibility, line_plant
from tests.simulator.unlisted_scenes import FORMS, LINES, Scene

STRONGEST = 1e5
"""Greatest strength of what may be of any size."""

BEAMS = ("cantilever", "freebeam")


@dataclass(frozen=True)
class Hidden:
    """An effect: the kind of its port, its law (a tree or a word), its numbers and places [m]."""

    kind: str
    law: Any
    values: tuple[float, ...]
    powers: tuple[int, ...]  # of the strength, with which each number grows
    places: tuple[Any, ...] = ()
    channel: str = ""

    def of_strength(self, strength: float) -> "Hidden":
        grown = (v * strength**p for v, p in zip(self.values, self.powers, strict=True))
        return replace(self, values=tuple(grown))

    @property
    def most(self) -> float:
        """Greatest strength of a thing: a length a few per cent off, a loss factor of 1."""
        sizes = {"length": 0.05, "gain": 0.5, "layer": 1.0}
        is_sized = isinstance(self.law, str) and self.law in sizes
        return sizes[self.law] / abs(self.values[0]) if is_sized else STRONGEST


def response(scene: Scene, hidden: Sequence[Hidden], elements: int = ELEMENTS) -> np.ndarray:
    """Accelerance of shape (sensor, actuator, line) without noise, as recorded."""
    omega = 2 * np.pi * scene.frequency
    true, system = system_of(scene, hidden, elements)
    read, driven = (
        system.rows([one.true for one in side]) for side in (scene.sensors, scene.actuators)
    )
    pairs = [pair for effect in hidden for pair in attached(effect, system, omega)]
    cuts = [effect for effect in hidden if effect.kind == "cut"]
    pairs += [(system.jumps[[n]], loss(effect, omega)) for n, effect in enumerate(cuts)]
    ports = np.concatenate([rows for rows, _ in pairs]) if pairs else np.zeros((0, 0))
    laws = [np.tile(law[:, None], (1, len(rows))) for rows, law in pairs]
    laws = np.concatenate(laws, axis=1) if pairs else np.zeros((0, 0))
    moved = closed(read, driven, flexibility(system, true, omega), ports, laws)
    signs = np.outer(
        *(np.sign([x.direction for x in side]) for side in (scene.sensors, scene.actuators))
    )
    recorded = -(omega**2) * moved * (signs * scene.gains)[:, :, None]
    return recorded * chain(scene, hidden, omega)[:, None, :]


def system_of(scene: Scene, hidden: Sequence[Hidden], elements: int):
    """The true structure and its modes: with its true length and its cuts, nothing attached."""
    if scene.form == "plate":
        return scene.true, PlateWithPorts(scene.true)
    errors = [effect.values[0] for effect in hidden if effect.law == "length"]
    true = replace(scene.true, length=scene.true.length * (1 + sum(errors)))
    cuts = tuple(
        Cut(effect.places[0], effect.values[0]) for effect in hidden if effect.kind == "cut"
    )
    # A bar has a kink where a force acts, a beam where a moment does.
    kinked = {"displacement", "relative"} if true.kind == "bar" else {"rotation", "body"}
    nodes = [p for effect in hidden if effect.kind in {"region", *kinked} for p in effect.places]
    if true.kind == "bar":
        nodes += [actuator.true for actuator in scene.actuators]
        nodes += [place for place, _ in true.masses]
    return true, line_plant(true, cuts, tuple(nodes), elements)


def loss(effect: Hidden, omega: np.ndarray) -> np.ndarray:
    """What a lossy cut adds to that of the modes [N/m]."""
    share = effect.values[1] if effect.law == "h" else 0.0
    return 1j * share * effect.values[0] + 0 * omega


def attached(effect: Hidden, system, omega: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows of the ports of an effect, and the dynamic stiffness at each line."""
    places = effect.places
    if effect.kind == "body":
        mass, radius, offset = effect.values
        turned = system.rows(places, 1)
        inertial = -(omega**2) * mass
        beside = system.rows(places) + offset * turned
        return [(beside, inertial), (turned, inertial * radius**2)]
    if effect.law == "layer":
        eta, share = effect.values
        strained = system.part(*places, 1 if system.open.line.kind == "bar" else 2)
        return [(strained, eta * (share + 1j) + 0 * omega)]
    rows = {
        "displacement": lambda: system.rows(places),
        "rotation": lambda: system.rows(places, 1),
        "relative": lambda: np.diff(system.rows(places), axis=0),
        "region": lambda: system.part(*places, 0) / np.sqrt(np.prod(np.subtract(*places[::-1]))),
    }
    if effect.kind not in rows:
        return []
    return [(rows[effect.kind](), dynamic_stiffness(effect.law, effect.values, omega))]


def chain(scene: Scene, hidden: Sequence[Hidden], omega: np.ndarray) -> np.ndarray:
    """Factor of each sensor and line between motion and record."""
    total = np.ones((len(scene.sensors), omega.size), dtype=complex)
    for effect in hidden:
        if isinstance(effect.law, str) and effect.law in FACTORS:
            whose = [effect.channel in ("", sensor.name) for sensor in scene.sensors]
            total[whose] *= FACTORS[effect.law](omega, effect.values)
    return total


def butterworth(omega: np.ndarray, values: Sequence[float]) -> np.ndarray:
    """Low-pass of first or second order."""
    ratio = 1j * omega / (2 * np.pi * values[0])
    return 1 / (1 + ratio if values[1] == 1 else 1 + np.sqrt(2) * ratio + ratio**2)


FACTORS = {
    "gain": lambda omega, values: 1 + values[0] + 0j * omega,
    "delay": lambda omega, values: np.exp(-1j * omega * values[0]),
    "low_pass": butterworth,
}


@dataclass(frozen=True)
class Kind:
    """How an effect of strength one is made, how often, and of which forms it is known."""

    make: Callable[[np.random.Generator, Scene, Tree | str], Hidden]
    laws: Callable[[np.random.Generator], Tree | str]
    share: float
    forms: tuple[str, ...] = FORMS


def chosen(*words: str) -> Callable[[np.random.Generator], str]:
    return lambda generator: str(generator.choice(words))


CLASSES = {
    "one": (0.25, networks(1)),
    "two": (0.25, networks(2)),
    "three": (0.30, [tree for tree in networks(3) if law_networks.is_grounded(tree)]),
    "fractional": (0.08, ["p", grouped("|", ["k", "p"])]),
    "lossy": (0.06, ["h", grouped("|", ["h", "m"]), grouped("-", ["h", "m"])]),
    "two absorbers": (0.06, [["|", ABSORBER, ABSORBER]]),
}


def any_network(generator: np.random.Generator) -> Tree:
    shares = [share for share, _ in CLASSES.values()]
    trees = list(CLASSES.values())[generator.choice(len(shares), p=shares)][1]
    return trees[generator.integers(len(trees))]


def at(generator: np.random.Generator, scene: Scene) -> Any:
    return somewhere(generator, scene.true, 0.1)


def network(kind: str, scale: float, generator, scene: Scene, law: Tree, places) -> Hidden:
    stiffness = scale * scene.reference
    values = law_networks.random_values(generator, law, stiffness, scene.band)
    return Hidden(kind, law, values, law_networks.powers(law), places)


def displacement(generator, scene, law):
    return network("displacement", 1.0, generator, scene, law, (at(generator, scene),))


def rotation(generator, scene, law):
    scale = 0.01 * scene.true.length**2
    return network("rotation", scale, generator, scene, law, (at(generator, scene),))


def relative(generator, scene, law):
    """A strut whose ends are apart by a fifth of the length or more."""
    while True:
        places = tuple(at(generator, scene) for _ in range(2))
        if np.linalg.norm(np.subtract(*places)) > 0.2 * scene.true.length:
            return network("relative", 1.0, generator, scene, law, tuple(sorted(places)))


def body(generator, scene, law):
    length = scene.true.length
    offset = log_uniform(generator, 0.01, 0.06) * length * generator.choice([-1.0, 1.0])
    radius = log_uniform(generator, 0.01, 0.1) * length
    values = scene.true.mass, radius, float(offset)
    return Hidden("body", law, values, (1, 0, 0), (at(generator, scene),))


def cut(generator, scene, law):
    line = scene.true
    stiffness = line.rigidity / line.length
    eta = (log_uniform(generator, 0.05, 0.5),) if law == "h" else ()
    return Hidden("cut", law, (stiffness, *eta), (-1, 0)[: 1 + len(eta)], (at(generator, scene),))


def region(generator, scene, law):
    """A segment, or a patch, of 0.1 to 0.3 of each side."""
    of = scene.true
    sides = np.array([of.length] if isinstance(of, Line) else [of.length, of.width])
    if law == "layer" and not isinstance(of, Line):
        law = str(generator.choice(["k", "m"]))
    start = generator.uniform(0.08, 0.6, sides.size)
    end = start + generator.uniform(0.1, 0.3, sides.size)
    places = place_of(start * sides), place_of(end * sides)
    if law == "layer":
        share = float(generator.uniform(0.0, 0.3))
        return Hidden("region", law, (0.1, share), (1, 0), places)
    return network("region", 1.0, generator, scene, law, places)


def filtered(kind: str, generator, scene: Scene, law: str) -> Hidden:
    channel = str(generator.choice([sensor.name for sensor in scene.sensors]))
    values = {
        "gain": (float(generator.choice([-1.0, 1.0])),),
        "delay": (1 / scene.band[1],),
        "low_pass": (scene.frequency[-1], float(generator.integers(1, 3))),
    }[law]
    powers = (-1, 0) if law == "low_pass" else (1,)
    return Hidden(kind, law, values, powers, (), channel if kind == "channel" else "")


def channel(generator, scene, law):
    return filtered("channel", generator, scene, law)


def all_channels(generator, scene, law):
    return filtered("all_channels", generator, scene, law)


def dimension(generator, scene, law):
    return Hidden("structure", law, (float(generator.choice([-1.0, 1.0])),), (1,))


INNER = chosen("k", "c", "h")

KINDS = {
    "displacement": Kind(displacement, any_network, 0.5),
    "rotation": Kind(rotation, chosen("k", "c", "h", "m"), 0.1, BEAMS),
    "body": Kind(body, chosen("body"), 0.07, BEAMS),
    "relative": Kind(relative, INNER, 0.07),
    "cut": Kind(cut, chosen("k", "h"), 0.08, LINES),
    "region": Kind(region, chosen("k", "m", "layer"), 0.08),
    "channel": Kind(channel, chosen("gain", "delay", "low_pass"), 0.04),
    "all_channels": Kind(all_channels, chosen("delay", "low_pass"), 0.03),
    "structure": Kind(dimension, chosen("length"), 0.03, LINES),
}
