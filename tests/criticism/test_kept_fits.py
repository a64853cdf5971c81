"""Fits stay in a folder: a search that was ended goes on, and no damaged fit is believed."""

import jax
import numpy as np
import pytest

from bayes_placement import effects
from bayes_placement._shared.errors import WritingError
from bayes_placement.criticism import kept_fits
from bayes_placement.criticism.missing import (
    _descents,
    _held_out,
    _scan,
    _shared_fits,
    _suspicion,
    fitted_model,
)
from bayes_placement.criticism.missing.explain import explain
from bayes_placement.criticism.missing.improve import improve
from bayes_placement.experiment.model_error import Embedded
from tests.criticism.small import MASS, experiment, measured

ERRORS = Embedded(shape=None, stiffness_and_mass=None, modes=3)


@pytest.fixture(scope="module")
def candidates():
    return effects.library(experiment(), ["point_mass"])


@pytest.fixture
def asked(candidates):
    """A search in a process that has no fits in its memory."""

    def ask(function=improve, seed=1, **settings):
        _shared_fits._LAST.clear()
        return function(experiment(), measured(MASS, seed=seed), candidates=candidates, **settings)

    return ask


@pytest.fixture(scope="module")
def full_store(tmp_path_factory, candidates):
    """Folder of a search, and its ledger."""
    folder = tmp_path_factory.mktemp("fits")
    _shared_fits._LAST.clear()
    data = measured(MASS, seed=1)
    return folder, improve(experiment(), data, candidates=candidates, store=folder)


@pytest.fixture
def store(full_store, tmp_path):
    """Copy of its folder."""
    for file in full_store[0].iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def same(ledger, other):
    """Whether two ledgers say the same, to the last bit."""
    first, second = (
        {k: v for k, v in x.to_json().items() if k not in ("wall_seconds", "record")}
        for x in (ledger, other)
    )
    return first == second


def once_more(*_, **__):
    raise AssertionError("It was done again.")


def test_a_second_search_computes_nothing_and_says_the_same(asked, full_store, monkeypatch):
    folder, ledger = full_store
    monkeypatch.setattr(_descents, "minimise", once_more)
    monkeypatch.setattr(_scan, "_scanned", once_more)
    monkeypatch.setattr(_suspicion, "_signatures", once_more)
    monkeypatch.setattr(kept_fits.Problem, "prepare", once_more)
    with monkeypatch.context() as patched:
        patched.setattr(_held_out, "_evidence_ratio", once_more)
        patched.setattr(fitted_model, "sampled_about", once_more)
        assert same(asked(store=folder), ledger)
    # This one samples and holds out more hypotheses.
    ranking = asked(explain, store=folder)
    assert ranking.probabilities == ledger.probabilities


def test_other_data_are_fitted_anew(asked, store):
    with kept_fits.fits_kept_in(store) as fits:
        asked(explain, seed=2)
        assert fits.taken == 0


class EndedError(Exception):
    """The search was ended."""


def test_a_search_that_was_ended_goes_on(asked, full_store, tmp_path):
    def until_half(share):
        if share > 0.3:
            raise EndedError

    with pytest.raises(EndedError):
        asked(store=tmp_path, progress=until_half)
    done = len([*tmp_path.iterdir()])
    assert done > 0
    with kept_fits.fits_kept_in(tmp_path) as fits:
        ledger = asked()
    assert fits.taken == done
    assert same(ledger, full_store[1])


@pytest.mark.long
def test_damaged_and_copied_fits_are_made_anew_and_said(asked, full_store, store):
    damaged, copied = sorted(store.iterdir())[:2]
    content = bytearray(damaged.read_bytes())
    copied.write_bytes(bytes(content))
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    with pytest.warns(UserWarning, match="is damaged") as warned:
        assert same(asked(store=store), full_store[1])
    files = {str(warning.message).split(" is damaged")[0] for warning in warned}
    assert files == {str(damaged), str(copied)}


@pytest.mark.long
def test_a_full_disk_does_not_end_the_search(asked, full_store, tmp_path, monkeypatch):
    def full(*_):
        raise WritingError("there is no room")

    monkeypatch.setattr(kept_fits.ArrayStore, "write", full)
    with pytest.warns(UserWarning, match="A fit is not kept for a later run: there is no room"):
        assert same(asked(store=tmp_path), full_store[1])


def test_what_this_run_wrote_is_not_counted_as_taken_from_an_earlier_one(tmp_path):
    for taken in (0, 1):
        fits = kept_fits.KeptFits(tmp_path)
        if not taken:
            fits.write("mine", np.zeros(2))
        np.testing.assert_array_equal(fits.read("mine", np.ones(2)), np.zeros(2))
        assert fits.taken == taken


def _kept(problem, number):
    """What follows from a problem and a number, in whatever process."""
    return kept_fits.stored_or_computed(lambda: np.zeros(2), np.zeros(2), problem, number)


def test_what_one_part_of_a_run_wrote_is_not_counted_where_another_reads_it(tmp_path):
    """Each part, in a helper or here, looks at the folder anew."""
    setup = experiment()
    problem = kept_fits.Problem(setup, setup.data(measured(MASS, seed=1)))
    for taken in (0, 2):
        with kept_fits.fits_kept_in(tmp_path) as fits:
            for number in (1, 2, 1):
                kept_fits.fitted_in_processes(_kept, [(problem, number)])
            assert fits.taken == taken


def test_results_of_other_forms_from_the_same_inputs_are_kept_apart(tmp_path):
    setup = experiment()
    problem = kept_fits.Problem(setup, setup.data(measured(MASS, seed=1)))
    asked = (np.zeros(2), (np.zeros(2), 1.0), kept_fits.NO_RIVAL)
    with kept_fits.fits_kept_in(tmp_path):
        for tree in (*asked, *asked):
            found = kept_fits.stored_or_computed(lambda tree=tree: tree, tree, problem, 3)
            assert jax.tree.structure(found) == jax.tree.structure(tree)
            assert kept_fits.is_stored(tree, problem, 3)
    assert len([*tmp_path.iterdir()]) == len(asked)


def test_what_is_large_is_not_kept(tmp_path):
    fits = kept_fits.KeptFits(tmp_path)
    fits.write("small", np.zeros(2))
    fits.write("large", np.zeros(kept_fits.MOST_BYTES))
    assert [path.stem for path in tmp_path.iterdir()] == ["small"]


def test_sizes_of_errors_come_back(tmp_path):
    setup = experiment().with_model_error(ERRORS)
    problem = kept_fits.Problem(setup, setup.data(measured(seed=4)))
    starts = np.zeros((1, problem.dimension))
    anew = kept_fits.kept_with_sizes(problem, starts, (0.1,))
    with kept_fits.fits_kept_in(tmp_path):
        kept_fits.kept_with_sizes(problem, starts, (0.1,))
    with kept_fits.fits_kept_in(tmp_path) as fits:
        again = kept_fits.kept_with_sizes(problem, starts, (0.1,))
        assert fits.taken == 1
    assert again.problem.sizes == anew.problem.sizes
    assert again.deviations == anew.deviations
    assert again.as_rival == anew.as_rival
    np.testing.assert_array_equal(again.fit.point, anew.fit.point)
    np.testing.assert_array_equal(again.fit.gaussian.root, anew.fit.gaussian.root)
    assert again.fit.log_evidence == anew.fit.log_evidence
