"""The silhouette of twisted strands in projection, and its derivatives.

A bundle of N round strands on a fixed section turns about its own centre line, and that line may
itself coil about the zone's axis (helix of helix). A tube's silhouette in projection is the
envelope of discs along its projected centre line; the bundle's is the outermost of all strands.
Both edges and their derivatives come from the same contact points: at a maximum the contact point
may be held fixed while a parameter changes (envelope theorem), so that the Jacobian costs little
more than the silhouette.

Parameters, in px and rad, z running along the axis from the middle of the window:
  rho    strand radius; strand centres lie at a_i = 2 rho * (1 + open) * site radius (sites in
         units of d)
  k, phi strand rate and phase about the bundle's centre line (relative to the line's own frame)
  y0, m  offset and slope of the axis
  rc, kc, phic  radius, rate and phase of the coiling; rc = 0 for a straight bundle
  edge   how far both measured edges lie outside the true ones
  tilt   tangent of the angle by which the picture sees the bundle from along its axis and not from
         beside it: what lies in front of the middle line is seen as far along s
  open   share by which the section is opened: strands that lie steeply need more room
  crowd  share of what strands of a coil can give (`give_d` of the section) that they do
Relative signs of k and kc are taken as equal: the bundle coils in the sense in which it is twisted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np

from tsvision.measures.numeric.smoothing import smoothed

RHO, K, PHI, Y0, SLOPE, RC, KC, PHIC, EDGE, TILT, OPEN, CROWD = range(12)
PARAMETERS = 12
STRAIGHT = (RHO, K, PHI, Y0, SLOPE, EDGE)
COILED = (RHO, K, PHI, Y0, SLOPE, RC, KC, PHIC, EDGE)
# What a fit is free in while the edges' own place is known.
FREE_STRAIGHT, FREE_COILED = STRAIGHT[:-1], COILED[:-1]


def waves(psi: np.ndarray) -> np.ndarray:
    """What `Section.give_d` counts, (5, P), at angles psi (P,)."""
    return np.array([psi**0, np.cos(psi), np.sin(psi), np.cos(2.0 * psi), np.sin(2.0 * psi)])


_ROUND = waves(np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False))


@dataclass(frozen=True)
class Section:
    """Strand centres: radius in units of d and angle in rad, both (N,).

    give_d (N, 2, 5): by how much each gives outward, and on around, where strands crowd, in units
    of d: a constant, and what goes as cos, sin, cos 2 and sin 2 of its angle from the inner side of
    the coil's bend. None: they are not asked.
    gives: the share of that which strands are taken to give before they are asked, and its sd.
    """

    name: str
    radius_d: np.ndarray
    angle_rad: np.ndarray
    give_d: np.ndarray | None = None
    gives: tuple[float, float] = (0.0, 0.5)

    @cached_property
    def diameter_d(self) -> float:
        """Outer diameter in units of d."""
        return 1.0 + 2.0 * float(self.radius_d.max())

    def farthest_d(self, opened: float, crowd: float) -> float:
        """How far the farthest strand's centre lies from the middle line at most, in units of d,
        with the section opened by a share and strands giving by another."""
        off = self.radius_d[:, None] * (1.0 + opened)
        if crowd != 0.0 and self.give_d is not None:
            off = off + crowd * (self.give_d[:, 0] @ _ROUND)
        return float(off.max())

    @cached_property
    def outer(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Radius, angle and give of the strands that reach the outline: where it is not asked what
        they give the corners of the sites' convex hull, four of the pair core's eight."""
        give = np.zeros((self.count, 2, 5)) if self.give_d is None else self.give_d
        if self.count < 4 or self.give_d is not None:
            return self.radius_d, self.angle_rad, give
        corners = np.unique(self._support_d.argmax(axis=0))
        return self.radius_d[corners], self.angle_rad[corners], give[corners]

    @cached_property
    def mean_half_d(self) -> float:
        """How far the outline lies from the axis, in the mean of all turns, in units of d."""
        return 0.5 + float(self._support_d.max(axis=0).mean())

    @cached_property
    def _support_d(self) -> np.ndarray:
        """How far out each strand's centre lies in any direction, (N, 720)."""
        turns = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False) + 1e-4
        return np.asarray(self.radius_d[:, None] * np.cos(turns - self.angle_rad[:, None]))

    @property
    def count(self) -> int:
        """Strands."""
        return len(self.radius_d)

    @property
    def lobes(self) -> int:
        """Lobes of either edge that one turn of the strands makes, roughly alike."""
        return 2 if len(self.outer[0]) <= 2 else 4

    @property
    def fold(self) -> int:
        """Times that one turn repeats the section."""
        return 1 if self.count % 2 else 2

    def variants(self) -> tuple[Section, ...]:
        """The section and its mirror image, where that is another section whichever way it is
        turned (N = 5, 6, 7 of the pair core): which of the two twisted up nobody knows, and seen
        from the side a right-handed bundle of one looks like a left-handed one of the other."""
        points = self.radius_d * np.exp(1j * self.angle_rad)
        mirrored = points.conj()
        for turn in np.angle(mirrored[:, None] / np.where(points == 0, 1, points)[None, :]).ravel():
            turned = points * np.exp(1j * turn)
            if np.abs(turned[:, None] - mirrored[None, :]).min(axis=1).max() < 1e-6:
                return (self,)
        return self, replace(self, name=f"{self.name}_mirrored", angle_rad=-self.angle_rad)


