"""Every noun and result has a short repr, and says itself in HTML in a notebook."""

import html.parser

import numpy as np
import pandas as pd
import pytest

import bayes_placement as bp
from bayes_placement.design.effective_independence import EffectiveIndependence
from bayes_placement.design.place import Placement
from bayes_placement.positions.reprs import notebook_html
from models import bar

NOUNS = {
    "Experiment": bar.experiment,
    "Structure": bar.experiment.structure + bp.effects.point_mass(0.3, 0.1),
    "Sensor": bar.experiment.sensor["s1"],
    "Actuator": bar.experiment.actuator["a1"],
    "Measurement": bar.measurement,
    "ModalParameters": bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2]),
    "Placement": Placement(
        positions={"s1": 0.25},
        omitted=(),
        information_gain=2.0,
        information_gain_se=0.1,
        cost=0.0,
        lead=0.5,
        lead_se=0.1,
        table=pd.DataFrame({"s1": np.linspace(0, 1, 500), "information_gain": 2.0}),
        search="Exhaustive",
        evaluations=500,
    ),
    "EffectiveIndependence": EffectiveIndependence(
        {"s1": 0.25}, pd.DataFrame({"place": [0.25]}), np.array([1.0]), (1,)
    ),
}


class Tags(html.parser.HTMLParser):
    """Tags that are open, to see that all are closed."""

    def __init__(self):
        html.parser.HTMLParser.__init__(self)
        self.open, self.seen = [], set()

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.seen.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.parametrize("name", NOUNS)
def test_a_noun_is_short_and_begins_with_its_name(name):
    text = repr(NOUNS[name])
    assert text.startswith(name)
    assert len(text) < 250 and "object at 0x" not in text and "\n" not in text


@pytest.mark.parametrize("name", NOUNS)
def test_a_notebook_shows_a_table(name):
    parser = Tags()
    parser.feed(NOUNS[name]._repr_html_())
    parser.close()
    assert parser.open == []
    assert "table" in parser.seen


def test_priors_stand_in_the_table_of_an_experiment():
    shown = bar.experiment._repr_html_()
    assert "Uniform(0.02, 0.06)" in shown and "sensor.s1.position" in shown


def test_what_looks_like_html_is_escaped():
    shown = notebook_html("a < b", pd.DataFrame({"<x>": ["<y>"]}), ["<script>"])
    assert "<script>" not in shown and "a &lt; b" in shown and "&lt;y&gt;" in shown
