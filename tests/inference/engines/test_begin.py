"""A search that begins at known values ends at the mode there, and refuses values that are none."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing.as_given import fitted_as_given
from tests.criticism.small import TRUTH, experiment, measured
from tests.inference.engines.test_mode_with_sizes import SIZE, case  # noqa: F401  a fixture


@pytest.fixture(scope="module")
def data():
    return measured(seed=1)


@pytest.fixture(scope="module")
def from_the_prior(data):
    return bp.infer(experiment(), data, engine=bp.engines.MAP(starts=8), key=1)


def modes(posterior):
    return posterior["estimates"]["mode"].values


def test_it_ends_at_the_mode_of_many_starts(data, from_the_prior):
    engine = bp.engines.MAP(begin=TRUTH)
    posterior = bp.infer(experiment(), data, engine=engine, key=1)
    np.testing.assert_allclose(modes(posterior), modes(from_the_prior), rtol=1e-5)
    assert "begin" in posterior.attrs


@pytest.mark.long
@pytest.mark.longest
def test_sizes_of_errors_begin_where_they_were(case):  # noqa: F811
    experiment, measurement = case
    fit = fitted_as_given(experiment, measurement)
    posterior = bp.infer(experiment, measurement, engine=bp.engines.MAP(begin=fit.values))
    again = float(posterior["estimates"]["mode"].sel(unknown=SIZE))
    assert again == pytest.approx(float(fit.values[SIZE]), rel=0.05)
    from_prior = bp.infer(experiment, measurement, engine=bp.engines.MAP(starts=8))
    evidences = [float(tree["estimates"]["log_evidence"]) for tree in (posterior, from_prior)]
    assert evidences[0] == pytest.approx(evidences[1], abs=0.5)


def test_a_value_that_is_missing_is_named(data):
    name, *_ = TRUTH
    others = {other: value for other, value in TRUTH.items() if other != name}
    with pytest.raises(ValueError, match=f"no value of '{name}'.*every unknown"):
        bp.infer(experiment(), data, engine=bp.engines.MAP(begin=others))


def test_a_value_outside_its_prior_is_named(data):
    name, *_ = TRUTH
    with pytest.raises(ValueError, match=rf'"{name}" is to begin at -5.0.*no density'):
        bp.infer(experiment(), data, engine=bp.engines.MAP(begin=TRUTH | {name: -5.0}))
