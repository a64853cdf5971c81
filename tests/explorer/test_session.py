"""What is done on a page: undo returns exactly, the script says the same, a file holds it all."""

import json

import numpy as np
import numpyro.distributions as dist
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.explorer.actions import Drawn, Moved, Refitted, Removed
from bayes_placement.explorer.candidates import added, placed_at
from bayes_placement.explorer.page_frames import sliders
from bayes_placement.explorer.session import Session
from bayes_placement.explorer.steps import as_drawn
from tests.criticism import small

EXPERIMENT = small.experiment()
MEASUREMENT = small.measured()
RATIO = "structure.damping.ratio"


def named(session):
    """Values of the model at hand, and the names of its effects."""
    names = [effect.name for effect in session.model.experiment.effects]
    return names, dict(session.model.values)


def run_script(session):
    """Names and values to which the script leads, without what takes long."""
    head = "from tests.explorer.test_session import EXPERIMENT as experiment, MEASUREMENT"
    script = session.script().replace(session._head, head + "; measurement = MEASUREMENT")
    (*_, last) = [line for line in script.splitlines() if line]
    assert last == "print(chi2(experiment, measurement, values))"
    names = {}
    exec(
        script.replace(last, "").replace("values = fit(experiment, measurement, values)", ""), names
    )
    known = as_drawn(names["experiment"])
    effects = [effect.name for effect in names["experiment"].effects]
    return effects, {name: names["values"][name] for name in known}


class Clicks(RuleBasedStateMachine):
    """Random clicks on a page; each state is remembered as it was."""

    @initialize()
    def begin(self):
        self.session = Session(EXPERIMENT, MEASUREMENT)
        self.seen = {0: named(self.session)}

    def note(self):
        self.seen[self.session.current] = named(self.session)

    @rule(value=st.floats(0.02, 0.06))
    def move(self, value):
        self.session.do(Moved({RATIO: value}))
        self.note()

    @rule(kind=st.sampled_from(["point_mass", "ground_spring"]), at=st.floats(-1.0, 2.0))
    @precondition(lambda self: len(self.session.model.experiment.effects) < 2)
    def add(self, kind, at):
        self.session.do(added(self.session.model.experiment, kind, at=(at, 0.0, 0.0)))
        self.note()

    @rule(at=st.floats(0.0, 1.0))
    @precondition(lambda self: self.session.model.experiment.effects)
    def drag(self, at):
        name = self.session.model.experiment.effects[-1].name
        self.session.do(Moved(placed_at(self.session.model.experiment, name, (at, 0.0, 0.0))))
        self.note()

    @rule()
    @precondition(lambda self: self.session.model.experiment.effects)
    def remove(self):
        self.session.do(Removed(self.session.model.experiment.effects[0].name))
        self.note()

    @rule()
    def reset(self):
        self.session.do(Drawn())
        self.note()

    @rule()
    @precondition(lambda self: self.session.can_undo)
    def undo_and_redo(self):
        before = self.session.current
        self.session.undo()
        self.session.redo()
        assert self.session.current == before

    @rule()
    def undo(self):
        self.session.undo()

    @rule()
    def redo(self):
        self.session.redo()

    @rule(number=st.integers(-1, 30))
    def go(self, number):
        self.session.go(number)

    @invariant()
    def every_state_is_as_it_was(self):
        assert named(self.session) == self.seen[self.session.current]
        assert [*self.seen] == [*range(len(self.session.states))]

    def teardown(self):
        effects, values = named(self.session)
        assert run_script(self.session) == (effects, values)
        again = Session(EXPERIMENT, MEASUREMENT)
        again.take_up(json.loads(json.dumps(self.session.to_json())))
        assert again.current == self.session.current
        for number in self.seen:
            again.go(number)
            assert named(again) == self.seen[number]


Clicks.TestCase.settings = settings(
    max_examples=60,
    stateful_step_count=12,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)


@pytest.mark.long
class TestClicks(Clicks.TestCase):
    """Random clicks."""


