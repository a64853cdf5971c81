"""Wrong calls of the API, and how the sentence begins that each gets.

Run as a program it makes all of them, without the checks of types that tests install, and writes
what they said as JSON.
"""

import json
import sys
import warnings

import jax
import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement._shared.ranges import negative_log_uniform

LINES = np.arange(100.0, 700.0, 50.0)
MAP = bp.engines.MAP(starts=2, draws=5)


def bar(modes=5, **changes):
    sizes = {"length": 1.0, "area": 1e-3, "youngs_modulus": 1e9, "density": 9000.0}
    return bp.beams.bar(modes, **(sizes | changes))


def structure(damping=None, **changes):
    law = bp.damping.Modal(dist.Uniform(0.02, 0.06)) if damping is None else damping
    return bp.Structure(bar(**changes), damping=law)


def experiment(**changes):
    arguments = {
        "structure": structure(),
        "sensors": [bp.Sensor("s1", at=0.2)],
        "actuators": [bp.Actuator("a1", at=0.3)],
        "frequency": LINES,
        "observe": bp.observe.Complex("velocity"),
        "noise": bp.noise.Gaussian(1e-5),
    } | changes
    return bp.Experiment(arguments.pop("structure"), **arguments)


def measurement(**changes):
    arguments = {
        "frf": np.full((1, 1, LINES.size), 1 + 1j),
        "frequency": LINES,
        "sensors": ["s1"],
        "actuators": ["a1"],
        "quantity": "mobility",
    } | changes
    return bp.Measurement.from_arrays(arguments.pop("frf"), arguments.pop("frequency"), **arguments)


def sensor_somewhere():
    return experiment(sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.2, within=0.02))])


def time_records(force=None, **changes):
    arguments = {
        "response": np.ones((2, 64)),
        "rate": 64.0,
        "sensors": ["s1"],
        "actuator": "a1",
        "quantity": "acceleration",
        "excitation": bp.time_records.Impacts(),
    } | changes
    force = np.ones((2, 64)) if force is None else force
    return bp.time_records.frf(force, arguments.pop("response"), arguments.pop("rate"), **arguments)


