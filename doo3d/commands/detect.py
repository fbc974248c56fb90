"""Implement `doo3d detect`: find the chains in every frame of a capture, and write them to a folder."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated

import typer

from .arguments import ALL_FRAMES, DEFAULT_READING, DEFAULT_SETTINGS, CamerasOption, Frames, Reading, Settings
from .debug_frame import DebugFrameOption, debug_frames, write_debug_frames
from .exit_codes import NOTHING_DONE, SOME_FAILED
from .interruption import interruptible
from .messages import closing_line, wrapped
from .progress import Reporter, reporting


def detect(
    capture: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="A folder of frames, a bag, a cloud, a folder of clouds; in 2-D images or a video."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the results.")] = Path("out"),
    settings: Settings = DEFAULT_SETTINGS,
    reading: Reading = DEFAULT_READING,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="POSE",
            help="Pose of the camera in the robot's base frame, which the results are then in: a file (text, NPY, YAML, JSON), "
            "x,y,z,qx,qy,qz,qw, capture (the capture's own poses), or tf:FRAME of a bag. Default: pose.yaml beside the images.",
        ),
    ] = None,
    cameras: CamerasOption = None,
    selection: Frames = ALL_FRAMES,
    workers: Annotated[
        str,
        typer.Option(
            metavar="N|auto",
            help="Worker processes, each with one frame at a time; 0: this process alone; auto: as many as processors, memory "
            "and the number of frames allow.",
        ),
    ] = "0",
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Use the workers of a dask scheduler, such as tcp://host:8786.")
    ] = None,
    fuse_views: Annotated[
        bool,
        typer.Option("--fuse-views", help="Fuse all frames to one cloud and detect in that; object at rest, known camera poses."),
    ] = False,
    sequence: Annotated[
        bool,
        typer.Option("--sequence", help="Find the same objects in all frames together, through what hides them; two passes."),
    ] = False,
    debug_frame: DebugFrameOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="Do all frames again, also those already finished in OUT.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Do frames again that failed; without it, those whose files have changed.")
    ] = False,
    time_limit: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.1, help="Time after which a frame fails and its worker is replaced.")
    ] = 60.0,
    pictures: Annotated[
        str,
        typer.Option(
            metavar="all|failed|none|every:N",
            help="Frames that get a picture. failed: those without a chain, with a doubtful one or one below 0.5, or with a "
            "note; every:10: the first and every tenth after it. Missing pictures of finished frames are drawn from the results.",
        ),
    ] = "all",
    picture_format: Annotated[
        str, typer.Option(metavar="jpg|png", help="Format of the pictures; PNG takes ten times as long to write.")
    ] = "jpg",
    instances: Annotated[
        bool, typer.Option("--instances", help="Also write OUT/<frame>.instances.png: the number of the chain at each pixel.")
    ] = False,
    points: Annotated[
        str | None,
        typer.Option(metavar="X,Y;-X,Y", help="Keep chains at these pixels of the first frame; minus: drop them."),
    ] = None,
    box: Annotated[
        str | None, typer.Option(metavar="X0,Y0,X1,Y1", help="Keep chains with over half of their visible length in this box.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write into OUT even if it holds something else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Find the chains in every frame of INPUT and write them to OUT.

    Writes OUT/<frame>.json (the chains) and OUT/<frame>.jpg (a picture) per frame, OUT/config.yaml and OUT/manifest.json. Prints
    a line per frame. Interrupted runs resume: repeat the same command.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out
      doo3d detect capture -o out -c mine.yaml --set merge.chains=2 --set fit.segment_length=0.005
      doo3d detect sample_clouds/photos -o out -c image
      doo3d detect capture -o out --workers auto
      doo3d detect capture -o out --pictures failed
      doo3d detect capture -o out --instances --pictures none
      doo3d detect sample_clouds/two_cables -o out --points "230,520;-550,365"
      doo3d detect capture -o out --pose 0.4,0,0.7,1,0,0,0
      doo3d detect sample_clouds/crossing -o out --debug-frame 0
      doo3d detect capture -o out --fuse-views --input-option trajectory=poses.txt
      doo3d detect capture -o out --sequence --workers 4
      doo3d detect pairs -o out --cameras rig.yaml

    Exit code 0: all frames are fine; 1: some failed (see OUT/manifest.json); 2: nothing could be done, or the run ended early;
    130: interrupted with Ctrl-C; 143: ended by SIGTERM.
    """
    from ..runs.local_executor import local_workers
    from ..runs.worker_count import AUTO, worker_count

    # the workers load the method while this process opens the capture
    known = 0 if workers == AUTO else worker_count(workers, 0)
    own_workers = local_workers(known, time_limit) if known and not scheduler else nullcontext()
    with interruptible() as interruption, own_workers as executor:
        from ..runs.threads import single_thread

        single_thread()
        from ..camera.open_rig import open_frames
        from ..runs.choice import Choice
        from ..runs.option_checks import check_use

        effective = settings.load()
        read_options = reading.options(cameras, *([] if pose is None else [f"pose={pose}"]))
        choice = Choice.of(points, box)
        check_use(read_options, effective, fuse_views, sequence, instances, choice is not None)
        opened = open_frames(capture, effective, reading.mask, read_options)
        opened = selection.of(opened)
        for note in () if quiet else opened.notes:
            typer.echo(wrapped(f"note: {note}", sys.stderr), err=True)
        if fuse_views:
            from ..fusion.fused_capture import fused_capture

            opened = fused_capture(opened, effective)
        debugged = debug_frames(opened, debug_frame)
        names = [entry.name for entry in opened.frames]
        width = max(map(len, names), default=0)
        from ..runs.pictures import Pictures
        from ..runs.run_options import RunOptions

        options = RunOptions(
            reading=read_options,
            workers=0 if scheduler and workers == AUTO else worker_count(workers, len(names)),
            scheduler=scheduler,
            executor=executor,
            restart=restart,
            force=force,
            retry_failed=retry_failed,
            time_limit=time_limit,
            pictures=Pictures.of(pictures, picture_format, instances),
            choice=choice,
        )
        if sequence:
            from ..runs.sequence_run import run_sequence

            @contextmanager
            def passes(name: str) -> Iterator[Reporter]:
                with reporting(len(names), width, quiet, name, name == "second pass", time_limit) as reporter:
                    interruption.reporter = reporter
                    yield reporter

            summary = run_sequence(opened, out, effective, passes, options)
        else:
            from ..runs.run import run

            with reporting(len(names), width, quiet, time_limit=time_limit) as reporter:
                interruption.reporter = reporter
                summary = run(opened, out, effective, options.with_progress(reporter))
    if not summary.succeeded:
        if len(names) > 1:
            typer.echo(f"doo3d: all {len(names)} frames failed, nothing was written", err=True)
        raise typer.Exit(NOTHING_DONE)
    for sentence in () if quiet else summary.notes:
        typer.echo(wrapped(f"note: {sentence}", sys.stderr), err=True)
    if not quiet:
        typer.echo(closing_line(len(names), summary.failed, summary.counts()["chains"], str(out), summary.doubtful))
    write_debug_frames(out, debugged, effective)
    if summary.failed:
        raise typer.Exit(SOME_FAILED)
