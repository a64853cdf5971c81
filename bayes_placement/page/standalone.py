"""The page in one piece, for what cannot load files: a report, a notebook.

Its modules become one script. They are written so that lines tell imports and exports: no program
that builds is needed.
"""

import base64
import functools
import gzip
import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

FOLDER = Path(__file__).parent

FIRST = "app"
"""Module from which all others are imported."""

FRAMES = "@frames@"
"""What stands in the page where frames are to be; nothing there: they come through its holder."""

_IMPORT = re.compile(r'^import (?:(\w+)|(\{ [^}]+ \})) from "\./([\w/]+)\.js";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:const|function|class) (\w+))", re.MULTILINE)
_DEFAULT = re.compile(r"^export \{ (\w+) as default \};\n", re.MULTILINE)
_LINKS = re.compile(r"<(?:link|script)[^\n]*\n")


@functools.cache
def script() -> str:
    """Return all modules as one script, with the licence of what is not ours."""
    licence = (FOLDER / "vendor/uplot.LICENSE").read_text(encoding="utf-8")
    return "\n".join([f"/*! uPlot: {licence}*/", *_in_order(FIRST, [])])


def _in_order(name: str, done: list[str]) -> Iterator[str]:
    """Modules as functions that are called once, those that are needed first."""
    text = (FOLDER / f"{name}.js").read_text(encoding="utf-8")
    for needed in _IMPORT.findall(text):
        if needed[2] not in done:
            yield from _in_order(needed[2], done)
    done.append(name)
    # Some of what is not ours is exported in a comment, beside its default.
    exported = [f"default: {word}" for word in _DEFAULT.findall(text)] or _EXPORT.findall(text)
    inside = _DEFAULT.sub("", _EXPORT.sub("", _IMPORT.sub(_taken, text)))
    end = f"return {{ {', '.join(exported)} }};\n}})();"
    yield f"const {_variable(name)} = (() => {{\n{inside}{end}"


def _taken(match: re.Match[str]) -> str:
    """What a module takes of another one."""
    whole, some, name = match.groups()
    return f"const {whole or some} = {_variable(name)}{'.default' if whole else ''};\n"


def _variable(name: str) -> str:
    return "module_" + name.replace("/", "_")


@functools.cache
def page() -> str:
    """Return the page with its styles and its script inside, and `FRAMES`."""
    body = _LINKS.sub("", (FOLDER / "index.html").read_text(encoding="utf-8"))
    styles = "".join((FOLDER / name).read_text() for name in ("vendor/uplot.css", "style.css"))
    head = f"<style>{styles}</style>\n</head>"
    end = (
        f'<script type="text/plain" id="frames">{FRAMES}</script>\n'
        f'<script type="module">{script()}</script>\n</body>'
    )
    return body.replace("</head>", head).replace("</body>", end)


@functools.cache
def notebook_module() -> str:
    """Return the module of a cell of a notebook, with the page inside; its frames come there."""
    text = (FOLDER / "notebook.mjs").read_text(encoding="utf-8")
    return text.replace('"@page@"', json.dumps(page().replace(FRAMES, "")))


def script_hash() -> str:
    """Return the SHA-256 of the script, as a policy of a page names it."""
    return base64.b64encode(hashlib.sha256(script().encode()).digest()).decode()


def compressed(content: bytes) -> str:
    """Return bytes as letters that the script of a page makes bytes of again."""
    return base64.b64encode(gzip.compress(content, mtime=0)).decode()


def kept_frames(frames: Sequence[bytes]) -> str:
    """Return frames one after the other, each with its length ahead, for the place `FRAMES`."""
    return compressed(b"".join(len(each).to_bytes(4, "little") + each for each in frames))
