"""The pages of the site: how-to pages run as they stand, and none of the others is out of date."""

import importlib
import json
import re
import runpy
import subprocess
import sys

import pytest

import bayes_placement as bp
from bayes_placement.effects.library import kind_of
from tests.code_blocks import OPTIONAL, ROOT, blocks, is_installed, run
from tests.test_public_calls import public

PAGES = ROOT / "notebooks" / "docs"
HOW_TO = {
    "my_file": ("Save these lines as measured.toml", "gain_error"),
    "identify": ("160.893", "5 modes from 160.894 to 836.62 Hz, shapes at 3"),
    "my_modes": ("ModalParameters: 5 modes", "The model fails", "Missing is point_mass"),
    "my_fe_model": ("compliant_support", "left end", "54.0236"),
    "nastran": ("14.078",),
    "ansys": ("[[22  1]",),
    "abaqus": ("[[2 1]]", "129.949"),
    "plate": ("Missing: point_mass", "falls from 24"),
    "time_records": ("Hit 4 of 7 is left out",),
    "real_measurement": ("model_error.frequency.size",),
    "hierarchical_model": ("scatter: ", "bar 3/youngs_modulus: 1.0"),
    "effect_of_my_own": ("rubber_pad",),
    "explore": (
        "Explorer: http://127.0.0.1:",
        "values |= {'structure.effects.point_mass.mass': 0.54}",
    ),
    "unlisted": (
        "displacement at 280 mm: dashpot - spring removes 100%",
        "pad times 1.0",
        "placements: s3 at 0.1 m",
    ),
    "placement": ("nat",),
    "cluster": ("best: s1 at 0.", "point_mass"),
}
"""What each page prints, among other things."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("how_to")


@pytest.fixture(scope="module")
def printed(folder):
    """What each how-to page prints; they compile for most of their time, and run in one process."""
    texts = [(PAGES / "how_to" / f"{name}.md").read_text() for name in HOW_TO]
    ran = run([blocks(text) for text in texts], folder)
    return dict(zip(HOW_TO, ran, strict=True))


def test_every_how_to_page_is_run():
    texts = {path.stem: path.read_text() for path in (PAGES / "how_to").glob("*.md")}
    assert {name for name, text in texts.items() if blocks(text)} == set(HOW_TO)


@pytest.mark.parametrize(
    ("word", "page"),
    [
        ("hammer", "time_records"),
        ("Nastran", "nastran"),
        (".mat", "my_file"),
        ("report", "results"),
    ],
)
def test_a_search_of_the_site_begins_with_the_page_on_the_word(word, page):
    """Main entries of the index count more than titles, and these more than text and names."""
    pages = (PAGES / "how_to").glob("*.md")
    entries = {path.stem: re.findall(r"! ([^,\n]+)", path.read_text()) for path in pages}
    assert [name for name, words in entries.items() if word in words] == [page]


@pytest.mark.long
@pytest.mark.parametrize("name", HOW_TO)
def test_a_how_to_page_runs_and_says_what_it_promises(name, printed):
    if name in OPTIONAL and not is_installed(name):
        pytest.skip(f"needs {name}")
    for words in HOW_TO[name]:
        assert words in printed[name]


@pytest.mark.long
def test_the_command_of_the_page_on_files_makes_a_case(printed, folder):
    text = (PAGES / "how_to" / "my_file.md").read_text()
    (command,) = re.findall(r"^ {4}bayes-placement (import measured.+)$", text, re.MULTILINE)
    run_it = [sys.executable, "-m", "bayes_placement", *command.split()]
    subprocess.run(run_it, cwd=folder, env={"PYTHONPATH": str(ROOT)}, check=True)
    assert (folder / "case").is_dir()


# --------------------------------------------------------------------------- gallery


@pytest.fixture(scope="module")
def gallery():
    """Modules of the gallery, imported without running it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PAGES)
        yield importlib.import_module("make_gallery")


def test_the_page_of_the_gallery_is_what_its_script_writes(gallery):
    results = json.loads(gallery.RESULTS.read_text())
    assert results.keys() == gallery.CASES.keys()
    assert gallery.page(results) == (PAGES / "gallery" / "index.md").read_text()
    figures = {path.stem for path in (PAGES / "gallery").glob("*.png")}
    assert figures == set(gallery.CASES)


def test_what_was_hidden_in_the_gallery_was_found(gallery):
    for name, result in json.loads(gallery.RESULTS.read_text()).items():
        effect = gallery.CASES[name].effect
        assert result["verdict"] == ([] if effect is None else [kind_of(effect())])
        assert result["chi2_per_datum"][-1] < 1.15


# --------------------------------------------------------------------------- reference


def members(module):
    """What `automodule` documents of a module."""
    exported = getattr(module, "__all__", None)
    for name in exported or [name for name in vars(module) if not name.startswith("_")]:
        value = getattr(module, name)
        if exported or getattr(value, "__module__", None) == module.__name__:
            yield value


def documented():
    """What the reference documents, by name."""
    with_registered = runpy.run_path(PAGES / "reference_pages.py")["with_registered"]
    pages = (PAGES / "reference").glob("*.md")
    text = "\n".join(with_registered(path.stem, path.read_text()) for path in pages)
    for path in re.findall(r"automodule:: (\S+)", text):
        for value in members(importlib.import_module(path)):
            yield f"{path}.{getattr(value, '__name__', '')}", value
    for path in re.findall(r"auto(?:function|class):: (\S+)", text):
        module, _, name = path.rpartition(".")
        yield path, getattr(importlib.import_module(module), name)


@pytest.mark.long
def test_every_public_name_is_in_the_reference():
    known = {id(value) for _, value in documented()}
    assert [name for name, value in public(bp) if id(value) not in known] == []
