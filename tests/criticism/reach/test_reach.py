"""Where a law acts that is in no list, and which: data of a mesh apart from this package."""

import dataclasses
import functools

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from matplotlib.text import Text
from scipy.stats import norm

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing.ledger import Ledger
from bayes_placement.criticism.reach import _in_bands, _named_laws, _ports
from bayes_placement.criticism.reach._at_port import ReachOfPort
from bayes_placement.criticism.reach._free_law import FreeLaw, complex_residuals
from bayes_placement.explorer.found import reach_for_page
from bayes_placement.inference.residuals import Problem, at_known_noise, point_in_problem
from tests.criticism import small
from tests.criticism.reach.cantilever import (
    AT,
    LINES,
    experiment,
    maxwell,
    measured,
    spring_on_slope,
)
from tests.simulator import fine_beams


@functools.cache
def reached(law, slope):
    return bp.reach(experiment(), measured(law, slope))


HIDDEN = [
    (maxwell, False, "displacement", ["-", "c", "k"]),
    pytest.param(spring_on_slope, True, "rotation", "k", marks=pytest.mark.long),
]


@pytest.mark.parametrize(("law", "slope", "acts_on", "tree"), HIDDEN)
def test_the_place_the_kind_of_port_and_the_law_are_found(law, slope, acts_on, tree):
    found = reached(law, slope)
    best = found.laws.iloc[0]
    assert found.chi2_per_datum > 10
    assert (best["acts_on"], best["law"].tree()) == (acts_on, tree)
    assert best["x"] == pytest.approx(AT, abs=5e-3)
    assert best["chi2_per_datum"] == pytest.approx(1.0, abs=0.25)
    assert found.kinds()["probability"].sum() == pytest.approx(1.0)
    assert found.kinds().index[0] == acts_on
    omega = 2 * np.pi * LINES
    assert np.allclose(best["law"].dynamic_stiffness(jnp.asarray(omega)), law(omega), rtol=0.1)


@pytest.mark.parametrize(("law", "slope", "acts_on", "tree"), HIDDEN)
def test_the_law_as_measured_is_that_which_acts(law, slope, acts_on, tree):
    table = reached(law, slope).law_as_measured(acts_on)
    true = law(2 * np.pi * table["frequency"].to_numpy())
    for part, of_law in (("real", true.real), ("imaginary", true.imag)):
        apart = np.abs(table[part] - of_law) / table[f"deviation_{part}"]
        assert np.mean(apart < 1.96) > 0.85


@pytest.mark.parametrize(("law", "slope", "acts_on", "tree"), HIDDEN)
def test_the_law_as_measured_attached_again_explains_the_data(law, slope, acts_on, tree, tmp_path):
    found = reached(law, slope)
    found.law_as_measured(acts_on).to_csv(tmp_path / "law.csv", index=False)
    again = bp.effects.attached(
        float(found.laws["x"].iloc[0]), bp.io.read_law(tmp_path / "law.csv"), motion=acts_on
    )
    setup = experiment() + again
    fitted = null_hypothesis(setup, setup.data(measured(law, slope)))
    # Each line gave its two numbers away.
    left = fitted.problem.count - 2 * LINES.size
    assert fitted.fit.squares / left == pytest.approx(1.0, abs=5 * np.sqrt(2 / left))


@pytest.mark.long
def test_where_the_noise_is_unknown_it_takes_up_nothing_of_what_laws_explain():
    """Squares alone would be least with the greatest noise, whatever the law."""
    share = dist.LogUniform(1e-3, 0.3), dist.LogUniform(1e-6, 1e-2)
    declared = eqx.tree_at(lambda tree: tree.noise, small.experiment(), bp.noise.Relative(*share))
    found = bp.reach(declared, small.without_coherence(small.measured(small.MASS)))
    best = found.laws.iloc[0]
    assert (best["acts_on"], best["law"].tree()) == ("displacement", "m")
    assert best["x"] == pytest.approx(small.MASS.at, abs=5e-3)
    kinds = found.kinds()
    assert found.fails is None and kinds["few_numbers"].iloc[0] > 0.98
    assert kinds["few_numbers"].iloc[1:].max() < 0.7
    assert np.all(kinds["any_law"] < 1) and np.all(kinds["any_law"] > 0.1)


