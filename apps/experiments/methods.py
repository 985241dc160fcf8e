# SPDX-License-Identifier: BSD-3-Clause
"""What is compared: ours with its options, and other programs that are installed."""

import numpy as np

from . import surfaces
from .figures import hole_of_each, rms, rms_per_hole
from .laboratory import Failure, Result

PRIORS = {1: "membrane", 2: "thin-plate", 3: "triharmonic"}
PRIOR_NAMES = {k: f"k = {k}, {word.replace('-', ' ')}" for k, word in PRIORS.items()}
#: Of the paper, in which normals are estimated; given here, where others are given them.
PAPER = ("--preset", "paper", "--normals", "use")
EXACT = ("--dense-voxels", 10**12, "--change-tolerance", 1e-5)


class Spacings(float):
    """A length in mean spacings of a scan."""


def lengths(options, spacing):
    return [f"{option * spacing:.9g}" if isinstance(option, Spacings) else option for option in options]


class Method:
    """\\param run of a laboratory and a scan: a Result"""

    def __init__(self, name, title, run):
        self.name, self.title, self.run = name, title, run


def ours(name, title, *options, remesh=False):
    words = options if remesh else ("--no-remesh",) + options
    return Method(name, title, lambda lab, scan: lab.reconstruct(scan.path("scan.ply"), *lengths(words, scan.spacing)))


def of_pcl(lab, program, points, normals, *options, merge=False):
    """One of PCL's tools, which read PCD, in floats, and write VTK."""
    offset = points.mean(0)
    cloud, mesh, converted = (lab.scratch(name) for name in ("cloud.pcd", "mesh.vtk", "mesh.ply"))
    surfaces.write_pcd(cloud, points - offset, normals)
    seconds, megabytes = lab.run(program, cloud, mesh, *options)
    lab.run("pcl_vtk2ply", mesh, converted)
    return Result(converted, seconds, megabytes, offset=offset, merge=merge)


def poisson(lab, points, normals, depth):
    return of_pcl(lab, "pcl_poisson_reconstruction", points, normals, "-depth", depth)


def hoppe(lab, points, normals):
    """A grid 5 % larger than the box: without that, the tool's default, sides of an object that lie in it are left
    out."""
    return of_pcl(lab, "pcl_marching_cubes_reconstruction", points, normals, "-hoppe", 1, "-grid_res", 128, "-extend",
                  .05, merge=True)


def kazhdan(lab, points, normals, program, depth, *options):
    """PoissonRecon or SSDRecon."""
    cloud, mesh = lab.scratch("cloud.ply"), lab.scratch("mesh.ply")
    surfaces.write_ply(cloud, points, normals)
    seconds, megabytes = lab.run(program, "--in", cloud, "--out", mesh, "--depth", depth, *options)
    return Result(mesh, seconds, megabytes)


def as_they_are(scan):
    return scan.cloud.points, scan.cloud.normals


def peers(lab, poissons=(8, 11), with_hoppe=True, given=as_they_are):
    """Those that are installed; the others are said to be missing. Quick: without the paper's depth of 11.
    \\param given what they get of a scan: points and normals"""
    runs = {"pcl_poisson_reconstruction": [(f"poisson-{depth}", f"pcl::Poisson, depth {depth}", poisson, depth)
                                           for depth in poissons if depth < 10 or not lab.quick],
            "pcl_marching_cubes_reconstruction": [("hoppe", "pcl::MarchingCubesHoppe, 128³", hoppe)] * with_hoppe}
    for program in ("PoissonRecon", "SSDRecon"):
        runs[program] = [(program, f"{program}, depth {poissons[0]}", kazhdan, program, poissons[0])]
    missing = [program for program in [*runs, "pcl_vtk2ply"] if not lab.find(program)]
    if missing:
        lab.say("Not on PATH, and so not measured: " + ", ".join(missing) + ".")
    return [Method(name, title, lambda lab, scan, run=run, more=more: run(lab, *given(scan), *more))
            for program, those in runs.items() if program not in missing for name, title, run, *more in those]


def lazily(make):
    """A function that makes a thing once, when it is asked for; and fails again as it failed."""
    made = []

    def get():
        if not made:
            try:
                made.append(make())
            except Failure as failure:
                made.append(failure)
        if isinstance(made[0], Failure):
            raise made[0]
        return made[0]

    return get


def measure(lab, result, scan, truth):
    """A surface against the scan it was made from, lengths in % of the object's diagonal: RMS distance of the points
    where they truly are to the surface (accuracy), of each hole's held-out points (holes; null: too few), of the
    surface to the object (reference), share of its area farther than 1 % from the object (invented), pieces and
    flaws."""
    percent, mesh = 100 / scan.diagonal, result.mesh
    statistics = lab.evaluate(result.path, "--clean", scan.path("clean.ply"), "--samples", 1)
    to_object = truth(mesh.samples(30000, 1)[0])
    held_out = scan.held_out.points
    to_mesh = percent * surfaces.distances(held_out, mesh) if len(held_out) else np.zeros(0)
    shape = statistics["mesh"]
    return {"accuracy": percent * statistics["distances"]["clean"]["rms"],
            "holes": rms_per_hole(to_mesh, hole_of_each(held_out, scan.holes), len(scan.holes)),
            "reference": percent * rms(to_object), "invented": 100 * float(np.mean(to_object > .01 * scan.diagonal)),
            "components": shape["components"], "triangles": shape["triangles"],
            "flaws": shape["nonManifoldEdges"] + shape["nonManifoldVertices"] + shape["degenerateTriangles"],
            "seconds": result.seconds, "megabytes": result.megabytes}
