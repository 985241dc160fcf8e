# SPDX-License-Identifier: BSD-3-Clause
"""Patches removed from scans: Table 1, and the options one at a time."""

from functools import partial

import numpy as np

from . import drawing
from .figures import compare, hole_of_each
from .methods import EXACT, GIVEN, PAPER, Spacings, measure_scans, ours, peers
from .priors import fill_colors
from .surfaces import Surface

#: Mean distance to the closest point over the side of a square with one point, for even sampling.
EVEN_SPACING = .8


def patch_objects(lab):
    """Quick: the first and the last."""
    names = list(lab.objects())
    return [names[0], names[-1]] if lab.quick else names


def patch_scan(lab, name, index):
    """12 views with occlusion, about 28,000 points, 5 holes with radii of 4 to 10 % of the diagonal."""
    scan = lab.scan(lab.objects()[name], "--points", lab.points(28000), "--holes", 5, "--hole-radius", "4%:10%",
                    "--sampling", lab.sampling, seed=1000 * lab.seed + index)
    if lab.sampling != "even":  # so that lengths in spacings are the same for every sampling
        scan.spacing = EVEN_SPACING * np.sqrt(
            scan.report["visibleArea"] / (scan.report["inliers"] + scan.report["heldOut"]))
    return scan


def holes_of(result):
    """The errors of the holes that were measured."""
    return [hole for hole in result.get("holes", []) if hole is not None]


def patch_row(results):
    """The row of one method over several scans."""
    good = [result for result in results if "failed" not in result]
    row = {"scans": len(results), "failed": len(results) - len(good)}
    if not good:
        return row
    holes = [hole for result in good for hole in holes_of(result)]
    of = {name: [result[name] for result in good] for name in good[0]}
    if holes:
        row.update({"holes": len(holes), "hole RMS %, median": np.median(holes), "mean": np.mean(holes), "worst": max(holes)})
    return {**row, "accuracy RMS %, median": np.median(of["accuracy RMS %"]),
            "invented area %, median": np.median(of["invented area %"]), "worst ": max(of["invented area %"]),
            "scans in several pieces": sum(pieces > 1 for pieces in of["components"]),
            "scans with mesh flaws": sum(flaws > 0 for flaws in of["flaws"]), "CPU s, median": np.median(of["CPU s"]),
            "MB, largest": max(of["MB"])}


def hole_by_hole(results, others):
    """Two lists of results, scan by scan, by the holes that both have measured."""
    return compare([(a, b, scan) for scan, (first, second) in enumerate(zip(results, others)) for a, b in zip(
        first.get("holes", []), second.get("holes", [])) if a is not None and b is not None])


def with_sampling(lab, experiment):
    return experiment if lab.sampling == "even" else f"{experiment}-{lab.sampling}"


def table_1(lab):
    """Each object is scanned by 12 simulated views with occlusion, with exact positions and normals, and loses 5
    spherical patches at random places with radii of 4 to 10 % of its diagonal. The points that a patch took away are
    the truth there: a hole's error is the root mean square of their distances to the surface. Accuracy is that of all
    points that were left, whether a method used or dropped them. Surface farther than 1 % of the diagonal from the
    object is invented. Both belong together: sheets across a hole that happen to pass near its points make its error
    small. All errors are in % of the diagonal.

    All methods are given the same points with the same normals, also the preset `paper`, whose own are estimated.
    Nothing is remeshed, and only ours is trimmed. Mesh flaws are non-manifold edges and vertices and degenerate
    triangles. CPU seconds and memory are of the whole process, with reading and writing. MPU, the other method of the
    paper's table, is not measured: neither PCL nor CGAL nor a package of Debian has it. The paper's Poisson has a depth
    of 11.

    In the paired table each hole is filled by both methods; the interval is a bootstrap over scans. The pictures show
    the hole that our default fills worst, dark at 3 % of the diagonal."""
    methods = [ours("default", "this, k = 3 (default)"), ours("k2", "this, k = 2", "--prior", "thin-plate"),
               ours("k1", "this, k = 1", "--prior", "membrane"),
               ours("plane", "this, voxel-wise (plane)", "--observation", "plane"),
               ours("paper", "this, preset paper", *PAPER, *GIVEN),
               ours("fine", "this, --quality fine", "--quality", "fine"),
               ours("exact", "this, all levels whole and exact", *EXACT), *peers(lab)]
    names, stem = patch_objects(lab), with_sampling(lab, "table-1")
    results, scans = measure_scans(lab, stem, names, 1 if lab.quick else 6, methods, patch_scan)
    rows = [{"object": name, "method": method.title,
             **patch_row([result for (of, _), result in zip(scans, results[method]) if name in (of, "all")])}
            for name in ["all", *names] for method in methods]
    lab.table(stem, f"Per object and over all ({lab.sampling} sampling)", rows)
    default = results[methods[0]]
    lab.table(stem + "-paired", "Hole by hole: its error over the default's",
              [{"method": method.title, **hole_by_hole(results[method], default)} for method in methods[1:]])
    lab.picture(stem, lambda: _sorted_holes(results))
    worst = max(((error, scan, hole) for scan, result in enumerate(default)
                 for hole, error in enumerate(result.get("holes", [])) if error is not None), default=None)
    if worst:
        _, at, hole = worst
        errors = {method: results[method][at].get("holes", {hole: None})[hole] for method in methods}
        lab.picture(stem + "-worst", lambda: _worst_hole(lab, errors, scans[at], hole))


