"""Every public name has an example in its docstring, and all of them run as they stand."""

import doctest
import io
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest

import bayes_placement as bp
from tests.code_blocks import blocks
from tests.test_pages import PAGES, documented
from tests.test_public_calls import public


def examples():
    """Docstrings of all that is public or in the reference, by name, each once."""
    named = {}
    for name, value in [*public(bp), *documented()]:
        if callable(value):
            named.setdefault(id(value), (name, value.__doc__ or ""))
    return dict(named.values())


def test_every_public_name_has_an_example():
    named = examples()
    assert len(named) > 200
    section = re.compile(r"^ *Examples\n *-{8}\n *>>> ", re.MULTILINE)
    assert [name for name, text in named.items() if not section.search(text)] == []


@pytest.mark.long
def test_every_example_runs_and_shows_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    names = {}
    for block in blocks((PAGES / "reference" / "index.md").read_text()):
        exec(block.code, names)
    runner, output = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE), io.StringIO()
    for name, text in examples().items():
        example = doctest.DocTestParser().get_doctest(text, names, name, None, 0)
        with np.printoptions(legacy=False):  # a library of another test may have changed it
            runner.run(example, out=output.write)
        plt.close("all")
    assert not output.getvalue(), output.getvalue()
    assert runner.summarize(verbose=False).attempted > 400
