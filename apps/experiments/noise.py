# SPDX-License-Identifier: BSD-3-Clause
"""Figures 7 and 8: noise and outliers; the L-curve of beta; error bars."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import spearmanr

from . import drawing, surfaces
from .clouds import real_clouds
from .figures import corner, coverage, mean_over_objects, rms, sparsification
from .laboratory import cells
from .methods import EXACT, PAPER, Method, Spacings, lazily, lengths, measure, peers
from .patches import COLUMNS, patch_cells, patch_objects, patch_scan, ratio_cells


def noisy_scan(lab, subject, *errors, seed=None):
    """Without normals: they are estimated."""
    return lab.scan(subject, "--points", 6000 if lab.quick else 28000, "--normals", "none", *errors, seed=seed)


def noisy_objects(lab):
    """Real head scans first."""
    names = sorted(lab.objects(), key=lambda name: name not in ("igea", "nefertiti"))
    return names[:1 if lab.quick else 4]


def hard_scan(lab, name, index):
    return noisy_scan(lab, lab.objects()[name], "--noise", "0.25%", "--outliers", 1, "--holes", 6, "--hole-radius",
                      "4%:10%", seed=1000 * lab.seed + index)


def ours_on_noise(name, title, *options):
    def run(lab, scan):
        words = ["--no-remesh", "--views", scan.path("views.txt"), "--sensors", scan.path("sensors.txt")]
        return lab.reconstruct(scan.path("scan.ply"), *words, *lengths(options, scan.spacing))

    return Method(name, title, run)


def facing_normals(scan):
    return surfaces.estimated_normals(scan.cloud.points, scan.views, scan.sensors)


def ours_with_facing(lab, scan):
    cloud = lab.scratch("cloud.ply")
    surfaces.write_ply(cloud, scan.cloud.points, facing_normals(scan))
    return lab.reconstruct(cloud, "--no-remesh")


def without_outliers(points, neighbors=50, deviations=1):
    """pcl::StatisticalOutlierRemoval, with the settings of its tutorial."""
    means = cKDTree(points).query(points, neighbors + 1)[0][:, 1:].mean(1)
    return means <= means.mean() + deviations * means.std()


def with_facing(scan):
    """What others get that cannot do without normals."""
    return scan.cloud.points, facing_normals(scan)


def filtered_with_facing(scan):
    kept = without_outliers(scan.cloud.points)
    return scan.cloud.points[kept], facing_normals(scan)[kept]


RESULTS = ["points' true places to surface, RMS %", "surface to object, RMS %", "invented area %", "components", "CPU s"]


def result_cells(measured):
    return cells(measured, "accuracy", "reference", "invented", "components", "seconds")


def fig_8(lab):
    """Scans from 12 views without normals: this method estimates them and turns them to the sensors. Others are given
    all points, with normals of planes fitted to their neighbors, each facing the sensor that saw its point.

    The error is the distance of the surface from where the scanned points truly are, before noise, in % of the
    diagonal; holes that the views leave do not count, invented surface has its own column: the share of the mesh's area
    farther than 1 % of the diagonal from the object.

    Noise. As in the paper's figures, beta is lowered against noise, with voxel-wise observations and k = 2; the preset
    `paper` is beside them. Our default has no beta: it observes at the points, and chooses its smoothing length by
    points that it left out; the table shows what it found beside the truth. Two rows tell what its errors come from:
    told the noise, it does not choose its smoothing length; given normals that each face their sensor, as the other
    methods are, it does not make them consistent with each other.

    Noisy scans: noise with a standard deviation of .25 % of the diagonal, 1 % outliers, 6 holes per scan with radii of
    4 to 10 %. A ratio below 1 means that the default fills the holes better."""
    subjects = {next(iter(lab.objects())): next(iter(lab.objects().values()))}
    if not lab.quick:
        subjects["primitives"] = "primitives"
    default, others = ours_on_noise("default", "this (default)"), peers(lab, given=with_facing)
    _noise(lab, subjects, default, others)
    _outliers(lab, subjects, default, others)
    methods = [default, ours_on_noise("paper", "this, preset paper", "--preset", "paper"), *others,
               *(Method(method.name + "-filtered", method.title + ", after statistical outlier removal", method.run)
                 for method in peers(lab, (8,), given=filtered_with_facing)),
               ours_on_noise("exact", "this, all levels whole and exact", *EXACT)]
    results = {method: [] for method in methods}
    for name in noisy_objects(lab):
        for index in range(1 if lab.quick else 2):
            scan = lazily(lambda: hard_scan(lab, name, index))
            for method in methods:
                results[method].append(lab.case(
                    f"fig-8/noisy-scan-{index}/{name}/{method.name}",
                    lambda: measure(lab, method.run(lab, scan()), scan(), lab.truth(lab.objects()[name]))))
    lab.table("fig-8-noisy-scans", f"Noisy scans with holes ({', '.join(noisy_objects(lab))}): errors in % of the diagonal",
              ["method", "hole by hole: median of the default's error / its", "95 % from", "to"] + COLUMNS,
              [[method.title] + ratio_cells(results[default], results[method]) + patch_cells(results[method])
               for method in methods])


def _noise(lab, subjects, default, others):
    betas = (.99, .1) if lab.quick else (.99, .5, .1, .05)
    rows, charts = [], {}
    for name, subject in subjects.items():
        for noise in (1,) if lab.quick else (.5, 1, 2):
            scan = lazily(lambda: noisy_scan(lab, subject, "--noise", f"{noise}s"))
            voxelwise = {(kind, beta): ours_on_noise(f"{kind}-{beta}", f"this, voxel-wise {kind}, k = 2, beta {beta}",
                                                     "--observation", kind, "--prior", "thin-plate", "--beta", beta)
                         for kind in ("median", "mean") for beta in betas}
            methods = [default, ours_on_noise("known", "this, told the noise", "--noise", Spacings(noise)),
                       Method("facing", "this, each normal facing its sensor", ours_with_facing),
                       ours_on_noise("paper", "this, preset paper", "--preset", "paper"), *voxelwise.values(), *others]
            found = {}
            for method in methods:
                measured = lab.case(f"fig-8/noise-{noise}/{name}/{method.name}",
                                    lambda: _measure_noisy(lab, method, scan(), lab.truth(subject)))
                found[method] = measured.get("accuracy")
                rows.append([name, noise, method.title] + result_cells(measured) +
                            [measured.get(what) for what in ("inSpacings", "noise", "smoothing")])
            curves = {f"voxel-wise {kind}, k = 2": (betas, [found[voxelwise[kind, beta]] for beta in betas])
                      for kind in ("median", "mean")}
            curves.update({method.title: ((betas[-1], betas[0]), 2 * (found[method],))
                           for method in [default, methods[3], *others]})
            charts[f"{name}, noise of {noise} spacings"] = curves
    lab.table("fig-8-noise", "Noise along the normal", ["object", "noise, spacings", "method"] + RESULTS +
              ["points' true places to surface, spacings", "noise that it found", "smoothing length, spacings"], rows)

    def draw():
        figure, axes = drawing.panels(list(charts), 3)
        for axis, curves in zip(axes, charts.values()):
            drawing.draw_curves(axis, curves, ("beta", "RMS error, % of the diagonal"))
        return figure

    lab.picture("fig-8-noise", draw)


def _measure_noisy(lab, method, scan, truth):
    made = method.run(lab, scan)
    result = measure(lab, made, scan, truth)
    result["inSpacings"] = result["accuracy"] / 100 * scan.diagonal / scan.spacing
    for name, found in (("noise", made.report.get("smoothing", {}).get("noise")),
                        ("smoothing", made.report.get("smoothingLength"))):
        result[name] = found / scan.spacing if found else None
    return result


def _outliers(lab, subjects, default, others):
    settings = [(f"{share} % anywhere", ("--outliers", share)) for share in ((5,) if lab.quick else (0, 1, 2, 5))]
    settings.append(("1 % in clusters", ("--clusters", 1)))
    methods = [default, ours_on_noise("robust", "this, --robust", "--robust"),
               ours_on_noise("median", "this, voxel-wise median, k = 2", "--observation", "median", "--prior",
                             "thin-plate"), ours_on_noise("paper", "this, preset paper", "--preset", "paper"), *others]
    rows = []
    for name, subject in subjects.items():
        for title, errors in settings:
            scan = lazily(lambda: noisy_scan(lab, subject, *errors))
            for method in methods:
                rows.append([name, title, method.title] + result_cells(lab.case(
                    f"fig-8/{errors[0][2:]}-{errors[1]}/{name}/{method.name}",
                    lambda: measure(lab, method.run(lab, scan()), scan(), lab.truth(subject)))))
    lab.table("fig-8-outliers", "Outliers, without noise on the other points", ["object", "outliers", "method"] + RESULTS,
              rows)


def l_curve(lab):
    """The paper's own suggestion for beta: the norm of the prior term over that of the data term, for many betas, with
    the preset `paper` on a scan with noise of one mean spacing. The data term is the RMS of the field at the points
    that were scanned, in voxels; the prior's is the RMS of the field's Laplacian, in voxels. Both are computed from the
    field that the tool writes. The corner is the point with the smallest circle through it and its neighbors; beside it
    stands which beta is in truth the best, by the noise-free points."""
    name, subject = next(iter(lab.objects().items()))
    betas = (.05, .2, .5, .9, .99) if lab.quick else (.01, .02, .05, .1, .2, .35, .5, .7, .8, .9, .95, .99, .999)
    scan, rows = lazily(lambda: lab.scan(subject, "--points", 6000 if lab.quick else 28000, "--noise", ".3s")), []
    for beta in betas:
        measured = lab.case(f"l-curve/{name}/{beta}", lambda: _energies(lab, scan(), beta))
        rows.append([beta] + cells(measured, "data", "prior", "accuracy"))
    good = [row for row in rows if len(row) == 4]
    if len(good) > 2:
        at = corner([row[1] for row in good], [row[2] for row in good])
        best = min(good, key=lambda row: row[3])
        lab.say(f"The corner is at beta = {good[at][0]}, with an error of {good[at][3]:.3g} % of the diagonal; the best of "
                f"these betas is {best[0]}, with {best[3]:.3g} %.")
    lab.table("l-curve", f"{name}, noise of .3 mean spacings",
              ["beta", "data term, RMS voxels", "prior term, RMS voxels", "true places to surface, RMS %"], rows)

    def draw():
        figure, axes = drawing.panels(["prior over data", "error over beta"], size=5)
        drawing.draw_curves(axes[0], {"preset paper": list(zip(*good))[1:3]},
                            ("data term, RMS voxels", "prior term, RMS voxels"), "xy")
        for beta, data, prior, _ in good:
            axes[0].annotate(f"{beta}", (data, prior), fontsize=7)
        drawing.draw_curves(axes[1], {"preset paper": (betas, [row[3] for row in good])},
                            ("beta", "true places to surface, RMS % of the diagonal"))
        return figure

    if good:
        lab.picture("l-curve", draw)


def _energies(lab, scan, beta):
    path = lab.scratch("field.vti")
    made = lab.reconstruct(scan.path("scan.ply"), "--no-remesh", *PAPER, "--beta", beta, "--field", path)
    field = surfaces.Field(path)
    inside = field.distance[1:-1, 1:-1, 1:-1]
    laplacian = -6 * inside
    for axis in range(3):
        for shift in (-1, 1):
            laplacian = laplacian + np.roll(field.distance, shift, axis)[1:-1, 1:-1, 1:-1]
    to_clean = lab.evaluate(made.path, "--clean", scan.path("clean.ply"))["distances"]["clean"]["rms"]
    return {"data": rms(field.at(scan.cloud.points)[0]) / field.spacing, "prior": rms(laplacian) / field.spacing,
            "accuracy": 100 * to_clean / scan.diagonal}


PLACES = {"measured": "measured surface", "fillings": "fillings", "near": "points within 1 spacing",
          "rim": "points 1 to 3 spacings away", "far": "points 3 to 8 spacings away",
          "farthest": "points beyond 8 spacings"}


def uncertainty(lab):
    """Clean scans are those of Table 1, with exact points and normals; noisy ones those of Fig. 8, with noise of .25 %
    of the diagonal, 1 % outliers and no normals. The error of a vertex is its distance to the object, and each stands
    for the area around it. An interval of 50, 80 or 95 % is right if it holds as large a share of the area, and the
    narrower the better. Objects count the same, and the interval of a coverage is a bootstrap over objects. Nothing is
    remeshed.

    Ranking: sparsification leaves out the area that is predicted to be the worst, more and more of it, and looks at the
    RMS error of the rest, beside that of leaving out what is the worst; 0 is perfect. Confidence falls with the
    distance to the nearest point.

    Real clouds are those of `real`, with the same points withheld and with normals given. A withheld point that was
    measured has noise of its own: what has to hold it is an interval of the surface's sigma and the noise together, the
    noise being what the report says of the cloud. The random tenth tells of measured surface, discs with radii of 5 to
    10 local spacings of fillings; those farther than 10 local spacings from any surface are without one, and not
    counted."""
    cases = [("clean", name, index) for name in patch_objects(lab) for index in range(1 if lab.quick else 6)]
    cases += [("noisy", name, index) for name in noisy_objects(lab) for index in range(1 if lab.quick else 2)]
    results = []
    for kind, name, index in cases:
        make = patch_scan if kind == "clean" else hard_scan
        results.append((kind, name, lab.case(f"uncertainty/{kind}/{name}/{index}",
                                             lambda: _bars(lab, make(lab, name, index), lab.objects()[name],
                                                           kind == "clean"))))

    def over_objects(kind, number):
        return mean_over_objects([(name, number(result)) for of, name, result in results
                                  if of == kind and "failed" not in result])

    rows, rankings = [], []
    for kind in ("clean", "noisy"):
        for place, title in PLACES.items():
            def figure(name, factor=1, over=None):
                found = over_objects(kind, lambda result: result[place] and factor * result[place][name] /
                                     (result[place][over] if over else 1))
                return found or dict.fromkeys(("mean", "lower", "upper", "lowest", "where"))

            held = figure("within95", 100)
            rows.append([kind, title, figure("within50", 100)["mean"], figure("within80", 100)["mean"], held["mean"],
                         held["lower"], held["upper"], held["lowest"], held["where"], figure("rms")["mean"],
                         figure("halfWidth", over="rms")["mean"]])
        for predictor in ("sigma", "confidence"):
            rankings.append([kind, predictor] + [(over_objects(kind, lambda result: result[predictor][what]) or
                                                  {}).get("mean") for what in ("sparsification", "rank")])
    lab.table("uncertainty-coverage", "How often the truth is within the intervals, % of the area, and how wide they are",
              ["scans", "where", "50 %", "80 %", "95 %", "95 % from", "to", "worst object", "which", "RMS error, % of the diagonal",
               "median half-width of 95 % / RMS error"], rows)
    lab.table("uncertainty-ranking", "What ranks the errors best: sparsification (0 is perfect) and rank correlation",
              ["scans", "predictor", "sparsification", "rank correlation"], rankings)
    rows = []
    for cloud in real_clouds(lab):
        measured = lab.case(f"uncertainty/real/{cloud.name}", lambda: _real_bars(lab, cloud))
        for place in ("random", "discs", "both"):
            one = measured.get(place)
            rows.append([cloud.title, place] + ([measured["failed"]] if "failed" in measured else one and [
                one["count"], 100 * one["lost"], *(100 * one[f"within{level}"] for level in (50, 80, 95)),
                measured["noise"], one["rms"], one["halfWidth"] / one["rms"], one["bySigma"], one["byConfidence"]] or []))
    lab.table("uncertainty-real", "Real clouds: how often the interval around the surface holds a withheld point, %",
              ["cloud", "withheld", "points", "without surface, %", "50 %", "80 %", "95 %", "noise, spacings",
               "RMS, spacings", "median half-width of 95 % / RMS", "sparsification by sigma", "by confidence"], rows)
    lab.picture("uncertainty", lambda: _bar_pictures(lab, cases[0]))


def _with_bars(lab, scan, subject, has_normals):
    """\\return mesh, errors and sigmas at its vertices, and the areas around those that have both"""
    options = ["--no-remesh", "--uncertainty"]
    if not has_normals:
        options += ["--views", scan.path("views.txt"), "--sensors", scan.path("sensors.txt")]
    mesh = lab.reconstruct(scan.path("scan.ply"), *options).mesh
    sigmas = np.asarray(mesh.fields["sigma"], float)
    weights = np.where(np.isfinite(sigmas) & (sigmas > 0), mesh.vertex_areas(), 0)
    return mesh, lab.truth(subject)(mesh.points), np.where(weights > 0, sigmas, 1), weights


def _rank(errors, sigmas, confidence, weights):
    return {name: {"sparsification": sparsification(errors, doubt, weights),
                   "rank": float(spearmanr(errors[weights > 0], doubt[weights > 0])[0])}
            for name, doubt in (("sigma", sigmas), ("confidence", -confidence))}


def _bars(lab, scan, subject, has_normals):
    mesh, errors, sigmas, weights = _with_bars(lab, scan, subject, has_normals)
    percent, confidence = 100 / scan.diagonal, mesh.fields["confidence"]
    near = np.digitize(surfaces.nearest(mesh.points, scan.cloud.points) / scan.spacing, (1, 3, 8))
    where = [confidence > 0, confidence == 0] + [near == n for n in range(4)]
    result = {place: coverage(percent * errors, percent * sigmas, np.where(there, weights, 0))
              for place, there in zip(PLACES, where)}
    return {**result, **_rank(errors, sigmas, confidence, weights)}


def _real_bars(lab, cloud):
    path = lab.scratch("cloud.ply")
    surfaces.write_ply(path, cloud.points, cloud.normals)
    made = lab.reconstruct(path, "--no-remesh", "--uncertainty", *cloud.sensor_options())
    mesh, spacings = made.mesh, surfaces.local_spacings(cloud.points)
    spacing = float(np.median(spacings))
    noise = made.report["uncertainty"]["noise"] if cloud.has_noisy_rest else 0
    result, parts = {"noise": noise / spacing}, {}
    for place, points in (("random", cloud.random), ("discs", cloud.discs)):
        errors, triangles = surfaces.distances(points, mesh, with_triangles=True)
        corners = mesh.triangles[triangles]
        farness = np.linalg.norm(mesh.points[corners] - points[:, None], axis=2)
        nearest = corners[np.arange(len(points)), farness.argmin(1)]
        local = spacings[cKDTree(cloud.points).query(points)[1]] if len(points) else np.zeros(0)
        parts[place] = (errors, np.hypot(mesh.fields["sigma"][nearest], noise), mesh.fields["confidence"][nearest], local)
    parts["both"] = [np.concatenate(pair) for pair in zip(parts["random"], parts["discs"])]
    for place, (errors, sigmas, confidence, local) in parts.items():
        is_near = (errors <= 10 * local) & np.isfinite(sigmas)
        held = coverage(errors[is_near] / spacing, sigmas[is_near] / spacing, np.ones(is_near.sum()))
        if held:
            ranks = _rank(errors[is_near], sigmas[is_near], confidence[is_near], np.ones(is_near.sum()))
            held.update(count=int(is_near.sum()), lost=float(np.mean(~is_near)),
                        bySigma=ranks["sigma"]["sparsification"], byConfidence=ranks["confidence"]["sparsification"])
        result[place] = held
    return result


def _bar_pictures(lab, case):
    kind, name, index = case
    scan = patch_scan(lab, name, index)
    mesh, errors, sigmas, _ = _with_bars(lab, scan, lab.objects()[name], True)
    figure, axes = drawing.panels([f"{name}: half-width of the 95 % interval; dark: 1 % of the diagonal",
                                   "distance to the object"], size=6)
    for axis, values in zip(axes, (1.96 * sigmas, errors)):
        drawing.draw_surface(axis, mesh, drawing.View(), drawing.by_error(100 / scan.diagonal * values, 1))
    return figure