START, END = 0.2, 0.4


def mount(omega):
    spring, dashpot = 2e4, 30j * omega
    return spring * dashpot / (spring + dashpot)


def rubber(omega):
    return 0.15 * (1j * omega / (200 * np.pi)) ** 0.5


SPREAD = [
    pytest.param(mount, "region", ["-", "c", "k"], marks=pytest.mark.longest),
    pytest.param(rubber, "structure", "p", marks=pytest.mark.longest),
]


def reached_all_over(law, acts_on):
    whole = fine_beams.matrices()[0]
    part = fine_beams.spread(fine_beams.HEAVY, START, END) / (END - START)
    spread = law, part if acts_on == "region" else whole
    return bp.reach(experiment(), measured(spread=spread))


@pytest.mark.long
@pytest.mark.parametrize(("law", "acts_on", "tree"), SPREAD)
def test_a_law_that_acts_at_many_places_is_found_and_read(law, acts_on, tree):
    found = reached_all_over(law, acts_on)
    best = found.laws.iloc[0]
    assert (best["acts_on"], best["law"].tree()) == (acts_on, tree)
    assert best["probability"] > 0.9
    assert best["chi2_per_datum"] == pytest.approx(1.0, abs=0.25)
    if acts_on == "region":
        assert (best["x"], best["to_x"]) == pytest.approx((START, END), abs=5e-3)
    table = found.law_as_measured()
    true = law(2 * np.pi * table["frequency"].to_numpy())
    for part, of_law in (("real", true.real), ("imaginary", true.imag)):
        apart = np.abs(table[part] - of_law) / table[f"deviation_{part}"]
        assert np.mean(apart < 1.96) > 0.85
    figure = bp.plots.reach.curves(found, experiment=experiment())
    shown = [panel.get_title().partition(":")[0] for panel in figure.axes]
    assert ("region" if acts_on == "region" else "modulus") in shown
    noun = "dynamic stiffness [N/m]" if acts_on == "region" else "added modulus, relative [1]"
    assert bp.plots.reach.law(found).axes[0].get_ylabel() == noun


def test_the_quantity_of_a_kind_of_port_is_told_by_its_unit():
    units = {kind: table["unit"][0] for kind, table in reached(maxwell, False).measured.items()}
    assert units == {
        "displacement": "N/m",
        "relative": "N/m",
        "rotation": "N m/rad",
        "cut": "rad/(N m)",
        "channel": "1",
        "all_channels": "1",
    }


def test_no_law_removes_more_than_any_law():
    curves = reached(maxwell, False).curves
    assert curves["any_law"].between(0, 1).all()
    assert (curves["few_numbers"] <= curves["any_law"] + 0.02).all()
    # A free law explains much from anywhere; one of few numbers tells the place.
    along = curves[curves["acts_on"] == "displacement"]
    spread = along["few_numbers"].max() - along["few_numbers"].min()
    assert spread > 0.1 and along["any_law"].max() > 0.99


def test_any_law_within_the_whole_band_is_that_of_its_curves():
    found = reached(maxwell, False)
    bound, known = found.any_law_within(LINES[0], LINES[-1]), found.curves["any_law"].to_numpy()
    # Descents end a little before the least; channels that cannot be it are told to first order.
    assert np.abs(bound - known).max() < 0.05 and np.median(np.abs(bound - known)) < 1e-6
    assert not found.any_law_within(1.0, LINES[0] - 1.0).any()  # no line, no misfit


