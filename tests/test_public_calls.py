"""Every public callable refuses each argument that is wrong in kind, sign, shape or finiteness.

The table is in `public_calls.py`; unit mistakes that need a context are in `wrong_calls.py`.
"""

import inspect
import json
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import bayes_placement as bp
from tests import public_calls

FOREIGN = re.compile(r"ufunc|operand|broadcast|Traceback|XLA|tracer|has no attribute")
"""In sentences of libraries."""

# What functions of the package return, and parts of it, which users do not make.
RESULTS = {
    "beams.UniformBar",
    "beams.UniformBeam",
    "design.EffectiveIndependence",
    "design.Lead",
    "design.Placement",
    "design.ToleranceStudy",
    "effects.Library",
    "effects.Scales",
    "finite_elements.Affine",
    "finite_elements.AffineModes",
    "finite_elements.NodalModes",
    "finite_elements.interpolation.Elements",
    "finite_elements.interpolation.Nearest",
    "finite_elements.interpolation.NodalModel",
    "finite_elements.interpolation.Reading",
    "finite_elements.interpolation.Scattered",
    "finite_elements.interpolation.reference_corners",
    "finite_elements.soft_supports.SupportMotion",
    "information.Divergence",
    "io.arrays.NamedArrays",
    "io.case.write",
    "io.formats.Format",
    "io.mapped.ChannelRow",
    "io.mapped.ImportReport",
    "io.mapped.Imported",
    "io.mapped.Mapping",
    "io.matrix_files.SystemMatrices",
    "io.matrix_files.system_matrices",
    "io.mesh.Mesh",
    "io.model.Study",
    "io.npz_modes.ModelNodes",
    "io.time_records.Estimate",
    "model_error.ModalErrors",
    "model_error.shares_size",
    "plots.structure.draw_scores",
    "plots.structure.draw_structure",
    "plots.structure.extent",
    "plots.structure.mark_place",
    "plots.structure.name_axes",
    "plots.structure.view",
    "positions.AtNode",
    "positions.InBall",
    "positions.OnMember",
    "positions.OnPatch",
}

# They take no argument, or an object of a library that is optional and checked where it is read.
WITHOUT_ARGUMENTS = {
    "design.Exhaustive",
    "design.Forward",
    "marginals.Enumeration",
    "marginals.Latent",
    "finite_elements.from_scikit_fem",
    "finite_elements.interpolation.scikit_fem",
}


# Wrong calls of it are in the tests of its file: the example files of the library that reads them
# are not of one structure, so that there is no right call.
ELSEWHERE = {"io.ansys.read_modes"}


def public(module, path=""):
    """Public callables of a module and those below it, by name."""
    exported = getattr(module, "__all__", None)
    for name in exported or [name for name in vars(module) if not name.startswith("_")]:
        value = getattr(module, name)
        if isinstance(value, types.ModuleType):
            if exported and value.__name__.startswith("bayes_placement"):
                yield from public(value, f"{path}{name}.")
        elif callable(value) and (exported or value.__module__ == module.__name__):
            yield f"{path}{name}", value


def is_called(value):
    """Whether users call it: neither an exception nor a base of classes."""
    exception = isinstance(value, type) and issubclass(value, Exception)
    return not exception and not inspect.isabstract(value)


def test_what_has_no_row_is_there():
    named = {name for name, _ in public(bp)}
    stale = (RESULTS | WITHOUT_ARGUMENTS | ELSEWHERE) - named
    assert not stale, "their names are gone"


def test_every_public_callable_has_a_row():
    text = Path(public_calls.__file__).read_text()
    without_row = RESULTS | WITHOUT_ARGUMENTS | ELSEWHERE
    names = {}
    for name, value in public(bp):
        if is_called(value):
            names.setdefault(id(value), []).append(name)
    missing = [
        names_of_one
        for names_of_one in names.values()
        if {*without_row, *public_calls.REGISTERED}.isdisjoint(names_of_one)
        and not any(
            f'"{word}":' in text
            for name in names_of_one
            for word in (name, name.removeprefix("effects."))
        )
    ]
    assert not missing, "each needs a row in tests/public_calls.py"


def answers(*groups):
    """What each call said, in a process without the checks of types of the tests."""
    command = [sys.executable, "-m", "tests.public_calls", *groups]
    root = Path(__file__).parents[1]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def check(replies):
    """Right calls pass; each wrong one gets a sentence of ours."""
    right = {call: words for call, words in replies.items() if call.endswith("()")}
    assert not {call: words for call, words in right.items() if any(words)}
    wrong = {call: words for call, words in replies.items() if call not in right}
    assert not {call: words for call, words in wrong.items() if words[0] != "ours"}
    sentences = {call: words for call, (_, words) in wrong.items()}
    assert not {call: words for call, words in sentences.items() if len(words) < 40}
    assert not {call: words for call, words in sentences.items() if FOREIGN.search(words)}


SHORT = ("laws", "positions", "effects")


def test_each_wrong_argument_gets_a_sentence():
    replies = answers(*SHORT)
    assert len(replies) > 1000
    check(replies)


@pytest.mark.long
@pytest.mark.longest
def test_each_wrong_argument_of_all_others_gets_a_sentence():
    check(answers(*sorted({*public_calls.GROUPS} - {*SHORT})))
