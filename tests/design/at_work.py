"""Tasks of worker processes that import neither JAX nor anything heavy.

`python -m tests.design.at_work LOG` begins two workers that write down who they are, and waits.
"""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

import bayes_placement as bp


def stop_once(marker, number):
    """Return ten times a number, but kill the worker that has the sixth, the first time."""
    if number == 5 and first(marker):
        stop(number)
    return np.array([10 * number])


def first(marker):
    """Tell whether nobody asked before, and write down who did."""
    try:
        with marker.open("x") as stream:
            stream.write(str(os.getpid()))
    except FileExistsError:
        return False
    return True


def stop(_):
    """Kill the worker."""
    os.kill(os.getpid(), signal.SIGKILL)


def note(log):
    """Write down who this is."""
    with log.open("a") as stream:
        stream.write(f"{os.getpid()}\n")
    time.sleep(0.5)


def main(log):
    """Begin two workers and wait."""
    with bp.design.workers(2) as executor:
        for _ in range(2):
            executor.submit(note, Path(log))
        time.sleep(60)


if __name__ == "__main__":
    main(*sys.argv[1:])
