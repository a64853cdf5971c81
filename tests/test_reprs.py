"""Every noun and result has a short repr, and says itself in HTML in a notebook."""

import html.parser
from xml.etree import ElementTree

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pandas as pd
import pytest

import bayes_placement as bp
from bayes_placement._shared.reprs import notebook_html, noun_html
from bayes_placement.design.effective_independence import EffectiveIndependence
from bayes_placement.design.place import Placement
from bayes_placement.experiment.data_checks import DataChecks
from bayes_placement.experiment.data_checks.record import Fault
from bayes_placement.laws import Law
from bayes_placement.laws.catalogue import leaves
from models import bar
from tests import public_calls

PLOTS = ("ledger", "measurement", "misfit", "modes", "placement", "posterior", "reach", "structure")

LONG = {
    "files": [pytest.mark.long, pytest.mark.longest],
    "methods": pytest.mark.long,
    "verbs": pytest.mark.long,
}
"""Groups of public calls that start processes, or infer and search."""

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


SENTENCES = {"Estimate", "Misfit", "ModelComparison"}
"""Results whose line is a sentence of what was found, which may be longer than that of a noun."""


def is_typed(law):
    """Whether what is printed of a law can be typed, and is that law; a table is told in short."""
    if "t" in leaves(law.tree()):
        return "Tabulated(" in repr(law)
    typed = eval(repr(law), {**vars(dist), **vars(bp.effects)})
    return eqx.tree_equal(*(jax.tree.map(float, one) for one in (typed, law)))


def is_well_formed(text):
    try:
        ElementTree.fromstring(text)
    except ElementTree.ParseError:
        return False
    return text.startswith("<div>")


def offences(made):
    """What is wrong with the repr and the HTML of a noun or result; laws are typed as algebra."""
    text, kind = repr(made), type(made).__name__
    begins = is_typed(made) if isinstance(made, Law) else text.startswith(kind)
    if "\n" in text or " object at 0x" in text or not begins:
        yield text
    if len(text) > (250 if kind in SENTENCES else 200):
        yield f"{len(text)} characters: {text}"
    if not is_well_formed(made._repr_html_()):
        yield made._repr_html_()


@pytest.mark.filterwarnings("ignore")  # of inferences and estimates that are too small
@pytest.mark.parametrize(
    "group",
    [
        *sorted({*public_calls.GROUPS} - {"plots", *LONG}),
        *(pytest.param(group, marks=marks) for group, marks in LONG.items()),
    ],
)
def test_what_public_calls_return_is_short(group):
    calls = public_calls.GROUPS[group]()
    made = {
        label: call._replace(then=None).make()
        for label, call in calls.items()
        if call.has_right and label != "positions.rotation"  # a matrix
    }
    ours = {
        label: noun
        for label, noun in made.items()
        if type(noun).__module__.startswith("bayes_placement")
    }
    assert ours
    wrong = {label: [*offences(noun)] for label, noun in ours.items()}
    assert not {label: words for label, words in wrong.items() if words}


class Reader(bp.effects.Attachment):
    """An effect of a user, whose line comes from the base."""

    absent = ("mass", 0.0)
    at: object
    mass: object
    name: str = "reader"

    def dynamic_stiffness(self, omega):
        """None."""

    @classmethod
    def suggest(cls, scales):
        """None."""


