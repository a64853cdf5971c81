"""Arguments and options of the commands."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ..inference import engines, marginals
from ..inference.names import names

if TYPE_CHECKING:
    EngineName = str
    FitEngineName = str
    MarginalName = str
else:  # names of the registries are only known when this runs
    EngineName = Literal[("all", *names(engines))]
    FitEngineName = Literal[tuple(names(engines))]
    MarginalName = Literal[tuple(names(marginals))]


EstimatorName = Literal["kernel-gain", "exact", "expected-gain", "separation"]
SideName = Literal["sensors", "actuators"]
SearchName = Literal["exhaustive", "sequential", "forward", "evolutionary"]


Study = Annotated[
    Path,
    typer.Argument(
        metavar="MODEL", help="Python file that defines `experiment`, or folder with case.json."
    ),
]
Data = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Measured FRFs: universal file, .mat, .npz, HDF5, CSV, .xlsx, or a mapping (TOML) "
        "that names such a file; or modal parameters, a universal file or CSV. Default: the "
        "model's `measurement`.",
    ),
]
Engine = Annotated[
    EngineName | None,
    typer.Option(
        help="One engine, or all of those that check each other. Default: the model's, or smc."
    ),
]
Marginal = Annotated[
    MarginalName | None,
    typer.Option(help="How placement is treated, with one engine. Default: latent."),
]
FitEngine = Annotated[
    FitEngineName,
    typer.Option(
        "--engine", help="Engine of the posterior: the fast Laplace approximation, or a sampler."
    ),
]
Effects = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="Effects to try, separated by commas: point_mass,gain_error. `listed` means all usual "
        "ones. Default: these, and networks of springs, dashpots and masses.",
    ),
]
Estimator = Annotated[
    EstimatorName,
    typer.Option(
        help="How information is estimated: the paper's KDE, placement integrated exactly, the "
        "average over data to come, or which of the explanations of --data is right."
    ),
]
Search = Annotated[
    SearchName,
    typer.Option(help="All placements, one moved at a time, one added at a time, or CMA-ES."),
]
About = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="Parameters to learn about, separated by commas, all others at nominal values: "
        "structure.damping.ratio.1. Default: all.",
    ),
]
Sensors = Annotated[
    int | None,
    typer.Option(
        metavar="NUMBER", help="Sensors to place. Default: those that the model declares."
    ),
]
Places = Annotated[
    int,
    typer.Option(
        metavar="NUMBER",
        help="Positions to try for each sensor and actuator, evenly along a line, far apart in "
        "space.",
        min=1,
    ),
]
Lines = Annotated[
    int,
    typer.Option(
        metavar="NUMBER",
        help="Frequency lines to use, evenly over the band, where the model has more.",
        min=1,
    ),
]
MostLines = Annotated[
    int | None,
    typer.Option(
        "--lines",
        metavar="NUMBER",
        help="Most lines to take, dense where the FRFs change most. Default: all that the model "
        "declares, up to 50,000 values.",
        min=1,
    ),
]
ModelError = Annotated[
    bool,
    typer.Option(
        "--model-error",
        help="Declare that modes and channels differ from the model a little, by unknown sizes, "
        "as those of any real structure do.",
    ),
]
Baseline = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="FRFs of an earlier state of the structure, as for --data: effects are new since. "
        "Default: the model's `baseline`, or the files that a case names.",
    ),
]
States = Annotated[
    list[str] | None,
    typer.Option(
        "--state",
        metavar="LABEL=FILE",
        help="A label and the FRFs of one state of the structure, cut=cut.uff; once for each "
        "state, the first is the baseline. Default: the model's `states`, or those of a case.",
    ),
]
Alone = Annotated[bool, typer.Option("--alone", help="Leave out the earlier state.")]
Port = Annotated[
    int,
    typer.Option(
        metavar="NUMBER",
        help="Port of the page on this machine; 0 for a free one.",
        min=0,
        max=65535,
    ),
]
NoBrowser = Annotated[
    bool, typer.Option("--no-browser", help="Print the address of the page, and open no browser.")
]
EarlierData = Annotated[
    Path | None,
    typer.Option(
        "--data",
        metavar="FILE",
        help="What has been measured, a file as for `update`: the next measurement adds to it.",
    ),
]
Noise = Annotated[
    float | None,
    typer.Option(
        metavar="NUMBER",
        help="Standard deviation of log10 of the amplitude. Default: as the model declares, or as "
        "the coherence of the data tells.",
    ),
]
LeastDistance = Annotated[
    float | None,
    typer.Option(
        metavar="NUMBER",
        help="Least distance [m] between sensors, and between actuators. Default: 1 % of the "
        "structure.",
    ),
]
Forbidden = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FROM:TO", help="Region [m] in which nothing is placed, 0.4:0.45; may be repeated."
    ),
]
Cost = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=NUMBER",
        help="Information [nat] that a sensor or actuator must add to be used, s2=0.1; may be "
        "repeated.",
    ),
]
Workers = Annotated[
    int | None, typer.Option(metavar="NUMBER", help="Processes on this machine.", min=1)
]
Dask = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help='Dask scheduler, tcp://host:8786, or "local" with --workers processes.',
    ),
]


def out(source: str, command: str) -> object:
    """Return the annotation of `--out` of a command: where its results go by default."""
    words = f"Folder of the results. Default: a new one, results/{source}/{command}-1."
    return Annotated[Path | None, typer.Option(metavar="FOLDER", help=words)]


Quiet = Annotated[
    bool, typer.Option("--quiet", help="Show the verdict and the folder of the results only.")
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Answer with one object of JSON on standard output.")
]
WriteReport = Annotated[
    bool,
    typer.Option(
        "--report",
        help="Write report.html as well, with where to measure next: one file to hand on.",
    ),
]


def _seed(number: int) -> int:
    """Refuse a seed that JAX does not take; a range of 19 digits would fill `--help`."""
    if not 0 <= number < 2**63:
        raise typer.BadParameter(f"{number} is not between 0 and 2^63 - 1.")
    return number


Seed = Annotated[
    int, typer.Option(metavar="NUMBER", help="The same seed gives the same result.", callback=_seed)
]
NoCache = Annotated[
    bool,
    typer.Option(
        "--no-cache",
        help="Search anew, and keep no compiled functions, fits and answers for the next run in "
        "the user's cache directory.",
    ),
]
Traceback = Annotated[
    bool, typer.Option("--traceback", help="Show where in the program an error came up.")
]
ForeignFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="Measured FRFs: universal file, .mat, .npz, HDF5, CSV, .xlsx; or a folder with data, "
        "mapping and channel table.",
    ),
]
Mapping = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="TOML file that says what the data do not: axes, names, units, case."
    ),
]
Shown = Annotated[
    Path,
    typer.Argument(
        metavar="MODEL|FILE",
        help="Model file, folder with case.json, or file of measured FRFs or modes.",
    ),
]
ShownData = Annotated[
    Path | None,
    typer.Option(
        "--data",
        metavar="FILE",
        help="Measured FRFs that are drawn with the model as it is drawn, nothing fitted. Default: "
        "the model's `measurement`, drawn alone.",
    ),
]
MeasuredFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="Measured FRFs, in any of the formats of --data.")
]
ShapesAt = Annotated[
    SideName,
    typer.Option(
        help="Where shapes are told: at the sensors, or at the actuators, as where a hammer went "
        "from place to place."
    ),
]
NewFolder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Folder for the new files; it is made.")
]
AsCase = Annotated[
    bool,
    typer.Option(
        "--case",
        help="Write a mapping and a channel table, which `import` turns into a case folder, in "
        "the place of a model file.",
    ),
]
Channels = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Channel table, a workbook or CSV: name, role, x [mm], tolerance [mm], ...",
    ),
]
Save = Annotated[
    Path | None,
    typer.Option(
        metavar="PATH",
        help="Model file to which the completed model is written, or case folder where the model "
        "is one; its posterior goes to the results.",
    ),
]
EffectName = Annotated[str, typer.Argument(metavar="EFFECT", help="Name of the effect, see below.")]
Numbers = Annotated[
    list[str] | None,
    typer.Argument(metavar="--NAME VALUE", help="Numbers and places of the effect, in SI."),
]
NewModel = Annotated[
    Path, typer.Option("--save", metavar="FILE", help="The new model file, which is not there yet.")
]
Results = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER", help="Folder of the results of check, explain, improve, update or place."
    ),
]
AllResults = Annotated[
    Path | None,
    typer.Argument(
        metavar="FOLDER", help="Folder with the results of each model. Default: results."
    ),
]
Clean = Annotated[
    bool,
    typer.Option(
        "--clean",
        help="Delete the fits of all models, which a later run makes again. Results stay.",
    ),
]
To = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="The page. Results of another state or week are added to one that is there, under "
        "their --label. Default: report.html in the folder.",
    ),
]
Label = Annotated[
    str | None,
    typer.Option(
        metavar="WORD", help="Name of these results in the report. Default: that of the folder."
    ),
]
Title = Annotated[str | None, typer.Option(metavar="WORDS", help="Title of the page.")]
Author = Annotated[str | None, typer.Option(metavar="WORDS", help="Who wrote the report.")]
Client = Annotated[str | None, typer.Option(metavar="WORDS", help="For whom it is.")]
Photo = Annotated[
    Path | None, typer.Option(metavar="FILE", help="PNG or JPEG of the structure, at most 5 MB.")
]
Comments = Annotated[
    list[str] | None,
    typer.Option("--comment", metavar="WORDS", help="A paragraph of yours; once for each."),
]
