"""`bayes-placement import`: files of other programs as a case folder."""

from functools import partial
from pathlib import Path

from .._shared.files import write_atomically
from ..io import case, mapped, uff
from ..io._gate import files_read
from ._run import Output

DATA, REPORT = "measured.uff", "import_report.txt"


def run(path: Path, mapping: Path | None, output: Output) -> int:
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
