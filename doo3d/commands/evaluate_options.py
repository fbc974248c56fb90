"""Options shared by the commands of `doo3d evaluate`, and their checks."""

from __future__ import annotations

from collections.abc import Collection

from ..errors import ConfigError

SENSORS = {"d435": "d435", "d455": "d455", "zivid": "zivid", "stereo": "stereo", "coarse": "coarse", "perfect": "none"}
"""Name of a depth camera in the shell -> its key in the renderer's SENSORS."""


def check_choice(option: str, value: str, choices: Collection[str]) -> str:
    """Return the value of an option unchanged if it is one of the choices.

    Parameters
    ----------
    option
        name of the option, such as "--count", named in the error.
    value
        the value given by the user.
    choices
        the allowed values.

    Raises
    ------
    ConfigError : the value is none of the choices; the message lists them.
    """
    if value not in choices:
        raise ConfigError(f"{option} {value}: there are {', '.join(choices)}", code="choice-unknown")
    return value


def parse_sensor(name: str) -> str:
    """Return the renderer's name of the depth camera given with --sensor.

    It is the given name, "d435", "d455", "zivid", "stereo" or "coarse", or "none" if the given name is "perfect".

    Raises
    ------
    ConfigError : there is no such camera.
    """
    return SENSORS[check_choice("--sensor", name, SENSORS)]


def parse_size(text: str) -> tuple[int, int]:
    """Return (width, height) in px from text such as "1280x720".

    Raises
    ------
    ConfigError : the text has another form, or width or height is below 64.
    """
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) >= 64 and int(height) >= 64):
        raise ConfigError(
            f"--size {text}: expected WIDTHxHEIGHT in pixels, 64x64 at least, such as 1280x720", code="value-invalid"
        )
    return int(width), int(height)


def use_single_thread() -> None:
    """Limit native libraries to one thread in this process, so that measured times can be compared."""
    from ..runs.threads import single_thread

    single_thread()
