"""A stretch of bundle whose coil grows or shrinks within it: its outline, and a fit of that.

The centre line swings about the axis with a radius that is a spline along it. The strands, as thick
and as twisted per length of bundle all along it, for a bundle passes its torque on, are laid about
that line on the frame that the smallest rotation turns from the axis onto its tangent. Their angle
in that frame is the one in the picture: it counts the turns, however wide the coil is.

Parameters, in px and rad, z running along the axis from the middle of the stretch:
  rho         strand radius
  twist       of the strands, per px of bundle
  chi, theta  angle of the strands in the picture and of the coil, at z = 0
  y0, slope   of the axis
  kc, kc1     rate of the coil at z = 0, and by how much it is more where the stretch ends
  r (n,)      radius of the coil: coefficients of a uniform cubic spline, whose n - 3 pieces fill
              the stretch; beyond it is as at its ends
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from tsvision.measures.helix import silhouette as helix
from tsvision.measures.helix.fit import sum_of_products
from tsvision.measures.helix.silhouette import (
    border,
    draw_outermost,
    give_of,
    given,
    twist,
)

RHO, TWIST, CHI, THETA, Y0, SLOPE, KC, KC1, R = range(9)
LEAST_GAIN = 1e-3  # of what is left, by which a step has to better a fit to be worth its time
STEPS_ON = 8  # in which angles are carried on to the next stretch


class Strands(NamedTuple):
    """away_d, angle_rad (N,): strand centres, in units of d; give (N, 2, 5) and crowd: what they
    give in a coil, and the share of it that they do (`helix.silhouette`)."""

    away_d: np.ndarray
    angle_rad: np.ndarray
    give: np.ndarray
    crowd: float


class Drawn(NamedTuple):
    """A stretch drawn: upper, lower (M,) and where they touch which strand (M, 2); at `first`,
    `first` + `step`, ... the strands' angle chi (S,), and its derivatives (S, 3 + n) by twist, kc,
    kc1 and radii."""

    upper: np.ndarray
    lower: np.ndarray
    at_upper: np.ndarray
    at_lower: np.ndarray
    first: float
    step: float
    chi: np.ndarray
    of_chi: np.ndarray


@numba.njit(cache=True)
def even(p, radii):  # pragma: no cover - compiled
    """Parameters (8 + n,) of a stretch that coils evenly (12,)."""
    q = np.full(R + radii, p[helix.RC])
    q[RHO], q[TWIST] = p[helix.RHO], twist(p)
    q[CHI], q[THETA] = p[helix.PHI] + p[helix.PHIC] + np.pi, p[helix.PHIC]
    q[Y0], q[SLOPE], q[KC], q[KC1] = p[helix.Y0], p[helix.SLOPE], p[helix.KC], 0.0
    return q


@numba.njit(cache=True)
def in_the_middle(p, like):  # pragma: no cover - compiled
    """Parameters (12,) of the even coil that a stretch is like in its middle, `like` (12,) in what
    it does not tell."""
    q = like.copy()
    radius, theta = _radius_at(p, 0.0, 1.0), p[THETA]
    if radius < 0.0:  # a waist was passed on the axis' other side
        radius, theta = -radius, theta + np.pi
    q[helix.RHO], q[helix.PHI], q[helix.PHIC] = p[RHO], p[CHI] - theta - np.pi, theta
    q[helix.RC], q[helix.KC] = radius, p[KC]
    q[helix.Y0], q[helix.SLOPE] = p[Y0], p[SLOPE]
    q[helix.K] = _rate(p[TWIST], p[KC], radius) - p[KC]
    return q


@numba.njit(cache=True)
def onward(p, off, half):  # pragma: no cover - compiled
    """Parameters of a stretch `half` long to either side whose middle lies `off` further on."""
    q = p.copy()
    pieces = p.size - R - 3
    for k in range(pieces + 3):
        q[R + k] = _radius_at(p, off + (2.0 * (k - 1) / pieces - 1.0) * half, half)
    q[Y0] += p[SLOPE] * off
    q[THETA] += (p[KC] + 0.5 * p[KC1] * off / half) * off
    q[KC] += p[KC1] * off / half
    for k in range(STEPS_ON):
        z = (k + 0.5) / STEPS_ON * off
        rate = p[KC] + p[KC1] * z / half
        q[CHI] += _rate(p[TWIST], rate, _radius_at(p, z, half)) * off / STEPS_ON
    return q


@numba.njit(cache=True)
def _rate(twisted, rate, radius):  # pragma: no cover - compiled
    """Of strands and coil together, rad per px of the axis."""
    length = np.sqrt(1.0 + (radius * rate) ** 2)
    return twisted * length + rate * (1.0 - 1.0 / length)


@numba.njit(cache=True)
def _spline(z, half, pieces):  # pragma: no cover - compiled
    """Of a cubic spline at z: the first coefficient that counts, and the weights of it and the next
    three in its value and its slope."""
    spacing = 2.0 * half / pieces
    t = (z + half) / spacing
    inside = 0.0 <= t <= pieces
    t = min(max(t, 0.0), float(pieces))
    j = min(int(t), pieces - 1)
    f = t - j
    g = 1.0 - f
    values = (
        g * g * g / 6.0,
        (4.0 + 3.0 * f * f * (f - 2.0)) / 6.0,
        (4.0 + 3.0 * g * g * (g - 2.0)) / 6.0,
        f * f * f / 6.0,
    )
    by = 0.5 / spacing if inside else 0.0
    slopes = (-g * g * by, (3.0 * f - 4.0) * f * by, (4.0 - 3.0 * g) * g * by, f * f * by)
    return j, values, slopes


@numba.njit(cache=True)
def _radius_at(p, z, half):  # pragma: no cover - compiled
    j, values, _ = _spline(z, half, p.size - R - 3)
    return sum_of_four(p, R + j, values)


@numba.njit(cache=True)
def sum_of_four(p, first, weights):  # pragma: no cover - compiled
    """Of p from `first` on."""
    return (
        p[first] * weights[0]
        + p[first + 1] * weights[1]
        + p[first + 2] * weights[2]
        + p[first + 3] * weights[3]
    )


@numba.njit(cache=True)
def _line(p, z, half):  # pragma: no cover - compiled
    """The centre line at z: its coefficients (`_spline`), radius, rate of the coil, cosine and sine
    of its angle, and how fast the line goes on, aside and in depth."""
    j, values, slopes = _spline(z, half, p.size - R - 3)
    radius, slope = sum_of_four(p, R + j, values), sum_of_four(p, R + j, slopes)
    theta = p[THETA] + (p[KC] + 0.5 * p[KC1] * z / half) * z
    rate = p[KC] + p[KC1] * z / half
    ct, st = np.cos(theta), np.sin(theta)
    dy, dz = slope * ct - radius * rate * st, slope * st + radius * rate * ct
    return j, values, slopes, radius, rate, ct, st, dy, dz


@numba.njit(cache=True, inline="always")
def _offset(away, crowd, share, c, s, ct, st):  # pragma: no cover - compiled
    """Of a strand in the frame, two ways, that lies `away` and gives `crowd` (px) times its share;
    cosines and sines of its angle and the coil's there."""
    # From the bend's inner side: against the coil's own direction.
    more, more_on, _, _ = given(share, -(c * ct + s * st), -(s * ct - c * st))
    out, on = away + crowd * more, crowd * more_on
    return out * c - on * s, out * s + on * c


