"""Benchmarks: verdicts on the open cases, false alarms and power, with time and memory.

Run with `python -m pytest tests/benchmarks/test_missing_effect.py -n 0 -s -m long`.
"""

import json
import resource
import time
from dataclasses import replace

import equinox as eqx
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._posterior_odds import p_value
from bayes_placement.criticism.missing.improve import improve
from bayes_placement.experiment.noise import Noise
from bayes_placement.inference.chi2 import LEVEL
from bayes_placement.io import case
from bayes_placement.io.case._measurement import noise_by_data
from tests.benchmarks.missing_effects import experiment_of
from tests.benchmarks.page import at_least, at_most
from tests.simulator.hidden_draws import draw

CASES = ["01", "03", "05", "06", "07", "09", "11", "12"]
MODELS = ["02", "04", "08", "10"]
INTACT = ["03", "08"]
"""Cases in which nothing is missing."""

DRAWS, MEMORY = 60, 1.5
"""Structures of each kind; memory that is asked [GiB]."""

pytestmark = pytest.mark.long


# Name of each true parameter: ours, and its value in our terms.
OURS = {
    "youngs_modulus_Pa": ("structure.modes.youngs_modulus", float),
    "density_kg_m3": ("structure.modes.density", float),
    "modal_damping_ratio": ("structure.damping.ratio", float),
    "m": ("mass", float),
    "c": ("viscosity", float),
    "k": ("stiffness", float),
    "k3": ("stiffness", float),
    "k_rot": ("compliance", lambda stiffness: 1 / stiffness),
    "eta": ("loss_factor", float),
    "tau": ("delay", float),
    "factor": ("error", lambda factor: factor - 1),
    "f_absorber_hz": ("frequency", float),
    "f0": ("frequency", float),
    "zeta": ("damping_ratio", float),
    "force": ("tension", float),
}


def true_values(truth):
    """True values of unknowns, by the end of their names."""
    for name, value in truth["h_true"].items():
        yield OURS[name][0], OURS[name][1](value)
    for kind, transducers in (("sensor", truth["sensors"]), ("actuator", truth["actuators"])):
        for transducer in transducers:
            name = f"{kind}.{transducer['id']}"
            yield from coordinates(f"{name}.position", transducer["true_position"])
            for number, angle in enumerate(transducer["true_angles_rad"], start=1):
                yield f"{name}.angles.{number}", angle
    for effect in truth["effects"]:
        for name, value in effect["parameters"].items():
            ours, convert = OURS.get(name, (name, lambda quantity: quantity))
            if name == "position":
                yield from coordinates(f"{effect['name']}.at", value)
            elif isinstance(convert(value), float):
                yield f"{effect['name']}.{ours}", convert(value)


def coordinates(name, place):
    """Where something is: on a line by one number, in space by three."""
    yield name, place[0]
    yield from (
        (f"{name}.{axis}", coordinate) for axis, coordinate in zip("xyz", place, strict=True)
    )


def outside(step, truth):
    """True values that lie outside their 99 % interval."""
    sentences = []
    for ending, value in true_values(truth):
        for name, estimate in step.parameters.items():
            if name.endswith(ending) and not estimate.low <= value <= estimate.high:
                sentences.append(f"{name} {value:g} not in {estimate.low:g} to {estimate.high:g}")
    return sentences


def withheld(study):
    """The study as its files would be read without their coherence: the noise is not known."""
    is_single = isinstance(study.measurement, bp.Measurement)
    runs = [study.measurement] if is_single else study.measurement
    bare = [replace(run, coherence=None, averages=None) for run in runs]
    experiment = eqx.tree_at(
        lambda tree: tree.noise, study.experiment, noise_by_data(bare), is_leaf=is_noise
    )
    return study._replace(experiment=experiment, measurement=bare[0] if is_single else tuple(bare))


def is_noise(leaf):
    return isinstance(leaf, Noise)


