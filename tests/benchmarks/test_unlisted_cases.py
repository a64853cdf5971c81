"""The study of unlisted cases: how an answer is scored, and what is asked, stored and decided."""

import json

import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing.table import Row, TableOfFits
from tests.benchmarks import unlisted_cases
from tests.benchmarks.unlisted_scores import calibration, score, share, summary

SIZE = 0.8
ABSORBER = ["-", ["|", "c", "k"], "m"]


def claim(place, law="k", probability=0.95, **further):
    return {
        "name": "network",
        "kind": "attached: spring",
        "acts_on": "displacement",
        "place_m": [[place]],
        "place_95_m": [[[place - 0.01, place + 0.01]]],
        "law_tree": law,
        "probability": probability,
        "equivalent": [],
    } | further


def wanted(place, *laws, **further):
    return {
        "acts_on": ["displacement"],
        "place_m": [[place]],
        "laws": list(laws),
        "names": [],
    } | further


@pytest.mark.parametrize("place, found", [(0.3, 1), (0.315, 1), (0.317, 0)])
def test_a_place_is_within_a_fiftieth_of_the_size(place, found):
    one = score([claim(place)], [wanted(0.3, "k")], SIZE)
    assert (one.found, one.laws, one.wrong) == (found, found, 1 - found)


@pytest.mark.parametrize("half, found", [(0.039, 1), (0.041, 0), (0.02, 0)])
def test_a_place_is_within_its_interval_where_that_is_narrow(half, found):
    far = claim(0.33, place_95_m=[[[0.33 - half, 0.33 + half]]])
    assert score([far], [wanted(0.3, "k")], SIZE).found == found


def test_a_wrong_law_is_a_wrong_name_unless_it_is_told_with_doubt():
    told = [score([claim(0.3, "m", p)], [wanted(0.3, "k")], SIZE) for p in (0.9, 0.89)]
    assert [(one.found, one.laws, one.wrong) for one in told] == [(1, 0, 1), (1, 0, 0)]


@pytest.mark.parametrize("probability, laws", [(0.06, 1), (0.04, 0)])
def test_what_is_told_as_equivalent_counts_from_a_twentieth_on(probability, laws):
    other = claim(0.3, ["-", "k", ["|", "k", "c"]], probability)
    one = score([claim(0.3, "m", equivalent=[other])], [wanted(0.3, other["law_tree"])], SIZE)
    assert one.laws == laws


def test_laws_at_one_place_are_one_in_parallel():
    pair = [claim(0.3, "k"), claim(0.3, ["-", "m", ["|", "k", "c"]])]
    assert score(pair, [wanted(0.3, ["|", "k", ABSORBER])], SIZE).laws == 1
    assert score(pair, [wanted(0.3, "k")], SIZE).laws == 0


def test_each_claim_finds_one_of_two_effects():
    effects = [wanted(0.3, "k"), wanted(0.31, "m")]
    both = score([claim(0.305, "m"), claim(0.3, "k")], effects, SIZE)
    assert (both.found, score([claim(0.305)], effects, SIZE).found) == (2, 1)


def test_a_body_may_be_told_as_its_mass_and_its_inertia():
    body = wanted(0.3, acts_on=["body", "displacement", "rotation"], names=["eccentric_mass"])
    parts = [claim(0.3, "m"), claim(0.3, "m", acts_on="rotation")]
    assert score(parts, [body], SIZE).laws == 1
    assert score(parts[:1], [body], SIZE).laws == 0
    whole = claim(0.3, None, name="eccentric_mass", acts_on="body")
    assert score([whole], [body], SIZE).laws == 1


def test_a_filter_is_found_on_its_channel_alone():
    late = wanted(0.0, acts_on=["channel"], place_m=[], names=["channel_delay"], on="s2")
    told = {"name": "channel_delay", "acts_on": "channel", "place_m": [], "probability": 0.97}
    scores = [score([told | {"on": on}], [late], SIZE) for on in ("s2", "s1")]
    assert [one.laws for one in scores] == [1, 0]


def test_sums_say_how_many_of_how_many_with_an_interval():
    right = score([claim(0.3, probability=0.95)], [wanted(0.3, "k")], SIZE)
    alarm = score([claim(0.3, probability=0.995)], [], SIZE)
    lines = summary({"a": right, "b": alarm, "c": score([], [], SIZE)})
    assert "cases found: 1/1 = 100% (3% to 100%)" in lines
    assert "alarms where nothing is missing: 1/2 = 50% (1% to 99%)" in lines
    assert calibration([right, alarm]) == [
        share("names told with 0.9 to 0.99 that are right", 1, 1),
        share("names told with above 0.99 that are right", 0, 1),
    ]


def row(kinds, log_evidence):
    return Row(kinds, log_evidence, -2 * log_evidence, 400, 5.0, effects=kinds)


@pytest.fixture
def stored(tmp_path):
    """A case whose ledger is there: a spring of which the evidence is e^8."""
    table = TableOfFits([row((), -230.0), row(("attached: spring",), -222.0)])
    ledger = {"table": table.to_json(), "effects": [claim(0.3)]}
    truth = {"expected": [wanted(0.3, "k")], "size_m": SIZE, "hidden": [], "chi2_nominal_fit": 2.0}
    for folder, name, content in [
        ("truth", "u000_bar.json", truth),
        ("results/u000_bar", "ledger.json", ledger),
    ]:
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / name).write_text(json.dumps(content))
    return tmp_path


def test_what_is_stored_is_decided_again_by_other_thresholds(stored):
    again = unlisted_cases.decided_again(stored, bp.Policy())
    assert (again["u000_bar"].found, again["u000_bar"].laws) == (1, 1)
    assert not unlisted_cases.decided_again(stored, bp.Policy(strong=1e5))["u000_bar"].names


def test_two_of_one_kind_are_two_claims(stored):
    ledger = json.loads((stored / "results" / "u000_bar" / "ledger.json").read_text())
    pair = ("attached: spring",) * 2
    ledger["table"] = TableOfFits([row((), -230.0), row(pair, -190.0)]).to_json()
    ledger["effects"] = [claim(0.3), claim(0.5)]
    claims = unlisted_cases.claims_of(ledger, bp.Policy())
    assert [each["place_m"] for each in claims] == [[[0.3]], [[0.5]]]


def test_a_case_that_has_a_ledger_is_not_asked_again(stored, capsys):
    unlisted_cases.main([str(stored), "--limit", "0.001"])
    printed = capsys.readouterr().out
    assert "found 1/1, laws 1, wrong 0; asked before" in printed
    assert "with the right law: 1/1" in printed
    assert "u000_bar" in json.loads((stored / "truth" / "expected.json").read_text())


def test_a_case_out_of_time_is_said_and_has_no_score(stored, capsys):
    (stored / "results" / "u000_bar" / "ledger.json").unlink()
    unlisted_cases.main([str(stored), "--limit", "0.001"])
    printed = capsys.readouterr().out
    assert "told no answer" in printed and "out of time" in printed
    assert "cases found: none asked" in printed


def test_cases_are_written_once(tmp_path, capsys):
    for _ in range(2):
        unlisted_cases.main([str(tmp_path), "--seeds", "3:4", "--none", "exact:1", "--write-only"])
    assert capsys.readouterr().out.count("written") == 2
    assert len(list((tmp_path / "cases").glob("[eu]00?_*"))) == 2
