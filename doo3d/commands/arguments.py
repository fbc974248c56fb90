"""Define arguments and options shared by several commands, and resolve them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from ..errors import InputError
from ..outputs.new_file import check_new_file as check_new_file
from ..outputs.new_file import named_after as named_after
from ..outputs.new_file import save as save

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import Capture, FrameRef, ReadOptions


def completing(names: Callable[[], list[str]]) -> Callable[[str], list[str]]:
    """Return a function for the shell's completion, from a typed prefix to the names that begin with it.

    names : called only when the shell asks, so that nothing is imported before.
    """
    return lambda incomplete: [name for name in names() if name.startswith(incomplete)]


def _complete_preset() -> list[str]:
    from ..config import preset_names

    return preset_names()


def _complete_setting() -> list[str]:
    from ..config import known_keys

    return [f"{key}=" for key in known_keys() if "." in key or key in ("mode", "seed")]


Preset = Annotated[
    str,
    typer.Option(
        "--config", "-c", help="A preset (see doo3d presets) or a YAML file.", autocompletion=completing(_complete_preset)
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set one field, such as merge.chains=2; repeat for more.",
        autocompletion=completing(_complete_setting),
    ),
]

InputOption = Annotated[
    list[str] | None,
    typer.Option(
        "--input-option", metavar="KEY=VALUE", help="How INPUT is to be read, such as depth_scale=5000; repeat for more."
    ),
]

CameraOption = Annotated[
    Path | None,
    typer.Option(
        "--camera",
        metavar="FILE|fx,fy,cx,cy",
        help="Intrinsics of the depth images: a JSON or YAML file with fx, fy, cx, cy or K, ROS's camera_info, RealSense's text, "
        "or the four numbers, in pixels.",
    ),
]

CamerasOption = Annotated[
    Path | None,
    typer.Option(
        "--cameras",
        metavar="FILE",
        help="INPUT holds the images of several calibrated cameras: a rig file, or a stereo pair's calibration (ZED, OpenCV).",
    ),
]

FrameOption = Annotated[
    str | None, typer.Option("--frame", metavar="N", help="Frame to use: its name, or its number from 0; -1 is the last.")
]
Results = Annotated[Path, typer.Argument(metavar="OUT", help="The folder that doo3d detect wrote.")]
MinConfidence = Annotated[
    float,
    typer.Option(
        "--min-confidence", metavar="P", min=0.0, max=1.0, help="Leave out objects whose confidence, 0 to 1, is below this."
    ),
]


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command in which each parameter that is a group of options is replaced by the fields of the group.

    The default of the parameter has the defaults of its options.
    """
    groups: dict[str, tuple[type, list[str]]] = {}
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        kind = parameter.annotation
        if is_dataclass(kind) and isinstance(kind, type):
            options = get_type_hints(kind, include_extras=True)
            groups[parameter.name] = kind, list(options)
            for name, option in options.items():
                default = getattr(parameter.default, name)
                parameters.append(inspect.Parameter(name, parameter.kind, default=default, annotation=option))
        else:
            parameters.append(parameter)

    @wraps(command)
    def run(**values: Any) -> None:
        made = {group: kind(**{name: values.pop(name) for name in names}) for group, (kind, names) in groups.items()}
        command(**values, **made)

    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def config_of(name: str, overrides: list[str] | None) -> Config:
    """Return the configuration of a command: a preset or a YAML file, changed by the values of --set.

    `name` is a preset, such as "default", or the path of a YAML file; `overrides` are texts such as "merge.chains=2", or None.

    Raises
    ------
    ConfigError : the preset, the file or an override cannot be used.
    """
    from ..config import load_config, parse_overrides

    return load_config(name, parse_overrides(overrides or []))


def split(names: str | None) -> list[str] | None:
    """Return the names in a comma-separated text as a list, without blanks around them; None if `names` is None."""
    return None if names is None else [name.strip() for name in names.split(",")]


def frame_of(capture: Capture, wanted: str | None, option: str = "--frame") -> FrameRef:
    """Return the frame of a capture that has a given name or number.

    Parameters
    ----------
    capture
        the capture to search.
    wanted
        name of the frame, or its number: 0 is the first, -1 the last. A name takes precedence over a number. None selects the
        first frame.
    option
        the command-line option that `wanted` was given with, named in the error.

    Raises
    ------
    InputError : the capture has no such frame.
    """
    frames = capture.frames
    for entry in frames:
        if wanted is not None and entry.name == wanted:
            return entry
    try:
        return frames[int(wanted or 0)]
    except (ValueError, IndexError):
        names = f"{frames[0].name} to {frames[-1].name}" if len(frames) > 1 else "".join(entry.name for entry in frames)
        raise InputError(
            f"{option} {wanted}: {capture.path} has {len(frames)} frame{'s' * (len(frames) != 1)}, {names}", code="frame-unknown"
        ) from None


@dataclass(frozen=True)
class Settings:
    """The options for the configuration: a preset or a file, and settings that override it."""

    config: Preset = "default"
    overrides: Overrides = None

    def load(self) -> Config:
        """Load the configuration; raise ConfigError if it cannot be used."""
        return config_of(self.config, self.overrides)


@dataclass(frozen=True)
class Reading:
    """The options for reading a capture."""

    mask: Annotated[
        Path | None,
        typer.Option("--mask", help="Mask of the object, replacing the capture's own: an image, or a folder of them."),
    ] = None
    input_options: InputOption = None
    camera: CameraOption = None

    def options(self, cameras: Path | None = None, *more: str) -> ReadOptions:
        """Return the ReadOptions; cameras : file of a rig. more : further options in the form of `--input-option`."""
        from ..inputs import ReadOptions

        return ReadOptions.from_pairs([*(self.input_options or []), *more], self.camera, cameras)

    def open(self, path: Path) -> Capture:
        """Open the capture at a path; raise InputError if it cannot be read."""
        from ..inputs import open_capture

        return open_capture(path, masks=self.mask, options=self.options())


@dataclass(frozen=True)
class Frames:
    """The options that select frames of a capture."""

    every: Annotated[int, typer.Option(min=1, metavar="N", help="Keep every Nth of the selected frames.")] = 1
    start: Annotated[
        str | None,
        typer.Option(
            metavar="POSITION",
            help="First frame: its number from 0 (12), or from the end (-1 is the last), or a time since the first frame (12.5s; "
            "-2s is two seconds before the last).",
        ),
    ] = None
    end: Annotated[str | None, typer.Option(metavar="POSITION", help="Last frame, given like --start; it is included.")] = None
    frames: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Frames and ranges, given like --start, both ends included: 3,7,10-20 or 2s-4.5s; a single time selects the "
            "frame nearest to it.",
        ),
    ] = None

    def of(self, capture: Capture) -> Capture:
        """Return the capture with only the selected frames; raise InputError if a position is invalid."""
        from ..inputs.frame_selection import Selection, select_frames

        return select_frames(capture, Selection(self.every, self.start, self.end, self.frames))


DEFAULT_SETTINGS, DEFAULT_READING, ALL_FRAMES = Settings(), Reading(), Frames()
