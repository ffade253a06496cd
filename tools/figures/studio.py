"""Where figures are made: size, samples, the scene that is open, and what every strip looks like."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.evaluation.frame import open_frame

from .sheet import DIFFERENCE, Panel, draw, short
from .shot import Scores, Shot


@dataclass(frozen=True)
class Figure:
    """sheets: (file name, PNG) each. rows: the numbers below them, the first one names the columns."""

    title: str
    words: str  # what the paper shows and what to look at
    sheets: list[tuple[str, bytes]]
    rows: list[list[str]] = field(default_factory=list)


class Studio:
    """size: (width, height) of pictures; samples: Cycles' paths a ray; texels: finest side of what is baked."""

    def __init__(self, size: tuple[int, int], samples: int, texels: int, folder: Path):
        self.size, self.samples, self.texels, self.folder = size, samples, texels, folder
        self._open: tuple[Callable, Shot] | None = None
        self._stack = ExitStack()
        self._number = 0

    def __enter__(self):
        return self

    def __exit__(self, *what):
        self._stack.close()

    def shot(self, build: Callable[[], bpy.types.Scene]) -> Shot:
        """The scene that `build` opens or makes, ready. The last one is kept: Blender has one file open."""
        if self._open is None or self._open[0] is not build:
            self._stack.close()
            self._open = None
            scene = build()
            snapshot = self._stack.enter_context(open_frame(scene, None))
            self._number += 1
            shot = Shot(scene, snapshot, self.size, self.samples, self.texels, self.folder / str(self._number))
            self._open = build, shot
        return self._open[1]

    def compared(self, shot: Shot, shown: list[tuple[str, object]]) -> tuple[list[list[Panel]], list[list[str]]]:
        """((truth and pictures, the frame and their differences), rows of numbers) of (label, Answer) pairs."""
        truth = shot.picture(shot.truth)
        top = [Panel("truth", up(truth), "Cycles, along the shader's rays")]
        below = [Panel("the frame", up(shot.look.apply(shot.frame.combined)), "Cycles")]
        rows = [HEADINGS]
        for label, answer in shown:
            picture = shot.picture(answer)
            scores = shot.scores(answer, picture)
            top.append(Panel(label, up(picture), scores.words()))
            below.append(
                Panel(
                    "its difference", up(shot.difference(picture)), f"radiance: half within {_percent(scores.median)}"
                )
            )
            rows.append(numbers(label, scores))
        return [top, below], rows

    def close_up(
        self, shot: Shot, marked: np.ndarray, rows: list[list[Panel]], shown: list[tuple[str, object]]
    ) -> list[Panel]:
        """A row of what `compared` shows, CLOSE times as large, where most pixels of (H, W) bool are marked; the place is
        drawn into the truth of `rows`."""
        window = busiest(marked, tuple(side // CLOSE for side in self.size))
        truth = shot.picture(shot.truth)
        rows[0][0] = replace(rows[0][0], picture=up(outlined(truth, window)))
        out = [Panel("truth, close up", magnified(truth, window, self.size), f"the frame above, {CLOSE} times")]
        return out + [Panel(label, magnified(shot.picture(a), window, self.size), "close up") for label, a in shown]

    def sheet(self, rows: list[list[Panel]], words: str = "", legend: bool = True) -> bytes:
        note = "FLIP: 0 = looks equal. hit p95: hit-point error over the scene's diagonal, 95 % of rays are below."
        return draw(
            rows, self.size, "\n".join(w for w in (words, f"{DIFFERENCE} {note}" if legend else "") if w), legend
        )


CLOSE = 4  # times, of close-ups
HEADINGS = ["", "FLIP", "median", "relMSE", "hit p50", "hit p95", "missed + false"]


def numbers(label: str, scores: Scores) -> list[str]:
    hits = (short(v) for v in (scores.relmse, scores.hit_p50, scores.hit_p95))
    return [label, short(scores.flip), _percent(scores.median), *hits, _percent(scores.wrong)]


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.2g} %"


def up(picture: np.ndarray) -> np.ndarray:
    """Top row first, as files and sheets have it."""
    return np.clip(picture[::-1], 0, 1)


def magnified(picture: np.ndarray, window: tuple[int, int, int, int], size: tuple[int, int]) -> np.ndarray:
    """(height, width, 3) of `size`, top row first: the window (x, y, width, height; row 0 at the bottom), texels as squares."""
    x, y, w, h = window
    columns = x + np.arange(size[0]) * w // size[0]
    rows = y + np.arange(size[1]) * h // size[1]
    return up(picture[rows][:, columns])


def outlined(picture: np.ndarray, window: tuple[int, int, int, int]) -> np.ndarray:
    """The picture with the window's frame drawn in."""
    x, y, w, h = window
    out = picture.copy()
    for rows, columns in (((y, y + h - 1), slice(x, x + w)), (slice(y, y + h), (x, x + w - 1))):
        out[rows, columns] = (1.0, 0.25, 0.1)
    return out


def busiest(marked: np.ndarray, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """(x, y, width, height) of the window of this size that holds most marked pixels of (H, W) bool."""
    w, h = (min(a, b) for a, b in zip(size, marked.shape[::-1], strict=True))
    sums = np.pad(np.cumsum(np.cumsum(marked.astype(int), 0), 1), ((1, 0), (1, 0)))
    counts = sums[h:, w:] - sums[:-h, w:] - sums[h:, :-w] + sums[:-h, :-w]
    y, x = np.unravel_index(np.argmax(counts), counts.shape)
    return int(x), int(y), w, h
