# SPDX-License-Identifier: BSD-3-Clause
"""Clouds as scanners deliver them, meshes of random scans, and what the options are for."""

import numpy as np

from . import drawing, surfaces
from .figures import rms
from .laboratory import BUNNY, cells
from .methods import kazhdan, lazily, poisson


class Cloud:
    """Points to reconstruct, and those withheld from them."""

    def __init__(self, name, title, points, normals, discs, random, sensors, has_noisy_rest, view=None):
        self.name, self.title, self.points, self.normals, self.discs, self.random = (name, title, points, normals, discs,
                                                                                     random)
        self.sensors, self.has_noisy_rest = sensors, has_noisy_rest
        self.view = view or drawing.View(sensors[0] - points.mean(0) if len(sensors) == 1 else (.35, .3, 1))

    def sensor_options(self):
        return ["--sensor", ",".join(f"{x:.17g}" for x in self.sensors[0])] if len(self.sensors) == 1 else []


def withheld(points, seed):
    """Which points lie in discs with radii of 5 to 10 local spacings, and which are of a random tenth of the others."""
    random, spacings, discs = np.random.default_rng(seed), surfaces.local_spacings(points), []
    for _ in range(1000):  # small or crowded clouds have fewer
        i, radius = random.integers(len(points)), random.uniform(5, 10)
        if all(np.linalg.norm(points[i] - center) > spacings[i] * radius + other for center, other in discs):
            discs.append((points[i], spacings[i] * radius))
        if len(discs) == 16:
            break
    in_disc = np.zeros(len(points), bool)
    for center, radius in discs:
        in_disc |= np.linalg.norm(points - center, axis=1) < radius
    return in_disc, ~in_disc & (random.random(len(points)) < .1)


def _cloud_of(name, title, cloud, truth, sensors, is_noisy, seed, view=None):
    in_disc, is_random = withheld(cloud.points, seed)
    kept = ~in_disc & ~is_random
    return Cloud(name, title, cloud.points[kept], cloud.normals[kept], truth[in_disc], truth[is_random], sensors, is_noisy,
                 view)


def real_clouds(lab):
    """Those of --data, and simulated ones: rays on an angular grid, noise of a fifth of the mean spacing."""
    for folder in sorted((lab.data / "real").glob("*/input.ply")) if lab.data else []:
        folder = folder.parent
        cloud = surfaces.read(str(folder / "input.ply"))
        title = f"{folder.name} (--data)"
        sensors = np.loadtxt(folder / "sensors.txt", ndmin=2) if (folder / "sensors.txt").exists() else np.zeros((0, 3))
        rest = [folder / "heldout.ply", folder / "heldout_random.ply"]
        if all(path.exists() for path in rest):
            yield Cloud(folder.name, title, cloud.points, cloud.normals, *(surfaces.read(str(path)).points
                                                                           for path in rest), sensors, True)
        else:
            yield _cloud_of(folder.name, title, cloud, cloud.points, sensors, True, lab.seed)
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
        scan = lab.scan(subject, "--points", points // 5 if lab.quick else points, "--sampling", "scanner", "--noise", ".2s",
                        *options)
        yield _cloud_of(name, title, scan.cloud, scan.clean.points, scan.sensors, False, lab.seed, view)


