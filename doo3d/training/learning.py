"""Train the network on drawn images; training can stop and resume from a checkpoint."""

from __future__ import annotations

import csv
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from threading import Thread
from typing import Any

import cv2
import numpy as np
import torch
from torch.nn import functional

from ..errors import InputError
from ..types import Array
from .drawing import draw
from .export import onnx_bytes
from .network import Network
from .own_data import cropped, own_images

SIZE = 256
"""Width and height of a training image, px."""

CAPACITY = 12000
"""Greatest number of drawn images kept for reuse."""

FIRST = 480
"""Number of images drawn before the first step."""

AHEAD = 64
"""Number of images drawn in advance."""

CHECK_IMAGES = 96
"""Number of check images of each kind, for the learning curve."""

WARM_UP_STEPS = 400
AVERAGE_DECAY = 0.998
"""Decay per step of the exponential moving average of the network's weights, which is exported."""


@dataclass(frozen=True)
class Settings:
    """Settings of training.

    Attributes
    ----------
    folder
        folder of the checkpoint, the kept images and the learning curve.
    steps
        total number of steps.
    seed
        seed of all random numbers.
    batch
        number of images per step.
    fresh
        number of these images that have not been used before.
    rate
        largest learning rate.
    threads
        number of threads of torch; images are drawn by an additional process.
    checkpoint_steps
        number of steps from one checkpoint to the next.
    data
        the user's captures with masks, and result folders.
    share
        fraction, 0 to 1, of the images that come from `data`; the others are drawn.
    """

    folder: Path
    steps: int
    seed: int = 0
    batch: int = 8
    fresh: int = 2
    rate: float = 2e-3
    threads: int = 1
    checkpoint_steps: int = 500
    data: tuple[Path, ...] = ()
    share: float = 0.5


def train(
    settings: Settings,
    report: Callable[[int, float], None] = lambda step, loss: None,
    drawing: Callable[[int, int], None] = lambda count, total: None,
) -> Path:
    """Train up to a number of steps, and return the path of the checkpoint; resume from an existing one.

    Parameters
    ----------
    settings
        settings of the training.
    report
        called after each step with its number and its loss.
    drawing
        called after each image drawn before the first step, with the numbers of images drawn and of all.

    Raises
    ------
    InputError : one of the user's images cannot be read or has no mask; the folder's training had other data or another seed.
    """
    own = [image for path in settings.data for image in own_images(path)]
    torch.set_num_threads(settings.threads)
    torch.manual_seed(settings.seed)
    settings.folder.mkdir(parents=True, exist_ok=True)
    checkpoint = settings.folder / "checkpoint.pt"
    identity: dict[str, Any] = {"seed": settings.seed, "batch": settings.batch, "fresh": settings.fresh, "share": settings.share}
    identity["data"] = [str(path) for path in settings.data]
    network = Network().to(memory_format=torch.channels_last)
    average = {name: value.detach().clone() for name, value in network.state_dict().items()}
    optimizer = torch.optim.AdamW(network.parameters(), lr=settings.rate, weight_decay=1e-3)
    step, spent = 0, 0.0
    if checkpoint.exists():
        state = torch.load(checkpoint, weights_only=True)
        if state.get("identity", identity) != identity:
            raise InputError(
                f"{settings.folder}: holds a checkpoint of training with other data, share or seed: give another --work",
                code="training-differs",
            )
        network.load_state_dict(state["network"])
        optimizer.load_state_dict(state["optimizer"])
        average, step, spent = state["average"], state["step"], state["seconds"]
        if step not in _logged(settings):  # it was interrupted in between
            _log(settings, step, spent, state.get("loss", float("nan")), average)
    since = time.monotonic()
    losses: list[float] = []
    with _Pool(settings, step, own, drawing) as pool:
        while step < settings.steps:
            for group in optimizer.param_groups:
                group["lr"] = settings.rate * _rate(step, settings.steps)
            image, truth = pool.batch(step)
            network.train()
            with torch.autocast("cpu", torch.bfloat16):
                output = network(image)
            loss = loss_of(output.float(), truth)
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 2.0)
            optimizer.step()
            step += 1
            losses.append(float(loss.detach()))
            _update(average, network, step)
            report(step, losses[-1])
            if step % settings.checkpoint_steps == 0 or step == settings.steps:
                seconds = spent + time.monotonic() - since
                state = {"network": network.state_dict(), "optimizer": optimizer.state_dict(), "average": average}
                state["identity"] = identity
                state |= {"step": step, "seconds": seconds, "loss": float(np.mean(losses))}
                torch.save(state, checkpoint.with_suffix(".new"))
                os.replace(checkpoint.with_suffix(".new"), checkpoint)
                _log(settings, step, seconds, state["loss"], average)
                losses = []
    return checkpoint


