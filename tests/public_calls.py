"""A right call of every public callable, and each argument of it wrong in many ways.

Run as a program it makes all wrong calls, without the checks of types that tests install, and
writes what they said as JSON.
"""

import contextlib
import dataclasses
import functools
import importlib.util
import inspect
import io
import json
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import jax
import matplotlib as mpl
import numpy as np
import numpyro.distributions as dist
import pandas as pd
import scipy.sparse

import bayes_placement as bp
from bayes_placement._shared.dimensions import Parameter
from bayes_placement._shared.errors import PackageError
from tests.plots.test_modes import fit as modes_beside_a_model
from tests.wrong_calls import LINES, MAP, bar, experiment, measurement, structure

NAN, INF = float("nan"), float("inf")

# ---------------------------------------------------------------------- kinds of arguments

WRONG = {
    "number": {
        "text": "heavy",
        "nothing": None,
        "nan": NAN,
        "infinite": INF,
        "complex": 1j,
        "three": np.ones(3),
        "class": float,
        "object": object(),
    },
    "count": {
        "text": "3",
        "nothing": None,
        "nan": NAN,
        "zero": 0,
        "negative": -2,
        "half": 2.5,
        "list": [2],
    },
    "name": {"empty": "", "number": 3, "nothing": None, "dot": "a.b", "list": ["s1"]},
    "word": {"unknown": "nonsense", "empty": "", "number": 3, "nothing": None, "list": ["x"]},
    "thing": {"number": 3, "text": "thing", "nothing": None, "list": [], "object": object()},
    "things": {"number": 3, "text": "thing", "nothing": None, "of others": [3], "object": object()},
    "mapping": {
        "number": 3,
        "text": "thing",
        "nothing": None,
        "list": [1],
        "to others": {"s1": object()},
        "unknown": {"nobody": 1.0},
    },
    "array": {"text": "array", "nothing": None, "object": object(), "ragged": [[1.0], [1.0, 2.0]]},
    "path": {"number": 3, "nothing": None, "list": ["a"], "missing": "no/such.file"},
    "function": {"number": 3, "text": "function", "nothing": None},
    "flag": {"text": "yes", "number": 3, "nothing": None},
}


class Argument(NamedTuple):
    """A right value of an argument, and the wrong ones by what is wrong with them."""

    right: Any
    wrong: dict[str, Any]


def of(kind, right, *but, **more):
    """An argument of a kind: without some of its wrong values, with more."""
    wrong = {name: value for name, value in WRONG[kind].items() if name not in but}
    return Argument(right, wrong | more)


def number(right, *but, **more):
    return of("number", right, *but, **more)


def positive(right, *but, **more):
    return of("number", right, *but, negative=-abs(right), zero=0.0, **more)


count = functools.partial(of, "count")
name = functools.partial(of, "name")
word = functools.partial(of, "word")
things = functools.partial(of, "things")
mapping = functools.partial(of, "mapping")
path = functools.partial(of, "path")
function = functools.partial(of, "function")
flag = functools.partial(of, "flag")


def thing(right, *but, **more):
    return of("thing", right, *but, **{"class": type(right)} | more)


def array(right, *but, **more):
    values = np.asarray(right)
    wrong = {"another shape": values[..., None], "shorter": values[:-1]}
    if values.dtype.kind == "f":
        wrong["nan"] = np.where(np.arange(values.size).reshape(values.shape) == 0, NAN, values)
    return of("array", right, *but, **{key: wrong[key] for key in wrong if key not in but} | more)


class Call(NamedTuple):
    """A right call: the callable, its arguments, and what is done with what it returns.

    Of a reader without an example file no right call is known: wrong ones are made alone.
    """

    function: Any
    arguments: dict[str, Argument]
    then: Any = None
    has_right: bool = True

    def make(self, **changed):
        """Make the call with other values."""
        arguments = {key: argument.right for key, argument in self.arguments.items()} | changed
        positional = [
            arguments.pop(key)
            for key, parameter in inspect.signature(self.function).parameters.items()
            if key in arguments and parameter.kind is not parameter.KEYWORD_ONLY
        ]
        result = self.function(*positional, **arguments)
        return result if self.then is None else self.then(result)


# ---------------------------------------------------------------------- what calls are made with


def with_sensor(at):
    """Experiment with a sensor at a place."""
    return experiment(sensors=[bp.Sensor("s1", at=at)])


def in_space(at):
    """Experiment in space with a sensor at a place."""
    return bp.Experiment(
        bp.Structure(plane_modes(), damping=bp.damping.Modal([0.02])),
        sensors=[bp.Sensor("s1", at=at)],
        actuators=[bp.Actuator("a1", at=(0.1, 0.1, 0.0))],
        frequency=LINES,
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(1e-5),
    )


def damped(law):
    """Experiment with a damping law."""
    return experiment(structure=structure(law))


def noisy(noise):
    """Data density of an experiment with a noise."""
    return experiment(noise=noise).data(measurement())


def noisy_with_coherence(noise):
    """Data density of an experiment with a noise that reads the coherence."""
    coherence = np.full((1, 1, LINES.size), 0.9)
    return experiment(noise=noise).data(measurement(coherence=coherence, averages=8))


def observed(observation):
    """Experiment with an observation."""
    return experiment(observe=observation).data(measurement())


def added(effect):
    """Experiment with an effect."""
    return experiment() + effect


def on_beam():
    """Experiment on a beam."""
    return experiment(structure=bp.Structure(beam(), damping=bp.damping.Modal([0.02])))


def beam_with(effect):
    """Experiment on a beam, with an effect."""
    return on_beam() + effect


def two_sensors():
    """Experiment of two sensors and two actuators."""
    sensors = [bp.Sensor(label, at=at) for label, at in (("s1", 0.2), ("s2", 0.4))]
    actuators = [bp.Actuator(label, at=at) for label, at in (("a1", 0.3), ("a2", 0.6))]
    return experiment(sensors=sensors, actuators=actuators)


def two_sensors_with(effect):
    """Experiment of two sensors and two actuators, with an effect."""
    return two_sensors() + effect


def two_channels_with(effect):
    """Experiment whose sensor has two channels, with an effect."""
    return experiment(sensors=[bp.Sensor("s1", at=0.2, directions=(1, -1))]) + effect


def on_parts(effect):
    """Structure of finite elements with parts of all kinds, with an effect."""
    return bp.Structure(parted_modes(), damping=bp.damping.Modal([0.02])) + effect


def beam():
    """A free beam."""
    return bp.beams.beam(
        4,
        length=1.0,
        area=1e-4,
        second_moment=1e-9,
        youngs_modulus=7e10,
        density=2700.0,
        ends="clamped-free",
    )


