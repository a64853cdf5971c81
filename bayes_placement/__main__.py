"""The command line: `python -m bayes_placement` is `bayes-placement`."""

from .cli.app import app

app(prog_name="bayes-placement")
