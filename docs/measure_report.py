"""Measure the report of a long run: python docs/measure_report.py [--frames 1000] [--opened 3].

Run it in the folder that holds sample_clouds/ and tests/. The run repeats the detection of sample_clouds/crossing under other
names. The data of twenty frames are made as by `doo3d report` and timed, then repeated, so that the whole takes seconds.
The page is opened in Chromium without a window (`chromium`, or the program named in DOO3D_CHROMIUM), a new one each time.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, "tests")
from builders.browser import Browser

from doo3d.outputs.run_reader import open_results
from doo3d.viz.report import page

DOO3D = str(Path(sys.executable).with_name("doo3d"))  # the command beside this Python, not the sources beside this script

SAMPLE = Path("sample_clouds/crossing")
MADE = 20  # frames whose data are made; the others repeat them

WATCH = """
const seen = window.seen = {};
function watch() {
  const plots = [...document.querySelectorAll(".plot")];
  if (document.querySelectorAll("#frames > li").length) seen.frames ??= performance.now();
  if (plots.length && plots.every(plot => plot.querySelector(".scatterlayer .trace"))) seen.plots ??= performance.now();
  if (!seen.plots) requestAnimationFrame(watch);
}
requestAnimationFrame(watch);
"""


def write_run(folder: Path, frames: int) -> Path:
    """Write the capture and the results of a run of many frames: those of the sample, again and again."""
    out, capture = folder / "out", folder / "capture"
    command = [DOO3D, "detect", str(SAMPLE), "-o", str(folder / "first"), "--quiet"]
    subprocess.run(command, check=True)
    manifest = json.loads((folder / "first" / "manifest.json").read_text())
    journal = [json.loads(line) for line in (folder / "first" / "progress.jsonl").read_text().splitlines()]
    out.mkdir()
    for part in ("color", "depth"):
        (capture / part).mkdir(parents=True)
    (capture / "camera_intrinsic.json").write_bytes((SAMPLE / "camera_intrinsic.json").read_bytes())
    entries, lines = [], []
    for i in range(frames):
        first, name = manifest["frames"][i % len(journal)], f"{i:06d}"
        for part, suffix in (("color", "jpg"), ("depth", "png")):
            os.symlink((SAMPLE / part / f"{first['name']}.{suffix}").resolve(), capture / part / f"{name}.{suffix}")
        os.symlink(folder / "first" / f"{first['name']}.jpg", out / f"{name}.jpg")
        detection = json.loads((folder / "first" / f"{first['name']}.json").read_text())
        (out / f"{name}.json").write_text(json.dumps(detection | {"frame": name}))
        entries.append(first | {"name": name})
        lines.append(json.dumps(journal[i % len(journal)] | {"name": name}) + "\n")
    source = manifest["input"] | {"path": str(capture), "frames": frames}
    (out / "manifest.json").write_text(json.dumps(manifest | {"input": source, "frames": entries}))
    (out / "progress.jsonl").write_text("".join(lines))
    return out


def make_report(out: Path, file: Path) -> float:
    """Write the report and return the time that it takes for each frame, s."""
    made: list[dict[str, Any]] = []
    seconds, real = [], page._frame_data

    def frame_data(frame: Any, *others: Any) -> dict[str, Any]:
        if len(made) >= MADE:
            return made[int(frame.name) % MADE] | {"name": frame.name}
        start = time.perf_counter()
        made.append(real(frame, *others))
        seconds.append(time.perf_counter() - start)
        return made[-1]

    page._frame_data = frame_data
    file.write_text(page.report_page(open_results(out), file.parent), encoding="utf-8")
    return median(seconds)


def open_report(file: Path, frames: int) -> dict[str, float]:
    """Open the report and return when what was seen, and the time of the processor for it, s."""
    with Browser() as browser:
        browser.send("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        browser.send("Performance.enable", timeDomain="threadTicks")
        browser.open(file)
        browser.wait("window.seen.plots")
        seen = browser.run("({paint: performance.getEntriesByName('first-contentful-paint')[0].startTime, ...window.seen})")
        assert browser.run("document.querySelectorAll('#frames > li').length") == frames
        assert browser.problems == []
        used = {each["name"]: each["value"] for each in browser.send("Performance.getMetrics")["metrics"]}["TaskDuration"]
        return {key: seen[key] / 1000 for key in ("paint", "frames", "plots")} | {"used": used}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--opened", type=int, default=3, help="times that the report is opened")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        out = write_run(Path(temporary), options.frames)
        file = Path(temporary) / "report.html"
        each = make_report(out, file)
        size = file.stat().st_size / 1e6
        print(f"{options.frames} frames, report of {size:.1f} MB, made in {1000 * each:.0f} ms a frame")
        for _ in range(options.opened):
            seen = open_report(file, options.frames)
            times = f"first paint after {seen['paint']:.1f} s, all frames {seen['frames']:.1f} s, plots {seen['plots']:.1f} s"
            print(f"opened: {times}; {seen['used']:.1f} s of the processor")


if __name__ == "__main__":
    main()
