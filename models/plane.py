"""A measured aeroplane-like structure with three accelerometers at unknown positions.

A hammer test at 74 nodes of a finite element model of which only mode shapes were given. Unknown:
natural frequencies, damping, modal masses, the positions of the accelerometers, the sign of each
impact, and how much shapes 1 to 6 err, once modes 3, 4 and 5, which are close in frequency, are
rotated into each other: by 2 to 3 %. What is left near each resonance, 1 to 6 % of the level there,
is inferred too. Shapes above mode 6 are not those of the structure: if they err as much as those
below, 16, 95 and 99 % of the level are left near resonances 7 to 9, and `bp.check` fails there.

Between resonances neighbouring lines err alike, most of all on the fin, and `bp.check` says so: the
modes above the band, whose flexibility shows there, are not known.

Damping is identified from the flanks of the resonances. That of mode 6 is a fifth less than by its
peak, 0.00085 instead of 0.00102: its resonance is not exactly that of viscous damping, and differs
between impacts. The total mass is not well identified.

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
from scipy.spatial import KDTree

import bayes_placement as bp
from bayes_placement.io.model import Study

FOLDER = "PLANE_DATA"
"""Environment variable that names the folder of the measurement."""

RESONANCES = np.array(
    [18.84, 40.12, 87.85, 89.65, 97.07, 105.20, 118.0, 125.2, 125.6, 129.9, 135.3, 143.4, 166.3]
)
"""Measured resonances [Hz]."""

FLANK = np.array([0.375, 0.75] + [0.375] * 7)
"""Distance from each resonance at which it is compared [Hz]: peaks drift between impacts."""

PAIRED = 6
"""Number of modes whose shapes in the model are those of the structure."""

UNEXPLAINED = dist.LogUniform(1e-3, 1.0)
"""Prior of what the model does not explain near a resonance, relative to the level there [1]."""

CLOSE = ((3, 4), (4, 5), (7, 8), (8, 9))
"""Pairs of modes close enough in frequency to be rotated into each other."""

AXES = {"wing": 3, "tail": 3, "fin": 1}
"""Axis of each accelerometer: normal to the plate on which it is mounted."""

PLATES = {
    "wing": ((0.45, 0.75), (0.75, 0.85), 0.0),
    "tail": ((0.07, 0.25), (0.0, 0.1), 0.075),
    "fin": (0.0, (0.0, 0.1), (0.17, 0.35)),
}
"""Region of each accelerometer along x, y and z [m]."""

SHAPES = bp.model_error.Embedded(frequency=None, damping=None, gain=None, stiffness_and_mass=None)
"""Natural frequencies, damping and masses of modes are unknown; it is the shapes that err."""

RIGID = np.array([16.0, 22.0, 25.0, 28.0])
"""Lines at which rigid-body motion is as large as that of an elastic mode [Hz]."""

RIGID_BODY = 3
"""Number of rigid-body modes that the impacts excite: heave, pitch and roll."""

MASS, SPREAD = 40.0, 0.7
"""Prior of the mass on which modal masses are based: median [kg], standard deviation of the log."""

engine = bp.engines.MAP(starts=4, draws=256)
"""Four starts: above mode 6, where the model fails, a single one ends at a lesser maximum."""


class Plane(NamedTuple):
    """The data: the hammer test, and nodes with mode shapes."""

    frequency: np.ndarray
    accelerance: np.ndarray
    coherence: np.ndarray
    hit: np.ndarray
    axis: np.ndarray
    node: np.ndarray
    shape: np.ndarray

    def shape_at_hits(self):
        """Mode shapes at the impacts, along the positive axis, [mode, hit]."""
        nearest = KDTree(self.node).query(self.hit)[1]
        return self.shape[:, nearest, self.axis - 1]


def read(folder=None):
    """Read the measurement from a folder, by default that in the environment."""
    folder = Path(folder or os.environ.get(FOLDER) or "no folder")
    files = [folder / name for name in ("measured.npz", "modes.npz")]
    if not all(file.is_file() for file in files):
        raise FileNotFoundError(
            f"{folder} was given for the measurement of models/plane.py; a folder that holds "
            "measured.npz and modes.npz is needed, since the data are not part of this project. "
            f"Name it: {FOLDER}=folder bayes-placement update models/plane.py --engine map."
        )
    measured, modes = (np.load(file) for file in files)
    return Plane(
        frequency=measured["frequency_hz"],
        accelerance=measured["frf"].astype(complex),
        coherence=measured["coherence"].astype(float),
        hit=measured["impact_position_m"],
        axis=measured["impact_axis"],
        node=modes["node_position_m"].astype(float),
        shape=modes["shape"].astype(float),
    )


def usable_frfs(plane):
    """Tell which FRFs can be used, [sensor, hit].

    An impact near an accelerometer overloads it: its FRF is wrong, and its coherence low at nearly
    all lines. A record that repeats an earlier record is not used.
    """
    band = (plane.frequency > 14) & (plane.frequency < 107)
    coherent = np.median(plane.coherence[..., band], axis=-1) > 0.99
    first = np.unique(plane.accelerance, axis=1, return_index=True)[1]
    return coherent & np.isin(np.arange(len(plane.hit)), first)


def signs(plane):
    """Sign of each impact along its axis, and the agreement of the votes for it, from 0 to 1.

    Near a resonance the imaginary part of an accelerance is proportional to the shape at the
    sensor, the shape at the impact and the sign. Multiplied by the shape at the impact, whose
    position is known, it is a vote on the sign, up to a sign for each sensor and mode: 18 lists of
    votes, which are combined by the first eigenvector of their products. The first impact is along
    its axis.

    This does not bias the inference: positions of sensors are not used, and a sign on which all
    votes agree has no alternative of notable probability.
    """
    votes = []
    for mode, shape in enumerate(plane.shape_at_hits()[:PAIRED]):
        near = np.abs(plane.frequency - RESONANCES[mode]) < 1.0
        peak = np.sum(np.imag(plane.accelerance[..., near]), axis=-1)
        vote = np.where(usable_frfs(plane), peak, 0.0) * shape
        votes.extend(vote / np.linalg.norm(vote, axis=1, keepdims=True))
    leading = np.linalg.eigh(np.transpose(votes) @ votes)[1][:, -1]
    agreed = np.sign(votes @ leading)[:, None] * votes
    total, most = agreed.sum(axis=0), np.abs(agreed).sum(axis=0)
    sign = np.where(total * total[0] < 0, -1, 1)
    return sign, np.abs(total) / np.where(most > 0, most, np.inf)


def measured(plane):
    """Usable FRFs, with the sign of each impact as the direction of its channel."""
    usable = usable_frfs(plane)[..., None]
    directions = plane.axis * signs(plane)[0]
    return bp.Measurement.from_arrays(
        np.where(usable, plane.accelerance, np.nan)[..., 1:],
        plane.frequency[1:],
        sensors=[bp.Channel(name, axis) for name, axis in AXES.items()],
        actuators=[bp.Channel(str(n), int(axis)) for n, axis in enumerate(directions, start=1)],
        quantity="accelerance",
        coherence=np.where(usable, np.clip(plane.coherence, 1e-3, 1 - 1e-4), np.nan)[..., 1:],
        averages=2,  # not recorded: the least number with a coherence, and so the largest error
    )


class Aeroplane(bp.finite_elements.DerivedNodalModes):
    """Known mode shapes with unknown frequencies and masses; shapes of close modes are rotated.

    Parameters
    ----------
    nodal
        The shapes, those of the rigid body first.
    frequency
        Natural frequency of each elastic mode [Hz].
    modal_mass
        Modal mass of each mode [kg].
    angle
        Angle by which each of the pairs is rotated [rad], the effect of a small error of the
        stiffness on modes of nearly the same frequency.
    pairs
        Columns of the shapes that are rotated into each other.
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
        """Mass-normalised mode shapes [kg^-1/2]; rotated shapes are mass-normalised as well."""
        shapes = self.nodal.shapes(position, derivative) / jnp.sqrt(self.modal_mass)
        for number, pair in enumerate(self.pairs):
            cosine, sine = jnp.cos(self.angle[number]), jnp.sin(self.angle[number])
            rotation = jnp.array([[cosine, -sine], [sine, cosine]])
            shapes = shapes.at[:, pair].set(shapes[:, pair] @ rotation)
        return shapes

    def static_flexibility(self, position, other):
        """None: truncated modes are not known."""
        return


