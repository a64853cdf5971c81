"""What is said where a model does not explain the baseline that was given."""

from pathlib import Path
from unittest.mock import Mock

from bayes_placement.cli import improve
from bayes_placement.cli._missing_effects import Request
from bayes_placement.cli._terminal import Screen
from bayes_placement.criticism.missing.ledger import Ledger
from bayes_placement.criticism.missing.table import AS_STATED, Row, TableOfFits


def said(baseline, p_value):
    """Lines that are shown after a search with a baseline, which fits with so much probability."""
    squares = {0.0: 3000.0, 0.5: 1000.0}[p_value]
    row = Row((), 0.0, squares, data=1000, determined=4.0)
    ledger = Mock(spec=Ledger, rows=TableOfFits([row], baseline=row), policy=AS_STATED)
    request = Mock(spec=Request, baseline=baseline, path=Path("model.py"))
    screen = Mock(spec=Screen)
    improve._baseline_first(request, ledger, screen)
    return [call.args[0] for call in screen.text.call_args_list]


def test_a_baseline_that_is_not_explained_is_looked_at_alone():
    (line,) = said(Path("before.uff"), 0.0)
    command = "bayes-placement improve model.py --data before.uff --alone"
    assert line == f"What is nearest for the baseline alone: {command}"


def test_one_that_is_explained_or_not_a_file_needs_no_command():
    assert said(Path("before.uff"), 0.5) == []
    assert said(None, 0.0) == []
