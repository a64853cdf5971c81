"""The command line: `python -m bayes_placement` is `bayes-placement`."""

from .cli._program import run

run()
