"""Random structures that hide an effect of a stated strength.

Bars and beams of random dimensions, material and ends, with instruments somewhat off their recorded
positions; only the effect depends on the strength. Independent of bayes_placement.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.simulator.fine_elements import NOTHING, Effect, Line, effect, plant
from tests.simulator.hidden_structures import Instrument, accelerance, deviation

COARSE = 60
"""Elements with which a strength is tuned; the measurement has more."""

MATERIALS = ((210e9, 7850.0), (70e9, 2700.0), (105e9, 8500.0), (3.2e9, 1190.0), (1e9, 9000.0))
ENDS = ("fixed-fixed", "fixed-free", "free-free")


@dataclass(frozen=True)
class Scene:
    """All of a draw that is fixed before the noise falls."""

    nominal: Line
    priors: dict[str, tuple[float, float]]
    true: Line
    sensors: tuple[Instrument, ...]
    actuators: tuple[Instrument, ...]
    frequency: np.ndarray
    force_levels: tuple[float | None, ...]
    hidden: Effect

    def responses(self, hidden: Effect, elements: int) -> np.ndarray:
        """Accelerance of shape (force level, sensor, actuator, line) without noise."""
        return np.stack(
            [
                accelerance(
                    self.true,
                    self.sensors,
                    self.actuators,
                    self.frequency,
                    hidden,
                    level or 1.0,
                    elements,
                )
                for level in self.force_levels
            ]
        )

    def misfit(self) -> float:
        """Expected chi2 per datum of the structure without the effect, all else true."""
        exact, without = (self.responses(hidden, COARSE) for hidden in (self.hidden, NOTHING))
        return 1 + float(np.mean(np.abs(exact - without) ** 2 / deviation(exact) ** 2))


def drawn(key: tuple[int, ...], name: str | None, strength: float) -> Scene:
    """The scene of a key, the same for every strength but for what the strength says."""
    generator = np.random.default_rng([*key, 0])
    kinds, ends = (EFFECTS[name].kinds, EFFECTS[name].ends) if name else (("bar", "beam"), ENDS)
    kind = str(generator.choice(kinds))
    slenderness = log_uniform(generator, 0.004, 0.02)
    if name == "shear_and_rotary_inertia":
        slenderness = strength
    nominal = structure(generator, kind, str(generator.choice(ends)), slenderness)
    priors = prior(generator, nominal)
    true = replace(
        nominal, **{field: generator.uniform(*bounds) for field, bounds in priors.items()}
    )
    if name == "hysteretic_damping":
        # Twice the damping ratio is the loss factor that looks alike at resonance.
        scale = strength / 2 / true.damping_ratio
        nominal, true = (replace(x, damping_ratio=x.damping_ratio * scale) for x in (nominal, true))
        priors["damping_ratio"] = tuple(scale * x for x in priors["damping_ratio"])
    careful = 0.05 if name == "misplaced_sensor" else 1.0
    sensors, actuators = instruments(generator, nominal, careful)
    frequency = lines(generator, nominal)
    levels = generator.random() < 0.25 or name == "cubic_stiffness"
    scene = Scene(
        nominal=nominal,
        priors=priors,
        true=true,
        sensors=sensors,
        actuators=actuators,
        frequency=frequency,
        force_levels=(1.0, 3.0, 6.0) if levels else (None,),
        hidden=NOTHING,
    )
    return replace(scene, hidden=EFFECTS[name].make(generator, scene, strength)) if name else scene


def log_uniform(generator: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(generator.uniform(np.log(low), np.log(high))))


def structure(generator: np.random.Generator, kind: str, ends: str, slenderness: float) -> Line:
    """Nominal structure; a free one sometimes on soft springs, far below the band."""
    length = log_uniform(generator, 0.4, 2.0)
    youngs_modulus, density = generator.choice(MATERIALS)
    height = length * (slenderness if kind == "beam" else 0.03)
    width = height * generator.uniform(1.0, 4.0)
    damping_ratio = log_uniform(generator, *((0.01, 0.04) if kind == "bar" else (0.004, 0.015)))
    line = Line(
        kind=kind,
        ends=ends,
        length=length,
        area=width * height,
        youngs_modulus=float(youngs_modulus),
        density=float(density),
        damping_ratio=damping_ratio,
        second_moment=width * height**3 / 12,
    )
    if ends == "free-free" and generator.random() < 0.5:
        spring = line.mass * (0.03 * elastic(line)[0]) ** 2 / 2
        return replace(line, suspension=((0.2 * length, spring), (0.8 * length, spring)))
    return line


def elastic(line: Line) -> np.ndarray:
    """Natural angular frequencies [rad/s] of the elastic modes."""
    rigid = {"bar": 1, "beam": 2}[line.kind] if line.ends == "free-free" else 0
    return plant(line, elements=COARSE).natural[rigid:]


def prior(generator: np.random.Generator, line: Line) -> dict[str, tuple[float, float]]:
    """Bounds of what is uncertain."""
    stiffness = generator.uniform(0.04, 0.08)
    shares = {
        "youngs_modulus": (1 - stiffness, 1 + stiffness),
        "damping_ratio": (0.5, 2.0),
        **({"density": (0.97, 1.03)} if generator.random() < 1 / 3 else {}),
    }
    return {name: tuple(getattr(line, name) * x for x in ends) for name, ends in shares.items()}


def instruments(
    generator: np.random.Generator, line: Line, careful: float
) -> tuple[tuple[Instrument, ...], tuple[Instrument, ...]]:
    """Three to five sensors and one or two actuators, none close to another of its kind."""
    within = round(careful * generator.uniform(0.01, 0.03) * line.length, 6)
    sides = []
    for letter, count in (("s", generator.integers(3, 6)), ("a", generator.integers(1, 3))):
        places = apart(generator, count) * line.length
        sides.append(
            tuple(
                placed(generator, line, f"{letter}{index}", place, within)
                for index, place in enumerate(places, start=1)
            )
        )
    return sides[0], sides[1]


def apart(generator: np.random.Generator, count: int, distance: float = 0.08) -> np.ndarray:
    places = generator.uniform(0.06, 0.94, count)
    while np.any(np.diff(np.sort(places)) < distance):
        places = generator.uniform(0.06, 0.94, count)
    return places


def placed(
    generator: np.random.Generator, line: Line, name: str, place: float, within: float
) -> Instrument:
    recorded = round(place, 4)
    sign = int(generator.choice([-1, 1]))
    true = recorded + generator.uniform(-within, within)
    return Instrument(name, recorded, within, sign * (1 if line.kind == "bar" else 3), true)


def lines(generator: np.random.Generator, line: Line) -> np.ndarray:
    """Lines [Hz] of a band that holds four to nine elastic modes."""
    modes = int(generator.integers(4, 10))
    natural = elastic(line) / (2 * np.pi)
    band = 0.4 * natural[0], np.sqrt(natural[modes - 1] * natural[modes])
    return np.linspace(*band, 300) if line.kind == "bar" else np.geomspace(*band, 400)


@dataclass(frozen=True)
class Kind:
    """How an effect is made, between which strengths, and of which structures it is known."""

    make: Callable[[np.random.Generator, Scene, float], Effect]
    strengths: tuple[float, float]
    kinds: tuple[str, ...] = ("bar", "beam")
    ends: tuple[str, ...] = ENDS


def anywhere(generator: np.random.Generator, scene: Scene) -> float:
    return generator.uniform(0.1, 0.9) * scene.true.length


def in_band(generator: np.random.Generator, scene: Scene) -> float:
    """A frequency [Hz] in the band, not at its edges."""
    low, high = np.log(scene.frequency[[0, -1]])
    return float(np.exp(low + generator.uniform(0.3, 0.8) * (high - low)))


def modal_stiffness(scene: Scene) -> float:
    return scene.true.mass * elastic(scene.true)[0] ** 2


def whose(generator: np.random.Generator, scene: Scene) -> Instrument:
    return scene.sensors[generator.integers(len(scene.sensors))]


def point_mass(generator, scene, strength):
    return effect("point_mass", at=anywhere(generator, scene), mass=strength * scene.true.mass)


def ground_spring(generator, scene, strength):
    stiffness = strength * modal_stiffness(scene)
    return effect("ground_spring", at=anywhere(generator, scene), stiffness=stiffness)


def ground_dashpot(generator, scene, strength):
    viscosity = strength * scene.true.mass * elastic(scene.true)[0]
    return effect("ground_dashpot", at=anywhere(generator, scene), viscosity=viscosity)


def tuned_absorber(generator, scene, strength):
    return effect(
        "tuned_absorber",
        at=anywhere(generator, scene),
        frequency=in_band(generator, scene),
        damping_ratio=log_uniform(generator, 0.01, 0.1),
        mass=strength * scene.true.mass,
    )


def local_stiffness_loss(generator, scene, strength):
    return effect(
        "local_stiffness_loss",
        at=generator.uniform(0.12, 0.88) * scene.true.length,
        extent=generator.uniform(0.02, 0.06) * scene.true.length,
        share=strength,
    )


def hysteretic_damping(generator, scene, strength):
    return effect("hysteretic_damping", loss_factor=strength)


def viscoelastic_modulus(generator, scene, strength):
    time = 1 / (2 * np.pi * in_band(generator, scene))
    return effect("viscoelastic_modulus", relaxing=strength, relaxation_time=time)


def compliant_support(generator, scene, strength):
    fixed = [
        side for side, end in zip(SIDES, scene.true.ends.split("-"), strict=True) if end != "free"
    ]
    compliance = strength * scene.true.length / scene.true.rigidity
    return effect("compliant_support", end=str(generator.choice(fixed)), compliance=compliance)


def axial_preload(generator, scene, strength):
    buckling = 4 * np.pi**2 * scene.true.rigidity / scene.true.length**2
    return effect("axial_preload", tension=strength * buckling)


def shear_and_rotary_inertia(generator, scene, strength):
    return effect("shear_and_rotary_inertia", shear_correction=5 / 6, poisson_ratio=0.3)


def cubic_stiffness(generator, scene, strength):
    stiffness = strength * modal_stiffness(scene) ** 3 / scene.force_levels[-1] ** 2
    return effect("cubic_stiffness", at=anywhere(generator, scene), stiffness=stiffness)


def sensor_mass(generator, scene, strength):
    mass, roving = strength * scene.true.mass, bool(generator.random() < 0.5)
    return effect("sensor_mass", mass=mass, roving=roving)


def time_delay(generator, scene, strength):
    return effect("time_delay", delay=strength / (2 * np.pi * scene.frequency[-1]))


def gain_error(generator, scene, strength):
    error = strength * generator.choice([-1.0, 1.0])
    return effect("gain_error", sensor=whose(generator, scene).name, error=error)


def mount_resonance(generator, scene, strength):
    return effect(
        "mount_resonance",
        sensor=whose(generator, scene).name,
        frequency=scene.frequency[-1] / strength,
        damping_ratio=log_uniform(generator, 0.02, 0.1),
    )


def misplaced_sensor(generator, scene, strength):
    """At least three tolerances away from the record, towards the farther end."""
    sensor, half = whose(generator, scene), scene.true.length / 2
    offset = np.sign(half - sensor.recorded) * strength * sensor.within
    return effect("misplaced_sensor", sensor=sensor.name, position=sensor.recorded + offset)


SIDES = ("left", "right")
HELD = ("fixed-fixed", "fixed-free")

EFFECTS = {
    "point_mass": Kind(point_mass, (1e-5, 1.0)),
    "ground_spring": Kind(ground_spring, (1e-4, 1e3)),
    "ground_dashpot": Kind(ground_dashpot, (1e-5, 1e2)),
    "tuned_absorber": Kind(tuned_absorber, (1e-5, 1.0)),
    "local_stiffness_loss": Kind(local_stiffness_loss, (1e-3, 0.95)),
    "hysteretic_damping": Kind(hysteretic_damping, (1e-3, 0.3)),
    "viscoelastic_modulus": Kind(viscoelastic_modulus, (1e-4, 1.0)),
    "compliant_support": Kind(compliant_support, (1e-6, 1.0), ends=HELD),
    "axial_preload": Kind(axial_preload, (1e-6, 1.0), ("beam",), ("fixed-fixed",)),
    "shear_and_rotary_inertia": Kind(shear_and_rotary_inertia, (1e-3, 0.15), ("beam",)),
    "cubic_stiffness": Kind(cubic_stiffness, (1e-8, 1e4)),
    "sensor_mass": Kind(sensor_mass, (1e-6, 1.0)),
    "time_delay": Kind(time_delay, (1e-4, 1.0)),
    "gain_error": Kind(gain_error, (1e-3, 0.9)),
    "mount_resonance": Kind(mount_resonance, (1e-3, 1.0)),
    "misplaced_sensor": Kind(misplaced_sensor, (3.0, 30.0)),
}
