"""Effects on a few of many channels: screened by what they could explain at most, then fitted."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing import _more_effects
from bayes_placement.criticism.missing._at_channels import data_changed
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._more_effects import single_effects, with_channels
from bayes_placement.criticism.missing._scanned_candidates import scanned
from bayes_placement.criticism.missing._swapped_pairs import _costs, likeliest
from bayes_placement.criticism.reach._left_out import LeftOut
from bayes_placement.inference.chi2 import LEVEL
from bayes_placement.inference.engines.levenberg_marquardt import minimise
from tests.criticism.small import GAIN, MASS, TRUTH, experiment, measured, recorded

KINDS = ["point_mass", "gain_error"]


@pytest.fixture(scope="module")
def nulls():
    """The model fitted to data with a wrong gain, and with a mass."""
    return {
        name: null_hypothesis(experiment(), experiment().data(measured(hidden, seed=1)))
        for name, hidden in (("gain_error", GAIN), ("point_mass", MASS))
    }


def test_without_some_data_a_fit_is_that_to_the_others(nulls):
    """To first order: the model is about linear where the wrong gain is small."""
    null = nulls["gain_error"]
    left = np.isin(np.arange(len(null.residual)), data_changed(null, GAIN))
    weight = (~left).astype(float)
    objective = null.problem.squares.objective(weight=weight)
    _, normal = minimise(objective, null.fit.point[None], steps=20)
    found = LeftOut(null.problem, null.fit)
    np.testing.assert_allclose(found.squares(left), normal.squares[0], rtol=0.02)
    curved = np.linalg.slogdet(
        null.problem.squares.objective().normal_equations(null.fit.point[None]).curvature[0]
    )[1]
    volume = 0.5 * (curved - np.linalg.slogdet(normal.curvature[0])[1])
    evidence = null.fit.log_evidence + null.fit.cost - normal.cost[0] + volume
    assert found.most_evidence(left) == pytest.approx(evidence, abs=1.0)


@pytest.mark.parametrize("hidden", KINDS)
def test_a_gain_is_fitted_where_it_may_win(nulls, hidden):
    """No fit of it exceeds what is taken for its greatest evidence."""
    null = nulls[hidden]
    tried = bp.effects.library(experiment(), KINDS).effects
    singles = single_effects(null, tried, lambda: None)
    assert {each.kinds for each in singles.hypotheses} == {(), ("point_mass",)}
    of_channels = with_channels(singles, LEVEL).hypotheses[len(singles.hypotheses) :]
    found = LeftOut(null.problem, null.fit)
    for each in of_channels:
        left = np.isin(np.arange(len(null.residual)), data_changed(null, each.effects[0]))
        assert each.fit.log_evidence < found.most_evidence(left)
    names = {each.effects[0].transducer for each in of_channels}
    assert ("s2" in names) == (hidden == "gain_error")


def test_pairs_are_screened_by_the_costs_of_their_scans(monkeypatch):
    """Of four sensors; at some of the lines too."""
    sensors = [
        bp.Sensor(name, at=bp.positions.Segment(place, within=0.02))
        for name, place in (("s1", 0.24), ("s2", 0.61), ("s3", 0.75), ("s4", 0.83))
    ]
    setup = bp.Experiment(
        experiment().structure,
        sensors=sensors,
        actuators=[*experiment().actuator.values()],
        frequency=experiment().frequency,
        observe=experiment().observe,
        noise=experiment().noise,
    )
    true = setup.fix(TRUTH | {"sensor.s3.position": 0.74, "sensor.s4.position": 0.84})
    swapped = true + bp.effects.swapped_sensors("s2", "s4")
    null = null_hypothesis(setup, setup.data(recorded(swapped, 0)))
    pairs = bp.effects.library(setup, ["swapped_sensors"]).effects
    expected = [each.predicted_cost for each in scanned([(null, e) for e in pairs], lambda: None)]
    np.testing.assert_allclose(_costs(null, null.problem, pairs), expected, rtol=1e-9)
    (best,) = likeliest(null, pairs, 1)
    assert best.pair == ("s2", "s4")
    monkeypatch.setattr(_more_effects, "VARIANTS", 1)
    singles = single_effects(null, pairs, lambda: None)
    assert singles.variants == {"swapped_sensors": 6} and len(singles.candidates) == 1
