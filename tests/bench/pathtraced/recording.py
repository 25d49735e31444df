"""Writes a recording: frames, turns.csv, rig.toml, profiles.npz, truth.csv, truth.json (last)."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd

from .camera import Camera
from .film import Film, develop
from .rope import Knot, State, build
from .scene import Look, build_scene, load_mitsuba, trace
from .truth import frame_truth, silhouette


@dataclass(frozen=True)
class Spec:
    """One recording. `coil_from` is where overtwist starts; knots carry their own turn."""

    name: str
    what: str
    count: int
    hand: int
    turns: tuple[float, ...]
    camera: Camera
    look: Look = field(default_factory=Look)
    film: Film = field(default_factory=Film)
    coil_from: float = 1e9
    coil_per_root_turn_d: float = 0.066  # coil radius over D per square root of turns past onset
    unevenness: float = 0.0
    swell: float = 0.0  # lattice spacing grows by this share as the lay reaches its end
    knots: tuple[Knot, ...] = ()
    motion_step_px: float = 0.0
    equal_luma: bool = False
    exposed_to: float | None = None  # share of full well that the brightest hundredth reaches
    seed: int = 1
    spp: int = 16


def state_at(spec: Spec, turns: float) -> State:
    """Coil and knots grow with the turns past their onset; the coil's phase is any."""
    rng = np.random.default_rng([spec.seed, round(1000 * turns)])
    spacing = 1 + spec.swell * (1 - np.exp(-turns / (0.5 * max(spec.turns))))
    state = State(spec.count, spec.hand, turns, spacing=float(spacing))
    past = max(0.0, turns - spec.coil_from)
    grown = tuple(grow(k, turns) for k in spec.knots if turns >= k.nucleated_at_turn)
    return replace(
        state,
        coil_radius_mm=spec.coil_per_root_turn_d * state.diameter_mm * float(np.sqrt(past)),
        coil_pitch_mm=2.8 * state.diameter_mm,
        coil_phase=float(rng.uniform(0, 2 * np.pi)),
        unevenness=spec.unevenness,
        knots=grown,
    )


def grow(knot: Knot, turns: float) -> Knot:
    """A knot starts at just over half its radius and fills within some five turns."""
    share = 1 - 0.45 * np.exp(-(turns - knot.nucleated_at_turn) / 5)
    return replace(knot, radius_mm=knot.radius_mm * float(share))


def film_at(spec: Spec, i: int) -> Film:
    """Shake that grows from frame to frame and changes its direction."""
    step = spec.motion_step_px
    return replace(spec.film, motion_px=spec.film.motion_px + step * i, motion_deg=(50.0 * i) % 180)


def header(spec: Spec, frames: list[dict[str, Any]]) -> dict[str, Any]:
    """Facts of the whole recording; onsets by the frames' own truth."""

    def first(test: Any) -> float | None:
        return next((f["turns"] for f in frames if test(f)), None)

    nucleated = [k.nucleated_at_turn for k in spec.knots if k.nucleated_at_turn <= max(spec.turns)]
    sides = ("left", "top", "right", "bottom")
    return {
        "sequence": spec.name,
        "what": spec.what,
        "n_strings": spec.count,
        "handedness": "right" if spec.hand > 0 else "left",
        "L_mm": 23.2,
        "strand_d_mm": 0.24,
        "hole_gap_mm": 5.0,
        "knot_nucleation_turn": min(nucleated, default=None),
        "first_frame_turn_with_visible_knot": first(lambda f: f["n_knots_visible"] > 0),
        "overtwist_first_frame_turn": first(
            lambda f: f["bundle_d_mm"] and f["coil_amplitude_mm"] >= 0.05 * f["bundle_d_mm"]
        ),
        "separator_side": sides[round(spec.camera.axis_deg / 90) % 4],
        "seed": spec.seed,
        "spp": spec.spp,
        "pixel_convention": "continuous px, centre of the top-left pixel = (0.5,0.5)",
    }


