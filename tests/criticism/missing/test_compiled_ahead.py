"""Problems come in their order, compiled, and few are taken before they are due."""

import threading

import pytest

from bayes_placement.criticism.kept_fits import fits_kept_in, folder_of_fits
from bayes_placement.criticism.missing._compiled_ahead import AHEAD, compiled_ahead
from bayes_placement.inference.residuals import Problem

SECONDS = 20.0
"""How long a compilation waits for what it needs; never, where they go on at once."""


class Fake(Problem):
    """A problem whose compilation waits for another one, or fails."""

    def __init__(self, after=None, error=None):
        self.after, self.error, self.done = after, error, threading.Event()

    def prepare(self):
        """Pretend to compile."""
        if self.after is not None and not self.after.done.wait(SECONDS):
            raise TimeoutError("the next problem was not compiled meanwhile")
        if self.error is not None:
            raise self.error
        self.done.set()


def test_problems_come_in_their_order_and_compiled():
    second = Fake()
    problems = [Fake(after=second), second, *(Fake() for _ in range(3 * AHEAD))]
    came = []
    for problem in compiled_ahead(iter(problems)):
        assert problem.done.is_set()
        came.append(problem)
    assert came == problems  # the first was compiled after the second


def test_the_next_problems_are_compiled_while_one_is_fitted():
    problems = [Fake() for _ in range(2 + AHEAD)]
    for number, _ in enumerate(compiled_ahead(iter(problems))):
        for following in problems[number + 1 : number + 1 + AHEAD]:
            assert following.done.wait(SECONDS)


def test_few_problems_are_taken_before_they_are_due():
    problems = []

    def counted():
        for _ in range(5 * AHEAD):
            problems.append(Fake())
            yield problems[-1]

    for number, _ in enumerate(compiled_ahead(counted())):
        assert len(problems) - number <= AHEAD + 1
    assert len(problems) == 5 * AHEAD


def test_a_compilation_that_fails_is_told_where_its_problem_is_due():
    error = ValueError("this one cannot be compiled")
    problems = [Fake(), Fake(error=error), Fake()]
    coming = compiled_ahead(iter(problems))
    assert next(coming) is problems[0]
    with pytest.raises(ValueError, match="cannot be compiled"):
        next(coming)


def test_a_compilation_knows_where_fits_are_kept(tmp_path):
    folders = []

    class Asking(Fake):
        def prepare(self):
            folders.append(folder_of_fits())

    with fits_kept_in(tmp_path):
        assert len([*compiled_ahead([Asking(), Asking()])]) == 2
    assert folders == [tmp_path, tmp_path]


def test_of_no_problem_none_comes():
    assert list(compiled_ahead([])) == []
