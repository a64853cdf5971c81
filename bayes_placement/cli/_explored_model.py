"""The model of a page as a model file or case folder: as given, with what was added."""

import itertools
from pathlib import Path
from typing import TYPE_CHECKING

from ._missing_effects import Request
from ._save import CompletedModel

if TYPE_CHECKING:
    from ..explorer.live import LivePage


def explored_model(request: Request, suffix: str, page: "LivePage") -> Path:
    """Write the model at hand beside the model, under a new name, and return its path.

    Parameters
    ----------
    request
        What the command was given.
    suffix
        `.py` for a model file, none for a case folder, which only a case folder can become.
    page
        The page.
    """
    session = page.session
    given = session.states[0].model.experiment
    known = {effect.name for effect in given.effects}
    added = [effect for effect in session.model.experiment.effects if effect.name not in known]
    values = {name: float(value) for name, value in session.model.values.items()}
    path = _new_path(request.path, suffix)
    model = CompletedModel(path, request.path, request.data, request.model_error)
    model.write_effects(given, added, {}, values)
    return path


def _new_path(model: Path, suffix: str) -> Path:
    """A file or folder beside the model that is not there yet."""
    names = (f"{model.stem}_explored_{number}{suffix}" for number in itertools.count(1))
    return next(path for path in (model.with_name(name) for name in names) if not path.exists())
