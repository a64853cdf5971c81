"""Wrong calls of the API raise our own sentences, none of JAX, NumPy or SciPy."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests import wrong_calls


@pytest.fixture(scope="module")
def answers():
    """What each call said, in a process without the checks of types of the tests."""
    root = Path(__file__).parents[1]
    command = [sys.executable, "-m", "tests.wrong_calls"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", wrong_calls.CALLS)
def test_a_wrong_call_gets_a_sentence(answers, name):
    kind, words = answers[name]
    assert kind == "ours", words
    assert wrong_calls.CALLS[name][1] in words
    assert len(words) > 40


def test_there_are_many_wrong_calls():
    assert len(wrong_calls.CALLS) >= 150
