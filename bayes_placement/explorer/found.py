"""What reach and a search have found, as the page shows it."""

import jax.numpy as jnp
import numpy as np

from .._shared.files import Json
from ..criticism.missing.fitted_model import FittedModel
from ..criticism.missing.ledger import Ledger
from ..criticism.reach._channels import CHANNELS, NOWHERE
from ..criticism.reach._ports import OF_MANY
from ..criticism.reach.reach import Reach
from ..experiment.experiment import Experiment
from ..experiment.model_error import Embedded
from ..inference.residuals import sizes_of
from ..io.case._effects import stated_effects
from ..laws.tabulated import COMPLIANCES
from .actions import Improved, ValuedModel
from .steps import as_drawn


def reach_for_page(reach: Reach) -> Json:
    """Return what laws can do at each place, and the law that the data ask for, kind by kind.

    `rows` of a kind are those of its curve in a bound of a band.
    """
    rows = reach.curves.groupby("acts_on").indices
    kinds = [
        {
            **kind,
            "rows": np.asarray(rows[kind["acts_on"]]).tolist(),
            "is_channel": kind["acts_on"] in NOWHERE,
            "chance": reach.chance(kind["best"]["probability"]),
            "law_in_words": reach.kinds()["law"][kind["acts_on"]].in_words(),
            "few_numbers": float(reach.kinds()["few_numbers"][kind["acts_on"]]),
            "measured": _law(reach, kind["acts_on"]),
        }
        for kind in reach.to_json()
    ]
    is_bounded = reach.in_bands is not None
    return {"kinds": kinds, "words": reach.words(), "fails": reach.fails, "is_bounded": is_bounded}


def read_by_line(reach: Reach) -> list[str]:
    """Return the kinds of ports at which any law is known line by line."""
    if reach.in_bands is None:
        return []
    kinds = reach.curves["acts_on"].unique()
    return [str(kind) for kind in kinds if kind not in (*NOWHERE, *OF_MANY)]


def _law(reach: Reach, kind: str) -> Json | None:
    """The law as measured and the best network, line by line; None where none was read."""
    if kind not in reach.measured or kind in CHANNELS:
        return None
    table = reach.law_as_measured(kind)
    unit = str(table["unit"].iloc[0])
    omega = jnp.asarray(2 * np.pi * table["frequency"].to_numpy())
    law = np.asarray(reach.kinds()["law"][kind].dynamic_stiffness(omega))
    named = 1 / law if unit in COMPLIANCES else law
    columns = ["frequency", "real", "imaginary", "deviation_real", "deviation_imaginary"]
    measured = {name: table[name].tolist() for name in columns}
    return {**measured, "unit": unit, "law_real": named.real, "law_imaginary": named.imag}


def ledger_for_page(ledger: Ledger) -> Json:
    """Return candidates with probabilities, what they cannot be told from, and the sentences."""
    best = ledger.compared.sort_values("log_odds", ascending=False).drop_duplicates("effects")
    return {
        "words": ledger.words(),
        "probabilities": ledger.probabilities,
        "compared": best.head(12).to_dict("records"),
        "steps": [
            {
                "added": step.added and step.title,
                "chi2": step.chi2_per_datum,
                "words": step.description(),
                "model_error": {kind: size.mean for kind, size in step.model_error.items()},
            }
            for step in ledger.steps
        ],
    }


def actions_of(ledger: Ledger, experiment: Experiment) -> list[Improved]:
    """Return the steps of a ledger as actions on the experiment that was searched."""
    return [_action(number, step, experiment) for number, step in enumerate(ledger.steps)]


def _action(number: int, step: FittedModel, experiment: Experiment) -> Improved:
    assert step.experiment is not None
    new = [effect for effect in step.experiment.effects if effect.name in step.effects]
    has_error = step.experiment.model_error is not None
    is_new = has_error and experiment.model_error is None
    known = experiment.with_model_error(Embedded()) if is_new else experiment
    sizes = {size.name: float(step.values[size.name]) for size in sizes_of(known)}
    stated = tuple(stated_effects(experiment, new))
    return Improved(number, stated, is_new, sizes, model_of(step).values)


def model_of(step: FittedModel) -> ValuedModel:
    """Return a fitted model with the values of its unknowns."""
    assert step.experiment is not None
    names = as_drawn(step.experiment)
    return ValuedModel(step.experiment, {name: float(step.values[name]) for name in names})
