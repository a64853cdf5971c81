"""Small experiments with latent placement, and ranks of true values among draws of a posterior.

Truth and data are draws of the model itself, so that ranks are uniform if the draws are those of
the posterior: Talts et al. (2018), arXiv:1804.06788. All replicates of a study have one structure,
so that what is compiled for the first serves all.

Run a part by hand with `python -m tests.benchmarks.calibration_studies STUDY METHOD COUNT`.
"""

import functools
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import process_time
from typing import NamedTuple

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement.criticism.missing._descents import fit_alone
from bayes_placement.inference.engines.about_mode import sampled_about
from bayes_placement.inference.engines.engine import Engine
from bayes_placement.inference.estimates import scalars
from bayes_placement.inference.infer import InferenceWarning
from bayes_placement.inference.marginals.marginal import Marginal
from bayes_placement.inference.residuals import Problem
from bayes_placement.modes.finite_elements import interpolation
from tests.benchmarks.recorded_rows import Rows
from tests.simulator import space_frames

REPLICATES = 500
"""Replicates of which the data are simulated; fewer may be run."""

DRAWS = 60
"""Draws among which a true value has its rank: few enough to be nearly independent."""


def bar() -> bp.Experiment:
    """The bar of the paper's section 5, its noise unknown."""
    damping = bp.damping.Modal([dist.Uniform(0.02, 0.06), 0.04])
    modes = bp.beams.bar(8, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(modes, damping=damping),
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.22, within=0.04))],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.34, within=0.04))],
        frequency=(np.arange(1, 11) - 0.5) * 43.3,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=bp.noise.Gaussian(dist.LogUniform(0.05, 0.5)),
    )


def beam() -> bp.Experiment:
    """A cantilever whose modulus is unknown, complex FRFs of two sensors, unknown noise."""
    modes = bp.beams.beam(
        6,
        length=0.8,
        area=4e-4,
        second_moment=3.3e-9,
        youngs_modulus=dist.Uniform(6.8e10, 7.2e10),
        density=2700.0,
        ends="clamped-free",
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.01, 0.03))),
        sensors=[
            bp.Sensor("s1", at=bp.positions.Segment(0.31, within=0.03)),
            bp.Sensor("s2", at=bp.positions.Segment(0.70, within=0.03)),
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.52, within=0.03))],
        frequency=np.array([20.0, 55.0, 110.0, 143.0, 152.0, 260.0, 390.0, 410.0]),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(dist.LogUniform(1.0, 10.0)),
    )


def frame() -> bp.Experiment:
    """Column and arm of a frame in space; the sensor on the arm is rolled, the noise is known."""
    foot, corner, tip = np.zeros(3), np.array([0.0, 0.0, 0.5]), np.array([0.4, 0.1, 0.55])
    parts = [space_frames.line(foot, corner, 4), space_frames.line(corner, tip, 4)]
    position = np.concatenate([parts[0][0][:-1], parts[1][0]])
    elements = np.concatenate([parts[0][1], parts[1][1] + 4])
    model = space_frames.matrices(position, elements, space_frames.RoundBar(0.008))
    matrices = bp.finite_elements.Matrices(**model, fixed=np.arange(6))
    modes = bp.finite_elements.modes(
        matrices, interpolation.frame(matrices, elements), up_to=1200.0
    )
    column = bp.positions.Member(foot, corner, centre=(0.0, 0.0, 0.36), within=0.03)
    arm = bp.positions.Member(corner, tip, centre=0.3 * corner + 0.7 * tip, within=0.03)
    rolled = (dist.Uniform(-0.3, 0.3), 0.0, 0.0)
    mass = bp.effects.point_mass(at=0.6 * corner + 0.4 * tip, mass=dist.Uniform(0.0, 0.1))
    structure = bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.01, 0.04)))
    return bp.Experiment(
        structure + mass,
        sensors=[bp.Sensor("s1", at=arm, directions=(3, 2), angles=rolled)],
        actuators=[bp.Actuator("a1", at=column, directions=(1,))],
        frequency=np.array([14.0, 21.0, 36.0, 60.0, 90.0, 140.0]),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(0.2),
    )


STUDIES = {"bar": bar, "beam": beam, "frame": frame}

GRID_NODES = {"bar": 16, "beam": 32, "frame": 16}
"""Nodes along each unknown: with 16 of them the grid says that it does not resolve the beam's."""


class Study:
    """An experiment, true values and data of many replicates."""

    def __init__(
        self, experiment: bp.Experiment, count: int = REPLICATES, key: int = 0, grid_nodes: int = 16
    ):
        self.experiment, self.grid_nodes = experiment, grid_nodes
        simulated = bp.simulate(experiment, draws=count, key=key)
        self.truth = dict(elements(simulated["prior"]))
        self.outputs = simulated["prior_predictive"]["measured"].values[0]

    def measurement(self, replicate: int) -> bp.Measurement:
        """Data of a replicate, as an engineer would have them."""
        z, quantity = self.outputs[replicate], self.experiment.observe.quantity
        frf = 10.0**z if self.experiment.observe.parts == 1 else z[..., 0, :] + 1j * z[..., 1, :]
        return bp.Measurement.from_arrays(
            frf,
            self.experiment.frequency,
            sensors=self.experiment.sensor_channels,
            actuators=self.experiment.actuator_channels,
            quantity=quantity,
        )


