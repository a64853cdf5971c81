"""Cases whose hidden effect may be anything: written, asked and scored one by one.

`python -m tests.benchmarks.unlisted_cases OUT --seeds 0:60 --jobs 4` writes the cases of the seeds
into OUT/cases and OUT/truth, runs `improve` on each that has no ledger in OUT/results yet, and
prints one line a case and the sums. `--none exact:40` and `--none imperfect:40` ask structures with
nothing missing. Without any of these, the cases that OUT holds are asked. What is stored is decided
again by `decided_again`.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

import bayes_placement as bp
from tests.benchmarks.unlisted_scores import Claim, Score, score, summary
from tests.simulator import case_folders
from tests.simulator.unlisted_draws import UnlistedDraw, draw, nothing

ROOT = Path(__file__).parents[2]

LIMIT = 1800
"""Seconds that a case may take."""

DRAWS: dict[str, Callable[[int], UnlistedDraw]] = {
    "unlisted": draw,
    "exact": partial(nothing, imperfect=False),
    "imperfect": partial(nothing, imperfect=True),
}

OPTIONS = {"i": ("--model-error",)}
"""Options of `improve` by the first letter of a case: an engineer knows what is imperfect."""

ALONE = {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    **dict.fromkeys(("PJRT_NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
}
"""Environment of a case that has one thread; LOKY_MAX_CPU_COUNT is the number of its processes."""


def written(out: Path, kind: str, seed: int) -> str | None:
    """Name of the case of a seed, which is drawn unless it is there; None where none can be."""
    begins = f"{kind[0]}{seed:03d}_"
    for folder in (out / "cases").glob(f"{begins}*"):
        if (out / "truth" / f"{folder.name}.json").exists():
            return folder.name
    try:
        drawn = DRAWS[kind](seed)
    except ValueError as error:
        print(error, flush=True)
        return None
    name = begins + drawn.form
    case_folders.write(drawn, name, out / "cases", out / "truth")
    print(f"{name} written, chi2 {drawn.chi2:.3g}", flush=True)
    return name


def truths(out: Path) -> dict[str, Any]:
    """The truth of each case by its name."""
    paths = sorted((out / "truth").glob("*_*.json"))
    return {path.stem: json.loads(path.read_text()) for path in paths}


def write_expected(out: Path) -> None:
    """Write what right answers say, in one file as for the cases of others."""
    wanted = {name: truth["expected"] for name, truth in truths(out).items()}
    case_folders.dump(wanted, out / "truth" / "expected.json")


def asked(out: Path, name: str, limit: float, processes: int) -> str:
    """Run `improve` on a case unless its ledger is there, and say in words how that went."""
    results = out / "results" / name
    if (results / "ledger.json").exists():
        return "asked before"
    command = [sys.executable, "-m", "bayes_placement", "improve", str(out / "cases" / name)]
    command += ["--out", str(results), "--quiet", *OPTIONS.get(name[0], ())]
    environment = os.environ | ALONE | {"LOKY_MAX_CPU_COUNT": str(processes)}
    began = time.perf_counter()
    try:
        run = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=limit
        )
        last = " ".join((run.stderr or run.stdout).strip().splitlines()[-1:])
    except subprocess.TimeoutExpired:
        last = "out of time"
    return f"{time.perf_counter() - began:.0f} s; {last}"


def scored(out: Path, name: str, truth: Mapping[str, Any]) -> Score | None:
    """Score a case; None where it has no ledger yet."""
    path = out / "results" / name / "ledger.json"
    if not path.exists():
        return None
    ledger = json.loads(path.read_text())
    return score(ledger["effects"], truth["expected"], truth["size_m"])


def line(name: str, out: Path, truth: Mapping[str, Any], words: str) -> str:
    """What was hidden in a case, what was told, and how that scores."""
    one = scored(out, name, truth)
    hidden = [f"{effect['kind']} {json.dumps(effect['law'])}" for effect in truth["hidden"]]
    told = "no answer"
    if one is not None:
        ledger = json.loads((out / "results" / name / "ledger.json").read_text())
        names = [f"{each['kind']} ({each['probability']:.3g})" for each in ledger["effects"]]
        told = f"{names}, found {one.found}/{one.effects}, laws {one.laws}, wrong {one.wrong}"
    return f"{name}: chi2 {truth['chi2_nominal_fit']:.3g}, hidden {hidden}, told {told}; {words}"


def ask(out: Path, names: Sequence[str], limit: float, jobs: int) -> None:
    """Ask all cases, so many at once, and print a line as soon as one is done."""
    known = truths(out)
    processes = max(1, (os.cpu_count() or 1) // jobs)
    with ThreadPoolExecutor(jobs) as pool:
        runs = {pool.submit(asked, out, name, limit, processes): name for name in names}
        for run in as_completed(runs):
            name = runs[run]
            print(line(name, out, known[name], run.result()), flush=True)


def scores_of(out: Path, names: Sequence[str]) -> dict[str, Score]:
    known = truths(out)
    every = {name: scored(out, name, known[name]) for name in names}
    return {name: one for name, one in every.items() if one is not None}


def decided_again(out: Path, policy: bp.Policy) -> dict[str, Score]:
    """Score what another policy would claim of every stored search; nothing is fitted.

    What it claims besides is known by its kind alone, so that it finds nothing.
    """
    scores = {}
    for name, truth in truths(out).items():
        path = out / "results" / name / "ledger.json"
        if path.exists():
            claims = claims_of(json.loads(path.read_text()), policy)
            scores[name] = score(claims, truth["expected"], truth["size_m"])
    return scores


def claims_of(ledger: Mapping[str, Any], policy: bp.Policy) -> list[Claim]:
    """What a policy claims, with the places and laws that the ledger tells of these kinds.

    A claim is as probable as its kind, but not more than the least of all doubts allows.
    """
    decision = bp.decide(ledger["table"], policy)
    doubts = [doubt.probability for of in decision.doubts.values() for doubt in of]
    told = [*ledger["effects"], *(e for claim in ledger["effects"] for e in claim["equivalent"])]
    claims = []
    for kind in decision.kinds:
        entry = next((each for each in told if each["kind"] == kind), None)
        # One of several of a kind is told once; what is claimed first has come first.
        told = [each for each in told if each is not entry]
        probability = min([decision.probabilities.get(kind, 0.0), *doubts])
        claims.append({"kind": kind, **(entry or {}), "probability": probability})
    return claims


def arguments(words: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="unlisted_cases", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seeds", default="", help="first and one more than the last: 0:60")
    parser.add_argument("--none", action="append", default=[], help="exact:40 or imperfect:40")
    parser.add_argument("--write-only", action="store_true")
    parser.add_argument("--score-only", action="store_true")
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds a case")
    parser.add_argument("--jobs", type=int, default=1)
    return parser.parse_args(words)


def wanted(asked_for: argparse.Namespace) -> list[tuple[str, int]]:
    """Kind and seed of each case that is asked for."""
    first, _, last = asked_for.seeds.partition(":")
    every = [("unlisted", seed) for seed in range(int(first or 0), int(last or 0))]
    for words in asked_for.none:
        kind, _, count = words.partition(":")
        every += [(kind, seed) for seed in range(int(count))]
    return every


def main(words: Sequence[str] | None = None) -> None:
    asked_for = arguments(words)
    out, every = asked_for.out.resolve(), wanted(asked_for)
    names = [written(out, kind, seed) for kind, seed in every] if every else list(truths(out))
    names = [name for name in names if name is not None]
    write_expected(out)
    if asked_for.write_only:
        return
    if not asked_for.score_only:
        ask(out, names, asked_for.limit, asked_for.jobs)
    print("\n".join(summary(scores_of(out, names))))


if __name__ == "__main__":
    main()
