# SPDX-License-Identifier: BSD-3-Clause
"""Figures 2 to 5: remeshing, the priors, confidence, a large hole."""

import numpy as np

from . import drawing, surfaces
from .figures import rms, summary
from .laboratory import BUNNY, Failure, cells
from .methods import PAPER, PRIOR_NAMES, PRIORS, lazily, ours, peers

FAULTS = ("nonManifoldEdges", "nonManifoldVertices", "degenerateTriangles", "selfIntersectingTriangles",
          "unusedVertices")


def own_methods(remesh=True):
    """Ours with each prior, and the paper's preset."""
    return [ours(f"k{k}", PRIOR_NAMES[k], "--prior", word, remesh=remesh) for k, word in PRIORS.items()
            ] + [ours("paper", "preset paper (k = 2)", *PAPER, remesh=remesh)]


def fig_2(lab):
    """The mesh that the polygonizer cuts out of the voxels, and the same remeshed, with our defaults and with the
    preset `paper`; nothing is trimmed. The bunny's points are those of the zippered scans, without normals. Poisson's
    meshes are beside them.

    Quality is twice the inradius over the circumradius: 1 for an equilateral triangle. The area variance is relative to
    the square of the mean area. Checks violated counts, of eight, those that fail: non-manifold edges, non-manifold
    vertices, degenerate triangles, self-intersections, unused vertices, and a number of components, an Euler
    characteristic or a number of boundary loops other than before. The paper's figure shows the same histograms:
    valences gather at six and areas around one size."""
    columns = ["object", "preset", "mesh", "triangles", "mean quality", "lowest quality", "vertices with 6 edges, %",
               "area variance", "edges off the zero level, voxels RMS", "checks violated"]
    rows, charts = [], {}
    for name in ["bunny"] * ("bunny" in lab.objects()) + ["torus"]:
        cloud = lab.scratch("cloud.ply")
        if name == "bunny":
            surfaces.write_ply(cloud, surfaces.read(BUNNY).points)
        else:
            torus = lab.scan("torus:major=1,minor=.4", "--views", 0, "--points", 4000 if lab.quick else 12000)
            surfaces.write_ply(cloud, torus.cloud.points, torus.cloud.normals)
        for preset, options in (("default", ()), ("paper", ("--preset", "paper"))):
            measured = lab.case(f"fig-2/{name}-{preset}", lambda: _before_and_after(lab, cloud, options))
            if "failed" in measured:
                rows.append([name, preset, measured["failed"]])
                continue
            charts[f"{name}, {preset}"] = measured
            rows += [[name, preset, when] + _mesh_cells(measured[when], measured["before"])
                     for when in ("before", "after")]
        if name == "torus":
            for method in peers(lab, with_hoppe=False):
                measured = lab.case(f"fig-2/{name}-{method.name}",
                                    lambda: lab.evaluate(method.run(lab, torus).path)["mesh"])
                rows.append([name, method.title, measured.get("failed")] +
                            ([] if "failed" in measured else _mesh_cells(measured, measured)))
    lab.table("fig-2", "Meshes before and after remeshing", columns, rows)
    lab.picture("fig-2", lambda: _histograms(charts))