@numba.njit(cache=True, inline="always")
def climb(p):  # pragma: no cover - compiled
    """Cosine and sine of the angle at which a coiled centre line climbs about its axis."""
    kappa = p[RC] * p[KC]
    cosine = 1.0 / np.sqrt(1.0 + kappa * kappa)
    return cosine, kappa * cosine


@numba.njit(cache=True, inline="always")
def give_of(give, i):  # pragma: no cover - compiled
    """Strand i's share of give (N, 2, 5), told once for all points of the strand: a loop that asks
    the array takes twice as long."""
    outward, around = give[i, 0], give[i, 1]
    return (
        (outward[0], outward[1], outward[2], outward[3], outward[4]),
        (around[0], around[1], around[2], around[3], around[4]),
    )


@numba.njit(cache=True, inline="always")
def given(share, cp, sp):  # pragma: no cover - compiled
    """How far a strand (`give_of`) gives outward and around, and the derivatives of both along its
    angle psi from the bend's inner side, of which cosine and sine are told."""
    o, o_c, o_s, o_c2, o_s2 = share[0]
    a, a_c, a_s, a_c2, a_s2 = share[1]
    c2, s2 = cp * cp - sp * sp, 2.0 * cp * sp
    out = o + o_c * cp + o_s * sp + o_c2 * c2 + o_s2 * s2
    on = a + a_c * cp + a_s * sp + a_c2 * c2 + a_s2 * s2
    d_out = o_s * cp - o_c * sp + 2.0 * (o_s2 * c2 - o_c2 * s2)
    d_on = a_s * cp - a_c * sp + 2.0 * (a_s2 * c2 - a_c2 * s2)
    return out, on, d_out, d_on


@numba.njit(cache=True, inline="always")
def border(ds, dy, rho):  # pragma: no cover - compiled
    """From the centre of a strand, that goes on by ds, dy, to its upper border."""
    out = np.copysign(rho, ds) / (np.sqrt(ds * ds + dy * dy) + 1e-12)
    return -dy * out, ds * out


