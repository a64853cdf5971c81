"""What is advised, as a line of Python and as a command: each way of use reads its own."""

import re
from typing import NamedTuple


class Advice(NamedTuple):
    """One piece of advice; sentences hold its Python, for which the command line has a command."""

    python: str
    command: str


SAMPLED = Advice(
    "bp.infer(ledger.experiment, measurement, engine=bp.engines.SMC())",
    "improve --save new.py, then bayes-placement update new.py --engine smc,",
)
BEGUN_AT_MORE = Advice(
    "check(infer(..., engine=bp.engines.MAP(starts=128)))",
    "engine = bp.engines.MAP(starts=128) in the model file",
)
SIZES_OF_ERRORS = Advice("model_error=bp.model_error.Embedded()", "model_error in the model file")
BASELINE = Advice("baseline=before", "--baseline before.uff")
SMC = Advice("engines.SMC()", "bayes-placement update --engine smc")
MORE_STARTS = Advice("MAP(starts=128)", "engine = bp.engines.MAP(starts=128) in the model file")
MORE_NODES = Advice("Grid(nodes=96)", "engine = bp.engines.Grid(nodes=96) in the model file")

COMMANDS = dict((SAMPLED, BEGUN_AT_MORE, SIZES_OF_ERRORS, BASELINE, SMC, MORE_STARTS, MORE_NODES))
"""Command in the place of each line of Python; of two that begin alike the longer comes first."""


def in_commands(sentence: str) -> str:
    """Return a sentence with its advice in commands, or in a line of the model file."""
    lines = "|".join(map(re.escape, COMMANDS))
    return re.sub(rf"(?<![.\w])(?:{lines})", lambda found: COMMANDS[found[0]], sentence)
