"""A real aeroplane-like structure whose three accelerometers sat nobody knows where.

A hammer test at 74 nodes of a finite element model that came with mode shapes alone. Unknown:
natural frequencies, damping, modal masses, where the accelerometers were, and from which side each
hit came. Shapes 1 to 6 are those of the structure, once modes 3, 4 and 5, close in frequency, are
turned into each other: to 2 to 8 % of what the hits excite. Those above are not, and `bp.check`
says so: treated alike, modes 1 to 6 pass and modes 7 to 9 miss by ten times as much.

Damping is what the flanks tell. That of mode 6 is a fifth less than what its top tells: 0.00085
against 0.00102; its line is not quite that of viscous damping, nor the same from hit to hit. The
mass of the whole, 39 to 50 kg by the lines chosen, is not well known.

The measurement is not part of this project. Give the folder of `measured.npz` and `modes.npz`:
`PLANE_DATA=folder bayes-placement update models/plane.py --engine map`.
"""

import functools
import os
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
from numpyro.distributions.transforms import AffineTransform
from scipy.spatial import KDTree

import bayes_placement as bp
from bayes_placement.criticism.check import correlation
from bayes_placement.io.model import Study

FOLDER = "PLANE_DATA"
"""Environment variable that names the folder of the measurement."""

RESONANCES = np.array(
    [18.84, 40.12, 87.85, 89.65, 97.07, 105.20, 118.0, 125.2, 125.6, 129.9, 135.3, 143.4, 166.3]
)
"""Measured resonances [Hz]."""

FLANK = np.array([0.375, 0.75] + [0.375] * 7)
"""How far to either side of each resonance it is compared [Hz]: tops drift from hit to hit."""

PAIRED = 6
"""Modes whose measured shapes the model has."""

MISS = np.array([0.035, 0.08, 0.08, 0.05, 0.065, 0.02])
"""Model error about resonances 1 to 6 over the level there [1], so that chi2 is about 1."""

CLOSE = ((3, 4), (4, 5), (7, 8), (8, 9))
"""Modes near enough in frequency to be turned into each other."""

AXES = {"wing": 3, "tail": 3, "fin": 1}
"""Axis along which each accelerometer reads: across the plate on which it sits."""

PLATES = {
    "wing": ((0.45, 0.75), (0.75, 0.85), 0.0),
    "tail": ((0.07, 0.25), (0.0, 0.1), 0.075),
    "fin": (0.0, (0.0, 0.1), (0.17, 0.35)),
}
"""Region of each accelerometer along x, y and z [m]."""

RIGID = np.array([16.0, 22.0, 25.0, 28.0])
"""Lines at which the structure moves as a rigid body as much as in a mode [Hz]."""

RIGID_BODY = 3
"""Rigid-body modes that these hits excite: heave, pitch and roll."""

MASS, SPREAD = 40.0, 0.7
"""Prior of what each mode sees of the mass: a median [kg] and a deviation of the log."""

engine = bp.engines.MAP(starts=1, draws=256)
"""Three starts end within two units of log density of each other."""


class Plane(NamedTuple):
    """What was handed over: the hammer test, and nodes with mode shapes."""

    frequency: np.ndarray
    accelerance: np.ndarray
    coherence: np.ndarray
    hit: np.ndarray
    axis: np.ndarray
    node: np.ndarray
    shape: np.ndarray

    def shape_at_hits(self):
        """Return the mode shapes at the hits, along the positive axis, [mode, hit]."""
        nearest = KDTree(self.node).query(self.hit)[1]
        return self.shape[:, nearest, self.axis - 1]


def read(folder=None):
    """Read the measurement from a folder, by default that in the environment."""
    folder = Path(folder or os.environ.get(FOLDER) or "no folder")
    files = [folder / name for name in ("measured.npz", "modes.npz")]
    if not all(one.is_file() for one in files):
        raise FileNotFoundError(
            f"{folder} was given for the measurement of models/plane.py; a folder that holds "
            "measured.npz and modes.npz is needed, since the data are not part of this project. "
            f"Name it: {FOLDER}=folder bayes-placement update models/plane.py --engine map."
        )
    measured, modes = (np.load(one) for one in files)
    return Plane(
        frequency=measured["frequency_hz"],
        accelerance=measured["frf"].astype(complex),
        coherence=measured["coherence"].astype(float),
        hit=measured["impact_position_m"],
        axis=measured["impact_axis"],
        node=modes["node_position_m"].astype(float),
        shape=modes["shape"].astype(float),
    )


