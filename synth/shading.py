"""From fragments to light: shades each visible piece and lays the layers over the background.

All colours are linear light. The key light is directional, so every strand has a lit and a shadow
side; grooves between strands darken; a braid darkens fine diagonals.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def _covered_part(share, half):  # pragma: no cover - compiled
    """Part of a pixel at `share` of the half width that lies on the strand, in half widths."""
    low, high = max(share - half, -1.0), min(share + half, 1.0)
    if high - low < 1e-3:
        low = min(max(share, -1.0), 0.999)
        high = low + 1e-3
    return low, high


@njit(cache=True, error_model="numpy")
def _mean_height(low, high):  # pragma: no cover - compiled
    """Mean of sqrt(1 - x^2) over low..high."""
    upper = high * np.sqrt(max(1.0 - high * high, 0.0)) + np.arcsin(high)
    lower = low * np.sqrt(max(1.0 - low * low, 0.0)) + np.arcsin(low)
    return 0.5 * (upper - lower) / (high - low)


@njit(cache=True, error_model="numpy")
def _groove(outwards, reach):  # pragma: no cover - compiled
    """How far a point of the bundle's surface lies in a groove, 0..1.

    outwards: cosine between the surface's normal and the direction away from the bundle's axis,
    low where a strand faces its neighbour; reach: distance from the axis over the outer radius,
    low on the core strands. The front and the limb of an outer strand lie open.
    """
    step = min(max((outwards * min(reach / 0.65, 1.0) + 0.2) / 0.85, 0.0), 1.0)
    return 1.0 - step * step * (3.0 - 2.0 * step)


@njit(cache=True, fastmath=True, error_model="numpy")
def composite(
    depth,
    alpha,
    piece,
    mid_px,
    inverse,
    lean,
    section,
    axes,
    strand,
    arc_mm,
    outward_mm,
    inside,
    left,
    top,
    outer_mm,
    fibre_id,
    colours,
    key,
    key_strength,
    ambient,
    specular,
    gloss,
    occlusion,
    braid,
    rim,
    light_dx,
    light_dy,
    image_w,
    image_h,
    front_rgb,
    front_alpha,
    front_near,
    image,
    covered,
    ids,
):
    """`image` (h, w, C) comes in as the ground and goes out composed; `front_*` is the hardware.

    `covered` (h, w): share of the pixel that strands cover (hardware not counted); `ids` (h, w):
    1 + strand seen there, 0 where none.
    """
    height, width, layers = depth.shape
    channels = image.shape[2]
    half = np.empty(3)
    sx, sy = key[0], key[1]
    half[0], half[1], half[2] = sx, sy, key[2] + 1.0
    half /= np.sqrt((half**2).sum())
    order = np.empty(layers, np.int64)
    colour = np.empty(3)
    for row in range(height):
        for col in range(width):
            count = 0
            for n in range(layers):
                if piece[row, col, n] >= 0:
                    order[count] = n
                    count += 1
                else:
                    break
            hard = front_alpha[row, col]
            if count == 0 and hard <= 0.0:
                continue
            for i in range(1, count):
                m = order[i]
                j = i - 1
                while j >= 0 and depth[row, col, order[j]] < depth[row, col, m]:
                    order[j + 1] = order[j]
                    j -= 1
                order[j + 1] = m
            open_share = 1.0
            strands = 1.0
            last_x, last_y = 0.0, 0.0
            hard_done = hard <= 0.0
            for ch in range(channels):
                colour[ch] = 0.0
            strongest = 0.0
            for i in range(count + 1):
                if not hard_done and (
                    i == count or front_near[row, col] > depth[row, col, order[i]]
                ):
                    for ch in range(channels):
                        colour[ch] += open_share * hard * front_rgb[row, col, ch]
                    open_share *= 1.0 - hard
                    hard_done = True
                if i == count:
                    break
                n = order[i]
                k = piece[row, col, n]
                cover = alpha[row, col, n]
                ex, ey = inverse[k, 1, 0], inverse[k, 1, 1]
                norm = np.sqrt(ex * ex + ey * ey)
                du, dv = col + left - mid_px[k, 0], row + top - mid_px[k, 1]
                xi = inverse[k, 0, 0] * du + inverse[k, 0, 1] * dv
                eta = inverse[k, 1, 0] * du + inverse[k, 1, 1] * dv
                norm = norm if eta > 0.0 else -norm
                ex, ey = ex / norm, ey / norm
                # Edges that face the same way overlap, edges that face each other add up.
                taken = 1.0 - strands
                union = 1.0 - strands * (1.0 - cover)
                if 0.0 < taken < 0.999 and cover < 0.999:
                    alike = 0.5 + 0.5 * (ex * last_x + ey * last_y)
                    union = alike * max(taken, cover) + (1.0 - alike) * min(1.0, taken + cover)
                last_x, last_y = ex, ey
                if strands > 1e-6:
                    cover = (union - taken) / strands
                q22, q23, q33 = section[k, 0], section[k, 1], section[k, 2]
                hw = np.sqrt(q22)
                # Towards the limb the normal turns fast: a pixel shows the mean over its covered
                # part, not the value in its middle, which would darken every edge.
                low_share, high_share = _covered_part(eta / hw, 0.5 * abs(norm) / hw)
                share = 0.5 * (low_share + high_share)
                rise = _mean_height(low_share, high_share)
                flat = max(q33 - q23 * q23 / q22, 1e-12)
                h2, h3 = share * hw, share * hw * q23 / q22 + np.sqrt(flat) * rise
                # outward normal of the ellipse: Q^-1 (h2, h3)
                det = q22 * q33 - q23 * q23
                n2 = (q33 * h2 - q23 * h3) / det
                n3 = (-q23 * h2 + q22 * h3) / det
                size = np.sqrt(n2 * n2 + n3 * n3)
                n2, n3 = n2 / size, n3 / size
                cos, sin = lean[k, 0], lean[k, 1]
                nx = n2 * axes[k, 1, 0] + n3 * (cos * axes[k, 2, 0] - sin * axes[k, 0, 0])
                ny = n2 * axes[k, 1, 1] + n3 * (cos * axes[k, 2, 1] - sin * axes[k, 0, 1])
                nz = n2 * axes[k, 1, 2] + n3 * (cos * axes[k, 2, 2] - sin * axes[k, 0, 2])
                diffuse = max(nx * sx + ny * sy + nz * key[2], 0.0)
                shine = max(nx * half[0] + ny * half[1] + nz * half[2], 0.0) ** gloss
                sky = ambient * (0.75 + 0.25 * ny)
                deep = 1.0
                if inside[k] > 0.0 and outer_mm > 0.0:
                    px = outward_mm[k, 0] + hw * nx
                    py = outward_mm[k, 1] + hw * ny
                    pz = outward_mm[k, 2] + hw * nz
                    size = np.sqrt(px * px + py * py + pz * pz)
                    outwards = (px * nx + py * ny + pz * nz) / max(size, 1e-9)
                    deep = 1.0 - inside[k] * occlusion * _groove(outwards, size / outer_mm)
                u = (col + left) / image_w - 0.5
                v = (row + top) / image_h - 0.5
                lit = max(1.0 + light_dx * u + light_dy * v, 0.05)
                weave = 1.0
                if braid > 0.0 and strand[k] < fibre_id:
                    along = arc_mm[k] + (xi / max(cos, 0.2))
                    turn = np.arctan2(n2, n3)
                    wave = 2.0 * np.pi * along / (5.2 * hw)
                    one = abs(np.sin(wave + 1.5 * turn))
                    two = abs(np.sin(wave - 1.5 * turn))
                    weave = 1.0 - braid * (1.0 - min(one, two)) ** 4
                edge = rim * (1.0 - max(nz, 0.0)) ** 3
                base = strand[k] % fibre_id % colours.shape[0]
                for ch in range(channels):
                    glow = colours[base, ch] * weave * deep * lit * (key_strength * diffuse + sky)
                    glow += deep * lit * specular * shine + edge
                    colour[ch] += open_share * cover * glow
                if strand[k] < fibre_id and open_share * cover > strongest:
                    strongest = open_share * cover
                    ids[row, col] = 1 + strand[k]
                open_share *= 1.0 - cover
                if strand[k] < fibre_id:
                    strands = 1.0 - union
            covered[row, col] = 1.0 - strands
            if hard > 0.0 and strongest < 0.5 * hard:
                ids[row, col] = 0
            for ch in range(channels):
                image[row, col, ch] = image[row, col, ch] * open_share + colour[ch]
