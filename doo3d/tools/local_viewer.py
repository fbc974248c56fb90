"""Start the Rerun viewer as a local process on 127.0.0.1: a window, or without a display a web page."""

import os
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from urllib.parse import quote

from ..errors import InputError

ADDRESS = "127.0.0.1"
START_SECONDS = 30.0
"""Time in s to wait for a viewer to answer."""

POLL_SECONDS = 0.1


@dataclass(frozen=True)
class LocalViewer:
    """A running viewer.

    Attributes
    ----------
    process
        the viewer's process; a window stays open when this process ends.
    server
        address that recordings are sent to.
    page
        address of the web page that shows them; empty if the viewer is a window.
    """

    process: subprocess.Popen[bytes]
    server: str
    page: str = ""


def has_display() -> bool:
    """Return whether this process can open a window: always, except on Linux without a display server."""
    return not sys.platform.startswith("linux") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def start_viewer() -> LocalViewer:
    """Start the Rerun viewer: a window, or without a display a web page. It listens on 127.0.0.1, on free ports.

    Raises
    ------
    InputError : the viewer ends at once, or does not answer.
    """
    port, web_port = _free_ports(2)
    command = [sys.executable, "-m", "rerun", "--bind", ADDRESS, "--port", str(port), "--hide-welcome-screen"]
    server, page = f"rerun+http://{ADDRESS}:{port}/proxy", ""
    if not has_display():
        command += ["--serve-web", "--web-viewer-port", str(web_port)]
        page = f"http://{ADDRESS}:{web_port}/?url={quote(server, safe='')}"
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=not page,
        env=os.environ | {"RERUN_ANALYTICS": "off"},
    )
    deadline = time.monotonic() + START_SECONDS
    while not _answers(port):
        if process.poll() is not None or time.monotonic() > deadline:
            process.kill()
            fault = "the viewer cannot be opened: it ends at once or does not answer"
            remedy = "write a recording with --save FILE.rrd, and open it with: rerun FILE.rrd"
            raise InputError(f"{fault}; {remedy}", code="viewer-unavailable")
        time.sleep(POLL_SECONDS)
    return LocalViewer(process, server, page)


def _free_ports(count: int) -> list[int]:
    """Return `count` free ports of 127.0.0.1."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for each in sockets:
            each.bind((ADDRESS, 0))
        return [each.getsockname()[1] for each in sockets]
    finally:
        for each in sockets:
            each.close()


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(POLL_SECONDS)
        return probe.connect_ex((ADDRESS, port)) == 0