@numba.njit(cache=True, error_model="numpy")
def drawn(p, strands, z0, count, step):  # pragma: no cover - compiled
    """The outline (`Drawn`) at z0, z0 + 1, ..., z0 + count - 1 = -z0."""
    half = abs(z0)
    reach = 0.0
    for i in range(strands.away_d.size):
        off = strands.away_d[i]
        for k in range(5):
            off += abs(strands.crowd * strands.give[i, 0, k])
        reach = max(reach, p[RHO] * (1.0 + 2.0 * off) + 2.0 * step)
    samples = int((count + 2.0 * reach) / step) + 2
    first = z0 - reach
    radii = p.size - R
    chi, of_chi = np.zeros(samples), np.zeros((samples, radii + 3))
    # Of the centre line: y; how fast y and depth go on; how far behind and below a strand comes to
    # lie for every px that its place leans forward; cosine and sine of the coil's angle and of the
    # strands'.
    line = np.empty((9, samples))
    y, by_y, by_depth, by_s, by_h, cos_t, sin_t, cos_c, sin_c = line
    before, now = np.zeros(radii + 3), np.zeros(radii + 3)
    rate_before = 0.0
    for j in range(samples):
        z = first + j * step
        k, values, slopes, radius, coil, ct, st, dy, dz = _line(p, z, half)
        length = np.sqrt(1.0 + dy * dy + dz * dz)
        y[j], by_y[j], by_depth[j], cos_t[j], sin_t[j] = radius * ct, dy, dz, ct, st
        by_s[j], by_h[j] = 1.0 / length, dy / (length * (length + 1.0))
        turned = radius * coil
        wound = np.sqrt(1.0 + turned * turned)
        rate = p[TWIST] * length + coil * (1.0 - 1.0 / wound)
        slope = sum_of_four(p, R + k, slopes)
        of_turned = turned * (p[TWIST] / length + coil / (wound * wound * wound))
        before, now = now, before
        now[0] = length
        now[1] = of_turned * radius + 1.0 - 1.0 / wound
        now[2] = now[1] * z / half
        for m in range(radii):
            now[3 + m] = 0.0
        for m in range(4):
            now[3 + k + m] = of_turned * coil * values[m] + p[TWIST] * slope / length * slopes[m]
        if j > 0:
            chi[j] = chi[j - 1] + 0.5 * step * (rate_before + rate)
            for m in range(radii + 3):
                of_chi[j, m] = of_chi[j - 1, m] + 0.5 * step * (before[m] + now[m])
        rate_before = rate
    middle = -first / step
    off = p[CHI] - _between(chi, middle)
    for j in range(samples):
        chi[j] += off
        cos_c[j], sin_c[j] = np.cos(chi[j]), np.sin(chi[j])
    of_middle = _between(of_chi, middle)
    for j in range(samples):
        for m in range(radii + 3):
            of_chi[j, m] -= of_middle[m]
    upper, lower = np.full(count, -1e30), np.full(count, 1e30)
    at_upper, at_lower = np.zeros((count, 2)), np.zeros((count, 2))
    xu, yu, xl, yl = np.empty(samples), np.empty(samples), np.empty(samples), np.empty(samples)
    for i in range(strands.away_d.size):
        _borders(p, strands, i, line, first, step, xu, yu, xl, yl)
        draw_outermost(upper, at_upper, xu, yu, 1.0, i, p[RHO], z0, first, step)
        draw_outermost(lower, at_lower, xl, yl, -1.0, i, p[RHO], z0, first, step)
    for c in range(count):
        axis = p[Y0] + p[SLOPE] * (c + z0)
        upper[c] += axis
        lower[c] += axis
    return Drawn(upper, lower, at_upper, at_lower, first, step, chi, of_chi)