def real(lab):
    """Clouds as scanners deliver them: open, of uneven density, with clutter. Those of --data/real were measured; the
    others are simulated: rays on a regular angular grid from one sensor (terrain: three), so that density falls with
    distance and angle, with a noise of a fifth of the mean spacing. Two kinds of points are withheld from all methods:
    discs with radii of 5 to 10 local spacings, and a random tenth.

    The local spacing of a point is .313 times the distance to its 8th neighbor; RMS distances are given in the median
    of the cloud. Near is the share of the input within 5 of its own local spacings of the mesh: a point that was
    dropped is not. Invented is the share of the mesh's area that is farther than 10 local spacings from the input,
    flipped the share of the given normals against the nearest triangle, dropped that of the input that the method did
    not use.

    All methods are given the same normals, apart from the row that estimates them. Nothing is remeshed. Poisson's
    surface is not trimmed: what it invents is to be cut off by the user."""
    columns = ["cloud", "method", "discs RMS", "random RMS", "input RMS", "near %", "invented %", "flipped %", "dropped %",
               "points", "unevenness", "triangles", "CPU s"]
    rows = []
    for cloud in real_clouds(lab):
        path = lab.scratch("cloud.ply")
        surfaces.write_ply(path, cloud.points, cloud.normals)
        bare, discs = lab.scratch("bare.ply"), lab.scratch("discs.ply")
        surfaces.write_ply(bare, cloud.points)
        surfaces.write_ply(discs, cloud.discs)
        methods = {"this (default)": lambda: lab.reconstruct(path, "--no-remesh", *cloud.sensor_options())}
        if cloud.sensor_options():
            methods["this, normals estimated, one sensor known"] = lambda: lab.reconstruct(
                bare, "--no-remesh", *cloud.sensor_options())
        if lab.find("pcl_poisson_reconstruction"):
            methods["pcl::Poisson, depth 9"] = lambda: poisson(lab, cloud.points, cloud.normals, 9)
        if lab.find("PoissonRecon"):
            methods["PoissonRecon, depth 9"] = lambda: kazhdan(lab, cloud.points, cloud.normals, "PoissonRecon", 9)
        shown = []
        for title, make in methods.items():
            run = lazily(make)
            measured = lab.case(f"real/{cloud.name}/{title.replace(' ', '-')}",
                                lambda: _measure_real(lab, run(), cloud, path, discs))
            rows.append([cloud.title, title] + cells(measured, *columns[2:]))
            if "failed" not in measured:
                shown.append((title, run))
        lab.picture(f"real-{cloud.name}", lambda: _side_by_side(shown, cloud.view))
    lab.table("real", "Per cloud: RMS in median local spacings, shares in %", columns, rows)


def _measure_real(lab, made, cloud, path, discs):
    mesh, options = made.mesh, ["--held-out", discs] if len(cloud.discs) else []
    local = lab.evaluate(made.path, "--input", path, "--samples", 100000, *options)["local"]
    counts = made.report.get("points")
    known = counts["input"] - counts["notFinite"] - counts["duplicates"] if counts else 0
    return {"discs RMS": local.get("heldOutRms"),
            "random RMS": rms(surfaces.distances(cloud.random, mesh)) / local["spacing"], "input RMS": local["cloudRms"],
            "near %": round(100 * local["nearShare"], 2), "invented %": 100 * local["inventedShare"],
            "flipped %": 100 * local["flippedShare"] if "flippedShare" in local else None,
            "dropped %": 100 * (1 - counts["used"] / known) if known else None, "points": len(cloud.points),
            "unevenness": local["unevenness"], "triangles": len(mesh.triangles), "CPU s": made.seconds}


def _side_by_side(shown, view):
    figure, axes = drawing.panels([title for title, _ in shown])
    for axis, (_, run) in zip(axes, shown):
        drawing.draw_surface(axis, run().mesh, view)
    return figure


