# SPDX-License-Identifier: BSD-3-Clause
"""Our method with options, and the other methods that are installed."""

import tempfile
from collections import namedtuple
from functools import cache, partial

import numpy as np
from scipy.spatial import cKDTree

from . import surfaces
from .figures import hole_of_each, rms, rms_per_hole
from .laboratory import Result
from .surfaces import Surface

PRIORS = {1: "membrane", 2: "thin-plate", 3: "triharmonic"}
PRIOR_NAMES = {k: f"k = {k}, {word.replace('-', ' ')}" for k, word in PRIORS.items()}
PAPER = ("--preset", "paper")
#: The preset `paper` estimates normals; this gives it the normals that other methods get.
GIVEN = ("--normals", "use")
EXACT = ("--dense-voxels", 10**12, "--change-tolerance", 1e-5)

#: `run` makes a Result from a laboratory and a scan.
Method = namedtuple("Method", "name title run")


class Spacings(float):
    """A length in mean spacings of a scan."""


def ours(name, title, *options, remesh=False):
    def run(lab, scan):
        words = [f"{word * scan.spacing:.9g}" if isinstance(word, Spacings) else word for word in options]
        return lab.reconstruct(scan.path("scan.ply"), *words, *scan.sensor_options, *([] if remesh else ["--no-remesh"]))

    return Method(name, title, run)


def of_pcl(lab, points, normals, program, *options, merge=False):
    """One of PCL's tools, which read PCD, in floats, and write VTK. \\param merge merges corners of triangles that are
    equal except for rounding"""
    middle, result = points.mean(0), lab.scratch("mesh.ply")
    with tempfile.TemporaryDirectory() as folder:
        cloud, mesh = f"{folder}/cloud", f"{folder}/mesh"
        Surface(points - middle, normals=normals).write(f"{cloud}.ply", "float")
        lab.run("pcl_ply2pcd", f"{cloud}.ply", f"{cloud}.pcd")
        seconds, megabytes = lab.run(program, f"{cloud}.pcd", f"{mesh}.vtk", *options)
        lab.run("pcl_vtk2ply", f"{mesh}.vtk", f"{mesh}.ply")
        found = surfaces.read(f"{mesh}.ply")
    if merge:
        found = found.merged(1e-6 * np.linalg.norm(np.ptp(found.points, axis=0)))
    Surface(found.points + middle, found.triangles).write(result)
    return Result(lab, result, seconds, megabytes)


def of_kazhdan(lab, points, normals, program, depth):
    """PoissonRecon or SSDRecon."""
    cloud, mesh = lab.scratch("cloud.ply"), lab.scratch("mesh.ply")
    Surface(points, normals=normals).write(cloud)
    return Result(lab, mesh, *lab.run(program, "--in", cloud, "--out", mesh, "--depth", depth))


def without_outliers(points, neighbors=50, deviations=1):
    """pcl::StatisticalOutlierRemoval, with the settings of its tutorial."""
    means = cKDTree(points).query(points, neighbors + 1)[0][:, 1:].mean(1)
    return means <= means.mean() + deviations * means.std()


def peers(lab, depths=(8, 11), with_hoppe=True, filtered=False):
    """The installed methods; missing ones are reported. Quick: without the paper's depth of 11. Hoppe's grid is 5 %
    larger than the box: with the tool's default, sides of an object in the box's faces would be missing. \\param
    filtered gives them the scan without its outliers"""
    runs = [(f"poisson-{depth}", f"pcl::Poisson, depth {depth}", of_pcl, "pcl_poisson_reconstruction", "-depth", depth)
            for depth in depths if depth < 10 or not lab.quick]
    if with_hoppe:
        runs.append(("hoppe", "pcl::MarchingCubesHoppe, 128³", lambda *all: of_pcl(*all, merge=True),
                     "pcl_marching_cubes_reconstruction", "-hoppe", 1, "-grid_res", 128, "-extend", .05))
    runs += [(program, f"{program}, depth {depths[0]}", of_kazhdan, program, depths[0])
             for program in ("PoissonRecon", "SSDRecon")]
    missing = [name for name in [run[3] for run in runs] + ["pcl_vtk2ply", "pcl_ply2pcd"] if not lab.find(name)]
    if missing:
        lab.say("Not on PATH, and so not measured: " + ", ".join(dict.fromkeys(missing)) + ".")

    def method(name, title, make, *words):
        def run(lab, scan):
            kept = without_outliers(scan.cloud.points) if filtered else slice(None)
            return make(lab, scan.cloud.points[kept], scan.cloud.normals[kept], *words)

        return Method(name + "-filtered" * filtered, title + ", after statistical outlier removal" * filtered, run)

    return [method(*run) for run in runs if run[3] not in missing]


def tries(lab, key, methods, scan, measured):
    """Yields each method, a function that gives its result on a scan, and the measures of that, stored as case
    KEY/NAME. \\param scan a function that makes it \\param measured a function of a result and a scan"""
    for method in methods:
        run = cache(lambda method=method: method.run(lab, scan()))
        yield method, run, lab.case(f"{key}/{method.name}", lambda: measured(run(), scan()))


def compared(lab, key, methods, scan, measured, caption=None):
    """Runs the methods as above. \\return a row for each method, and for pictures the titles and functions that give
    the meshes of the methods that made one \\param caption a figure, in %, that is added to each title"""
    rows, shown = [], []
    for method, run, found in tries(lab, key, methods, scan, measured):
        rows.append({"method": method.title, **found})
        if "failed" not in found:
            title = f"{method.title}: {found[caption]:.3g} %" if caption else method.title
            shown.append((title, lambda run=run: run().mesh))
    return rows, shown


def measure_scans(lab, key, names, count, methods, make, measured=None):
    """\\param make makes a scan from the name of an object and an index below the count
    \\param measured as above; none: measure \\return by method the results of all scans; and the scans, (object, index)"""
    results, scans = {method: [] for method in methods}, [(name, index) for name in names for index in range(count)]
    for name, index in scans:
        for method, _, found in tries(lab, f"{key}/{name}/{index}", methods, partial(make, lab, name, index),
                                      measured or measure):
            results[method].append(found)
    return results, scans


def measure(result, scan):
    """A surface against the scan it was made from, lengths in % of the object's diagonal: RMS distance of the points
    where they truly are to the surface (accuracy), of each hole's held-out points (holes; null: too few), of the
    surface to the object, share of its area farther than 1 % from the object (invented), pieces and flaws."""
    percent, held_out = 100 / scan.diagonal, scan.held_out.points
    found = result.evaluate("--clean", scan.path("clean.ply"), "--samples", 1)
    shape, to_object = found["mesh"], percent * scan.truth(result.mesh.samples(30000, 1))
    return {"accuracy RMS %": percent * found["distances"]["clean"]["rms"],
            "holes": rms_per_hole(percent * surfaces.distances(held_out, result.mesh),
                                  hole_of_each(held_out, scan.holes), len(scan.holes)),
            "surface to object RMS %": rms(to_object), "invented area %": 100 * float(np.mean(to_object > 1)),
            "components": shape["components"], "triangles": shape["triangles"],
            "flaws": shape["nonManifoldEdges"] + shape["nonManifoldVertices"] + shape["degenerateTriangles"],
            "CPU s": result.seconds, "MB": round(result.megabytes)}
