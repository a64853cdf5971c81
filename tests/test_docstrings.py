"""Public functions of three or more arguments say what each is, and what they return."""

import inspect
import re

import bayes_placement as bp
from tests.test_public_calls import public

FEWEST = 3
"""Arguments from which on a sentence is not enough."""


def functions():
    """Public functions with many arguments: name, signature, docstring."""
    for name, value in public(bp):
        if inspect.isroutine(value):
            signature = inspect.signature(value)
            if len(signature.parameters) >= FEWEST:
                yield name, signature, inspect.getdoc(value) or ""


def lacking(signature, text):
    """What a docstring does not describe."""
    described = re.findall(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*)$", text, re.MULTILINE)
    words = {word.strip("*") for line in described for word in line.split(", ")}
    sections = ["Parameters"] + ["Returns"] * (signature.return_annotation is not None)
    missing = [name for name in sections if f"\n{name}\n{'-' * len(name)}\n" not in text]
    return missing + [name for name in signature.parameters if name not in words]


def test_arguments_and_results_are_described():
    documented = {name: lacking(signature, text) for name, signature, text in functions()}
    assert len(documented) > 60
    assert {name: missing for name, missing in documented.items() if missing} == {}
