"""Draw the pictures of the documentation again: `python docs/figures/all.py`, some minutes.

The pictures of measurements (docs/pages/images/accuracy, scale.png) belong to figures in the text and are made with these. A
script that lacks a package, such as MuJoCo, is named at the end, and the others are run nevertheless.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
HAND, T_PIECE = "sample_clouds/hand", "sample_clouds/t_piece"


def commands(results: Path) -> list[list[str]]:
    """Return the commands in order; `results` is a folder for the results that the moving picture shows."""
    yellow, dragged, harness = (str(results / name) for name in ("yellow.yaml", "dragged", "harness"))
    doo3d = [sys.executable, "-m", "doo3d"]
    alone = ("choose", "stages", "troubleshooting", "paper_2d", "reliability", "simulator")
    return [
        *([sys.executable, str(HERE / f"{name}.py")] for name in alone),
        [*doo3d, "tune", HAND, "-o", yellow],
        [*doo3d, "detect", HAND, "-o", dragged, "-c", yellow, "--sequence", "-q"],
        [*doo3d, "detect", T_PIECE, "-o", harness, "-c", "harness", "-q"],
        [sys.executable, str(HERE / "moving.py"), dragged, harness],
    ]


def main() -> None:
    with tempfile.TemporaryDirectory() as results:
        failed = [command for command in commands(Path(results)) if subprocess.run(command, cwd=ROOT).returncode]
    sys.exit("".join(f"failed: {' '.join(command)}\n" for command in failed) or None)


if __name__ == "__main__":
    main()
