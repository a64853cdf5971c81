"""Which further effects promise most beside those of a hypothesis."""

from bayes_placement import effects
from bayes_placement.criticism.missing import _more_effects
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.effects.library import kind_of
from tests.criticism.small import experiment, measured


def test_a_reversed_sensor_promises_most_where_resonances_are_moved_too():
    """Phases of what both effects change add up to more than half a turn: they are the same then.

    Taken as they come, the reversed sensor would promise least of all.
    """
    hidden = effects.point_mass(0.313, 3.0), effects.reversed_sensor("s2")
    kinds = ["point_mass", "gain_error", "time_delay", "reversed_sensor", "ground_spring"]
    tried = effects.library(experiment(), kinds).effects
    null = null_hypothesis(experiment(), experiment().data(measured(*hidden, seed=3)))
    singles = _more_effects.single_effects(null, tried, lambda: None)
    mass = singles.of(("point_mass",))
    first, *_ = _more_effects._by_promise(mass, null, singles.candidates)
    assert (kind_of(first.effect), first.effect.sensor) == ("reversed_sensor", "s2")
