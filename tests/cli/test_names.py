"""Names on the command line are those of the registries, known without importing what they name."""

import inspect
from typing import get_args

import pytest

import bayes_placement as bp
from bayes_placement.cli import _options, place
from bayes_placement.design.information.estimator import Estimator
from bayes_placement.design.search import Search


def kebab_case(kind):
    name = kind.__name__
    starts = [i for i, letter in enumerate(name) if letter.isupper()]
    if name.isupper():
        return name.lower()
    return "-".join(
        name[i:j].lower() for i, j in zip(starts, [*starts[1:], len(name)], strict=True)
    )


@pytest.mark.parametrize(
    ("names", "registry", "room", "base"),
    [
        (_options.EstimatorName, place.ESTIMATORS, bp.information, Estimator),
        (_options.SearchName, place.SEARCHES, bp.design, Search),
    ],
    ids=["estimators", "searches"],
)
def test_every_class_of_a_room_has_its_name_on_the_command_line(names, registry, room, base):
    kinds = [
        kind
        for kind in (getattr(room, name) for name in room.__all__)
        if inspect.isclass(kind) and issubclass(kind, base)
    ]
    assert registry == {kebab_case(kind): kind for kind in kinds}
    assert set(get_args(names)) == set(registry)


def test_engines_and_marginals_are_those_of_their_rooms():
    assert set(get_args(_options.EngineName)) == {"all", *map(str.lower, bp.engines.__all__)}
    assert set(get_args(_options.MarginalName)) == set(map(str.lower, bp.marginals.__all__))
