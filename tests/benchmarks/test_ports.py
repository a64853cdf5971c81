"""Ports: what networks at one, two and four places add to a likelihood and its gradient.

Run with `python -m pytest tests/benchmarks/test_ports.py -n 0`.
"""

import time

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from tests.benchmarks.page import Anchor, at_most

SENSORS, LINES, REPEATED = (0.16, 0.47, 0.71), np.arange(100.0, 900.0, 2.0), 200
PLACES = (0.2, 0.35, 0.55, 0.8)


def experiment(ports):
    """A bar with an absorber of unknown place, mass, frequency and damping at some places."""
    modulus, ratio = dist.Uniform(0.9e9, 1.1e9), dist.Uniform(0.02, 0.08)
    modes = bp.beams.bar(60, length=1.0, area=1e-3, youngs_modulus=modulus, density=9000.0)
    structure = bp.Structure(modes, damping=bp.damping.Modal(ratio))
    for number, place in enumerate(PLACES[:ports]):
        structure += bp.effects.tuned_absorber(
            at=dist.Uniform(place - 0.05, place + 0.05),
            mass=dist.Uniform(0.0, 0.5),
            frequency=dist.Uniform(100.0, 900.0),
            damping_ratio=dist.Uniform(0.01, 0.1),
            name=f"absorber{number}",
        )
    return bp.Experiment(
        structure,
        sensors=[bp.Sensor(f"s{number}", at=at) for number, at in enumerate(SENSORS)],
        actuators=[bp.Actuator("a1", at=0.25)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(0.01),
    )


def likelihood(known, data, values):
    concrete = known.fix(values)
    return concrete.noise.distribution(concrete.predict(), data).log_prob(data.z).sum()


def with_gradient(known, data, values):
    return jax.value_and_grad(lambda values: likelihood(known, data, values))(values)


def prepared(function, ports):
    """Function of nothing that computes one value, once it is compiled."""
    built = experiment(ports)
    values = {name: jnp.asarray(value) for name, value in built.nominal_values().items()}
    data = built.data(built.nominal_measurement())
    call = compiled(function).bound(built, data, values)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(call()))
    return call


def milliseconds(calls):
    """Median time of each call; they take turns, so that the machine is the same for all."""
    took = np.empty((REPEATED, len(calls)))
    for row in took:
        for column, call in enumerate(calls):
            began = time.perf_counter()
            jax.block_until_ready(call())
            row[column] = time.perf_counter() - began
    return 1e3 * np.median(took, axis=0)


def frfs(ports):
    """FRFs between sensors, the actuator and ports: each port is closed in all that are left."""
    return (len(SENSORS) + ports) * (1 + ports)


def test_a_port_costs_no_more_than_its_frfs(page):
    counts = (1, 2, 4)
    for function in (likelihood, with_gradient):
        bare, *took = milliseconds([prepared(function, ports) for ports in (0, *counts)])
        anchor = Anchor("no port", bare)
        for ports, value in zip(counts, took, strict=True):
            most = at_most(frfs(ports) / frfs(0))
            name = f"{function.__name__.replace('_', ' ')}, {ports} ports"
            assert page.add(name, value, "ms", most, anchor=anchor).met
