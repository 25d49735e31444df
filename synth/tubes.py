"""Rasteriser: strands as chains of short tube pieces, with exact pixel coverage.

Strategy. Every piece gets the camera's affine map at its middle, so a pixel becomes (xi along,
eta across) in mm and the silhouette is |eta| = half width. Coverage is the exact area of the
pixel square beyond that straight edge, no subsamples. Per pixel up to LAYERS fragments are kept;
pieces of one strand that lie close along it are one fragment. Shading comes later, from the
fragments alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from synth.camera import View, project, projection_jacobian, to_camera, towards_viewer

LAYERS = 4
LEAN_LIMIT = 0.45  # cosine of the lean beyond which a piece gets round caps
TURN_LIMIT_RAD = 0.5
CORNER_RAD = 0.15  # a kink of the centre line (at a hole's rim) is kept as it is
MITRE_PX = 0.03  # neighbours overlap by this much, so that no pixel falls between them
SAGITTA_PX = 0.02  # largest gap between a chord and the curved centre line
GROOVE_D = (
    3.0  # string diameters from the apex until the grooves between strands are at their darkest
)


@dataclass(frozen=True)
class Pieces:
    """Tube pieces (K of them) ready to draw; lengths in mm, `mid_px` in pixels.

    `inverse` (K, 2, 2): pixel offset -> (xi, eta). `section` (K, 3): the cross-section's
    q22, q23, q33 in (e2, e3). `axes` (K, 3, 3): e1, e2, towards the viewer, in the camera frame.
    """

    mid_px: np.ndarray
    inverse: np.ndarray
    half_mm: np.ndarray
    lean: np.ndarray  # (K, 2): cos and sin of the tangent's tilt out of the image plane
    near_mm: np.ndarray  # camera z of the middle
    section: np.ndarray
    axes: np.ndarray
    mitre: np.ndarray  # (K, 2): tan of half the turn towards e2, at the start and the end
    steep: np.ndarray  # (K,): turns or leans too sharply for mitres; drawn with round caps
    strand: np.ndarray
    arc_mm: np.ndarray
    outward_mm: np.ndarray  # (K, 3) offset from the bundle's centre line, camera frame
    inside: np.ndarray  # 0 outside the bundle, rising to 1 within its first GROOVE_D diameters


@dataclass(frozen=True)
class Tube:
    """A centre line with its cross-section: half axes along `outward` and across it, in mm."""

    points_mm: np.ndarray
    outward_mm: np.ndarray
    in_bundle: np.ndarray
    half_out_mm: float
    half_side_mm: float
    strand: int


def thin_out(points_mm: np.ndarray, px_per_mm: float) -> np.ndarray:
    """Indices of the points to keep so that chords stay within SAGITTA_PX of the curve."""
    step = np.diff(points_mm, axis=0)
    length = np.linalg.norm(step, axis=1)
    tangent = step / length[:, None]
    turn = np.linalg.norm(np.diff(tangent, axis=0), axis=1)
    curvature = np.empty(len(length))
    curvature[1:] = turn / (0.5 * (length[1:] + length[:-1]))
    curvature[0] = curvature[1] if len(curvature) > 1 else 0.0
    curvature = np.maximum(curvature, 1e-4)
    allowed = np.minimum(np.sqrt(8.0 * SAGITTA_PX / (curvature * px_per_mm)), 2.0)
    cost = np.concatenate([[0.0], np.cumsum(length / allowed)])
    marks = np.arange(0.0, cost[-1], 1.0)
    corners = np.flatnonzero(turn > CORNER_RAD) + 1
    keep = np.unique(np.concatenate([np.searchsorted(cost, marks), corners]))
    return np.append(keep[keep < len(points_mm) - 1], len(points_mm) - 1)


def make_pieces(view: View, tubes: list[Tube]) -> Pieces:
    """Cut the tubes into pieces and give each its local map."""
    columns: list[tuple[np.ndarray, ...]] = []
    for tube in tubes:
        keep = thin_out(tube.points_mm, view.px_per_mm)
        seen = to_camera(view, tube.points_mm[keep])
        outward = tube.outward_mm[keep] @ view.rotation.T
        middle = to_camera(view, _means(tube.points_mm, keep))
        columns.append(_cut(view, tube, seen, middle, outward, tube.in_bundle[keep]))
    return Pieces(*(np.ascontiguousarray(np.concatenate(c)) for c in zip(*columns, strict=True)))


def _means(points: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """Mean place of the curve between kept points: chords through it have no bias inwards."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None]
    total = np.zeros_like(points)
    np.cumsum(0.5 * step * (points[1:] + points[:-1]), axis=0, out=total[1:])
    arc = np.concatenate([[0.0], np.cumsum(step)])[:, None]
    return np.diff(total[keep], axis=0) / np.diff(arc[keep], axis=0)


