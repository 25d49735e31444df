"""Contact: strands that lie closer than they can are pushed apart, smoothly along their length.

Strategy: the paths that follow the coiled centre line are right in topology but let strands on
the inner side of a bend crowd into each other. Nodes a quarter of d apart get a displacement;
every overlapping pair is pushed apart by half its overlap each, the displacement is smoothed
along each strand, and so on until no pair overlaps by more than the allowance. Holes and
connector stay where they are. No strand crosses another, so the linking number is kept; the
string length is measured on the result.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline

ALLOWED = 0.025  # overlap in units of the mean diameter that is left alone (nodes see 0.01 less)
STAGES = 8  # the list of watched pairs is renewed in between
ROUNDS = 25
TOLERATED = 0.015  # of that distance, at the end
NODE_D = 0.3  # distance of nodes
REACH_D = 1.25  # pairs closer than this are watched
SMOOTHING = 0.3


def relax(points: list[np.ndarray], diameters: np.ndarray) -> list[np.ndarray]:
    """Displacements (M, 3) for each path's points (M, 3), zero where nothing touches.

    Both ends of every path stay. Points need not be evenly spaced.
    """
    d = float(diameters.mean())
    arcs = [_arc(p) for p in points]
    nodes, strand, place = [], [], []
    for number, (path, arc) in enumerate(zip(points, arcs, strict=True)):
        at = np.linspace(0.0, arc[-1], max(int(np.ceil(arc[-1] / (NODE_D * d))), 3) + 1)
        nodes.append(np.column_stack([np.interp(at, arc, path[:, k]) for k in range(3)]))
        strand.append(np.full(len(at), number))
        place.append(at)
    all_nodes, owner, along = np.vstack(nodes), np.concatenate(strand), np.concatenate(place)
    starts = np.concatenate([[0], np.cumsum([len(n) for n in nodes])]).astype(np.int64)
    shift = np.zeros_like(all_nodes)
    for _ in range(STAGES):
        pairs = _watched(all_nodes + shift, owner, along, d)
        i, j = pairs[:, 0], pairs[:, 1]
        want = (1.0 - ALLOWED) * 0.5 * (diameters[owner[i]] + diameters[owner[j]])
        if _push(all_nodes, shift, pairs, want, starts, ROUNDS, SMOOTHING) < TOLERATED:
            break
    if not shift.any():
        return [np.zeros_like(p) for p in points]
    out = []
    for k, (arc, at) in enumerate(zip(arcs, place, strict=True)):
        part = shift[starts[k] : starts[k + 1]]
        out.append(CubicSpline(at, part, bc_type="clamped")(arc))
    return out


def _arc(path: np.ndarray) -> np.ndarray:
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(step)])


def _watched(nodes: np.ndarray, owner: np.ndarray, along: np.ndarray, d: float) -> np.ndarray:
    """Pairs (P, 2) that may touch; stretches of one strand next to each other do not count."""
    order = np.argsort(nodes[:, 0], kind="stable")
    room = np.empty((64 * len(nodes), 2), np.int32)
    found = _sweep(nodes, owner, along, order, REACH_D * d, 2.5 * d, room)
    return room[:found]


@njit(cache=True, fastmath=True, error_model="numpy")
def _sweep(nodes, owner, along, order, reach, apart, room):
    """Sweep along x: the zone is long and thin, so few nodes share a window."""
    count, found = len(order), 0
    square = reach * reach
    for a in range(count):
        i = order[a]
        for b in range(a + 1, count):
            j = order[b]
            dx = nodes[j, 0] - nodes[i, 0]
            if dx > reach:
                break
            dy, dz = nodes[j, 1] - nodes[i, 1], nodes[j, 2] - nodes[i, 2]
            if dx * dx + dy * dy + dz * dz > square:
                continue
            if owner[i] == owner[j] and abs(along[i] - along[j]) < apart:
                continue
            if found < len(room):
                room[found, 0], room[found, 1] = i, j
                found += 1
    return found


def closest_mm(points: list[np.ndarray], d: float, step: float = 0.08) -> float:
    """Smallest distance between strand centre lines (own far parts included), to about 0.1 % d."""
    nodes, owner, along = [], [], []
    for number, path in enumerate(points):
        arc = _arc(path)
        at = np.arange(0.0, arc[-1], step * d)
        nodes.append(np.column_stack([np.interp(at, arc, path[:, k]) for k in range(3)]))
        owner.append(np.full(len(at), number))
        along.append(at)
    every = np.vstack(nodes)
    pairs = _watched(every, np.concatenate(owner), np.concatenate(along), d)
    if not len(pairs):
        return REACH_D * d
    return float(np.linalg.norm(every[pairs[:, 0]] - every[pairs[:, 1]], axis=1).min())


@njit(cache=True, fastmath=True, error_model="numpy")
def _push(nodes, shift, pairs, want, starts, rounds, smoothing):
    count = len(nodes)
    worst = 0.0
    force = np.zeros((count, 3))
    touched = np.zeros(count)
    old = np.zeros((count, 3))
    free = np.ones(count)
    for s in range(len(starts) - 1):
        for n in range(2):
            free[starts[s] + n] = 0.0
            free[starts[s + 1] - 1 - n] = 0.0
    for _ in range(rounds):
        force[:] = 0.0
        touched[:] = 0.0
        worst = 0.0
        for p in range(len(pairs)):
            i, j = pairs[p, 0], pairs[p, 1]
            dx = nodes[j, 0] + shift[j, 0] - nodes[i, 0] - shift[i, 0]
            dy = nodes[j, 1] + shift[j, 1] - nodes[i, 1] - shift[i, 1]
            dz = nodes[j, 2] + shift[j, 2] - nodes[i, 2] - shift[i, 2]
            square = dx * dx + dy * dy + dz * dz
            if square >= want[p] * want[p]:
                continue
            gap = np.sqrt(square) + 1e-12
            lack = want[p] - gap
            worst = max(worst, lack / want[p])
            push = 0.5 * lack / gap
            force[i, 0] -= push * dx
            force[i, 1] -= push * dy
            force[i, 2] -= push * dz
            force[j, 0] += push * dx
            force[j, 1] += push * dy
            force[j, 2] += push * dz
            touched[i] += 1.0
            touched[j] += 1.0
        if worst < TOLERATED:
            break
        for i in range(count):
            if touched[i] > 0.0:
                share = free[i] * min(1.0, 2.0 / touched[i])
                for k in range(3):
                    shift[i, k] += share * force[i, k]
        old[:] = shift
        for s in range(len(starts) - 1):
            for i in range(starts[s] + 2, starts[s + 1] - 2):
                for k in range(3):
                    even = 0.5 * (old[i - 1, k] + old[i + 1, k])
                    shift[i, k] = old[i, k] + smoothing * (even - old[i, k])
    return worst