def sound(plane):
    """Tell which FRFs can be used, [sensor, hit].

    A hit near an accelerometer overloads it: its FRF is wrong, and its coherence low at nearly all
    lines. A record that repeats an earlier one is of no other hit.
    """
    band = (plane.frequency > 14) & (plane.frequency < 107)
    coherent = np.median(plane.coherence[..., band], axis=-1) > 0.99
    first = np.unique(plane.accelerance, axis=1, return_index=True)[1]
    return coherent & np.isin(np.arange(len(plane.hit)), first)


def signs(plane):
    """Sign of each hit along its axis, and how unanimous the votes for it are, from 0 to 1.

    About a resonance the imaginary part of an accelerance goes with the shape at the sensor, the
    shape at the hit and the sign. Times the shape at the hit, whose place is known, it is a vote on
    the sign, up to one sign for each sensor and mode: 18 lists of votes, which the first
    eigenvector of their products weighs against each other. The first hit is along its axis.

    What is inferred cannot be biased by it: where the sensors sat plays no part, and a sign that
    all votes agree on has no rival whose probability a choice could drop.
    """
    votes = []
    for mode, shape in enumerate(plane.shape_at_hits()[:PAIRED]):
        near = np.abs(plane.frequency - RESONANCES[mode]) < 1.0
        peak = np.sum(np.imag(plane.accelerance[..., near]), axis=-1)
        vote = np.where(sound(plane), peak, 0.0) * shape
        votes.extend(vote / np.linalg.norm(vote, axis=1, keepdims=True))
    leading = np.linalg.eigh(np.transpose(votes) @ votes)[1][:, -1]
    agreed = np.sign(votes @ leading)[:, None] * votes
    total, most = agreed.sum(axis=0), np.abs(agreed).sum(axis=0)
    sign = np.where(total * total[0] < 0, -1, 1)
    return sign, np.abs(total) / np.where(most > 0, most, np.inf)


def measured(plane):
    """Return the FRFs that can be used, each hit with its sign as the direction of its channel."""
    usable = sound(plane)[..., None]
    directions = plane.axis * signs(plane)[0]
    return bp.Measurement.from_arrays(
        np.where(usable, plane.accelerance, np.nan)[..., 1:],
        plane.frequency[1:],
        sensors=[bp.Channel(name, axis) for name, axis in AXES.items()],
        actuators=[bp.Channel(str(n), int(axis)) for n, axis in enumerate(directions, start=1)],
        quantity="accelerance",
        coherence=np.where(usable, np.clip(plane.coherence, 1e-3, 1 - 1e-4), np.nan)[..., 1:],
        averages=2,  # not recorded: the fewest that tell a coherence, and so the most error
    )


class Aeroplane(bp.finite_elements.DerivedNodalModes):
    """Known shapes of unknown frequencies and masses, those of close modes turned.

    Parameters
    ----------
    nodal
        The shapes, those of the rigid body first.
    frequency
        Natural frequency of each elastic mode [Hz].
    modal_mass
        Modal mass of each mode [kg].
    angle
        Angle by which each of the pairs is turned [rad]. That is what a small error of the
        stiffness does to modes of nearly the same frequency.
    pairs
        Columns of the shapes that are turned into each other.
    """

    nodal: bp.finite_elements.NodalModes
    frequency: Any
    modal_mass: Any
    angle: Any
    pairs: tuple = eqx.field(static=True)
    axes: tuple = eqx.field(static=True, default=(1, 2, 3))
    rigid_body_modes: int = eqx.field(static=True, default=RIGID_BODY)

    def angular_frequency(self):
        """Natural angular frequencies [rad/s]."""
        return 2 * np.pi * jnp.concatenate([jnp.zeros(RIGID_BODY), self.frequency])

    def shapes(self, position, derivative=0):
        """Mass-normalised mode shapes [kg^-1/2], which turned shapes stay."""
        shapes = self.nodal.shapes(position, derivative) / jnp.sqrt(self.modal_mass)
        for number, pair in enumerate(self.pairs):
            cosine, sine = jnp.cos(self.angle[number]), jnp.sin(self.angle[number])
            turn = jnp.array([[cosine, -sine], [sine, cosine]])
            shapes = shapes.at[:, pair].set(shapes[:, pair] @ turn)
        return shapes

    def static_flexibility(self, position, other):
        """Nothing is known of modes left out."""
        return