def exported(checkpoint: Path) -> bytes:
    """Return the content of an ONNX file of a checkpoint's averaged network."""
    network = Network()
    network.load_state_dict(torch.load(checkpoint, weights_only=True)["average"])
    return onnx_bytes(network.eval())


def loss_of(output: Any, truth: Any) -> Any:
    """Return the loss: cross-entropy and Dice loss of the object, and absolute error of the centre inside it."""
    logit, centre = output[:, 0], output[:, 1]
    mask, middle = truth[:, 0], truth[:, 1]
    entropy = functional.binary_cross_entropy_with_logits(logit, mask, pos_weight=torch.tensor(1.5))
    probability = torch.sigmoid(logit)
    both, sums = (probability * mask).sum((1, 2)), (probability + mask).sum((1, 2))
    dice = 1 - (2 * both + 50) / (sums + 50)
    inside = (mask > 0.5).float()
    error = (torch.abs(torch.sigmoid(centre) - middle) * inside).sum() / (inside.sum() + 1)
    return 2 * entropy + dice.mean() + 0.5 * error


def _rate(step: int, steps: int) -> float:
    if step < WARM_UP_STEPS:
        return (step + 1) / WARM_UP_STEPS
    return 0.02 + 0.98 * 0.5 * (1 + float(np.cos(np.pi * min(1, step / steps))))


def _update(average: dict[str, Any], network: Any, step: int) -> None:
    decay = min(AVERAGE_DECAY, step / (step + 10))
    for name, value in network.state_dict().items():
        if value.dtype.is_floating_point:
            average[name].lerp_(value, 1 - decay)
        else:
            average[name].copy_(value)


def _log(settings: Settings, step: int, seconds: float, loss: float, average: dict[str, Any]) -> None:
    """Append a line to the learning curve, with the IoU of the averaged weights on check images.

    The check images are new images of trained kinds, and images of held-out kinds.
    """
    network = Network().to(memory_format=torch.channels_last)
    network.load_state_dict(average)
    network.eval()
    values = [intersection_over_union(network, images) for images in check_images(settings)]
    path = settings.folder / "curve.csv"
    is_new = not path.exists()
    with path.open("a", newline="") as stream:
        writer = csv.writer(stream)
        if is_new:
            writer.writerow(["step", "seconds", "loss", "iou_trained_kinds", "iou_held_out_kinds"])
        writer.writerow([step, round(seconds), round(loss, 4), *(round(value, 4) for value in values)])


def _logged(settings: Settings) -> set[int]:
    """Return the steps that have a line in the learning curve."""
    path = settings.folder / "curve.csv"
    lines = path.read_text().splitlines()[1:] if path.exists() else []
    return {int(line.partition(",")[0]) for line in lines}


def check_images(settings: Settings) -> list[Array]:
    """Return the check images (N, S, S, 5) uint8 for the learning curve, of trained and of held-out kinds."""
    found = []
    for held_out in (False, True):
        path = settings.folder / f"check_{int(held_out)}.npy"
        if not path.exists():
            np.save(path, np.stack([_drawn(settings.seed + 1_000_003, index, SIZE, held_out) for index in range(CHECK_IMAGES)]))
        found.append(np.load(path))
    return found


