"""A recording on disk: frames, turns.csv, rig.toml, truth.parquet, truth_profiles.parquet,
truth.json.

Strategy: frame by frame, nothing kept but the scalars of the truth, so memory does not grow with
the recording.
"""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from synth.actuator import state_at
from synth.camera import View
from synth.effects import stated_zone_mm
from synth.frames import id_map_name, open_frames
from synth.phases import onset
from synth.render import Scene, make_scene
from synth.settings import Settings
from synth.strands import hole_diameter_mm, strand_paths
from synth.truth import FrameTruth, frame_truth, hardware_truth, scale_at
from synth.validate import check
from tsvision.staging import Kind, check_out, staged

Progress = Callable[[int, int], None]
_TRUTH = "truth.json"
_FORMAT = "tsvision synthetic recording"
_ALWAYS_THERE = ("turns.csv", "rig.toml", "truth.parquet", "truth_profiles.parquet", _TRUTH)
_FRAME_FILE = re.compile(r"frame_\d{5,}\.(png|jpg|tif)|recording\.mp4")
_ORDER = ("twist", "overtwist", "local overtwist", "knotted", "irreversible")


def write_recording(
    out: Path | str,
    settings: Settings,
    overwrite: bool = False,
    progress: Progress | None = None,
    with_ids: bool = False,
) -> Path:
    """Render `settings` into the folder `out` and return it.

    `progress(done, total)` is called after every frame. `with_ids` writes the strand id map of
    every frame (0 none, k strand k) as `truth_ids/*.png`. Raises InputError on a parameter out of
    bounds, on an existing folder without `overwrite` or of something else, or when a turn count
    cannot be held.
    """
    check(settings)
    target = Path(out)
    check_out(target, RECORDING, overwrite)
    with staged(target, RECORDING) as folder:
        _write_all(folder, settings, progress, with_ids)
    return target


def _own_names(folder: Path) -> frozenset[str]:
    """What was rendered into a folder, as its truth lists it; frames by other names are others'."""
    try:
        story = json.loads((folder / _TRUTH).read_bytes())
        if not str(story["format"]).startswith(_FORMAT):
            return frozenset()
        numbers = [int(frame["frame"]) for frame in story["frames"]]
        files = [str(frame["file"]) for frame in story["frames"]]
    except (OSError, ValueError, TypeError, LookupError):
        return frozenset()
    frames = [name for name in files if _FRAME_FILE.fullmatch(name)]
    ids = [id_map_name(number) for number in numbers]
    return frozenset({*_ALWAYS_THERE, *frames, *ids})


RECORDING = Kind("rendered recording", _TRUTH, _own_names)


def _write_all(folder: Path, settings: Settings, progress: Progress | None, with_ids: bool) -> None:
    scene = make_scene(settings)
    total = len(settings.turns)
    rows, knots = [], []
    profiles: pq.ParquetWriter | None = None
    with open_frames(folder, settings, scene, with_ids) as frames:
        for index in range(total):
            state = state_at(settings, index)
            paths = strand_paths(settings, state)
            name = frames.write(state, paths, index)
            truth = frame_truth(settings, scene.view, state, index, paths)
            rows.append({**truth.row, "file": name})
            knots.append(truth.knots)
            table = _profile_table(truth, scene.view, index)
            if profiles is None:
                profiles = pq.ParquetWriter(folder / "truth_profiles.parquet", table.schema)
            profiles.write_table(table)
            if progress:
                progress(index + 1, total)
    if profiles is not None:
        profiles.close()
    frame_table = pd.DataFrame(rows)
    frame_table.to_parquet(folder / "truth.parquet", index=False)
    _turns_table(settings, frame_table).to_csv(folder / "turns.csv", index=False)
    (folder / "rig.toml").write_text(rig_text(settings, scene))
    story = truth_story(settings, scene, frame_table, knots)
    (folder / _TRUTH).write_text(json.dumps(story, indent=1, default=_plain))


def _profile_table(truth: FrameTruth, view: View, index: int) -> pa.Table:
    """The outline's rows; `mask` is True where both edges lie inside the picture."""
    seen = np.isfinite(truth.upper_px)
    row = truth.row
    start = np.array([row["axis_x0_px"], row["axis_y0_px"]])
    along = np.array([row["axis_x1_px"], row["axis_y1_px"]]) - start
    along /= np.linalg.norm(along)
    across = np.array([-along[1], along[0]])
    inside = np.ones(int(seen.sum()), bool)
    for edge in (truth.upper_px, truth.lower_px):
        place = start + truth.s_px[seen, None] * along + edge[seen, None] * across
        inside &= ((place >= 0) & (place <= [view.width - 1, view.height - 1])).all(axis=1)
    return pa.table(
        {
            "frame": np.full(int(seen.sum()), index, np.int32),
            "s_px": truth.s_px[seen].astype(np.float32),
            "s_mm": truth.s_mm[seen].astype(np.float32),
            "upper_px": truth.upper_px[seen].astype(np.float32),
            "lower_px": truth.lower_px[seen].astype(np.float32),
            "envelope_mm": truth.envelope_mm[seen].astype(np.float32),
            "mask": inside,
        }
    )


def times_s(settings: Settings) -> np.ndarray:
    """Time of each frame at a steady motor speed."""
    turns = np.array(settings.turns)
    return np.cumsum(np.abs(np.diff(turns, prepend=turns[:1]))) * settings.seconds_per_turn


