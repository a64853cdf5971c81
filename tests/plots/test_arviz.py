"""What arviz-plots draws of a result: ranks, predictions, energy, sensitivity to priors."""

import warnings

import arviz_plots
import arviz_stats
import matplotlib
import matplotlib.pyplot as plt
import numpyro.distributions as dist
import pytest
from matplotlib.text import Text

import bayes_placement as bp
from bayes_placement.inference.infer import InferenceWarning
from models import bar
from tests.plots.test_posterior import POSITION, RATIO, result


@pytest.fixture(autouse=True)
def _without_a_screen():
    matplotlib.use("agg")
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def chains():
    """A posterior by chains, whose prior is not uniform."""
    experiment = bar.placed(
        0.25, 0.30, bp.noise.FromCoherence(), structure=bar.bar(dist.LogNormal(-3.3, 0.3))
    )
    engine = bp.engines.NUTS(chains=2, warmup=100, draws=50)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InferenceWarning)  # a short run
        return bp.infer(experiment, bar.measurement, engine=engine, key=1)


def test_arviz_draws_a_result():
    arviz_plots.plot_forest(result(), backend="matplotlib")
    texts = {text.get_text() for text in plt.gcf().findobj(Text)}
    assert {RATIO, POSITION} <= texts


IS_OF_0 = arviz_plots.__version__.startswith("0.")
OF_1 = pytest.mark.skipif(IS_OF_0, reason="arviz-plots 0.8 fails on any tree with xarray of today")


@pytest.mark.parametrize(
    "name",
    ["ppc_dist", "loo_pit", "energy", "trace", "rank", pytest.param("psense_dist", marks=OF_1)],
)
@pytest.mark.filterwarnings("ignore")  # of libraries about each other
def test_arviz_draws_predictions_energy_and_sensitivity(chains, name):
    getattr(arviz_plots, f"plot_{name}")(chains, backend="matplotlib")
    assert plt.get_fignums()


@pytest.mark.long
def test_arviz_tells_the_sensitivity_to_the_prior(chains):
    table = arviz_stats.psense_summary(chains)
    assert table.loc["structure.damping.ratio.1", "prior"] > 0


def test_observed_data_are_what_was_measured_alone(chains):
    assert list(chains["observed_data"].data_vars) == ["measured"]
    assert {"deviation", "receptance", "log_jacobian"} <= set(chains["constant_data"].data_vars)
    assert list(chains["log_prior"].data_vars) == ["structure.damping.ratio.1"]
