"""What arviz-plots draws and this package does not: ranks and forests of a result."""

import arviz_plots
import matplotlib
import matplotlib.pyplot as plt
import pytest
from matplotlib.text import Text

from tests.plots.test_posterior import POSITION, RATIO, result


@pytest.fixture(autouse=True)
def _without_a_screen():
    matplotlib.use("agg")
    yield
    plt.close("all")


@pytest.mark.parametrize("draw", [arviz_plots.plot_rank, arviz_plots.plot_forest])
def test_arviz_draws_a_result(draw):
    draw(result(), backend="matplotlib")
    texts = {text.get_text() for text in plt.gcf().findobj(Text)}
    assert {RATIO, POSITION} <= texts
