"""The wheel installs without a compiler in an environment of its own, where the README's first two commands run."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import time

import pytest
from builders.paths import ROOT

import doo3d

MOST = 60
"""s for the installation of the wheel and of all that it needs; half of it is copying 1 GB."""

PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
WORKFLOWS = ROOT / ".github" / "workflows"


@pytest.mark.slow
def test_the_wheel_installs_without_a_compiler_and_runs_the_first_commands(tmp_path):
    reachable = [*PIP, "download", "--retries=0", "--timeout=10", "--no-deps", f"--dest={tmp_path}", "scikit-build-core"]
    if subprocess.run(reachable, capture_output=True).returncode:
        pytest.skip("no package index can be reached")
    subprocess.run([*PIP, "wheel", "--no-deps", f"--wheel-dir={tmp_path}", str(ROOT)], check=True, capture_output=True)
    subprocess.run([sys.executable, "-m", "venv", str(tmp_path / "venv")], check=True)
    programs = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    bare = kept | {"PATH": str(programs), "CC": "/bin/false", "CXX": "/bin/false"}
    (wheel,) = tmp_path.glob("doo3d-*.whl")
    start = time.monotonic()
    install = [str(programs / "python"), "-m", "pip", "install", "--only-binary=:all:", str(wheel)]
    subprocess.run(install, check=True, env=bare, capture_output=True)
    assert time.monotonic() - start < MOST
    (tmp_path / "sample_clouds").symlink_to(ROOT / "sample_clouds")
    commands = re.findall(r"\b(doo3d \w[^#&\n]+)", (ROOT / "README.md").read_text(encoding="utf-8").split("```sh", 1)[1])[:2]
    for command in commands:
        program, *words = shlex.split(command)
        subprocess.run([str(programs / program), *words], check=True, cwd=tmp_path, env=bare, capture_output=True)
    assert [command.split()[1] for command in commands] == ["detect", "report"]
    assert {"000000.json", "000000.jpg"} <= {path.name for path in (tmp_path / "out").iterdir()}
    assert list(tmp_path.glob("out*.html"))


def test_the_version_has_one_place():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'dynamic = ["version"]' in project
    assert f'version: "{doo3d.__version__}"' in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## {doo3d.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_actions_are_pinned_by_the_hash_of_a_commit():
    for workflow in WORKFLOWS.glob("*.yml"):
        for action in re.findall(r"uses: (\S+)", workflow.read_text(encoding="utf-8")):
            assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", action), f"{workflow.name}: {action}"
