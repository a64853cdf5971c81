"""The report of the main example: small, soon after the answer, and in order in a browser."""

import json
import time

import pytest

import bayes_placement as bp
from bayes_placement.cli._findings import FINDINGS, of_result
from bayes_placement.plots.report import write_report
from models import hidden_effect
from tests.browser import pages
from tests.plots.report.test_report import check_page

LARGEST = 3_000_000
"""Bytes of the page."""

LONGEST = 15.0
"""Seconds after the answer."""

pytestmark = [pytest.mark.long, pytest.mark.longest, pytest.mark.usefixtures("optimised")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hidden_effect")
    experiment, measurement = hidden_effect.experiment, hidden_effect.measurement
    ledger = bp.improve(experiment, measurement)
    began = time.process_time()
    ledger.write(folder / "ledger.json")
    ledger.suspicion.to_csv(folder / "suspicion.csv", index=False)
    ledger.compared.to_csv(folder / "compared.csv", index=False)
    bp.io.netcdf.write(
        of_result(ledger, experiment, measurement, [], with_next=True), folder / FINDINGS
    )
    write_report(folder)
    # Time of the processor, since others may work beside these tests.
    (folder / "seconds.json").write_text(json.dumps(time.process_time() - began))
    return folder


def test_it_is_written_soon_after_the_answer_and_is_small(folder):
    assert json.loads((folder / "seconds.json").read_text()) < LONGEST
    assert (folder / "report.html").stat().st_size < LARGEST


def test_it_says_what_is_missing_where(folder):
    tree = check_page(folder / "report.html")
    text = " ".join(tree.itertext())
    assert "Missing: point_mass" in text
    assert "at 370" in text
    assert "mass 0.54" in text


def test_it_opens_in_a_browser(folder):
    with pages() as opened:
        page = opened(folder / "report.html")
        page.wait_for_timeout(300)
        assert page.trouble == []
        assert page.locator("article.item svg").count() >= 9
        assert page.locator("canvas").count() == 2
