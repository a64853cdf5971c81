"""Scores of answers on unlisted cases: what was found, which laws, what was wrong.

A true effect is found where a claim, or an entry of its `equivalent` of .05 or more, acts on the
right kind of port, each of its places within 2 % of the size of the structure or in its own 95 %
interval, which may be a tenth of the size wide at most. Claims at one place count as one law in
parallel. The law is right where its tree, or that of an entry of `equivalent`, is expected, or its
name is. A wrong name is a claim of .9 or more that finds nothing, or whose law is not expected.
"""

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

from tests.simulator.law_networks import Tree

Claim = Mapping[str, Any]
"""An entry of `effects` of a ledger."""

NEAR, WIDEST = 0.02, 0.1
"""Greatest distance of a place, and of the width of its interval, over the size."""

LEAST, SURE = 0.05, 0.9
"""Least probability of an entry of `equivalent` that counts, and of a claim that is a name."""

NAMED = {"0.9 to 0.99": (0.9, 0.99), "above 0.99": (0.99, 1.01)}
"""Probabilities with which names are told; the lower end belongs to them."""


@dataclass(frozen=True)
class Score:
    """How one case was answered."""

    effects: int
    found: int
    laws: int
    names: tuple[tuple[float, bool], ...]  # of each claim its probability, and whether it is right

    @property
    def wrong(self) -> int:
        """Wrong names."""
        return sum(probability >= SURE and not right for probability, right in self.names)

    @property
    def is_alarm(self) -> bool:
        return bool(self.names) and not self.effects


def score(claims: Sequence[Claim], expected: Sequence[Mapping[str, Any]], size: float) -> Score:
    """Score the claims of one case, whose structure has a size [m]."""
    groups = assigned(claims, expected, size)
    right_laws = [
        bool(group) and law_is_right([claims[n] for n in group], effect)
        for group, effect in zip(groups, expected, strict=True)
    ]
    right = {n for group, law in zip(groups, right_laws, strict=True) if law for n in group}
    return Score(
        effects=len(expected),
        found=sum(map(bool, groups)),
        laws=sum(right_laws),
        names=tuple((sure(claim), n in right) for n, claim in enumerate(claims)),
    )


def sure(claim: Claim) -> float:
    """Probability of a claim; one without is sure."""
    return 1.0 if claim.get("probability") is None else float(claim["probability"])


def entries(claim: Claim) -> list[Claim]:
    """The claim itself, and what it says the data do not tell from it."""
    others = claim.get("equivalent") or []
    return [claim, *(other for other in others if (other.get("probability") or 0) >= LEAST)]


def assigned(
    claims: Sequence[Claim], expected: Sequence[Mapping[str, Any]], size: float
) -> list[list[int]]:
    """Claims of each true effect: as many as one to one finds, then what else is at its place."""
    table = [[finds(claim, effect, size) for claim in claims] for effect in expected]
    numbers = [[None, *(n for n, found in enumerate(row) if found)] for row in table]
    ways = [way for way in itertools.product(*numbers) if is_one_to_one(way)]
    best = max(ways, key=lambda way: sum(n is not None for n in way))
    groups = [[] if n is None else [n] for n in best]
    for n in sorted(set(range(len(claims))) - set(best)):
        for group, effect, row in zip(groups, expected, table, strict=True):
            if group and effect["place_m"] and row[n]:
                group.append(n)
                break
    return groups


def is_one_to_one(way: Iterable[int | None]) -> bool:
    chosen = [n for n in way if n is not None]
    return len(set(chosen)) == len(chosen)


def finds(claim: Claim, effect: Mapping[str, Any], size: float) -> bool:
    """Whether a claim is about the port of an effect, at its place; of a channel, the right one."""
    return any(
        (entry.get("acts_on") in effect["acts_on"] or entry.get("name") in effect["names"])
        and is_near(entry, effect["place_m"], size)
        and effect.get("on", "") in (entry.get("on") or "")
        for entry in entries(claim)
    )


