# SPDX-License-Identifier: BSD-3-Clause
"""Figures 2 to 5: remeshing, the priors, confidence, a large hole."""

from functools import partial

import numpy as np

from . import drawing, surfaces
from .figures import summary
from .methods import GIVEN, PAPER, PRIOR_NAMES, PRIORS, compared, measure_scans, ours, peers, tries


def own_methods():
    """Our method with each prior, and the paper's preset."""
    return [ours(f"k{k}", PRIOR_NAMES[k], "--prior", word, remesh=True) for k, word in PRIORS.items()
            ] + [ours("paper", "preset paper (k = 2)", *PAPER, *GIVEN, remesh=True)]


def fig_2(lab):
    """The mesh that the polygonizer cuts out of the voxels, and the same remeshed, with our defaults and with the
    preset `paper`; nothing is trimmed. The points of the bunny and of a torus come without normals. Poisson's meshes of
    the torus, with its normals, are beside them.

    Quality is twice the inradius over the circumradius: 1 for an equilateral triangle. The area variance is relative to
    the square of the mean area. Checks violated counts, of eight, those that fail: non-manifold edges, non-manifold
    vertices, degenerate triangles, self-intersections, unused vertices, and a number of components, an Euler
    characteristic or a number of boundary loops other than before. The paper's figure shows the same histograms."""
    rows, charts = [], {}
    torus = lab.scan("torus:major=1,minor=.4", "--views", 0, "--points", lab.points(12000))
    clouds = {"torus": torus.cloud.points}
    if "bunny" in lab.objects():
        clouds["bunny"] = surfaces.read(lab.objects()["bunny"]).points[::5 if lab.quick else 1]
    for name, points in clouds.items():
        cloud = lab.scratch("cloud.ply")
        surfaces.Surface(points).write(cloud)
        for preset, options in (("default", ()), ("paper", PAPER)):
            measured = lab.case(f"fig-2/{name}-{preset}", lambda: _before_and_after(lab, cloud, options))
            if "failed" in measured:
                rows.append({"object": name, "method": preset, **measured})
                continue
            charts[f"{name}, {preset}"] = measured
            rows += [{"object": name, "method": preset, "mesh": when, **measured[when]} for when in ("before", "after")]
    others, _ = compared(lab, "fig-2/torus", peers(lab, with_hoppe=False), lambda: torus,
                         lambda made, _: _mesh_figures(made.evaluate()["mesh"]))
    lab.table("fig-2", "Meshes before and after remeshing", rows + [{"object": "torus", **row} for row in others])
    lab.picture("fig-2", lambda: _histograms(charts))


def _before_and_after(lab, cloud, options):
    before = lab.reconstruct(cloud, "--trim", "none", "--no-remesh", *options)
    found = lab.reconstruct(cloud, "--trim", "none", *options).evaluate("--reference", before.path)
    off = found["distances"]["meshToReference"]["rms"] / before.report["options"]["multiscale"]["voxelSize"]
    mesh = before.evaluate()["mesh"]
    return {"before": _mesh_figures(mesh), "after": {**_mesh_figures(found["mesh"], mesh),
                                                     "from the mesh before, voxels RMS": off}}


def _mesh_figures(mesh, before=None):
    faults = [mesh[name] for name in ("nonManifoldEdges", "nonManifoldVertices", "degenerateTriangles",
                                      "selfIntersectingTriangles", "unusedVertices")]
    faults += [mesh[name] - (before or mesh)[name] for name in ("components", "eulerCharacteristic", "boundaryLoops")]
    return {"triangles": mesh["triangles"], "mean quality": mesh["meanQuality"], "lowest quality": mesh["minQuality"],
            "vertices with 6 edges, %": 100 * mesh["valences"][6] / mesh["vertices"], "area variance": mesh["areaVariance"],
            "checks violated": sum(fault != 0 for fault in faults), "valences": mesh["valences"], "areas": mesh["areas"],
            "area step": [mesh["areaStep"]]}


