"""Write reference.json from a clone of posteriordb.

Run with `git clone https://github.com/stan-dev/posteriordb` and then
`python tests/benchmarks/posteriordb/make_reference.py posteriordb`.
"""

import json
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
POSTERIORS = (
    "eight_schools-eight_schools_noncentered",
    "mesquite-mesquite",
    "mesquite-logmesquite",
    "mesquite-logmesquite_logva",
    "mesquite-logmesquite_logvas",
    "mesquite-logmesquite_logvash",
    "mesquite-logmesquite_logvolume",
    "arma-arma11",
    "gp_pois_regr-gp_regr",
    "gp_pois_regr-gp_pois_regr",
)
ALIKE = {"eight_schools-eight_schools_noncentered": "eight_schools-eight_schools_centered"}
"""Posteriors of the same quantities, of which the database holds one of the two statistics."""


def main(clone: Path) -> None:
    root = clone / "posterior_database"
    posteriors = {name: reference(root, name) for name in POSTERIORS}
    data = {
        name: data_of(root, name) for name in dict.fromkeys(n.split("-")[0] for n in POSTERIORS)
    }
    parts = {"data": data, "posteriors": posteriors}
    lines = [f'"{part}": {{\n{in_lines(values)}\n}}' for part, values in parts.items()]
    (HERE / "reference.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")


def in_lines(values: dict) -> str:
    """One line for each entry."""
    return ",\n".join(f'"{name}": {json.dumps(value)}' for name, value in values.items())


def data_of(root: Path, name: str) -> dict:
    file = root / "data" / "data" / f"{name}.json"
    if file.exists():
        return json.loads(file.read_text())
    with zipfile.ZipFile(file.with_suffix(".json.zip")) as archive:
        return json.loads(archive.read(f"{name}.json"))


def reference(root: Path, name: str) -> dict:
    """Names, means and mean squares of a posterior with their standard errors."""
    mean, square = (statistic(root, name, kind) for kind in ("mean_value", "mean_squared_value"))
    assert mean["names"] == square["names"]
    return {
        "names": mean["names"],
        "mean": numbers(mean, "mean_value"),
        "mean_error": numbers(mean, "mcse_mean"),
        "mean_square": numbers(square, "mean_squared_value"),
        "mean_square_error": numbers(square, "mcse_mean"),
    }


def statistic(root: Path, name: str, kind: str) -> dict:
    folder = root / "reference_posteriors" / "summary_statistics" / kind / kind
    file = folder / f"{name}.json"
    return json.loads((file if file.exists() else folder / f"{ALIKE[name]}.json").read_text())


def numbers(statistics: dict, key: str) -> list[float]:
    """Numbers of a field, of which some files hold words under a name that ends in a full stop."""
    return [float(value) for value in statistics.get(key) or statistics[f"{key}."]]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
