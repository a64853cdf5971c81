"""Commands that are killed at random moments, and the files that they leave.

A file that is not complete is an error, and so is a last run that does not end as the first.
"""

import random
import signal
import subprocess
import sys
import time
import zipfile

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.image import imread

from tests.cli.studies import EXPERIMENT
from tests.io.test_properties import bar_measurement

STUDY = EXPERIMENT + "measurement = experiment.nominal_measurement()\n"
MAPPING = """frf = { array = "frf", axes = ["sensor", "actuator", "frequency"], unit = "m/s^2/N" }
frequency = { array = "frequency", unit = "Hz" }
sensors = ["s1"]
actuators = ["a1"]
file = "measured.npz"
"""


def words(command, folder):
    """Words of a command."""
    study, out = folder / "study.py", folder / "out"
    return {
        "update": ["update", study, "--engine", "importance", "--out", out],
        "check": ["check", study, "--out", out],
        "improve": ["improve", study, "--effects", "point_mass,time_delay", "--out", out],
        "place": ["place", study, "--places", "4", "--lines", "2", "--out", out],
        "report": ["report", folder / "checked", "--to", out / "report.html"],
        "import": ["import", folder / "mapping.toml", "--out", out],
    }[command]


def begun(arguments, log):
    """A process that runs a command."""
    command = [sys.executable, "-m", "bayes_placement", *map(str, arguments)]
    with log.open("w") as output:
        return subprocess.Popen(command, stdout=output, stderr=output)


def finished(arguments, log):
    """Duration of a run that is let alone."""
    began = time.monotonic()
    assert begun(arguments, log).wait() in (0, 1), log.read_text()
    return time.monotonic() - began


def check(path):
    """Refuse a file that is not complete."""
    assert path.stat().st_size > 0, path
    if path.suffix == ".png":
        assert imread(path).size
    elif path.suffix == ".csv":
        assert len(pd.read_csv(path).columns)
    elif path.suffix == ".nc":
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            tree.load()
    elif path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
        with np.load(path) as arrays:
            assert [arrays[name] for name in arrays.files]
    elif path.suffix == ".html":
        assert path.read_text().rstrip().endswith("</html>")
    elif path.suffix == ".json":
        pd.read_json(path, typ="series")
    elif path.suffix in (".txt", ".uff"):
        assert path.read_bytes().endswith(b"\n")


def files(out):
    """Files that are not hidden."""
    return [path for path in out.rglob("*") if path.is_file() and not path.name.startswith(".")]


def prepare(folder):
    """Write what the commands are given."""
    (folder / "study.py").write_text(STUDY)
    (folder / "mapping.toml").write_text(MAPPING)
    measured = bar_measurement()
    np.savez(folder / "measured.npz", frf=measured.frf, frequency=measured.frequency)


def killed_at(folder, command, moments):
    """How many runs of a command were killed before their end."""
    prepare(folder)
    log, out = folder / "said", folder / "out"
    if command == "report":
        finished(["check", folder / "study.py", "--out", folder / "checked"], log)
    arguments, chance = words(command, folder), random.Random(command)
    duration = finished(arguments, log)
    expected = {path.relative_to(out) for path in files(out)}
    for path in sorted(out.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    killed = 0
    for _ in range(moments):
        process = begun(arguments, log)
        time.sleep(chance.uniform(0.0, duration))
        process.kill()
        killed += process.wait() == -signal.SIGKILL
        for path in files(out):
            check(path)
    finished(arguments, log)
    assert {path.relative_to(out) for path in files(out)} == expected
    hidden = [path for path in out.rglob(".*") if path.is_file()]
    assert not hidden, hidden
    return killed