def _before_and_after(lab, cloud, options):
    path = lab.scratch("field.vti")
    before = lab.reconstruct(cloud, "--trim", "none", "--no-remesh", "--field", path, *options)
    after = lab.reconstruct(cloud, "--trim", "none", *options)
    field, result = surfaces.Field(path), {}
    for when, made in (("before", before), ("after", after)):
        corners = made.mesh.corners()
        value, slope = field.at((corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2)
        off = value / np.maximum(np.linalg.norm(slope, axis=1), 1e-3) / field.spacing
        result[when] = dict(lab.evaluate(made.path)["mesh"], offLevel=rms(off))
    return result


def _mesh_cells(mesh, before):
    faults = sum(mesh[name] != 0 for name in FAULTS) + sum(
        mesh[name] != before[name] for name in ("components", "eulerCharacteristic", "boundaryLoops"))
    return [mesh["triangles"], mesh["meanQuality"], mesh["minQuality"], 100 * mesh["valences"][6] / mesh["vertices"],
            mesh["areaVariance"], mesh.get("offLevel"), faults]


def _histograms(charts):
    figure, axes = drawing.panels([f"{title}: {what}" for title in charts for what in ("edges of a vertex", "areas")], 2)
    for n, measured in enumerate(charts.values()):
        for when, shift in (("before", -.2), ("after", .2)):
            mesh = measured[when]
            valences, areas = np.array(mesh["valences"]), np.array(mesh["areas"])
            edges = np.arange(3, 11)
            axes[2 * n].bar(edges + shift, 100 * valences[3:11] / valences.sum(), .4, label=when)
            at = (np.arange(len(areas)) + .5 + shift) * mesh["areaStep"]
            axes[2 * n + 1].bar(at, 100 * areas / areas.sum(), .4 * mesh["areaStep"], label=when)
        axes[2 * n].set_ylabel("% of vertices")
        axes[2 * n + 1].set_xlabel("area / mean area; last: all above")
        axes[2 * n + 1].set_ylabel("% of triangles")
        axes[2 * n].legend()
    return figure


RADIUS, LENGTH, GAP = .25, 1, .5


def fig_3(lab):
    """Two open tubes along one axis, and a collection of spheres, boxes, a torus, a cylinder and a plate, each covered
    evenly with points and exact normals, reconstructed with default options and each of the three priors, with the
    preset `paper` and by Poisson.

    In the gap the truth is taken to be the straight tube that goes through both: distances are from evenly spread
    places of it to the surface, so that a gap that is not bridged counts as well. Elsewhere, and for the primitives,
    they are from evenly spread samples of the surface to the exact shape. Voxels are those of our default.

    The paper's figure shows that the membrane (differences of neighbors) closes what is open with the least area, while
    the thin plate (Laplacian) continues the tangents."""
    methods = own_methods() + peers(lab, with_hoppe=False)
    shapes = {"tubes": (f"tubes:radius={RADIUS},length={LENGTH},gap={GAP}", 3000 if lab.quick else 8000, _tubes,
                        ("gap", "elsewhere"), drawing.View((.12, .3, 1), extent=2.9)),
              "primitives": ("primitives", 8000 if lab.quick else 30000, _primitives, ("surface",),
                             drawing.View((.2, .35, 1)))}
    for name, (shape, points, measure, places, view) in shapes.items():
        scan = lazily(lambda: lab.scan(shape, "--views", 0, "--points", points))
        runs = {method: lazily(lambda method=method: method.run(lab, scan())) for method in methods}
        voxel = lab.case(f"fig-3/{name}/voxel", lambda: {"is": runs[methods[2]]().report["options"]["multiscale"]["voxelSize"]})
        if "failed" in voxel:
            raise Failure(voxel["failed"])
        voxel = voxel["is"]
        figures = [(place, figure) for place in places for figure in ("rms", "percentile95", "max")]
        rows, shown = [], []
        for method, run in runs.items():
            measured = lab.case(f"fig-3/{name}/{method.name}", lambda: measure(lab, run(), voxel))
            flat = {f"{place}, {figure}": measured[place][figure] for place, figure in figures if measured.get(place)}
            rows.append([method.title] + cells({**measured, **flat}, "components", *flat, "waist"))
            if "failed" not in measured:
                shown.append((method.title, run, None))
        lab.table(f"fig-3-{name}", f"{shape}: distances in voxels of {voxel:.3g}",
                  ["method", "components"] + [f"{place}, {figure}" for place, figure in figures] +
                  ["radius in the middle of the gap"] * ("gap" in places),
                  rows if "gap" in places else [row[:-1] for row in rows])
        lab.picture(f"fig-3-{name}", lambda: _gallery(shown, view))


def _tubes(lab, result, voxel):
    along, angle = np.meshgrid(GAP * ((np.arange(200) + .5) / 200 - .5), 2 * np.pi * np.arange(300) / 300)
    gap = np.stack([along, RADIUS * np.cos(angle), RADIUS * np.sin(angle)], -1).reshape(-1, 3)
    places = result.mesh.samples(200000, lab.seed)[0]
    axial, radius = np.abs(places[:, 0]), np.hypot(places[:, 1], places[:, 2])
    # Beside the ends the fillings of the open tubes begin.
    on_data = (axial > GAP / 2 + voxel) & (axial < GAP / 2 + LENGTH - voxel)
    waist = radius[axial < voxel]
    return {"components": lab.evaluate(result.path)["mesh"]["components"],
            "gap": summary(surfaces.distances(gap, result.mesh) / voxel),
            "elsewhere": summary((radius[on_data] - RADIUS) / voxel),
            "waist": float(waist.mean()) if len(waist) else None}


def _primitives(lab, result, voxel):
    return {"components": lab.evaluate(result.path)["mesh"]["components"],
            "surface": summary(surfaces.primitives(result.mesh.samples(200000, lab.seed)[0]) / voxel)}


def _gallery(shown, view, points=None, columns=None):
    """\\param shown title, a function that gives a result, a function that gives colors of its mesh (none: by
    confidence) \\param points positions and normals that a first picture shows"""
    titles = ["the points that face the viewer"] * bool(points) + [title for title, _, _ in shown]
    figure, axes = drawing.panels(titles, columns)
    if points:
        drawing.draw_points(axes[0], *points, view)
    for axis, (_, run, paint) in zip(axes[bool(points):], shown):
        mesh = run().mesh
        colors = paint(mesh) if paint else drawing.by_confidence(mesh) if "confidence" in mesh.fields else None
        drawing.draw_surface(axis, mesh, view, colors)
    return figure


#: Lower bounds of the classes of confidence; the first holds the surface without data.
BOUNDS = (0, 1e-6, .5, .75, .9, .95)
CLASSES = ("0 (no data)", "0 – .5", ".5 – .75", ".75 – .9", ".9 – .95", ".95 – 1")


def fig_4(lab):
    """A simulated scan from twelve sides with occlusion and three more holes of 6 to 9 % of the diagonal in radius,
    reconstructed with default options and with the preset `paper`. Every vertex carries the local confidence α: 1 on a
    data point, falling with the distance to the nearest one, and 0 where the prior alone made the surface.

    The table shows what α says about the error: the distance from evenly spread samples of the surface to the mesh that
    was scanned. Samples whose closest place is at that mesh's border have a share of the area but no error, because the
    truth is not known there. The paper's figure shows the same coloring."""
    rows, bars, shown = [], {}, []
    for name in [name for name in lab.objects() if name in ("bunny", "igea")]:
        path = lab.objects()[name]
        scan = lazily(lambda path=path: lab.scan(path, "--points", 8000 if lab.quick else 28000, "--holes", 3,
                                                 "--hole-radius", "6%:9%"))
        for method in (ours("default", "default", remesh=True), ours("paper", "preset paper", *PAPER, remesh=True)):
            run = lazily(lambda method=method, scan=scan: method.run(lab, scan()))
            measured = lab.case(f"fig-4/{name}-{method.name}", lambda: _classes(lab, run().mesh, path, scan().diagonal))
            if "failed" in measured:
                rows.append([name, method.title, measured["failed"]])
                continue
            for title, one in zip(CLASSES, measured["classes"]):
                errors = one["errors"] or {}
                rows.append([name, method.title, title, one["share"], errors.get("rms"), errors.get("percentile95"),
                             errors.get("max"), measured["unknown"]])
            bars[f"{name}, {method.title}"] = [(one["errors"] or {}).get("rms", 0) for one in measured["classes"]]
            shown.append((f"{name}, {method.title}", run, None))
    if not rows:
        lab.say("Nothing was measured: Debian's package glmark2-data with the bunny is not installed.")
        return
    lab.table("fig-4", "Error by confidence, % of the diagonal",
              ["object", "preset", "confidence α", "area, %", "RMS", "95 %", "largest", "area without truth, %"], rows)

    def draw():
        figure = _gallery(shown, drawing.View(), columns=len(shown) + 1)
        axis = figure.add_subplot(1, len(shown) + 1, len(shown) + 1)
        for n, (title, values) in enumerate(bars.items()):
            axis.bar(np.arange(len(values)) + .2 * n, values, .2, label=title)
        axis.set_xticks(range(len(CLASSES)), CLASSES, rotation=60, fontsize=7)
        axis.set_yscale("log")
        axis.set_ylabel("RMS error, % of the diagonal")
        axis.legend(fontsize=7)
        return figure

    lab.picture("fig-4", draw)


def _classes(lab, mesh, path, diagonal):
    truth = surfaces.read(path)
    places, triangles, weights = mesh.samples(50000 if lab.quick else 200000, lab.seed)
    confidence = (weights * mesh.fields["confidence"][mesh.triangles[triangles]]).sum(1)
    errors, closest = surfaces.distances(places, truth, with_triangles=True)
    # Triangles of the truth at its border: what is closest to them may lie beside the known surface.
    edges = np.sort(np.stack([truth.triangles, np.roll(truth.triangles, -1, 1)], -1).reshape(-1, 2), axis=1)
    kinds, uses = np.unique(edges, axis=0, return_counts=True)
    at_border = np.zeros(len(truth.points), bool)
    at_border[kinds[uses == 1]] = True
    unknown = at_border[truth.triangles].any(1)[closest]
    index = np.searchsorted(BOUNDS, confidence, "right") - 1
    return {"unknown": 100 * unknown.mean(),
            "classes": [{"share": 100 * np.mean(index == n),
                         "errors": summary(100 / diagonal * errors[(index == n) & ~unknown])}
                        for n in range(len(BOUNDS))]}


def fig_5(lab):
    """Points all over an object, with exact normals, apart from a spherical hole with a radius of 17 % of the diagonal.
    Default options with each of the three priors, the preset `paper`, and pcl::Poisson. The points that the hole took
    away are the truth: the error is their distance to the surface. The default with a wider volume around the points
    shows how much of its error comes from the volume's border.

    In the pictures, surface within three mean spacings of a point is gray; what was filled in is colored by its
    distance to the true surface, dark at 3 % of the diagonal. In the table of random holes one hole is one scan; a hole
    this large takes features with it that no prior can know, so the worst figures are more about the object than about
    the method.

    The paper's figure shows the same: the membrane spans the hole like a soap film, the thin plate continues the slope
    of its rim, and Poisson closes it in its own way."""
    methods = own_methods() + [ours("wide", "k = 3, 24 voxels of padding", "--padding", 24, remesh=True)]
    methods += peers(lab, with_hoppe=False)
    points = ["--views", 0, "--points", 8000 if lab.quick else 28000, "--hole-radius", "17%"]
    objects = {name: path for name, path in lab.objects().items() if name in ("bunny", "igea", "nefertiti")}
    columns = ["method", "held-out points", "RMS", "95 %", "largest"]
    if "bunny" in objects:
        scan = lazily(lambda: lab.scan(objects["bunny"], *points, "--hole", ".5,.28,.36"))
        rows, shown = [], []
        for method in methods:
            run = lazily(lambda method=method: method.run(lab, scan()))
            measured = lab.case(f"fig-5/pictured/{method.name}", lambda: _hole(run().mesh, scan()))
            rows.append([method.title] + cells(measured, "count", "rms", "percentile95", "max"))
            if "failed" not in measured:
                shown.append((f"{method.title}: {measured['rms']:.3g} %", run,
                              lambda mesh: fill_colors(mesh, scan(), lab.truth(objects["bunny"]))))
        lab.table("fig-5", "The hole in the pictures: error of its held-out points, % of the diagonal", columns, rows)
        lab.picture("fig-5", lambda: _gallery(shown, drawing.View((.85, .55, 1), (.1, -.05, 0), 2.6),
                                              (scan().cloud.points, scan().cloud.normals)))
    objects.update({"torus": "torus:major=1,minor=.5", "box": "box:x=2,y=1.5,z=1,rounding=.3"})
    errors = {method: {} for method in methods}
    for name, subject in list(objects.items())[:2 if lab.quick else None]:
        for hole in range(2 if lab.quick else 8):
            scan = lazily(lambda: lab.scan(subject, *points, "--holes", 1, seed=1000 * lab.seed + hole))
            for method in methods:
                measured = lab.case(f"fig-5/{name}/{hole}/{method.name}",
                                    lambda: _hole(method.run(lab, scan()).mesh, scan()))
                errors[method].setdefault(name, []).append(measured.get("rms"))
    rows = []
    for name in [*errors[methods[0]], "all"]:
        for method in methods:
            known = [error for of, values in errors[method].items() for error in values
                     if error is not None and name in (of, "all")]
            rows.append([name, method.title, len(known)] +
                        [float(figure(known)) for figure in (np.median, np.mean, np.max) if known])
    lab.table("fig-5-holes", "Random holes: RMS error of each, % of the diagonal",
              ["object", "method", "holes", "median", "mean", "worst"], rows)


def _hole(mesh, scan):
    return summary(100 / scan.diagonal * surfaces.distances(scan.held_out.points, mesh))


def fill_colors(mesh, scan, truth, limit=3):
    """Gray near the scan's points, by the distance to the truth in fillings."""
    return drawing.by_error(100 / scan.diagonal * truth(mesh.points), limit,
                            surfaces.nearest(mesh.points, scan.cloud.points) < 3 * scan.spacing)
