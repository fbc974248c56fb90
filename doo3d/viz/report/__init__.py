"""Make the report of a run: one self-contained HTML page."""

from .page import report_page

__all__ = ["report_page"]
