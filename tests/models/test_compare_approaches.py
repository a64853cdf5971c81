"""Both approaches run on the same data, and the conclusions follow from their results."""

import matplotlib.image
import numpy as np
import pytest

from models import compare_approaches as study

SIZES = study.Sizes(draws=300, kernels=40, particles=160, moves=5, nodes=0, placement_nodes=0)


@pytest.fixture(scope="module")
def outcome():
    return study.study(SIZES, (study.WITHOUT, study.WITH))


@pytest.mark.long
@pytest.mark.longest
def test_both_approaches_see_the_very_same_data(outcome):
    trees = [result for results in outcome.results.values() for result in results.values()]
    assert len(trees) == 4
    measured = [tree["observed_data"]["measured"] for tree in trees]
    for values in measured:
        assert values.identical(measured[0])
        assert values.sizes == {"sensor": 3, "actuator": 1, "frequency": 10}


@pytest.mark.long
@pytest.mark.longest
def test_the_table_has_a_row_for_each_approach(outcome):
    rows = study.table(outcome, study.WITH)
    assert list(rows.index) == [study.KDE, study.LATENT]
    for name in ("modes.youngs_modulus mean", "effects.point_mass.mass variation", "seconds"):
        assert np.all(rows[name].astype(float) >= 0)
    assert float(rows.loc[study.KDE, "kernel / noise"]) > 5
    assert rows.loc[study.LATENT, "kernel / noise"] == "-"
    assert "effects.point_mass.mass mean" not in study.table(outcome, study.WITHOUT)


@pytest.mark.long
@pytest.mark.longest
def test_a_hidden_effect_biases_and_adding_it_corrects(outcome):
    true = outcome.scenes[study.WITH].truth[study.STIFFNESS]
    means = {
        scene: float(results[study.LATENT]["posterior"][study.STIFFNESS].mean())
        for scene, results in outcome.results.items()
    }
    assert abs(means[study.WITHOUT] - true) > 0.04 * true
    assert abs(means[study.WITH] - true) < 0.02 * true


@pytest.mark.long
@pytest.mark.longest
def test_the_sentences_say_what_follows(outcome):
    sentences = study.sentences(outcome)
    for beginning in (
        f"{study.WITH}: the kernels are ",
        f"{study.WITH}, KDE: Importance sampling is unreliable here",
        "KDE: without the clamp in the model, Young's modulus is ",
        "latent: without the clamp in the model, Young's modulus is 6",
        "Adding the mass raises the log evidence by ",
        f'The evidence prefers "{study.WITH}" to "{study.WITHOUT}": log Bayes factor ',
    ):
        assert any(line.startswith(beginning) for line in sentences), beginning
    assert any("very strong" in line for line in sentences)


@pytest.mark.long
@pytest.mark.longest
def test_the_command_writes_tables_words_and_a_figure(outcome, tmp_path, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(study, "study", lambda *arguments: asked.append(arguments) or outcome)
    study.main(["--fast", "--out", str(tmp_path / "new")])
    assert asked == [(study.FAST, (study.WITHOUT, study.WITH))]
    text = capsys.readouterr().out
    assert f"{study.WITHOUT}\n" in text
    assert "- The evidence prefers" in text
    assert matplotlib.image.imread(tmp_path / "new" / "approaches.png").shape[1] > 600


@pytest.mark.long
@pytest.mark.longest
def test_the_figure_names_parameter_unit_and_approaches(outcome):
    for axis, name in zip(study.figure(outcome).axes, outcome.results, strict=True):
        assert axis.get_title() == name
        assert axis.get_xlabel() == "structure.modes.youngs_modulus [Pa]"
        labels = [text.get_text() for text in axis.get_legend().get_texts()]
        assert labels == [study.KDE, study.LATENT, "true value"]


def test_quadrature_joins_where_parameters_are_few():
    scenes = study.scenes()
    names = {
        scene: [method.name for method in study.approaches(scenes[scene].experiment, study.FULL)]
        for scene in scenes
    }
    assert names[study.PAPER] == names[study.WITHOUT] == [study.KDE, study.LATENT, study.EXACT]
    assert names[study.WITH] == [study.KDE, study.LATENT]
    methods = study.approaches(scenes[study.PAPER].experiment, study.FAST)
    assert [method.name for method in methods] == [study.KDE, study.LATENT]


@pytest.mark.long
@pytest.mark.longest
def test_all_draws_in_one_place_are_drawn_as_a_line(outcome):
    axis = study.figure(outcome).axes[0]
    before = len(axis.lines)
    study._density(axis, np.full(50, 1e9), label="copies", color="C3", linestyle="-")
    assert len(axis.lines) == before + 1


def test_nodes_of_a_quadrature_stand_for_the_intervals_about_them():
    edges = study._cells(np.repeat([1.0, 2.0, 4.0], 5))
    np.testing.assert_allclose(edges, [0.5, 1.5, 3.0, 5.0])
