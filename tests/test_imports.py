"""Imports go one way, and what is heavy loads only when it is used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from builders.paths import ROOT

ROOT = ROOT / "doo3d"
# each layer may import those before it, and what stands beside it where that is said
LAYERS = [
    {"errors"},
    {"threads"},
    {"types"},
    {"config"},
    {"kernels"},
    {"geometry"},
    {
        *("arcs", "axis", "cells", "costs", "crossings", "visibility", "holes", "linking", "meetings", "overlaps"),
        *("segmenters", "segments", "views", "silhouette", "stations", "stubs", "sureness", "surface", "tracks"),
    },
    {"stages"},
    {"pipeline"},
    {"explain", "tuning"},
    {"batch", "fusion", "runs"},
    {"products", "viewer"},
    {"commands"},
    {"cli"},
]
BESIDE = {"exports", "inputs", "outputs", "viz"}  # of the layers, these may import no stage and nothing above
ANYTHING_BUT_CLI = {"evaluation", "bench", "compare"}
HEAVY = ["numpy", "cv2", "open3d", "numba", "trimesh", "fcl", "scipy", "pydantic", "rich.progress", "dask"]


def modules() -> dict[str, Path]:
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name: str, path: Path) -> set[str]:
    """The modules of doo3d that a module imports anywhere, dotted, without the leading doo3d."""
    package = name.split(".") if path.name == "__init__.py" and name else name.split(".")[:-1]
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.removeprefix("doo3d.") for alias in node.names if alias.name.startswith("doo3d.")}
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
            elif node.module and node.module.split(".")[0] == "doo3d":
                base = node.module.split(".")[1:]
            else:
                continue
            for alias in node.names:
                deeper = ".".join([*base, alias.name])
                names.add(deeper if deeper in MODULES else ".".join(base))
    return {item for item in names if item}


MODULES = modules()
EDGES = {name: imported(name, path) for name, path in MODULES.items() if name not in ("", "__main__")}


def part(name: str) -> str:
    return name.split(".")[0]


def layer(name: str) -> int | None:
    return next((i for i, members in enumerate(LAYERS) if part(name) in members), None)


def test_the_walk_sees_the_imports():
    assert "stages.segment" in EDGES["pipeline"]
    assert "config" in EDGES["batch"]
    assert "inputs._open3d" in EDGES["inputs._cloud_files"]


def test_every_module_has_its_place():
    known = set.union(*LAYERS) | BESIDE | ANYTHING_BUT_CLI
    assert {part(name) for name in EDGES} <= known


@pytest.mark.parametrize("name", EDGES)
def test_imports_go_one_way(name):
    own = layer(name)
    for other in EDGES[name]:
        assert part(other) != "cli", f"{name} imports {other}: nobody imports cli"
        if part(other) == part(name):
            continue
        their = layer(other)
        if part(name) in BESIDE:
            assert their is None or their < layer("stages"), f"{name} imports {other}"
        elif own is not None and their is not None:
            assert their <= own, f"{name} imports {other}: upwards"
            same = LAYERS[own]
            assert their < own or len(same) > 1, f"{name} imports {other}"
        elif own is not None and own < layer("batch"):
            # the method knows no files and no pictures; only a segmentation may read its reference image
            assert (part(name), part(other)) == ("segmenters", "inputs"), f"{name} imports {other}"


def test_stages_never_import_each_other():
    for name, others in EDGES.items():
        if part(name) == "stages":
            assert not [other for other in others if part(other) == "stages"], name


def test_no_circles_among_the_modules():
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> None:
        assert name not in above, " > ".join([*above, name])
        if name not in done:
            for other in EDGES.get(name, ()):
                visit(other, (*above, name))
            done.add(name)

    for name in EDGES:
        visit(name, ())


def loaded(code: str) -> set[str]:
    script = f"{code}\nimport sys\nprint('\\n'.join(sys.modules))"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


HELP = """
import sys
from doo3d.cli import app
sys.argv = ["doo3d", "--help"]
try:
    app()
except SystemExit:
    pass
"""


@pytest.mark.parametrize("code", ["import doo3d", "import doo3d.cli", HELP])
def test_heavy_packages_do_not_load_for_the_help(code):
    assert not loaded(code) & set(HEAVY)


def test_opening_a_folder_does_not_load_open3d(capture):
    folder = capture()
    code = f"from doo3d.inputs import open_capture; open_capture({str(folder)!r}).frames[0].load()"
    assert not loaded(code) & {"open3d", "numba", "trimesh", "fcl"}
