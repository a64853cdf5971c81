"""What the live page of a command can be saved as."""

import json

import cloudpickle
import pytest

import bayes_placement as bp
from bayes_placement.cli import explore
from bayes_placement.cli._inputs import Inputs
from bayes_placement.cli._missing_effects import Request
from bayes_placement.cli._result_folder import ResultFolder
from bayes_placement.cli._run import Output
from bayes_placement.cli._terminal import Screen
from bayes_placement.explorer.candidates import added
from bayes_placement.explorer.live import LivePage
from bayes_placement.explorer.session import Session
from tests.io.case.test_folder import written


def request(path, **further):
    output = Output(ResultFolder(path.parent, path.parent))
    return Request(path, None, None, output, None, **further)


def page_of(session):
    """A page as those who save it see it."""
    page = object.__new__(LivePage)
    page.session = session
    return page


@pytest.mark.parametrize("what", ["model", "case"])
def test_a_page_of_a_case_is_saved_as_a_case_and_as_a_model_file_that_reads_it(tmp_path, what):
    folder = tmp_path / "bar"
    folder.mkdir()
    study = bp.io.case.read(written(folder))
    session = Session(study.experiment, study.measurement)
    session.do(added(session.model.experiment, "point_mass", at=(0.3, 0.0, 0.0)))
    saves = explore._saves(request(folder))
    path = saves[what](page_of(session))
    assert path == tmp_path / ("bar_explored_1.py" if what == "model" else "bar_explored_1")
    again = (bp.io.model if what == "model" else bp.io.case).read(path)
    assert [effect.name for effect in again.experiment.effects] == ["point_mass"]
    assert saves[what](page_of(session)).stem == "bar_explored_2"


def test_a_model_file_is_saved_as_a_model_file_alone(tmp_path):
    # The structure of a case is told by words, which nobody finds in Python.
    assert [*explore._saves(request(tmp_path / "model.py"))] == ["model"]
    assert [*explore._saves(request(tmp_path, model_error=True))] == ["model"]


@pytest.mark.long
def test_what_a_worker_writes_as_a_report_is_noted_in_the_run(tmp_path):
    folder = tmp_path / "bar"
    folder.mkdir()
    study = bp.io.case.read(written(folder))
    session = Session(study.experiment, study.measurement)
    page = page_of(session)
    page.ledger = None
    run = request(folder).output.begin("explore", folder)
    report = explore.PageReport(Inputs(Screen.of(True, False), run, study, study.measurement, []))
    shares = []
    in_worker = cloudpickle.loads(cloudpickle.dumps(report.writer(page)))
    path = report.take_over(in_worker(shares.append))
    assert path.name == "report.html" and path.exists()
    assert {"misfit.csv", "misfit.txt", "findings.nc"} <= {*run.files}
    assert json.loads((run.top / "run.json").read_text())["explore"]["files"] == run.files
    assert shares == sorted(shares) and shares[-1] == 1.0
