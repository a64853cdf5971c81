"""Warnings point at the line of the user."""

import pytest

INSIDE = """
from bayes_placement._shared.errors import warn

def first(call):
    return second(call)

def second(call):
    return call() if call else warn("The posterior is flat.")
"""
"""Functions of a module of the package."""


@pytest.fixture
def module():
    namespace = {"__name__": "bayes_placement.somewhere"}
    exec(INSIDE, namespace)
    return namespace


def test_a_warning_names_the_line_that_called_the_package(module):
    with pytest.warns(UserWarning, match="flat") as warned:
        module["first"](None)
    assert warned[0].filename == __file__


def test_also_where_the_package_calls_the_user_back(module):
    def of_the_user():
        return module["first"](None)

    with pytest.warns(UserWarning, match="flat") as warned:
        module["first"](of_the_user)
    line = test_also_where_the_package_calls_the_user_back.__code__.co_firstlineno + 5
    assert (warned[0].filename, warned[0].lineno) == (__file__, line)
