# SPDX-License-Identifier: BSD-3-Clause
"""Experiments with clouds as scanners deliver them, and with the options for their traits."""

from functools import partial
from pathlib import Path

import numpy as np

from . import drawing, surfaces
from .figures import rms
from .methods import compared, ours, peers
from .surfaces import Surface


class Cloud:
    """A scan without known truth, apart from points that were withheld from it, in discs and at random."""

    def __init__(self, lab, name, title, cloud, discs, random, sensors=(), has_noisy_rest=True, view=None):
        self.name, self.title, self.cloud, self.normals = name, title, cloud, cloud.normals
        self.discs, self.random, self.has_noisy_rest = discs, random, has_noisy_rest
        self.sensor_options = ["--sensor", ",".join(f"{x:.17g}" for x in sensors[0])] if len(sensors) == 1 else []
        self.view = view or drawing.View(sensors[0] - cloud.points.mean(0) if len(sensors) == 1 else (.35, .3, 1))
        self._folder = Path(lab.scratch("cloud"))
        self._folder.mkdir()
        cloud.write(self.path("scan.ply"))
        Surface(discs).write(self.path("discs.ply"))

    def path(self, name):
        return str(self._folder / name)


def real_clouds(lab):
    """The clouds of --data, and simulated ones: rays on an angular grid, noise of a fifth of the mean spacing."""
    for path in sorted((lab.data / "real").glob("*/heldout_random.ply")) if lab.data else []:
        parts = [surfaces.read(str(path.with_name(name))) for name in ("input.ply", "heldout.ply", path.name)]
        sensors = path.with_name("sensors.txt")
        yield Cloud(lab, path.parent.name, f"{path.parent.name} (--data)", parts[0], parts[1].points, parts[2].points,
                    np.loadtxt(sensors, ndmin=2) if sensors.exists() else ())
    front, street = ("--placement", "front", "--views"), ("--axis", "0,0,1", "--front", "1,0,0", "--sensor", "0,0,1.8")
    simulated = [("table", "objects on a table before a wall", "table", 60000,
                  (*front, 1, "--distance", .7, "--elevation", 25), None),
                 ("terrain", "terrain from three flights", "terrain", 40000,
                  (*front, 3, "--aspect", 3, "--distance", .8, "--fan", 60), drawing.View((.4, -1, .9), up=(0, 0, 1))),
                 ("street", "a street around a lidar", "street", 40000,
                  (*street, "--aspect", 8, "--elevations", "-30:30"), drawing.View((-.5, -.6, .8), up=(0, 0, 1)))]
    simulated += [(f"{name}-front".replace(" ", "-"), f"{name} from the front", path, 30000, (*front, 1), None)
                  for name, path in list(lab.objects().items())[:3]]
    for name, title, subject, points, options, view in simulated[:1 if lab.quick else None]:
        scan = lab.scan(subject, "--points", lab.points(points), "--sampling", "scanner", "--noise",
                        ".2s", "--holes", 16, "--hole-radius", "5s:10s", *options)
        is_random = np.random.default_rng(lab.seed).random(len(scan.cloud.points)) < .1
        kept = Surface(scan.cloud.points[~is_random], normals=scan.cloud.normals[~is_random])
        yield Cloud(lab, name, title, kept, scan.held_out.points, surfaces.read(scan.path("clean.ply")).points[is_random],
                    np.loadtxt(scan.path("sensors.txt"), ndmin=2), False, view)


def real(lab):
    """Clouds as scanners deliver them: open, of uneven density, with clutter. Those of --data/real were measured; the
    others are simulated: rays on a regular angular grid from one sensor (terrain: three), with a noise of a fifth of the
    mean spacing. Withheld from all methods are discs with radii of 5 to 10 spacings and a random tenth.

    The local spacing of a point is .313 times the distance to its 8th neighbor; RMS distances are given in the median
    of the cloud. Near is the share of the input within 5 of its own local spacings of the mesh: a point that was
    dropped is not. Invented is the share of the mesh's area that is farther than 10 local spacings from the input,
    flipped the share of the given normals against the nearest triangle, dropped that of the input that the method did
    not use. All methods are given the same normals, apart from the row that estimates them. Nothing is remeshed;
    Poisson's surface is not trimmed."""
    rows, others = [], peers(lab, (9,), with_hoppe=False)
    for cloud in real_clouds(lab):
        methods = [ours("default", "this (default)")]
        if cloud.sensor_options:
            methods.append(ours("estimated", "this, normals estimated, one sensor known", "--normals", "estimate"))
        found, shown = compared(lab, f"real/{cloud.name}", methods + others, lambda: cloud, _measure_real)
        rows += [{"cloud": cloud.title, **row} for row in found]
        lab.picture(f"real-{cloud.name}", lambda: drawing.gallery(shown, cloud.view, lambda mesh: None))
    lab.table("real", "Per cloud: RMS in median local spacings, shares in %", rows)


