"""Simulate the cases of the gallery, search in each with all candidates, and store what is found.

python notebooks/docs/make_gallery.py [CASE ...]

writes a figure for each case, `results.json`, and the page `index.md`.
"""

import io
import json
import sys
import warnings
from pathlib import Path

from gallery_cases import CASES, GROUPS, experiment, measured
from matplotlib.figure import Figure
from small_png import small

import bayes_placement as bp
from bayes_placement._shared.labels import AS_DRAWN, AS_GIVEN
from bayes_placement.plots._colours import AFTER, DATA, INK
from bayes_placement.plots._fit_panels import colours_of, line_style, show_all_of

GALLERY = Path(__file__).parent / "gallery"
RESULTS = GALLERY / "results.json"
FITS = Path("build") / "fits"
"""Folder of the fits: figures of the same cases are drawn again in seconds."""

HEAD = """# Gallery of symptoms

What does a strange measurement mean? Each entry begins with what you see. It shows the effect that was
hidden in a simulated measurement, and what `bp.improve` says of it with all candidates of the library.

The structure is an aluminium cantilever, 0.8 m long, with three accelerometers and two hits of a hammer,
each up to 1 cm from where it was recorded. Young's modulus is known to 4 %, the damping ratio is between 0.3 and
3 %. The noise is 1 % of each value. Left: the response of one channel, as measured, of the model as drawn, of the
same once fitted (as given), and with what was found. Right: the error of the last two over the noise, which falls
to about 1. The cases are simulated with this package by `make_gallery.py`; studies with data from elsewhere are in
the [tutorials](../tutorials.md).

| you see | it was | reduced chi-square |
|---|---|---|
"""


def result_of(name, case):
    """Search, draw, and return what is found."""
    model = experiment(case.force_levels)
    true = model if case.effect is None else model + case.effect()
    measurement = measured(true, seed=[*CASES].index(name))
    ledger = bp.improve(model, measurement, store=FITS)
    fits = ledger.fits
    held = io.BytesIO()
    draw(fits, case.shown).savefig(held, dpi=90)
    (GALLERY / f"{name}.png").write_bytes(small(held.getvalue()))
    return {
        "sentence": ledger.sentence(),
        "verdict": list(ledger.verdict),
        # Further digits depend on the machine.
        "chi2_per_datum": [float(f"{step.chi2_per_datum:.7g}") for step in ledger.steps],
    }


def draw(fits, shown):
    """Response of one channel, and its error over the noise."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    response, error = figure.subplots(1, 2)
    channels = {name: channel_of(fit, *shown) for name, fit in fits.items()}
    first = channels[AS_GIVEN]
    response.plot(
        first["frequency"],
        20 * first["measured"],
        ".",
        color=DATA,
        ms=5,
        alpha=0.5,
        label="measured",
    )
    for name, color in colours_of(channels).items():
        label = "with what was found" if name.startswith("with") else name
        line, fit = channels[name]["frequency"].values, channels[name]
        response.plot(line, 20 * fit["predicted"], label=label, **line_style(color))
        if name != AS_DRAWN:
            marker = "." if color == AFTER else "x"
            error.plot(line, fit["error"] / fit["noise"], marker, color=color, ms=4)
    fitted = [fit["predicted"] for name, fit in channels.items() if name != AS_DRAWN]
    show_all_of(response, [20 * curve.values for curve in [*fitted, first["measured"]]])
    noise = error.axhline(1.0, color=INK, linestyle="--", linewidth=1)
    response.set_ylabel(f"accelerance {shown[0]} / {shown[1]}\n[dB re 1 (m/s²)/N]")
    error.set_ylabel("error over noise [1]")
    error.set_yscale("log")
    for panel in (response, error):
        panel.set_xscale("log")
        panel.set_xlabel("frequency [Hz]")
        panel.set_xticks([10, 30, 100, 300], ["10", "30", "100", "300"])
        panel.set_xticks([], minor=True)
    handles, labels = response.get_legend_handles_labels()
    figure.legend(
        [*handles, noise], [*labels, "noise"], loc="outside lower center", ncols=5, frameon=False
    )
    return figure


def channel_of(fit, sensor, actuator):
    """Response of a sensor to an actuator, at the highest force level."""
    row = [str(word).startswith(sensor) for word in fit["sensor"].values].index(True)
    column = [str(word).startswith(actuator) for word in fit["actuator"].values].index(True)
    channel = fit.isel(sensor=row, actuator=column)
    return channel.isel(force_level=-1) if "force_level" in channel.dims else channel


def page(results):
    """The page of the gallery, from the cases and what was found in them."""
    rows = [
        f"| [{case.symptom}](#{name.replace('_', '-')}) | `{was(name, results[name])}` "
        f"| {fall(results[name])} |"
        for name, case in CASES.items()
    ]
    parts = [HEAD + "\n".join(rows)]
    for group, cases in GROUPS.items():
        parts.append(f"## {group}")
        parts += [entry(name, case, results[name]) for name, case in cases.items()]
    return "\n\n".join(parts) + "\n"


def was(name, result):
    """Kind of what was hidden, which a table of Markdown can hold."""
    return (result["verdict"] or [name])[0].replace("|", "\\|")


def fall(result):
    """Chi2 before and after."""
    numbers = result["chi2_per_datum"]
    ends = dict.fromkeys((numbers[0], numbers[-1]))
    return " → ".join(f"{value:.2f}" if value < 10 else f"{value:,.0f}" for value in ends)


def entry(name, case, result):
    """One case."""
    effect = case.hidden or ("nothing" if case.effect is None else f"`bp.effects.{name}`")
    return (
        f"({name.replace('_', '-')})=\n### {case.symptom}\n\n{case.meaning}\n\n"
        f"Hidden: {effect}.\n\n> {result['sentence']}\n\n"
        f"![Response and error, before and after]({name}.png)"
    )


def main(names):
    """Make the cases of these names, all by default, and write the page."""
    warnings.simplefilter("ignore")
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in names or CASES:
        results[name] = result_of(name, CASES[name])
        sys.stderr.write(f"{name}: {results[name]['sentence']}\n")
        RESULTS.write_text(json.dumps(results, indent=1) + "\n")
    (GALLERY / "index.md").write_text(page(results))


if __name__ == "__main__":
    main(sys.argv[1:])
