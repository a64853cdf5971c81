"""`bayes-placement identify`: modal parameters from measured FRFs, without a model."""

import json
from pathlib import Path

from .._shared.errors import UsageError
from ..experiment.identification.identify import Side, identified
from ..experiment.measurement import Measurement
from ..io import formats
from ..io._gate import files_read
from ._next_command import command_on
from ._run import Output

MODES = "modes.npz"


def run(path: Path, shapes_at: Side, output: Output) -> int:
    """Identify modal parameters, and write a file of them that `--data` takes.

    Shapes are those at the sensors or at the actuators.
    """
    with files_read() as files:
        measurement = formats.read_measurement(path)
    if not isinstance(measurement, Measurement):
        raise UsageError(
            f"{path} holds FRFs at {len(measurement)} force levels; those of one are needed, since "
            "modes of a structure that depends on the level are not the same in all. Give a file "
            "of one level."
        )
    modes, words = identified(measurement, shapes_at)
    run = output.begin("identify", path, files=files, shapes_at=shapes_at)
    output.screen.verdict(repr(modes))
    table = modes.table()
    output.screen.table(table.map("{:.5g}".format), "mode")
    output.screen.list(words)
    run.table("frequencies_and_damping.csv", table)
    run.modes(MODES, modes)
    following = command_on("improve", Path("model.py"), run.folder / MODES)
    output.screen.text(f"Next: {following}")
    result = {"modes": json.loads(table.to_json()), "sentences": list(words)}
    return run.finish(output.screen, repr(modes), result)