CALLS = {
    "prior swapped": (
        lambda: experiment(structure=structure(bp.damping.Modal(dist.Uniform(0.06, 0.02)))),
        "damping.ratio: Uniform(0.06, 0.02) was given; a prior with a finite",
    ),
    "prior zero width": (
        lambda: experiment(structure=structure(bp.damping.Modal(dist.Uniform(0.06, 0.06)))),
        "damping.ratio: Uniform(0.06, 0.06) was given; a prior with a finite",
    ),
    "prior of minus a prior swapped": (
        lambda: structure() + bp.effects.point_mass(0.4, negative_log_uniform(0.2, 0.1)),
        "mass: -1 exp(Uniform(-1.60944, -2.30259)) was given; a prior with a finite",
    ),
    "prior nan": (
        lambda: experiment(structure=structure(youngs_modulus=dist.Uniform(np.nan, 1e9))),
        "modes.youngs_modulus: Uniform(nan, 1e+09) was given; a prior with a",
    ),
    "prior inf": (
        lambda: experiment(structure=structure(youngs_modulus=dist.Uniform(0.0, np.inf))),
        "modes.youngs_modulus: Uniform(0, inf) was given; a prior with a",
    ),
    "prior neg modulus": (
        lambda: experiment(structure=structure(youngs_modulus=dist.Uniform(-1e9, 1e9))),
        "modes.youngs_modulus=Uniform(-1e+09, 1e+09), from -1e+09 to 1e+09,",
    ),
    "prior modulus normal wide": (
        lambda: experiment(structure=structure(youngs_modulus=dist.Normal(1e9, 1e9))),
        "modes.youngs_modulus=Normal(1e+09, 1e+09), from -3.75e+09 to",
    ),
    "prior neg density": (
        lambda: experiment(structure=structure(density=dist.Uniform(-1.0, 9e3))),
        "modes.density=Uniform(-1, 9000), from -1 to 9e+03, was given; it must be above zero",
    ),
    "prior neg damping": (
        lambda: experiment(structure=structure(bp.damping.Modal(dist.Uniform(-0.06, 0.02)))),
        "damping.Modal: ratio=Uniform was given; no number below zero is",
    ),
    "prior neg noise": (
        lambda: experiment(noise=bp.noise.Gaussian(dist.Uniform(-1.0, 1.0))),
        "noise.sigma=Uniform(-1, 1), from -1 to 1, was given; it must be above zero [",
    ),
    "prior normal noise": (
        lambda: experiment(noise=bp.noise.Gaussian(dist.Normal(0.0, 1.0))),
        "noise.sigma=Normal(0, 1), from -4.75 to 4.75, was given; it must be above zero",
    ),
    "prior position off": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=dist.Uniform(0.9, 1.2))]),
        'Sensor "s1": position Uniform(0.9, 1.2) m lies outside the structure',
    ),
    "prior position all off": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=dist.Uniform(1.1, 1.2))]),
        'Sensor "s1": position Uniform(1.1, 1.2) m lies outside the structure',
    ),
    "effect mass swapped prior": (
        lambda: experiment() + bp.effects.point_mass(0.4, dist.Uniform(1.0, 0.5)),
        "effects.point_mass.mass: Uniform(1, 0.5) was given; a prior with a",
    ),
    "effect place off": (
        lambda: experiment() + bp.effects.point_mass(1.4, 0.1),
        'Effect "point_mass": place 1.4 m lies outside the structure (0 to 1',
    ),
    "effect place text": (
        lambda: experiment() + bp.effects.point_mass("middle", 0.1),
        "at='middle' was given; one finite number is needed, in SI units:",
    ),
    "effect mass nan": (
        lambda: experiment() + bp.effects.point_mass(0.4, np.nan),
        "effects.point_mass.mass=nan was given; a finite number [kg] is",
    ),
    "effect mass text": (
        lambda: experiment() + bp.effects.point_mass(0.4, "heavy"),
        "effects.point_mass.mass='heavy' was given; a number [kg] or a",
    ),
    "effect on nothing": (
        lambda: experiment() + 3,
        "effect=3 was given; an effect is needed, since only effects are",
    ),
    "damping percent": (
        lambda: structure(bp.damping.Modal([4.0])),
        "damping.ratio.1=4 was given; it must be between 0 and 1: a damping",
    ),
    "damping percent prior": (
        lambda: structure(bp.damping.Modal(dist.Uniform(2.0, 8.0))),
        "damping.ratio=Uniform(2, 8), from 2 to 8, was given; it must be between",
    ),
    "damping tuple": (
        lambda: structure(bp.damping.Modal((0.02, 0.08))),
        "damping.Modal((0.02, 0.08)) was given, two numbers, which are the",
    ),
    "damping text": (
        lambda: structure(bp.damping.Modal("5 %")),
        "A damping of '5 %' was given; a finite number or a distribution is",
    ),
    "damping bare number": (
        lambda: bp.Structure(bar(), damping=0.04),
        "damping=0.04 was given; a damping law is needed, since a number alone",
    ),
    "damping bare tuple": (
        lambda: bp.Structure(bar(), damping=(0.02, 0.08)),
        "damping=tuple of 2 was given; a damping law is needed, since a number",
    ),
    "damping empty": (
        lambda: structure(bp.damping.Modal([])),
        "damping.Modal got no ratio; at least one is needed, since the last",
    ),
    "damping nan": (
        lambda: structure(bp.damping.Modal([np.nan])),
        "A damping of nan was given; a finite number or a distribution is",
    ),
    "structural neg": (
        lambda: structure(bp.damping.Structural(-0.1)),
        "damping.Structural: loss_factor=-0.1 was given; no number below zero",
    ),
    "rayleigh neg": (
        lambda: structure(bp.damping.Rayleigh(-1.0, 0.0)),
        "damping.Rayleigh: mass=-1 was given; no number below zero is",
    ),
    "rayleigh swapped": (
        lambda: structure(bp.damping.Rayleigh(1e-5, dist.Uniform(5.0, 20.0))),
        "damping.Rayleigh: a stiffness of 5 s or more was given; less than 1 s",
    ),
    "angles degrees": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, angles=(0.0, 10.0, 0.0))]),
        "sensor.s1.angles.2=10 was given; it must be between -3.142 and 3.142 [rad]",
    ),
    "angles prior degrees": (
        lambda: experiment(
            sensors=[bp.Sensor("s1", at=0.2, angles=(0.0, dist.Uniform(-10.0, 10.0), 0.0))]
        ),
        "sensor.s1.angles.2=Uniform(-10, 10), from -10 to 10, was given; it must be",
    ),
    "angles number": (
        lambda: bp.Sensor("s1", at=0.2, angles=0.1),
        "angles of the Sensor=0.1 was given; three Euler angles [rad] are",
    ),
    "angles nan": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, angles=(0.0, np.nan, 0.0))]),
        "sensor.s1.angles.2=nan was given; a finite number [rad] is needed,",
    ),
    "frequency kHz": (
        lambda: experiment(frequency=LINES / 1000).data(measurement()),
        "12 of the frequencies given were not measured: 0.1 Hz (nearest 100",
    ),
    "frequency rad": (
        lambda: experiment(frequency=LINES * 2 * np.pi).data(measurement()),
        "12 of the frequencies given were not measured: 628.319 Hz (nearest",
    ),
    "frequency twice": (
        lambda: experiment(frequency=[100.0, 100.0]),
        "frequency has the line 100 Hz 2 times; each line is needed once,",
    ),
    "frequency text": (
        lambda: experiment(frequency="100 Hz"),
        "frequency='100 Hz' was given; a list of real numbers [Hz] is needed,",
    ),
    "frequency number": (
        lambda: experiment(frequency=100.0),
        "frequency of shape () was given; a list of lines [Hz], finite and not",
    ),
    "frequency nan": (
        lambda: experiment(frequency=[np.nan]),
        "frequency of shape (1,) was given; a list of lines [Hz], finite and",
    ),
    "frequency none": (
        lambda: experiment(frequency=None),
        "frequency=None was given; a list of real numbers [Hz] is needed,",
    ),
    "frequency complex": (
        lambda: experiment(frequency=LINES + 1j),
        "frequency=an object of ndarray was given; a list of real numbers [Hz]",
    ),
    "noise number": (
        lambda: experiment(noise=0.01),
        "noise=0.01 was given; an output error is needed, since a number does",
    ),
    "noise text": (
        lambda: experiment(noise="coherence"),
        "noise='coherence' was given; an output error is needed, since a",
    ),
    "noise negative": (
        lambda: bp.noise.Gaussian(-0.1),
        "noise.Gaussian(sigma) was given a standard deviation of -0.1; the",
    ),
    "noise zero": (
        lambda: bp.noise.Gaussian(0.0),
        "noise.Gaussian(sigma) was given a standard deviation of 0; the",
    ),
    "noise text sigma": (
        lambda: bp.noise.Gaussian("small"),
        "noise.Gaussian(sigma) was given 'small'; numbers or a distribution",
    ),
    "noise shape": (
        lambda: bp.infer(
            experiment(noise=bp.noise.Gaussian(np.ones(7))), measurement(), engine=MAP
        ),
        "noise.Gaussian(sigma) was given a level of shape (7,), but the",
    ),
    "noise neg array": (
        lambda: bp.noise.Gaussian(np.array([1.0, -1.0])),
        "noise.Gaussian(sigma) was given a standard deviation of -1; the",
    ),
    "noise none arg": (
        lambda: bp.noise.Gaussian(None),
        "noise.Gaussian(sigma) was given None; numbers or a distribution are",
    ),
    "noise factor zero": (
        lambda: bp.noise.FromCoherence(0.0),
        "noise.FromCoherence(factor) was given a factor of 0; the factor must",
    ),
    "noise cov": (
        lambda: bp.noise.Covariance(np.zeros((3, 3))),
        "noise.Covariance(matrix) was given a matrix of shape (3, 3) that is",
    ),
    "noise class": (
        lambda: experiment(noise=bp.noise.Gaussian),
        "noise=the class Gaussian was given; an output error is needed, since",
    ),
    "sensor place text": (
        lambda: bp.Sensor("s1", at="middle"),
        "at='middle' was given; one finite number is needed, in SI units:",
    ),
    "sensor place none": (
        lambda: bp.Sensor("s1", at=None),
        "at=None was given; one finite number is needed, in SI units: at=0.25,",
    ),
    "sensor place nan": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=np.nan)]),
        "at=nan was given; one finite number is needed, in SI units: at=0.25,",
    ),
    "sensor place off": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=1.2)]),
        'Sensor "s1": position 1.2 m lies outside the structure (0 to 1 m).',
    ),
    "sensor place two": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=(0.1, 0.2))]),
        "A position of 2 coordinates was given; one number on a line or three",
    ),
    "sensor place three on a line": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=(0.1, 0.2, 0.3))]),
        'Sensor "s1": position (0.1, 0.2, 0.3) was given, but the structure is',
    ),
    "sensor name empty": (
        lambda: bp.Sensor("", at=0.2),
        "Sensor of the name '' was given; a name without a dot is needed,",
    ),
    "sensor name blank": (
        lambda: experiment(sensors=[bp.Sensor(" ", at=0.2)]),
        "Sensor of the name ' ' was given; a name of at most 100 letters is needed,",
    ),
    "sensor name number": (
        lambda: bp.Sensor(1, at=0.2),
        "Sensor of the name 1 was given; a name without a dot is needed, since",
    ),
    "sensor name dot": (
        lambda: bp.Sensor("a.b", at=0.2),
        "Sensor of the name 'a.b' was given; a name without a dot is needed,",
    ),
    "sensor name like channel": (
        lambda: experiment(sensors=[bp.Sensor("s1+x", at=0.2)]),
        "The name 's1+x' of a transducer was given; its label 's1+x' would be",
    ),
    "sensor direction 4": (
        lambda: bp.Sensor("s1", at=0.2, directions=(4,)),
        'Sensor "s1": directions=(4,) was given; each must be one of +-1, +-2,',
    ),
    "sensor direction number": (
        lambda: bp.Sensor("s1", at=0.2, directions=3),
        "directions of the Sensor=3 was given; a tuple is needed, with a",
    ),
    "sensor direction text": (
        lambda: bp.Sensor("s1", at=0.2, directions=("x",)),
        "Sensor \"s1\": directions=('x',) was given; each must be one of +-1, +-2",
    ),
    "sensor direction wrong axis": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, directions=(3,))]),
        'Sensor "s1": directions=(3,) was given, but the structure moves along',
    ),
    "sensor direction twice": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, directions=(1, 1))]),
        'Sensor "s1": directions=(1, 1) was given; each is needed once, since',
    ),
    "sensor gain neg": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, gain=0.0)]),
        'Sensor "s1": gain=0 was given; a finite number other than 0 is',
    ),
    "sensor gain text": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, gain="1 %")]),
        "sensor.s1.gain='1 %' was given; a number [1] or a distribution is",
    ),
    "segment inf": (
        lambda: bp.positions.Segment(0.2, within=np.inf),
        "Segment(within)=inf was given; one finite number is needed, in SI",
    ),
    "segment neg": (
        lambda: bp.positions.Segment(0.2, within=-0.1),
        "Segment(within=-0.1) was given; a positive tolerance [m] is needed.",
    ),
    "segment text": (
        lambda: bp.positions.Segment(0.2, within="1 cm"),
        "Segment(within)='1 cm' was given; one finite number is needed, in SI",
    ),
    "segment centre text": (
        lambda: bp.positions.Segment("a", within=0.1),
        "Segment(centre)='a' was given; one finite number is needed, in SI",
    ),
    "segment nan": (
        lambda: bp.positions.Segment(np.nan, within=0.1),
        "Segment(centre)=nan was given; one finite number is needed, in SI",
    ),
    "segment off": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=bp.positions.Segment(1.5, within=0.1))]),
        'Sensor "s1": Segment(1.5, within=0.1) m has no point on the structure',
    ),
    "box inf": (
        lambda: bp.positions.Box((0.0, 0.0, 0.0), within=np.inf),
        "Box(within=...) was given inf; three finite numbers along x, y and z",
    ),
    "box neg": (
        lambda: bp.positions.Box((0.0, 0.0, 0.0), within=-1.0),
        "Box(within=...) was given -1.0; three finite numbers along x, y and z",
    ),
    "ball neg": (
        lambda: bp.positions.Ball((0.0, 0.0, 0.0), radius=-1.0),
        "Ball(radius=-1.0) was given; a positive radius [m] is needed. For a",
    ),
    "sensors bare": (
        lambda: experiment(sensors=bp.Sensor("s1", at=0.2)),
        "sensors=an object of Sensor was given; a list of objects of Sensor is",
    ),
    "sensors empty": (
        lambda: experiment(sensors=[]),
        "An experiment needs at least one sensor and one actuator, since an",
    ),
    "sensors text": (
        lambda: experiment(sensors=["s1"]),
        "an entry of sensors='s1' was given; a list of objects of Sensor is",
    ),
    "sensors dict": (
        lambda: experiment(sensors={"s1": 0.2}),
        "sensors=dict of 1 was given; a list of objects of Sensor is needed,",
    ),
    "actuator in sensors": (
        lambda: experiment(sensors=[bp.Actuator("a1", at=0.2)]),
        "an entry of sensors=an object of Actuator was given; a list of",
    ),
    "sensor in actuators": (
        lambda: experiment(actuators=[bp.Sensor("s1", at=0.2)]),
        "an entry of actuators=an object of Sensor was given; a list of",
    ),
    "two same name": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2)] * 2),
        'Two transducers are called "s1". Each needs a name of its own, since',
    ),
    "structure missing": (
        lambda: experiment(structure=bar()),
        "structure=an object of UniformBar was given; a structure is needed,",
    ),
    "structure none": (
        lambda: experiment(structure=None),
        "structure=None was given; a structure is needed, which has modes and",
    ),
    "observe text": (
        lambda: experiment(observe="velocity"),
        "observe='velocity' was given; an observation is needed, since it says",
    ),
    "observe class": (
        lambda: experiment(observe=bp.observe.Complex),
        "observe=the class Complex was given; an observation is needed, since",
    ),
    "observe wrong quantity": (
        lambda: bp.observe.Complex("speed"),
        "quantity='speed' was given; an FRF of displacement, velocity or",
    ),
    "levels neg": (
        lambda: experiment(force_levels=[-1.0]),
        "force_levels=(-1.0,) was given; force amplitudes [N] are needed,",
    ),
    "levels number": (
        lambda: experiment(force_levels=1.0),
        "force_levels=1.0 was given; a list of force amplitudes [N] is needed,",
    ),
    "mounted": (
        lambda: experiment(sensors_mounted="glued"),
        "sensors_mounted='glued' was given; it must be 'roving', where each",
    ),
    "measurement path": (
        lambda: bp.infer(experiment(), "measured.uff", engine=MAP),
        "measurement='measured.uff' was given; measured FRFs are needed, with",
    ),
    "measurement array": (
        lambda: bp.infer(experiment(), np.ones((1, 1, LINES.size)), engine=MAP),
        "measurement=an object of ndarray was given; measured FRFs are needed,",
    ),
    "measurement none": (
        lambda: bp.infer(experiment(), None, engine=MAP),
        "measurement=None was given; measured FRFs are needed, with their",
    ),
    "measurement experiment swapped": (
        lambda: bp.infer(measurement(), experiment(), engine=MAP),
        "experiment=an object of Measurement was given; an experiment is",
    ),
    "measurement swapped names": (
        lambda: bp.infer(experiment(), measurement(sensors=["a1"], actuators=["s1"]), engine=MAP),
        "The sensor channel s1+x was requested, but only a1 were measured;",
    ),
    "explain path": (
        lambda: bp.explain(experiment(), "x.uff"),
        "measurement='x.uff' was given; measured FRFs are needed, with their",
    ),
    "improve none": (
        lambda: bp.improve(experiment(), None),
        "measurement=None was given; measured FRFs are needed, with their",
    ),
    "explain candidates text": (
        lambda: bp.explain(experiment(), measurement(), candidates="point_mass"),
        "candidates='point_mass' was given; a library of effects is needed,",
    ),
    "check experiment": (
        lambda: bp.check(experiment()),
        "posterior=an object of Experiment was given; the result of an",
    ),
    "check none": (
        lambda: bp.check(None),
        "posterior=None was given; the result of an inference is needed, since",
    ),
    "engine unknown": (
        lambda: bp.infer(experiment(), measurement(), engine="mcmc"),
        "'mcmc' was given, but there is none of that name among the engines:",
    ),
    "engine number": (
        lambda: bp.infer(experiment(), measurement(), engine=3),
        "engine=3 was given; an engine or its name is needed, since it",
    ),
    "engine class": (
        lambda: bp.infer(experiment(), measurement(), engine=bp.engines.MAP),
        "engine=the class MAP was given; an engine or its name is needed,",
    ),
    "marginal unknown": (
        lambda: bp.infer(experiment(), measurement(), engine=MAP, marginal="none"),
        "'none' was given, but there is none of that name among the marginals:",
    ),
    "key text": (
        lambda: bp.infer(experiment(), measurement(), engine=MAP, key="a"),
        "key='a' was given; an integer or one JAX key is needed, from which",
    ),
    "key float": (
        lambda: bp.infer(experiment(), measurement(), engine=MAP, key=1.5),
        "key=1.5 was given; an integer or one JAX key is needed, from which",
    ),
    "nuts chains": (
        lambda: bp.engines.NUTS(chains=0),
        "chains=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "nuts draws": (
        lambda: bp.engines.NUTS(draws=0),
        "draws=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "smc particles": (
        lambda: bp.engines.SMC(particles=0),
        "particles=0 was given; a whole number of at least 1 is needed, since",
    ),
    "map starts": (
        lambda: bp.engines.MAP(starts=0),
        "starts=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "map draws": (
        lambda: bp.engines.MAP(draws=-1),
        "draws=-1 was given; a whole number of at least 1 is needed, since it",
    ),
    "importance": (
        lambda: bp.engines.Importance(draws=0),
        "draws=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "grid nodes": (
        lambda: bp.engines.Grid(nodes=0),
        "nodes=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "quadrature nodes": (
        lambda: bp.marginals.Quadrature(nodes=0),
        "nodes=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "kde draws": (
        lambda: bp.marginals.KDE(placement_draws=0),
        "placement_draws=0 was given; a whole number of at least 1 is needed,",
    ),
    "bar n 0": (lambda: bar(modes=0), "modes=0 was given; at least one mode is needed: modes=15."),
    "bar n neg": (
        lambda: bar(modes=-3),
        "modes=-3 was given; at least one mode is needed: modes=15.",
    ),
    "bar n float": (
        lambda: bar(modes=2.5),
        "modes=2.5 was given; a whole number is needed, since it counts: modes=8",
    ),
    "bar n text": (
        lambda: bar(modes="5"),
        "modes='5' was given; a whole number is needed, since it counts: modes=8",
    ),
    "bar length 0": (
        lambda: bar(length=0.0),
        "length=0.0 was given; it must be positive, since it divides or scales",
    ),
    "bar length neg": (
        lambda: bar(length=-1.0),
        "length=-1.0 was given; it must be positive, since it divides or",
    ),
    "bar length text": (
        lambda: bar(length="1 m"),
        "length='1 m' was given; one finite number or a distribution is needed, in SI",
    ),
    "bar length nan": (
        lambda: bar(length=np.nan),
        "length=nan was given; one finite number or a distribution is needed, in SI",
    ),
    "bar area 0": (
        lambda: bar(area=0.0),
        "area=0.0 was given; it must be positive, since it divides or scales",
    ),
    "bar E neg": (
        lambda: bar(youngs_modulus=-1e9),
        "youngs_modulus=-1000000000.0 was given; it must be positive, since it",
    ),
    "bar E text": (
        lambda: bar(youngs_modulus="steel"),
        "youngs_modulus='steel' was given; one finite number or a distribution is",
    ),
    "bar rho 0": (
        lambda: bar(density=0.0),
        "density=0.0 was given; it must be positive, since it divides or",
    ),
    "bar ends": (
        lambda: bar(ends="glued"),
        "ends='glued' is not understood. Give the left and the right end, each",
    ),
    "bar direction": (
        lambda: bar(direction=5),
        "direction=5 was given; the motion is recorded along 1, 2 or 3 for x,",
    ),
    "bar E array": (
        lambda: bar(youngs_modulus=np.ones(3) * 1e9),
        "youngs_modulus=an object of ndarray was given; one finite number is",
    ),
    "bar E none": (
        lambda: bar(youngs_modulus=None),
        "youngs_modulus=None was given; one finite number or a distribution is",
    ),
    "bar E inf": (
        lambda: bar(youngs_modulus=np.inf),
        "youngs_modulus=inf was given; one finite number or a distribution is",
    ),
    "m frf shape": (
        lambda: measurement(frf=np.ones((2, 1, LINES.size))),
        "frf has shape (2, 1, 12); (sensor, actuator, frequency) = (1, 1, 12)",
    ),
    "m frf text": (
        lambda: measurement(frf="a"),
        "frf='a' was given, of <U1; an array of complex or real numbers is",
    ),
    "m frf inf": (
        lambda: measurement(frf=np.full((1, 1, LINES.size), np.inf)),
        "frf is inf+0j for s1 / a1 at 100 Hz; a measured pair needs a finite",
    ),
    "m freq fall": (
        lambda: measurement(frequency=LINES[::-1]),
        "frequency goes from 650 Hz to 600 Hz; it must increase from line to",
    ),
    "m freq text": (
        lambda: measurement(frequency="x"),
        "frequency='x' was given, of <U1; an array of real numbers is needed,",
    ),
    "m quantity": (
        lambda: measurement(quantity="speed"),
        "quantity='speed' was given; an FRF of displacement, velocity or",
    ),
    "m coh 2": (
        lambda: measurement(coherence=np.full((1, 1, LINES.size), 2.0)),
        "coherence is 2 for s1 / a1 at 100 Hz; it must lie between 0 and 1,",
    ),
    "m coh percent": (
        lambda: measurement(coherence=np.full((1, 1, LINES.size), 95.0)),
        "coherence is 95 for s1 / a1 at 100 Hz; it must lie between 0 and 1,",
    ),
    "m averages 0": (
        lambda: measurement(averages=0),
        "averages=0 was given; a whole number of at least 1 is needed, since",
    ),
    "m averages 1.5": (
        lambda: measurement(averages=1.5),
        "averages=1.5 was given; a whole number of at least 1 is needed, since",
    ),
    "m averages text": (
        lambda: measurement(averages="8"),
        "averages='8' was given; one finite number is needed, in SI units:",
    ),
    "m force neg": (
        lambda: measurement(force_level=-1.0),
        "force_level=-1.0 was given; a positive amplitude [N] is needed, since",
    ),
    "m force text": (
        lambda: measurement(force_level="1 N"),
        "force_level='1 N' was given; one finite number is needed, in SI",
    ),
    "m positions": (
        lambda: measurement(positions={"s1": (1, 2)}),
        "The position of 's1' was given as (1, 2); three finite coordinates",
    ),
    "m positions text": (
        lambda: measurement(positions={"s1": "a"}),
        "The position of 's1' was given as a; three finite coordinates [m] are",
    ),
    "m sensors twice": (
        lambda: measurement(frf=np.ones((2, 1, LINES.size)), sensors=["s1", "s1"]),
        "The sensor channel s1 was given twice; each may stand once only,",
    ),
    "m sensors number": (
        lambda: measurement(sensors=[1]),
        "channel=1 was given; the label of a channel is needed, since channels",
    ),
    "m sensors empty": (
        lambda: measurement(sensors=[]),
        "frf has shape (1, 1, 12); (sensor, actuator, frequency) = (0, 1, 12)",
    ),
    "m band swapped": (
        lambda: measurement().band(300.0, 200.0),
        "A band from 300 to 200 Hz was given; its limits must rise, since no",
    ),
    "m band text": (
        lambda: measurement().band("a", "b"),
        "low='a' was given; one finite number is needed, in SI units:",
    ),
    "m lines": (
        lambda: measurement().lines([123.0]),
        "1 of the frequencies given were not measured: 123 Hz (nearest 100",
    ),
    "m lines text": (
        lambda: measurement().lines("a"),
        "frequency='a' was given, of <U1; an array of real numbers is needed,",
    ),
    "m channels": (
        lambda: measurement().channels(["s9"], ["a1"]),
        "The sensor channel s9 was requested, but only s1 were measured; name",
    ),
    "m converted": (
        lambda: measurement().converted("speed"),
        "quantity='speed' was given; an FRF of displacement, velocity or",
    ),
    "m thinned text": (
        lambda: measurement().thinned("a"),
        "measurement.thinned was given most='a'; a number above 0 is needed,",
    ),
    "m together path": (
        lambda: measurement().thinned(3, together="abc"),
        "together holds 'a'; measurements on the same lines are needed, since",
    ),
    "fix unknown": (
        lambda: experiment().fix({"structure.damping.rato": 0.04}),
        "There is no unknown 'structure.damping.rato' to give a value to. The",
    ),
    "fix text": (
        lambda: experiment().fix({"structure.damping.ratio": "a"}).predict(),
        "structure.damping.ratio='a' was given; a number is needed, since it",
    ),
    "fix list": (
        lambda: experiment().fix([0.04]),
        "values=list of 1 was given; values by the names of unknowns are",
    ),
    "without": (
        lambda: experiment().without("mass"),
        'There is no effect "mass" to leave out. The experiment has none.',
    ),
    "simulate none": (
        lambda: bp.simulate(None),
        "experiment=None was given; an experiment is needed, with structure,",
    ),
    "simulate draws 0": (
        lambda: bp.simulate(experiment(), draws=0),
        "draws=0 was given; a whole number of at least 1 is needed, since it",
    ),
    "simulate text": (
        lambda: bp.simulate(experiment(), draws="a"),
        "draws='a' was given; a whole number is needed, since it counts: draws=8",
    ),
    "place none": (
        lambda: bp.place(None, {}),
        "experiment=None was given; an experiment is needed, with structure,",
    ),
    "place exp": (
        lambda: bp.place(experiment(), "all"),
        "places='all' was given; positions by the name of the transducer are",
    ),
    "map text": (
        lambda: bp.information_map(experiment(), 3),
        "places=3 was given; positions by the name of the transducer are",
    ),
    "report none": (
        lambda: bp.report(None),
        "results=None was given; results by the names of their methods or models are",
    ),
    "report list": (
        lambda: bp.report([1]),
        "results=list of 1 was given; results by the names of their methods",
    ),
    "compare none": (
        lambda: bp.compare(None),
        "results=None was given; results by the names of their methods or models are",
    ),
    "read none": (
        lambda: bp.io.read_measurement(None),
        "path=None was given; the path of a file or folder is needed, since it",
    ),
    "read number": (
        lambda: bp.io.read_measurement(3),
        "path=3 was given; the path of a file or folder is needed, since it is",
    ),
    "read missing": (
        lambda: bp.io.read_measurement("no.uff"),
        "no file no.uff; a file with a measurement is needed. Check the folder:",
    ),
    "read any number": (
        lambda: bp.io.read(3),
        "path=3 was given; the path of a file or folder is needed, since it is",
    ),
    "read any missing": (
        lambda: bp.io.read("no.mat"),
        "There is no file no.mat; a file of measured FRFs is needed",
    ),
    "read mapping number": (
        lambda: bp.io.read("models/bar.uff", 3),
        "mapping=3 was given; the path of a TOML file or a dictionary is",
    ),
    "read mapping misspelt": (
        lambda: bp.io.read("models/bar.uff", {"averges": 4}),
        'the field averges is not known; the nearest known one is "averages"',
    ),
    "read mapping averages": (
        lambda: bp.io.read("models/bar.uff", {"averages": 0.5}),
        "mapping: averages is 0.5; a whole number of at least 1 is needed",
    ),
    "read mapping superfluous": (
        lambda: bp.io.read("models/bar.uff", {"sensors": ["s1"]}),
        "mapping has the field sensors, and models/bar.uff is a universal file",
    ),
    "abaqus missing": (
        lambda: bp.io.abaqus.read_matrices("no.mtx", "no.mtx"),
        "There is no file no.mtx; a matrix of Abaqus is needed",
    ),
    "abaqus number": (
        lambda: bp.io.abaqus.read_matrices(3, "no.mtx"),
        "path=3 was given; the path of a file or folder is needed",
    ),
    "uff names": (
        lambda: bp.io.uff.read("models/bar.uff", names=["s1"]),
        "names=list of 1 was given; a dictionary, each name with a text, is needed",
    ),
    "case none": (
        lambda: bp.io.case.read(None),
        "path=None was given; the path of a file or folder is needed, since it",
    ),
    "netcdf write": (
        lambda: bp.io.netcdf.write(3, "result.nc"),
        "result=3 was given; a tree of results is needed, as bp.infer and",
    ),
    "report table": (
        lambda: bp.plots.report.Report().add_table([[1]]),
        "table=list of 1 was given; a data frame is needed, since its columns become those of",
    ),
    "report figure": (
        lambda: bp.plots.report.Report().add_figure(3),
        "figure=3 was given; a figure of matplotlib or the text of an SVG file is needed, since",
    ),
    "report text": (
        lambda: bp.plots.report.Report().add_text(3),
        "add_text was given 3; a text or a list of sentences is needed, since it is shown as",
    ),
    "improve one state": (
        lambda: bp.improve(experiment(), {"new": measurement()}),
        "1 states by label were given; at least two are needed and no baseline, since the first",
    ),
    "improve states and baseline": (
        lambda: bp.improve(
            experiment(), {"new": measurement(), "old": measurement()}, baseline=measurement()
        ),
        "2 states by label were given and a baseline as well; at least two are needed and no",
    ),
    "improve a state that is none": (
        lambda: bp.improve(experiment(), {"new": measurement(), "old": None}),
        "measurement",
    ),
    "explain states": (
        lambda: bp.explain(experiment(), {"new": measurement(), "old": measurement()}),
        "measurement",
    ),
    "frf unknown": (
        lambda: experiment().frf(),
        "Still unknown: structure.damping.ratio; the response of an experiment needs a number in",
    ),
    "predict unknown": (
        lambda: sensor_somewhere().predict(),
        "Still unknown: structure.damping.ratio, sensor.s1.position; the response of an experiment",
    ),
    "receptance unknown": (
        lambda: experiment(model_error=bp.model_error.Embedded()).receptance(),
        "distribution, since each of its values gives another response. Give values, "
        'experiment.fix({"structure.damping.ratio": ...}).frf()',
    ),
    "frf unknown compiled": (
        lambda: jax.jit(lambda: experiment().frf())(),
        "Still unknown: structure.damping.ratio; the response of an experiment needs a number in",
    ),
    "frf unknown by level": (
        lambda: experiment(force_levels=[1.0, 2.0]).frf(),
        "Still unknown: structure.damping.ratio; the response of an experiment needs a number in",
    ),
    "noise scale text": (
        lambda: bp.noise.FromVariance("small"),
        "noise.FromVariance(factor) was given 'small'; numbers or a distribution are",
    ),
    "records of text": (
        lambda: time_records("force"),
        "The force was given as 'force' of 0 axes; the samples of one record, or a",
    ),
    "records unexcited": (
        lambda: time_records(excitation="hammer"),
        "excitation='hammer' was given; how the structure was excited is needed, since",
    ),
    "records rate text": (
        lambda: time_records(rate="4096"),
        "rate='4096' was given; one finite number is needed, in SI units: rate=4096.0.",
    ),
    "records without names": (
        lambda: time_records(sensors=None),
        "The responses were given without names; a sensor label is needed for each,",
    ),
    "records estimator": (
        lambda: time_records(estimator=1),
        "estimator=1 was given; one of H1, H2, Hv is needed: estimator='H1' where",
    ),
    "records ranges": (
        lambda: time_records(ranges=10.0),
        "ranges=10.0 was given; the greatest value by channel is needed, since each",
    ),
    "impacts duration": (
        lambda: bp.time_records.Impacts(duration="long"),
        "duration='long' was given; one finite number is needed, in SI units:",
    ),
    "channels without units": (
        lambda: bp.time_records.read(__file__, {"hammer": "F"}),
        "channels['hammer']='F' was given; a Signal for each label is needed, since",
    ),
    "signal without unit": (
        lambda: bp.time_records.Signal("F", None),
        "unit=None was given; a unit as text is needed, since none is guessed:",
    ),
    "recording none": (
        lambda: bp.time_records.frf_of([measurement()], "a1", excitation=bp.time_records.Impacts()),
        "recordings=an object of Measurement was given; one recording or several are",
    ),
    "merged none": (
        lambda: bp.time_records.merged([experiment()]),
        "measurements=an object of Experiment was given; measurements on the same",
    ),
    "prior of several": (
        lambda: structure(youngs_modulus=dist.Uniform(np.array([1e9, 2e9]), 3e9)),
        "youngs_modulus=Uniform([1e+09, 2e+09], 3e+09) of shape (2,) was given; one number or a",
    ),
    "damping of more modes": (
        lambda: experiment(structure=structure(bp.damping.Modal([0.02] * 7))).nominal_measurement(),
        "damping.Modal was given 7 ratios, and the structure has 5 elastic modes; at most one",
    ),
    "damping of lists": (
        lambda: structure(bp.damping.Modal([[0.02, 0.03]])),
        "A damping of list of 2 was given; a finite number or a distribution is needed",
    ),
    "damping by mode": (
        lambda: structure(bp.damping.Modal({1: 0.02})),
        "A damping of dict of 1 was given; a finite number or a distribution is needed",
    ),
    "damping of a mode none": (
        lambda: structure(bp.damping.Modal([0.02, None])),
        "A damping of None was given; a finite number or a distribution is needed",
    ),
    "structural percent": (
        lambda: structure(bp.damping.Structural(2.0)),
        "damping.loss_factor=2 was given; it must be between 0 and 1: a loss factor is a share",
    ),
    "structural prior percent": (
        lambda: structure(bp.damping.Structural(dist.Uniform(1.0, 3.0))),
        "damping.loss_factor=Uniform(1, 3), from 1 to 3, was given; it must be between 0 and 1:",
    ),
    "sensor direction bool": (
        lambda: bp.Sensor("s1", at=0.2, directions=(True,)),
        'Sensor "s1": directions=(True,) was given; each must be one of +-1, +-2, +-3',
    ),
    "sensor angles bool": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, angles=(True, 0.0, 0.0))]),
        "sensor.s1.angles.1=True was given; a number [rad] or a distribution is needed",
    ),
    "sensor gain list": (
        lambda: bp.Sensor("s1", at=0.2, gain=[1.0]),
        "gain=list of 1 was given; one number or a distribution of one number is needed",
    ),
    "sensor gain array": (
        lambda: bp.Sensor("s1", at=0.2, gain=np.array([1.0, 2.0])),
        "gain=an object of ndarray of shape (2,) was given; one number or a distribution of one",
    ),
    "sensor delay list": (
        lambda: bp.Sensor("s1", at=0.2, delay=[1e-5]),
        "delay=list of 1 was given; one number or a distribution of one number is needed",
    ),
    "sensor delay ms": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=0.2, delay=5.0)]),
        "sensor.s1.delay=5 was given; it must be between -1 and 1 [s]: a delay is in seconds",
    ),
    "sensor recorded mm": (
        lambda: experiment(sensors=[bp.Sensor("s1", at=dist.Normal(0.2, 0.01), recorded=200.0)]),
        'Sensor "s1": recorded position 200 m lies outside the structure (0 to 1 m)',
    ),
    "sensor name slash": (
        lambda: bp.Sensor("rib 1/2", at=0.2),
        "Sensor of the name 'rib 1/2' was given; a name without a slash is needed, since slashes",
    ),
    "effect name slash": (
        lambda: experiment() + bp.effects.point_mass(0.4, 0.1, name="a/b"),
        "An effect of the name 'a/b' was given; a name without a slash is needed, since slashes",
    ),
    "levels bool": (
        lambda: experiment(force_levels=[True]),
        "force_levels=list of 1 was given; a list, each entry of it one finite number, is needed",
    ),
    "noise relative percent": (
        lambda: experiment(noise=bp.noise.Relative(5.0)),
        "noise.ratio=5 was given; it must be between 0 and 1: a ratio of noise is a share of the",
    ),
    "noise relative prior percent": (
        lambda: experiment(noise=bp.noise.Relative(dist.LogUniform(1.0, 20.0))),
        "noise.ratio=LogUniform(1, 20), from 1 to 20, was given; it must be between 0 and 1:",
    ),
    "noise covariance of other lines": (
        lambda: bp.infer(
            experiment(noise=bp.noise.Covariance(np.eye(3))), measurement(), engine=MAP
        ),
        "noise.Covariance(matrix) was given a matrix of shape (3, 3), but the experiment has 12",
    ),
    "model error percent": (
        lambda: bp.model_error.Embedded(frequency=2.0),
        "model_error.Embedded(frequency=2.0) was given; a number up to 1 is needed, since it is a",
    ),
    "fix percent": (
        lambda: experiment().fix({"structure.damping.ratio": 4.0}),
        "structure.damping.ratio=4 was given; it must be between 0 and 1: a damping ratio is a",
    ),
    "fix prior percent": (
        lambda: experiment().fix({"structure.damping.ratio": dist.Uniform(2.0, 4.0)}),
        "structure.damping.ratio=Uniform(2, 4), from 2 to 4, was given; it must be between 0",
    ),
    "fix nan": (
        lambda: experiment().fix({"structure.damping.ratio": np.nan}),
        "structure.damping.ratio=nan was given; a finite number [1] is needed",
    ),
    "fix bool": (
        lambda: experiment().fix({"structure.damping.ratio": True}),
        "structure.damping.ratio=True was given; a number [1] or a distribution is needed",
    ),
    "fix several": (
        lambda: experiment().fix({"structure.damping.ratio": [0.02, 0.03, 0.04]}),
        "structure.damping.ratio=list of 3 of shape (3,) was given; the shape () of its prior is",
    ),
    "fix position off": (
        lambda: sensor_somewhere().fix({"sensor.s1.position": 4.0}),
        'Sensor "s1": position 4 m lies outside the structure (0 to 1 m)',
    ),
    "without a list": (
        lambda: experiment().without(["point_mass"]),
        "There is no effect \"['point_mass']\" to leave out. The experiment has none",
    ),
    "unknowns of a name": (
        lambda: experiment().unknowns_of("point_mass"),
        "effect='point_mass' was given; an object of Effect is needed",
    ),
    "m thinned together bare": (
        lambda: measurement().thinned(3, together=measurement()),
        "together=an object of Measurement was given; a list of measurements is needed",
    ),
    "m resonances together bare": (
        lambda: measurement().around_resonances(together=measurement()),
        "together=an object of Measurement was given; a list of measurements is needed",
    ),
    "key too long": (
        lambda: bp.infer(experiment(), measurement(), engine=MAP, key=2**80),
        "key=1208925819614629174706176 was given; an integer of 64 bits is needed",
    ),
    "improve a label empty": (
        lambda: bp.improve(experiment(), {"": measurement(), "new": measurement()}),
        "A state of the label '' was given; a name of at most 100 letters is needed",
    ),
    "improve a label of control characters": (
        lambda: bp.improve(experiment(), {"\x1b[2J": measurement(), "new": measurement()}),
        "A state of the label '\\x1b[2J' was given; a name of at most 100 letters is needed",
    ),
    "improve a label number": (
        lambda: bp.improve(experiment(), {1: measurement(), 2: measurement()}),
        "A state of the label=1 was given; a name is needed, since it stands in tables and files",
    ),
    "map of lists": (
        lambda: bp.information_map(sensor_somewhere(), {"s1": [[0.3, 0.4]]}),
        "A place to try of 2 coordinates was given; one number on a line or three along x, y",
    ),
    "map nominal percent": (
        lambda: bp.information_map(
            sensor_somewhere(), {"s1": [0.3]}, nominal={"structure.damping.ratio": 4.0}
        ),
        "A nominal value of 4 was given for structure.damping.ratio, outside of its prior Uniform",
    ),
    "place forbidden mm": (
        lambda: bp.place(sensor_somewhere(), {"s1": [0.3, 0.4]}, forbidden=[(300.0, 400.0)]),
        "The forbidden region 300.0 to 400.0 m was given, which lies outside the structure (0 to",
    ),
    "effect mass list": (
        lambda: bp.effects.point_mass(0.4, [0.1]),
        "mass=list of 1 was given; one number or a distribution of one number is needed",
    ),
    "effect mass for each line": (
        lambda: bp.effects.point_mass(0.4, np.ones(LINES.size)),
        "mass=an object of ndarray of shape (12,) was given; one number or a distribution of one",
    ),
    "effect mass prior of several": (
        lambda: bp.effects.point_mass(0.4, dist.Uniform(np.zeros(2), 1.0)),
        "mass=Uniform(0, 1) of shape (2,) was given; one number or a distribution of one number",
    ),
    "effect mass bool": (
        lambda: experiment() + bp.effects.point_mass(0.4, True),
        "effects.point_mass.mass=True was given; a number [kg] or a distribution is needed",
    ),
    "effect share of several": (
        lambda: bp.effects.reversed_sensor("s1", share=np.ones(3)),
        "share=an object of ndarray of shape (3,) was given; one number or a distribution of one",
    ),
    "effect flexibility of another shape": (
        lambda: experiment() + bp.effects.residual_modes(np.full(3, 1e-6)),
        'Effect "residual_modes": flexibility of shape (3,) was given; one number or the shape',
    ),
    "effect absorber percent": (
        lambda: experiment() + bp.effects.tuned_absorber(0.4, 0.1, 200.0, 5.0),
        "effects.tuned_absorber.damping_ratio=5 was given; it must be between 0 and 1: a damping",
    ),
    "effect mount percent": (
        lambda: experiment() + bp.effects.mount_resonance("s1", 900.0, 5.0),
        "instrument_effects.mount_resonance.damping_ratio=5 was given; it must be between 0 and 1",
    ),
    "effect loss percent": (
        lambda: experiment() + bp.effects.local_stiffness_loss(0.4, 0.1, 20.0),
        "effects.local_stiffness_loss.loss=20 was given; no more than all is lost, a share",
    ),
    "effect loss prior percent": (
        lambda: experiment() + bp.effects.local_stiffness_loss(0.4, 0.1, dist.Uniform(0, 90)),
        "effects.local_stiffness_loss.loss=Uniform(0, 90), from 0 to 90, was given; no more than",
    ),
    "effect extent mm": (
        lambda: experiment() + bp.effects.local_stiffness_loss(0.4, 100.0, 0.2),
        'Effect "local_stiffness_loss": an extent of 100 m was given, more than the length of',
    ),
    "effect hysteretic percent": (
        lambda: experiment() + bp.effects.hysteretic_damping(2.0),
        "effects.hysteretic_damping.loss_factor=2 was given; it must be between -1 and 1: a loss",
    ),
    "effect delay ms": (
        lambda: experiment() + bp.effects.time_delay(5.0),
        "instrument_effects.time_delay.delay=5 was given; it must be between -1 and 1 [s]: a",
    ),
    "effect window negative": (
        lambda: experiment() + bp.effects.exponential_window(-1.0),
        "instrument_effects.exponential_window.rate=-1 was given; it must not be negative [1/s]",
    ),
    "effect drift percent": (
        lambda: experiment() + bp.effects.frequency_drift("s1", 5.0),
        "instrument_effects.frequency_drift.drift=5 was given; it must be between -0.9 and 1: a",
    ),
    "effect rate percent": (
        lambda: experiment() + bp.effects.frequency_scale(5.0),
        "instrument_effects.frequency_scale.rate_error=5 was given; it must be between -0.9 and 1",
    ),
    "effect phase degrees": (
        lambda: experiment() + bp.effects.phase_drift("s1", 5.0, 100.0),
        "instrument_effects.phase_drift.phase=5 was given; it must be between -3.142 and 3.142",
    ),
    "effect filter of another order": (
        lambda: bp.effects.low_pass("s1", 900.0, 4),
        'Effect "low_pass": order=4 was given; 1 or 2 is needed, since filters of these orders',
    ),
    "effect filter of a channel of all": (
        lambda: experiment() + bp.effects.low_pass(None, 900.0, direction=1),
        'Effect "low_pass": the direction 1 was given without a sensor; none is needed, since',
    ),
    "effect cross axis of one": (
        lambda: experiment() + bp.effects.cross_axis("s1", 0.03),
        'Effect "cross_axis": sensor "s1" was given, but it has one channel; at least two are',
    ),
    "effect hum of force": (
        lambda: bp.effects.mains_hum("s1", 0.1, quantity="force"),
        "Effect \"mains_hum\": quantity='force' was given; displacement, velocity or acceleration",
    ),
    "effect beyond no prior": (
        lambda: experiment() + bp.effects.beyond_prior("structure.modes.mass", 2.0, end=1.0),
        "effects.beyond_prior.value stands for 'structure.modes.mass'; the name of a number or",
    ),
    "effect beyond what can be": (
        lambda: experiment() + bp.effects.beyond_prior("structure.damping.ratio", 7.0, end=0.06),
        "damping.ratio=7 was given; it must be between 0 and 1: a damping ratio is a share",
    ),
    "effect shift mm": (
        lambda: experiment() + bp.effects.misplaced_sensor("s1", 20.0),
        'Effect "misplaced_sensor": a shift of 20 m was given, farther than the structure (1 m)',
    ),
    "effect shift list": (
        lambda: bp.effects.misplaced_sensor("s1", [0.1]),
        "shift=list of 1 was given; one number or a distribution of one number is needed",
    ),
    "effect swapped with itself": (
        lambda: experiment() + bp.effects.swapped_sensors("s1", "s1"),
        'Effect "swapped_sensors": sensor "s1" was given twice; two sensors are needed',
    ),
    "no density": (
        lambda: bp.beams.bar(5, length=1.0, area=1e-3, youngs_modulus=1e9),
        "missing a required argument: 'density'; the arguments of bar(modes, length, area,",
    ),
    "ends of two words": (
        lambda: bar(ends=("fixed", "free")),
        "ends=tuple of 2 was given; the two ends as one word are needed, joined by a hyphen",
    ),
}
"""What is called wrongly, and how the sentence begins that it gets."""


def answer(name):
    """Kind and words of what a call raises; both empty where it passes."""
    try:
        CALLS[name][0]()
    except Exception as error:  # noqa: BLE001, what is raised is what is asked
        ours = isinstance(error, InputError | FileNotFoundError)
        return ("ours" if ours else type(error).__name__), " ".join(str(error).split())
    return "", ""


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    json.dump({name: answer(name) for name in CALLS}, sys.stdout)