class NearResonances(bp.noise.Noise):
    """Independent errors in proportion to the level near each resonance.

    Parameters
    ----------
    ratio
        Ratio of the error to the level near each resonance, and at all other lines [1].
    level
        Level of each line as a deviation of z, where it is near a resonance, and zero elsewhere,
        [resonance, line]; the last row is of all other lines.
    """

    reads_coherence: ClassVar[bool] = False
    ratio: Any
    level: np.ndarray

    def distribution(self, predicted, data, kernel=0.0):
        """Independent normal distribution of every output."""
        return self._gaussian().distribution(predicted, data, kernel)

    def deviation(self, data):
        """Return the deviation of every output; None where the ratio is not known."""
        return (
            None if isinstance(self.ratio, dist.Distribution) else self._gaussian().deviation(data)
        )

    def _gaussian(self):
        return bp.noise.Gaussian((jnp.asarray(self.ratio) @ self.level)[None, None])


def structure(plane, modes):
    """Structure with known shapes and unknown frequency, mass and damping of each mode."""
    shape = np.concatenate([rigid_body_shapes(plane.node), plane.shape[:modes]])
    kept, resonances = regions(plane), RESONANCES[:modes]
    model = bp.finite_elements.ModalModel.from_arrays(
        position=plane.node[kept],
        shape=np.moveaxis(shape[:, kept], 0, -1),
        natural_frequency=np.concatenate([np.zeros(RIGID_BODY), resonances]),
        modal_mass=1,
    )
    even = MASS * np.mean(np.sum(shape**2, axis=2), axis=1)  # if all nodes had the same mass
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
    """Heave along z and rotations about x and y, which the impacts excite, [mode, node, axis]."""
    offset = position - position.mean(axis=0)
    heave = np.broadcast_to([0.0, 0.0, 1.0], offset.shape)
    return np.stack([heave, *(np.cross(axis, offset) for axis in np.eye(3)[:2])])