def _cut(
    view: View,
    tube: Tube,
    seen: np.ndarray,
    middle: np.ndarray,
    outward: np.ndarray,
    inside: np.ndarray,
) -> tuple[np.ndarray, ...]:
    step = np.diff(seen, axis=0)
    length = np.linalg.norm(step, axis=1)
    tangent = step / length[:, None]
    out = 0.5 * (outward[1:] + outward[:-1])
    viewer = towards_viewer(view, middle)
    sin = (tangent * viewer).sum(axis=1)
    flat = tangent - sin[:, None] * viewer
    cos = np.linalg.norm(flat, axis=1)
    lost = cos < 1e-9
    flat[lost] = np.cross(viewer[lost], np.array([0.3, 1.0, 0.1]))
    e1 = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    e2 = np.cross(viewer, e1)
    e3 = cos[:, None] * viewer - sin[:, None] * e1
    forward = projection_jacobian(view, middle) @ np.stack([e1, e2], axis=2)
    mitre, sharp = _mitres(e1, viewer)
    arc = np.cumsum(length) - 0.5 * length
    return (
        project(view, middle),
        np.linalg.inv(forward),
        0.5 * length,
        np.stack([cos, sin], axis=1),
        middle[:, 2],
        _section(tube, tangent, out, e2, e3),
        np.stack([e1, e2, viewer], axis=1),
        mitre,
        sharp | (cos < LEAN_LIMIT),
        np.full(len(length), tube.strand, np.int64),
        arc,
        out,
        _closing_in(inside[1:] & inside[:-1], arc, tube),
    )


def _closing_in(inside: np.ndarray, arc: np.ndarray, tube: Tube) -> np.ndarray:
    """(K,) how far neighbours have closed in: grooves do not darken all at once at the apex."""
    if not inside.any():
        return np.zeros(len(arc))
    depth = (arc - arc[np.argmax(inside)]) / (2.0 * GROOVE_D * tube.half_side_mm)
    share = np.clip(depth, 0.0, 1.0)
    return np.where(inside, share * share * (3.0 - 2.0 * share), 0.0)


