"""Kill runs, refuse them the disk, and repeat the command: the results are those of an undisturbed run, byte for byte.

    python tests/campaigns/kills.py --random 100 --operations --errors [--workers 0 1 2] [--seed 0] [--sequence]

`--random N` kills N runs at random moments. `--operations` kills at each file operation: before it, after it, and with half of it
done. `--errors` has each file operation fail with ENOSPC, EACCES and EIO: once, and from then on. `--most N` takes N of these
cases. `--sequence` takes runs of two passes, which find objects in all frames together. Prints a line for each case that
went wrong and the counts; exit code 1 if any did. Linux and macOS.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from captures import result_of, write_capture
from faults import ERRORS, KILLS, Ended, Fault, Forked

KILLED = -signal.SIGKILL
FINE = (0, 1)  # exit codes of runs that went through, the damaged frame failed


@dataclass
class Campaign:
    """Runs of one capture, some of them disturbed.

    folder: for the capture and results. sequence: whether the runs look at all frames together, in two passes. frames: of the
    capture. wrong: a sentence about each case that went wrong.
    """

    folder: Path
    sequence: bool = False
    frames: int = 4
    wrong: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.names = write_capture(self.folder / "capture", self.frames)
        start = time.monotonic()
        ended = self.run(0)
        self.seconds = {0: time.monotonic() - start}
        self.expected = result_of(self.out)
        assert ended.code == 1, ended.output
        assert self.expected[1] == self.names * (1 + self.sequence)

    @property
    def out(self) -> Path:
        """The folder of the results of the case under way."""
        return self.folder / "out"

    def start(self, workers: int, fault: Fault | None = None, *options: str) -> Forked:
        """Start a run."""
        arguments = [str(self.folder / "capture"), "-o", str(self.out), "--workers", str(workers), "--quiet", *options]
        arguments += ["--sequence"] * self.sequence
        return Forked(arguments, self.out, self.folder / "log", fault)

    def run(self, workers: int, fault: Fault | None = None, *options: str) -> Ended:
        """Start a run and wait for its end."""
        return self.start(workers, fault, *options).wait()

    def resumed(self, case: str, workers: int, *options: str) -> bool:
        """Repeat the command; whether the results are then those of an undisturbed run. Removes them."""
        ended = self.run(workers, None, *options)
        same = self.out.is_dir() and result_of(self.out) == self.expected
        if ended.code != 1 or "Traceback" in ended.output or not same:
            self.wrong.append(f"{case}: resumed with exit code {ended.code}, same results: {same}\n{ended.output}")
        shutil.rmtree(self.out, ignore_errors=True)
        return ended.code == 1 and same

    def random_kills(self, workers: int, count: int, rng: random.Random) -> int:
        """Kill runs at random moments, some of them again when they have resumed; the number that came out right."""
        shutil.rmtree(self.out, ignore_errors=True)
        if workers not in self.seconds or self.seconds[workers] == 0:
            start = time.monotonic()
            self.run(workers)
            self.seconds[workers] = time.monotonic() - start
            shutil.rmtree(self.out, ignore_errors=True)
        right = 0
        for number in range(count):
            for _ in range(rng.choice((1, 1, 2))):
                run = self.start(workers)
                time.sleep(rng.uniform(0, self.seconds[workers]))
                with suppress(ProcessLookupError):
                    os.kill(run.process, signal.SIGKILL)
                run.wait()
            right += self.resumed(f"random kill {number}, {workers} workers", workers)
        return right

    def operations(self, workers: int) -> int:
        """The number of file operations of an undisturbed run."""
        shutil.rmtree(self.out, ignore_errors=True)
        operations = self.run(workers).operations
        shutil.rmtree(self.out, ignore_errors=True)
        return operations

    def kill_at(self, workers: int, at: int, kind: str) -> bool:
        """Kill a run at a file operation; whether it came out right."""
        case = f"killed {kind} operation {at}, {workers} workers"
        ended = self.run(workers, Fault(kind, at))
        if ended.code != KILLED and not (ended.code in FINE and ended.operations < at):
            self.wrong.append(f"{case}: ended with {ended.code}\n{ended.output}")
            return False
        return self.resumed(case, workers)

    def refuse_at(self, workers: int, at: int, kind: str, lasting: bool) -> bool:
        """Let a file operation fail; whether that is one sentence, and the next run comes out right."""
        case = f"{kind} at operation {at}{' and later' if lasting else ''}, {workers} workers"
        ended = self.run(workers, Fault(kind, at, lasting))
        lines = [line for line in ended.output.splitlines() if "000001" not in line]  # the damaged frame has a line of its own
        told = ended.code == 2 and len(lines) == 1 and lines[0].endswith("[out-unwritable]")
        if not told and not (ended.code in FINE and not lines):
            self.wrong.append(f"{case}: ended with {ended.code}\n{ended.output}")
            shutil.rmtree(self.out, ignore_errors=True)
            return False
        return self.resumed(case, workers, "--retry-failed")


def chosen(cases: Iterator[tuple[int, str, bool]], most: int | None, rng: random.Random) -> list[tuple[int, str, bool]]:
    """All cases, or so many of them."""
    every = list(cases)
    return every if most is None or most >= len(every) else rng.sample(every, most)


def preload() -> None:
    """Load what a run needs, once for all forked processes."""
    from doo3d.runs.threads import single_thread

    single_thread()
    import scipy.optimize  # noqa: F401

    import doo3d.runs.sequence_run  # noqa: F401


def main() -> None:
    """Run the campaign and print the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--random", type=int, default=0, metavar="N", help="kill so many runs, for each number of workers")
    parser.add_argument("--operations", action="store_true", help="kill at each file operation")
    parser.add_argument("--errors", action="store_true", help="let each file operation fail")
    parser.add_argument("--workers", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--most", type=int, help="cases of operations and of errors, for each number of workers")
    parser.add_argument("--sequence", action="store_true", help="find the objects of all frames together, in two passes")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    preload()
    with tempfile.TemporaryDirectory() as folder:
        campaign, rng = Campaign(Path(folder), options.sequence), random.Random(options.seed)
        for workers in options.workers:
            if options.random:
                right = campaign.random_kills(workers, options.random, rng)
                print(f"{workers} workers, killed at random moments: {right} of {options.random}", flush=True)
            count = campaign.operations(workers) if options.operations or options.errors else 0
            places = range(1, count + 1)
            if options.operations:
                cases = chosen(((at, kind, False) for at in places for kind in KILLS), options.most, rng)
                right = sum(campaign.kill_at(workers, at, kind) for at, kind, _ in cases)
                print(f"{workers} workers, killed at file operations ({count}): {right} of {len(cases)}", flush=True)
            if options.errors:
                every = ((at, kind, lasting) for at in places for kind in ERRORS for lasting in (False, True))
                cases = chosen(every, options.most, rng)
                right = sum(campaign.refuse_at(workers, *case) for case in cases)
                print(f"{workers} workers, errors at file operations ({count}): {right} of {len(cases)}", flush=True)
    print("\n".join(campaign.wrong), end="")
    sys.exit(bool(campaign.wrong))


if __name__ == "__main__":
    main()
