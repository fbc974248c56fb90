"""How sure the result of a frame is, decided once, at the end: log-odds of chains, interpretations and crossings."""

from .evidence import Evidence
from .interpretations import Interpretation, interpret
from .judge import judge
from .verdict import Verdict

__all__ = ["Evidence", "Interpretation", "Verdict", "interpret", "judge"]
