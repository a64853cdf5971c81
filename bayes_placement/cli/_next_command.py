"""Commands that go on from another one, as they are typed."""

import shlex
from pathlib import Path


def command_on(name: str, model: Path, data: Path | None, *flags: str) -> str:
    """Return a command on a model and its data.

    Parameters
    ----------
    name
        Name of the command.
    model
        Model file or case folder.
    data
        File of the measurement; None for that of the model.
    *flags
        Further words, such as `--model-error`.
    """
    measured = () if data is None else ("--data", str(data))
    return shlex.join(["bayes-placement", name, str(model), *measured, *flags])
