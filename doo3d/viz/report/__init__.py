"""The report: a run as one page of HTML that needs no network."""

from __future__ import annotations

from .page import report_page

__all__ = ["report_page"]
