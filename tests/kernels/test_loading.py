"""The package of a checkout loads the kernels of the installed distribution, if they were built of the same sources."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import pytest
from builders.paths import ROOT

from doo3d import kernels

NEEDED = ("__init__.py", "errors.py", "plugins.py", "kernels/__init__.py", "kernels/_loading.py")
CALL = "from doo3d import kernels; kernels.visits(); print(kernels._native.__name__, kernels._native.__file__)"


def copy_sources(folder: Path) -> Path:
    """Copy what importing the kernels needs, without a built module, as a checkout has it."""
    for name in NEEDED:
        (folder / "doo3d" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "doo3d" / name, folder / "doo3d" / name)
    (folder / "pyproject.toml").touch()
    return folder


def install_by_hand(site: Path) -> Path:
    """Write what an installation has of the kernels, and return the built module."""
    info, folder = site / "doo3d-0.1.dist-info", site / "doo3d" / "kernels"
    info.mkdir(parents=True)
    folder.mkdir(parents=True, exist_ok=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: doo3d\nVersion: 0.1\n")
    return Path(shutil.copy(kernels._native.__file__, folder))


def load(checkout: Path, site: Path) -> tuple[str, str]:
    """Import the kernels in a checkout, where nothing but `site` is installed, and return what was printed."""
    # -S: without the packages of this environment; the folder one works in comes first, whatever the environment says
    surroundings = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"} | {"PYTHONPATH": str(site)}
    done = subprocess.run([sys.executable, "-S", "-c", CALL], cwd=checkout, env=surroundings, capture_output=True, text=True)
    return done.stdout.strip(), done.stderr.strip()


def test_the_built_module_of_the_installation_is_loaded(tmp_path):
    checkout = copy_sources(tmp_path / "checkout")
    shutil.copytree(ROOT / "doo3d/kernels/src", checkout / "doo3d/kernels/src")
    built = install_by_hand(tmp_path / "site")
    assert load(checkout, tmp_path / "site") == (f"doo3d.kernels._native {built}", "")


def test_a_module_beside_the_sources_comes_first(tmp_path):
    checkout = copy_sources(tmp_path / "checkout")
    install_by_hand(tmp_path / "site")
    built = shutil.copy(kernels._native.__file__, checkout / "doo3d" / "kernels")
    assert load(checkout, tmp_path / "site") == (f"doo3d.kernels._native {built}", "")


@pytest.mark.parametrize(
    ("place", "told"), [(None, "are not installed"), ("site", "other sources"), ("checkout", "other sources")]
)
def test_what_to_do_is_said_in_one_sentence(tmp_path, place, told):
    checkout = copy_sources(tmp_path / "checkout")
    (checkout / "doo3d/kernels/src").mkdir()
    (checkout / "doo3d/kernels/src/thinning.cpp").write_text("// changed")
    if place is not None:
        install_by_hand(tmp_path / place)
    printed, error = load(checkout, tmp_path / "site")
    assert printed == ""
    last = error.splitlines()[-1]
    assert last.startswith("doo3d.errors.MissingDependency: the native kernels of doo3d ")
    assert told in last
    assert last.endswith(f"run pip install . in {checkout}")


def test_a_module_that_cannot_be_loaded_is_told(tmp_path):
    checkout = copy_sources(tmp_path / "checkout")
    (checkout / "doo3d" / "kernels" / Path(kernels._native.__file__).name).write_bytes(b"torn")
    assert "doo3d cannot be loaded (" in load(checkout, tmp_path)[1].splitlines()[-1]


def is_editable(package: str) -> bool:
    origin = json.loads(metadata.distribution(package).read_text("direct_url.json") or "{}")
    return bool(origin.get("dir_info", {}).get("editable"))


@pytest.fixture(scope="module")
def python(tmp_path_factory) -> str:
    """The Python of an environment with `pip install .` of the checkout: this one, or a new one if this one's is editable.

    The other packages of the new environment are those of this one.
    """
    if not is_editable("doo3d"):
        return sys.executable
    if not (find_spec("scikit_build_core") and find_spec("nanobind")):
        pytest.skip("an editable installation without the packages that build another")
    place = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    (program,) = place.glob("*/python.exe" if os.name == "nt" else "*/python")
    code = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = subprocess.run([program, "-c", code], check=True, capture_output=True, text=True).stdout.strip()
    # as lines of paths, which do not run the .pth files of these folders, such as that of the editable installation
    (Path(site) / "others.pth").write_text("\n".join(path for path in sys.path if path.endswith("-packages")))
    pip = [sys.executable, "-m", "pip", "--python", program, "install", "--quiet", "--no-deps", "--no-index"]
    pip += ["--no-build-isolation", "--ignore-installed"]
    quick = "cmake.define.CMAKE_CXX_FLAGS_RELEASE=-O0"  # a third of the time, and the same results
    done = subprocess.run([*pip, "-C", quick, ROOT], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return str(program)


def run_in_checkout(*command: object) -> str:
    surroundings = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    command = tuple(map(str, command))
    done = subprocess.run(command, cwd=ROOT, env=surroundings, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    return done.stdout


NOTEBOOK = """
import sys, nbclient, nbformat
cells = [nbformat.v4.new_code_cell(text) for text in sys.argv[1:]]
notebook = nbclient.NotebookClient(nbformat.v4.new_notebook(cells=cells), kernel_name="python3", timeout=300).execute()
for cell in notebook.cells:
    for output in cell.outputs:
        print(output.get("text") or output["data"].get("text/html"))
"""


def blocks() -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.slow
def test_the_checkout_uses_the_installation(python, tmp_path):
    """README's Python runs where a reader types it: as a program, as `python -m`, in a notebook and in IPython."""
    where = "import doo3d.kernels; print(doo3d.__file__, doo3d.kernels._native.__file__)"
    package, native = run_in_checkout(python, "-c", where).split()
    assert Path(package).parents[1] == ROOT
    assert not Path(native).is_relative_to(ROOT / "doo3d")

    told = re.compile(r"1\.\d\d m, radius 4\.\d mm, 0% occluded")
    assert told.search(run_in_checkout(python, "-c", "\n".join(blocks())))
    assert told.search(run_in_checkout(python, "-m", "IPython", "--colors=nocolor", "-c", "\n".join(blocks())))
    shown = run_in_checkout(python, "-W", "ignore", "-c", NOTEBOOK, *blocks(), where, "detection")
    assert told.search(shown)
    assert f"{package} {native}" in shown
    assert '<div class="doo3d">' in shown

    printed = run_in_checkout(python, "-m", "doo3d", "detect", "sample_clouds/crossing", "-o", tmp_path / "out", "--workers", 1)
    assert printed.splitlines()[-1].startswith("3 frames, 3 chains")
