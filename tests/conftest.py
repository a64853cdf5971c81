"""conftest: shapes and types of every annotation in the package are checked while tests run."""

import sys
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

# The hook rewrites modules as they are imported; one imported before it would go unchecked.
assert "bayes_placement" not in sys.modules, "bayes_placement was imported before conftest.py"
install_import_hook("bayes_placement", "beartype.beartype")


@pytest.fixture(scope="session")
def shared_data():
    folder = (Path(__file__).parents[1] / "../shared/data").resolve()
    if not folder.is_dir():
        pytest.skip(f"the shared data is not on this machine: there is no {folder}")
    return folder
