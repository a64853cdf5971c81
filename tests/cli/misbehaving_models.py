"""Model files that misbehave: a line that no model should have, at each place of one that is right.

What becomes of each is its exit code, words of its last line, and whether results are written.
"""

from typing import NamedTuple

from tests.cli.studies import EXPERIMENT


class Misbehaviour(NamedTuple):
    """A line of a model file, the exit code of `show`, and words of the complaint.

    Where it outlasts the command, that needs a process of its own.
    """

    line: str
    code: int
    words: str = ""
    alone: bool = False


ENDED = "the model file ended the program"
MISBEHAVIOURS = (
    Misbehaviour("import sys; sys.exit(0)", 3, ENDED),
    Misbehaviour("import sys; sys.exit('enough')", 3, ENDED),
    Misbehaviour("raise SystemExit", 3, ENDED),
    Misbehaviour("exit()", 3, ENDED),
    Misbehaviour("import os; os._exit(0)", 3, ENDED),
    Misbehaviour("from os import _exit; _exit(2)", 3, ENDED),
    Misbehaviour("import os; os.execlp('true', 'true')", 3, ENDED),
    Misbehaviour("import os; os.abort()", 3, ENDED),
    Misbehaviour("import os; os.fork() or os._exit(0)", 0, "", True),
    Misbehaviour("raise BaseException('odd')", 3, ENDED),
    Misbehaviour("raise GeneratorExit", 3, ENDED),
    Misbehaviour("raise StopIteration", 3, "StopIteration"),
    Misbehaviour("raise ValueError('mine')", 3, "ValueError: mine"),
    Misbehaviour("1 / 0", 3, "ZeroDivisionError"),
    Misbehaviour("raise MemoryError", 3, "MemoryError"),
    Misbehaviour("(f := lambda: f())()", 3, "RecursionError"),
    Misbehaviour("raise KeyboardInterrupt", 130, "Run it again to go on."),
    Misbehaviour("def f(:", 3, "SyntaxError"),
    Misbehaviour("import os; os.chdir('/')", 0),
    Misbehaviour("print('said by the model')", 0),
    Misbehaviour("import os; os.write(1, b'said by the model')", 0, "said", True),
    Misbehaviour("import sys; sys.stdout.close()", 0, "", True),
    Misbehaviour("import sys; sys.stdout = sys.stderr = None", 0),
    Misbehaviour("import warnings; warnings.simplefilter('error')", 0),
    Misbehaviour("import numpy; numpy.seterr(all='raise')", 0),
    Misbehaviour("import jax; jax.config.update('jax_enable_x64', False)", 3, "jax_enable_x64"),
    Misbehaviour("import jax; jax.config.update('jax_debug_nans', True)", 3, "jax_debug_nans"),
    Misbehaviour("import numpyro; numpyro.enable_x64(False)", 3, "jax_enable_x64"),
    Misbehaviour(
        "import threading as t; t.Thread(target=t.Event().wait).start()", 0, "thread", True
    ),
    Misbehaviour(
        "import threading as t; t.Timer(0, __import__('os').chdir, '/').start()", 0, "", True
    ),
)


def model_files() -> list[tuple[Misbehaviour, str]]:
    """Each misbehaviour before each statement of a small model, and behind it."""
    lines = EXPERIMENT.strip().splitlines()
    starts = [number for number, line in enumerate(lines) if line[:1] not in ("", " ", ")")]
    return [
        (each, "\n".join([*lines[:place], each.line, *lines[place:], ""]))
        for each in MISBEHAVIOURS
        for place in [*starts, len(lines)]
    ]
