"""A separate process that runs a reader: `python _child.py READER.py FILE RESULT.npz CPU_SECONDS`.

Further arguments of the reader, by name, come as JSON on standard input.
Damaged files make some libraries run for ever, exit or take all memory. Nothing of this package is
imported here.
"""

import json
import runpy
import struct
import sys
import warnings

import numpy as np

MEMORY_BYTES = 8 << 30
OF_PROGRAMS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    NameError,
    RecursionError,
    TypeError,
    struct.error,
)
"""Errors that libraries do not raise of a file, but of what they did with it."""


def main(reader: str, path: str, result: str, cpu_seconds: str) -> None:
    """Write the arrays that the function `read` of a reader returns, and its metadata as JSON."""
    _limit(int(cpu_seconds))
    warnings.simplefilter("ignore")  # of other libraries; some print their own complaints
    arrays, metadata = runpy.run_path(reader)["read"](path, **json.load(sys.stdin))
    text = np.array(json.dumps({**metadata, "names": list(arrays)}))
    numbered = {f"array {number}": values for number, values in enumerate(arrays.values())}
    np.savez(result, metadata=text, **numbered)


def _limit(cpu_seconds: int) -> None:
    """Limit the memory and the time of this process."""
    try:
        import resource
    except ImportError:  # not on this system
        return
    for kind, wanted in ((resource.RLIMIT_AS, MEMORY_BYTES), (resource.RLIMIT_CPU, cpu_seconds)):
        _, most = resource.getrlimit(kind)
        limit = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
        resource.setrlimit(kind, (limit, most))


def in_words(error: BaseException) -> str:
    """What an error says of the file, in words of no program."""
    if isinstance(error, OF_PROGRAMS) or not str(error):
        return "its content is not what its beginning announces"
    return f"its reader ended with {error}" if isinstance(error, SystemExit) else str(error)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except (Exception, SystemExit) as error:  # noqa: BLE001, libraries raise any exception
        sys.exit(in_words(error))