@numba.njit(cache=True, error_model="numpy")
def silhouette(p, site_radius, site_angle, give, z0, count, upper, lower, at_upper, at_lower, step):
    # pragma: no cover - compiled
    """Fill upper, lower (count,) at z0, z0 + 1, ...; at_* (count, 2) gets contact z and strand."""
    crowd = 2.0 * p[RHO] * p[CROWD] if p[RC] > 0.0 else 0.0
    rho, apart = p[RHO], 2.0 * p[RHO] * (1.0 + p[OPEN])
    for c in range(count):
        upper[c] = -1e30
        lower[c] = 1e30
    reach = rho + 2.0 * step
    for i in range(site_radius.size):
        off = apart * site_radius[i]
        for k in range(5):
            off += abs(crowd * give[i, 0, k])
        reach = max(reach, rho + off + 2.0 * step)
    samples = int((count + 2.0 * reach) / step) + 2
    first = z0 - reach
    coiled = p[RC] > 0.0
    cos_psi, sin_psi = turning(p[K] * step, p[K] * first + p[PHI], 0.0, samples)
    coils = samples if coiled else 0
    cos_theta, sin_theta = turning(p[KC] * step, p[KC] * first + p[PHIC], 0.0, coils)
    xu, yu = np.empty(samples), np.empty(samples)
    xl, yl = np.empty(samples), np.empty(samples)
    for i in range(site_radius.size):
        a, c0, s0 = apart * site_radius[i], np.cos(site_angle[i]), np.sin(site_angle[i])
        if coiled:
            share = give_of(give, i)
            _coiled_borders(
                p, a, c0, s0, share, crowd, first, step,
                cos_psi, sin_psi, cos_theta, sin_theta, xu, yu, xl, yl,
            )  # fmt: skip
        else:
            _straight_borders(p, a, c0, s0, first, step, cos_psi, sin_psi, xu, yu, xl, yl)
        draw_outermost(upper, at_upper, xu, yu, 1.0, i, rho, z0, first, step)
        draw_outermost(lower, at_lower, xl, yl, -1.0, i, rho, z0, first, step)
    for c in range(count):
        line = p[Y0] + p[SLOPE] * (c + z0)
        upper[c] += line + p[EDGE]
        lower[c] += line - p[EDGE]


# One strand a call and nothing carried from sample to sample: the compiler then does several at
# once.
@numba.njit(cache=True, error_model="numpy")
def _straight_borders(p, a, c0, s0, first, step, cos_psi, sin_psi, xu, yu, xl, yl):
    # pragma: no cover - compiled
    """Fill the upper and lower border x, y (K,) of a straight bundle's strand whose centre lies `a`
    off the axis; cosine and sine of its angle in the section, and of the section's (K,)."""
    k, tilt, rho = p[K], p[TILT], p[RHO]
    for j in range(xu.size):
        cp, sp = cos_psi[j] * c0 - sin_psi[j] * s0, sin_psi[j] * c0 + cos_psi[j] * s0
        s, y = first + j * step - tilt * a * sp, -a * cp
        nx, ny = border(1.0 - tilt * a * cp * k, k * (a * sp), rho)
        xu[j], yu[j] = s + nx, y + ny
        xl[j], yl[j] = s - nx, y - ny


@numba.njit(cache=True, error_model="numpy")
def _coiled_borders(
    p, a, c0, s0, share, crowd, first, step, cos_psi, sin_psi, cos_theta, sin_theta, xu, yu, xl, yl
):
    # pragma: no cover - compiled
    """The same of a coil, whose angle's cosine and sine are told as well (K,), and whose strand
    gives `crowd` (px) times its share (`give_of`)."""
    cos_climb, sin_climb = climb(p)
    k, tilt, rho, kc, radius = p[K], p[TILT], p[RHO], p[KC], p[RC]
    for j in range(xu.size):
        cp, sp = cos_psi[j] * c0 - sin_psi[j] * s0, sin_psi[j] * c0 + cos_psi[j] * s0
        ct, st = cos_theta[j], sin_theta[j]
        out, on, d_out, d_on = given(share, cp, sp)
        across = (a + crowd * out) * cp - crowd * on * sp
        aside = (a + crowd * out) * sp + crowd * on * cp
        across_psi = -aside + crowd * (d_out * cp - d_on * sp)
        aside_psi = across + crowd * (d_out * sp + d_on * cp)
        depth = radius * st - across * st - aside * ct * cos_climb
        s = first + j * step + aside * sin_climb + tilt * depth
        y = radius * ct - across * ct + aside * st * cos_climb
        y_psi = aside_psi * st * cos_climb - across_psi * ct
        s_psi = aside_psi * sin_climb - tilt * (across_psi * st + aside_psi * ct * cos_climb)
        # Turned about the axis by a right angle, depth becomes height: each is the other's
        # derivative.
        nx, ny = border(1.0 + k * s_psi + kc * tilt * y, k * y_psi - kc * depth, rho)
        xu[j], yu[j] = s + nx, y + ny
        xl[j], yl[j] = s - nx, y - ny