def random_scan(seed, index):
    """An object of a kind that the index chooses, its scan's seed and options, and whether the scan has normals."""
    random = np.random.default_rng([seed, index])

    def few(lower, upper):  # digits, so that a command line repeats it
        return float(f"{random.uniform(lower, upper):.2g}")

    size = few(.1, 10) * 10.**random.integers(-1, 3)
    y, z, closed = few(.2, 1), few(.2, 1), random.integers(2)
    kinds = {"bunny": BUNNY, "sphere": f"sphere:radius={size / 2:g}",
             "torus": f"torus:major={size / 2:g},minor={size * few(.1, .48):g}",
             "sharp box": f"box:x={size:g},y={size * y:g},z={size * z:g}",
             "rounded box": f"box:x={size:g},y={size * y:g},z={size * z:g},rounding={size * few(.05, .45) * min(y, z):g}",
             "tubes": f"tubes:radius={size * few(.1, .4):g},length={size * few(.5, 1.5):g},gap={size * few(.1, .6):g},"
                      f"closed={closed}",
             "primitives": f"primitives:size={.3 * size:g}",
             "plate": f"plate:width={size:g},height={size * few(.5, 1):g},thickness={size * few(.01, .15):g}",
             "cheese": f"cheese:side={size:g},bubbles={random.integers(30)},radius={few(.08, .2)}",
             "cut sphere": f"cut-sphere:radius={size / 2:g},angle={few(20, 140)}",
             "plane": f"plane:width={size:g},height={size * few(.3, 1):g}"}
    kind = list(kinds)[index % len(kinds)]
    angle = few(0, .5) if random.random() < .75 else 0
    options = ["--points", random.integers(3000, 5001), "--sampling",
               random.choice(["even", "random"]), "--rotate", ",".join(map(str, random.integers(0, 360, 3))), "--noise",
               f"{few(0, 1) if random.random() < .75 else 0}s", "--outliers", few(0, 3) if random.random() < .75 else 0,
               "--misalign-angle", angle, "--misalign-shift", f"{few(0, .5) if angle else 0}s", "--holes",
               random.integers(5), "--hole-radius", "4%:10%"]
    return kind, kinds[kind], int(random.integers(1, 10**6)), [str(option) for option in options], bool(random.random() < .5)


def robustness(lab):
    """Scans drawn at random: object, its proportions, size and rotation; 3,000 to 5,000 points; noise of 0 to 1 mean
    spacing; 0 to 3 % outliers; 0 to 4 holes; misaligned views; half of them without normals, which are then estimated
    and face their sensors. Each is reconstructed with the default options, remeshing included.

    A mesh is without fault if every edge and every vertex is manifold, neighboring triangles agree on the orientation,
    no triangle is degenerate, none intersects another (exact predicates), closed meshes are not inside out, and a mesh
    is closed unless an extrapolation was trimmed. Accuracy is not judged here: some of these scans do not determine
    their object. Quality is twice the ratio of the radii of a triangle's inner and outer circle."""
    groups, failures = {}, []
    for index in range(12 if lab.quick else 100):
        kind, subject, seed, options, has_normals = random_scan(lab.seed, index)
        measured = lab.case(f"robustness/{index}", lambda: _check(lab, subject, seed, options, has_normals))
        groups.setdefault(kind, []).append(measured)
        groups.setdefault("all", []).append(measured)
        if measured.get("failed") or measured["faults"]:
            failures.append([index, measured.get("failed") or "; ".join(measured["faults"]),
                             f"pcl_mrf_scan {subject} scan.ply --seed {seed} {' '.join(options)}"
                             + ("" if has_normals else " --normals none, with sensors and views")])
    rows = []
    for kind, found in groups.items():
        good = [one for one in found if "failed" not in one]
        rows.append([kind, len(found), sum(not one["faults"] for one in good), sum(one["closed"] for one in good)] +
                    ([np.mean([one["meanQuality"] for one in good]), min(one["minQuality"] for one in good),
                      100 * np.mean([one["regular"] for one in good])] if good else []))
    lab.table("robustness", "Meshes of random scans", ["object", "scans", "without fault", "closed", "mean quality",
                                                       "lowest quality of a triangle", "vertices with 6 edges, %"], rows)
    if failures:
        lab.table("robustness-failures", "Meshes with faults, and what repeats them", ["scan", "fault", "repeat"], failures)


def _check(lab, subject, seed, options, has_normals):
    scan = lab.scan(subject, *options, *([] if has_normals else ["--normals", "none"]), seed=seed)
    made = lab.reconstruct(scan.path("scan.ply"), *([] if has_normals else [
        "--views", scan.path("views.txt"), "--sensors", scan.path("sensors.txt")]))
    mesh = lab.evaluate(made.path)["mesh"]
    wrong = ("nonManifoldEdges", "nonManifoldVertices", "degenerateTriangles", "unusedVertices",
             "selfIntersectingTriangles")
    faults = [f"{mesh[name]} {name}" for name in wrong if mesh[name]]
    if mesh["boundaryLoops"] and not made.report["trimming"]["extrapolationsDropped"]:
        faults.append(f"{mesh['boundaryLoops']} openings, though nothing was trimmed")
    if not mesh["boundaryEdges"] and not mesh["volume"] > 0:
        faults.append("closed, but inside out")
    return {"faults": faults, "closed": mesh["boundaryEdges"] == 0, "meanQuality": mesh["meanQuality"],
            "minQuality": mesh["minQuality"], "regular": mesh["valences"][6] / mesh["vertices"]}