def test_any_law_within_a_band_is_a_dense_least_squares(monkeypatch):
    """Of the residuals of its lines in all unknowns, and in two numbers of the law at each line."""
    bar = small.experiment()
    base, port = Problem(bar, bar.data(small.measured(small.MASS))), _ports.ports_of(bar)[0]
    problem = base.with_effect(port.effect)
    free = FreeLaw(problem, _ports.place_columns(port, problem))
    point = np.full(base.dimension, 0.1)
    points = point_in_problem(base, point, problem)[None]
    points[:, free.held] = 0.3
    at = free.at(points)
    law = [at.best(), 1 - at.receptance * at.best()]
    along = _slopes(lambda around: free.residuals(around, *law), points)
    turned = np.einsum("cl,lm->lcm", at.slope[0], np.eye(small.LINES.size))
    of_law = np.concatenate([turned, 1j * turned])
    with_law = [*np.delete(along, free.held, axis=0), *of_law], at.left(at.best())[0]

    def alone(around):
        return complex_residuals(base.squares.residuals(around)[0], base)

    as_given = [*_slopes(alone, point[None])], alone(point[None])[0]
    reach = ReachOfPort(port, free, points, *np.zeros((3, 1)))
    # Where fewer products are kept, a band is widened to the edges that are there: here to all.
    for most, lines in ((2**22, slice(10, 30)), (1, slice(None))):
        monkeypatch.setattr(_in_bands, "MOST_NUMBERS", most)
        bounds = _in_bands.left_in_bands(base, point, [reach])
        (share,) = bounds.any_law(small.LINES[10], small.LINES[29])
        given, left = (_least(*each, lines, point) for each in (as_given, with_law))
        count = small.LINES[lines].size
        above = given - base.count / small.LINES.size * count
        assert 0.05 < share < 1
        assert share == pytest.approx((given - left - 2 * count) / above, rel=1e-4)


def test_any_law_within_a_band_of_unknown_noise_is_a_share_of_all_residuals():
    """The noise takes up the misfit, so that nothing is left above it of which it were a share."""
    share = dist.LogUniform(1e-3, 0.3), dist.LogUniform(1e-6, 1e-2)
    bar = eqx.tree_at(lambda tree: tree.noise, small.experiment(), bp.noise.Relative(*share))
    null = null_hypothesis(bar, bar.data(small.without_coherence(small.measured(small.MASS))))
    known, point = at_known_noise(null.problem, null.fit.point)
    port = _ports.ports_of(bar)[0]
    problem = known.with_effect(port.effect)
    free = FreeLaw(problem, _ports.place_columns(port, problem))
    points = np.tile(point_in_problem(known, point, problem), (2, 1))
    (place,) = free.held
    points[:, place] = norm.ppf([small.MASS.at, 0.9])
    reach = ReachOfPort(port, free, points, *np.zeros((3, 2)))
    bounds = _in_bands.left_in_bands(null.problem, null.fit.point, [reach])
    for band in ((30.0, 700.0), (100.0, 300.0)):
        at_mass, elsewhere = bounds.any_law(*band)
        assert at_mass > 0.9 and elsewhere < at_mass


def _slopes(residuals, point, step=1e-6):
    directions = step * np.eye(point.shape[1])
    around = [residuals(point + sign * each)[0] for each in directions for sign in (1, -1)]
    return (np.array(around[::2]) - np.array(around[1::2])) / (2 * step)


def _least(along, residual, lines, prior):
    """Sum of squares of the data of some lines where that of data and prior is least."""

    def parts(values):
        return np.concatenate([np.real(values).ravel(), np.imag(values).ravel()])

    columns = np.array([parts(each[:, lines]) for each in along]).T
    of_data = parts(residual[:, lines])
    both = np.concatenate([columns, np.eye(prior.size, columns.shape[1])])
    moved, *_ = np.linalg.lstsq(both, -np.concatenate([of_data, prior]), rcond=None)
    return float(np.sum((of_data + columns @ moved) ** 2))


