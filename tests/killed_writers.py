"""Processes that write result files until they are killed, and what they leave.

Run as a program with a folder and a number of moments: it forks a process that writes for each
moment, kills it, and ends with an error where a file is not complete.
"""

import os
import random
import signal
import sys
import time
from pathlib import Path

import numpy as np

from bayes_placement._shared.files import write_atomically

SIZE = 200_000


def write(folder):
    """Write files over and over, each filled with one number."""
    for number in range(10**9):
        write_atomically(folder / "result.npz", lambda path, n=number: np.savez(path, a=filled(n)))
        write_atomically(folder / "result.txt", lambda path, n=number: path.write_text(text(n)))


def filled(number):
    return np.full(SIZE // 8, number)


def text(number):
    return f"{number % 10}" * SIZE


def check(folder):
    """Refuse files that are not complete."""
    with np.load(folder / "result.npz") as arrays:
        values = arrays["a"]
        assert values.size == SIZE // 8 and np.all(values == values[0])
    content = (folder / "result.txt").read_text()
    assert len(content) == SIZE and set(content) == {content[0]}


def main(folder, moments):
    wait, leftovers = random.Random(5), 0
    for _ in range(moments):
        writer = os.fork()
        if not writer:
            write(folder)
        while not (folder / "result.txt").exists():
            time.sleep(0.001)
        time.sleep(wait.uniform(0.0, 0.05))
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        check(folder)
        leftovers += len(list(folder.iterdir())) - 2
    sys.stdout.write(f"{leftovers}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
