"""Annotations are checked: kinds, shapes, dimensions that must agree, and classes named later."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest
from beartype.roar import BeartypeCallHintViolation
from jaxtyping import Float

from tests.annotation_checks import checked

if TYPE_CHECKING:
    from nowhere import Unknown

Vector = Float[np.ndarray, "length"]

refused = pytest.raises(BeartypeCallHintViolation)


@checked
def product(matrix: Float[np.ndarray, "row length"], vector: Vector) -> Float[np.ndarray, "row"]:
    return matrix @ vector if len(vector) < 9 else vector


@checked
def of_plain_kinds(number: int, word: str = "") -> list[Vector] | None:
    assert product(np.ones((4, 2)), np.ones(2)).size == 4  # dimensions of its own
    return None


@checked
def of_later_classes(items: "list[Later]", unknown: "Unknown") -> "Later":
    return items[0] if items else unknown


class Later:
    pass


@checked
@dataclass
class Sized:
    first: Vector
    second: Vector


def test_dimensions_of_one_name_must_agree():
    product(np.ones((3, 2)), np.ones(2))
    with refused:
        product(np.ones((3, 2)), np.ones(3))
    with refused:
        product(np.ones((3, 9)), np.ones(9))  # what it returns has another number of rows


def test_another_dtype_or_rank_is_refused():
    with refused:
        product(np.ones((3, 2), int), np.ones(2))
    with refused:
        product(np.ones(2), np.ones(2))


def test_each_call_has_dimensions_of_its_own():
    product(np.ones((3, 2)), np.ones(2))
    product(np.ones((5, 4)), np.ones(4))
    of_plain_kinds(3)


def test_kinds_are_checked_where_there_are_no_shapes():
    with refused:
        of_plain_kinds("3")
    with refused:
        of_plain_kinds(3, word=4)


def test_classes_are_known_that_are_defined_below():
    later = Later()
    assert of_later_classes([later], None) is later
    with refused:
        of_later_classes([3], None)
    with refused:
        of_later_classes([], 3)  # returned, where the class is known; its own kind is not


def test_what_makes_a_dataclass_is_checked():
    Sized(np.ones(2), np.ones(2))
    with refused:
        Sized(np.ones(2), np.ones(3))
