"""What the live page of a command can be saved as."""

import pytest

import bayes_placement as bp
from bayes_placement.cli import explore
from bayes_placement.cli._inputs import Inputs
from bayes_placement.cli._missing_effects import Request
from bayes_placement.cli._result_folder import ResultFolder
from bayes_placement.cli._run import Output
from bayes_placement.explorer.candidates import added
from bayes_placement.explorer.live import LivePage
from bayes_placement.explorer.session import Session
from tests.io.case.test_folder import written

INPUTS = Inputs(None, None, None, None, [])  # of the report alone


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
    saves = explore._saves(request(folder), INPUTS)
    path = saves[what](page_of(session))
    assert path == tmp_path / ("bar_explored_1.py" if what == "model" else "bar_explored_1")
    again = (bp.io.model if what == "model" else bp.io.case).read(path)
    assert [effect.name for effect in again.experiment.effects] == ["point_mass"]
    assert saves[what](page_of(session)).stem == "bar_explored_2"


def test_a_model_file_is_saved_as_a_model_file_alone(tmp_path):
    # The structure of a case is told by words, which nobody finds in Python.
    assert [*explore._saves(request(tmp_path / "model.py"), INPUTS)] == ["model", "report"]
    assert [*explore._saves(request(tmp_path, model_error=True), INPUTS)] == ["model", "report"]