def _mitres(e1: np.ndarray, viewer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Neighbouring pieces share out the pixels at the bisector of their projected directions."""
    turn = np.zeros(len(e1) + 1)
    cross = (np.cross(e1[:-1], e1[1:]) * viewer[:-1]).sum(axis=1)
    turn[1:-1] = np.arctan2(cross, (e1[:-1] * e1[1:]).sum(axis=1))
    sharp = np.maximum(np.abs(turn[:-1]), np.abs(turn[1:])) > TURN_LIMIT_RAD
    half = np.tan(0.5 * np.clip(turn, -TURN_LIMIT_RAD, TURN_LIMIT_RAD))
    return np.stack([half[:-1], half[1:]], axis=1), sharp


def _section(
    tube: Tube, tangent: np.ndarray, out: np.ndarray, e2: np.ndarray, e3: np.ndarray
) -> np.ndarray:
    """q22, q23, q33 of the ellipse b^2 r r' + c^2 s s' in the (e2, e3) plane."""
    b, c = tube.half_out_mm, tube.half_side_mm
    count = len(tangent)
    if abs(b - c) < 1e-12:
        return np.tile([b * b, 0.0, b * b], (count, 1))
    radial = out - (out * tangent).sum(axis=1, keepdims=True) * tangent
    size = np.linalg.norm(radial, axis=1, keepdims=True)
    radial = np.where(size > 1e-9, radial / np.maximum(size, 1e-9), e2)
    side = np.cross(tangent, radial)
    r2, r3 = (radial * e2).sum(axis=1), (radial * e3).sum(axis=1)
    s2, s3 = (side * e2).sum(axis=1), (side * e3).sum(axis=1)
    return np.stack(
        [
            b * b * r2 * r2 + c * c * s2 * s2,
            b * b * r2 * r3 + c * c * s2 * s3,
            b * b * r3 * r3 + c * c * s3 * s3,
        ],
        axis=1,
    )


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _half_plane(distance: float, nx: float, ny: float) -> float:
    """Area of a unit pixel on the inner side of an edge `distance` px outside its centre."""
    a, b = abs(nx), abs(ny)
    if a < b:
        a, b = b, a
    outer, inner = 0.5 * (a + b), 0.5 * (a - b)
    if distance >= outer:
        return 0.0
    if distance <= -outer:
        return 1.0
    if distance > inner:
        gap = outer - distance
        return gap * gap / (2.0 * a * b)
    if distance < -inner:
        gap = outer + distance
        return 1.0 - gap * gap / (2.0 * a * b)
    return 0.5 - distance / a


@njit(cache=True, fastmath=True, error_model="numpy")
def rasterise(
    mid_px,
    inverse,
    half_mm,
    lean,
    near_mm,
    section,
    axes,
    mitre,
    steep,
    strand,
    left,
    top,
    depth,
    alpha,
    piece,
):
    """Fill depth, alpha, piece (h, w, LAYERS); (left, top) is the crop's first pixel.

    `piece` must come in as -1, `alpha` as 0, `depth` (nearness, camera z) as -1e9.
    """
    height, width, layers = depth.shape
    for k in range(len(half_mm)):
        q22, q23, q33 = section[k, 0], section[k, 1], section[k, 2]
        hw = np.sqrt(q22)
        rise = q23 / q22
        bulge = np.sqrt(max(q33 - q23 * q23 / q22, 0.0))
        cos, sin = lean[k, 0], lean[k, 1]
        a, b = inverse[k, 0, 0], inverse[k, 0, 1]
        c, d = inverse[k, 1, 0], inverse[k, 1, 1]
        mm_per_px = np.hypot(c, d)
        along_px = np.hypot(a, b)
        hl = half_mm[k] * cos
        solid = hw - 0.75 * mm_per_px
        reach_eta = hw + 0.75 * mm_per_px
        capped = steep[k]
        start, stop = mitre[k, 0], mitre[k, 1]
        overlap = MITRE_PX * along_px
        bow, curvature = 0.0, 0.0
        if capped:
            reach_xi = hl + hw + 0.75 * along_px
        else:
            reach_xi = hl + reach_eta * max(abs(start), abs(stop)) + overlap
            # The piece is a parabola about its mean; the half plane still misses what the
            # outline's own curvature takes from (or adds to) a pixel: kappa / 24.
            curvature = (start + stop) / max(2.0 * hl, 1e-9)
            bow = curvature * mm_per_px * mm_per_px / 24.0
        det = a * d - b * c
        span = (abs(c) * reach_xi + abs(a) * reach_eta) / abs(det)
        x0, y0 = mid_px[k, 0] - left, mid_px[k, 1] - top
        row0 = max(int(np.ceil(y0 - span)), 0)
        row1 = min(int(np.floor(y0 + span)), height - 1)
        nx, ny = c / mm_per_px, d / mm_per_px
        near_pieces = int(3.0 * hw / max(half_mm[k] * 2.0, 1e-6)) + 3
        for row in range(row0, row1 + 1):
            dv = row - y0
            lo, hi = -1e9, 1e9
            if abs(a) > 1e-12:
                p, q = (-reach_xi - b * dv) / a, (reach_xi - b * dv) / a
                lo, hi = max(lo, min(p, q)), min(hi, max(p, q))
            elif abs(b * dv) > reach_xi:
                continue
            if abs(c) > 1e-12:
                p, q = (-reach_eta - d * dv) / c, (reach_eta - d * dv) / c
                lo, hi = max(lo, min(p, q)), min(hi, max(p, q))
            elif abs(d * dv) > reach_eta:
                continue
            col0 = max(int(np.ceil(x0 + lo)), 0)
            col1 = min(int(np.floor(x0 + hi)), width - 1)
            for col in range(col0, col1 + 1):
                du = col - x0
                xi = a * du + b * dv
                eta = c * du + d * dv
                if not capped and (
                    xi > hl - eta * stop + overlap or xi < -hl + eta * start - overlap
                ):
                    continue
                eta -= 0.5 * curvature * (xi * xi - hl * hl / 3.0)
                over = abs(xi) - hl
                if capped and over > 0.0:
                    far = np.sqrt(over * over + eta * eta)
                    out_px = (far - hw) / mm_per_px + mm_per_px / (24.0 * hw)
                    if far > 1e-12:
                        gx = (over * a * (1.0 if xi > 0 else -1.0) + eta * c) / far / mm_per_px
                        gy = (over * b * (1.0 if xi > 0 else -1.0) + eta * d) / far / mm_per_px
                        size = np.sqrt(gx * gx + gy * gy)
                        cover = _half_plane(out_px / size, gx / size, gy / size)
                    else:
                        cover = 1.0
                elif abs(eta) < solid:
                    cover = 1.0
                else:
                    edge = hw if eta > 0.0 else -hw
                    curve = bow / max(1.0 - curvature * edge, 0.3)
                    outside = abs(eta) - hw - (curve if eta > 0.0 else -curve)
                    cover = _half_plane(outside / mm_per_px, nx, ny)
                    if hw < 1.5 * mm_per_px:
                        # a thin fibre: the far edge cuts the pixel too
                        cover -= _half_plane((abs(eta) + hw) / mm_per_px, nx, ny)
                if cover <= 1e-4:
                    continue
                share = min(abs(eta) / hw, 1.0)
                h = eta * rise + bulge * np.sqrt(1.0 - share * share)
                if cos > 1e-6:
                    along = (xi + h * sin) / cos
                else:
                    along = 1e9 if xi + h * sin > 0 else -1e9
                if capped and (along > half_mm[k] or along < -half_mm[k]):
                    along = half_mm[k] if along > 0 else -half_mm[k]
                    gap = xi - along * cos
                    square = hw * hw - eta * eta - gap * gap
                    lift = along * sin + (np.sqrt(square) if square > 0.0 else 0.0)
                else:
                    lift = along * sin + h * cos
                z = near_mm[k] + xi * axes[k, 0, 2] + eta * axes[k, 1, 2] + lift * axes[k, 2, 2]
                _insert(depth, alpha, piece, strand, row, col, z, cover, k, near_pieces, layers)


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _insert(depth, alpha, piece, strand, row, col, z, cover, k, near_pieces, layers):
    free = -1
    farthest, worst = 0, 1e18
    for n in range(layers):
        other = piece[row, col, n]
        if other < 0:
            free = n
            break
        if strand[other] == strand[k] and abs(other - k) <= near_pieces:
            # the same stretch of one strand: one surface
            old = alpha[row, col, n]
            if cover > old + 0.02 or (cover > old - 0.02 and z > depth[row, col, n]):
                depth[row, col, n] = z
                piece[row, col, n] = k
            if cover > old:
                alpha[row, col, n] = cover
            return
        if depth[row, col, n] < worst:
            worst, farthest = depth[row, col, n], n
    if free < 0:
        if z <= worst:
            return
        free = farthest
    depth[row, col, free] = z
    alpha[row, col, free] = cover
    piece[row, col, free] = k