def verdict(shared_data, number, prepared=lambda study: study):
    """Whether the verdict on a case is its truth, and the ledger; all of it is printed."""
    folder = next((shared_data / "cases").glob(f"{number}_*"))
    truth = json.loads((shared_data / f"cases/truth/{folder.name}.json").read_text())
    study = prepared(case.read(folder))
    ledger = improve(study.experiment, study.measurement)
    hidden = sorted(effect["name"] for effect in truth["effects"] if effect["name"] != "none")
    is_right = sorted(ledger.verdict) == hidden
    first, last = ledger.steps[0], ledger.steps[-1]
    print(
        f"{number}: {' + '.join(ledger.verdict) or 'nothing'} "
        f"({'right' if is_right else 'WRONG: ' + ' + '.join(hidden)}), chi2 per datum "
        f"{first.chi2_per_datum:.3g} -> {last.chi2_per_datum:.4g} (truth "
        f"{truth['chi2']['truth']:.4g}), {ledger.seconds:.0f} s, "
        f"confounded {ledger.confounded}, outside: {outside(last, truth) or 'none'}"
    )
    print(f"    {last.setting}")
    for name, estimate in last.parameters_of_added().items():
        print(f"    {name} {estimate}, 99 %: {estimate.low:.6g} to {estimate.high:.6g}")
    print(f"    truth: {truth['effects']}", flush=True)
    return is_right, ledger


@pytest.mark.parametrize(
    ("name", "cases", "least", "median", "longest"),
    [("lines", CASES, 7, 20, 60), ("frames and plates", MODELS, 3, 45, 90)],
    ids=["lines", "models"],
)
def test_open_cases(shared_data, page, name, cases, least, median, longest):
    verdicts = []
    for number in cases:
        verdicts.append(verdict(shared_data, number))
        page.add(f"open case {number}", verdicts[-1][1].seconds, "s", at_most(longest))
    seconds = [ledger.seconds for _, ledger in verdicts]
    page.add(f"open {name}, median", np.median(seconds), "s", at_most(median))
    right = page.add(f"open {name}, right verdicts", summary(verdicts), "", at_least(least))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    page.add(f"open {name}, peak memory", peak, "GiB", at_most(MEMORY))
    assert right.met


@pytest.mark.parametrize(("cases", "least"), [(CASES, 7), (MODELS, 3)], ids=["lines", "models"])
def test_open_cases_without_their_coherence(shared_data, cases, least):
    verdicts = {number: verdict(shared_data, number, withheld) for number in cases}
    assert summary(list(verdicts.values())) >= least
    assert all(verdicts[number][1].verdict == () for number in cases if number in INTACT)


def summary(verdicts):
    """Number of right verdicts; with time and memory it is printed."""
    right = sum(is_right for is_right, _ in verdicts)
    seconds = [ledger.seconds for _, ledger in verdicts]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{right} of {len(verdicts)} right; median {np.median(seconds):.0f} s, longest ", end="")
    print(f"{max(seconds):.0f} s; peak memory {peak:.2f} GiB")
    return right


def test_false_alarms():
    claims = []
    for seed in range(DRAWS):
        experiment, measurement = experiment_of(draw(seed))
        # improve claims nothing where the model as given passes its check; only then is it asked.
        if p_value(null_hypothesis(experiment, experiment.data(measurement))) < LEVEL:
            ledger = improve(experiment, measurement)
            claims += [(seed, ledger.verdict)] if ledger.verdict else []
    print(f"{len(claims)} claims of {DRAWS} structures with nothing missing: {claims}")
    assert len(claims) <= 3


@pytest.mark.parametrize("first", range(0, DRAWS, 10))
def test_power(first):
    right = 0
    for seed in range(first, first + 10):
        began, hidden = time.perf_counter(), draw(seed, "any", after_fit=True)
        ledger = improve(*experiment_of(hidden))
        is_right = ledger.verdict == (hidden.hidden.name,)
        right += is_right
        print(
            f"{seed}: {hidden.hidden.name}, found {' + '.join(ledger.verdict)}, "
            f"{'right' if is_right else 'WRONG'}, {time.perf_counter() - began:.0f} s"
        )
    assert right >= 9
