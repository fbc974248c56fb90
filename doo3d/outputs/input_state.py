"""Record the state of a run's input files, so that a failed frame is tried again once its files have changed."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class InputState:
    """The current state of a run's input files.

    Attributes
    ----------
    files
        absolute path -> size and modification time, as text; "?" if the file cannot be read.
    by_frame
        frame name -> absolute paths of the files that this frame is read from.
    """

    files: Mapping[str, str]
    by_frame: Mapping[str, Sequence[str]]

    def digest(self, replaced: Mapping[str, str | None] | None = None) -> str:
        """Return the SHA-256 of paths, sizes and times as 64 hexadecimal digits.

        replaced : path -> state to use instead of the current one; None for a file that does not exist.
        """
        states = {**self.files, **(replaced or {})}
        text = "\n".join(f"{path} {states[path]}" for path in sorted(states) if states[path] is not None)
        return hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()

    def of_frame(self, name: str) -> dict[str, str]:
        """Return path -> state of the files that a frame is read from, for its line in the journal if it failed."""
        return {path: self.files[path] for path in self.by_frame[name] if path in self.files}

    def has_changed(self, line: Mapping[str, Any]) -> bool:
        """Return whether a file of a failed frame has changed, appeared or disappeared; `line` : its line in the journal."""
        former = line.get("inputs")
        return isinstance(former, dict) and line["name"] in self.by_frame and former != self.of_frame(line["name"])

    def digest_before(self, lines: Iterable[Mapping[str, Any]]) -> str:
        """Return the digest of the input with the files of failed frames in their state at the time of failure.

        Files that other frames also use, such as a bag, keep their current state. `lines` are those of all frames in the journal.
        """
        last = {line["name"]: line for line in lines}
        failed = {name for name, line in last.items() if line["status"] == "failed" and self.has_changed(line)}
        if not failed:
            return self.digest()
        shared = {path for name, paths in self.by_frame.items() if name not in failed for path in paths}
        before: dict[str, str | None] = {}
        for name in failed:
            former = {str(path): str(state) for path, state in last[name]["inputs"].items()}
            before |= dict.fromkeys(self.of_frame(name)) | former
        return self.digest({path: state for path, state in before.items() if path not in shared})
