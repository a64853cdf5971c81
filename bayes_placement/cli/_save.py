"""`--save` of `improve`: the completed model as a model file or case folder.

The completed model is the model with the effects that it lacked.
"""

import os
from pathlib import Path
from typing import Any, NamedTuple

from .._files import write_atomically
from .._types import UsageError
from ..criticism.missing.ledger import Ledger
from ..effects.effect import Effect
from ..effects.library import EFFECTS, kind_of
from ..experiment.experiment import Experiment
from ..io._modal_files import holds_modal_parameters
from ..io.case._completed import write_completed
from ..io.case._effects import candidate_place

HEAD = '''\
"""The model of {model} with the effects it lacked: {effects}.

Written by bayes-placement improve --save. Default priors of effects are scaled to the structure.
"""

import dataclasses
from pathlib import Path

import bayes_placement as bp
{imports}
HERE = Path(__file__).parent

study = bp.io.{reader}.read(HERE / {path!r})
measurement = {measurement}
original = {original}
experiment = original{model_error}
'''

OF_MODES = "observing_modes(study.experiment, measurement)"
IMPORT = "from bayes_placement.experiment.resized import observing_modes\n"

ADDED = """\
{variable} = bp.effects.library(original, [{kind!r}]).effects[{number}]
experiment = experiment + dataclasses.replace({variable}, name={name!r})
"""


ADDED_NETWORK = """\
{variable} = bp.effects.{function}({places}, {law}{options})
experiment = experiment + {variable}
"""

OF_NETWORKS = """from numpyro.distributions import LogNormal, LogUniform, Uniform

from bayes_placement.effects import Dashpot, LossySpring, Mass, Spring, Springpot
"""


class CompletedModel(NamedTuple):
    """A model file or case folder that is to be written.

    Parameters
    ----------
    path
        The file, or the folder.
    model
        Model file or case folder that lacked something.
    data
        File of the measurement; None where it is that of the model.
    model_error
        Whether a model error was declared on the command line.
    """

    path: Path
    model: Path
    data: Path | None
    model_error: bool

    def write(self, experiment: Experiment, ledger: Ledger) -> None:
        """Write the model as it was given, and the effects of the ledger."""
        known = {effect.name for effect in experiment.effects}
        added = [effect for effect in ledger.experiment.effects if effect.name not in known]
        if not self.path.suffix:
            write_completed(self.path, self.model, experiment, added)
            return
        parts = [self._head(added)]
        parts += [_addition(experiment, effect, n) for n, effect in enumerate(added, 1)]
        text = "\n".join(parts)
        write_atomically(self.path, lambda path: path.write_text(text, encoding="utf-8"))

    def _head(self, added: list[Effect]) -> str:
        is_modal = self.data is not None and holds_modal_parameters(self.data)
        reader = "modal_parameters.read" if is_modal else "read_measurement"
        data = f"bp.io.{reader}(HERE / {self._from_here(self.data)!r})" if self.data else ""
        of_networks = OF_NETWORKS if any(map(_is_network, added)) else ""
        return HEAD.format(
            model=self.model.name,
            effects=", ".join(effect.name for effect in added) or "none is claimed",
            reader="case" if self.model.is_dir() else "model",
            path=self._from_here(self.model),
            measurement=data or "study.measurement",
            imports=(IMPORT if is_modal else "") + of_networks,
            original=OF_MODES if is_modal else "study.experiment",
            model_error=(".with_model_error(bp.model_error.Modal())" if self.model_error else ""),
        )

    def _from_here(self, path: Path | None) -> str:
        """Path of a file from the folder of the new one."""
        target = str(Path(path or ".").resolve())
        return Path(os.path.relpath(target, self.path.resolve().parent)).as_posix()


def completed_model(
    path: Path, model: Path, data: Path | None, model_error: bool
) -> CompletedModel:
    """Return a model file or case folder to be written, after a check that it replaces nothing.

    Raises
    ------
    UsageError
        If there is such a file or folder, or it cannot hold what is to be saved.
    """
    is_case = not path.suffix and model.is_dir()
    if path.exists() or not (is_case or path.suffix == ".py"):
        fault = "is there already" if path.exists() else "is no name of a Python file"
        folder = f", or of a case folder: --save {model.name}_completed" if model.is_dir() else ""
        raise UsageError(
            f"--save {path} was given, which {fault}; a new model file is needed, since nothing is "
            f"replaced: --save {model.stem}_completed.py{folder}."
        )
    if is_case and (data is not None or model_error):
        option = "--data" if data is not None else "--model-error"
        raise UsageError(
            f"--save {path} was given beside {option}; a model file is needed then, since a case "
            f"folder holds its own data and no model error: --save {model.stem}_completed.py."
        )
    return CompletedModel(path, model, data, model_error)


def _addition(experiment: Experiment, effect: Effect, number: int) -> str:
    """Lines that add an effect: which of the default candidates it is, or a network as typed."""
    if _is_network(effect):
        return _network(experiment, effect, number)
    return ADDED.format(
        variable=f"effect_{number}",
        kind=kind_of(effect),
        number=candidate_place(experiment, effect),
        name=effect.name,
    )


def _is_network(effect: Effect) -> bool:
    """Whether an effect is a law of its own at a port, and none of the library."""
    return kind_of(effect) not in EFFECTS


def _network(experiment: Experiment, effect: Any, number: int) -> str:
    """Lines that add a network, on the piece of the structure where it is."""
    pieces = [repr(piece) for piece in experiment.structure.modes.anywhere()]
    ends = [repr(getattr(effect, field)) for field in effect.place_fields]
    numbers = [pieces.index(end) if end in pieces else 0 for end in ends]
    settings = {"motion": getattr(effect, "motion", None), "direction": effect.direction}
    stated = {name: value for name, value in settings.items() if value is not None}
    options = {**stated, "name": effect.name}
    return ADDED_NETWORK.format(
        variable=f"effect_{number}",
        function=type(effect).name,
        places=", ".join(f"original.structure.modes.anywhere()[{piece}]" for piece in numbers),
        law=repr(effect.law),
        options="".join(f", {name}={value!r}" for name, value in options.items()),
    )
