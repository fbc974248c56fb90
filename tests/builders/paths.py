"""Where the tests find the checkout, its samples, and data of others beside it (tests that need it skip where it is absent)."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_clouds"
DATA = ROOT.parent / "shared" / "data"