def _sorted_holes(results):
    figure, (axis,) = drawing.panels(["All holes, in the order of their errors"], size=7)
    curves = {}
    for method, measured in results.items():
        errors = sorted(hole for result in measured for hole in holes_of(result))
        curves[method.title] = (100 * (np.arange(len(errors)) + .5) / max(len(errors), 1), errors)
    drawing.draw_curves(axis, curves, ("% of the holes", "RMS error, % of the diagonal"), "y", marker="")
    return figure


def _worst_hole(lab, errors, which, hole):
    scan = patch_scan(lab, *which)
    held_out, ball = scan.held_out, scan.holes[hole]
    # The view is against the normals of the withheld points, into the opening of the hole.
    mine = hole_of_each(held_out.points, scan.holes) == hole
    view = drawing.View(held_out.normals[mine].sum(0), ball["center"], 5 * ball["radius"])

    def around(method):
        mesh = method.run(lab, scan).mesh
        near = np.linalg.norm(mesh.points - ball["center"], axis=1) < 6 * ball["radius"]
        return Surface(mesh.points, mesh.triangles[near[mesh.triangles].all(1)])

    shown = [(f"{method.title}: {error:.3g} %", partial(around, method))
             for method, error in errors.items() if error is not None]
    whole = [np.concatenate([scan.cloud.points, held_out.points]), np.concatenate([scan.cloud.normals, held_out.normals])]
    return drawing.gallery(shown, view, partial(fill_colors, scan), (f"{which[0]}, with the points left out", *whole), 4)


def variations():
    """The option, value and command-line words of each setting to try."""
    plane = ("--observation", "plane")
    settings = [("default", "", ())]
    for option, name, values, more in (
            ("observation", "--observation", ("points", "median", "mean", "nearest", "plane", "trapezoid"), ()),
            ("prior", "--prior", ("membrane", "thin-plate", "triharmonic"), ()),
            ("smoothing, spacings", "--smoothing", [Spacings(x) for x in (.4, .6, .8, 1.2)], ()),
            ("gradient weight", "--gradient-weight", (.1, .4, 1.5), ()),
            ("plane: dEmax, spacings", "--max-distance", [Spacings(x) for x in (2.5, 3, 3.25, 4)], plane),
            ("plane: beta", "--beta", (.9, .95, .99, .999), plane),
            ("voxel, spacings", "--voxel-size", [Spacings(x) for x in (1.5, 2, 3)], ()),
            ("padding, voxels", "--padding", (4, 6, 12, 24), ()),
            ("trimming", "--trim", ("none", "holes", "supported"), ())):
        settings += [(option, value, (*more, name, value)) for value in values]
    return settings


def defaults(lab):
    """The scans of Table 1, two of each object: what changes if one option is not at its default. Errors are in % of
    the diagonal. Ratios are taken hole by hole, with a bootstrap interval over scans. beta and dEmax act on voxel-wise
    observations, so these rows are of the estimate plane, to be read beside its own row. Automatic lengths follow the
    spacing of the points that are left, those of the table the spacing before patches were left out."""
    settings = {ours(f"{option.split(',')[0]}={value}".replace(" ", "-").replace(":", ""), "", *words): (option, value)
                for option, value, words in variations()[::3 if lab.quick else 1]}
    names = patch_objects(lab)[:1 if lab.quick else None]
    results, _ = measure_scans(lab, with_sampling(lab, "defaults"), names, 1 if lab.quick else 2, list(settings), patch_scan)
    first = next(iter(results.values()))
    rows = [dict(zip(("option", "value"), settings[method]), **hole_by_hole(results[method], first),
                 **patch_row(results[method])) for method in settings]
    lab.table("defaults", "One option at a time; hole by hole, its error over the default's", rows)
    lab.picture("defaults", lambda: _ratios(rows))


def _ratios(rows):
    figure, (axis,) = drawing.panels(["hole errors / the default's, with 95 %"], size=9)
    for at, row in enumerate(rows):
        if "ratio" in row:
            width = [[max(row["ratio"] - row["95 % from"], 0)], [max(row["to"] - row["ratio"], 0)]]
            axis.errorbar(row["ratio"], -at, xerr=width, fmt="ko", markersize=3)
    axis.axvline(1, color="gray", linewidth=.8)
    axis.set_yticks(-np.arange(len(rows)), [f"{row['option']} {row['value']}" for row in rows], fontsize=7)
    axis.set_xscale("log")
    return figure