@numba.njit(cache=True, error_model="numpy")
def draw_outermost(edge, at, x, y, sense, strand, rho, z0, first, step):
    # pragma: no cover - compiled
    """Draw a strand's border x, y (K,), told every `step` from `first` on, into an edge (count,)
    wherever it lies further out; sense +1 upper, -1 lower. at (count, 2): contact z and strand."""
    last = edge.size - 1
    before = int(np.floor(x[0] - z0))
    for j in range(1, x.size):
        here = int(np.floor(x[j] - z0))
        if here == before:
            continue
        low, high = min(before, here), max(before, here)
        before = here
        x0, x1 = x[j - 1], x[j]
        if not abs(x1 - x0) < 4.0 * rho:
            continue
        for c in range(max(low + 1, 0), min(high, last) + 1):
            w = (c + z0 - x0) / (x1 - x0)
            v = y[j - 1] + w * (y[j] - y[j - 1])
            if sense * v > sense * edge[c]:
                edge[c] = v
                at[c, 0] = first + (j - 1) * step + w * step
                at[c, 1] = strand


@numba.njit(cache=True, error_model="numpy")
def gradient(x, z, radius_d, give, i, sense, p, cp, sp, ct, st, out):  # pragma: no cover - compiled
    """d edge(x) / d p, out (12,), at contact z on strand i, at radius_d, of those that give
    (N, 2, 5); sense +1 upper, -1 lower; cosines and sines of its angle psi and the coil's theta."""
    rho = p[RHO]
    closed = 2.0 * rho * radius_d
    a = closed * (1.0 + p[OPEN])
    if p[RC] <= 0.0 and p[TILT] == 0.0:  # the same with kappa = theta = 0, in half the time
        u = x - z
        root = np.sqrt(max(rho * rho - u * u, 0.04 * rho * rho))
        out[RHO] = sense * rho / root - a / rho * cp
        out[K] = z * (a * sp)
        out[PHI] = a * sp
        out[Y0] = 1.0
        out[SLOPE] = x
        out[RC] = 1.0 + sense * u / root * (a * sp) * p[KC]
        out[KC] = z * (a * sp)
        out[PHIC] = a * sp
        out[EDGE] = sense
        out[TILT] = -sense * u / root * (a * sp)
        out[OPEN] = -closed * cp
        out[CROWD] = 0.0
        return
    cos_climb, sin_climb = climb(p)
    kappa = p[RC] * p[KC]
    across, aside = a * cp, a * sp
    across_psi, aside_psi = -aside, across
    more_across = more_aside = 0.0  # where strands crowd, per share that they give
    crowd = 2.0 * rho * p[CROWD]
    if give[i, 0, 0] != 0.0:  # where they are asked
        more, more_on, d_out, d_on = given(give_of(give, i), cp, sp)
        more_across, more_aside = more * cp - more_on * sp, more * sp + more_on * cp
        across += crowd * more_across
        aside += crowd * more_aside
        across_psi = -aside + crowd * (d_out * cp - d_on * sp)
        aside_psi = across + crowd * (d_out * sp + d_on * cp)
    depth = p[RC] * st - across * st - aside * ct * cos_climb
    height = p[RC] * ct - across * ct + aside * st * cos_climb
    s = z + aside * sin_climb + p[TILT] * depth
    u = x - s
    root = np.sqrt(max(rho * rho - u * u, 0.04 * rho * rho))
    g = sense * u / root  # d edge / d s of the centre
    d_theta = -depth + g * p[TILT] * height
    y_psi = aside_psi * st * cos_climb - across_psi * ct
    s_psi = aside_psi * sin_climb - p[TILT] * (across_psi * st + aside_psi * ct * cos_climb)
    y_a = -cp * ct + sp * st * cos_climb
    s_a = sp * sin_climb - p[TILT] * (cp * st + sp * ct * cos_climb)
    cubed = cos_climb * cos_climb * cos_climb
    y_kappa = -aside * st * kappa * cubed
    s_kappa = aside * cubed * (1.0 + p[TILT] * ct * kappa)
    y_rho = aside * st * cos_climb - across * ct
    s_rho = aside * sin_climb - p[TILT] * (across * st + aside * ct * cos_climb)
    out[RHO] = sense * rho / root + (y_rho + g * s_rho) / rho
    d_psi = y_psi + g * s_psi
    out[K] = z * d_psi
    out[PHI] = d_psi
    out[Y0] = 1.0
    out[SLOPE] = x
    d_kappa = y_kappa + g * s_kappa
    out[RC] = ct + g * p[TILT] * st + d_kappa * p[KC]
    out[KC] = z * d_theta + d_kappa * p[RC]
    out[PHIC] = d_theta
    out[EDGE] = sense
    out[TILT] = g * depth
    out[OPEN] = closed * (y_a + g * s_a)
    y_crowd = more_aside * st * cos_climb - more_across * ct
    s_crowd = more_aside * sin_climb - p[TILT] * (more_across * st + more_aside * ct * cos_climb)
    out[CROWD] = 2.0 * rho * (y_crowd + g * s_crowd)


