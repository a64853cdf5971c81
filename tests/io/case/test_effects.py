"""Effects that a case states: default candidates by kind and number, written and read back."""

import dataclasses

import equinox as eqx
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.effects.library import kind_of
from bayes_placement.io import case
from bayes_placement.io.case._effects import _content, candidate_place, stated_effects
from bayes_placement.io.case._runs import write_completed
from tests import public_calls
from tests.io.case.test_folder import changed, written

MASS = {"kind": "point_mass", "candidate": 1, "name": "clamp"}


@pytest.fixture
def folder(tmp_path):
    """Return a function that makes a folder of a name."""

    def case_folder(name):
        (tmp_path / name).mkdir()
        return tmp_path / name

    return case_folder


def test_a_case_with_effects_is_the_one_without_and_default_candidates(folder):
    plain = case.read(written(folder("plain"))).experiment
    gain = {"kind": "gain_error", "candidate": 2, "name": "gain_error"}
    content = changed("effects", [MASS, gain])
    experiment = case.read(written(folder("completed"), content)).experiment
    assert [effect.name for effect in experiment.effects] == ["clamp", "gain_error"]
    assert set(experiment.unknown) - set(plain.unknown) == {
        "structure.effects.clamp.at",
        "structure.effects.clamp.mass",
        "instrument_effects.gain_error.error",
    }
    assert int(experiment.instrument_effects["gain_error"].transducer) == 1  # the second sensor


def test_a_completed_case_is_complete_and_read_back(tmp_path, folder):
    path = written(folder("given"))
    (path / "secret.txt").write_text("not of the case")
    incomplete = case.read(path)
    added = bp.effects.library(incomplete.experiment, ["point_mass", "channel_delay"]).effects
    (mass,), delay = added[:1], added[-1]
    write_completed(tmp_path / "sub" / "completed", path, incomplete.experiment, [mass, delay])
    names = {file.name for file in (tmp_path / "sub" / "completed").iterdir()}
    assert names == {"case.json", "measured.uff"}
    completed = case.read(tmp_path / "sub" / "completed")
    assert eqx.tree_equal(completed.experiment, incomplete.experiment + mass + delay)
    assert (completed.measurement.frf == incomplete.measurement.frf).all()


def networks(experiment):
    (place,) = experiment.structure.modes.anywhere()
    spring = bp.effects.Spring(dist.LogUniform(1e3, 1e6))
    return [
        bp.effects.attached(place, spring - bp.effects.Dashpot(40.0), direction=(1.0, 0.0, 0.0)),
        bp.effects.inserted(place, spring, motion="displacement"),
        bp.effects.strut(place, place, spring, name="tie"),
    ]


def test_networks_are_read_back_as_they_were_typed(tmp_path, folder):
    path = written(folder("given"))
    incomplete = case.read(path).experiment
    added = networks(incomplete)
    write_completed(tmp_path / "completed", path, incomplete, added)
    expected = incomplete
    for effect in added:
        expected = expected + effect
    assert eqx.tree_equal(case.read(tmp_path / "completed").experiment, expected)


TABLE = bp.effects.Tabulated([5.0, 9.0], [1e4 + 1j, 2e4 + 2j])


@pytest.mark.parametrize(
    "change", [{"strength": 0.5}, {"at": 0.3}, {"at": dist.Uniform(0.1, 0.2)}, {"law": TABLE}]
)
def test_what_a_case_cannot_hold_is_refused(folder, change):
    experiment = case.read(written(folder("given"))).experiment
    other = dataclasses.replace(networks(experiment)[0], **change)
    with pytest.raises(ValueError, match="attached is none of the default candidates"):
        stated_effects(experiment, [other])


def test_default_candidates_at_unknown_places_in_space_are_told():
    plate = public_calls.in_space((0.5, 0.4, 0.0))
    candidates = bp.effects.library(plate, ["point_mass"]).effects
    renamed = [dataclasses.replace(candidate, name="clamp") for candidate in candidates]
    places = [candidate_place(plate, candidate) for candidate in renamed]
    assert places == [*range(len(candidates))]


def test_candidates_are_told_as_an_experiment_holds_them(folder):
    experiment = case.read(written(folder("given"))).experiment
    places = dict[str, int]()
    for candidate in bp.effects.library(experiment).effects:
        (held,) = [each for each in (experiment + candidate).effects if each.name == candidate.name]
        place = places.setdefault(kind_of(candidate), 0)
        assert candidate_place(experiment, held) == place, candidate.name
        places[kind_of(candidate)] += 1
    assert places["gain_error"] > 1


def test_a_candidate_of_slightly_other_numbers_is_none_of_the_default_ones():
    plate = public_calls.in_space((0.5, 0.4, 0.0))
    candidate = bp.effects.library(plate, ["point_mass"]).effects[0]
    other = dataclasses.replace(candidate, at=bp.positions.Cartesian(0.123451, 0.4, 0.0))
    near = dataclasses.replace(candidate, at=bp.positions.Cartesian(0.123452, 0.4, 0.0))
    assert repr(other) == repr(near) and _content(other) != _content(near)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("kind", "heavy_thing", "kind.*is .heavy_thing.; .point_mass. or"),
        ("candidate", 7, "is 7, but there are 2 candidates of the kind point_mass"),
        ("candidate", 0, "at least 1"),
        ("name", "a ", "a name without blanks"),
        ("strength", 3, "field effects\\[0\\].strength.*is not known"),
    ],
)
def test_what_is_no_default_candidate_is_refused(tmp_path, field, value, words):
    content = changed("effects", [MASS | {field: value}])
    with pytest.raises(case.CaseError, match=words):
        case.read(written(tmp_path, content))


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("law", "Inerter(3)", "a network as it is typed.*write .law.: .Spring"),
        ("law", 3.0, "a network as it is typed"),
        ("pieces", [2], "a list of 1 numbers of pieces of the structure from 1 to 1 is needed"),
        ("pieces", [1, 1], "a list of 1 numbers"),
        ("motion", "sideways", "displacement"),
        ("direction", [1.0, 0.0], "a list of three numbers"),
    ],
)
def test_what_is_no_network_is_refused(tmp_path, field, value, words):
    pad = {"kind": "attached", "pieces": [1], "law": "Spring(1e4)", "name": "pad"}
    content = changed("effects", [pad | {field: value}])
    with pytest.raises(case.CaseError, match=words):
        case.read(written(tmp_path, content))