def trait_cases(lab):
    """Scan options, what is tried (words of the command line), and the view."""
    points, fast = ("--points", 8000 if lab.quick else 28000), "--no-remesh"
    front = drawing.View(focus=(0, 0, 0), extent=2.45)
    return {
        "holes": ((*points, "--views", 8, "--hole", ".45,.32,.4", "--hole", "-.75,.25,.35", "--hole", "0,-.45,.7",
                   "--hole-radius", "6%"), ("", fast, f"{fast} --prior thin-plate", f"{fast} --quality draft"), front),
        "noisy": ((*points, "--noise", "1s", "--normals", "none"), ("--observation plane", ""), front),
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
    in % of the diagonal. Surface without data lies farther than three mean spacings from every point.

    In pictures with two colors, blue is surface without data. One object says which way an option works, not how much
    it gains on another."""
    if "bunny" not in lab.objects():
        lab.say("Nothing was measured: Debian's package glmark2-data with the bunny is not installed.")
        return
    rows, subject = [], lab.objects()["bunny"]
    for name, (options, tried, view) in trait_cases(lab).items():
        scan, shown = lazily(lambda: lab.scan(subject, *options)), []
        sensors = "none" in options  # that is without normals

        def made(words):
            known = ["--views", scan().path("views.txt"), "--sensors", scan().path("sensors.txt")] if sensors else []
            return lab.reconstruct(scan().path("scan.ply"), *words.split(), *known)

        for words in tried:
            run = lazily(lambda words=words: made(words))
            measured = lab.case(f"guide/{name}/{words.replace(' ', '') or 'default'}",
                                lambda: _measure_trait(lab, run(), scan(), lab.truth(subject)))
            rows.append([name, words or "default"] + cells(measured, *measured))
            if "failed" not in measured:
                shown.append((words or "default", run))
        lab.picture(f"guide-{name}", lambda: _trait_picture(scan(), shown, view, name not in ("noisy", "clusters", "sparse")))
    lab.table("guide", "Options against traits of the scan",
              ["scan", "options", "points to surface", "held-out points to surface", "surface to object",
               "surface without data, %", "components", "CPU s"], rows)


def _measure_trait(lab, made, scan, truth):
    percent, mesh = 100 / scan.diagonal, made.mesh
    held_out = ["--held-out", scan.path("held-out.ply")] if scan.holes else []
    found = lab.evaluate(made.path, "--clean", scan.path("clean.ply"), *held_out)
    places = mesh.samples(50000, lab.seed)[0]
    return {"clean": percent * found["distances"]["clean"]["rms"],
            "heldOut": percent * found["distances"]["heldOut"]["rms"] if scan.holes else None,
            "truth": percent * rms(truth(places)),
            "without": 100 * np.mean(surfaces.nearest(places, scan.cloud.points) > 3 * scan.spacing),
            "components": found["mesh"]["components"], "seconds": made.seconds}


def _trait_picture(scan, shown, view, has_confidence):
    figure, axes = drawing.panels(["points"] + [title for title, _ in shown])
    normals = scan.cloud.normals
    if normals is None:
        normals = surfaces.estimated_normals(scan.cloud.points, scan.views, scan.sensors)
    drawing.draw_points(axes[0], scan.cloud.points, normals, view)
    for axis, (_, run) in zip(axes[1:], shown):
        mesh = run().mesh
        drawing.draw_surface(axis, mesh, view, drawing.by_confidence(mesh) if has_confidence else None)
    return figure
