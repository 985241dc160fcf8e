# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of many cases made one, with what they are worth."""

import numpy as np

RESAMPLES = 2000


def summary(values):
    """Of distances; None of none."""
    values = np.abs(np.asarray(values, float))
    if len(values) == 0:
        return None
    return {"count": len(values), "rms": rms(values), "median": float(np.median(values)),
            "percentile95": float(np.quantile(values, .95)), "max": float(values.max())}


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def rounded(value, digits=3):
    """Numbers as tables show them; other things as they are."""
    return float(f"{value:.{digits}g}") if isinstance(value, (float, np.floating)) and np.isfinite(value) else value


def hole_of_each(points, holes):
    """The hole that took each point away: the one in whose ball it lies deepest; -1: none."""
    if not holes:
        return np.full(len(points), -1)
    shares = np.stack([np.linalg.norm(points - hole["center"], axis=1) / hole["radius"] for hole in holes])
    return np.where(shares.min(0) < 1 + 1e-6, shares.argmin(0), -1)


def rms_per_hole(errors, owners, count, min_points=20):
    """None for holes with few points, which say little."""
    holes = [errors[owners == hole] for hole in range(count)]
    return [rms(hole) if len(hole) >= min_points else None for hole in holes]


def compare(pairs, seed=1):
    """Errors of the same holes by two methods: (a, b, scan). Holes of one scan share what went wrong in it, so that the
    interval of 95 % of the median ratio a / b draws scans. \\return None of no pairs"""
    if not pairs:
        return None
    ratios = {}
    for a, b, scan in pairs:
        ratios.setdefault(scan, []).append(a / b)
    groups, random = list(ratios.values()), np.random.default_rng(seed)
    medians = [np.median(np.concatenate([groups[g] for g in random.integers(len(groups), size=len(groups))]))
               for _ in range(RESAMPLES)]
    lower, upper = np.quantile(medians, [.025, .975])
    return {"pairs": len(pairs), "better": float(np.mean([a < b for a, b, _ in pairs])),
            "ratio": float(np.median(np.concatenate(groups))), "lower": float(lower), "upper": float(upper)}


def mean_over_objects(values, seed=1):
    """(object, number) pairs: the mean in which objects count the same, and its interval of 95 % by drawing objects,
    whose scans have shapes in common; the lowest object. None of none."""
    objects = {}
    for name, value in values:
        if value is not None:
            objects.setdefault(name, []).append(value)
    if not objects:
        return None
    means = np.array([np.mean(of) for of in objects.values()])
    random = np.random.default_rng(seed)
    drawn = means[random.integers(len(means), size=(RESAMPLES, len(means)))].mean(1)
    return {"mean": float(means.mean()), "lower": float(np.quantile(drawn, .025)),
            "upper": float(np.quantile(drawn, .975)), "lowest": float(means.min()),
            "where": list(objects)[means.argmin()]}


#: Shares of a normal distribution, and how many deviations hold them.
LEVELS = {50: .67449, 80: 1.28155, 95: 1.95996}


def coverage(errors, sigmas, weights):
    """How much of the weight has its error within the interval of each level, how wide the widest is in the median, and
    the RMS error. None of no weight."""
    whole = weights.sum()
    if not whole > 0:
        return None
    result = {f"within{level}": float(weights[errors <= width * sigmas].sum() / whole)
              for level, width in LEVELS.items()}
    order = np.argsort(sigmas)
    middle = order[np.searchsorted(np.cumsum(weights[order]), whole / 2)]
    result["halfWidth"] = float(LEVELS[95] * sigmas[middle])
    result["rms"] = float(np.sqrt((weights * errors**2).sum() / whole))
    return result


def sparsification(errors, predictions, weights):
    """The area between two curves of the RMS error that is left, over the RMS error of all, as more and more of the
    weight is left out: what is predicted the worst first, and what is the worst. 0 is perfect."""

    def area(order):
        kept = weights[order]
        below = np.cumsum(kept * errors[order]**2) / np.cumsum(kept)
        return (np.sqrt(below) * kept).sum() / kept.sum()

    positive = weights > 0
    errors, predictions, weights = errors[positive], predictions[positive], weights[positive]
    if len(errors) == 0 or not errors.any():
        return None
    whole = np.sqrt((weights * errors**2).sum() / weights.sum())
    return float((area(np.argsort(predictions, kind="stable")) - area(np.argsort(errors, kind="stable"))) / whole)


def corner(x, y):
    """The index of the point of an L-curve, in order, where it turns most: the circle through it and its neighbors is
    the smallest, both axes being logarithms."""
    points = np.log(np.column_stack([x, y]))
    turns = []
    for a, b, c in zip(points, points[1:], points[2:]):
        u, v = b - a, c - a
        sides = np.linalg.norm(u) * np.linalg.norm(c - b) * np.linalg.norm(v)
        turns.append(2 * (u[0] * v[1] - u[1] * v[0]) / sides if sides > 0 else 0)
    return 1 + int(np.argmax(np.abs(turns)))
