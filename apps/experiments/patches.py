# SPDX-License-Identifier: BSD-3-Clause
"""Patches left out of scans: Table 1, and the options one at a time."""

import numpy as np

from . import drawing, surfaces
from .figures import compare, hole_of_each
from .methods import EXACT, PAPER, Spacings, lazily, measure, ours, peers
from .priors import fill_colors

HOLES = 5
#: Mean distance to the closest point by the side of a square with one point, evenly sampled.
EVEN_SPACING = .8
COLUMNS = ["scans", "failed", "holes", "hole RMS, median", "hole RMS, mean", "hole RMS, worst", "accuracy RMS, median",
           "invented area %, median", "invented area %, worst", "scans in several pieces", "scans with mesh flaws",
           "CPU s, median", "MB, largest"]


def own_methods():
    return [ours("default", "this, k = 3 (default)"),
            ours("k2", "this, k = 2", "--prior", "thin-plate"),
            ours("k1", "this, k = 1", "--prior", "membrane"),
            ours("plane", "this, voxel-wise (plane)", "--observation", "plane"),
            ours("paper", "this, preset paper", *PAPER),
            ours("fine", "this, --quality fine", "--quality", "fine"),
            ours("exact", "this, all levels whole and exact", *EXACT)]


def patch_objects(lab):
    """Quick: the first and the last."""
    names = list(lab.objects())
    return [names[0], names[-1]] if lab.quick else names


def patch_scan(lab, name, index):
    """12 views with occlusion, about 28,000 points, 5 holes with radii of 4 to 10 % of the diagonal."""
    scan = lab.scan(lab.objects()[name], "--points", 8000 if lab.quick else 28000, "--holes", HOLES, "--hole-radius",
                    "4%:10%", "--sampling", lab.sampling, seed=1000 * lab.seed + index)
    if lab.sampling != "even":  # lengths in spacings mean the same for every sampling
        scan.spacing = EVEN_SPACING * np.sqrt(
            scan.report["visibleArea"] / (scan.report["inliers"] + scan.report["heldOut"]))
    return scan


def patch_cells(results):
    """Of one method on some scans, for COLUMNS."""
    good = [result for result in results if "failed" not in result]
    if not good:
        return [len(results), len(results)]
    holes = [hole for result in good for hole in result["holes"] if hole is not None]

    def all_of(name):
        return [result[name] for result in good]

    return [len(results), len(results) - len(good), len(holes), *([np.median(holes), np.mean(holes), np.max(holes)]
                                                                  if holes else [None] * 3),
            np.median(all_of("accuracy")), np.median(all_of("invented")), np.max(all_of("invented")),
            sum(result["components"] > 1 for result in good), sum(result["flaws"] > 0 for result in good),
            np.median(all_of("seconds")), round(max(all_of("megabytes")))]


def pairs_of(results, others):
    """(a, b, scan) of the holes that both lists of results, scan by scan, have measured."""
    return [(a, b, scan) for scan, (first, second) in enumerate(zip(results, others))
            for a, b in zip(first.get("holes", []), second.get("holes", [])) if a is not None and b is not None]


def ratio_cells(results, others):
    found = compare(pairs_of(results, others))
    return [found["ratio"], found["lower"], found["upper"]] if found else [None] * 3


def measure_scans(lab, experiment, names, count, methods):
    """\\return by method: the results scan by scan; and the scans, (object, index)"""
    results, scans = {method: [] for method in methods}, [(name, index) for name in names for index in range(count)]
    folder = experiment + ("" if lab.sampling == "even" else "-" + lab.sampling)
    for name, index in scans:
        scan = lazily(lambda: patch_scan(lab, name, index))
        for method in methods:
            results[method].append(lab.case(
                f"{folder}/{name}/{index}/{method.name}",
                lambda: measure(lab, method.run(lab, scan()), scan(), lab.truth(lab.objects()[name]))))
    return results, scans


