"""What doo3d weighs on disk, by package: a Markdown table of everything that `pip install doo3d` brings, largest first.

Run it in an environment with doo3d installed; it looks at what is installed there, by the requirements of each package:

    python docs/installation_size.py
"""

from __future__ import annotations

import re
from importlib import metadata
from importlib.metadata import Distribution

SMALL_MB = 5.0
"""Packages below this are summed up in the last row."""


def name_of(requirement: str) -> str:
    """Return the normalized name of the package that a requirement asks for."""
    return re.sub(r"[-_.]+", "-", re.split(r"[\s;<>=!~\[(]", requirement)[0]).lower()


def needed() -> dict[str, Distribution]:
    """Return name -> package for doo3d and everything that it needs, without extras."""
    found: dict[str, Distribution] = {}
    waiting = ["doo3d"]
    while waiting:
        name = waiting.pop()
        try:
            package = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            continue  # for another platform or another version of Python
        if name not in found:
            found[name] = package
            waiting += [name_of(each) for each in package.requires or [] if "extra ==" not in each]
    return found


def megabytes(package: Distribution) -> float:
    """Return the size of the files that a package installed, MB."""
    places = (package.locate_file(file) for file in package.files or [])
    return sum(place.stat().st_size for place in places if place.is_file()) / 1e6


def table() -> str:
    """Return the table as Markdown."""
    packages = needed()
    sizes = sorted(((megabytes(package), name) for name, package in packages.items()), reverse=True)
    rows = [f"| `{name}` | {size:.0f} |" for size, name in sizes if size >= SMALL_MB]
    small = [size for size, _ in sizes if size < SMALL_MB]
    rows.append(f"| {len(small)} others | {sum(small):.0f} |")
    rows.append(f"| **all** | **{sum(size for size, _ in sizes):.0f}** |")
    return "\n".join(["| package | MB |", "|---|---|", *rows])


if __name__ == "__main__":
    print(table())