def test_reach_is_told_in_words():
    found = reached(maxwell, False)
    assert found.words()[0].startswith("displacement at 2")
    assert "dashpot - spring removes 100%" in found.words()[0]
    assert repr(found).startswith("Reach: reduced chi-square")
    assert found.one_explains and "(probability 0." in found.words()[0]


def test_no_law_is_called_probable_where_none_alone_leaves_nothing_but_noise():
    found = reached(maxwell, False)
    not_all = dataclasses.replace(found, one_explains=False)
    assert not any("probability" in sentence for sentence in not_all.words())
    assert not_all.words()[-1].endswith("not where something acts.")
    figures = bp.plots.reach.curves(not_all), bp.plots.reach.law(not_all)
    titles = [panel.get_title() for figure in figures for panel in figure.axes]
    entries = [text.get_text() for text in figures[1].findobj(Text)]
    assert not any("probability" in word for word in [*titles, *entries])
    assert not any(kind["chance"] for kind in reach_for_page(not_all)["kinds"])


def test_places_that_are_not_told_apart_are_told_and_shaded():
    known = reached(maxwell, False)
    assert "do not tell where" not in known.words()[0]
    assert len(known.as_good("displacement")) == 1
    rows = known.curves
    near = (rows["acts_on"] == "displacement") & rows["x"].between(0.2, 0.4)
    evidence = np.where(near, -2.5 * (rows["x"] > 0.3), -3.5)  # strong evidence is 3.0
    found = dataclasses.replace(known, curves=rows.assign(log_evidence=evidence))
    assert "do not tell where between 204 and 396 mm" in found.words()[0]
    (panel,) = (
        each
        for each in bp.plots.reach.curves(found).axes
        if each.get_title().startswith("displacement")
    )
    shaded = [p.get_x() + np.array([0, p.get_width()]) for p in panel.patches]
    assert np.ravel(shaded)[[0, -1]] == pytest.approx([0.192, 0.408])


def test_a_kind_of_port_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="one of displacement, relative, rotation, "):
        reached(maxwell, False).law_as_measured("torsion")


@pytest.mark.parametrize(
    ("acts_on", "port"),
    [(["rotation"], "rotation"), ([], None), (["channel"], None), (["rotation", "cut"], None)],
)
def test_the_law_of_a_ledger_is_that_at_the_port_of_its_only_claim(acts_on, port):
    entries = tuple({"acts_on": word} for word in acts_on)
    found = reached(maxwell, False)
    ledger = object.__new__(Ledger)  # without all else that a search finds
    vars(ledger).update(effects=entries, reach=found)
    assert ledger.port == port
    expected = None if port is None else found.law_as_measured(port)
    assert ledger.z is None if port is None else ledger.z.equals(expected)


def solid(omega, stiffness=2e3, further=8e3, viscosity=8.0):
    """A spring beside a spring and a dashpot in series."""
    return stiffness + 1 / (1 / further + 1 / (1j * omega * viscosity))


@pytest.mark.long
def test_a_law_that_no_place_of_a_coarse_grid_shows_is_found_where_the_best_other_one_is(
    monkeypatch,
):
    monkeypatch.setitem(_ports.PLACES, 1, 4)
    setup = experiment()
    null = null_hypothesis(setup, setup.data(measured(solid)))
    port = _ports.ports_of(null.problem.experiment)[0]
    reach = _named_laws.reach_of_port(null.problem, null.fit.point, port)
    first = _named_laws.laws_with_names(reach, 1)
    assert min(law.fit.squares for law in first) > 2 * null.problem.count
    best = max(_named_laws._refined(reach, first, 1), key=lambda law: law.fit.log_evidence)
    assert best.tree == ["|", "k", ["-", "c", "k"]]
    assert best.fit.squares == pytest.approx(null.problem.count, rel=0.2)
