"""Imports go one way, and what is heavy loads only when it is used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from builders.paths import ROOT

ROOT = ROOT / "doo3d"
# each may import those before it; the names of one set stand side by side and do not import each other
ORDER = [
    {"errors"},
    {"plugins", "guard", "kernels"},
    {"types"},
    {"config"},
    {"geometry"},
    {"scene"},
    {"segment", "skeleton", "chains", "links", "judge"},
    {"pipeline"},
    {"fusion"},
    {"camera"},
    {"track"},
    {"outputs"},
    {"viz"},
    {"runs"},
    {"exports", "evaluation", "training"},
    {"tools"},
    {"commands"},
    {"cli"},
]
INPUTS = "inputs"  # stands beside the method: whoever reads frames may import it
INPUTS_MAY_IMPORT = {"errors", "guard", "plugins", "types", "config"}
HEAVY = ["numpy", "cv2", "open3d", "trimesh", "fcl", "rustworkx", "scipy", "pydantic", "rich.progress", "dask"]


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


def imported_by_name(path: Path) -> set[str]:
    """The modules of doo3d that a module imports through a function, `import_module("doo3d.viz.figure")`, without the doo3d."""
    calls = (node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call))
    texts = (str(argument.value) for call in calls for argument in call.args if isinstance(argument, ast.Constant))
    return {text.removeprefix("doo3d.") for text in texts if text.startswith("doo3d.")} & set(MODULES)


MODULES = modules()
EDGES = {name: imported(name, path) for name, path in MODULES.items() if name not in ("", "__main__")}


def part(name: str) -> str:
    return name.split(".")[0]


def rank(name: str) -> int:
    """The place of a module's package in ORDER."""
    return next(i for i, members in enumerate(ORDER) if part(name) in members)


def test_the_walk_sees_the_imports():
    assert "chains.fit" in EDGES["pipeline"]
    assert "config" in EDGES["runs.run"]
    assert "inputs.support.open3d" in EDGES["inputs.formats._cloud_files"]


def test_every_package_has_its_place():
    assert {part(name) for name in EDGES} == set.union(*ORDER) | {INPUTS}


@pytest.mark.parametrize("name", EDGES)
def test_imports_go_one_way(name):
    for other in EDGES[name]:
        if part(other) == part(name):
            continue
        if part(name) == INPUTS:
            assert part(other) in INPUTS_MAY_IMPORT, f"{name} imports {other}"
        elif part(other) == INPUTS:
            # the method knows no files; only a segmentation may read its reference image
            assert rank(name) > rank("pipeline") or name.startswith("segment.methods."), f"{name} imports {other}"
        else:
            assert rank(other) < rank(name), f"{name} imports {other}: upwards or sideways"


def test_nothing_is_imported_upwards_by_name():
    named = {(name, other) for name in EDGES for other in imported_by_name(MODULES[name])}
    assert not {(name, other) for name, other in named if rank(other) >= rank(name)}


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
    assert not loaded(code) & {"open3d", "trimesh", "fcl"}
