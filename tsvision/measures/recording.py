"""A recording in, one result a frame out, in order and with flat memory.

What stands still is learnt from a few frames spread over the recording, so that a recording cut
into chunks gives the same numbers; then every frame is measured on its own, starting from the one
before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from tsvision.errors import InputError
from tsvision.flags import Flag, flags_from_text, flags_to_text
from tsvision.images.depth import bits_of, filled
from tsvision.images.frames import iter_frames
from tsvision.images.tone_curve import gamma_of
from tsvision.measures.alone import explained
from tsvision.measures.cords.bowed import Bowed, learn_bowed, measure_bowed
from tsvision.measures.ends.start import needs_holes
from tsvision.measures.frame import LEGS_TURNS, Warm, measure_frame
from tsvision.measures.late import by_twist, shown_late
from tsvision.measures.looks import Looks, learn_looks
from tsvision.measures.numeric.spread import pick_samples
from tsvision.measures.scale import resolve_scale, scale_between_holes
from tsvision.measures.sense import way_of
from tsvision.records import Frame, FrameResult, FrameRow, Recording, Rig

FEWEST_REGION_PX = 8  # on a side; a region of which less lies in the picture was meant for another
SAMPLED_FRAMES = 8  # of a recording, that its looks are learnt from
FIRST_TRIES = 4  # frames that an untaught measurer tries to learn from: learning takes seconds


class Measurer:
    """Measures frames one at a time once its looks are known.

    `prime(pictures)` learns the looks; where that has not been done (a live camera) `measure`
    learns from the first frames that it gets until one of them shows a bundle.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.looks: Looks | None = None
        self.bowed: Bowed | None = None
        self.shape: tuple[int, ...] | None = None
        self.gamma_guessed = False
        self.bits: int | None = None
        self.tries_left = FIRST_TRIES
        self.warm = Warm()

    def prime(self, pictures: list[np.ndarray], turns: Iterable[float] = ()) -> None:
        """Learn from pictures of one size, the most twisted last; the looks stay None when none
        shows a bundle. turns: all that these were chosen from. Nothing is learnt of blank ones."""
        bits = bits_of(pictures)
        pictures = [p for p in pictures if not _is_blank(p, bits)]
        if not pictures:
            return
        self.tries_left, self.bits = 0, bits
        self.shape = pictures[0].shape[:2]
        alike = [p for p in pictures if p.shape == pictures[0].shape]
        if np.isnan(self.rig.camera.gamma):
            gamma = gamma_of(alike)
            self.gamma_guessed = bool(np.isfinite(gamma))
            self.rig = replace(self.rig, camera=replace(self.rig.camera, gamma=gamma))
        self.rig = _within_picture(self.rig, self.shape)
        alike = [filled(p, bits) for p in alike]
        scale = resolve_scale(self.rig)
        if needs_holes(self.rig):
            unscaled = learn_looks(alike, self.rig, scale)
            scale = scale_between_holes(self.rig, unscaled.gap if unscaled is not None else None)
        looks = shown_late(alike, self.rig, scale, learn_looks(alike, self.rig, scale))
        self.bowed, self.looks = learn_bowed(alike, looks, self.rig, scale)
        alone = len(alike) == 1 and self.rig.strings.count is not None
        if alone and (self.bowed is None or self.looks is None):
            self.looks = explained(alike[0], self.rig, scale, self.looks)
            if self.looks is not None:
                self.bowed = None
        ways = {way_of(t) for t in turns if abs(t) >= LEGS_TURNS}
        self.looks = _wound(self.looks, ways)
        if self.bowed is not None:
            self.bowed = replace(self.bowed, looks=_wound(self.bowed.looks, ways))

    @property
    def needs_colour(self) -> bool:
        """Whether the strings are told by their colour: else luma alone, as files store it, is
        decoded in half the time."""
        if self.bowed is not None or self.looks is None:
            return True
        return self.looks.sight.signal.in_colour

    def measure(self, frame: Frame, turns: float = float("nan")) -> FrameResult:
        """One frame; never raises on what the picture shows."""
        if frame.pixels is None:
            return _empty(frame, turns, Flag.UNREADABLE)
        if self.shape is not None and frame.pixels.shape[:2] != self.shape:
            return _empty(frame, turns, Flag.WRONG_SIZE)
        if _is_blank(frame.pixels, self.bits or bits_of([frame.pixels])):
            return _empty(frame, turns, Flag.BLANK)
        if self.looks is None and self.bowed is None and self.tries_left:
            left = self.tries_left - 1
            self.prime([frame.pixels])
            self.tries_left = left
        if self.bits is not None:
            frame = replace(frame, pixels=filled(frame.pixels, self.bits))
        if self.bowed is not None and abs(turns) < LEGS_TURNS:
            return _empty(frame, turns, Flag.TOO_FEW_TURNS)
        if self.bowed is not None:
            result, self.warm = measure_bowed(frame, self.bowed, turns, self.warm)
        elif self.looks is not None:
            result, self.warm = measure_frame(frame, self.looks, turns, self.warm)
        else:
            return _empty(frame, turns, Flag.NO_BUNDLE)
        return self._with_gamma(result)

    def _with_gamma(self, result: FrameResult) -> FrameResult:
        """The exponent in force, and whether it was guessed; where files are sRGB there is none."""
        if np.isnan(self.rig.camera.gamma):
            return result
        flags = flags_from_text(result.row.flags)
        if self.gamma_guessed:
            flags |= Flag.GAMMA_GUESSED
        row = replace(result.row, gamma=self.rig.camera.gamma, flags=flags_to_text(flags))
        return replace(result, row=row)


