"""Compare the given length of the objects of a sequence with the measured length."""

from collections.abc import Sequence

from ..config import Config
from .object_length import MIN_FRAMES
from .objects import find_objects
from .observations import LENGTH_ERROR, Observation
from .world_frame import in_world


def length_notes(observations: Sequence[Observation], config: Config) -> tuple[str, ...]:
    """Return a note if an object's measured length differs from `sequence.length`.

    Parameters
    ----------
    observations
        all frames, in order.
    config
        the settings, as for `find_objects`.
    """
    given = config.sequence.length
    if given is None or len(observations) < MIN_FRAMES:
        return ()
    measured = find_objects(
        in_world(observations), config.model_copy(update={"sequence": config.sequence.model_copy(update={"length": None})})
    )
    segment = config.fit.length
    lengths = [item.length for item in measured if item.nodes == (None, None)]
    other = [length for length in lengths if abs(length - given) > max(segment, LENGTH_ERROR * given)]
    if not other:
        return ()
    found = " and ".join(f"{length:.3f} m" for length in other)
    return (
        f"sequence: sequence.length is {given:.3f} m, and the frames that show an object whole show {found}: leave "
        "sequence.length out to use what they show",
    )
