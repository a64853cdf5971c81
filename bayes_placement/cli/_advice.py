"""Advice of the package, which is in Python, in words of the command line."""

import re

ADVICE = {
    r"bp\.infer\(ledger\.experiment, measurement, engine=bp\.engines\.SMC\(\)\) samples it": (
        "improve --save new.py, then bayes-placement update new.py --engine smc, samples it"
    ),
    r"check\(infer\(\.\.\., engine=bp\.engines\.MAP\(starts=128\)\)\) begins at more": (
        "engine = bp.engines.MAP(starts=128) in the model file begins at more"
    ),
    r"widen that prior of model_error=bp\.model_error\.Embedded\(\)": (
        "widen that prior of model_error in the model file"
    ),
    r"baseline=before\b": "--baseline before.uff",
    r"(?<!\.)\b(MAP|Grid)\((\w+=\d+)\)": r"engine = bp.engines.\1(\2) in the model file",
    r"(?<!\.)\bengines\.SMC\(\)": "bayes-placement update --engine smc",
}
"""What is advised in Python, as a pattern, and what is advised on the command line."""


def in_commands(sentence: str) -> str:
    """Return a sentence with its advice in commands, or in a line of the model file."""
    for pattern, words in ADVICE.items():
        sentence = re.sub(pattern, words, sentence)
    return sentence
