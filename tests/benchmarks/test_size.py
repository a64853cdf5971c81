"""Size: a model of a million degrees of freedom; what parameters of matrices cost a likelihood.

Run with `python -m pytest tests/benchmarks/test_size.py -n 0 -s`. Models are measured in a process
of their own, whose peak memory is then theirs.
"""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro.distributions import Uniform
from scipy.spatial import KDTree

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.sites import substitute
from bayes_placement.io import npz_modes
from bayes_placement.modes.changed import with_coupling
from tests.benchmarks.page import Anchor, at_least, at_most

NODES, MODES, LINES = 333_334, 60, 400
CANDIDATES, SENSORS, WITHIN = 200, 6, 0.004
SETUP_SECONDS, LIKELIHOOD_MILLISECONDS, MEMORY = 6.0, 2.0, 1.0
"""Asked: seconds, milliseconds, GiB."""

USED = (
    "Actuator",
    "Experiment",
    "Sensor",
    "Structure",
    "damping",
    "finite_elements",
    "io",
    "noise",
    "observe",
    "positions",
)

# Threads that wait for each other on a busy machine would be measured, not the work.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}


def write_model(path):
    """Write a curved panel whose shapes are products of sines, three directions a node."""
    side = int(np.ceil(np.sqrt(NODES)))
    number = np.arange(NODES)
    u, v = number % side / side, number // side / side
    position = np.column_stack([2.0 * u, 1.5 * v, 0.2 * np.sin(np.pi * u)])
    shape = np.empty((NODES, 3, MODES))
    for mode in range(MODES):
        m, n = 1 + mode % 8, 1 + mode // 8
        for axis, phase in enumerate((0.3, 0.7, 0.0)):
            size = (0.2, 0.1, 1.0)[axis]
            shape[:, axis, mode] = size * np.sin(m * np.pi * u + phase) * np.sin(n * np.pi * v)
    frequency = np.sort([20.0 * (m**2 + n**2) for m in range(1, 9) for n in range(1, 9)])[:MODES]
    npz_modes.write(
        path,
        bp.finite_elements.ModalModel.from_arrays(
            position=position,
            shape=shape,
            natural_frequency=frequency + np.arange(MODES),
            modal_mass=1.0,
        ),
    )


def candidates(position):
    """Nodes spread over the inner panel, the same at each call."""
    inner = np.flatnonzero(
        (np.abs(position[:, 0] - 1) < 0.9) & (np.abs(position[:, 1] - 0.7) < 0.6)
    )
    return inner[np.linspace(0, len(inner) - 1, CANDIDATES).astype(int)]


def continuous(model):
    """Boxes near candidate nodes, read by moving least squares."""
    places = model.position[candidates(model.position)]
    near = KDTree(model.position).query_ball_point(places, 3 * WITHIN)
    submodel = model.restricted(model.node[np.unique(np.concatenate(near))])
    reading = bp.finite_elements.interpolation.scattered(submodel).near(places, WITHIN)
    boxes = [bp.positions.Box(place, within=(WITHIN, WITHIN, 0.0)) for place in places]
    return submodel, reading, boxes


def at_nodes(model):
    """Candidate nodes themselves, every one as likely."""
    submodel = model.restricted(model.node[candidates(model.position)])
    return (
        submodel,
        bp.finite_elements.interpolation.nearest(submodel),
        [bp.positions.Nodes(submodel.position)] * CANDIDATES,
    )


def experiment(model, placed):
    submodel, reading, supports = placed(model)
    tilt = (Uniform(-0.1, 0.1),) * 3
    chosen = np.linspace(10, CANDIDATES - 10, SENSORS).astype(int)
    return bp.Experiment(
        bp.Structure(
            bp.finite_elements.modes_from_shapes(submodel, reading), damping=bp.damping.Modal(0.01)
        ),
        sensors=[
            bp.Sensor(f"s{number}", at=supports[number], directions=(1, 2, 3), angles=tilt)
            for number in chosen
        ],
        actuators=[bp.Actuator("a", at=submodel.position[5], directions=(3,))],
        frequency=np.linspace(30.0, 900.0, LINES),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(0.1),
    )


def seconds(function, *arguments):
    began = time.perf_counter()
    result = function(*arguments)
    return result, time.perf_counter() - began


def measure(path, kind):
    """Figures of one kind of placement: seconds and bytes."""
    placed = {"continuous": continuous, "nodes": at_nodes}[kind]
    for name in USED:  # imported on first use, which is no part of the set-up
        getattr(bp, name)
    began = time.perf_counter()
    model, reading = seconds(npz_modes.read, path)
    built, building = seconds(experiment, model, placed)
    names = [unknown.name for unknown in built.unknowns if unknown.component != "node"]
    setup = time.perf_counter() - began
    peak = peak_memory()
    data = built.data(built.nominal_measurement())
    nominal = built.nominal_values()

    # The model is an input of what is compiled, as it is for engines, not a constant in it.
    gradient = compiled(value_and_gradient).bound(built, data, nominal, tuple(names))
    start = jnp.array([float(nominal[name]) for name in names])
    (value, slope), first = seconds(lambda: jax.block_until_ready(gradient(start)))
    times = [seconds(lambda: jax.block_until_ready(gradient(start)))[1] for _ in range(30)]
    assert np.isfinite(value) and np.isfinite(slope).all()
    return {
        "unknowns": len(names),
        "nodes kept": built.structure.modes.shape.shape[0] // 3,
        "read [s]": reading,
        "experiment [s]": building,
        "set-up [s]": setup,
        "first likelihood [s]": first,
        "likelihood with gradient [s]": float(np.median(times)),
        "peak at set-up [GiB]": peak,
        "peak [GiB]": peak_memory(),
    }


