"""Files that are complete or not there at all."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path


def write_atomically(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Write a temporary file in the same folder and rename it once it is complete.

    Parameters
    ----------
    path
        Where the file is to be; its folder is made.
    write
        Called with the path of a temporary file of the same suffix.

    Returns
    -------
    Path
        The path.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(
        suffix=target.suffix, prefix=f".{target.stem}-", dir=target.parent
    )
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        temporary.chmod(0o644)  # temporary files are private, results are not
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    return target
