"""_files: in, a path and a function that writes; out, the whole file, or what was there before.

Not known here: what is written.
"""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Write a file beside its place and move it there once it is whole.

    Parameters
    ----------
    path
        Where the file is to be; its folder is made.
    write
        Called with the path of a temporary file of the same ending.

    Returns
    -------
    Path
        The path.
    """
    place = Path(path)
    place.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=place.suffix, prefix=f".{place.stem}-", dir=place.parent)
    os.close(handle)
    beside = Path(name)
    try:
        write(beside)
        beside.chmod(0o644)  # temporary files are private, results are not
        beside.replace(place)
    finally:
        beside.unlink(missing_ok=True)
    return place
