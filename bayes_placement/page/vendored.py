"""Fetch what the page is drawn with, by version and hash: run by `python -m`, as a module."""

import hashlib
import subprocess
import tarfile
import tempfile
from pathlib import Path

from .._shared.errors import InputError

PACKAGE = "uplot@1.6.32"
SHA512 = (
    "2883159c6ebccefbb95d751b0b82d010f9e1c0ec41b8bc96d401eda66e882935"
    "c89a46cb824332fa369b8cb8122cc6ac36e186cd09bf7a9ded3a4c93c6989023"
)
"""Hash of the archive in hexadecimal."""

FILES = {
    "package/dist/uPlot.esm.js": "uplot.js",
    "package/dist/uPlot.min.css": "uplot.css",
    "package/LICENSE": "uplot.LICENSE",
}
"""Files of the archive, and their names here."""

FOLDER = Path(__file__).parent / "vendor"


def fetch(folder: Path = FOLDER) -> None:
    """Fetch the archive by npm, check its hash, and write the files."""
    with tempfile.TemporaryDirectory() as temporary:
        subprocess.run(["npm", "pack", "--silent", PACKAGE], cwd=temporary, check=True)
        (archive,) = Path(temporary).glob("*.tgz")
        found = hashlib.sha512(archive.read_bytes()).hexdigest()
        if found != SHA512:
            raise InputError(
                f"{PACKAGE} has the hash {found}; {SHA512} is needed, since the page may not "
                "change unseen: look at the new version, and write its hash here."
            )
        with tarfile.open(archive) as content:
            for inside, name in FILES.items():
                member = content.extractfile(inside)
                assert member is not None
                (folder / name).write_bytes(member.read())


if __name__ == "__main__":
    fetch()
