"""Figures of docs/measuring/, drawn by the code: `python -m tests.bench.measuring_figures`."""

# ruff: noqa: E402 - the thread counts must be set before numpy and numba are imported
from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.ndimage import gaussian_filter1d

from tests.bench.pictures48_draw import cases, draw
from tsvision.measures.edges.cut import cut_frame
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import EdgeProfile
from tsvision.measures.helix.bundle import fit_window
from tsvision.measures.helix.silhouette import model_edges
from tsvision.measures.helix.windows import near_window
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.looks import Looks, learn_looks
from tsvision.records import Rig, Scale, Strings, View

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "measuring"


def save(figure: plt.Figure, name: str) -> None:
    """As a small PNG."""
    figure.savefig(FOLDER / name, dpi=90, bbox_inches="tight")
    plt.close(figure)


def pictures() -> None:
    """Four of the benchmark's pictures."""
    figure, axes = plt.subplots(2, 2, figsize=(9, 5.2))
    for axis, (strings, index) in zip(axes.flat, ((2, 1), (4, 11), (6, 20), (8, 46)), strict=True):
        case = cases(strings)[index]
        axis.imshow(draw(case)[::2, ::2], cmap="gray", vmin=0, vmax=255)
        axis.set_title(
            f"N = {strings}, D = {case.diameter_px:.1f} px, β = {case.beta_deg:.0f}°, "
            f"noise {100 * case.noise:.0f} %",
            fontsize=9,
        )
        axis.axis("off")
    save(figure, "pictures.png")


def learnt(picture: np.ndarray, strings: int) -> Looks:
    """Looks of one picture."""
    rig = Rig(strings=Strings(count=strings), view=View(separator_side="none"))
    looks = learn_looks([picture], rig, Scale())
    if looks is None:
        raise SystemExit("no bundle found")
    return looks


def strip() -> None:
    """The straightened strip, the edges of every column, and the silhouette fitted to them."""
    case = cases(2)[42]
    picture = draw(case)
    looks = learnt(picture, 2)
    cut = cut_frame(picture, looks.sight, looks.diameter_px / 2.0, looks.half_px)
    assert cut is not None
    edges = find_edges(cut, looks.shading)
    window = near_window(cut, looks.diameter_px)
    assert window is not None
    low, high = window
    fit = fit_window(edges, looks.section, low, high, looks.diameter_px, float("nan"))
    assert fit is not None
    s = np.arange(fit.s_low_px, fit.s_high_px + 0.5)
    upper, lower = model_edges(fit.fit.p, fit.fit.section, s[0] - fit.middle_px, s.size)
    figure, axes = plt.subplots(2, 1, figsize=(9, 4.6), sharex=True)
    extent = (cut.s_px[0], cut.s_px[-1], cut.half_px, -cut.half_px)
    axes[0].imshow(cut.light, cmap="gray", extent=extent, aspect="auto")
    axes[0].plot(s, upper, "C1", s, lower, "C1", lw=1)
    axes[0].set_ylabel("n, px")
    for side, weight, model in (
        (edges.upper_px, edges.upper_weight, upper),
        (edges.lower_px, edges.lower_weight, lower),
    ):
        here = (edges.s_px >= s[0] - 0.5) & (edges.s_px <= s[-1] + 0.5) & (weight > 0)
        axes[1].plot(edges.s_px[here], (side[here] - np.interp(edges.s_px[here], s, model)), lw=0.8)
    axes[1].set_ylim(-1, 1)
    axes[1].set_ylabel("edge − fit, px")
    axes[1].set_xlabel("s along the axis, px")
    axes[0].set_xlim(s[0] - 60, s[-1] + 60)
    save(figure, "strip.png")


def lambert(offsets: np.ndarray, rho: float, angle_deg: float) -> np.ndarray:
    """A tube's brightness inside its edge, blurred by 1 px, under a lamp 50 degrees wide that
    stands `angle_deg` from the camera: neither a point nor all around, as the models have it."""
    t = np.arange(-14.0, 30.0, 0.01)
    x = np.clip(1.0 - t / rho, -1.0, 1.0)
    turn = np.deg2rad(angle_deg + np.linspace(-25.0, 25.0, 11))[:, None]
    key = np.maximum(np.cos(turn) * np.sqrt(1.0 - x * x) + np.sin(turn) * x, 0.0).mean(axis=0)
    return np.interp(offsets, t, gaussian_filter1d(np.where(t >= 0, 0.2 + 0.8 * key, 0.0), 100.0))


def edge() -> None:
    """Profiles across the edge of a round strand: where its half level lies, where its edge is."""
    rho = 10.0
    offsets = np.arange(-5.0, 0.85 * rho, 0.25)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2))
    for angle in (-40, -20, 0, 20, 40):
        axes[0].plot(offsets, lambert(offsets, rho, angle), label=f"{angle:+d}°")
    axes[0].axvline(0.0, color="k", lw=0.6)
    axes[0].legend(title="lamp", fontsize=8)
    axes[0].set_xlabel("px inside the true edge")
    axes[0].set_ylabel("linear light")
    angles = np.arange(-44, 45, 4)
    half, model = [], []
    for lamp in angles:
        pair = (lambert(offsets, rho, float(lamp)), lambert(offsets, rho, float(-lamp)))
        half.append(float(np.interp(0.5 * pair[0].max(), pair[0], offsets)))
        means = [
            np.mean([lambert(offsets + d, rho, float(at)) for d in np.linspace(-0.5, 0.5, 21)], 0)
            for at in (lamp, -lamp)
        ]  # as mean profiles are: over a px
        seen = [EdgeProfile(offsets, p, np.full(p.size, 0.002)) for p in means]
        model.append(float(fit_shading((seen[0], seen[1]), rho)[2][0]))
    worst = np.abs(model)[angles >= 0].max(), np.abs(model)[angles < 0].max()
    print(f"edge model: {worst[0]:.2f} px on the lit side, {worst[1]:.2f} px on the shadow side")
    axes[1].plot(angles, half, label="half level")
    axes[1].plot(angles, model, label="shading model")
    axes[1].axhline(0.0, color="k", lw=0.6)
    axes[1].set_xlabel("lamp, degrees from the camera")
    axes[1].set_ylabel("edge found − true, px (inwards > 0)")
    axes[1].legend(fontsize=8)
    figure.tight_layout()
    save(figure, "edge.png")


def main() -> None:
    """Write all figures."""
    FOLDER.mkdir(exist_ok=True)
    pictures()
    strip()
    edge()
    print(f"wrote {sum(p.stat().st_size for p in FOLDER.glob('*.png')) // 1024} KiB")


if __name__ == "__main__":
    main()