@numba.njit(cache=True, error_model="numpy")
def _borders(p, strands, i, line, first, step, xu, yu, xl, yl):  # pragma: no cover - compiled
    """Fill the upper and lower border x, y (S,) of strand i about a line (9, S) (`drawn`). In loops
    that carry nothing from sample to sample, of which the compiler does several at once."""
    y, by_y, by_depth, by_s, by_h, cos_t, sin_t, cos_c, sin_c = line
    c0, s0 = np.cos(strands.angle_rad[i]), np.sin(strands.angle_rad[i])
    thick = 2.0 * p[RHO]
    away, crowd, share = thick * strands.away_d[i], thick * strands.crowd, give_of(strands.give, i)
    last = xu.size - 1
    s, h, ds, dh = (np.empty_like(xu), np.empty_like(xu), np.empty_like(xu), np.empty_like(xu))
    for j in range(last + 1):
        c, w = cos_c[j] * c0 - sin_c[j] * s0, sin_c[j] * c0 + cos_c[j] * s0
        one, two = _offset(away, crowd, share, c, w, cos_t[j], sin_t[j])
        g = one * by_y[j] + two * by_depth[j]
        s[j] = first + j * step - g * by_s[j]
        h[j] = y[j] + one - g * by_h[j]
    for j in range(1, last):
        ds[j], dh[j] = s[j + 1] - s[j - 1], h[j + 1] - h[j - 1]
    ds[0], dh[0], ds[last], dh[last] = ds[1], dh[1], ds[last - 1], dh[last - 1]
    for j in range(last + 1):
        nx, ny = border(ds[j], dh[j], p[RHO])
        xu[j], yu[j] = s[j] + nx, h[j] + ny
        xl[j], yl[j] = s[j] - nx, h[j] - ny


