"""Say what would help where a sequence has no objects, or a given length differs from the measured one."""

from collections.abc import Sequence

from ..config import Config
from .object_length import MIN_FRAMES
from .objects import SequenceObject, find_objects
from .observations import LENGTH_ERROR, Observation
from .world_frame import in_world


def sequence_notes(observations: Sequence[Observation], objects: Sequence[SequenceObject], config: Config) -> tuple[str, ...]:
    """Return the notes on a sequence as a whole.

    Parameters
    ----------
    observations
        all frames, in order.
    objects
        the objects of the sequence.
    config
        the settings, as for `find_objects`.
    """
    return _length_note(observations, config) or _missing_note(observations, objects, config)


def _missing_note(observations: Sequence[Observation], objects: Sequence[SequenceObject], config: Config) -> tuple[str, ...]:
    """Return a note if there are no objects, with the remedies that the caller has not tried."""
    if objects or not observations:
        return ()
    remedies = ["the length of the object (sequence.length)"] if config.sequence.length is None else []
    if config.merge.chains is None:
        remedies.insert(0, "the number of objects (merge.chains)")
    shown = [observation for observation in observations if observation.strands] or observations
    if not all(observation.object_given for observation in shown):
        remedies.insert(0, "masks or the color of the object (segment.ranges; doo3d tune finds it)")
    help_text = f"; it helps to give {' or '.join(remedies)}" if remedies else ""
    return (f"sequence: no frames show an object whole and with confidence, so every frame keeps its own chains{help_text}",)


def _length_note(observations: Sequence[Observation], config: Config) -> tuple[str, ...]:
    """Return a note if an object's measured length differs from `sequence.length`."""
    given = config.sequence.length
    if given is None or len(observations) < MIN_FRAMES:
        return ()
    measured = find_objects(
        in_world(observations), config.model_copy(update={"sequence": config.sequence.model_copy(update={"length": None})})
    )
    lengths = [item.length for item in measured if item.nodes == (None, None) and not item.closed]
    other = [length for length in lengths if abs(length - given) > max(config.fit.length, LENGTH_ERROR * given)]
    if not other:
        return ()
    found = " and ".join(f"{length:.3f} m" for length in other)
    return (
        f"sequence: sequence.length is {given:.3f} m, and the frames that show an object whole show {found}: leave "
        "sequence.length out to use what they show",
    )