def table_1(lab):
    """Each object is scanned by 12 simulated views with occlusion, with exact positions and normals, and loses 5
    spherical patches at random places with radii of 4 to 10 % of its diagonal. The points that a patch took away are
    the truth there: a hole's error is the root mean square of their distances to the surface. Accuracy is that of all
    points that were left, whether a method used or dropped them. Surface farther than 1 % of the diagonal from the
    object is invented. Both belong together: the error of a hole does not see surface that is too much, and sheets
    across a hole that happen to pass near its points make it small. All errors are in % of the diagonal.

    All methods are given the same points with the same normals, also the preset `paper`, whose own are estimated. Ours
    has its defaults apart from what the name says, and no remeshing. pcl::MarchingCubesHoppe has a grid 5 % larger than
    the points' box; corners of its triangles that are equal but for rounding become one. Mesh flaws are non-manifold
    edges and vertices and degenerate triangles. CPU seconds and memory are of the whole process, with reading and
    writing. Ours leaves surface open where it would be an extrapolation; the others' is not trimmed. MPU, the other
    method of the paper's table, is not measured: neither PCL nor CGAL nor a package of Debian has it. The paper's
    Poisson has a depth of 11.

    In the paired table each hole is filled by both methods; the interval is a bootstrap over scans, so that holes of
    one scan do not count as independent. The pictures show the hole that our default fills worst, dark at 3 % of the
    diagonal."""
    names, methods = patch_objects(lab), own_methods() + peers(lab)
    results, scans = measure_scans(lab, "table-1", names, 1 if lab.quick else 6, methods)
    stem = "table-1" + ("" if lab.sampling == "even" else "-" + lab.sampling)
    rows = [[name, method.title] + patch_cells([result for (of, _), result in zip(scans, results[method])
                                                if name in (of, "all")])
            for name in ["all", *names] for method in methods]
    lab.table(stem, f"Per object and over all ({lab.sampling} sampling)", ["object", "method"] + COLUMNS, rows)
    rows = []
    for method in methods[1:]:
        found = compare(pairs_of(results[method], results[methods[0]]))
        rows.append([method.title] + ([found["pairs"], 100 * found["better"], found["ratio"], found["lower"],
                                       found["upper"]] if found else [0]))
    lab.table(stem + "-paired", "Hole by hole against the default",
              ["method", "holes", "better than ours in % of the holes", "median of its error / ours", "95 % from", "to"],
              rows)
    lab.picture(stem, lambda: _sorted_holes(methods, results))
    worst = max(((error, scan, hole) for scan, result in enumerate(results[methods[0]])
                 for hole, error in enumerate(result.get("holes", [])) if error is not None), default=None)
    if worst:
        lab.picture(stem + "-worst", lambda: _worst_hole(lab, methods, results, scans[worst[1]], *worst[1:]))


def _sorted_holes(methods, results):
    figure, (axis,) = drawing.panels(["All holes, in the order of their errors"], size=7)
    curves = {}
    for method in methods:
        errors = sorted(hole for result in results[method] for hole in result.get("holes", []) if hole is not None)
        curves[method.title] = (100 * (np.arange(len(errors)) + .5) / max(len(errors), 1), errors)
    drawing.draw_curves(axis, curves, ("% of the holes", "RMS error, % of the diagonal"), "y", marker="")
    return figure


