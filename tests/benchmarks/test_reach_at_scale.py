"""Benchmark: the scan of reach over all nodes of an aircraft, in three directions.

Run with `python -m pytest tests/benchmarks/test_reach_at_scale.py -n 0`; `-m long` adds the full
size. Seconds are those of one core, whatever else the machine does. The floor is what the products
over modes take at the rate of one large product of matrices in single precision, in the same run.
"""

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from bayes_placement.criticism.reach import _by_modes
from bayes_placement.criticism.reach._ports import ports_of
from bayes_placement.criticism.reach._scanned import _Placed
from bayes_placement.inference.residuals import Problem
from tests.benchmarks import aircraft
from tests.benchmarks.page import Anchor, at_most

MODES, SHAKERS = 60, 2
REDUCED, FULL = (51, 500, 3_000), (351, 2_000, 30_000)
"""Sensor channels, lines and nodes; channels are twice as many FRFs."""
SECONDS, FLOORS, MEMORY = 60.0, 3.0, 4.0
"""Asked: seconds, floors, GiB."""
POINT = np.array([0.1, -0.35])
"""Modulus and loss near those of the data, as a fit beside a law has them."""


def scanned(sensors, lines, nodes):
    """Seconds of tables, readings and sums; the ten best places; the same in double."""
    whole = aircraft.skin(nodes, MODES)
    setup, rows = aircraft.experiment(whole, sensors, SHAKERS, np.linspace(3.0, 80.0, lines))
    node = nodes * 11 // 30
    data = aircraft.measured(
        whole, setup, rows, node, 2, lambda omega: 3e5 * (1 + 0.2j) + 0 * omega
    )
    problem = Problem(setup, setup.data(data))
    problem.squares.residuals(POINT[None])  # compiled
    ports = ports_of(setup)[:3]
    took = {}
    scan = timed(took, "tables", lambda: _by_modes.ScanByModes(problem, POINT))
    placed = [_Placed(port, problem, whole.position[:, None]) for port in ports]
    values, effects = placed[0].of_effect(), [each.effect for each in placed]
    shapes = timed(took, "readings", lambda: scan.motions.readings(effects, values))
    costs = timed(took, "sums", lambda: [scan.costs(each) for each in shapes])
    in_double = timed(took, "in double", lambda: scan._costs(scan.tables, shapes[2]))
    best = [np.argsort(each)[:10].tolist() for each in (costs[2], in_double)]
    pairs = MODES * (MODES + 1) // 2
    a_place = SHAKERS * lines * (2 * pairs + 4 * MODES * (2 + len(scan.pull)))
    return took | {
        "floor": 3 * nodes * a_place / rate(),
        "best": best,
        "GiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }


def timed(took, name, function):
    began = time.process_time()
    result = function()
    took[name] = time.process_time() - began
    return result


def rate():
    """Operations a second of a large product in single precision, on one core."""
    random = np.random.default_rng(0)
    one, other = (random.random(shape, np.float32) for shape in ((1024, 2048), (2048, 2048)))
    took = []
    for _ in range(5):
        began = time.process_time()
        one @ other
        took.append(time.process_time() - began)
    return 2 * 1024 * 2048 * 2048 / min(took)


def apart(size):
    """Figures from a process of its own."""
    output = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.test_reach_at_scale", *map(str, size)],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
        env=os.environ | {"PJRT_NPROC": "1"},
    ).stdout
    return json.loads(output.splitlines()[-1])


def total(figures):
    return sum(figures[name] for name in ("tables", "readings", "sums"))


def test_the_scan_grows_no_more_than_what_it_multiplies(page):
    before = apart(REDUCED)
    for number, word in enumerate(("channels", "lines", "nodes")):
        size = tuple(each * 2 if place == number else each for place, each in enumerate(REDUCED))
        exponent = np.log2(total(apart(size)) / total(before))
        page.add(f"scan of reach: exponent of growth in {word}", exponent, "", at_most(1.1))


@pytest.mark.parametrize("size", [REDUCED, pytest.param(FULL, marks=pytest.mark.long)])
def test_the_scan_of_an_aircraft(size, page):
    figures = apart(size)
    sensors, lines, nodes = size
    name = f"scan of reach, {SHAKERS * sensors} FRFs, {lines} lines, {nodes} nodes"
    assert figures["best"][0] == figures["best"][1]
    for word in ("tables", "readings", "sums"):
        page.add(f"{name}: {word}", figures[word], "s")
    page.add(f"{name}: total", total(figures), "s", at_most(SECONDS))
    floor = Anchor("floor", figures["floor"])
    page.add(f"{name}: sums over modes", figures["sums"], "s", at_most(FLOORS), anchor=floor)
    page.add(f"{name}: peak memory", figures["GiB"], "GiB", at_most(MEMORY))


if __name__ == "__main__":
    with threadpool_limits(1):
        print(json.dumps(scanned(*map(int, sys.argv[1:]))))
