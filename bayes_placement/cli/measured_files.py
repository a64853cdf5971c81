"""`bayes-placement identify` and `import`: what is made of measured files without a model."""

import json
from functools import partial
from pathlib import Path

from .._shared.errors import UsageError
from .._shared.files import write_atomically
from ..experiment.identification import Side, identified
from ..experiment.measurement import Measurement
from ..io import case, formats, mapped, uff
from ..io._gate import files_read
from ._run import Output
from ._terminal import command_on

MODES = "modes.npz"


def run_identify(path: Path, shapes_at: Side, output: Output) -> int:
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


DATA, REPORT = "measured.uff", "import_report.txt"


def run_import(path: Path, mapping: Path | None, output: Output) -> int:
    """Read a file, write a case folder, or the data alone where nothing is said of a structure.

    The file may be a folder with data, mapping and channel table; a mapping says what a file does
    not.
    """
    with files_read() as files:
        imported = mapped.read(path, mapping)
    out, stated = output.folder.path, imported.mapping.case
    run = output.begin("import", path, files=files)
    if stated is None:
        write = partial(uff.write, measurement=imported.measurement, binary=True)
        write_atomically(out / DATA, write)
    else:
        case.write(out, imported.measurement, imported.channels, stated)
    run.text(REPORT, str(imported.report))
    words = imported.report.words()
    output.screen.list(words)
    verdict = _next(out, is_case=stated is not None)
    output.screen.verdict(verdict)
    return run.finish(output.screen, verdict, {"sentences": words})


def _next(out: Path, *, is_case: bool) -> str:
    """What was written, and what to do with it."""
    if is_case:
        return f"A case was written. Next: bayes-placement improve {out}"
    return (
        f"FRFs were written. Next: bayes-placement improve model.py --data {out / DATA}. To "
        "write a case with its structure, add the line [case] to the mapping and import again: the "
        "lines that a case needs are then listed."
    )