@numba.njit(cache=True, error_model="numpy")
def turning(rate, phase, first, count):  # pragma: no cover - compiled
    """Cosine and sine (count,) of what turns at a rate, at first, first + 1, ..."""
    cosines, sines = np.empty(count), np.empty(count)
    c, s = np.cos(rate * first + phase), np.sin(rate * first + phase)
    c1, s1 = np.cos(rate), np.sin(rate)
    for j in range(count):
        cosines[j], sines[j] = c, s
        c, s = c * c1 - s * s1, s * c1 + c * s1
    return cosines, sines


@numba.njit(cache=True, inline="always")
def turned_on(rate, off, cosine, sine):  # pragma: no cover - compiled
    """Cosine and sine of what turns at a rate, so little off where they are known (half a px) that
    a few terms of their series tell them: to 3e-4 at 1 rad a px, which no bundle reaches."""
    d = rate * off
    square = d * d
    c1, s1 = 1.0 - square * (0.5 - square / 24.0), d * (1.0 - square / 6.0)
    return cosine * c1 - sine * s1, sine * c1 + cosine * s1


@numba.njit(cache=True)
def twist(p):  # pragma: no cover - compiled
    """Of the strands about the bundle's own centre line, rad per px of that: its frame turns with
    its torsion, kc / (1 + kappa^2), beside the strands' k."""
    if p[RC] <= 0.0:
        return p[K]
    stretch = np.sqrt(1.0 + (p[RC] * p[KC]) ** 2)
    return (p[K] + p[KC] / stretch) / stretch


def passing(p: np.ndarray) -> float:
    """Of strands and coil together before the camera, rad per px of the axis: all passings are the
    turns."""
    return float(p[K] + p[KC]) if p[RC] > 0.0 else float(p[K])


@numba.njit(cache=True)
def moved(p, shift):  # pragma: no cover - compiled
    """Parameters (12,) with z counted from a middle `shift` px further on."""
    q = p.copy()
    q[PHI] += p[K] * shift
    q[PHIC] += p[KC] * shift
    q[Y0] += p[SLOPE] * shift
    return q


def rescaled(p: np.ndarray, factor: float, shift: float = 0.0) -> np.ndarray:
    """Parameters (12,) in units of `factor` px; z counted from a middle `shift` px further on."""
    q: np.ndarray = moved(p, shift)
    q[[RHO, Y0, RC]] /= factor
    q[[K, KC]] *= factor
    return q


def rounded_off(
    p: np.ndarray, section: Section, z0: float, count: int, blur_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """By how much (count,) blur moves the upper and the lower edge at z0, z0 + 1, ...: a blurred
    outline's half level runs, to first order in its slope, where the outline itself smoothed along
    the axis does, inside of crests and outside of notches."""
    beyond = int(np.ceil(3.0 * blur_px))
    sharp = model_edges(p, section, z0 - beyond, count + 2 * beyond)
    inside = slice(beyond, beyond + count)
    up, low = ((smoothed(e, blur_px, truncate=3.0) - e)[inside] for e in sharp)
    return up, low


def model_edges(
    p: np.ndarray, section: Section, z0: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower edge (count,) at z0, z0 + 1, ..."""
    upper, lower = np.empty(count), np.empty(count)
    at_u, at_l = np.zeros((count, 2)), np.zeros((count, 2))
    step = max(0.25, min(0.6, 0.08 * float(p[RHO])))
    silhouette(
        np.asarray(p, dtype=float),
        *section.outer,
        float(z0),
        count,
        upper,
        lower,
        at_u,
        at_l,
        step,
    )
    return upper, lower