def is_near(entry: Claim, places: Sequence[Sequence[float]], size: float) -> bool:
    """Whether the places of an entry are these, in either order."""
    found, intervals = entry.get("place_m") or [], entry.get("place_95_m") or []
    if len(found) != len(places):
        return not places
    order = range(len(places))
    ways = (order, order[::-1])
    known = intervals if len(intervals) == len(places) else [None] * len(places)
    return any(
        all(is_close(found[i], known[i], place, size) for i, place in zip(way, places, strict=True))
        for way in ways
    )


def is_close(found: Sequence[float], interval, place: Sequence[float], size: float) -> bool:
    if len(found) < len(place):
        return False
    place = [*place, *np.zeros(len(found) - len(place))]  # a plate lies in the plane z = 0
    if np.linalg.norm(np.subtract(found, place)) <= NEAR * size:
        return True
    return interval is not None and all(
        low <= x <= high and high - low <= WIDEST * size
        for (low, high), x in zip(interval, place, strict=True)
    )


def law_is_right(claims: Sequence[Claim], effect: Mapping[str, Any]) -> bool:
    every = [entry for claim in claims for entry in entries(claim)]
    is_named = any(entry.get("name") in effect["names"] for entry in every)
    if len(effect["acts_on"]) > 1:  # a body: its mass and its inertia, as one claim or as two
        told = {(claim.get("acts_on"), json.dumps(claim.get("law_tree"))) for claim in claims}
        parts = {(kind, '"m"') for kind in effect["acts_on"] if kind != "body"}
        return is_named or told >= parts
    if is_named and (len(claims) == 1 or not effect["laws"]):
        return True
    wanted = [canonical(law) for law in effect["laws"]]
    return any(canonical(tree) in wanted for tree in told_trees(claims))


def told_trees(claims: Sequence[Claim]) -> list[Tree]:
    """Laws of claims at one place, which are one in parallel."""
    trees = [
        [entry["law_tree"] for entry in entries(claim) if entry.get("law_tree")] for claim in claims
    ]
    if len(claims) > 1 and all(trees):
        return [["|", *(first for first, *_ in trees)]]
    return [tree for of in trees for tree in of]


def canonical(tree: Tree) -> Tree:
    """Groups of one kind in one, of one part none, sorted."""
    if isinstance(tree, str):
        return tree
    parts: list[Tree] = []
    for part in map(canonical, tree[1:]):
        parts += part[1:] if isinstance(part, list) and part[0] == tree[0] else [part]
    return parts[0] if len(parts) == 1 else [tree[0], *sorted(parts, key=json.dumps)]


def summary(scores: Mapping[str, Score]) -> list[str]:
    """Lines that say how often, each with an interval of 95 %."""
    every = list(scores.values())
    some = [one for one in every if one.effects]
    two = [one for one in every if one.effects > 1]
    none = [one for one in every if not one.effects]
    lines = [
        share("cases found", sum(one.found == one.effects for one in some), len(some)),
        share("with the right law", sum(one.laws == one.effects for one in some), len(some)),
        share("effects found", sum(one.found for one in every), sum(one.effects for one in every)),
        share("laws right", sum(one.laws for one in every), sum(one.effects for one in every)),
        share("both of two found", sum(one.found == one.effects for one in two), len(two)),
        share("both laws of two", sum(one.laws == one.effects for one in two), len(two)),
        share("cases with a wrong name of .9 or more", sum(map(is_wrong, every)), len(every)),
        share("alarms where nothing is missing", sum(one.is_alarm for one in none), len(none)),
    ]
    return lines + calibration(every)


def is_wrong(one: Score) -> bool:
    return one.wrong > 0


def calibration(scores: Iterable[Score]) -> list[str]:
    """How many names that are told with a probability are right."""
    told = [name for one in scores for name in one.names]
    lines = []
    for words, (low, high) in NAMED.items():
        right = [is_right for probability, is_right in told if low <= probability < high]
        lines.append(share(f"names told with {words} that are right", sum(right), len(right)))
    return lines


def share(words: str, count: int, of: int) -> str:
    if not of:
        return f"{words}: none asked"
    interval = binomtest(count, of).proportion_ci(0.95, method="exact")
    return f"{words}: {count}/{of} = {count / of:.0%} ({interval.low:.0%} to {interval.high:.0%})"
