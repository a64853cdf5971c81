"""The formula of a network, read as a number, is its dynamic stiffness."""

import json
import re

import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.mathtext import MathTextParser

from bayes_placement.effects import Dashpot, LossySpring, Mass, Spring, Springpot
from bayes_placement.laws import law_of, networks
from bayes_placement.laws.catalogue import ELEMENTS, leaves
from bayes_placement.laws.symbols import numbers

TREES = [*networks("kcmp", 3), *networks("kmh", 2)]
SPRING, DASHPOT, MASS = Spring(2e4), Dashpot(40.0), Mass(0.3)
SCALED = [
    0.4 * SPRING,
    0.4 * MASS,
    0.4 * (SPRING | MASS),
    SPRING | 0.4 * MASS,
    0.4 * (Springpot(1e4, 0.4, 30.0) - 0.3 * (MASS | LossySpring(2e4, 0.2))),
    0.5 * (0.4 * (SPRING | DASHPOT)) - MASS,
    MASS | SPRING - (MASS | DASHPOT),
    (SPRING | DASHPOT) - MASS | SPRING - MASS | MASS,
]


def law_of_tree(tree):
    size = sum(ELEMENTS[letter][1] for letter in leaves(tree))
    return law_of(tree, np.random.default_rng(1).uniform(0.1, 0.9, size).round(4).tolist())


LAWS = [*map(law_of_tree, TREES), *SCALED]
every_law = pytest.mark.parametrize("law", LAWS, ids=[*map(json.dumps, TREES), *map(repr, SCALED)])


def in_python(latex):
    """Formula as an expression of Python: braces of fractions and powers become brackets."""
    (inside,) = re.fullmatch(r"\$\\displaystyle Z = (.*)\$", latex).groups()
    inside = re.sub(r"_\{(\d+)\}", r"_\1", inside).replace("}{", ") / (")
    inside = inside.replace("lambda", "factor")  # a word of Python
    inside = re.sub(r"\\(left|right|frac)", "", inside).replace("^{", "**(").replace("^2", "**2")
    inside = inside.replace("{", "(").replace("}", ")").replace("\\", " ")
    return re.sub(r"(?<=[\w)]) +(?=[\w(])", " * ", inside)


@every_law
def test_the_formula_is_the_dynamic_stiffness(law):
    omega = 37.0
    named = {
        re.sub(r"[\\{}]", "", number.latex).replace("lambda", "factor"): float(number.value)
        for _, held in numbers(law)
        for number in held
    }
    value = eval(in_python(law._repr_latex_()), {"omega": omega, "i": 1j, "pi": np.pi, **named})
    exact = complex(law.dynamic_stiffness(jnp.array([omega]))[0])
    np.testing.assert_allclose(value, exact, rtol=1e-10)


@every_law
def test_the_formula_can_be_set(law):
    # Matplotlib sets all formulas in the style of a display, and has no word for it.
    MathTextParser("agg").parse(law._repr_latex_().replace(r"\displaystyle ", ""))


FORMULAS = {
    r"k + i\omega c": SPRING | DASHPOT,
    r"k_1 - \omega^2 m + k_2": Spring(1.0) | Mass(1.0) | Spring(2.0),
    r"\left(\frac{1}{k} + \frac{1}{i\omega c}\right)^{-1}": SPRING - DASHPOT,
    r"\lambda \left(k - \omega^2 m\right)": 0.4 * (SPRING | MASS),
    r"\lambda \left(-\omega^2 m\right)": 0.4 * MASS,
    r"\lambda \left(\frac{1}{k} + \frac{1}{-\omega^2 m}\right)^{-1}": 0.4 * (SPRING - MASS),
    r"k \left(\frac{i\omega}{2\pi f}\right)^{\alpha}": Springpot(1e4, 0.5),
    r"k_1 (1 + i \eta_1) + k_2 (1 + i \eta_2)": LossySpring(1.0, 0.1) | LossySpring(2.0, 0.2),
}


@pytest.mark.parametrize("words", FORMULAS)
def test_formulas_as_written_by_hand(words):
    assert FORMULAS[words]._repr_latex_() == rf"$\displaystyle Z = {words}$"


def test_an_index_of_two_digits_stands_in_braces():
    law = Spring(1.0)
    for stiffness in range(2, 12):
        law = law | Spring(float(stiffness))
    assert law._repr_latex_().endswith(r"k_9 + k_{10} + k_{11}$")
