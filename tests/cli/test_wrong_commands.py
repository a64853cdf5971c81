"""Command lines that are typed wrongly: one sentence each, exit code 2 or 3, no traceback."""

import numpy as np
import pytest
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT

USAGE, REFUSED = 2, 3

FILES = {
    "empty.py": b"",
    "number.py": b"experiment = 3\n",
    "bytes.py": bytes(range(256)),
    "model.txt": b"experiment = 3\n",
    "empty.uff": b"",
    "empty.csv": b"",
    "one_row.csv": b"name,role\na,b,c\n",
    "empty.toml": b"",
    "broken.toml": b"a = [",
    "file": b"x",
    "study.py": EXPERIMENT.encode(),
    "folder/nothing.txt": b"",
    "list/case.json": b"[]",
    "empty/case.json": b"",
}

COMMANDS = {
    "check no.py": (USAGE, "There is no model file no.py. Give a Python file"),
    "check empty.py": (REFUSED, "empty.py has no `experiment`. A model file declares one"),
    "check number.py": (REFUSED, "number.py is a int; a Experiment is needed"),
    "check bytes.py": (REFUSED, "bytes.py is no Python file. Give one that defines"),
    "check model.txt": (REFUSED, "model.txt is no Python file. Give one that defines"),
    "check folder": (USAGE, "There is no file folder/case.json. A case is a folder with"),
    "check list": (REFUSED, "list/case.json holds []; one object {...} with the fields of"),
    "check empty": (REFUSED, "empty/case.json is not JSON"),
    "check measured.uff": (REFUSED, "measured.uff is no Python file"),
    "check study.py": (USAGE, "study.py declares no `measurement` and no --data file"),
    "check study.py --data no.uff": (USAGE, "There is no file no.uff"),
    "check study.py --data folder": (USAGE, "folder is a folder; a file with a measurement"),
    "check study.py --data empty.uff": (REFUSED, "empty.uff is not a universal file"),
    "check study.py --data empty.csv": (REFUSED, "empty.csv is empty (0 bytes)"),
    "check study.py --data study.py": (REFUSED, "study.py: no row of it has a number"),
    "check study.py --data empty.toml": (REFUSED, "empty.toml names no file"),
    "check study.py --data broken.toml": (REFUSED, "broken.toml cannot be read as TOML"),
    "check study.py --lines 0": (USAGE, "--lines"),
    "check study.py --lines many": (USAGE, "--lines"),
    "check study.py --engine mcmc": (USAGE, "'mcmc' is not one of"),
    "check study.py --seed -1": (USAGE, "--seed"),
    "check study.py --seed 99999999999999999999": (USAGE, "--seed"),
    "check study.py --out file": (USAGE, "--out file is a file. A folder is needed"),
    "check study.py --out file/below": (USAGE, "--out file/below cannot be written to"),
    "check study.py --nonsense": (USAGE, "No such option"),
    "check study.py more": (USAGE, "unexpected extra argument"),
    "chekc study.py": (USAGE, "No such command 'chekc'"),
    "improve study.py --effects point_mas": (USAGE, "Did you mean 'point_mass'?"),
    "improve study.py --effects ,": (USAGE, "There is no effect ''"),
    "improve study.py --alone --baseline measured.uff": (
        USAGE,
        "--alone was given beside --baseline; one of them is needed",
    ),
    "improve study.py --data measured.uff --baseline no.uff": (USAGE, "There is no file no.uff"),
    "improve study.py --state cut=measured.uff": (REFUSED, "1 states by label were given"),
    "improve study.py --state cut": (USAGE, "--state 'cut' was given; a label and a file"),
    "improve study.py --state =measured.uff": (USAGE, "a label and a file are needed"),
    "improve study.py --state a=no.uff --state b=measured.uff": (USAGE, "There is no file no.uff"),
    "improve study.py --data measured.uff --save study.py": (USAGE, "which is there already"),
    "improve study.py --data measured.uff --save out.txt": (USAGE, "no name of a Python file"),
    "explain study.py --effects mass": (USAGE, "There is no effect 'mass'"),
    "explain study.py --effects listd": (USAGE, "Did you mean 'listed'?"),
    "update study.py --data measured.uff --engine all --marginal kde": (
        USAGE,
        "beside --engine all",
    ),
    "update study.py --engine smc --marginal none": (USAGE, "'none' is not one of"),
    "place study.py --places 0": (USAGE, "--places"),
    "place study.py --noise -1": (REFUSED, "a standard deviation of -1"),
    "place study.py --least-distance -1": (REFUSED, "least_distance=-1 was given; a distance [m]"),
    "place study.py --forbidden 0.5": (USAGE, "--forbidden '0.5' was given; the least and the"),
    "place study.py --forbidden 0.5:0.4": (REFUSED, "The forbidden region 0.5 to 0.4 m was given"),
    "place study.py --forbidden 300:400": (REFUSED, "which lies outside the structure (0 to 1 m)"),
    "place study.py --cost s1": (USAGE, "--cost 's1' was given; a transducer and the information"),
    "place study.py --cost s1=nan": (USAGE, "--cost 's1=nan' was given; a transducer and the"),
    "place study.py --cost s9=0.1": (REFUSED, 'A cost of 0.1 nat of "s9" was given'),
    "place study.py --about damping": (REFUSED, "about=['damping'] was given; names of unknown"),
    "place study.py --sensors 0": (USAGE, "--sensors 0 was given; at least one sensor"),
    "place study.py --search best": (USAGE, "'best' is not one of"),
    "place study.py --workers 0": (USAGE, "--workers"),
    "report nowhere": (USAGE, "There is no folder nowhere. Results are written by"),
    "report file": (USAGE, "There is no folder file. Results are written by"),
    "report folder": (REFUSED, "folder holds no results"),
    "import no.mat": (USAGE, "There is no file no.mat; a file of measured FRFs is needed"),
    "import folder": (REFUSED, "folder/nothing.txt is empty (0 bytes)"),
    "import empty.uff": (REFUSED, "empty.uff is empty (0 bytes)"),
    "import measured.uff --mapping no.toml": (USAGE, "There is no file no.toml; a mapping"),
    "import measured.uff --mapping broken.toml": (REFUSED, "broken.toml cannot be read as TOML"),
    "import measured.uff --out file": (USAGE, "--out file is a file. A folder is needed"),
    "show no.py": (USAGE, "There is no model file no.py"),
    "show folder": (USAGE, "There is no file folder/case.json"),
    "show empty.uff": (REFUSED, "empty.uff is not a universal file"),
    "init file": (USAGE, "file is a file; a folder is needed, which is made if it is not"),
    "init study.py": (USAGE, "study.py is a file; a folder is needed, which is made if it is"),
    "init new --channels no.csv": (USAGE, "There is no file no.csv; a channel table is needed"),
    "init new --channels folder": (USAGE, "folder is a folder; a channel table is needed"),
    "init new --channels empty.csv": (REFUSED, "it has no row. Its first row names the columns"),
    "init new --channels one_row.csv": (REFUSED, "or left over. Its first row names the columns"),
}
"""Exit code of each command, and words of its sentence."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with files of many kinds, and a measurement."""
    folder = tmp_path_factory.mktemp("commands")
    for name, content in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    measurement = bp.Measurement.from_arrays(
        np.array([1 + 1j, 2 + 1j]),
        [150.0, 166.0],
        sensors=["s1+x"],
        actuators=["a1+x"],
        quantity="mobility",
    )
    bp.io.uff.write(folder / "measured.uff", measurement)
    return folder


@pytest.mark.parametrize("line", COMMANDS)
def test_a_wrong_command_gets_a_sentence(folder, monkeypatch, line):
    monkeypatch.chdir(folder)
    code, words = COMMANDS[line]
    answer = CliRunner().invoke(app, line.split())
    said = " ".join(answer.output.replace("│", " ").split())
    assert words in said
    assert "Traceback" not in said
    assert answer.exit_code == code
    assert isinstance(answer.exception, SystemExit)


def test_a_wrong_command_leaves_nothing_behind(folder, monkeypatch):
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    for line in ("place study.py --forbidden 300:400", "init new --channels empty.csv"):
        CliRunner().invoke(app, line.split())
    assert sorted(folder.rglob("*")) == before
