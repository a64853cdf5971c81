"""The search for missing effects, which `explain` and `improve` begin with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from .._shared.errors import UsageError
from .._shared.executors import workers
from .._shared.progress import with_advice
from ..effects import EFFECTS, Library, library
from ..effects.library import classes_named, nearest_name, unknown_effect
from ..experiment.experiment import Experiment, Measurements
from ..experiment.modal_parameters import ModalParameters
from ..io.model import Study
from ..positions.channel import is_printable
from ._inputs import Inputs, fits_of_model, read_inputs, read_measurement
from ._run import KeptAnswer, Output
from ._save import CompletedModel
from ._terminal import command_on

Result = TypeVar("Result")

FEWER_LINES = 150
"""Lines that are advised where a search takes long."""


@dataclass(frozen=True)
class Request:
    """What a command that looks for missing effects was given.

    Data, baseline, and states by label, the baseline first, are those of the study where none are
    named; `alone` looks at no earlier state. No `kinds` means those that apply and are tried by
    default, and networks; no `most_lines` means all, unless there are too many values. `workers`
    and `dask` are of `bp.design.workers`.
    """

    path: Path
    data: Path | None
    kinds: list[str] | None
    output: Output
    most_lines: int | None
    model_error: bool = False
    baseline: Path | None = None
    alone: bool = False
    states: Mapping[str, Path] = field(default_factory=dict)
    save: CompletedModel | None = None
    workers: int | None = None
    dask: str | None = None

    def read(self, command: str) -> Inputs:
        """Read study and measurement, which is that of the last state where there are several."""
        self._check_kinds()
        if self.baseline and self.alone:
            raise UsageError(
                "--alone was given beside --baseline; one of them is needed, since the first "
                "leaves the earlier state out: --baseline before.uff."
            )
        data = self.data
        if self.states:
            if self.data or self.baseline or self.alone:
                raise UsageError(
                    "--state was given beside --data, --baseline or --alone; the states alone are "
                    "needed, since the first is the baseline of all others: "
                    '--state "undamaged=before.uff" --state "5 mm cut=after.uff".'
                )
            data = [*self.states.values()][-1]
        return read_inputs(
            self.path,
            data,
            command,
            self.output,
            self.most_lines,
            self.model_error,
            effects=self.kinds,
            baseline=self.baseline,
            alone=self.alone,
            states=self.states,
        )

    def of_states(self, study: Study) -> Mapping[str, Measurements]:
        """What was measured in each of several states, by label; empty where one is asked for."""
        if self.states:
            return {label: read_measurement(file) for label, file in self.states.items()}
        return {} if self.data or self.baseline or self.alone else study.states

    def earlier(self, study: Study) -> Measurements | None:
        """What was measured in an earlier state; None where there is none.

        That of a study counts where it is of the same kind: FRFs, or modal parameters.
        """
        if self.alone:
            return None
        if self.baseline is not None:
            return read_measurement(self.baseline)
        earlier = study.baseline or next(iter(study.states.values()), None)
        is_modal = isinstance(earlier, ModalParameters)
        return earlier if is_modal == study.experiment.observe.is_modal else None

    def search(self, command: str, function: Callable[..., Result], inputs: Inputs) -> Result:
        """Return what `explain` or `improve` finds in one measurement, and a baseline if any."""
        baseline = self.earlier(inputs.study)
        if baseline is None:
            return self.searched(command, function, inputs, inputs.measurement)
        words = "An earlier state was measured too: the effects are what is new since."
        inputs.screen.text(f"{words} Without it: --alone.")
        return self.searched(command, function, inputs, inputs.measurement, baseline=baseline)

    def searched(
        self,
        command: str,
        function: Callable[..., Result],
        inputs: Inputs,
        measured: object,
        **settings: object,
    ) -> Result:
        """Return what a function finds in what was measured; its progress is shown."""
        effects = self._candidates(inputs.experiment)
        asked = command, inputs.experiment, measured, effects, settings
        answer = KeptAnswer(inputs.run.fits, *asked)
        known: Result | None = answer.read()
        if known is not None:
            inputs.screen.text(
                "Found by an earlier run with the same model, data and options; to search "
                "anew: --no-cache."
            )
            return known
        with (
            workers(self.workers, dask=self.dask) as executor,
            fits_of_model(inputs),
            inputs.screen.progress([command]) as begin,
        ):
            found = function(
                inputs.experiment,
                measured,
                candidates=effects,
                executor=executor,
                progress=with_advice(begin(command), lambda: self._advise(inputs)),
                **settings,
            )
        answer.write(found)
        return found

    def _advise(self, inputs: Inputs) -> None:
        """Say how a search that takes long is made shorter."""
        experiment = inputs.experiment
        has_many = not experiment.observe.is_modal and experiment.frequency.size > FEWER_LINES
        options = [f"--lines {FEWER_LINES} (fewer lines)"] * has_many
        if self.kinds is None:
            options += [
                "--effects listed (no networks)",
                "--effects point_mass,gain_error (those that you suspect)",
            ]
        if options:
            again = "To shorten it, stop it and run it again with"
            inputs.screen.step(f"This may take long. {again} {' or '.join(options)}.")

    def command(self, name: str) -> str:
        """Return another command on the same model, data and, of `improve`, candidates."""
        words: dict[str, object] = {"--lines": self.most_lines}
        if name == "improve":
            words |= {"--effects": ",".join(self.kinds or ()), "--baseline": self.baseline}
        flags = [word for option, value in words.items() if value for word in (option, str(value))]
        flags += ["--model-error"] * self.model_error
        flags += ["--alone"] * (self.alone and name == "improve")
        return command_on(name, self.path, self.data, *flags)

    def _check_kinds(self) -> None:
        """Refuse names of which there is no effect, before anything is read."""
        kinds = self.kinds or []
        unknown = [kind for kind in kinds if not classes_named(kind)]
        if unknown:
            named = [nearest_name(kind) if kind in unknown else kind for kind in kinds]
            effects = ",".join(filter(None, named))
            remedy = f"--effects {effects}, or no --effects" if effects else "no --effects"
            raise UsageError(
                f"{unknown_effect(unknown[0])}. Names of these are needed, with commas: {remedy} "
                "for those tried by default."
            )

    def _candidates(self, experiment: Experiment) -> Library[Experiment]:
        """Effects to be tried; refuses where none of those that are named can act."""
        candidates = library(experiment, self.kinds)
        if self.kinds and not candidates.effects:
            all_kinds = ", ".join(library(experiment, [*EFFECTS]).kinds)
            raise UsageError(
                f"--effects {','.join(self.kinds)} was given; none of these can act on what the "
                f"model declares, where at least one is needed. Those that can: {all_kinds}."
            )
        return candidates


def states_by_label(words: Sequence[str]) -> dict[str, Path]:
    """Files of several states by label, from LABEL=FILE each."""
    pairs = [word.partition("=") for word in words]
    labels = [label.strip() for label, _, _ in pairs]
    for word, label, (_, _, file) in zip(words, labels, pairs, strict=True):
        if not is_printable(label) or not file or labels.count(label) > 1:
            raise UsageError(
                f"--state {word!r} was given; a label and a file are needed, each label once, "
                'since it is the name of the state: --state "5 mm cut=cut5.uff".'
            )
    return {label: Path(file).absolute() for label, (_, _, file) in zip(labels, pairs, strict=True)}