def _turns_table(settings: Settings, truth: pd.DataFrame) -> pd.DataFrame:
    random = np.random.default_rng([settings.seed, 17])
    noise = settings.displacement_noise_mm * random.standard_normal(len(truth))
    return pd.DataFrame(
        {
            "frame": truth["frame"],
            "file": truth["file"],
            "turns": truth["turns"],
            "time_s": times_s(settings).round(4),
            "displacement_mm": (truth["displacement_mm"] + noise).round(4),
            "load_N": settings.actuator.load_N,
        }
    )


def stated_mm_per_px(settings: Settings, scene: Scene) -> float:
    """The scale that the rig file gives: at the axis in mid view, planted error in."""
    middle = float(scene.view.look_mm[0])
    return scale_at(scene.view, middle)[1] / (1.0 + settings.hidden.camera_scale_error)


def rig_text(settings: Settings, scene: Scene) -> str:
    """rig.toml: stated values only; planted effects are not among them."""
    strings, actuator = settings.strings, settings.actuator
    return f"""\
[strings]
count = {strings.count}
diameter_mm = {strings.diameter_mm:g}
[actuator]
twisting_zone_mm = {stated_zone_mm(settings):g}
hole_distance_mm = {actuator.hole_distance_mm:g}
hole_diameter_mm = {hole_diameter_mm(settings):g}
load_N = {actuator.load_N:g}
[camera]
mm_per_px = {stated_mm_per_px(settings, scene):.7g}
gamma = {settings.sensor.gamma:g}
[view]
separator_side = "auto"
"""


def truth_story(
    settings: Settings, scene: Scene, frames: pd.DataFrame, knots: list[list[dict[str, float]]]
) -> dict[str, object]:
    """truth.json: what was rendered, the onsets, the hardware in px, and every frame."""
    records = frames.to_dict("records")
    return {
        "format": f"{_FORMAT}, version 1",
        "made_by": f"tsvision {version('tsvision')}",
        "conventions": CONVENTIONS,
        "settings": dataclasses.asdict(settings),
        "onsets": onsets(settings, frames),
        "hardware": hardware_truth(settings, scene.view),
        "stated_mm_per_px": stated_mm_per_px(settings, scene),
        "frames": [{**r, "knots": k} for r, k in zip(records, knots, strict=True)],
    }


CONVENTIONS = {
    "pixels": "pixel centres at integer coordinates, x right, y down",
    "profiles": "truth_profiles.parquet: s_px along the line axis0 -> axis1 (separator face to "
    "connector face); upper_px and lower_px are the largest and smallest signed distance of the "
    "strands' outline from that line along n = (-u_y, u_x), as in a measurement's profiles "
    "(with the separator on the left upper is down in the picture); twisted part only",
    "envelope_mm": "E(s) = D + 2 R(s), R the largest distance of the bundle's centre line from the "
    "zone's straight axis within one silhouette period",
    "coil_amplitude_mm": "rms distance of the bundle's centre line from the zone's axis over the "
    "twisted part (for a uniform coil: its radius)",
    "diameter_mm": "smallest cylinder about the bundle's own centre line over the first pitch "
    "after the apex; diameter_laid_mm is the section as laid, before contact in a coil widens it; "
    "diameter_near_largest_mm holds the whole near-separator region",
    "pitch_mm": "along the bundle's own centre line",
    "displacement_mm": "as recorded (law and planted effects); scene_displacement_mm = mean strand "
    "length in the zone - L is what the picture holds",
    "turn budget": "turns = turns_lost + turns_in_legs + turns_of_strands + turns_of_centre_line",
    "masks": "mask_diameter, mask_pitch, mask_apex, mask_full_zone, and mask in truth_profiles: "
    "where a comparison is fair",
    "handedness": "Z: right-handed helix",
}


def onsets(settings: Settings, frames: pd.DataFrame) -> dict[str, Any]:
    """Onset of each phase over the winding part, refined between frames by bisection."""
    turns = frames["turns"].to_numpy(float)
    if not len(turns):
        return {}
    stop = int(np.abs(turns).argmax()) + 1
    level = frames["phase"].map(_ORDER.index).to_numpy()[:stop]
    stuck = frames["irreversible"].to_numpy(bool)[:stop]
    found: dict[str, Any] = {}
    for name, present in (
        ("overtwist_onset", level >= 1),
        ("local_overtwist_onset", level >= 2),
        ("knot_onset", level >= 3),
        ("irreversible_onset", stuck),
    ):
        found[name] = _refined(settings, name, onset(turns[:stop], present))
    return found


def _refined(settings: Settings, name: str, rough: dict[str, object]) -> dict[str, object]:
    """`exact_turns`: where the criterion is first met between the two frames."""
    before, after = rough.get("after_turns"), rough["turns"]
    if not isinstance(before, float) or not isinstance(after, float):
        return rough
    sign = np.sign(sum(settings.turns)) or 1.0
    low, high = before, after
    for _ in range(9):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _present(settings, name, sign * middle) else (middle, high)
    return {**rough, "exact_turns": round(high, 3)}


def _present(settings: Settings, name: str, turns: float) -> bool:
    from synth.phases import phase_of
    from synth.truth import envelope_of

    probe = dataclasses.replace(settings, turns=(0.0, turns))
    state = state_at(probe, 1)
    envelope = envelope_of(probe, state)
    if envelope is None:
        return False
    if name == "irreversible_onset":
        hole = hole_diameter_mm(settings)
        return any(knot.max_diameter_mm > hole for knot in envelope.knots)
    amplitude = float(np.sqrt(np.mean(state.line.radius_mm**2)))
    wanted = {"overtwist_onset": 1, "local_overtwist_onset": 2, "knot_onset": 3}[name]
    return _ORDER.index(phase_of(envelope, amplitude, state.diameter_mm)) >= wanted


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value)} is not JSON")
