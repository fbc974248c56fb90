"""Follow the objects that the user chose in the first frame of a capture."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from ..config import Config
from ..errors import DooError, InputError
from ..inputs import Capture
from ..outputs import SUFFIXES
from ..outputs.run_folder import ResultsFolder
from ..outputs.run_reader import read_detection
from ..track.chain_matching import pair_chains
from ..track.tracking import TrackedChain, Tracker, TrackingState
from ..types import Detection
from .choice import Choice, bodies_of, keep
from .frame_record import OK
from .methods import Method


class ChosenTracker(Tracker):
    """Tracker that keeps the objects chosen in the first frame, by their ids; it remembers the others to tell them apart.

    Parameters
    ----------
    choice
        what the user points at.
    first
        name of the first frame, whose pixels `choice` means.
    tracker
        gives chains their ids; None if they have them, or if there is one frame only.
    config
        the configuration of the run.
    ids
        ids of the chosen chains, if an earlier run has finished the first frame.
    """

    def __init__(self, choice: Choice, first: str, tracker: Tracker | None, config: Config, ids: frozenset[int] | None) -> None:
        super().__init__(config.tracking, None if tracker is None else tracker.state)
        self._choice, self._first, self._follows, self._ids = choice, first, tracker is not None, ids

    def update(self, detection: Detection) -> Detection:
        """Return the next frame's detection with ids, and the chosen objects only.

        Raises
        ------
        InputError : the first frame failed, or nothing is chosen in it.
        """
        tracked = super().update(detection) if self._follows else detection
        if self._ids is not None:
            chosen = {k for k, chain in enumerate(tracked.chains) if chain.id in self._ids}
            return keep(tracked, sorted(k for body in bodies_of(tracked) if body & chosen for k in body))
        is_first = tracked.frame == self._first
        tracked = self._choice.applied(tracked) if is_first else tracked
        if not is_first or not tracked.chains:
            why = "; ".join(("no chain is left", *tracked.notes)) if is_first else "it failed; start at another by --start"
            raise InputError(f"frame {self._first}: --points and --box choose in this first frame: {why}", code="place-missed")
        self._ids = frozenset(chain.id for chain in tracked.chains if chain.id is not None)
        return tracked

    def remember(self, detection: Detection, stored: Detection) -> None:
        """Remember the objects not chosen, which results do not hold; detection, stored : of the last finished frame."""
        pairs, end = pair_chains(stored.chains, detection.chains, self._config), self.state.next_id
        others = [chain for chain, (number, _) in zip(detection.chains, pairs, strict=True) if number is None]
        new = (TrackedChain(replace(chain, id=end + k)) for k, chain in enumerate(others))
        self._state = TrackingState((*self.state.tracked, *new), end + len(others))


def chosen_tracker(
    choice: Choice, tracker: Tracker | None, capture: Capture, config: Config, folder: ResultsFolder, method: Method
) -> ChosenTracker:
    """Return the tracker of the chosen objects, after the frames that an earlier run finished.

    Results hold the chosen objects only, so the others are detected once more, in the last finished frame.

    Parameters
    ----------
    choice, tracker, config
        as for `ChosenTracker`; `tracker` remembers the chosen objects.
    capture
        the capture.
    folder
        the folder of the run.
    method
        the function that finds the chains of a frame.
    """
    if capture.format == "photos" and len(capture.frames) > 1:
        what = f"{capture.path}: --points and --box choose in one photograph, and there are {len(capture.frames)}"
        raise InputError(f"{what}, which are no sequence: choose one by --frames", code="options-conflict")
    first = capture.frames[0].name
    finished = [frame for frame in capture.frames if folder.done.get(frame.name, {}).get("status") == OK]
    if not finished or finished[0].name != first:
        return ChosenTracker(choice, first, tracker, config, None)
    stored = [read_detection(folder.file(frame.name, SUFFIXES["json"])) for frame in (finished[0], finished[-1])]
    ids = frozenset(chain.id for chain in stored[0].chains if chain.id is not None)
    result = ChosenTracker(choice, first, tracker, config, ids)
    if tracker is not None and len(folder.done) < len(capture.frames):
        with suppress(DooError):  # its files have gone since; the next frames are tracked without the other objects
            result.remember(method(finished[-1].load(), finished[-1], config).detection, stored[1])
    return result
