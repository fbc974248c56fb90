"""The time that each stage of a frame takes."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_SECONDS: ContextVar[defaultdict[str, float] | None] = ContextVar("seconds", default=None)


@contextmanager
def stopwatch() -> Iterator[dict[str, float]]:
    """Collect the seconds of the stages that run in the `with` block: name of the stage -> s, all calls of it together."""
    seconds: defaultdict[str, float] = defaultdict(float)
    token = _SECONDS.set(seconds)
    try:
        yield seconds
    finally:
        _SECONDS.reset(token)


def timed(stage: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator that adds the time of a function to a stage, in seconds, where a `stopwatch` is running."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def measured(*args: P.args, **keywords: P.kwargs) -> R:
            start = time.perf_counter()
            result = function(*args, **keywords)
            seconds = _SECONDS.get()
            if seconds is not None:
                seconds[stage] += time.perf_counter() - start
            return result

        return measured

    return decorate