def regions(plane):
    """Nodes near the impacts and in the regions of the sensors; the others are not needed."""
    kept = np.zeros(len(plane.node), dtype=bool)
    kept[np.concatenate(KDTree(plane.node).query_ball_point(plane.hit, 0.03)).astype(int)] = True
    for sides in PLATES.values():
        low, high = np.transpose([np.broadcast_to(side, 2) for side in sides])
        kept |= np.all((plane.node > low - 0.03) & (plane.node < high + 0.03), axis=1)
    return kept


def lines(modes):
    """Lines [Hz] on the flanks of the resonances, rounded to 1/8 Hz."""
    flanks = RESONANCES[:modes, None] + FLANK[:modes, None] * [-1, 1]
    return np.unique(np.round(8 * flanks)) / 8


def about(frequency):
    """Tell which resonance a line is near, [mode, line]."""
    apart = abs(frequency - RESONANCES[:, None])
    return (apart < 1.5) & (apart == apart.min(axis=0))


def level(plane, frequency):
    """Root mean square of the FRFs of all impacts [(m/s2)/N], [line].

    The error of a shape does not vanish near a node of the mode. For some modes the usable impacts
    are near a node, so that the mean over these is scaled to all impacts by the shapes.
    """
    usable, shape = usable_frfs(plane), plane.shape_at_hits() ** 2
    at_usable = np.stack([shape[:, hits].mean(axis=1) for hits in usable])
    near = about(frequency)
    scale = np.where(near.any(axis=0), shape.mean(axis=1) / at_usable @ near, 1.0)
    square = np.nanmean(np.abs(measured(plane).lines(frequency).frf) ** 2, axis=1)
    return np.sqrt(np.mean(square * scale, axis=0))


def sensor(name, sides):
    """Accelerometer anywhere on its plate."""
    position = bp.positions.places.Cartesian(
        *(dist.Uniform(*side) if np.ndim(side) else side for side in sides)
    )
    middle = tuple(float(np.mean(side)) for side in sides)
    return bp.Sensor(name, position, directions=(AXES[name],), recorded=middle)


def level_by_resonance(plane, frequency, modes):
    """Level of each line in the row of its resonance, and of no other line, [resonance, line]."""
    near = about(frequency)[:modes]
    return np.vstack([near, ~near.any(axis=0)]) * level(plane, frequency)


def experiment_of(plane, frequency, modes):
    """Experiment at given lines [Hz], with sensors anywhere on their plates.

    What the model does not explain is in proportion to the level near each resonance. It is alike
    at neighbouring impacts, so that every second impact is sufficient.
    """
    hits = list(enumerate(zip(plane.hit, plane.axis, strict=True), start=1))
    of_each_part = level_by_resonance(plane, frequency, modes) / np.sqrt(2)
    ratio = UNEXPLAINED.expand((len(of_each_part),)).to_event(1)
    return bp.Experiment(
        structure(plane, modes),
        sensors=[sensor(name, sides) for name, sides in PLATES.items()],
        actuators=[
            bp.Actuator(str(n), tuple(map(float, at)), directions=(int(axis),))
            for n, (at, axis) in hits[::2]
        ],
        frequency=frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=NearResonances(ratio, of_each_part),
        model_error=SHAPES,
    )


def below(plane):
    """Experiment on modes 1 to 6."""
    return experiment_of(plane, np.union1d(RIGID, lines(PAIRED)), PAIRED)


def beyond(plane, posterior):
    """Experiment on modes 1 to 9, all treated alike.

    Sensors are at their posterior means, and shapes err as much as those of modes 1 to 6, so that
    these are a control for what is left near the others.
    """
    known = {
        name: float(draws.mean())
        for name, draws in posterior["posterior"].to_dataset().items()
        if draws.attrs["owner"].startswith("sensor ") or name == "model_error.shape.size"
    }
    modes = PAIRED + 3
    return experiment_of(plane, lines(modes), modes).fix(known)


def by_mode(misfit):
    """Chi2 per datum near each resonance, [mode]."""
    square = np.nanmean(misfit.response["misfit"].values ** 2, axis=(0, 1))
    near = about(misfit.response["frequency"].values)
    return np.array([np.mean(square[lines]) for lines in near if lines.any()])


@functools.cache
def study(folder=None):
    """Experiment, measurement and engine; for the folder of the data see `read`."""
    plane = read(folder)
    return Study(below(plane), measured(plane), engine, {})


def __getattr__(name):
    """Read the data on the first access of the experiment or the measurement."""
    if name in ("experiment", "measurement"):
        return getattr(study(), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
