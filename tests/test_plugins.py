"""Plug-ins: broken ones are told, and the whole package of the documentation is installed and used from the shell."""

from __future__ import annotations

import os
import re
import struct
import subprocess
import sys
from importlib import metadata

import numpy as np
import pytest
from builders.drawn_masks import frame_of, wave
from builders.errors import code_in, refuses
from builders.paths import ROOT

from doo3d.errors import ConfigError
from doo3d.exports import FORMATS
from doo3d.geometry.polyline import arc_length
from doo3d.plugins import Registry

TAKES_ALL = "class entry:\n    def can_read(path): return True\n"
EXPORT = """
from doo3d.exports import Export
class entry(Export):
    summary = "lengths"
    suffixes = (".txt",)
"""
DOO3D = [sys.executable, "-m", "doo3d"]


def run(command, folder, site):
    path = os.pathsep.join(filter(None, [str(site), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(command, cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def install_by_hand(site, name, group, code):
    """Write a package as pip would leave it, with one entry point."""
    module = name.replace("-", "_")
    info = site / f"{module}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n{name} = {module}:entry\n")
    (site / f"{module}.py").write_text(code)


def write_lab(path, table=0.53):
    """Write a cable on a table as a file of the lab's camera."""
    frame, _ = frame_of(wave(), table=table)
    height, width = frame.depth.shape
    pixels = np.rint(1000 * frame.depth).astype("<u2").tobytes()
    path.write_bytes(struct.pack("<4sIIf", b"LAB1", width, height, frame.camera.fx) + pixels)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("group", "code", "told"),
    [
        ("doo3d.readers", TAKES_ALL + "    def __init__(self, path, options): self.path = 1 / 0\n", "failed (ZeroDivisionError"),
        ("doo3d.readers", TAKES_ALL + "    def __init__(self, path, options): pass\n", "without path and format and frames"),
        ("doo3d.segmenters", "entry = lambda data, config, seed: 1 / 0", "failed (ZeroDivisionError"),
        ("doo3d.segmenters", "entry = lambda data, config, seed: data.depth[:2] > 0", "mask has shape (2, "),
        ("doo3d.segmenters", "entry = 3", "is not callable"),
        ("doo3d.exports", "", "cannot be imported (AttributeError"),
        ("doo3d.exports", "entry = 3", "is no class derived from doo3d.exports.Export"),
        ("doo3d.exports", "class entry:\n    suffixes = ('.txt',)\n", "is no class derived from doo3d.exports.Export"),
        ("doo3d.exports", EXPORT + "    supports_2d = None\n", "has no supports_2d of type bool"),
        ("doo3d.exports", EXPORT + "    file_per = 'run'\n", "none of capture, frame, chain"),
    ],
)
def test_a_broken_plug_in_that_is_asked_for_is_named(tmp_path, group, code, told):
    site = tmp_path / "site"
    install_by_hand(site, "mine", group, code)
    if group == "doo3d.exports":
        exit_code, _, err = run([*DOO3D, "export", "out", "--to", "mine"], tmp_path, site)
    else:
        method = ["--set", "segment.method=mine"] if group == "doo3d.segmenters" else []
        exit_code, _, err = run([*DOO3D, "explain", ROOT / "sample_clouds" / "straight", *method], tmp_path, site)
    assert exit_code == 2
    assert told in err
    assert "Traceback" not in err
    assert code_in(err) in ("plugin-broken", "mask-shape")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("group", "code", "told"),
    [
        ("doo3d.readers", "raise ImportError('no module named lab')", "cannot be imported (ImportError: no module named lab)"),
        ("doo3d.readers", "class entry:\n    def can_read(path): return 1 / 0\n", "failed (ZeroDivisionError"),
        ("doo3d.readers", "entry = None", "is no class with can_read"),
        ("doo3d.exports", "raise SyntaxError", "cannot be imported (SyntaxError"),
        ("doo3d.exports", "entry = len", "is no class derived from"),
    ],
)
def test_a_broken_plug_in_among_others_is_left_out_with_a_note(tmp_path, group, code, told):
    install_by_hand(tmp_path / "site", "mine", group, code)
    exit_code, out, err = run([*DOO3D, "detect", ROOT / "sample_clouds" / "straight", "-o", "out"], tmp_path, tmp_path / "site")
    assert (exit_code, out.splitlines()[-1]) == (0, "1 frame, 1 chain -> out")
    commands = [err]
    if group == "doo3d.exports":
        assert err == ""
        for command in (["--list"], ["out", "--to", "npz"], ["out", "--to", "mjcf"]):
            exit_code, out, err = run([*DOO3D, "export", *command], tmp_path, tmp_path / "site")
            assert exit_code == 0
            assert out
            commands.append(err)
        commands = [commands[1], commands[3]]  # of those that look at all formats
    for err in commands:
        (line,) = err.splitlines()
        assert line.startswith(f"doo3d: note: plug-in mine ({group}) of the package mine ")
        assert told in line
        assert line.endswith("it is left out")


@pytest.mark.slow
def test_a_method_that_no_plug_in_has_is_refused_with_the_names_of_those_there_are(tmp_path):
    install_by_hand(tmp_path / "site", "mine", "doo3d.segmenters", "")
    exit_code, _, err = run([*DOO3D, "explain", "x", "--set", "segment.method=main"], tmp_path, tmp_path / "site")
    assert exit_code == 2
    assert "mine" in err
    assert "ridge" in err


@pytest.mark.slow
def test_the_plug_in_of_the_documentation_is_installed_and_found(tmp_path):
    if int(metadata.version("setuptools").split(".")[0]) < 71:
        pytest.skip("the plug-in is built by setuptools 71 or later, of the extra test")
    text = (ROOT / "docs" / "pages" / "extending.md").read_text(encoding="utf-8")
    text = text[text.index("\n## A plug-in") :]
    package, site = tmp_path / "doo3d-lab", tmp_path / "site"
    package.mkdir()
    for language, name in (("toml", "pyproject.toml"), ("python", "doo3d_lab.py")):
        (content,) = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        (package / name).write_text(content, encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    assert run([*pip, "--target", site, package], tmp_path, site)[::2] == (0, "")

    write_lab(tmp_path / "scan.lab")
    commands = re.findall(r"^doo3d (.*)$", text, re.MULTILINE)
    assert len(commands) == 2
    for command in commands:
        exit_code, _, err = run(["bash", "-c", f"{sys.executable} -m doo3d {command}"], tmp_path, site)
        assert exit_code == 0, err
    name, length = (tmp_path / "found.txt").read_text().split()
    assert name == "scan"
    assert int(length) == pytest.approx(1000 * arc_length(wave())[-1], abs=12)
    assert "lab-lengths" in run([*DOO3D, "export", "--list"], tmp_path, site)[1]

    (tmp_path / "scan.lab").write_bytes(b"LAB1")
    assert code_in(run([*DOO3D, "explain", "scan.lab"], tmp_path, site)[2]) == "file-damaged"


def test_a_registry_is_a_dictionary_of_loaded_entries():
    registry = Registry("doo3d.none", {"steps": "polyline:steps", "two": 2}, "doo3d.geometry")
    assert list(registry) == ["steps", "two"]
    assert registry["steps"](np.zeros((3, 3))).shape == (2,)
    registry["three"] = len
    assert "three" in registry
    assert len(registry) == 3
    assert registry.is_built_in("two")
    assert not registry.is_built_in("three")
    with pytest.raises(KeyError):
        registry["four"]


def test_what_is_no_entry_is_refused_when_it_is_added():
    with refuses("plugin-broken", "is no class derived from", kind=ConfigError):
        FORMATS["mine"] = 3
    assert "mine" not in FORMATS
