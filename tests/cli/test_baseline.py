"""What is said where a model does not explain the baseline that was given."""

from pathlib import Path
from unittest.mock import Mock

import pytest

from bayes_placement.cli import improve
from bayes_placement.cli._missing_effects import Request
from bayes_placement.cli._terminal import Screen
from bayes_placement.criticism.missing.ledger import Ledger
from bayes_placement.criticism.missing.table import AS_STATED, Row, TableOfFits


def said(baseline, p_value, path="model.py"):
    """Lines that are shown after a search with a baseline, which fits with so much probability."""
    squares = {0.0: 3000.0, 0.5: 1000.0}[p_value]
    row = Row((), 0.0, squares, data=1000, determined=4.0)
    ledger = Mock(spec=Ledger, rows=TableOfFits([row], baseline=row), policy=AS_STATED)
    request = Mock(spec=Request, baseline=baseline, path=Path(path))
    screen = Mock(spec=Screen)
    improve._baseline_first(request, ledger, screen)
    return [call.args[0] for call in screen.text.call_args_list]


@pytest.mark.parametrize(("folder", "completed"), [(False, "completed.py"), (True, "completed")])
def test_a_baseline_that_is_not_explained_comes_first(tmp_path, folder, completed):
    path = tmp_path if folder else tmp_path / "model.py"
    (line,) = said(Path("before.uff"), 0.0, path)
    command = f"bayes-placement improve {path} --data before.uff --save {completed}"
    assert line == f"The baseline first: {command}"


def test_one_that_is_explained_or_not_a_file_needs_no_command():
    assert said(Path("before.uff"), 0.5) == []
    assert said(None, 0.0) == []