@functools.cache
def study(name: str) -> Study:
    """Return a study, simulated once."""
    return Study(STUDIES[name](), key=len(name), grid_nodes=GRID_NODES[name])


class Draws(NamedTuple):
    """Draws of one unknown; nodes of a quadrature where they have weights."""

    values: np.ndarray
    weights: np.ndarray | None = None


@dataclass(frozen=True)
class Inferred:
    """Draws of `infer`."""

    engine: Engine
    marginal: Marginal

    def __call__(self, study: Study, replicate: int) -> dict[str, Draws]:
        tree = bp.infer(
            study.experiment,
            study.measurement(replicate),
            engine=self.engine,
            marginal=self.marginal,
            key=replicate,
        )
        return {name: Draws(values) for name, values in elements(tree["posterior"])}


def on_grid(study: Study, replicate: int) -> dict[str, Draws]:
    """Nodes of the grid, and of a quadrature over the placement."""
    tree = bp.infer(
        study.experiment,
        study.measurement(replicate),
        engine=bp.engines.Grid(nodes=study.grid_nodes),
        marginal=bp.marginals.Quadrature(nodes=12),
        key=replicate,
    )
    return nodes_of(tree)


def nodes_of(tree) -> dict[str, Draws]:
    """Nodes of the grid with their weights, and of the placement as often as they were drawn."""
    weights = np.exp(tree["weighted"]["log_weight"].values.ravel())
    on_grid = tree["weighted"].to_dataset().drop_vars("log_weight")
    nodes = {name: Draws(values, weights) for name, values in elements(on_grid)}
    for name, values in elements(tree["posterior"]):
        nodes.setdefault(name, Draws(values, np.full(values.size, 1 / values.size)))
    return nodes


def elements(draws) -> Iterator[tuple[str, np.ndarray]]:
    """Names and draws of all numbers in a group of results."""
    for name, variable in draws.data_vars.items():
        for element, values in scalars(name, variable.values):
            yield element, values.ravel()


def finalist(study: Study, replicate: int) -> dict[str, Draws]:
    """Draws from which `improve` takes the intervals of its verdict."""
    problem = Problem(study.experiment, study.experiment.data(study.measurement(replicate)))
    fitted = fit_alone(problem, replicate)
    points = sampled_about(problem.squares, fitted.fit, seed=replicate).points
    named = problem.coordinates.named(points)
    return {
        element: Draws(values.ravel())
        for name, draws in named.items()
        for element, values in scalars(name, draws[None])
    }


METHODS: dict[str, Callable[[Study, int], dict[str, Draws]]] = {
    "importance": Inferred(bp.engines.Importance(draws=20_000), bp.marginals.Latent()),
    "grid": on_grid,
    "smc": Inferred(bp.engines.SMC(particles=400, populations=2), bp.marginals.Latent()),
    "nuts": Inferred(bp.engines.NUTS(chains=2, warmup=400, draws=500), bp.marginals.Latent()),
    "finalist": finalist,
}


@dataclass(frozen=True)
class Replicate:
    """Ranks of the true values of a replicate, from 0 to 1, by name."""

    study: str
    method: str
    replicate: int
    seconds: float
    warned: bool
    ranks: dict[str, float]


def ranked(name: str, method: str, replicate: int) -> Replicate:
    """Rank the true values of a replicate."""
    posterior_study, began = study(name), process_time()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", InferenceWarning)
        draws = METHODS[method](posterior_study, replicate)
    random = np.random.default_rng([replicate, 3])
    priors = {unknown.name: unknown.distribution for unknown in posterior_study.experiment.unknowns}
    ranks = {
        unknown: rank(
            float(posterior_study.truth[unknown][replicate]), drawn, priors[unknown], random
        )
        for unknown, drawn in draws.items()
    }
    seconds = process_time() - began
    return Replicate(name, method, replicate, seconds, bool(caught), ranks)


def rank(
    truth: float, draws: Draws, prior: dist.Distribution, random: np.random.Generator
) -> float:
    """Rank of a true value, uniform from 0 to 1 where the draws are those of the posterior."""
    if draws.weights is None:
        chosen = random.choice(draws.values, DRAWS, replace=False)
        return float((np.sum(chosen < truth) + random.uniform()) / (DRAWS + 1))
    nodes, place = np.unique(draws.values, return_inverse=True)
    share = np.bincount(place, draws.weights)
    # Half of the weight of a node lies below it; between nodes the density is that of the prior.
    known = np.concatenate([[0.0], np.asarray(prior.cdf(nodes)), [1.0]])
    below = np.concatenate([[0.0], np.cumsum(share) - share / 2, [1.0]])
    return float(np.interp(float(prior.cdf(truth)), known, below))


ROWS = Rows(Replicate, "ranks")


def replicates(name: str, method: str, count: int) -> list[Replicate]:
    """Return so many replicates; those that are recorded are not run again."""
    return [
        ROWS.row(
            functools.partial(ranked, name, method, number),
            study=name,
            method=method,
            replicate=number,
        )
        for number in range(count)
    ]


if __name__ == "__main__":
    rows = replicates(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    print(sys.argv[1:], f"{sum(row.seconds for row in rows):.0f} CPU s")