class InexactShapes(bp.effects.InstrumentEffect):
    """What a sensor reads of each mode is off by a factor, since the shapes are not exact.

    Parameters
    ----------
    error
        Error for each sensor and mode [1].
    about
        Whether a line is about the resonance of a mode, [mode, line].
    """

    absent: ClassVar = ("error", 0.0)
    error: Any
    about: np.ndarray
    name: str = eqx.field(static=True, default="inexact_shapes", kw_only=True)

    def recorded(self, frf, omega, channels):
        """FRF multiplied by 1 + error about each resonance."""
        return frf * (1 + jnp.asarray(self.error) @ self.about)[:, None]

    @classmethod
    def suggest(cls, experiment):
        """Nothing: it belongs to this study."""
        return []


def structure(plane, modes):
    """Return the structure: shapes known, frequency, mass and damping of each mode unknown."""
    shape = np.concatenate([rigid_body_shapes(plane.node), plane.shape[:modes]])
    kept, resonances = regions(plane), RESONANCES[:modes]
    model = bp.finite_elements.ModalModel.from_arrays(
        position=plane.node[kept],
        shape=np.moveaxis(shape[:, kept], 0, -1),
        natural_frequency=np.concatenate([np.zeros(RIGID_BODY), resonances]),
        modal_mass=1,
    )
    even = MASS * np.mean(np.sum(shape**2, axis=2), axis=1)  # if all nodes weighed the same
    pairs = tuple((RIGID_BODY + i - 1, RIGID_BODY + j - 1) for i, j in CLOSE if j <= modes)
    aeroplane = Aeroplane(
        bp.finite_elements.modes_from_shapes(
            model, bp.finite_elements.interpolation.scattered(model)
        ),
        frequency=dist.Uniform(resonances - 0.15, resonances + 0.15).to_event(1),
        modal_mass=dist.LogNormal(np.log(even), SPREAD).to_event(1),
        angle=dist.Uniform(-0.5, 0.5).expand((len(pairs),)).to_event(1),
        pairs=pairs,
    )
    ratio = dist.LogUniform(3e-4, 1e-2).expand((modes,)).to_event(1)
    return bp.Structure(aeroplane, damping=bp.damping.Modal(ratio))


def rigid_body_shapes(position):
    """Heave along z and rotations about x and y, all that these hits excite, [mode, node, axis]."""
    offset = position - position.mean(axis=0)
    heave = np.broadcast_to([0.0, 0.0, 1.0], offset.shape)
    return np.stack([heave, *(np.cross(axis, offset) for axis in np.eye(3)[:2])])


def regions(plane):
    """Nodes about the hits and in the regions of the sensors: the others are never read."""
    kept = np.zeros(len(plane.node), dtype=bool)
    kept[np.concatenate(KDTree(plane.node).query_ball_point(plane.hit, 0.03)).astype(int)] = True
    for sides in PLATES.values():
        low, high = np.transpose([np.broadcast_to(side, 2) for side in sides])
        kept |= np.all((plane.node > low - 0.03) & (plane.node < high + 0.03), axis=1)
    return kept


def lines(modes):
    """Lines [Hz] on the flanks of the resonances, eight to a hertz."""
    flanks = RESONANCES[:modes, None] + FLANK[:modes, None] * [-1, 1]
    return np.unique(np.round(8 * flanks)) / 8


def about(frequency):
    """Tell which resonance a line is about, [mode, line]."""
    apart = np.abs(frequency - RESONANCES[:, None])
    return (apart < 1.5) & (apart == apart.min(axis=0))


def level(plane, frequency):
    """Root mean square of the FRFs of all hits [(m/s2)/N], [line].

    Shapes err as much next to a node of the mode as elsewhere. For some modes the hits that can be
    used are next to one, so that the mean over these is taken to all hits by the shapes.
    """
    usable, shape = sound(plane), plane.shape_at_hits() ** 2
    seen = np.stack([shape[:, one].mean(axis=1) for one in usable])
    near = about(frequency)
    more = np.where(near.any(axis=0), shape.mean(axis=1) / seen @ near, 1.0)
    square = np.nanmean(np.abs(measured(plane).lines(frequency).frf) ** 2, axis=1)
    return np.sqrt(np.mean(square * more, axis=0))