def _histograms(charts):
    figure, axes = drawing.panels([f"{title}: {what}" for title in charts for what in ("edges of a vertex", "areas")], 4)
    for n, measured in enumerate(charts.values()):
        for when, shift in (("before", -.2), ("after", .2)):
            mesh = measured[when]
            valences, areas, step = np.array(mesh["valences"]), np.array(mesh["areas"]), mesh["area step"][0]
            axes[2 * n].bar(np.arange(3, 11) + shift, 100 * valences[3:11] / valences.sum(), .4, label=when)
            at = (np.arange(len(areas)) + .5 + shift) * step
            axes[2 * n + 1].bar(at, 100 * areas / areas.sum(), .4 * step, label=when)
        axes[2 * n].set_ylabel("% of vertices")
        axes[2 * n].legend()
        axes[2 * n + 1].set(xlabel="area / mean area; last: all above", ylabel="% of triangles")
    return figure


RADIUS, LENGTH, GAP = .25, 1, .5


def fig_3(lab):
    """Two open tubes along one axis, and a collection of spheres, boxes, a torus, a cylinder and a plate, each covered
    evenly with points and exact normals. Lengths are in mean spacings of the points, half a voxel of our default. In
    the gap the truth is taken to be the straight tube that goes through both: distances are from places of it to the
    surface, so that a gap that is not bridged counts as well. Elsewhere, and for the primitives, they are from samples
    of the surface to the exact shape.

    The paper's figure shows that the membrane (differences of neighbors) closes what is open with the least area, while
    the thin plate (Laplacian) continues the tangents."""
    shapes = {"tubes": (f"tubes:radius={RADIUS},length={LENGTH},gap={GAP}", lab.points(8000), _tubes,
                        drawing.View((.12, .3, 1), extent=3.2)),
              "primitives": ("primitives", lab.points(30000), _primitives, drawing.View((.2, .35, 1)))}
    methods = own_methods() + peers(lab, with_hoppe=False)
    for name, (shape, points, measure, view) in shapes.items():
        make = partial(lab.scan, shape, "--views", 0, "--points", points)
        rows, shown = compared(lab, f"fig-3/{name}", methods, make, measure)
        lab.table(f"fig-3-{name}", f"{shape}: distances in mean spacings", rows)
        lab.picture(f"fig-3-{name}", lambda: drawing.gallery(shown, view))


def _tubes(made, scan):
    along, angle = np.meshgrid(GAP * ((np.arange(60) + .5) / 60 - .5), 2 * np.pi * np.arange(120) / 120)
    gap = np.stack([along, RADIUS * np.cos(angle), RADIUS * np.sin(angle)], -1).reshape(-1, 3)
    places = made.mesh.samples(50000, 1)
    axial, radius = np.abs(places[:, 0]), np.hypot(places[:, 1], places[:, 2])
    # The fillings of the open tubes begin beside the ends.
    on_data = (axial > GAP / 2 + 2 * scan.spacing) & (axial < GAP / 2 + LENGTH - 2 * scan.spacing)
    waist = radius[axial < 2 * scan.spacing]
    return {"components": made.evaluate()["mesh"]["components"],
            **summary(surfaces.distances(gap, made.mesh) / scan.spacing, "gap, "),
            **summary((radius[on_data] - RADIUS) / scan.spacing, "elsewhere, "),
            "radius in the middle of the gap": float(waist.mean()) if len(waist) else None}


def _primitives(made, scan):
    return {"components": made.evaluate()["mesh"]["components"],
            **summary(surfaces.primitives(made.mesh.samples(50000, 1)) / scan.spacing)}


#: Lower bounds of the classes of confidence; the first holds the surface without data.
BOUNDS = (0, 1e-6, .5, .75, .9, .95)
CLASSES = ("0 (no data)", "0 – .5", ".5 – .75", ".75 – .9", ".9 – .95", ".95 – 1")


def fig_4(lab):
    """A simulated scan from twelve sides with occlusion and three more holes of 6 to 9 % of the diagonal in radius. Every
    vertex carries the local confidence α: 1 on a data point, falling with the distance to the nearest one, and 0 where
    the prior alone made the surface. The table shows what α says about the error: the distance from the vertices to the
    mesh that was scanned. Those that are nearest to that mesh's border have a share of the area but no error, because
    the truth is not known there."""
    rows, shown = [], []
    for name in [name for name in lab.objects() if name in ("bunny", "igea")]:
        options = ["--points", lab.points(28000), "--holes", 3, "--hole-radius", "6%:9%"]
        methods = [ours(f"{name}-default", f"{name}, default", remesh=True),
                   ours(f"{name}-paper", f"{name}, preset paper", *PAPER, *GIVEN, remesh=True)]
        make = partial(lab.scan, lab.objects()[name], *options)
        for method, run, measured in tries(lab, "fig-4", methods, make, _classes):
            if "failed" in measured:
                rows.append({"object, preset": method.title, **measured})
                continue
            rows += [{"object, preset": method.title, "confidence α": title, **one}
                     for title, one in zip(CLASSES, measured["classes"])]
            shown.append((method.title, lambda run=run: run().mesh))
    lab.table("fig-4", "Error by confidence, % of the diagonal", rows)

    if shown:
        lab.picture("fig-4", lambda: drawing.gallery(shown, drawing.View()))