def peak_memory():
    """Peak of resident memory [GiB] of this process."""
    # What getrusage tells begins with the peak of the process that began this one.
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmHWM:\s*(\d+) kB", status)[1]) / 2**20


def value_and_gradient(experiment, data, nominal, names, start):
    """Log likelihood of values by name, all others nominal, and its gradient."""

    def likelihood(values):
        concrete = experiment.fix(nominal | dict(zip(names, values, strict=True)))
        return concrete.noise.distribution(concrete.predict(), data).log_prob(data.z).sum()

    return jax.value_and_grad(likelihood)(start)


def apart(kind, *arguments, environment=None):
    """Figures from a separate process."""
    command = [sys.executable, "-m", "tests.benchmarks.test_size", kind, *arguments]
    output = subprocess.run(
        command,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
        env=os.environ | (environment or {}),
    ).stdout
    return json.loads(output.splitlines()[-1])


def listed(figures):
    return ", ".join(f"{name} {value:.3g}" for name, value in figures.items())


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("size") / "large.npz"
    write_model(path)
    yield path
    path.unlink()


@pytest.mark.parametrize("kind", ["continuous", "nodes"])
def test_a_model_of_a_million_degrees_of_freedom(model, kind, page):
    figures = apart(kind, str(model))
    print(f"\n{kind}: {listed(figures)}")
    name, gradient = f"10^6 degrees of freedom, {kind}", "likelihood with gradient"
    page.add(f"{name}: set-up", figures["set-up [s]"], "s", at_most(SETUP_SECONDS))
    page.add(f"{name}: peak memory", figures["peak [GiB]"], "GiB", at_most(MEMORY))
    took = 1e3 * figures[f"{gradient} [s]"]
    page.add(f"{name}: {gradient}", took, "ms", at_most(LIKELIHOOD_MILLISECONDS))


def test_eigenpairs_cost_less_than_direct_solutions(page):
    """Parameters of matrices: one eigenproblem against a solution at each line, both reduced."""
    took = apart("eigenpairs", environment=ONE_THREAD)
    anchor = Anchor("direct solutions", 1e3 * took["direct [s]"])
    took_by_modes = 1e3 * took["eigenpairs [s]"]
    name = "parameters of matrices, value and gradient"
    assert page.add(name, took_by_modes, "ms", at_least(3), anchor=anchor).met


def costs():
    """Seconds of a likelihood of parameters of matrices, by eigenpairs and by direct solutions."""
    from tests.modes.finite_elements import test_affine_modes  # not needed by the models

    modes = test_affine_modes.affine()
    size, omega = modes.nodal.eigenvalues.size, 2 * np.pi * np.linspace(50.0, 1500.0, LINES)
    parts, random = modes.stiffness.matrices, np.random.default_rng(0)
    read, driven = random.normal(size=(3 * SENSORS, size)), random.normal(size=(1, size))

    def by_modes(values):
        named = zip((f"parameter.{name}" for name in modes.parameter), values, strict=True)
        solved = substitute(modes, dict(named)).solved()
        to, come_from = read @ solved.of_modes, driven @ solved.of_modes
        natural = solved.angular_frequency()
        loss = bp.damping.Modal(0.01).loss(natural, jnp.asarray(omega), 0)
        modal = 1 / ((natural**2)[:, None] - omega**2 + loss)
        residues = to[:, None] * come_from
        receptance = residues @ jnp.real(modal) + 1j * (residues @ jnp.imag(modal))
        sides = (to[:, :, None] * modal, come_from[:, :, None] * modal)
        return with_coupling(receptance, solved.coupling(), *sides)

    def direct(values):
        excess = jnp.tensordot(jnp.stack(values[:2]) - 1, parts, 1)
        stiffness = (jnp.diag(modes.nodal.eigenvalues) + excess) * (1 + 0.02j)

        def line(w):
            return read @ jnp.linalg.solve(stiffness - w**2 * values[2] * jnp.eye(size), driven.T)

        return jnp.moveaxis(jax.lax.map(line, jnp.asarray(omega), batch_size=20), 0, -1)

    return {"vectors": size, "eigenpairs [s]": cost(by_modes), "direct [s]": cost(direct)}


def cost(response):
    """Median seconds of a sum of squares with its gradient, once compiled."""
    start = np.array([0.9, 1.1, 1.02])
    compiled = jax.jit(jax.value_and_grad(lambda point: jnp.sum(jnp.abs(response(point)) ** 2)))
    assert np.isfinite(jax.block_until_ready(compiled(start))[1]).all()
    return np.median(
        [seconds(lambda: jax.block_until_ready(compiled(start)))[1] for _ in range(15)]
    )


if __name__ == "__main__":
    kind, *paths = sys.argv[1:]
    print(json.dumps(measure(Path(paths[0]), kind) if paths else costs()))