def within(low, high):
    """Return the law of a coordinate [m] that is the less likely the nearer to an edge."""
    stretch = AffineTransform(low, high - low, domain=dist.constraints.unit_interval)
    return dist.TransformedDistribution(dist.Beta(2.0, 2.0), stretch)


def sensor(name, sides):
    """Return an accelerometer somewhere on its plate."""
    place = bp.positions.places.Cartesian(*(within(*one) if np.ndim(one) else one for one in sides))
    middle = tuple(float(np.mean(one)) for one in sides)
    return bp.Sensor(name, place, directions=(AXES[name],), recorded=middle)


def experiment_of(plane, frequency, modes, miss):
    """Return the experiment at some lines [Hz], the sensors anywhere on their plates.

    The model error is a share of the level of each line [1]. Neighbouring hits err alike, so that
    every second is enough.
    """
    size = miss * level(plane, frequency) / np.sqrt(2)  # of the real part and of the imaginary
    hits = list(enumerate(zip(plane.hit, plane.axis, strict=True), start=1))
    whole = bp.Experiment(
        structure(plane, modes),
        sensors=[sensor(name, sides) for name, sides in PLATES.items()],
        actuators=[
            bp.Actuator(str(n), tuple(map(float, at)), directions=(int(axis),))
            for n, (at, axis) in hits[::2]
        ],
        frequency=frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(size[None, None]),
    )
    error = dist.Normal(np.zeros((len(PLATES), modes)), 0.1).to_event(2)
    return whole + InexactShapes(error, about(frequency)[:modes])


def below(plane):
    """Return the experiment on modes 1 to 6."""
    frequency = np.union1d(RIGID, lines(PAIRED))
    near = about(frequency)[:PAIRED]
    miss = np.where(near.any(axis=0), MISS @ near, MISS.max())
    return experiment_of(plane, frequency, PAIRED, miss)


def beyond(plane, posterior):
    """Return the experiment on modes 1 to 9, all treated alike.

    Sensors are where they were found, and the model error is the greatest of modes 1 to 6, so that
    bands which `bp.check` passes are a control for those which it does not.
    """
    drawn = posterior["posterior"].to_dataset()
    places = {
        name: float(draws.mean())
        for name, draws in drawn.items()
        if draws.attrs["owner"].startswith("sensor ")
    }
    modes = PAIRED + 3
    return experiment_of(plane, lines(modes), modes, MISS.max()).fix(places)


def assurance(plane):
    """Modal assurance criterion of each measured deflection with each shape, [resonance, mode].

    Over all pairs of sensor and hit that can be used, each sensor in a scale of its own: what is
    explained of the imaginary parts about a resonance. Shapes 1 to 6 have 0.86 to 1.00 with their
    own resonance, 7 to 9 less than 0.1, and no shape has more than 0.82 with resonances 7 to 10.
    The hits that can be used do not tell shapes 6, 11 and 13 apart.
    """
    sign, usable, shape = signs(plane)[0], sound(plane), plane.shape_at_hits()
    found = np.zeros((len(RESONANCES), len(shape)))
    for number, resonance in enumerate(RESONANCES):
        near = np.abs(plane.frequency - resonance) < 0.3
        peak = sign * np.sum(np.imag(plane.accelerance[..., near]), axis=-1)
        parts = [(peak[n, one, None], shape[:, one].T) for n, one in enumerate(usable)]
        criterion = [correlation.mac(measured, computed)[0] for measured, computed in parts]
        size = [np.sum(measured**2) for measured, _ in parts]
        found[number] = np.average(criterion, axis=0, weights=size)
    return found


def by_mode(misfit):
    """Chi2 per datum about each resonance, [mode]."""
    square = np.nanmean(misfit.response["misfit"].values ** 2, axis=(0, 1))
    near = about(misfit.response["frequency"].values)
    return np.array([np.mean(square[one]) for one in near if one.any()])


@functools.cache
def study(folder=None):
    """Return experiment, measurement and engine; for the folder of the data see `read`."""
    plane = read(folder)
    return Study(below(plane), measured(plane), engine, {})


def __getattr__(name):
    """Read the data once somebody asks for what follows from them, the command line for one."""
    if name in ("experiment", "measurement"):
        return getattr(study(), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
