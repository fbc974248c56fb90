"""Run under many surroundings: the same bytes whatever hash seed, threads, workers, language, time zone and processor.

    python tests/campaigns/same_bytes.py [--all]

Takes each surrounding by itself beside the usual one; `--all` takes every combination of hash seed, threads, workers and
language. Prints a line for each that differs and the count; exit code 1 if any does.
"""

from __future__ import annotations

import argparse
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from captures import result_of, write_capture

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
CHOICES: dict[str, tuple[str, ...]] = {
    "hash seed": ("0", "1", "4294967295"),
    "threads": ("1", "2", "8"),
    "workers": ("0", "1", "2"),
    "language": ("C.UTF-8", "C", "tr_TR.UTF-8", "de_DE.UTF-8"),
    "zone": ("UTC", "Asia/Kathmandu"),
    "kernel": ("", "Prescott", "Haswell", "SkylakeX"),
}
"""What surrounds a run -> the values tried; the first is the usual one."""


def surroundings(every: bool) -> Iterator[dict[str, str]]:
    """Yield the surroundings to try, without the usual one."""
    usual = {key: values[0] for key, values in CHOICES.items()}
    if not every:
        yield from (usual | {key: value} for key, values in CHOICES.items() for value in values[1:])
        return
    keys = [key for key in CHOICES if key not in ("zone", "kernel")]
    for values in itertools.product(*(CHOICES[key] for key in keys)):
        if (one := usual | dict(zip(keys, values, strict=True))) != usual:
            yield one


def run(capture: Path, out: Path, around: dict[str, str]) -> tuple[dict[str, bytes], list[str]]:
    """Run under these surroundings and return the results, which are removed."""
    own = {"PYTHONHASHSEED": around["hash seed"], "LC_ALL": around["language"], "LANG": around["language"], "TZ": around["zone"]}
    if around["kernel"]:
        own["OPENBLAS_CORETYPE"] = around["kernel"]  # as on another processor; one that this has not got is not taken
    env = dict(os.environ) | own | dict.fromkeys(THREADS, around["threads"])
    command = [sys.executable, "-m", "doo3d", "detect", str(capture), "-o", str(out), "--workers", around["workers"], "--quiet"]
    done = subprocess.run(command, env=env, cwd=capture.parent, capture_output=True)  # not where the sources lie
    assert done.returncode == 1, done.stderr.decode(errors="replace")
    try:
        return result_of(out)
    finally:
        shutil.rmtree(out)


def compare(folder: Path, tried: list[dict[str, str]], frames: int = 3) -> list[dict[str, str]]:
    """Return those of the surroundings under which results are not as usual; `folder` is for the capture and results."""
    write_capture(folder / "capture é", frames)
    usual = {key: values[0] for key, values in CHOICES.items()}
    expected = run(folder / "capture é", folder / "out", usual)
    return [around for around in tried if run(folder / "capture é", folder / "out", around) != expected]


def main() -> None:
    """Run the campaign and print the count."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--all", action="store_true", help="every combination")
    tried = list(surroundings(parser.parse_args().all))
    with tempfile.TemporaryDirectory() as folder:
        different = compare(Path(folder), tried)
    for around in different:
        print(f"differs: {around}")
    print(f"same bytes: {len(tried) - len(different)} of {len(tried)} surroundings")
    sys.exit(bool(different))


if __name__ == "__main__":
    main()