def intersection_over_union(network: Any, images: Array) -> float:
    """Return the IoU of the network's mask and the truth over all pixels of images (N, S, S, 5)."""
    both = either = 0
    with torch.no_grad():
        for part in np.array_split(images, max(1, len(images) // 12)):
            with torch.autocast("cpu", torch.bfloat16):
                found = network(_input(part)).float()[:, 0].numpy() > 0
            truth = part[..., 3] > 127
            both += int((found & truth).sum())
            either += int((found | truth).sum())
    return both / max(either, 1)


def _input(images: Array) -> Any:
    scaled = torch.from_numpy(np.ascontiguousarray(images[..., :3].transpose(0, 3, 1, 2))).float() / 255
    return scaled.contiguous(memory_format=torch.channels_last)


def _made(seed: int, index: int, share: float, size: int) -> Array:
    """Return an image with its truth, (S, S, 5) uint8: a crop of one of the user's images, or a drawn one."""
    rng = np.random.default_rng([seed, 3, index])
    if _own and rng.random() < share:
        return cropped(rng, _own[int(rng.integers(len(_own)))], size)
    return _drawn(seed, index, size, False)


def _drawn(seed: int, index: int, size: int, held_out: bool) -> Array:
    """Return a drawn image with its truth, (S, S, 5) uint8."""
    cv2.setNumThreads(1)
    image, truth = draw(seed, index, size, held_out)
    return np.concatenate([image, truth], axis=-1)


_own: list[Array] = []
"""The user's images, in the process that draws."""


def _start_worker(parent: int, own: list[Array]) -> None:
    """Prepare the drawing process: keep the user's images, ignore Ctrl-C, and exit when the parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _own[:] = own

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(2)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


class _Pool:
    """Images drawn by another process, each used several times; until step n, FIRST + n * fresh images are drawn."""

    def __init__(self, settings: Settings, step: int, own: list[Array], drawing: Callable[[int, int], None]) -> None:
        self._settings, self._drawing = settings, drawing
        path = settings.folder / "images.npy"
        shape = (CAPACITY, SIZE, SIZE, 5)
        self._drawn = FIRST + step * settings.fresh if path.exists() and step else 0
        mode = "r+" if path.exists() else "w+"
        self._images = np.lib.format.open_memmap(path, mode, np.uint8, None if mode == "r+" else shape)
        self._executor = ProcessPoolExecutor(1, get_context("spawn"), initializer=_start_worker, initargs=(os.getpid(), own))
        self._stream: Iterator[Array] = iter(())

    def __enter__(self) -> _Pool:
        self._stream = self._ahead()
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(cancel_futures=True)

    def _ahead(self) -> Iterator[Array]:
        """Yield the images in order, drawn in advance in the background."""
        index = self._drawn
        waiting: deque[Future[Array]] = deque()
        while True:
            while len(waiting) < AHEAD:
                waiting.append(self._executor.submit(_made, self._settings.seed, index, self._settings.share, SIZE))
                index += 1
            yield waiting.popleft().result()

    def batch(self, step: int) -> tuple[Any, Any]:
        """Return the images (B, 3, S, S) and the truth (B, 2, S, S) of a step."""
        wanted = FIRST + (step + 1) * self._settings.fresh
        is_first = wanted - self._drawn > self._settings.fresh
        while self._drawn < wanted:
            self._images[self._drawn % CAPACITY] = next(self._stream)
            self._drawn += 1
            if is_first:
                self._drawing(self._drawn, wanted)
        rng = np.random.default_rng([self._settings.seed, 7, step])
        count = min(self._drawn, CAPACITY)
        newest = (self._drawn - 1 - np.arange(self._settings.fresh)) % CAPACITY
        chosen = np.concatenate([newest, rng.integers(0, count, self._settings.batch - len(newest))])
        images = np.stack([varied(rng, self._images[index]) for index in chosen])
        truth = torch.from_numpy(np.ascontiguousarray(images[..., 3:].transpose(0, 3, 1, 2))).float() / 255
        return _input(images), truth


def varied(rng: np.random.Generator, image: Array) -> Array:
    """Augment an image with its truth: rotate, mirror and enlarge it, and permute its colors, at random."""
    if rng.random() < 0.35:
        side = int(rng.integers(SIZE * 5 // 8, SIZE))
        x, y = rng.integers(0, SIZE - side, 2)
        image = cv2.resize(np.ascontiguousarray(image[y : y + side, x : x + side]), (SIZE, SIZE), interpolation=cv2.INTER_LINEAR)
    image = np.rot90(image, int(rng.integers(4)))
    if rng.random() < 0.5:
        image = image[:, ::-1]
    if rng.random() < 0.3:
        image = image[..., [*rng.permutation(3), 3, 4]]
    if rng.random() < 0.3:
        gains = np.append(rng.uniform(0.7, 1.3) * rng.uniform(0.9, 1.1, 3), [1, 1])
        image = np.clip(image * gains, 0, 255).astype(np.uint8)
    return np.asarray(image)
