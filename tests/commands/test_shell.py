"""Completion in the shell, products named after their run, and the viewer without a display."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from builders.errors import code_in
from builders.paths import ROOT

SAMPLES = ROOT / "sample_clouds"
DOO3D = [sys.executable, "-m", "doo3d"]


def completed(line: str) -> list[str]:
    """Return what bash would offer at the end of a line, by doo3d's own completion script."""
    words = line.split(" ")
    asked = {"_DOO3D_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    code = "from doo3d.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code], cwd=sys.prefix, env=os.environ | asked, capture_output=True, text=True)
    return done.stdout.split()


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("doo3d de", ["detect"]),
        ("doo3d detect x -c pap", ["paper_2d", "paper_3d"]),
        ("doo3d detect x --set merge.cha", ["merge.chains="]),
        ("doo3d export out --to mj", ["mjcf", "mjcf-motion"]),
        ("doo3d detect x --quie", ["--quiet"]),
    ],
)
def test_completion(line, offered):
    assert completed(line) == offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_script(shell):
    code = "from doo3d.cli import main; main()"
    env = os.environ | {"_DOO3D_COMPLETE": f"source_{shell}"}
    script = subprocess.run([sys.executable, "-c", code], cwd=sys.prefix, env=env, capture_output=True, text=True).stdout
    assert f"complete_{shell}" in script
    assert "doo3d" in script


def test_products_are_named_after_their_run(doo3d, tmp_path):
    assert doo3d("detect", SAMPLES / "straight", "-o", "runs_a", "-q")[0] == 0
    assert doo3d("report", "runs_a", "--no-clouds")[1].endswith("-> runs_a.html\n")
    assert doo3d("video", "runs_a")[1].endswith("-> runs_a.webm\n")
    assert doo3d("report", "runs_a")[0] == 0  # made from these results and not edited: replaced
    Path("runs_a.html").write_text("edited")
    code, _, err = doo3d("report", "runs_a")
    assert (code, code_in(err)) == (2, "out-exists")
    assert doo3d("report", tmp_path / "runs_a" / "..", "--force")[0] == 2


def listening(pids: set[str]) -> set[str]:
    """Return the addresses, in hexadecimal, that processes listen on: of /proc/net/tcp and tcp6."""
    sockets = {
        os.readlink(link)[8:-1]
        for pid in pids
        for link in Path(f"/proc/{pid}/fd").iterdir()
        if os.readlink(link).startswith("socket:")
    }
    rows = [row.split() for name in ("tcp", "tcp6") for row in Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
    return {row[1].split(":")[0] for row in rows if row[3] == "0A" and row[9] in sockets}


def descendants(pid: int) -> set[str]:
    """Return the ids of a process and of all that it started."""
    found = {str(pid)}
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in path.read_text().split():
            found |= descendants(int(child))
    return found


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_view_without_a_display_says_so_and_listens_on_this_machine_only(doo3d, tmp_path):
    pytest.importorskip("rerun")
    assert doo3d("detect", SAMPLES / "straight", "-o", "out", "-q")[0] == 0
    env = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [*DOO3D, "view", "out", "--no-stages"]
    viewer = subprocess.Popen(command, cwd=tmp_path, env=env | {"PYTHONUNBUFFERED": "1"}, stdout=subprocess.PIPE, text=True)
    try:
        assert "1 frame" in viewer.stdout.readline()
        page = viewer.stdout.readline()
        assert re.match(r"no display: open http://127\.0\.0\.1:\d+/", page)
        deadline = time.monotonic() + 20
        while len(found := listening(descendants(viewer.pid))) == 0 and time.monotonic() < deadline:
            time.sleep(0.2)
        assert found == {"0100007F"}
    finally:
        viewer.send_signal(signal.SIGINT)
        viewer.stdout.close()
        code = viewer.wait(20)
    assert code == 130