def _classes(made, scan):
    mesh, truth = made.mesh, surfaces.read(scan.subject)
    unknown = truth.border()[surfaces.nearest(mesh.points, truth.points, which=True)]
    errors, areas = 100 / scan.diagonal * scan.truth(mesh.points), 100 * mesh.vertex_areas() / mesh.areas().sum()
    index = np.searchsorted(BOUNDS, mesh.fields["confidence"], "right") - 1
    classes = [index == n for n in range(len(BOUNDS))]
    return {"classes": [{"area, %": areas[these].sum(), "without truth, %": areas[these & unknown].sum(),
                         **summary(errors[these & ~unknown])} for these in classes]}


def fig_5(lab):
    """Points all over an object, with exact normals, apart from a spherical hole with a radius of 17 % of the diagonal.
    The points that the hole took away are the truth: the error is their distance to the surface. The default with a
    wider volume around the points shows how much of its error comes from the volume's border. In the pictures, surface
    within three mean spacings of a point is gray; what was filled in is colored by its distance to the true surface,
    dark at 3 % of the diagonal. In the table of random holes one hole is one scan; a hole this large takes features
    with it that no prior can know.

    The paper's figure shows the same: the membrane spans the hole like a soap film, the thin plate continues the slope
    of its rim, and Poisson closes it in its own way."""
    methods = own_methods() + [ours("wide", "k = 3, 24 voxels of padding", "--padding", 24, remesh=True)]
    methods += peers(lab, with_hoppe=False)
    points = ["--views", 0, "--points", lab.points(28000), "--hole-radius", "17%"]
    objects = {name: path for name, path in lab.objects().items() if name in ("bunny", "igea", "nefertiti")}
    if "bunny" in objects:
        make = partial(lab.scan, objects["bunny"], *points, "--hole", ".5,.28,.36")
        rows, shown = compared(lab, "fig-5/pictured", methods, make, _hole, "RMS")
        lab.table("fig-5", "The hole in the pictures: error of its held-out points, % of the diagonal", rows)
        lab.picture("fig-5", lambda: drawing.gallery(
            shown, drawing.View((.85, .55, 1), (.1, -.05, 0), 2.6), partial(fill_colors, make()),
            ("the points that face the viewer", make().cloud.points, make().cloud.normals)))
    objects.update({"torus": "torus:major=1,minor=.5", "box": "box:x=2,y=1.5,z=1,rounding=.3"})

    def with_hole(lab, name, index):
        return lab.scan(objects[name], *points, "--holes", 1, seed=1000 * lab.seed + index)

    names, rows = list(objects)[:2 if lab.quick else None], []
    results, scans = measure_scans(lab, "fig-5", names, 1 if lab.quick else 8, methods, with_hole, _hole)
    for name in [*names, "all"]:
        for method in methods:
            known = [found["RMS"] for (of, _), found in zip(scans, results[method]) if name in (of, "all") and "RMS" in found]
            rows.append({"object": name, "method": method.title, "holes": len(known), **({
                "median": np.median(known), "mean": np.mean(known), "worst": max(known)} if known else {})})
    lab.table("fig-5-holes", "Random holes: RMS error of each, % of the diagonal", rows)


def _hole(made, scan):
    return summary(100 / scan.diagonal * surfaces.distances(scan.held_out.points, made.mesh))


def fill_colors(scan, mesh, limit=3):
    """Gray near the scan's points; fillings are colored by the distance to the truth."""
    return drawing.by_error(100 / scan.diagonal * scan.truth(mesh.points), limit,
                            surfaces.nearest(mesh.points, scan.cloud.points) < 3 * scan.spacing)