@numba.njit(cache=True)
def _between(line, at):  # pragma: no cover - compiled
    j = min(max(int(at), 0), line.size - 2)
    return line[j] + (at - j) * (line[j + 1] - line[j])


@numba.njit(cache=True, error_model="numpy")
def gradient(x, z, i, sense, p, strands, half, seen, out):  # pragma: no cover - compiled
    """d edge(x) / d p, out (8 + n,), where it touches strand i at z; sense +1 upper, -1 lower. What
    strands give is taken to stay."""
    k, values, slopes, radius, coil, ct, st, dy, dz = _line(p, z, half)
    at = (z - seen.first) / seen.step
    angle = _between(seen.chi, at) + strands.angle_rad[i]
    thick = 2.0 * p[RHO]
    one, two = _offset(
        thick * strands.away_d[i], thick * strands.crowd, give_of(strands.give, i),
        np.cos(angle), np.sin(angle), ct, st,
    )  # fmt: skip
    length = np.sqrt(1.0 + dy * dy + dz * dz)
    g, g_chi = one * dy + two * dz, one * dz - two * dy
    m = 1.0 / (length * (length + 1.0))
    m_length = -(2.0 * length + 1.0) * m * m
    cubed = 1.0 / (length * length * length)
    u = x - (z - g / length)
    pull = sense * u / np.sqrt(max(p[RHO] ** 2 - u * u, 0.04 * p[RHO] ** 2))
    # Of height and place, by how fast the line goes on, and by the strands' angle.
    by_dy = -(one * dy * m + g * m + g * dy * m_length * dy / length)
    by_dy -= pull * (one / length - g * dy * cubed)
    by_dz = -(two * dy * m + g * dy * m_length * dz / length)
    by_dz -= pull * (two / length - g * dz * cubed)
    by_chi = -two - g_chi * dy * m - pull * g_chi / length
    off = one - g * dy * m - pull * g / length
    out[RHO] = sense * p[RHO] / np.sqrt(max(p[RHO] ** 2 - u * u, 0.04 * p[RHO] ** 2)) + off / p[RHO]
    out[CHI] = by_chi
    out[THETA] = -radius * st - by_dy * dz + by_dz * dy
    out[Y0] = 1.0
    out[SLOPE] = x
    by_coil = radius * (by_dz * ct - by_dy * st)
    j = min(max(int(at), 0), seen.chi.size - 2)
    by_before, by_after = by_chi * (1.0 - (at - j)), by_chi * (at - j)
    before, after = seen.of_chi[j], seen.of_chi[j + 1]
    out[TWIST] = by_before * before[0] + by_after * after[0]
    out[KC] = z * out[THETA] + by_coil + by_before * before[1] + by_after * after[1]
    out[KC1] = (0.5 * z * out[THETA] + by_coil) * z / half
    out[KC1] += by_before * before[2] + by_after * after[2]
    for a in range(p.size - R):
        out[R + a] = by_before * before[3 + a] + by_after * after[3 + a]
    for a in range(4):
        value, slope = values[a], slopes[a]
        more = value * ct + by_dy * (slope * ct - value * coil * st)
        out[R + k + a] += more + by_dz * (slope * st + value * coil * ct)


@numba.njit(cache=True, error_model="numpy")
def cost_of(p, free, seen, problem, scale):  # pragma: no cover - compiled
    """Cost and weight sum of an outline (Geman-McClure)."""
    cost = total = 0.0
    for side in range(2):
        edge = seen.upper if side == 0 else seen.lower
        for c in range(edge.size):
            weight = problem.weights[side, c]
            r = problem.observed[side, c] - edge[c]
            if weight > 0.0 and abs(r) < 1e6:
                t = (r / scale) ** 2 * problem.worth[side, c]
                cost += weight * t / (1.0 + t)
                total += weight
    for k in range(free.size):
        off = (p[free[k]] - problem.hold.toward[free[k]]) / scale
        cost += problem.hold.px2[free[k]] * off * off
    return cost, total


