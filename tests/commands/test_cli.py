"""The commands: what they print, what they leave behind, and their exit codes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from builders.errors import code_in

from doo3d import __version__
from doo3d.config import Config, load_config, preset_names
from doo3d.tools import scaling

COMMANDS = "detect info tune explain report video view export compare evaluate bench train presets config samples".split()


def test_one_line_per_frame_and_the_files(doo3d, capture):
    code, out, err = doo3d("detect", capture(frames=2), "-o", "results")
    assert code == 0
    first, second, last = out.splitlines()
    assert first.startswith("000000   1 chain   0.")
    for word in (" m ", "radius ", " mm", "% occluded", "confidence 0.8", " ms"):
        assert word in first
    assert second.startswith("000001   1 chain")
    assert last == "2 frames, 2 chains -> results"
    assert err.splitlines() == []
    assert sorted(os.listdir("results")) == [
        *("000000.jpg", "000000.json", "000001.jpg", "000001.json"),
        *("config.yaml", "manifest.json", "progress.jsonl"),
    ]
    found = json.loads(Path("results/000000.json").read_text())
    assert found["schema"] == "doo3d/detection/2"
    assert found["chains"][0]["radius"] == pytest.approx(0.005, abs=0.0015)
    assert cv2.imread("results/000000.jpg").shape == (240, 320, 3)


def test_settings_reach_the_detection(doo3d, capture):
    Path("mine.yaml").write_text("fit:\n  segment_length: 0.02\n")
    code, _, _ = doo3d("detect", capture(), "-c", "mine.yaml", "--set", "refine.iterations=1", "--set", "seed=7")
    assert code == 0
    effective = load_config("out/config.yaml")
    assert (effective.fit.segment_length, effective.refine.iterations, effective.seed) == (0.02, 1, 7)
    assert json.loads(Path("out/000000.json").read_text())["chains"][0]["segment_length"] == 0.02


def test_quiet(doo3d, capture):
    folder = capture(frames=2)
    assert doo3d("detect", folder, "--quiet") == (0, "", "")


def test_a_cloud(doo3d):
    t = np.linspace(0, 0.3, 4000)
    around = np.random.default_rng(0).uniform(0, 2 * np.pi, 4000)
    points = np.column_stack((t, 0.004 * np.cos(around), 0.5 + 0.004 * np.sin(around)))
    np.savez("scan one.npz", points=points)
    code, out, _ = doo3d("detect", "scan one.npz")
    assert code == 0
    assert out.startswith("scan one   1 chain   0.")
    assert Path("out/scan one.jpg").exists()


def test_one_bad_frame(doo3d, capture):
    folder = capture(frames=3)
    (folder / "depth" / "000001.png").write_bytes((folder / "depth" / "000001.png").read_bytes()[:200])
    code, out, err = doo3d("detect", folder)
    assert code == 1
    assert "000001   failed: " in err
    assert code_in(err) == "file-damaged"
    assert out.splitlines()[-1] == "2 of 3 frames, 2 chains -> out"
    statuses = [frame["status"] for frame in json.loads(Path("out/manifest.json").read_text())["frames"]]
    assert statuses == ["ok", "failed", "ok"]


def test_all_frames_bad(doo3d, capture):
    folder = capture(frames=2)
    for file in (folder / "depth").iterdir():
        file.write_bytes(b"")
    code, out, err = doo3d("detect", folder)
    assert (code, out) == (2, "")
    assert "all 2 frames failed, nothing was written" in err
    assert not Path("out").exists()


def test_the_folder_of_another_run(doo3d, refused, capture):
    assert doo3d("detect", capture())[0] == 0
    second = capture("second")
    assert "--force" in refused(second, code="out-other-input")
    assert doo3d("detect", second, "--force")[0] == 0
    code, out, err = doo3d("detect", second)
    assert (code, out) == (0, "1 frame, 1 chain -> out\n")
    said = err.splitlines()
    assert said == ["1 frame is finished already, nothing is left to do (--restart starts over)"]
    code, out, err = doo3d("detect", second, "--set", "seed=1")
    assert (code, err) == (0, "note: out has results with other settings (seed); they are replaced\n")
    assert "1 frame, 1 chain -> out" in out


# --- the other commands ------------------------------------------------------------------------------------------------


def test_version(doo3d):
    assert doo3d("--version") == (0, f"doo3d {__version__}\n", "")


def test_help_starts_with_examples(doo3d):
    code, out, _ = doo3d("--help")
    assert code == 0
    assert out.index("Examples:") < out.index("Options:")
    listed = [line.split()[0] for line in out.partition("Commands:")[2].splitlines() if line.strip()]
    assert listed[:4] == ["detect", "info", "tune", "explain"]
    assert sorted(listed) == sorted(COMMANDS)
    assert "..." not in out.partition("Commands:")[2]  # all are said whole in 80 columns


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(doo3d, command):
    code, out, _ = doo3d(command, "--help")
    assert code == 0
    assert "Usage: doo3d" in out


def test_presets(doo3d):
    code, out, _ = doo3d("presets")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == preset_names()
    assert all(len(line.split()) > 4 for line in out.splitlines())


def test_config(doo3d):
    code, out, _ = doo3d("config", "paper_3d", "--set", "merge.chains=3")
    assert code == 0
    assert "# " in out
    assert Config.model_validate(yaml.safe_load(out)) == load_config("paper_3d", {"merge.chains": 3})
    assert doo3d("config", "none_such")[0] == 2
    assert "distance_weight" not in doo3d("config")[1]
    assert "distance_weight" in doo3d("config", "--all")[1]
    assert doo3d("config", "--markdown")[1].startswith("# Configuration")


def test_bench_of_growing_frames(doo3d, tmp_path, monkeypatch):
    monkeypatch.setattr(scaling, "SIZES", {"pixels": (0.02, 0.04), "crossings": (1, 3)})
    code, out, _ = doo3d("bench", "--scale", "--runs", "1", "--plot", tmp_path / "scale.png")
    assert code == 0
    assert out.count("the time grows with the power") == 2
    assert [line.split()[0] for line in out.splitlines() if "megapixels" in line] == ["0.02", "0.04"]
    assert cv2.imread(str(tmp_path / "scale.png")).shape == (300, 800, 3)


def test_bench_options_that_exclude_each_other(doo3d, capture):
    folder = capture()
    assert "give no INPUT" in doo3d("bench", folder, "--scale")[2]
    assert "--scale" in doo3d("bench", "--plot", "a.png")[2]
    for option in ("--stages", "--large", "--only=cloud"):
        assert "rendered frames" in doo3d("bench", folder, option)[2]
        assert "rendered frames" in doo3d("bench", "--scale", option)[2]


def test_bench_of_rendered_frames(doo3d):
    code, out, _ = doo3d("bench", "--only", "1 cable, image", "--runs", "1", "--stages")
    assert code == 0
    assert "traverse" in out
    assert out.splitlines()[-5].startswith("photograph, 1 cable, image")
    code, _, error = doo3d("bench", "--only", "nothing")
    assert code == 2
    assert "cloud, 9,000 points" in error


def test_bench(doo3d, capture):
    code, out, _ = doo3d("bench", capture(), "--runs", "2")
    assert code == 0
    assert "2 runs, one thread" in out
    assert "median" in out


@pytest.mark.slow
def test_evaluate_scenes(doo3d):
    code, out, _ = doo3d("evaluate", "scenes", "--families", "straight", "--seeds", "1")
    assert code == 0
    assert "frames correct" in out
    code, _, err = doo3d("evaluate", "scenes", "--families", "straight,nope")
    assert code == 2
    assert code_in(err) == "choice-unknown"
    assert "nope" in err
    assert "crossing" in err


def test_as_a_program_of_its_own(capture, tmp_path):
    command = [sys.executable, "-m", "doo3d", "detect", str(capture("Seil é 1"))]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8")
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "out" / "000000.json").exists()
    run = subprocess.run([*command[:-1], "nowhere"], cwd=tmp_path, capture_output=True, text=True, encoding="utf-8")
    assert run.returncode == 2
    assert run.stderr.startswith("doo3d: nowhere ")
    assert code_in(run.stderr) == "file-missing"


def test_progress_bar_on_a_terminal_only(capture, tmp_path):
    pty = pytest.importorskip("pty")
    folder = capture(frames=3)
    (folder / "depth" / "000001.png").write_bytes(b"")
    main_end, terminal = pty.openpty()
    command = [sys.executable, "-m", "doo3d", "detect", str(folder)]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=terminal)
    os.close(terminal)
    shown = b""
    while True:
        try:
            part = os.read(main_end, 4096)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part
    out = run.communicate()[0].decode()
    os.close(main_end)
    assert run.returncode == 1
    assert b"3/3" in shown
    assert b"1 failed" in shown
    assert b"000001   failed" in shown
    assert [line.split()[0] for line in out.splitlines()] == ["000000", "000002", "2"]
    assert "\x1b" not in out
