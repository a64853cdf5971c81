"""Draw the figures of README and of the first page, which show the ledger of models/hidden_effect.py.

python notebooks/docs/make_figures.py
"""

import io
from pathlib import Path

from small_png import small

import bayes_placement as bp

DOCS = Path(__file__).parent
MODEL = DOCS.parents[1] / "models" / "hidden_effect.py"
DPI = 80  # a page of text is 800 to 1000 pixels wide


def main():
    """Search with all candidates, and store both figures."""
    study = bp.io.model.read(MODEL)
    candidates = bp.effects.library(study.experiment)
    ledger = bp.improve(study.experiment, study.measurement, candidates=candidates)
    figures = {
        "reach": bp.plots.reach.curves(ledger.reach, experiment=study.experiment),
        "error_falls": bp.plots.ledger.error_falls(ledger),
    }
    for name, figure in figures.items():
        png = io.BytesIO()
        figure.savefig(png, dpi=DPI)
        (DOCS / "figures" / f"{name}.png").write_bytes(small(png.getvalue()))


if __name__ == "__main__":
    main()
