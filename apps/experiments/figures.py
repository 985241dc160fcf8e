# SPDX-License-Identifier: BSD-3-Clause
"""Summarizes numbers of many cases, with their uncertainty."""

import numpy as np


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def summary(values, of=""):
    """Statistics of distances; empty if there are none. \\param of prefix of the names"""
    values = np.abs(np.asarray(values, float))
    if len(values) == 0:
        return {}
    return {of + "count": len(values), of + "RMS": rms(values), of + "95 %": float(np.quantile(values, .95)),
            of + "largest": float(values.max())}


def text_of(value, digits=3):
    """A cell of a table."""
    if isinstance(value, (float, np.floating)):
        return f"{float(f'{value:.{digits}g}'):.12g}"
    return "" if value is None else str(value)


def hole_of_each(points, holes):
    """The hole that removed each point: the one in whose ball it lies deepest; -1: none."""
    if not holes:
        return np.full(len(points), -1)
    shares = np.stack([np.linalg.norm(points - hole["center"], axis=1) / hole["radius"] for hole in holes])
    return np.where(shares.min(0) < 1 + 1e-6, shares.argmin(0), -1)


def rms_per_hole(errors, owners, count, min_points=20):
    """The RMS of each hole; None for holes with too few points."""
    holes = [errors[owners == hole] for hole in range(count)]
    return [rms(hole) if len(hole) >= min_points else None for hole in holes]


def grouped(pairs):
    """The values of (key, value) pairs as lists by key."""
    groups = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def interval(figure, groups, seed=1):
    """The 95 % interval of \\p figure of groups, by drawing as many groups 2,000 times."""
    random = np.random.default_rng(seed)
    drawn = [figure([groups[n] for n in random.integers(len(groups), size=len(groups))]) for _ in range(2000)]
    return [float(bound) for bound in np.quantile(drawn, [.025, .975])]


def compare(pairs):
    """Compares the errors of the same holes by two methods: (a, b, scan). Holes of one scan share its errors, so
    the 95 % interval of the median ratio a / b is found by drawing scans. Empty if there are no pairs."""
    if not pairs:
        return {}
    groups = list(grouped((scan, a / b) for a, b, scan in pairs).values())

    def median(some):
        return float(np.median(np.concatenate(some)))

    lower, upper = interval(median, groups)
    return {"pairs": len(pairs), "better %": 100 * float(np.mean([a < b for a, b, _ in pairs])), "ratio": median(groups),
            "95 % from": lower, "to": upper}


def mean_over_objects(values):
    """For (object, number) pairs: the mean with equal weights of the objects; its 95 % interval, found by drawing
    objects because scans of an object have shapes in common; and the object with the lowest number. None if there are
    no pairs."""
    means = {name: float(np.mean(of)) for name, of in grouped(pair for pair in values if pair[1] is not None).items()}
    if not means:
        return None
    lower, upper = interval(np.mean, list(means.values()))
    worst = min(means, key=means.get)
    return {"mean": float(np.mean(list(means.values()))), "95 % from": lower, "to": upper, "worst": means[worst],
            "which": worst}


def corner(x, y):
    """The index of the point of an L-curve with the largest curvature, with logarithmic axes."""
    first = np.gradient(np.log(np.column_stack([x, y])), axis=0)
    second = np.gradient(first, axis=0)
    turns = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    curvatures = np.abs(turns) / np.maximum(np.linalg.norm(first, axis=1), 1e-12)**3
    return 1 + int(np.argmax(curvatures[1:-1]))  # the ends are not corners
