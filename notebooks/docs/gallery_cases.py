"""The cases of the gallery, ordered by what is seen in the measurement.

A cantilever with three accelerometers and two hits of a hammer, all up to 1 cm from where they were
recorded, and for each case something that the model lacks.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp

LENGTH, WIDTH, HEIGHT = 0.8, 0.04, 0.01  # [m]
COHERENCE, AVERAGES = 0.998, 20  # an error of 1 % of each value
SENSORS = {"s1": 0.23, "s2": 0.47, "s3": 0.71}  # recorded positions [m]
HITS = {"a1": 0.35, "a2": 0.62}
TRUTH = {
    "structure.modes.youngs_modulus": 7.1e10,
    "structure.damping.ratio": 0.011,
    "sensor.s1.position": 0.2347,
    "sensor.s2.position": 0.4631,
    "sensor.s3.position": 0.7152,
    "actuator.a1.position": 0.3436,
    "actuator.a2.position": 0.6264,
}
LEVELS = [0.05, 1.0]  # [N]


def experiment(force_levels=None):
    """The model as it is drawn."""
    modes = bp.beams.beam(
        12,
        length=LENGTH,
        area=WIDTH * HEIGHT,
        second_moment=WIDTH * HEIGHT**3 / 12,
        youngs_modulus=dist.Uniform(6.7e10, 7.3e10),
        density=2700.0,
        ends="clamped-free",
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.003, 0.03))),
        sensors=[
            bp.Sensor(name, at=bp.positions.Segment(at, within=0.01), directions=(3,))
            for name, at in SENSORS.items()
        ],
        actuators=[
            bp.Actuator(name, at=bp.positions.Segment(at, within=0.01), directions=(3,))
            for name, at in HITS.items()
        ],
        frequency=np.geomspace(8.0, 800.0, 100),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
        force_levels=force_levels,
        sensors_mounted="fixed",
    )


def measured(true, seed):
    """What the true structure would show, with noise; one measurement for each force level."""
    random = np.random.default_rng(seed)
    exact = true.fix(TRUTH).nominal_measurement()
    levels = [noisy(level, random) for level in (exact if isinstance(exact, tuple) else (exact,))]
    return levels if isinstance(exact, tuple) else levels[0]


def noisy(exact, random):
    """One measurement with the noise that its coherence says."""
    parts = random.standard_normal((2, *exact.frf.shape)) / math.sqrt(2)
    deviation = np.abs(exact.frf) * math.sqrt((1 - COHERENCE) / (AVERAGES * COHERENCE))
    return bp.Measurement.from_arrays(
        exact.frf + deviation * (parts[0] + 1j * parts[1]),
        exact.frequency,
        sensors=exact.sensors,
        actuators=exact.actuators,
        quantity=exact.quantity,
        coherence=np.full(exact.frf.shape, COHERENCE),
        averages=AVERAGES,
        force_level=exact.force_level,
    )


class Case(NamedTuple):
    """What is seen, what it means, and what was hidden."""

    symptom: str
    meaning: str
    effect: Callable[[], bp.effects.Effect] | None
    shown: tuple[str, str] = ("s2", "a1")  # sensor and hit in the figure
    force_levels: list[float] | None = None
    hidden: str | None = None  # in words, where the library has no effect of that name


GROUPS = {
    "One channel is wrong": {
        "gain_error": Case(
            "One channel too high at all frequencies",
            "Its peaks and antiresonances are at the right lines and its phase is right; only its level "
            "is not. A sensitivity was typed wrongly, or g was taken for m/s². Where the factor is a "
            "known one, such as 9.81, the ledger says so.",
            lambda: bp.effects.gain_error("s2", 0.25),
        ),
        "reversed_sensor": Case(
            "One channel in opposite phase at all frequencies",
            "The magnitude fits perfectly and the error is twice the response: the sensor was glued on "
            "the other way round. A fit of magnitudes alone would not notice.",
            lambda: bp.effects.reversed_sensor("s2"),
        ),
        "swapped_sensors": Case(
            "Two channels are both wrong, and each would fit the place of the other",
            "Two cables were swapped. Each channel alone looks like a bad model.",
            lambda: bp.effects.swapped_sensors("s1", "s3"),
            ("s1", "a1"),
        ),
        "channel_delay": Case(
            "The phase of one channel falls behind, the more the higher the frequency",
            "The magnitude fits. A phase in proportion to frequency is a delay: another filter, or "
            "channels that are sampled one after the other.",
            lambda: bp.effects.channel_delay("s2", 4e-5),
        ),
        "mount_resonance": Case(
            "One channel too high towards the end of the band",
            "Below, it fits. The sensor is on wax or a magnet that is too soft, and its own resonance "
            "lies above the band.",
            lambda: bp.effects.mount_resonance("s3", 2500.0, 0.05),
            ("s3", "a1"),
        ),
        "misplaced_sensor": Case(
            "One channel has its antiresonances at wrong lines, its peaks at the right ones",
            "Peaks belong to the structure, antiresonances to the place. The sensor sat elsewhere than "
            "recorded, by more than its tolerance.",
            lambda: bp.effects.misplaced_sensor("s2", 0.05),
        ),
        "frequency_drift": Case(
            "The peaks of one run lie beside those of the others",
            "The structure changed between two hits: it became warmer, or a bolt settled. Of two runs it cannot "
            "be told which is the odd one.",
            lambda: bp.effects.frequency_drift("a2", -0.008),
            ("s2", "a2"),
        ),
    },
    "All channels are wrong": {
        "time_delay": Case(
            "The phase of all channels falls behind, the more the higher the frequency",
            "The magnitudes fit, and every accelerometer is late by the same time against the force: the force "
            "channel has another filter.",
            lambda: bp.effects.time_delay(3e-5),
        ),
        "compliant_support": Case(
            "All resonances low, the first one most",
            "The clamp is compliant. High modes bend mainly elsewhere and feel it less. Only lower stiffness "
            "everywhere would lower all of them by the same share.",
            lambda: bp.effects.compliant_support(2e-4, end="left", motion="rotation"),
        ),
        "sensor_mass": Case(
            "All resonances low, the high ones most",
            "What was mounted has a mass: here each accelerometer weighs 12 g on a beam of 860 g.",
            lambda: bp.effects.sensor_mass(0.012),
        ),
        "point_mass": Case(
            "Some resonances low, the others right",
            "A mass lowers the modes that move where it sits, and leaves those that have a node there. "
            "Which ones are low tells the place.",
            lambda: bp.effects.point_mass(0.52, 0.05),
        ),
        "local_stiffness_loss": Case(
            "Some resonances low, those that bend most at one place",
            "A crack or a notch. It lowers other modes than a mass at the same place does, since modes "
            "bend where they do not move.",
            lambda: bp.effects.local_stiffness_loss(0.12, 0.03, 0.5),
        ),
        "ground_spring": Case(
            "The first resonance high, the others right",
            "Something holds the structure: a cable, a stop, a soft contact. A spring is strong against "
            "the first mode and weak against the inertia of the high ones.",
            lambda: bp.effects.ground_spring(0.68, 250.0),
        ),
        "tuned_absorber": Case(
            "A split peak",
            "Two peaks where the model has one, and a notch between them: something with a resonance of "
            "its own hangs on the structure. It may be a loose part, a cable, a panel.",
            lambda: bp.effects.tuned_absorber(0.7, 0.02, 81.0, 0.02),
        ),
    },
    "Peaks have the wrong shape": {
        "exponential_window": Case(
            "Low peaks too round, high ones right",
            "All modes decay faster by the same rate, which is much for a low mode and little for a high "
            "one: an exponential window, whose damping was not taken out.",
            lambda: bp.effects.exponential_window(3.0),
        ),
        "ground_dashpot": Case(
            "Some peaks too round, the others right",
            "Something takes energy at one place: a cable that rubs, a seal, a hand. Modes that do not "
            "move there keep their damping.",
            lambda: bp.effects.ground_dashpot(0.47, 3.0),
        ),
        "cubic_stiffness": Case(
            "Peaks move when the structure is hit harder",
            "It is not linear. With measurements at two force levels a spring that hardens is told from one "
            "that does not.",
            lambda: bp.effects.cubic_stiffness(0.7, 3e9),
            ("s3", "a2"),
            LEVELS,
        ),
    },
    "It is in no list": {
        "dragged_mass": Case(
            "A resonance both low and too round",
            "A mass that something viscous drags along: a half-full tank, a part in grease, a particle damper. "
            "Slow motion takes it along as a mass; fast motion leaves it behind, and then it is a dashpot. No "
            "effect of the library is that: the law itself is read at each place, and named as a network, "
            "`dashpot - mass` for a dashpot and a mass in series.",
            lambda: bp.effects.attached(0.6, bp.effects.Dashpot(12.0) - bp.effects.Mass(0.09)),
            hidden="a dashpot and a mass in series, `Dashpot(12.0) - Mass(0.09)`, at 600 mm",
        ),
        "creeping_clip": Case(
            "A resonance much too round and hardly moved, the others right",
            "A clip that holds the slope of the beam, and creeps: stiff for fast motion, soft for slow. It acts "
            "on the rotation and not on the displacement; which of them is a part of the answer.",
            lambda: bp.effects.attached(
                0.3, bp.effects.Spring(300.0) - bp.effects.Dashpot(1.5), motion="rotation"
            ),
            hidden="a spring and a dashpot in series on the rotation at 300 mm, "
            "`Spring(300.0) - Dashpot(1.5)`",
        ),
        "glued_joint": Case(
            "Resonances low and too round, those most that bend at one place",
            "A joint whose glue is both elastic and viscous. It opens a cut of the beam as a crack does, but takes "
            "energy as well.",
            lambda: bp.effects.inserted(0.25, bp.effects.Spring(2000.0) | bp.effects.Dashpot(1.5)),
            hidden="a spring beside a dashpot in a cut at 250 mm, `Spring(2000.0) | Dashpot(1.5)`",
        ),
        "further_mode": Case(
            "One peak too many, all others right",
            "The structure moves as the model cannot: it twists since it is hit beside its axis, or what it "
            "stands on has a mode of its own. Nothing attached to the model does that. The mode is told with "
            "its frequency, its damping and how much of it each channel sees, whatever its shape.",
            lambda: bp.effects.further_mode(
                np.outer([0.35, -0.6, 0.9], [0.5, 0.8]), frequency=140.0, damping_ratio=0.012
            ),
            ("s3", "a2"),
        ),
    },
    "Nothing is wrong": {
        "nothing_missing": Case(
            "Measured positions, and still differences of some decibels near antiresonances",
            "Sensors up to 1 cm from where they were recorded do this. The positions are unknowns, the "
            "model passes its check, and nothing is claimed to be missing.",
            None,
        ),
    },
}
"""Cases by the name of what was hidden, in groups."""

CASES = {name: case for group in GROUPS.values() for name, case in group.items()}