def test_a_dropped_mass_sits_where_it_was_dropped_and_the_script_says_so():
    session = Session(EXPERIMENT, MEASUREMENT)
    session.do(added(EXPERIMENT, "point_mass", at=(0.37, 0.0, 0.0)))
    session.do(Moved({"structure.effects.point_mass.mass": 0.5}))
    names, values = named(session)
    assert names == ["point_mass"] and values["structure.effects.point_mass.at"] == 0.37
    assert run_script(session) == (names, values)
    assert [state.title for state in session.states] == [
        "as drawn",
        "+ point_mass",
        "point_mass mass 0.5 kg",
    ]
    session.do(added(session.model.experiment, "point_mass", at=(5.0, 0.0, 0.0)))
    assert session.model.values["structure.effects.point_mass_2.at"] == 1.0
    assert run_script(session) == named(session)


def test_an_unknown_that_an_effect_stood_for_is_there_again_without_it():
    session = Session(EXPERIMENT, MEASUREMENT)
    drawn = named(session)
    session.do(added(EXPERIMENT, "beyond_prior", 1))
    session.do(Drawn())
    assert session.model.values.keys() != drawn[1].keys()
    session.do(Removed("beyond_prior"))
    assert named(session) == drawn == run_script(session)


def test_states_that_were_left_are_still_there():
    session = Session(EXPERIMENT, MEASUREMENT)
    session.do(Moved({RATIO: 0.03}))
    session.undo()
    session.do(Moved({RATIO: 0.05}))
    assert session.path() == [0, 2] and not session.can_redo
    session.go(1)
    assert session.model.values[RATIO] == 0.03
    assert "0.05" not in session.script()


def test_a_fit_is_kept_by_its_values():
    session = Session(EXPERIMENT, MEASUREMENT)
    session.do(Refitted({**session.model.values, RATIO: 0.034}))
    again = Session(EXPERIMENT, MEASUREMENT)
    again.take_up(session.to_json())
    assert again.model.values == session.model.values


@pytest.mark.parametrize(
    "action",
    [
        {"do": "shell", "command": "rm"},
        {"do": "set"},
        {"do": "add", "effect": {"kind": "nonsense", "candidate": 1, "name": "x"}, "values": {}},
        {"do": "remove", "name": "nobody"},
    ],
)
def test_a_file_with_anything_else_is_refused(action):
    session = Session(EXPERIMENT, MEASUREMENT)
    with pytest.raises(InputError):
        session.take_up({"states": [{"parent": 0, "action": action}], "current": 1, "chi2": []})
    assert session.current == 0


def test_sliders_have_the_ranges_of_the_priors():
    shown = {slider.name: slider for slider in sliders(EXPERIMENT)}
    ratio = shown[RATIO]
    assert (ratio.low, ratio.high, ratio.is_logarithmic) == (0.02, 0.06, False)
    assert set(ratio.density) == {1.0}
    experiment = added(EXPERIMENT, "point_mass").applied_to(Session(EXPERIMENT, MEASUREMENT).model)
    mass = {s.name: s for s in sliders(experiment.experiment)}["structure.effects.point_mass.mass"]
    assert mass.is_logarithmic and mass.unit == "g"
    # Of a prior that is flat in the logarithm the density along it is flat as well.
    np.testing.assert_allclose(mass.density, 1.0, atol=2e-3)


def test_a_gain_is_divided_by_factors_of_the_distance_from_its_end():
    experiment = added(EXPERIMENT, "gain_error", 1).applied_to(
        Session(EXPERIMENT, MEASUREMENT).model
    )
    error = next(s for s in sliders(experiment.experiment) if s.owner == "gain_error")
    assert error.is_logarithmic and error.origin == -1.0 < error.low < 0.0 < error.high
    assert error.density.index(1.0) == len(error.density) // 2  # no error is in the middle


def test_a_number_that_is_negative_has_the_unit_of_its_size():
    lighter = EXPERIMENT + bp.effects.point_mass(0.3, dist.Uniform(-0.5, -0.01))
    mass = {slider.name: slider for slider in sliders(lighter)}["structure.effects.point_mass.mass"]
    assert (mass.low, mass.high, mass.unit) == (-0.5, -0.01, "kg")
