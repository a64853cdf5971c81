"""Benchmarks fill one page of figures, which is printed at the end.

What tests set so that they compile less is not set for a user: it is unset here, for processes that
a benchmark starts too.
"""

import os
from pathlib import Path

import pytest

from tests.benchmarks.fresh import OF_TESTS
from tests.benchmarks.page import Page

for name in [name for name in os.environ if name.startswith(OF_TESTS)]:
    del os.environ[name]

PAGE = pytest.StashKey[Page]()


def pytest_addoption(parser):
    parser.addoption(
        "--json",
        type=Path,
        metavar="FILE",
        help="keep the figures of the page in this file; those that it holds are shown as well",
    )


def pytest_configure(config):
    if config.getoption("numprocesses", None):
        raise pytest.UsageError(
            "Benchmarks were begun on several processes; they are measured one after another, "
            "since they would disturb each other: add -n 0."
        )
    try:
        config.stash[PAGE] = Page(config.getoption("--json"))
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error


def pytest_terminal_summary(terminalreporter, config):
    page = config.stash[PAGE]
    if page.figures:
        terminalreporter.section("figures")
        for line in page.lines():
            terminalreporter.write_line(line)


@pytest.fixture
def page(request):
    """Page of figures: `page.add(name, value, unit, at_most(18.0))`."""
    return request.config.stash[PAGE]


@pytest.fixture(autouse=True)
def as_for_a_user(optimised):
    """Compile in full: `tests/conftest.py` has imported JAX by now, which keeps what it read."""