@numba.njit(cache=True, error_model="numpy")
def _equations(
    p, free, seen, strands, problem, scale, normal, right
):  # pragma: no cover - compiled
    """Gauss-Newton system of the free parameters about an outline."""
    count = seen.upper.size
    half = abs(problem.z0_px)
    grads = np.empty((free.size, 2 * count))
    residuals, counts = np.empty(2 * count), np.empty(2 * count)
    out, counted = np.empty(p.size), np.empty(2 * count)
    used = 0
    for side in range(2):
        edge = seen.upper if side == 0 else seen.lower
        at = seen.at_upper if side == 0 else seen.at_lower
        for c in range(count):
            weight = problem.weights[side, c]
            r = problem.observed[side, c] - edge[c]
            if not (weight > 0.0 and abs(r) < 1e6):
                continue
            t = (r / scale) ** 2 * problem.worth[side, c]
            x, z, i = c + problem.z0_px, at[c, 0], int(at[c, 1])
            gradient(x, z, i, 1.0 - 2.0 * side, p, strands, half, seen, out)
            for a in range(free.size):
                grads[a, used] = out[free[a]]
            residuals[used] = r
            counts[used] = weight * problem.worth[side, c] / ((1.0 + t) * (1.0 + t))
            used += 1
    for a in range(free.size):
        for c in range(used):
            counted[c] = counts[c] * grads[a, c]
        right[a] = sum_of_products(counted, residuals, used)
        for b in range(a + 1):
            normal[a, b] = normal[b, a] = sum_of_products(counted, grads[b], used)
        px2 = problem.hold.px2[free[a]]
        right[a] -= px2 * (p[free[a]] - problem.hold.toward[free[a]])
        normal[a, a] += px2


@numba.njit(cache=True)
def radii(p, z0, count):  # pragma: no cover - compiled
    """Radius (M,) of the coil at z0, z0 + 1, ..., z0 + count - 1 = -z0."""
    out = np.empty(count)
    for c in range(count):
        out[c] = _radius_at(p, z0 + c, abs(z0))
    return out


@numba.njit(cache=True, error_model="numpy")
def spread(p, free, strands, problem):  # pragma: no cover - compiled
    """rms of the residuals that stay below three times the scale, and the covariance (2, 2) of the
    first two free parameters, were those 1 px."""
    count = problem.observed.shape[1]
    normal, right = np.empty((free.size, free.size)), np.empty(free.size)
    seen = drawn(p, strands, problem.z0_px, count, problem.step_px)
    _equations(p, free, seen, strands, problem, problem.scale_px, normal, right)
    squares = used = 0.0
    for side in range(2):
        edge = seen.upper if side == 0 else seen.lower
        for c in range(count):
            r = (problem.observed[side, c] - edge[c]) * np.sqrt(problem.worth[side, c])
            if problem.weights[side, c] > 0.0 and abs(r) < 3.0 * problem.scale_px:
                squares += r * r
                used += 1.0
    for a in range(free.size):
        normal[a, a] += 1e-9 * normal[a, a] + 1e-12
    return np.sqrt(squares / max(used, 1.0)), np.linalg.inv(normal)[:2, :2]


@numba.njit(cache=True, error_model="numpy")
def descend(start, free, strands, problem, steps, scale):  # pragma: no cover - compiled
    """Levenberg-Marquardt over the free parameters (m,) from a start (8 + n,): parameters, cost and
    weight sum. problem: its hold is of these parameters, its section not asked."""
    p = start.copy()
    count = problem.observed.shape[1]
    normal, right = np.empty((free.size, free.size)), np.empty(free.size)
    seen = drawn(p, strands, problem.z0_px, count, problem.step_px)
    cost, total = cost_of(p, free, seen, problem, scale)
    lam = 1e-3
    for _ in range(steps):
        _equations(p, free, seen, strands, problem, scale, normal, right)
        gain = 0.0
        for _try in range(5):
            damped = normal.copy()
            for a in range(free.size):
                damped[a, a] += lam * normal[a, a] + 1e-12
            step = np.linalg.solve(damped, right)
            # Nothing to be gained: to see that it is so costs as much as a step.
            if step @ right / scale**2 < LEAST_GAIN * cost:
                break
            trial = p.copy()
            for a in range(free.size):
                trial[free[a]] += step[a]
            other = drawn(trial, strands, problem.z0_px, count, problem.step_px)
            new_cost, new_total = cost_of(trial, free, other, problem, scale)
            if new_cost < cost:
                gain = cost - new_cost
                p, seen, cost, total = trial, other, new_cost, new_total
                lam = max(lam * 0.3, 1e-7)
                break
            lam *= 6.0
        if gain < LEAST_GAIN * cost:
            break
    return p, cost, total
