"""Blocks of code in Markdown, run as a reader runs them: section by section, in their order."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
COMMANDS = ("pip", "python", "bayes-placement", "sphinx-build")
FENCED = re.compile(r"^```(python|toml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)((?: {4}.*\n|\n)+)")
SAVED = re.compile(r"[Ss]ave (?:this|it) as\s+`(\w+\.(?:py|toml))`")
OPTIONAL = ("dask_jobqueue", "executorlib", "ansys")
"""Libraries without which blocks that name them are left out: a cluster, and one that is large."""


class Block(NamedTuple):
    """A block of code, and the name of the file in which the text before it says to save it."""

    code: str
    file: str | None


def blocks(text):
    """Blocks in Python, fenced or indented, and those in TOML that are saved in a file."""
    fenced = [(m.start(), m.end(), m[1], m[2]) for m in FENCED.finditer(text)]
    outside = FENCED.sub(lambda match: re.sub(r"[^\n]", "-", match[0]), text)
    indented = [
        (m.start(), m.end(), "python", re.sub(r"^ {4}", "", m[1], flags=re.MULTILINE))
        for m in INDENTED.finditer(outside)
        if m[1].strip() and not m[1].strip().startswith(COMMANDS)
    ]
    end_before, result = 0, []
    for start, end, language, code in sorted(fenced + indented):
        names = SAVED.findall(text[end_before:start])
        if names or language == "python":
            result.append(Block(code, names[-1] if names else None))
        end_before = end
    return result


RUN = r"""
import gc, pathlib, sys

gc.set_threshold(100_000, 50, 50)
for section in " ".join(sys.argv[1:]).split("/"):
    namespace = {"__name__": "__main__"}
    for name in section.split():
        exec(compile(pathlib.Path(name).read_text(), name, "exec"), namespace)
    print("\f", end="")
gc.freeze()
"""
"""Blocks run one after another, as in a notebook; the processes that they start do not run them.

Sections share a process, which imports once, but no name. It seldom looks for garbage, as pytest.
"""


def run(sections, folder):
    """Run sections of blocks in a folder, beside a copy of the models; return what each printed."""
    shutil.copytree(ROOT / "models", folder / "models")
    names = [
        name
        for number, section in enumerate(sections)
        for name in [*written(section, folder, f"block_{number}"), "/"]
    ]
    ran = subprocess.run(
        [sys.executable, "-c", RUN, *names[:-1]],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.split("\f")[:-1]


def written(section, folder, prefix):
    """Names of the files of the blocks that can run here, as they are to be saved."""
    names = []
    for number, block in enumerate(section):
        if any(name in block.code and not is_installed(name) for name in OPTIONAL):
            continue
        name = block.file or f"{prefix}_{number}.py"
        (folder / name).write_text(block.code)
        if name.endswith(".py"):
            names.append(name)
    return names


def is_installed(library):
    """Whether a library can be imported."""
    return importlib.util.find_spec(library) is not None