LINES = {
    "PointMass(at=Segment(centre=0.3 m, within=0.1 m), mass=Uniform(0, 1) kg)": (
        bp.effects.point_mass(bp.positions.Segment(0.3, within=0.1), dist.Uniform(0.0, 1.0))
    ),
    "PointMass(at=0.3 m, mass=0.1235 kg, name='clamp')": bp.effects.point_mass(
        0.3, 0.123456, name="clamp"
    ),
    "Reader(at=0.3, mass=2)": Reader(0.3, 2),
    "GroundSpring(at=0.3 m, stiffness=1e+04 N/m, direction=(0, 0.6, 0.8))": (
        bp.effects.ground_spring(0.3, 1e4, direction=(0.0, 0.6, 0.8))
    ),
    "Modal(ratio=(Uniform(0.02, 0.06), 0.04))": bp.damping.Modal([dist.Uniform(0.02, 0.06), 0.04]),
    "Embedded()": bp.model_error.Embedded(),
    "Embedded(shape=None, runs=0.01)": bp.model_error.Embedded(shape=None, runs=0.01),
    "Embedded(frequency=LogUniform(1e-05, 0.2))": bp.model_error.Embedded(
        frequency=dist.LogUniform(1e-5, 0.2)
    ),
    "Gaussian(sigma=0.01 [unit of z])": bp.noise.Gaussian(0.01),
    "Gaussian(sigma=array of 1x1x4 [unit of z])": bp.noise.Gaussian(np.ones((1, 1, 4))),
    "Complex(quantity='velocity')": bp.observe.Complex("velocity"),
    "SMC()": bp.engines.SMC(),
    "SMC(particles=400)": bp.engines.SMC(particles=400),
    "Latent()": bp.marginals.Latent(),
    "KernelGain(draws=16)": bp.information.KernelGain(draws=16),
    "Cartesian(x=0.5 m, y=Uniform(0.38, 0.42) m, z=0 m)": bp.positions.Cartesian(
        0.5, dist.Uniform(0.38, 0.42), 0.0
    ),
    "UniformBar(length=1 m, area=0.001 m2, youngs_modulus=1e+09 Pa, density=9000 kg/m3, "
    "wave_numbers=15 values from 3.142 to 47.12, ends=('fixed', 'fixed'))": bp.beams.bar(
        15, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0, ends="fixed-fixed"
    ),
    "Report(title='Frame')": bp.plots.report.Report("Frame"),
    "Channel(name='s1', direction=-1)": bp.Channel("s1", -1),
    "DataChecks: phase: 1 faults": DataChecks(
        {"phase": [Fault("s1", "a1", 1.0, 0.5, "It is wrong.")], "overload": []}
    ),
    "DataChecks: No fault was found in the data (checked: overload).": DataChecks({"overload": []}),
}


@pytest.mark.parametrize("line", LINES)
def test_a_line_names_the_class_and_what_differs_from_defaults(line):
    assert repr(LINES[line]) == line
    assert not [*offences(LINES[line])]


SPRING, MASS = bp.effects.Spring(1e4), bp.effects.Mass(dist.Uniform(0.0, 0.5))
NETWORKS = [
    SPRING,
    SPRING | bp.effects.Dashpot(dist.LogUniform(1.0, 1e3)),
    (SPRING | bp.effects.Dashpot(2.0)) - MASS,
    0.5 * (bp.effects.Springpot(1e4, 0.3, 50.0) - MASS),
    dist.Uniform(0.0, 1.0) * bp.effects.LossySpring(1e4, 0.2) | MASS,
]


@pytest.mark.parametrize("law", NETWORKS, ids=repr)
def test_a_network_is_shown_as_it_is_typed_and_drawn(law):
    assert not [*offences(law)]
    parser = Tags()
    parser.feed(law._repr_html_())
    parser.close()
    assert parser.open == []
    assert {"svg", "path", "text", "table"} <= parser.seen


def test_what_results_hold_is_short():
    steps = public_calls.ledger().steps
    assert steps and not [offence for step in steps for offence in offences(step)]


def test_numbers_that_are_traced_are_no_trouble():
    said = []

    def traced(mass, masses):
        said.append(repr(bp.effects.point_mass(dist.Uniform(0.0, mass), mass)))
        said.append(repr(bp.noise.Gaussian(masses)))
        said.append(bp.effects.point_mass(dist.Uniform(0.0, mass), mass)._repr_html_())
        return mass

    jax.jit(traced)(1.0, jnp.ones((1, 1, 4)))
    assert said[0] == "PointMass(at=Uniform(0, traced) m, mass=traced number kg)"
    assert said[1] == "Gaussian(sigma=traced array of 1x1x4 [unit of z])"
    assert "Uniform(0, traced)" in said[2]


def test_a_noun_of_many_fields_is_cut():
    names = {f"a rather long name of the axis {number}": number for number in range(3)}
    placed = bp.design.Lead(names, names, 1.0, 0.5)
    assert len(repr(placed)) < 200 and repr(placed).endswith(", ...)")


def test_html_of_a_noun_shows_priors_or_else_fields():
    unknown, known = dist.Uniform(0.0, 1.0), bp.effects.point_mass(0.3, 0.1)
    assert "<td>Uniform(0, 1)</td>" in noun_html(bp.effects.point_mass(0.3, unknown))
    assert "<td>mass</td>" in noun_html(known) and "<td>kg</td>" in noun_html(known)


def test_completion_offers_what_a_room_defines():
    assert {"Modal", "Rayleigh"} <= {*dir(bp.damping)}
    assert {"suspicion", "probabilities"} <= {*dir(bp.plots.ledger)}
    assert callable(bp.plots.experiment)  # which imports the module that has it
    rooms = (
        bp.damping,
        bp.model_error,
        bp.noise,
        bp.observe,
        *(getattr(bp.plots, name) for name in PLOTS),
    )
    for room in rooms:
        assert all(callable(getattr(room, name)) for name in dir(room)), room
        assert not {"Any", "Parameter", "panels", "partial"} & {*dir(room)}, room