def measure_frames(
    recording: Recording, start: int = 0, stop: int | None = None
) -> Iterator[FrameResult]:
    """One FrameResult a frame, in order; `start`/`stop` cut a chunk (looks: whole recording)."""
    measurer = Measurer(recording.rig)
    measurer.prime(sample_pictures(recording), recording.turns)
    for frame in iter_frames(recording, start, stop, color=measurer.needs_colour):
        i = frame.index
        result = measurer.measure(frame, float(recording.turns[i]))
        row = replace(
            result.row,
            time_s=float(recording.time_s[i]),
            displacement_mm=float(recording.displacement_mm[i]),
            load_N=float(recording.load_N[i]),
            cycle=float(recording.cycle[i]),
        )
        yield replace(result, row=row)


def _within_picture(rig: Rig, shape: tuple[int, ...]) -> Rig:
    """The rig with its region cut to the picture: what looks there takes it for pixels that are."""
    if rig.view.roi_px is None:
        return rig
    x0, y0, width, height = rig.view.roi_px
    cut = (x0, y0, min(width, shape[1] - x0), min(height, shape[0] - y0))
    if min(cut[2:]) < FEWEST_REGION_PX:
        raise InputError(
            f"view.roi_px lies outside the {shape[1]} x {shape[0]} px picture; mend it "
            "(x, y, width, height), or leave it out"
        )
    return replace(rig, view=replace(rig.view, roi_px=cut))


def _wound(looks: Looks | None, ways: set[int]) -> Looks | None:
    """The looks with the one way that the motor had turned, where it is known; where it had turned
    both ways the frames together show no one sense."""
    if looks is None or not ways:
        return looks
    if len(ways) > 1:
        return replace(looks, slope_sum=0.0)
    (way,) = ways
    return replace(looks, way=way)


def sample_pictures(recording: Recording, most: int = SAMPLED_FRAMES) -> list[np.ndarray]:
    """Readable pictures spread over the recording, all of the commonest size, the most twisted
    last."""
    taken = []
    for i in pick_samples(len(recording.files), most):
        for frame in iter_frames(recording, i, i + 1):
            if frame.pixels is not None:
                taken.append((frame.pixels, float(recording.turns[i])))
    bits = bits_of([p for p, _ in taken])
    shown = [(p, t) for p, t in taken if not _is_blank(p, bits)]
    pictures, turns = [p for p, _ in shown], [t for _, t in shown]
    if not pictures:
        for frame in iter_frames(recording):
            if frame.pixels is not None and not _is_blank(frame.pixels, bits_of([frame.pixels])):
                return [frame.pixels]
        return []
    shapes = [p.shape for p in pictures]
    common = max(set(shapes), key=lambda shape: (shapes.count(shape), shape == shapes[0]))
    return [p for p in by_twist(pictures, turns) if p.shape == common]


def _is_blank(pixels: np.ndarray, bits: int) -> bool:
    """Whether hardly any light differs, by 4 codes of 8 bits or as much of the `bits` that are
    filled; few pixels of nearly every picture show that it does."""
    least = 4 if pixels.dtype == np.uint8 else 2 ** (bits - 6)
    return all(bool(np.ptp(pixels[::step, ::step]) < least) for step in (49, 7))


def _empty(frame: Frame, turns: float, flag: Flag) -> FrameResult:
    flags = flag | (Flag.NO_TURNS if not np.isfinite(turns) else Flag(0))
    return FrameResult(
        FrameRow(frame=frame.index, file=frame.file, turns=turns, flags=flags_to_text(flags))
    )