def _measure_real(made, cloud):
    options = ["--held-out", cloud.path("discs.ply")] if len(cloud.discs) else []
    local = made.evaluate("--input", cloud.path("scan.ply"), "--samples", 100000, *options)["local"]
    counts = made.report.get("points")
    known = counts["input"] - counts["notFinite"] - counts["duplicates"] if counts else 0
    return {"discs RMS": local.get("heldOutRms"),
            "random RMS": rms(surfaces.distances(cloud.random, made.mesh)) / local["spacing"],
            "input RMS": local["cloudRms"],
            "near %": round(100 * local["nearShare"], 2), "invented %": 100 * local["inventedShare"],
            "flipped %": 100 * local["flippedShare"] if "flippedShare" in local else None,
            "dropped %": 100 * (1 - counts["used"] / known) if known else None, "points": len(cloud.cloud.points),
            "unevenness": local["unevenness"], "triangles": len(made.mesh.triangles), "CPU s": made.seconds}


def trait_cases(lab):
    """The scan options, the settings to try (words of the command line), and the view."""
    points, fast = ("--points", lab.points(28000)), "--no-remesh"
    front = drawing.View(focus=(0, 0, 0), extent=2.45)
    return {
        "holes": ((*points, "--views", 8, "--hole", ".45,.32,.4", "--hole", "-.75,.25,.35", "--hole", "0,-.45,.7",
                   "--hole-radius", "6%"), ("", fast, f"{fast} --prior thin-plate", f"{fast} --quality draft"), front),
        "noisy": ((*points, "--noise", "1s", "--normals", "estimated"), ("--observation plane", ""), front),
        "clusters": ((*points, "--clusters", 3), ("", "--robust"), front),
        "sparse": (("--points", 2000), ("", "--quality fine"), front),
        "open": ((*points, "--placement", "front", "--views", 3, "--fan", 70), ("--trim none", "", "--trim supported"),
                 drawing.View((1.5, .5, .2), (0, 0, 0), 2.45)),
        "large-hole": ((*points, "--views", 0, "--hole", ".5,.28,.36", "--hole-radius", "22%"),
                       ("--prior membrane", "--padding 4", ""), drawing.View((.85, .55, 1), (0, 0, 0), 2.45))}


def guide(lab):
    """Simulated scans of the bunny, each with the trait that calls for an option: noise of one mean spacing (normals
    estimated, with the sensors known), 3 % false matches in clusters of 30, 2,000 points, scans from the front only, a
    hole with a radius of 22 % of the diagonal; with the defaults, and with what helps. Distances are root mean squares
    in % of the diagonal. Surface without data lies farther than three mean spacings from every point; in pictures with
    two colors it is blue. One object says which way an option works, not how much it gains on another."""
    if "bunny" not in lab.objects():
        lab.say("Nothing was measured: Debian's package glmark2-data with the bunny is not installed.")
        return
    rows = []
    for name, (options, tried, view) in trait_cases(lab).items():
        make = partial(lab.scan, lab.objects()["bunny"], *options)
        paint = (lambda mesh: None) if name in ("noisy", "clusters", "sparse") else drawing.by_confidence
        methods = [ours(words.replace(" ", "") or "default", words or "default", *words.split(), remesh=True)
                   for words in tried]
        found, shown = compared(lab, f"guide/{name}", methods, make, _measure_trait)
        rows += [{"scan": name, **row} for row in found]
        lab.picture(f"guide-{name}", lambda: drawing.gallery(shown, view, paint,
                                                             ("points", make().cloud.points, make().cloud.normals)))
    lab.table("guide", "Options against traits of the scan", rows)


def _measure_trait(made, scan):
    percent, held_out = 100 / scan.diagonal, ["--held-out", scan.path("held-out.ply")] if scan.holes else []
    found = made.evaluate("--clean", scan.path("clean.ply"), *held_out)
    places = made.mesh.samples(50000, 1)
    return {"points to surface": percent * found["distances"]["clean"]["rms"],
            "held-out points to surface": percent * found["distances"]["heldOut"]["rms"] if scan.holes else None,
            "surface to object": percent * rms(scan.truth(places)),
            "surface without data, %": 100 * np.mean(surfaces.nearest(places, scan.cloud.points) > 3 * scan.spacing),
            "components": found["mesh"]["components"], "CPU s": made.seconds}
