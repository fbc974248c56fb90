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
from .choice import Choice, keep
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
            bodies = [item.chains for item in tracked.objects] or [(k,) for k in range(len(tracked.chains))]
            chosen = [body for body in bodies if any(tracked.chains[k].id in self._ids for k in body)]
            return keep(tracked, sorted(k for body in chosen for k in body))
        if tracked.frame != self._first:
            raise InputError(
                f"frame {self._first}: --points and --box choose in this first frame, and it failed: start at another by --start",
                code="place-missed",
            )
        tracked = self._choice.applied(tracked)
        self._ids = frozenset(chain.id for chain in tracked.chains if chain.id is not None)
        if not tracked.chains:
            raise InputError(
                f"frame {self._first}: no chain is left by --points and --box: {'; '.join(tracked.notes)}", code="place-missed"
            )
        return tracked

    def remember(self, detection: Detection, stored: Detection) -> None:
        """Remember the objects not chosen, which results do not hold; detection, stored : of the last finished frame."""
        paired = zip(detection.chains, pair_chains(stored.chains, detection.chains, self._config), strict=True)
        others = [chain for chain, (number, _) in paired if number is None]
        state, end = self.state, self.state.next_id + len(others)
        ids = range(state.next_id, end)
        new = tuple(TrackedChain(replace(chain, id=id)) for chain, id in zip(others, ids, strict=True))
        self._state = TrackingState((*state.tracked, *new), end)


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
    names = [frame.name for frame in capture.frames]
    finished = [frame for frame in capture.frames if folder.done.get(frame.name, {}).get("status") == OK]
    if not finished or finished[0].name != names[0]:
        return ChosenTracker(choice, names[0], tracker, config, None)
    first = read_detection(folder.file(names[0], SUFFIXES["json"]))
    ids = frozenset(chain.id for chain in first.chains if chain.id is not None)
    result = ChosenTracker(choice, names[0], tracker, config, ids)
    if tracker is not None and len(folder.done) < len(names):
        with suppress(DooError):  # its files have gone since; the next frames are tracked without the other objects
            last = finished[-1]
            found = method(last.load(), last, config).detection
            result.remember(found, read_detection(folder.file(last.name, SUFFIXES["json"])))
    return result


def check_choice(choice: Choice | None, capture: Capture) -> None:
    """Raise InputError if pixels of the first frame choose among photographs, which are not a sequence."""
    if choice is not None and capture.format == "photos" and len(capture.frames) > 1:
        raise InputError(
            f"{capture.path}: --points and --box are pixels of one photograph, and there are {len(capture.frames)}, which are no "
            "sequence: give one, or choose it by --frames",
            code="options-conflict",
        )