@functools.cache
def plane_model():
    """Modes of a plane of nodes, as arrays."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, 4), np.linspace(0.0, 0.8, 4))
    position = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    shape = np.zeros((16, 3, 2))
    shape[:, 2] = np.column_stack([1 + position[:, 0], 1 - position[:, 1]])
    return {
        "position": position,
        "shape": shape,
        "natural_frequency": np.array([120.0, 300.0]),
        "modal_mass": np.ones(2),
    }


@functools.cache
def modal_model():
    """Modes of a plane of nodes that move across it."""
    return bp.finite_elements.ModalModel.from_arrays(**plane_model()).without_unused_directions()


@functools.cache
def plane_reading():
    """How they are read."""
    return bp.finite_elements.interpolation.scattered(modal_model())


@functools.cache
def plane_modes():
    """Modes of a structure in space."""
    return bp.finite_elements.modes_from_shapes(modal_model(), plane_reading())


ELEMENTS = np.column_stack([np.arange(8), np.arange(1, 9)])


@functools.cache
def frame_arrays():
    """Arrays of a cantilever along x that bends along y."""
    size, length = 9, 1.0 / 8
    stiffness, mass = np.zeros((6 * size, 6 * size)), np.zeros((6 * size, 6 * size))
    bending = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], float)
    inertia = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    scale = np.array([1.0, length, 1.0, length])
    for first in range(size - 1):
        rows = np.ix_(*[6 * first + np.array([1, 5, 7, 11])] * 2)
        stiffness[rows] += 70.0 / length**3 * bending * np.outer(scale, scale)
        mass[rows] += 0.27 * length / 420 * inertia * np.outer(scale, scale)
    direction = np.tile(np.arange(1, 7), size)
    is_held = ~np.isin(direction, (2, 6))
    is_held[:6] = True
    return {
        "stiffness": stiffness,
        "mass": mass,
        "position": np.column_stack([np.linspace(0, 1, size), np.zeros((size, 2))]),
        "dof": np.column_stack([np.repeat(np.arange(1, size + 1), 6), direction]),
        "fixed": np.flatnonzero(is_held),
    }


@functools.cache
def matrices():
    """The cantilever, half of it a region."""
    arrays = frame_arrays()
    region = np.zeros_like(arrays["stiffness"])
    scale = np.array([1.0, 0.125, 1.0, 0.125])
    bending = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], float)
    rows = np.ix_(*[np.array([13, 17, 19, 23])] * 2)
    region[rows] = 0.5 * 70.0 * 8**3 * bending * np.outer(scale, scale)
    return bp.finite_elements.Matrices(**arrays, regions={"middle": region})


@functools.cache
def frame_reading():
    """How the cantilever is read."""
    return bp.finite_elements.interpolation.frame(matrices(), ELEMENTS)


@functools.cache
def geometric():
    """Geometric stiffness of its elements."""
    return bp.finite_elements.interpolation.frame_geometric_stiffness(matrices(), ELEMENTS)


@functools.cache
def soft_foot():
    """Its soft foot."""
    return bp.finite_elements.soft_supports.rotations(matrices(), 1)


@functools.cache
def loose_root():
    """Its joint."""
    return bp.finite_elements.joints(matrices())


@functools.cache
def parted_modes():
    """Its modes, with all parts."""
    return bp.finite_elements.modes(
        matrices(),
        frame_reading(),
        up_to=2000.0,
        members={"arm": geometric()},
        soft={"foot": soft_foot()},
        joints=loose_root(),
    )


@functools.cache
def posterior():
    """Posterior of a small experiment."""
    return bp.infer(known_sensor(), known_sensor().nominal_measurement(), engine=MAP)


def known_sensor():
    """Experiment of which the damping is unknown."""
    return experiment()


@functools.cache
def uncertain():
    """Experiment of which the damping and the place of a sensor are unknown."""
    return with_sensor(bp.positions.Segment(0.2, within=0.02))


@functools.cache
def learnt():
    """A small map."""
    return bp.information_map(
        uncertain(),
        {"s1": [0.2, 0.3]},
        estimator=bp.information.KernelGain(draws=16, placement_draws=8),
    )


@functools.cache
def study():
    """A small study of tolerances."""
    return bp.design.tolerance_study(
        uncertain(),
        {"s1": [0.2, 0.3]},
        factors=(1.0, 0.5),
        estimator=bp.information.KernelGain(draws=16, placement_draws=8),
    )


@functools.cache
def best():
    """A small search."""
    return bp.place(
        uncertain(),
        {"s1": [0.2, 0.3]},
        estimator=bp.information.KernelGain(draws=16, placement_draws=8),
    )


@functools.cache
def ledger():
    """A small ledger."""
    return bp.improve(
        known_sensor(),
        known_sensor().nominal_measurement(),
        model_error=None,
        candidates=bp.effects.library(known_sensor(), ["time_delay"]),
    )


@functools.cache
def reached():
    """What laws along a bar could remove."""
    return bp.reach(known_sensor(), known_sensor().nominal_measurement())


@functools.cache
def folder():
    """A folder of files."""
    path = Path(tempfile.mkdtemp())
    bp.io.uff.write(path / "measured.uff", measurement())
    bp.io.npz_modes.write(path / "modes.npz", modal_model())
    bp.io.netcdf.write(posterior(), path / "result.nc")
    for label in ("stiffness", "mass"):
        matrix = scipy.sparse.csc_array(frame_arrays()[label])
        scipy.sparse.save_npz(path / f"{label}.npz", matrix)
    (path / "part.vtk").write_text(
        "# vtk DataFile Version 4.2\npart\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n"
        "0 0 0 1 0 0 1 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n"
    )
    return path


LAW = pd.DataFrame({"frequency": [5.0, 9.0], "real": [1e4, 2e4], "imaginary": 50.0, "unit": "N/m"})


def law_file():
    """A law as a table."""
    LAW.to_csv(folder() / "law.csv", index=False)
    return str(folder() / "law.csv")


def photograph():
    """The beginning of a PNG."""
    (folder() / "bar.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    return str(folder() / "bar.png")


@functools.cache
def fitted():
    """Response and error before and after."""
    return ledger().fits


# ---------------------------------------------------------------------- calls by the registries

LAWS = {f"damping.{law.__name__}": law for law in bp.damping.LAWS if law is not bp.damping.Modal}
KINDS = {f"effects.{kind}": effect for kind, effect in bp.effects.EFFECTS.items()}
ENGINES = {f"engines.{engine}": getattr(bp.engines, engine) for engine in bp.engines.__all__}
READERS = {f"io.{known.reader}": known.reader for known in bp.io.formats.FORMATS}
OF_NETWORKS = {
    f"effects.{kind.__name__}": kind
    for kind in (
        bp.effects.Spring,
        bp.effects.Dashpot,
        bp.effects.Mass,
        bp.effects.LossySpring,
        bp.effects.Springpot,
    )
}
REGISTERED = {**LAWS, **OF_NETWORKS, **KINDS, **ENGINES, **READERS}
"""What has a line in a registry: a row is made of its fields where none is written below."""

SMALL = {"1": 0.02, "1/s": 1.0, "s": 1e-6}
"""A number for a field of a damping law, by its unit."""


def of_registry(registry, call_of):
    """A call of each member of a registry, by name."""
    return {label: call_of(member) for label, member in registry.items()}


def of_law(law):
    """Call of a damping law: a small number for each field, none of which may be negative."""
    rights = {field.name: SMALL[field.metadata["unit"]] for field in dataclasses.fields(law)}
    arguments = {key: number(right, negative=-right) for key, right in rights.items()}
    return Call(law, arguments, damped)


def of_element(kind):
    """Call of an element of a network, which is attached then."""
    arguments = {field.name: number(0.5) for field in dataclasses.fields(kind)}
    return Call(kind, arguments, lambda law: structure() + bp.effects.attached(0.4, law))


SPRING = bp.effects.Spring(1e4)
OF_ANY_LAW = {
    bp.effects.attached: bp.effects.attached(0.4, SPRING),
    bp.effects.over: bp.effects.over(0.4, 0.1, SPRING),
    bp.effects.inserted: bp.effects.inserted(0.4, SPRING, motion="displacement"),
    bp.effects.modulus: bp.effects.modulus(SPRING),
}
"""Effects of a law of yours, of which none is suggested."""


def of_effect(kind):
    """Call of an effect with numbers from the priors that it suggests, where it suggests some."""
    setups = (experiment(), two_sensors(), on_beam(), experiment(force_levels=[1.0]))
    setup, suggested = next(
        (setup, suggested)
        for setup in setups
        for suggested in kind.suggest(bp.effects.Scales(setup)) or [OF_ANY_LAW.get(kind)]
        if suggested is not None
    )
    fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
    arguments = {
        key: of_field(kind, field, getattr(suggested, key)) for key, field in fields.items()
    }
    return Call(kind, arguments, lambda effect: setup + effect)


def of_field(kind, field, suggested):
    """Argument of an effect by the annotation of its field, and what the effect suggests for it."""
    if field.name == "name":
        return NAME
    if field.name in kind.place_fields:
        return of("number", 0.4, "three", outside=1.4, pair=(0.1, 0.2))
    if field.type != Parameter:
        return Argument(suggested, {})
    if isinstance(suggested, dist.Distribution):
        suggested = float(np.median(suggested.sample(jax.random.key(0), (99,))))
    return number(suggested, "three")  # there may be one for each mode or part


def of_engine(engine):
    """Call of an engine: its defaults, wrong by the annotations of its fields."""
    kinds = {int: count, float: positive, bool: flag}
    arguments = {
        field.name: kinds[field.type](field.default)
        for field in dataclasses.fields(engine)
        if field.type in kinds
    }
    return Call(engine, arguments)


def of_reader(name):
    """Wrong calls of a reader of files; a right one needs a file of its format."""
    module, function = name.split(".")
    reader = getattr(importlib.import_module(f"bayes_placement.io.{module}"), function)
    first = next(iter(inspect.signature(reader).parameters))
    return Call(reader, {first: path(None, directory=str(folder()))}, has_right=False)


# ---------------------------------------------------------------------- the calls

NAME = name("one", "list")
AXES = {"axes": thing(None, "nothing", "class")}
AX = {"ax": thing(None, "nothing", "class")}
PLACE_ON_LINE = of("number", 0.2, outside=1.2, pair=(0.1, 0.2))
DAMPING_OF = {"many": 40.0}
PRIOR = dist.Uniform(0.02, 0.06)


def transducer(label, at):
    return {
        "name": name(label),
        "at": of("number", at, outside=1.2, pair=(0.1, 0.2)),
        "directions": of("things", (1,), "nothing", twice=(1, 1), none=(9,)),
    }


def calls_of_experiment():
    transducers = {
        "name": name("s1"),
        "at": PLACE_ON_LINE,
        "directions": of(
            "things", (1,), "nothing", "of others", twice=(1, 1), none=(9,), words=("x",)
        ),
        "angles": of(
            "things",
            (0.0, 0.0, 0.0),
            "nothing",
            degrees=(0.0, 10.0, 0.0),
            nan=(0.0, NAN, 0.0),
            two=(0.0, 0.0),
        ),
        "recorded": of("number", 0.2, "nothing", "three", "nan", "infinite", "complex"),
        "tolerance": thing(bp.positions.Segment(0.2, within=0.01), "nothing"),
        "gain": number(1.0, "nothing", zero=0.0),
        "delay": number(1e-5, "nothing"),
    }
    sensor = transducers
    actuator = transducers | {"name": name("a1")}
    return {
        "Sensor": Call(bp.Sensor, sensor, lambda made: experiment(sensors=[made])),
        "Actuator": Call(bp.Actuator, actuator, lambda made: experiment(actuators=[made])),
        "Channel": Call(
            bp.Channel,
            {"name": name("s1", "dot"), "direction": count(1, "zero", "negative", much=9)},
            lambda made: measurement(sensors=[made]),
        ),
        "Structure": Call(
            bp.Structure,
            {
                "modes": thing(bar()),
                "damping": thing(bp.damping.Modal([0.02])),
                "effects": mapping({}, "unknown"),
            },
            lambda made: experiment(structure=made),
        ),
        "Experiment": Call(
            bp.Experiment,
            {
                "structure": thing(structure()),
                "sensors": things([bp.Sensor("s1", at=0.2)], bare=bp.Sensor("s1", at=0.2), none=[]),
                "actuators": things([bp.Actuator("a1", at=0.3)], none=[]),
                "frequency": array(LINES, "shorter", negative=-LINES, scalar=5.0),
                "observe": thing(bp.observe.Complex("velocity")),
                "noise": thing(bp.noise.Gaussian(1e-5), "nothing"),
                "model_error": thing(bp.model_error.Embedded(), "nothing"),
                "force_levels": of(
                    "things",
                    [1.0],
                    "nothing",
                    "of others",
                    negative=[-1.0],
                    nan=[NAN],
                    none=[],
                    twice=[1.0, 1.0],
                ),
                "sensors_mounted": word("roving"),
            },
        ),
        "ModalParameters": Call(
            bp.ModalParameters,
            {
                "natural_frequency": array(
                    [160.0, 330.0], falling=[330.0, 160.0], negative=[-1.0, 2.0], nan=[NAN, 2.0]
                ),
                "natural_frequency_deviation": array(
                    [0.1, 0.2], "nothing", "nan", zero=[0.0, 0.1], one=[0.1], infinite=[INF, 0.1]
                ),
                "damping_ratio": array(
                    [0.01, 0.02], "nothing", "nan", percent=[1.0, 2.0], one=[0.01]
                ),
                "damping_ratio_deviation": array([1e-3, 1e-3], "nothing", "nan", other=[0.1, 0.1]),
                "shape": array(
                    np.ones((1, 2)), "nan", turned=np.ones((2, 1)), complex=np.full((1, 2), 1j)
                ),
                "shape_deviation": array(
                    np.full((1, 2), 0.1), "nothing", "nan", zero=np.zeros((1, 2))
                ),
                "sensors": things(["s1"], "text", none=[], blank=[" "]),
                "covariance": array(
                    np.stack([np.diag([1e-2, 1e-6, 1e-2]), np.diag([4e-2, 1e-6, 1e-2])]),
                    "nothing",
                    other=np.stack([np.eye(3), np.eye(3)]),
                    flat=np.eye(3),
                ),
                "correlation": array(np.eye(2), "nothing", flat=[1.0, 1.0], same=np.ones((2, 2))),
                "number": of("things", [1, 2], "nothing", "of others", none=[], half=[0.5, 1.0]),
            },
        ),
        "ModalParameters.from_repeats": Call(
            bp.ModalParameters.from_repeats,
            {
                "natural_frequency": array(REPEATS, few=REPEATS[:3], one=REPEATS[0]),
                "damping_ratio": array(1e-4 * REPEATS, "nothing", turned=REPEATS.T),
                "of_one": flag(False),
                "number": of("things", [1, 2], "nothing", "of others", none=[], half=[0.5, 1.0]),
            },
        ),
        "Measurement": Call(
            bp.Measurement.from_arrays,
            {
                "frf": array(
                    np.full((1, 1, LINES.size), 1 + 1j), infinite=np.full((1, 1, 12), INF)
                ),
                "frequency": array(LINES, negative=-LINES, falling=LINES[::-1]),
                "sensors": things(["s1"], "text", twice=["s1", "s1"], none=[], blank=[" "]),
                "actuators": things(["a1"], "text", none=[]),
                "quantity": word("mobility"),
                "coherence": array(
                    np.full((1, 1, LINES.size), 0.9), "nothing", percent=np.full((1, 1, 12), 90.0)
                ),
                "averages": count(8, "nothing"),
                "positions": mapping(
                    {"s1": (0.2, 0.0, 0.0)}, "nothing", nan={"s1": (NAN, 0.0, 0.0)}
                ),
                "force_level": positive(1.0, "nothing"),
            },
        ),
    }


REPEATS = np.array([160.0, 330.0]) + np.random.default_rng(0).normal(size=(6, 2))
"""Natural frequencies of two modes [Hz] in six repeats."""


def modal_parameters():
    """Two modes by their numbers."""
    return bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2])


def pyoma2():
    """Arrays of a result of pyOMA2."""
    deviations = {"Fn_std": [0.1], "Xi_std": [1e-3], "Phi_std": [[0.1]]}
    return {"Fn": [160.0], "Xi": [0.01], "Phi": [[1.0]]} | deviations


def modes_table(folder):
    """A table of modal parameters."""
    return str(bp.io.modal_parameters.write(modal_parameters(), folder / "modes.csv"))


def calls_of_laws():
    return of_registry(LAWS, of_law) | {
        "damping.Modal": Call(
            bp.damping.Modal,
            {
                "ratio": of(
                    "number",
                    [0.02],
                    "three",
                    percent=[2.0],
                    negative=[-0.02],
                    none=[],
                    nan=[NAN],
                    swapped=dist.Uniform(0.06, 0.02),
                )
            },
            damped,
        ),
        "noise.Gaussian": Call(bp.noise.Gaussian, {"sigma": positive(1e-5, "three")}, noisy),
        "noise.Covariance": Call(
            bp.noise.Covariance,
            {
                "matrix": array(
                    np.eye(24), indefinite=-np.eye(24), asymmetric=np.triu(np.ones((24, 24)))
                ),
                "factor": positive(1.0, "three"),
            },
            noisy,
        ),
        "noise.FromCoherence": Call(
            bp.noise.FromCoherence,
            {"factor": positive(1.0, "three")},
            noisy_with_coherence,
        ),
        "noise.FromScatter": Call(
            bp.noise.FromScatter,
            {"factor": positive(1.0, "three")},
            lambda noise: experiment(noise=noise).data(
                dataclasses.replace(measurement(), line_scatter=np.full((1, 1, LINES.size), 0.01))
            ),
        ),
        "noise.FromVariance": Call(
            bp.noise.FromVariance,
            {"factor": positive(1.0, "three")},
            lambda noise: experiment(noise=noise).data(
                measurement(variance=np.full((1, 1, LINES.size), 0.01))
            ),
        ),
        "noise.Relative": Call(
            bp.noise.Relative,
            {
                "ratio": positive(0.01, "three"),
                "floor": number(1e-6, "three", negative=-1.0),
                "coherence": positive(1.0, "nothing", "three"),
            },
            noisy_with_coherence,
        ),
        "observe.ModalData": Call(bp.observe.ModalData, {"measured": thing(modal_parameters())}),
        "observe.Complex": Call(bp.observe.Complex, {"quantity": word("velocity")}, observed),
        "observe.LogAmplitude": Call(
            bp.observe.LogAmplitude, {"quantity": word("velocity")}, observed
        ),
        "model_error.Embedded": Call(
            bp.model_error.Embedded,
            {
                key: positive(0.01, "nothing")
                for key in ("frequency", "damping", "shape", "gain", "stiffness_and_mass", "runs")
            }
            | {"modes": count(3, "nothing"), "pieces": count(4, "nothing")},
            lambda error: experiment(model_error=error),
        ),
        "beams.bar": Call(
            bp.beams.bar,
            {
                "modes": count(5),
                "length": positive(1.0),
                "area": positive(1e-3),
                "youngs_modulus": positive(1e9),
                "density": positive(9e3),
                "ends": word("fixed-fixed"),
                "direction": count(1, much=5),
                "static_correction": flag(True),
            },
            lambda modes: bp.Structure(modes, damping=bp.damping.Modal([0.02])),
        ),
        "beams.beam": Call(
            bp.beams.beam,
            {
                "modes": count(5),
                "length": positive(1.0),
                "area": positive(1e-3),
                "second_moment": positive(1e-9),
                "youngs_modulus": positive(1e9),
                "density": positive(9e3),
                "ends": word("clamped-free"),
                "direction": count(3, much=5),
                "static_correction": flag(True),
            },
            lambda modes: bp.Structure(modes, damping=bp.damping.Modal([0.02])),
        ),
    }


def calls_of_positions():
    three = {
        "nan": (NAN, 0.0, 0.0),
        "two": (0.1, 0.2),
        "text": "corner",
        "nothing": None,
        "words": ("a", "b", "c"),
        "infinite": (INF, 0.0, 0.0),
    }

    def point(right, **more):
        return Argument(right, three | {"number": 0.1} | more)

    return {
        "positions.Segment": Call(
            bp.positions.Segment,
            {"centre": number(0.2, outside=2.0), "within": positive(0.02)},
            with_sensor,
        ),
        "positions.Box": Call(
            bp.positions.Box,
            {
                "centre": point((0.5, 0.4, 0.0), outside=(5.0, 0.0, 0.0)),
                "within": point((0.1, 0.1, 0.0), negative=(-0.1, 0.1, 0.0)),
            },
            in_space,
        ),
        "positions.Ball": Call(
            bp.positions.Ball, {"centre": point((0.5, 0.4, 0.0)), "radius": positive(0.1)}, in_space
        ),
        "positions.Member": Call(
            bp.positions.Member,
            {
                "start": point((0.2, 0.4, 0.0)),
                "end": point((0.6, 0.4, 0.0), same=(0.2, 0.4, 0.0)),
                "centre": Argument(
                    (0.4, 0.4, 0.0), {k: v for k, v in three.items() if k != "nothing"}
                ),
                "within": positive(0.1, "nothing"),
            },
            in_space,
        ),
        "positions.Patch": Call(
            bp.positions.Patch,
            {
                "centre": point((0.5, 0.4, 0.0)),
                "first": point((1.0, 0.0, 0.0), none=(0.0, 0.0, 0.0)),
                "second": point((0.0, 1.0, 0.0), same=(1.0, 0.0, 0.0)),
                "within": Argument(
                    (0.1, 0.1),
                    {
                        "nan": (NAN, 0.1),
                        "negative": (-0.1, 0.1),
                        "one": (0.1,),
                        "text": "wide",
                        "nothing": None,
                        "number": 0.1,
                    },
                ),
            },
            in_space,
        ),
        "positions.Nodes": Call(
            bp.positions.Nodes,
            {
                "position": array(plane_model()["position"], "shorter"),
                "tolerance": thing(
                    bp.positions.Box((0.5, 0.4, 0.0), within=(0.4, 0.4, 0.0)), "nothing"
                ),
            },
            in_space,
        ),
        "positions.Cartesian": Call(
            bp.positions.Cartesian,
            {axis: number(0.0 if axis == "z" else 0.3) for axis in "xyz"},
            in_space,
        ),
        "positions.rotation": Call(bp.positions.rotation, {"angles": array(np.zeros(3))}, None),
    }


def calls_of_effects():
    # Strengths may be arrays, one for each mode or part.
    def number(right, **more):
        return of("number", right, "three", **more)

    def positive(right):
        return number(right, negative=-right, zero=0.0)

    at = of("number", 0.4, "three", outside=1.4, pair=(0.1, 0.2))

    share = number(1.0)
    side = word("sensor", "empty")
    channel = of("count", 1, "nothing", "zero", "negative", much=9)
    filtered = {
        "transducer": of("name", "s1", "nothing"),
        "order": count(1, much=3),
        "side": side,
        "direction": channel,
    }
    sensor = name("s1")
    actuator = name("a1")
    ratio = number(0.1, negative=-0.1)
    table = {
        "tuned_absorber": (
            added,
            {"at": at, "mass": number(0.1), "frequency": positive(200.0), "damping_ratio": ratio},
        ),
        "local_stiffness_loss": (added, {"at": at, "extent": positive(0.1), "loss": number(0.2)}),
        "region_stiffness_loss": (on_parts, {"region": name("middle"), "loss": number(0.2)}),
        "hysteretic_damping": (added, {"loss_factor": number(0.02), "share": share}),
        "viscoelastic_modulus": (
            added,
            {"relaxing": number(0.1), "relaxation_time": positive(1e-3)},
        ),
        "modulus_change": (added, {"change": number(-0.02)}),
        "compliant_support": (
            added,
            {"compliance": number(1e-9), "end": word("left"), "motion": word("translation")},
        ),
        "soft_support": (on_parts, {"support": name("foot"), "compliance": number(1e-3)}),
        "loose_joint": (
            on_parts,
            {"joint": name("node 1 about z"), "compliance": number(1e-3)},
        ),
        "axial_preload": (beam_with, {"tension": number(10.0)}),
        "member_preload": (on_parts, {"member": name("arm"), "tension": number(10.0)}),
        "shear_and_rotary_inertia": (beam_with, {"modulus_ratio": positive(3.0), "share": share}),
        "cubic_stiffness": (
            lambda effect: experiment(force_levels=[1.0]) + effect,
            {"at": at, "stiffness": number(1e9)},
        ),
        "residual_modes": (added, {"flexibility": number(1e-6)}),
        "further_mode": (
            added,
            {"residue": number(0.2), "frequency": positive(300.0), "damping_ratio": ratio},
        ),
        "stinger": (
            added,
            {"stiffness": number(1e4), "frequency": positive(300.0), "damping_ratio": ratio},
        ),
        "channel_delay": (
            added,
            {"transducer": sensor, "delay": number(1e-5), "side": side, "direction": channel},
        ),
        "gain_error": (
            added,
            {"transducer": sensor, "error": number(0.1), "side": side, "direction": channel},
        ),
        "mount_resonance": (
            added,
            {"sensor": sensor, "frequency": positive(900.0), "damping_ratio": ratio},
        ),
        "beyond_prior": (
            added,
            {
                "unknown": name("structure.damping.ratio"),
                "value": number(0.07, negative=-0.1),
                "end": number(0.06),
            },
        ),
        "misplaced_sensor": (added, {"sensor": sensor, "shift": number(0.1)}),
        "misplaced_actuator": (added, {"actuator": actuator, "shift": number(0.1)}),
        "reversed_sensor": (added, {"sensor": sensor, "share": share}),
        "reversed_channel": (
            added,
            {"transducer": sensor, "share": share, "side": side, "direction": channel},
        ),
        "swapped_sensors": (
            two_sensors_with,
            {"sensor": sensor, "other": name("s2"), "share": share},
        ),
        "swapped_actuators": (
            two_sensors_with,
            {"actuator": actuator, "other": name("a2"), "share": share},
        ),
        "frequency_drift": (
            added,
            {"transducer": sensor, "drift": number(0.01), "side": side, "direction": channel},
        ),
        "low_pass": (added, {**filtered, "frequency": positive(900.0)}),
        "high_pass": (added, {**filtered, "frequency": number(20.0)}),
        "phase_drift": (
            added,
            {
                "transducer": sensor,
                "phase": number(0.1, degrees=5.0),
                "reference": positive(100.0),
                "exponent": number(-1.0),
                "side": side,
                "direction": channel,
            },
        ),
        "cross_axis": (
            two_channels_with,
            {"sensor": name("s1"), "share": number(0.03)},
        ),
        "frequency_scale": (added, {"rate_error": number(0.01, percent=5.0)}),
        "mains_hum": (
            added,
            {
                "transducer": sensor,
                "share": number(0.1),
                "phase": number(0.1, degrees=5.0),
                "frequency": positive(50.0),
                "width": number(0.5, negative=-0.5),
                "quantity": word("acceleration"),
                "side": side,
                "direction": channel,
            },
        ),
    }
    calls = {
        f"effects.{kind}": Call(getattr(bp.effects, kind), arguments | {"name": NAME}, then)
        for kind, (then, arguments) in table.items()
    }
    missing = {label: kind for label, kind in KINDS.items() if label not in calls}
    return (
        of_registry(missing, of_effect)
        | of_registry(OF_NETWORKS, of_element)
        | calls
        | {
            "effects.Tabulated": Call(
                bp.effects.Tabulated,
                {
                    "frequency": array([1.0, 1e4]),
                    "stiffness": array([1e4 + 5e2j, 2e4 + 2e3j]),
                    "strength": number(0.5),
                },
                lambda law: structure() + bp.effects.attached(0.4, law),
            ),
            "effects.library": Call(
                bp.effects.library,
                {
                    "experiment": thing(experiment()),
                    "kinds": things(["point_mass"], "nothing", unknown=["mass"]),
                    "further": things([], "nothing"),
                },
            ),
        }
    )


def calls_of_methods():
    draws = {"draws": count(16)}
    sampling = {"sampling": word("sobol"), "replicates": count(4)}
    after = {"after": thing(None, "nothing", "class")}
    return of_registry(ENGINES, of_engine) | {
        "engines.Grid": Call(bp.engines.Grid, {"nodes": count(8), "batch": count(100)}, fit),
        "engines.MAP": Call(
            bp.engines.MAP,
            {"starts": count(2), "search": word("gradient"), "draws": count(5, "zero")},
            fit,
        ),
        "engines.NUTS": Call(
            bp.engines.NUTS,
            {
                "chains": count(2),
                "warmup": count(3, "zero"),
                "draws": count(4),
                "target_accept": positive(0.8, one=1.0, percent=80.0),
            },
        ),
        "engines.SMC": Call(
            bp.engines.SMC,
            {
                "particles": count(40),
                "populations": count(2),
                "moves": count(2, "zero"),
                "target_ess": positive(0.5, percent=50.0),
                "prior_draws": count(64, "nothing"),
            },
        ),
        "marginals.KDE": Call(
            bp.marginals.KDE,
            {
                "placement_draws": count(8),
                "kernel": word("soize"),
                "noise_draws": count(1, "zero", "nothing"),
                "common": flag(True),
            },
        ),
        "marginals.Quadrature": Call(bp.marginals.Quadrature, {"nodes": count(4)}),
        "information.KernelGain": Call(
            bp.information.KernelGain,
            {**draws, "placement_draws": count(8), "kernel": word("soize"), **sampling, **after},
            mapped,
        ),
        "information.Exact": Call(
            bp.information.Exact, {**draws, "nodes": count(4), **sampling, **after}, mapped
        ),
        "information.ExpectedGain": Call(
            bp.information.ExpectedGain,
            {**draws, "placement_draws": count(8), "data_draws": count(8), **sampling, **after},
            mapped,
        ),
        "information.Separation": Call(
            bp.information.Separation,
            {
                "alternatives": things((alternative("one"), alternative("two")), none=()),
                **draws,
                "data_draws": count(8),
                **sampling,
            },
        ),
        "information.Alternative": Call(
            bp.information.Alternative,
            {
                "name": name("one", "dot"),
                "probability": number(0.5, negative=-0.5),
                "experiment": thing(known_sensor()),
                "draws": thing(posterior(), "nothing"),
            },
            lambda made: bp.information.Separation((made, alternative("two"))),
        ),
        "information.from_evidence": Call(
            bp.information.from_evidence,
            {
                key: number(1.0)
                for key in ("log_likelihood", "log_likelihood_error", "evidence", "evidence_error")
            },
        ),
        "information.from_prior_draws": Call(
            bp.information.from_prior_draws,
            {
                "log_likelihood": array(np.linspace(0, 1, 50), "shorter"),
                "log_prior_weight": array(np.zeros(50), "nothing"),
            },
        ),
        "information.from_posterior_draws": Call(
            bp.information.from_posterior_draws,
            {
                "vectors": array(np.random.default_rng(0).normal(size=(50, 2))),
                "log_prior": array(np.zeros(50)),
                "neighbours": count(4, much=400),
            },
        ),
        "design.Evolutionary": Call(
            bp.design.Evolutionary,
            {
                "populations": count(2),
                "size": count(8),
                "scattered": count(4, "zero"),
                "generations": count(3),
                "accuracy": positive(0.01),
            },
        ),
        "design.Sequential": Call(bp.design.Sequential, {"rounds": count(2)}),
        "design.workers": Call(
            bp.design.workers,
            {
                "processes": count(None, "nothing"),
                "dask": Argument(None, {"number": 3, "empty": ""}),
            },
        ),
        "design.progress_bar": Call(
            bp.design.progress_bar,
            {"task": of("word", "done", "unknown", "empty")},
            lambda manager: manager.__enter__() and None,
        ),
    }


def fit(engine):
    """Result of an engine."""
    return bp.infer(known_sensor(), measurement(), engine=engine)


def mapped(estimator):
    """Map of an estimator, at one place."""
    return bp.information_map(uncertain(), {"s1": [0.2]}, estimator=estimator)


@functools.cache
def alternative(label):
    """An explanation of data."""
    return bp.information.Alternative(label, 0.5, known_sensor(), posterior())


def resonance():
    """A computed FRF with one peak."""
    lines = np.arange(50.0, 150.0, 0.5)
    frf = 1 / (100.0**2 - lines**2 + 2j * lines)
    one = {"sensors": ["s1"], "actuators": ["a1"], "quantity": "receptance"}
    return bp.Measurement.from_arrays(frf, lines, **one)


FLAT = measurement()
"""FRFs without a peak."""


def calls_of_verbs():
    key = {"key": of("count", 0, "zero", "negative")}
    progress = {"progress": function(lambda share: None)}
    measured = known_sensor().nominal_measurement()
    places = mapping(
        {"s1": [0.2, 0.3]},
        outside={"s1": [1.2]},
        none={},
        empty={"s1": []},
        words={"s1": ["a"]},
        nan={"s1": [NAN]},
    )
    search = {
        "experiment": thing(uncertain()),
        "places": places,
        "estimator": thing(bp.information.KernelGain(draws=16, placement_draws=8), "nothing"),
        "about": things(["structure.damping.ratio"], "nothing", unknown=["mass"], none=[]),
        "nominal": mapping(
            {},
            "nothing",
            nan={"structure.damping.ratio": NAN},
            words={"structure.damping.ratio": "a"},
        ),
        "store": path(None, "nothing", "missing"),
        "executor": thing(None, "nothing", "class"),
        **key,
        "progress": function(lambda share: None, "nothing"),
    }
    infer = {
        "experiment": thing(known_sensor()),
        "measurement": thing(measured, path="measured.uff"),
        "engine": thing(MAP, "nothing"),
        "marginal": thing(bp.marginals.Latent(), "nothing"),
        **key,
        **progress,
    }
    library = bp.effects.library(known_sensor(), ["time_delay"])
    missing = {
        "experiment": thing(known_sensor()),
        "measurement": thing(measured, path="measured.uff"),
        "baseline": thing(measured, "nothing"),
        "candidates": thing(library, "nothing"),
        "model_error": thing(None, "nothing", "class"),
        "store": path(None, "nothing", "missing"),
        "executor": thing(None, "nothing", "class"),
        **progress,
    }
    level = positive(0.01, one=1.0, percent=95.0)
    return {
        "infer": Call(bp.infer, infer),
        "simulate": Call(
            bp.simulate, {"experiment": thing(known_sensor()), "draws": count(3), **key}
        ),
        "identify": Call(
            bp.identify,
            {
                "measurement": thing(resonance(), path="measured.uff", flat=FLAT),
                "shapes_at": of("word", "sensors"),
                "number": of("things", [1], "nothing", "of others", none=[], two=[1, 2]),
            },
        ),
        "observing_modes": Call(
            bp.observing_modes,
            {
                "experiment": thing(known_sensor()),
                "measured": thing(modal_parameters(), path="modes.npz"),
            },
        ),
        "check": Call(
            bp.check, {"posterior": thing(posterior()), "level": level, "bands": count(3)}
        ),
        "reach": Call(
            bp.reach,
            {name: missing[name] for name in missing if name not in ("candidates", "store")},
        ),
        "decide": Call(
            bp.decide,
            {"table": mapping(TABLE, others={"kinds": [], "rows": [3]}), "policy": thing(POLICY)},
        ),
        "Policy": Call(bp.Policy, {name: positive(value) for name, value in vars(POLICY).items()}),
        "explain": Call(bp.explain, missing),
        "explore": Call(
            bp.explore,
            {
                **{name: missing[name] for name in ("experiment", "measurement", "baseline")},
                "store": missing["store"],
                "port": Argument(0, {"text": "80", "half": 0.5, "nothing": None, "negative": -1}),
                "browser": flag(False),
            },
            lambda page: page.close(),
        ),
        "improve": Call(bp.improve, missing | {"level": level, "most_effects": count(1, "zero")}),
        "compare": Call(
            bp.compare,
            {
                "results": mapping(
                    {"a": posterior(), "b": posterior()},
                    "unknown",
                    others={"a": 3, "b": 4},
                    none={},
                )
            },
        ),
        "report": Call(
            bp.report, {"results": mapping({"a": posterior()}, "unknown", others={"a": 3}, none={})}
        ),
        "information_map": Call(bp.information_map, search | {"chunk": count(10)}),
        "place": Call(
            bp.place,
            search
            | {
                "search": thing(bp.design.Exhaustive(), "nothing"),
                "forbidden": things(
                    [(0.7, 0.8)], "nothing", swapped=[(0.8, 0.7)], flat=(0.7, 0.8), nan=[(NAN, 0.8)]
                ),
                "least_distance": number(0.0, "three", "nothing", negative=-1.0),
                "cost": mapping({"s1": 0.0}, "nothing", nan={"s1": NAN}, negative={"s1": -1.0}),
            },
        ),
        "design.tolerance_study": Call(
            bp.design.tolerance_study,
            {
                key: value
                for key, value in search.items()
                if key in ("experiment", "places", "estimator")
            }
            | {
                "factors": things((1.0, 0.5), "of others", nan=(NAN,), negative=(-1.0,), none=()),
                "progress": search["progress"],
            },
        ),
        "design.effective_independence": Call(
            bp.design.effective_independence,
            {
                "experiment": thing(uncertain()),
                "places": places,
                "modes": things([1], "nothing", "of others", zero=[0], much=[99], none=[]),
            },
        ),
        "design.lead": Call(
            bp.design.lead,
            {"learnt": thing(learnt()), "other": mapping({"s1": 1}, "nothing", much={"s1": 99})},
        ),
        "design.rivals": Call(bp.design.rivals, {"learnt": thing(learnt())}),
        "design.planned": Call(
            bp.design.planned,
            {
                "experiment": thing(log_experiment()),
                "measurement": thing(None, "nothing", "class", "list"),
                "sigma": positive(0.01, "nothing"),
            },
        ),
    }


POLICY = bp.Policy()
TABLE = {
    "kinds": ["point_mass"],
    "rows": [
        {"kinds": kinds, "log_evidence": 0.0, "squares": 60.0, "data": 60, "determined": 4.0}
        for kinds in ([], ["point_mass"])
    ],
}
"""Rows of two hypotheses, as JSON has them."""


def log_experiment():
    """Experiment that observes the logarithm of amplitudes."""
    return experiment(observe=bp.observe.LogAmplitude("velocity"), noise=bp.noise.Gaussian(0.01))


def calls_of_finite_elements():
    arrays = frame_arrays()
    stiffness, mass = arrays["stiffness"], arrays["mass"]
    asymmetric = np.triu(stiffness)
    unit = positive(1.0)
    cantilever, reading = matrices(), frame_reading()
    modes = {
        "matrices": thing(cantilever),
        "interpolation": thing(reading),
        "up_to": positive(2000.0, low=1e-6),
        "pieces": things((bp.positions.Member((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),), "nothing"),
        "members": mapping({"arm": geometric()}, "nothing", "unknown"),
        "youngs_modulus": positive(1.0),
        "density": positive(1.0),
        "nominal": things((1.0, 1.0), zero=(0.0, 1.0), one=(1.0,), nan=(NAN, 1.0)),
    }
    axes = of("things", (2,), "nothing", "of others", none=(), much=(9,), twice=(2, 2))
    fem = bp.finite_elements
    return {
        "finite_elements.Matrices": Call(
            fem.Matrices,
            {
                "stiffness": array(stiffness, asymmetric=asymmetric, negative=-stiffness),
                "mass": array(mass, negative=-mass),
                "position": array(arrays["position"]),
                "dof": array(arrays["dof"], unknown=arrays["dof"] + 50, axis=arrays["dof"] * 9),
                "node": array(np.arange(1, 10), "nothing", twice=np.ones(9, int)),
                "fixed": array(
                    arrays["fixed"],
                    "nothing",
                    "shorter",
                    outside=np.array([99]),
                    negative=np.array([-1]),
                ),
                "regions": mapping({"middle": cantilever.regions["middle"]}, "nothing"),
            },
            lambda made: made.modes(up_to=2000.0),
        ),
        "finite_elements.ModalModel": Call(
            fem.ModalModel.from_arrays,
            {
                "position": array(plane_model()["position"]),
                "shape": array(plane_model()["shape"]),
                "natural_frequency": array(
                    plane_model()["natural_frequency"], negative=[-1.0, 2.0], falling=[300.0, 120.0]
                ),
                "modal_mass": array(np.ones(2), "nothing", zero=np.zeros(2), negative=-np.ones(2)),
                "node": array(np.arange(1, 17), "nothing", twice=np.ones(16, int)),
                "damping_ratio": array(
                    np.full(2, 0.02), "nothing", percent=np.full(2, 2.0), negative=np.full(2, -0.02)
                ),
                "length_unit": unit,
                "mass_unit": unit,
            },
        ),
        "finite_elements.modes": Call(
            fem.modes,
            modes
            | {
                "soft": mapping({"foot": soft_foot()}, "nothing", "unknown"),
                "joints": mapping(loose_root(), "nothing", "unknown"),
            },
        ),
        "finite_elements.joints": Call(fem.joints, {"matrices": thing(cantilever)}),
        "finite_elements.affine": Call(
            fem.affine,
            modes
            | {
                "parameters": mapping(
                    {"middle": dist.Uniform(0.8, 1.2)},
                    negative={"middle": -1.0},
                    zero={"middle": 0.0},
                    words={"middle": "a"},
                    nan={"middle": NAN},
                ),
                "stiffness": mapping({}, "nothing"),
                "mass": mapping({}, "nothing"),
                "powers": mapping(
                    {"middle": {"middle": 1}}, "nothing", words={"middle": {"middle": "a"}}
                ),
                "ranges": mapping(
                    {"middle": (0.7, 1.3)},
                    "nothing",
                    swapped={"middle": (1.3, 0.7)},
                    nan={"middle": (NAN, 1.0)},
                ),
                "tolerance": positive(1e-2),
            },
        ),
        "finite_elements.modes_from_shapes": Call(
            fem.modes_from_shapes,
            {
                "model": thing(modal_model()),
                "interpolation": thing(plane_reading()),
                "pieces": things(
                    (bp.positions.Member((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),), "nothing"
                ),
                "youngs_modulus": positive(1.0),
                "density": positive(1.0),
                "nominal": things((1.0, 1.0), zero=(0.0, 1.0), one=(1.0,), nan=(NAN, 1.0)),
                "flexibility": array(1e-6 * np.eye(16), "nothing"),
                "regions": mapping({"left": np.eye(2)}, "nothing", shape={"left": np.eye(3)}),
                "members": mapping({"arm": np.eye(2)}, "nothing", shape={"arm": np.eye(3)}),
                "mass": number(3.0, "nothing", negative=-3.0),
            },
            lambda made: bp.Structure(made, damping=bp.damping.Modal([0.02])),
        ),
        "finite_elements.UnknownModes": Call(
            fem.UnknownModes,
            {
                "nodal": thing(plane_modes()),
                "frequency": things(
                    [110.0, 310.0],
                    negative=[-1.0, 2.0],
                    falling=[310.0, 110.0],
                    one=[110.0],
                    nan=[NAN, 310.0],
                    words=["a", "b"],
                ),
                "modal_mass": Argument(
                    [1.0, 1.0],
                    {
                        "negative": [-1.0, 1.0],
                        "zero": [0.0, 1.0],
                        "one": [1.0],
                        "text": "heavy",
                        "nan": [NAN, 1.0],
                    },
                ),
            },
            lambda made: bp.Structure(made, damping=bp.damping.Modal([0.02])),
        ),
        "finite_elements.interpolation.frame": Call(
            fem.interpolation.frame,
            {
                "model": thing(cantilever),
                "elements": array(ELEMENTS, "shorter", unknown=ELEMENTS + 90),
            },
        ),
        "finite_elements.interpolation.frame_geometric_stiffness": Call(
            fem.interpolation.frame_geometric_stiffness,
            {
                "model": thing(cantilever),
                "elements": array(ELEMENTS, "shorter", unknown=ELEMENTS + 90),
            },
        ),
        "finite_elements.interpolation.plate": Call(
            fem.interpolation.plate,
            {
                "model": thing(bending_plane()),
                "elements": array(RECTANGLES, "shorter", unknown=RECTANGLES + 90),
            },
        ),
        "finite_elements.interpolation.linear": Call(
            fem.interpolation.linear,
            {
                "model": thing(modal_model()),
                "elements": array(RECTANGLES, "shorter", unknown=RECTANGLES + 90),
                "axes": of("things", (3,), "nothing", "of others", none=(), much=(9,)),
            },
        ),
        "finite_elements.interpolation.nearest": Call(
            fem.interpolation.nearest, {"model": thing(cantilever), "axes": axes}
        ),
        "finite_elements.interpolation.scattered": Call(
            fem.interpolation.scattered, {"model": thing(cantilever), "axes": axes}
        ),
        "finite_elements.soft_supports.springs": Call(
            fem.soft_supports.springs,
            {
                "matrices": thing(cantilever),
                "rows": array(
                    np.array([0, 1]), "shorter", free=np.array([7]), outside=np.array([99])
                ),
            },
        ),
        "finite_elements.soft_supports.rotations": Call(
            fem.soft_supports.rotations,
            {
                "matrices": thing(cantilever),
                "node": count(1, much=99),
                "along": array(np.array([1.0, 0.0, 0.0]), "nothing"),
            },
        ),
        "finite_elements.soft_supports.edge": Call(
            fem.soft_supports.edge,
            {
                "matrices": thing(held_plate()),
                "start": array(np.array([0.0, 0.0, 0.0])),
                "end": array(np.array([0.0, 0.8, 0.0]), same=np.zeros(3)),
                "direction": count(3, much=9),
            },
        ),
    }


RECTANGLES = np.array([[0, 1, 5, 4], [1, 2, 6, 5]])


@functools.cache
def bending_plane():
    """Modes of a plane with rotations."""
    shape = np.full((16, 4, 2), 0.1)
    shape[:, 0] = plane_model()["shape"][:, 2]
    dof = np.column_stack([np.repeat(np.arange(1, 17), 4), np.tile([3, 4, 5, 7], 16)])
    arrays = plane_model() | {"shape": shape.reshape(64, 2), "dof": dof}
    return bp.finite_elements.ModalModel.from_arrays(**arrays)


@functools.cache
def held_plate():
    """Nodes that move across a plane on springs, held along one side."""
    position = plane_model()["position"]
    return bp.finite_elements.Matrices(
        stiffness=np.diag(np.linspace(1e3, 2e3, 16)),
        mass=0.1 * np.eye(16),
        position=position,
        dof=np.column_stack([np.arange(1, 17), np.full(16, 3)]),
        fixed=np.flatnonzero(position[:, 0] == 0),
    )


def calls_of_files():
    files = folder()
    pairs = [str(files / f"{label}.npz") for label in ("stiffness", "mass")]
    mass = array(np.ones(2), "nothing", zero=np.zeros(2), negative=-np.ones(2))
    position = {"directory": str(files)}
    uff = path(str(files / "measured.uff"), **position)
    npz = path(str(files / "modes.npz"), **position)
    back = path(str(files / "back.npz"), "missing")
    return of_registry(READERS, of_reader) | {
        "io.uff.read": Call(
            bp.io.uff.read,
            {
                "path": uff,
                "names": mapping({1: "s1", 2: "a1"}, "nothing", "unknown"),
                "require_positions": flag(False),
                "averages": count(8, "nothing"),
                "quantity": word("mobility", "nothing"),
            },
        ),
        "io.uff.write": Call(
            bp.io.uff.write,
            {
                "path": path(str(files / "back.uff"), "missing"),
                "measurement": thing(measurement()),
                "binary": flag(False),
            },
        ),
        "io.laws.read_law": Call(bp.io.read_law, {"path": path(law_file())}),
        "io.laws.write_law": Call(
            bp.io.write_law, {"path": path(str(files / "law.unv"), "missing"), "table": thing(LAW)}
        ),
        "io.uff.left_out": Call(bp.io.uff.left_out, {"path": uff}),
        "io.uff.node_numbers": Call(bp.io.uff.node_numbers, {"measurement": thing(measurement())}),
        "io.arrays.load": Call(
            bp.io.arrays.load, {"path": path(files / "modes.npz", text="modes.npz", **position)}
        ),
        "io.mapped.read_measurement": Call(
            bp.io.mapped.read_measurement, {"path": path(frf_file())}
        ),
        "io.mapped.read": Call(
            bp.io.mapped.read,
            {"path": path(frf_file()), "mapping": thing(None, "nothing", "class")},
        ),
        **calls_of_time_records(),
        **calls_of_ansys(),
        "io.abaqus.read_matrices": Call(
            bp.io.abaqus.read_matrices,
            {
                "stiffness": path(abaqus_files()[0], **position),
                "mass": path(abaqus_files()[1], **position),
                "length_unit": positive(1.0),
                "mass_unit": positive(1.0),
            },
        ),
        "io.uff.read_modes": Call(bp.io.uff.read_modes, {"path": path(modes_file(), **position)}),
        "io.modal_parameters.read": Call(
            bp.io.modal_parameters.read,
            {
                "path": path(modes_table(files)),
                "frequency_deviation": positive(0.01, "nothing"),
                "damping_deviation": positive(0.01, "nothing"),
                "shape_deviation": positive(0.01, "nothing"),
                "names": mapping({1: "s1"}, "nothing", "unknown", "to others"),
            },
        ),
        "io.modal_parameters.write": Call(
            bp.io.modal_parameters.write,
            {
                "modal_parameters": thing(modal_parameters()),
                "path": path(str(files / "m.csv"), "missing"),
            },
        ),
        "io.modal_parameters.of_pyoma2": Call(
            bp.io.modal_parameters.of_pyoma2,
            {
                "result": thing(pyoma2()),
                "sensors": things(["s1"], "text", none=[], blank=[" "]),
                "number": of("things", [1], "nothing", "of others", none=[], half=[0.5]),
            },
        ),
        "io.npz_modes.read": Call(bp.io.npz_modes.read, {"path": npz, "modal_mass": mass}),
        "io.npz_modes.read_nodes": Call(bp.io.npz_modes.read_nodes, {"path": path(nodes_file())}),
        "io.npz_modes.write": Call(
            bp.io.npz_modes.write, {"path": back, "model": thing(modal_model())}
        ),
        "io.netcdf.read": Call(
            bp.io.netcdf.read, {"path": path(str(files / "result.nc"), **position)}
        ),
        "io.netcdf.write": Call(
            bp.io.netcdf.write,
            {"result": thing(posterior()), "path": path(str(files / "b.nc"), "missing")},
        ),
        "io.matrix_files.read": Call(
            bp.io.matrix_files.read,
            {
                "stiffness": path(pairs[0], **position),
                "mass": path(pairs[1], **position),
                "regions": mapping({"all": pairs[0]}, "nothing"),
            },
        ),
        "io.mesh.read": Call(
            bp.io.mesh.read,
            {
                "path": path(str(files / "part.vtk"), **position),
                "length_unit": positive(1.0, "nothing"),
            },
        ),
        "io.case.read": Call(bp.io.case.read, {"folder": path(str(case_folder()), **position)}),
        "io.model.read": Call(bp.io.model.read, {"path": path(str(model_file()), **position)}),
        "io.formats.read_measurement": Call(bp.io.read_measurement, {"path": uff}),
        "io.formats.read_modes": Call(bp.io.read_modes, {"path": npz}),
        "io.formats.read_matrices": Call(
            bp.io.read_matrices, {"path": path(pairs[0], **position), "others": path(pairs[1])}
        ),
        "io.nastran.read_modes": Call(
            bp.io.nastran.read_modes,
            {
                "path": path(nastran_modes(), **position),
                "modal_mass": Argument(1.0, {"zero": 0.0, "negative": -1.0, "text": "heavy"}),
                "length_unit": positive(1.0),
                "mass_unit": positive(1.0),
            },
        ),
        "io.nastran.read_matrices": Call(
            bp.io.nastran.read_matrices,
            {
                "path": path(nastran_matrices(), **position),
                "stiffness": word("KAA"),
                "mass": word("MAA"),
            },
        ),
    }


def calls_of_time_records():
    random = np.random.default_rng(0)
    force = random.standard_normal(4096)
    records = bp.io.time_records
    arguments = {
        "excitation": thing(records.Continuous(1.0)),
        "quantity": word("accelerance"),
        "actuator": name("a1", "dot"),
        "sensors": things(["s1"], "text", "nothing", twice=["s1", "s1"]),
        "band": of(
            "things", (20.0, 100.0), "nothing", "of others", swapped=(100.0, 20.0), nan=(NAN, 100.0)
        ),
        "estimator": word("H1"),
    }
    once = measurement()
    return {
        "io.time_records.frf": Call(
            records.frf,
            {
                "force": array(force),
                "response": array(force[None]),
                "rate": positive(512.0),
                **arguments,
            },
        ),
        "io.time_records.Continuous": Call(
            records.Continuous,
            {
                "segment": positive(1.0),
                "overlap": number(0.5, negative=-0.5, one=1.0),
                "window": word("hann", "number"),
            },
            lambda excitation: records.frf(
                force,
                force[None],
                512.0,
                excitation=excitation,
                quantity="accelerance",
                actuator="a1",
                sensors=["s1"],
            ),
        ),
        "io.time_records.Impacts": Call(
            records.Impacts,
            {
                key: positive(right, "nothing")
                for key, right in (
                    ("duration", 1.0),
                    ("before", 0.01),
                    ("trigger", 0.5),
                    ("force_window", 0.1),
                    ("time_constant", 0.5),
                )
            },
        ),
        "io.time_records.merged": Call(
            records.merged, {"measurements": things([once], none=[], bare=once)}
        ),
        "io.time_records.Signal": Call(
            records.Signal,
            {
                "source": of("name", "acc", "empty", "dot"),
                "unit": word("V", newtons="N V"),
                "sensitivity": of("word", "100 mV/g", zero="0 mV/g", volts="100 mV"),
            },
        ),
        "io.time_records.Recording": Call(
            records.Recording,
            {
                "rate": positive(512.0),
                "samples": mapping(
                    {"a1": force, "s1": force},
                    "unknown",
                    none={},
                    nan={"a1": force, "s1": NAN * force},
                    lengths={"a1": force, "s1": force[1:]},
                    table={"a1": force, "s1": force[:, None]},
                ),
                "quantity": mapping(
                    {"a1": "force", "s1": "acceleration"},
                    other={"a1": "force", "s1": "temperature"},
                    missing={"a1": "force"},
                ),
            },
            lambda made: records.frf_of(made, "a1", excitation=records.Continuous(1.0)),
        ),
        "io.time_records.frf_of": Call(
            records.frf_of,
            {
                "recordings": things(recording(), "of others", none=[], others=[3]),
                "actuator": name("a1", "dot", "list", unknown="a2", sensor="s1", list=["a1"]),
                "excitation": thing(records.Continuous(1.0)),
            },
        ),
        "io.time_records.read": Call(
            records.read,
            {
                "path": path(hits_file(), directory=str(folder())),
                "channels": mapping(
                    {"a1": records.Signal("hammer", "N"), "s1": records.Signal("acc", "g")},
                    absent={"a1": records.Signal("microphone", "N")},
                    none={},
                ),
                "rate": positive(512.0, "nothing"),
                "time": of("name", None, "nothing", absent="clock"),
            },
        ),
    }


def recording():
    """A recording of a force and a motion."""
    force = np.random.default_rng(0).standard_normal(4096)
    quantity = {"a1": "force", "s1": "acceleration"}
    return bp.time_records.Recording(512.0, {"a1": force, "s1": force}, quantity)


@functools.cache
def hits_file():
    """Time records in a file of arrays."""
    path = folder() / "hits.npz"
    np.savez(path, hammer=np.arange(64.0), acc=np.arange(64.0))
    return str(path)


@functools.cache
def abaqus_files():
    """Stiffness and mass of one degree of freedom, as Abaqus writes them."""
    paths = [folder() / f"{label}.mtx" for label in ("stiffness", "mass")]
    for path, value in zip(paths, (2000.0, 3.0), strict=True):
        path.write_text(f"1,1,1,1,{value}\n")
    return [str(path) for path in paths]


def calls_of_ansys():
    """Calls with the example files of the library that reads them, where that is installed."""
    if importlib.util.find_spec("ansys") is None:
        return {}
    import ansys.mapdl.reader.examples

    files = Path(ansys.mapdl.reader.examples.__file__).parent
    full = path(str(files / "file.full"), directory=str(files))
    units = {"length_unit": positive(1.0, "nothing"), "mass_unit": positive(1.0, "nothing")}
    return {
        "io.ansys.read_matrices": Call(bp.io.ansys.read_matrices, {"path": full, **units}),
    }


def calls_of_plots():
    plots = bp.plots
    truth = {"truth": mapping({}, "nothing", "unknown", words={"structure.damping.ratio": "a"})}
    result = {"result": thing(posterior())}
    return {
        "plots.ledger.suspicion": Call(
            plots.ledger.suspicion,
            {
                "result": thing(ledger()),
                "experiment": thing(known_sensor(), "nothing"),
                "places": mapping({"mass": 0.4}, "nothing", "unknown"),
                **AXES,
            },
        ),
        "plots.reach.curves": Call(
            plots.reach.curves,
            {
                "reach": thing(reached()),
                "experiment": thing(known_sensor(), "nothing"),
                **AXES,
            },
        ),
        "plots.reach.law": Call(
            plots.reach.law,
            {
                "reach": thing(reached()),
                "acts_on": word("displacement", "nothing", slope="slope"),
                **AXES,
            },
        ),
        "plots.ledger.probabilities": Call(
            plots.ledger.probabilities, {"result": thing(ledger()), **AX}
        ),
        "plots.ledger.error_falls": Call(
            plots.ledger.error_falls, {"ledger": thing(ledger()), **AX}
        ),
        "plots.ledger.before_and_after_pages": Call(
            plots.ledger.before_and_after_pages, {"result": mapping(fitted())}
        ),
        "plots.ledger.before_and_after": Call(
            plots.ledger.before_and_after, {"result": mapping(fitted()), **AXES}
        ),
        "plots.modes.compared": Call(
            plots.modes.compared,
            {
                "result": mapping(
                    {"as given": modes_beside_a_model()}, empty={}, **{"of frfs": fitted()}
                ),
                **AXES,
            },
        ),
        "plots.misfit.residual_map": Call(
            plots.misfit.residual_map, {"misfit": thing(misfit()), **AXES}
        ),
        "plots.misfit.residual_maps": Call(
            plots.misfit.residual_maps, {"result": mapping(fitted()), **AXES}
        ),
        "plots.misfit.discrepancy": Call(
            plots.misfit.discrepancy, {"misfit": thing(misfit()), **AXES}
        ),
        "plots.misfit.discrepancy_pages": Call(
            plots.misfit.discrepancy_pages, {"misfit": thing(misfit())}
        ),
        "plots.placement.information": Call(
            plots.placement.information, {"learnt": thing(learnt()), **AXES}
        ),
        "plots.placement.tolerances": Call(
            plots.placement.tolerances, {"study": thing(study()), **AXES}
        ),
        "plots.placement.placements": Call(
            plots.placement.placements, {"best": thing(best()), **AX}
        ),
        "plots.posterior.measured_against_band": Call(
            plots.posterior.measured_against_band, {**result, **AXES}
        ),
        "plots.posterior.measured_against_band_pages": Call(
            plots.posterior.measured_against_band_pages, result
        ),
        "plots.posterior.intervals": Call(plots.posterior.intervals, {**result, **truth, **AXES}),
        "plots.posterior.response_band": Call(
            plots.posterior.response_band,
            {"simulated": thing(simulated()), "reference": thing(None, "nothing", "class"), **AXES},
        ),
        "plots.posterior.response_band_pages": Call(
            plots.posterior.response_band_pages,
            {"simulated": thing(simulated()), "reference": thing(None, "nothing", "class")},
        ),
        "plots.posterior.parameters": Call(plots.posterior.parameters, {**result, **truth, **AXES}),
        "plots.posterior.placement": Call(
            plots.posterior.placement, {"result": thing(placed_posterior()), **truth, **AXES}
        ),
        "plots.posterior.pair": Call(
            plots.posterior.pair,
            {
                "result": thing(placed_posterior()),
                "first": word("structure.damping.ratio"),
                "second": word("sensor.s1.position"),
                **truth,
                **AX,
            },
        ),
        "plots.posterior.methods": Call(
            plots.posterior.methods,
            {"results": mapping({"a": posterior()}, others={"a": 3}, none={}), **truth, **AXES},
        ),
        "plots.measurement.pages": Call(
            plots.measurement.pages, {"measurement": thing(measurement())}
        ),
        "plots.report.Report": Call(
            plots.report.Report,
            {
                "title": name("Frame", "empty", "dot"),
                "chapters": things([], "of others", nothing=None, words=["Monday"]),
            },
            lambda report: report.write(folder() / "page.html"),
        ),
        "plots.report.write_report": Call(
            plots.report.write_report,
            {
                "folder": path(str(run_folder()), empty=str(empty_folder())),
                "to": path(str(folder() / "of_run.html"), "nothing", "missing", list=["a"]),
                "label": name("Monday", "nothing", "empty", "dot"),
                "title": name("Frame", "nothing", "empty", "dot"),
                "author": name("A. Person", "nothing", "empty", "dot"),
                "client": name("City", "nothing", "empty", "dot"),
                "photo": path(photograph(), "nothing"),
                "comments": things(["Torque was 8 N m."], text="Torque was 8 N m."),
            },
        ),
        "plots.structure.experiment": Call(
            plots.structure.experiment, {"experiment": thing(known_sensor()), **AX}
        ),
    }


@functools.cache
def run_folder():
    """Folder of a run of which a ledger is left."""
    path = folder() / "run"
    path.mkdir()
    ledger().write(path / "ledger.json")
    return path


@functools.cache
def empty_folder():
    """Folder without results."""
    path = folder() / "empty"
    path.mkdir()
    return path


@functools.cache
def misfit():
    """Check of a posterior."""
    return bp.check(posterior())


@functools.cache
def simulated():
    """Simulated responses."""
    return bp.simulate(known_sensor(), draws=5)


@functools.cache
def placed_posterior():
    """Posterior with an uncertain place."""
    return bp.infer(uncertain(), uncertain().nominal_measurement(), engine=MAP)


@functools.cache
def modes_file():
    """Universal file of modes."""
    from tests.io.test_properties import MODES

    path = folder() / "modes.unv"
    path.write_bytes(MODES)
    return str(path)


@functools.cache
def nodes_file():
    """Nodes of a model."""
    path = folder() / "nodes.npz"
    model = modal_model()
    np.savez(path, position=model.position, node=model.node, dof=model.dof)
    return str(path)


@functools.cache
def frf_file():
    """FRFs in a file of arrays."""
    path = folder() / "frf.npz"
    np.savez(path, frf=np.ones((1, 1, 12), complex), frequency=LINES)
    path.with_suffix(".toml").write_text(
        'frf = { array = "frf", axes = ["sensor", "actuator", "frequency"], unit = "m/s^2/N" }\n'
        'frequency = { array = "frequency", unit = "Hz" }\n'
        'sensors = ["s1"]\nactuators = ["a1"]\nfile = "frf.npz"\n'
    )
    return str(path.with_suffix(".toml"))


@functools.cache
def nastran_modes():
    """Modes in an OUTPUT2 file, an example of the library that reads it."""
    import pyyeti

    return str(Path(pyyeti.__file__).parent / "tests" / "nas2cam_extseout" / "full.op2")


@functools.cache
def nastran_matrices():
    """Matrices in an OUTPUT4 file."""
    with np.printoptions():  # it changes how all arrays are printed
        from pyyeti.nastran import op4

    path = str(folder() / "matrices.op4")
    op4.write(path, {"KAA": np.diag([2.0, 3.0]), "MAA": np.eye(2)})
    return path


@functools.cache
def case_folder():
    """Folder of a case."""
    from tests.io.test_properties import CASE, bar_measurement

    path = folder() / "case"
    path.mkdir()
    (path / "case.json").write_text(json.dumps(CASE))
    bp.io.uff.write(path / "measured.uff", bar_measurement())
    return path


@functools.cache
def model_file():
    """A model file."""
    from tests.cli.studies import EXPERIMENT

    path = folder() / "study.py"
    path.write_text(EXPERIMENT)
    return path


GROUPS = {
    "experiment": calls_of_experiment,
    "laws": calls_of_laws,
    "positions": calls_of_positions,
    "effects": calls_of_effects,
    "methods": calls_of_methods,
    "verbs": calls_of_verbs,
    "finite elements": calls_of_finite_elements,
    "files": calls_of_files,
    "plots": calls_of_plots,
}
"""Public calls, by what they are about."""


def answer(call, **changed):
    """Kind and words of what a call raises; both empty where it passes."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            call.make(**changed)
    except Exception as error:  # noqa: BLE001, what is raised is what is asked
        ours = isinstance(error, PackageError | FileNotFoundError | IsADirectoryError)
        kind = "ours" if ours else type(error).__name__
        return kind, " ".join(str(error).split())
    return "", ""


def answers(calls):
    """What calls say, the right one first, by name, argument and mistake."""
    sentences = {}
    for label, call in calls.items():
        if call.has_right:
            sentences[f"{label}()"] = answer(call)
        for key, argument in call.arguments.items():
            for wrong, value in argument.wrong.items():
                sentences[f"{label}({key}: {wrong})"] = answer(call, **{key: value})
    return sentences


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    mpl.use("agg")
    calls = [item for group in sys.argv[1:] for item in GROUPS[group]().items()]
    assert len(dict(calls)) == len(calls), "two calls share a name"
    json.dump(answers(dict(calls)), sys.stdout)