def write(spec: Spec, folder: Path, pictures: bool = True) -> Path:
    """Render `spec` into `folder`/name, or write its tables alone. truth.json comes last."""
    out = folder / spec.name
    out.mkdir(parents=True, exist_ok=True)
    (out / "truth.json").unlink(missing_ok=True)
    suffix = "jpg" if spec.film.jpeg_quality else "png"
    names = [f"{spec.name}_{i:03d}.{suffix}" for i in range(len(spec.turns))]
    if pictures:
        render(spec, [out / name for name in names])
    frames, profiles = [], {}
    for i, turns in enumerate(spec.turns):
        rope = build(state_at(spec, turns))
        edges = silhouette(rope, spec.camera)
        truth = frame_truth(rope, spec.camera, edges)
        if turns:
            profiles[f"f{i:03d}"] = edges
        named = {"file": names[i], "frame": i, "sequence": spec.name}
        frames.append({**named, **truth, "degradation": asdict(film_at(spec, i))})
    write_tables(spec, out, frames, profiles)
    return out


def render(spec: Spec, paths: list[Path]) -> None:
    mi = load_mitsuba()
    look = match_luma(mi, spec) if spec.equal_luma else spec.look
    jpeg = spec.film.jpeg_quality
    for i, (path, turns) in enumerate(zip(paths, spec.turns, strict=True)):
        scene = build_scene(mi, build(state_at(spec, turns)), spec.camera, look, spec.seed)
        rng = np.random.default_rng([spec.seed, i])
        light = trace(mi, scene, spec.spp, i)
        if spec.exposed_to is not None and not i:
            exposure = spec.exposed_to / float(np.percentile(light, 99.0))
            spec = replace(spec, film=replace(spec.film, exposure=exposure))
        picture = develop(light, film_at(spec, i), rng)
        cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, jpeg] if jpeg else [])
        print(f"{path.name}: {turns:g} turns", file=sys.stderr, flush=True)


def write_tables(spec: Spec, out: Path, frames: list[dict[str, Any]], profiles: Any) -> None:
    table = pd.DataFrame(frames)
    table[["frame", "file", "turns"]].to_csv(out / "turns.csv", index=False)
    table.drop(columns="degradation").to_csv(out / "truth.csv", index=False)
    scale = 1 / spec.camera.scale_at(11.6)
    (out / "rig.toml").write_text(
        f"[strings]\ncount = {spec.count}\ndiameter_mm = 0.24\n[actuator]\n"
        f"twisting_zone_mm = 23.2\nhole_distance_mm = 5.0\n[camera]\nmm_per_px = {scale:.6f}\n"
    )
    np.savez_compressed(out / "profiles.npz", **profiles)
    whole = {**header(spec, frames), "frames": frames}
    (out / "truth.json").write_text(json.dumps(whole, default=float))


def match_luma(mi: Any, spec: Spec) -> Look:
    """Scale the ground's albedo until the coded picture's luma there equals the strings'."""
    camera = replace(spec.camera, width=320, height=180, px_per_mm=spec.camera.px_per_mm / 4)
    rope = build(state_at(spec, 0.4 * max(spec.turns)))
    film = replace(spec.film, gauss_blur_px=0.3, defocus_px=0, motion_px=0, full_well_e=1e5)
    x = rope.centre[200:-200:20]
    on = np.floor(camera.project(x)).astype(int)
    look = spec.look
    for _ in range(4):
        light = trace(mi, build_scene(mi, rope, camera, look, spec.seed), 64, 0)
        grey = cv2.cvtColor(develop(light, film, np.random.default_rng(0)), cv2.COLOR_BGR2GRAY)
        on = on[(on[:, 0] >= 12) & (on[:, 0] < 308) & (on[:, 1] >= 12) & (on[:, 1] < 168)]
        strings = grey[on[:, 1], on[:, 0]].mean()
        ground = np.concatenate([grey[on[:, 1] + d, on[:, 0]] for d in (-10, 10)]).mean()
        factor = (strings / ground) ** 2.2
        look = replace(look, ground=tuple(min(0.9, g * factor) for g in look.ground))
    return look