def _worst_hole(lab, methods, results, which, index, hole):
    scan, truth = patch_scan(lab, *which), lab.truth(lab.objects()[which[0]])
    held_out, ball = scan.held_out, scan.holes[hole]
    # Seen against the normals of what was left out: from where the hole opens.
    mine = hole_of_each(held_out.points, scan.holes) == hole
    view = drawing.View(held_out.normals[mine].sum(0), ball["center"], 5 * ball["radius"])
    shown = [(method, results[method][index]["holes"][hole]) for method in methods
             if "holes" in results[method][index] and results[method][index]["holes"][hole] is not None]
    figure, axes = drawing.panels([f"{which[0]}, with the points left out"] +
                                  [f"{method.title}: {error:.3g} %" for method, error in shown])
    drawing.draw_points(axes[0], np.concatenate([scan.cloud.points, held_out.points]),
                        np.concatenate([scan.cloud.normals, held_out.normals]), view, 4)
    for axis, (method, _) in zip(axes[1:], shown):
        mesh = method.run(lab, scan).mesh
        near = np.linalg.norm(mesh.points - ball["center"], axis=1) < 6 * ball["radius"]
        mesh = surfaces.Surface(mesh.points, mesh.triangles[near[mesh.triangles].all(1)])
        drawing.draw_surface(axis, mesh, view, fill_colors(mesh, scan, truth))
    return figure


def variations():
    """Option, value and words of each setting that is tried."""
    plane = ("--observation", "plane")
    settings = [("default", "", ())]
    settings += [("observation", word, ("--observation", word))
                 for word in ("points", "median", "mean", "nearest", "plane", "trapezoid")]
    settings += [("prior", word, ("--prior", word)) for word in ("membrane", "thin-plate", "triharmonic")]
    settings += [("smoothing, spacings", x, ("--smoothing", Spacings(x))) for x in (.4, .6, .8, 1.2)]
    settings += [("gradient weight", x, ("--gradient-weight", x)) for x in (.1, .4, 1.5)]
    settings += [("plane: dEmax, spacings", x, (*plane, "--max-distance", Spacings(x))) for x in (2.5, 3, 3.25, 4)]
    settings += [("plane: beta", x, (*plane, "--beta", x)) for x in (.9, .95, .99, .999)]
    settings += [("voxel, spacings", x, ("--voxel-size", Spacings(x))) for x in (1.5, 2, 3)]
    settings += [("padding, voxels", x, ("--padding", x)) for x in (4, 6, 12, 24)]
    settings += [("trimming", word, ("--trim", word)) for word in ("none", "holes", "supported")]
    return settings


def defaults(lab):
    """The scans of Table 1, two of each object: what changes if one option is not at its default. Errors are in % of
    the diagonal. Ratios are taken hole by hole, with a bootstrap interval over scans.

    beta and dEmax act on voxel-wise observations, so these rows are of the estimate plane; what they change is to be
    read beside its own row. A row that repeats a default has a ratio of 1, apart from lengths: automatic ones follow
    the spacing of the points that are left or the data themselves, those of the table the spacing before patches were
    left out."""
    settings = {ours(f"{option.split(',')[0]}={value}".replace(" ", "-").replace(":", ""), "", *words): (option, value)
                for option, value, words in variations()}
    names = patch_objects(lab)[:1] if lab.quick else patch_objects(lab)
    results, _ = measure_scans(lab, "defaults", names, 1 if lab.quick else 2, list(settings))
    first = next(iter(results.values()))
    rows = [[*settings[method]] + ratio_cells(results[method], first) + patch_cells(results[method])
            for method in settings]
    lab.table("defaults", "One option at a time",
              ["option", "value", "hole by hole: median of its error / the default's", "95 % from", "to"] + COLUMNS, rows)
    lab.picture("defaults", lambda: _ratios([f"{row[0]} {row[1]}" for row in rows], [row[2:5] for row in rows]))


def _ratios(titles, cells):
    figure, (axis,) = drawing.panels(["hole errors / the default's, with 95 %"], size=9)
    for at, (ratio, lower, upper) in enumerate(cells):
        if ratio is not None:
            axis.errorbar(ratio, -at, xerr=[[max(ratio - lower, 0)], [max(upper - ratio, 0)]], fmt="ko", markersize=3)
    axis.axvline(1, color="gray", linewidth=.8)
    axis.set_yticks(-np.arange(len(titles)), titles, fontsize=7)
    axis.set_xscale("log")
    return figure
