"""Paths of the checkout, its samples, and third-party data beside it (tests that need absent data are skipped)."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_clouds"
DATA = ROOT.parent / "shared" / "data"
