# SPDX-License-Identifier: BSD-3-Clause
"""Figures 7 and 8: noise and outliers; the L-curve of beta; error bars."""

from functools import partial

import numpy as np
from scipy.ndimage import laplace

from . import drawing, surfaces
from .clouds import real_clouds
from .figures import corner, mean_over_objects, rms
from .methods import EXACT, GIVEN, PAPER, Spacings, compared, measure, measure_scans, ours, peers, tries
from .patches import hole_by_hole, patch_objects, patch_row, patch_scan


def noisy_scan(lab, subject, *errors, seed=None):
    """A noisy scan with estimated normals, which our method does not get."""
    return lab.scan(subject, "--points", lab.points(28000), "--normals", "estimated", *errors, seed=seed)


def noisy_objects(lab):
    """The objects of noisy scans; real head scans come first."""
    names = sorted(lab.objects(), key=lambda name: name not in ("igea", "nefertiti"))
    return names[:1 if lab.quick else 4]


def hard_scan(lab, name, index):
    return noisy_scan(lab, lab.objects()[name], "--noise", "0.25%", "--outliers", 1, "--holes", 6, "--hole-radius",
                      "4%:10%", seed=1000 * lab.seed + index)


def fig_8(lab):
    """Scans from 12 views: this method estimates normals and turns them to the sensors. Others are given those of the
    scanner, of planes fitted to 16 points, each facing the sensor that saw its point. The error is the distance
    of the surface from where the scanned points truly are, before noise, in % of the diagonal; invented is the share of
    the mesh's area farther than 1 % of the diagonal from the object.

    Noise. As in the paper's figures, beta is lowered against noise, with voxel-wise observations and k = 2. Our default
    has no beta: it observes at the points, and chooses its smoothing length by points that it left out; the table shows
    what it found beside the truth.

    Noisy scans: noise with a standard deviation of .25 % of the diagonal, 1 % outliers, 6 holes per scan with radii of
    4 to 10 %. A ratio below 1 means that the default fills the holes better."""
    first = next(iter(lab.objects()))
    subjects = {first: lab.objects()[first], **({} if lab.quick else {"primitives": "primitives"})}
    default, paper, others = ours("default", "this (default)"), ours("paper", "this, preset paper", *PAPER), peers(lab)
    _noise(lab, subjects, [default, paper, *others])
    _outliers(lab, subjects, [default, paper, *others])
    methods = [default, paper, *others, *peers(lab, (8,), filtered=True),
               ours("exact", "this, all levels whole and exact", *EXACT)]
    results, _ = measure_scans(lab, "fig-8/noisy-scans", noisy_objects(lab), 1 if lab.quick else 2, methods, hard_scan)
    lab.table("fig-8-noisy-scans", f"Noisy scans with holes ({', '.join(noisy_objects(lab))}); ratio: the default's error "
              "over that of the method, hole by hole",
              [{"method": method.title, **hole_by_hole(results[default], results[method]), **patch_row(results[method])}
               for method in methods])


def _noise(lab, subjects, methods):
    betas = (.99, .1) if lab.quick else (.99, .5, .1, .05)
    voxelwise = {(kind, beta): ours(f"{kind}-{beta}", f"this, voxel-wise {kind}, k = 2, beta {beta}", "--observation", kind,
                                    "--prior", "thin-plate", "--beta", beta)
                 for kind in ("median", "mean") for beta in betas}
    rows, charts = [], {}
    for name, subject in subjects.items():
        for noise in (1,) if lab.quick else (.5, 1, 2):
            tried = [*methods, *voxelwise.values(), ours("known", "this, told the noise", "--noise", Spacings(noise))]
            found = {}
            for method, _, measured in tries(lab, f"fig-8/noise-{noise}/{name}", tried,
                                             partial(noisy_scan, lab, subject, "--noise", f"{noise}s"), _measure_noisy):
                found[method] = measured.get("accuracy RMS %")
                rows.append({"object": name, "noise, spacings": noise, "method": method.title, **measured})
            curves = {f"voxel-wise {kind}, k = 2": (betas, [found[voxelwise[kind, beta]] for beta in betas])
                      for kind in ("median", "mean")}
            curves.update({method.title: ((betas[-1], betas[0]), 2 * (found[method],)) for method in methods})
            charts[f"{name}, noise of {noise} spacings"] = curves
    lab.table("fig-8-noise", "Noise along the normal", rows)
    lab.picture("fig-8-noise", lambda: drawing.charts(charts, ("beta", "RMS error, % of the diagonal"), columns=3))


def _measure_noisy(made, scan):
    result = measure(made, scan)
    result["accuracy RMS, spacings"] = result["accuracy RMS %"] / 100 * scan.diagonal / scan.spacing
    for name, found in (("noise that it found, spacings", made.report.get("smoothing", {}).get("noise")),
                        ("smoothing length, spacings", made.report.get("smoothingLength"))):
        result[name] = found / scan.spacing if found else None
    return result


def _outliers(lab, subjects, methods):
    settings = [(f"{share} % anywhere", ("--outliers", share)) for share in ((5,) if lab.quick else (0, 1, 2, 5))]
    settings.append(("1 % in clusters", ("--clusters", 1)))
    methods = [*methods, ours("robust", "this, --robust", "--robust"),
               ours("median", "this, voxel-wise median, k = 2", "--observation", "median", "--prior", "thin-plate")]
    rows = []
    for name, subject in subjects.items():
        for title, errors in settings:
            found, _ = compared(lab, f"fig-8/{errors[0][2:]}-{errors[1]}/{name}", methods,
                                partial(noisy_scan, lab, subject, *errors), measure)
            rows += [{"object": name, "outliers": title, **row} for row in found]
    lab.table("fig-8-outliers", "Outliers, without noise on the other points", rows)


def l_curve(lab):
    """The paper's own suggestion for beta: the norm of the prior term over that of the data term, for many betas, with
    the preset `paper` on a scan with noise of .3 mean spacings. The data term is the RMS distance of the points that
    were scanned from the surface; the prior's is the RMS of the field's Laplacian, from the field that the tool writes.
    Both are in voxels. The corner is where the curve turns most; beside it stands which beta is in truth the best, by
    the noise-free points."""
    name, subject = next(iter(lab.objects().items()))
    betas = (.05, .5, .9, .99) if lab.quick else (.01, .02, .05, .1, .2, .35, .5, .7, .8, .9, .95, .99, .999)
    make, rows = partial(lab.scan, subject, "--points", lab.points(28000), "--noise", ".3s"), []
    for beta in betas:
        rows.append({"beta": beta, **lab.case(f"l-curve/{name}/{beta}", lambda: _energies(lab, make(), beta))})
    lab.table("l-curve", f"{name}, noise of .3 mean spacings", rows)
    good = np.array([list(row.values()) for row in rows if "failed" not in row]).T
    if not good.size:
        return
    beta, data, prior, errors = good
    at, best = corner(data, prior), errors.argmin()
    lab.say(f"The corner is at beta = {beta[at]:g}, with an error of {errors[at]:.3g} % of the diagonal; the best of these "
            f"betas is {beta[best]:g}, with {errors[best]:.3g} %.")

    def draw():
        figure, axes = drawing.panels(["prior over data", "error over beta"], size=5)
        drawing.draw_curves(axes[0], {"preset paper": (data, prior)}, ("data term, RMS voxels", "prior term, RMS voxels"),
                            "xy")
        for text, x, y in zip(beta, data, prior):
            axes[0].annotate(f"{text:g}", (x, y), fontsize=7)
        drawing.draw_curves(axes[1], {"preset paper": (beta, errors)},
                            ("beta", "true places to surface, RMS % of the diagonal"))
        return figure

    lab.picture("l-curve", draw)


def _energies(lab, scan, beta):
    path = lab.scratch("field.vti")
    made = lab.reconstruct(scan.path("scan.ply"), "--no-remesh", *PAPER, *GIVEN, "--beta", beta, "--field", path)
    field, side = surfaces.read_field(path)
    found = made.evaluate("--input", scan.path("scan.ply"), "--clean", scan.path("clean.ply"))["distances"]
    return {"data term, RMS voxels": found["cloud"]["rms"] / side,
            "prior term, RMS voxels": rms(laplace(field)[1:-1, 1:-1, 1:-1]) / side,
            "accuracy RMS %": 100 * found["clean"]["rms"] / scan.diagonal}


#: The figures about error bars: the shares that the intervals of 50, 80 and 95 % hold, and the lengths.
HELD = ("50 %", "80 %", "95 %", "RMS error, % of the diagonal", "median half-width of 95 % / RMS error")


def uncertainty(lab):
    """Clean scans are those of Table 1, noisy ones those of Fig. 8. The error of a vertex is its distance to the object,
    and each stands for the area around it. An interval of 50, 80 or 95 % is right if it holds as large a share of the
    area, and the narrower the better. Objects count the same, and the interval of a coverage is a bootstrap over
    objects. Nothing is remeshed. All of it is what `pcl_mrf_evaluate --sigma` tells.

    Ranking: sparsification leaves out the area that is predicted to be the worst, more and more of it, and looks at the
    RMS error of the rest, beside that of leaving out what is the worst; 0 is perfect.

    Real clouds are those of `real`. A withheld point that was measured has noise of its own: what has to hold it is an
    interval of the surface's sigma and the noise together, the noise being what the report says of the cloud."""
    rows, rankings, clouds = [], [], []
    kinds = (("clean", patch_objects(lab), patch_scan, 6), ("noisy", noisy_objects(lab), hard_scan, 2))
    for kind, names, make, count in kinds:
        results = [(name, lab.case(f"uncertainty/{kind}/{name}/{index}", lambda: _bars(lab, make(lab, name, index))))
                   for name in names for index in range(1 if lab.quick else count)]

        def mean(figure):
            return mean_over_objects([(name, figure(result)) for name, result in results if "failed" not in result]) or {}

        for place in ("measured", "fillings"):
            of = {name: mean(lambda result: result[place].get(name)) for name in HELD}
            rows.append({"scans": kind, "where": place, **{name: one.get("mean") for name, one in of.items()},
                         **{f"95 %: {name}": value for name, value in of["95 %"].items() if name != "mean"}})
        rankings.append({"scans": kind, **{f"by {name}": mean(lambda result: result[name]).get("mean")
                                           for name in ("sigma", "confidence")}})
    lab.table("uncertainty-coverage", "How often the truth is within the intervals, % of the area, and how wide they are",
              rows)
    lab.table("uncertainty-ranking", "What ranks the errors best: sparsification (0 is perfect)", rankings)
    for cloud in real_clouds(lab):
        found = lab.case(f"uncertainty/real/{cloud.name}", lambda: _real_bars(lab, cloud))
        clouds += [{"cloud": cloud.title, "where": place, **found.get(place, {}), **found}
                   for place in ("measured", "fillings")]
    lab.table("uncertainty-real", "Real clouds: how often the interval around the surface holds a withheld point, %; "
              "sparsification by sigma and by confidence", clouds)
    lab.picture("uncertainty", lambda: _bar_pictures(lab, patch_objects(lab)[0]))


def _with_bars(lab, scan):
    return lab.reconstruct(scan.path("scan.ply"), "--no-remesh", "--uncertainty", *scan.sensor_options)


def _held(made, *options):
    """The figures of pcl_mrf_evaluate about error bars, in % and in % of the diagonal."""
    found, result = made.evaluate("--sigma", *options), {}
    for place in ("measured", "fillings"):
        one = found["sigma"][place]
        figures = [100 * share for share in one["coverage"]] + [100 * one["rmsError"] / found["diagonal"]]
        result[place] = dict(zip(HELD, [*figures, one["medianHalfWidth"] / one["rmsError"]]), count=one["count"]
                             ) if one["rmsError"] else {}
    return {**result, **found["sigma"]["sparsification"]}


def _bars(lab, scan):
    return _held(_with_bars(lab, scan), "--reference", scan.subject)


def _real_bars(lab, cloud):
    made, withheld = _with_bars(lab, cloud), lab.scratch("withheld.ply")
    surfaces.Surface(np.concatenate([cloud.discs, cloud.random])).write(withheld)
    noise = made.report["uncertainty"]["noise"] if cloud.has_noisy_rest else 0
    return {"noise, spacings": noise / made.report["density"]["spacing"], **_held(made, "--held-out", withheld, *["--noise", noise] * (noise > 0))}


def _bar_pictures(lab, name):
    scan = patch_scan(lab, name, 0)
    mesh = _with_bars(lab, scan).mesh
    sigmas = np.nan_to_num(np.asarray(mesh.fields["sigma"], float))
    shown = [(f"{name}: half-width of the 95 % interval; dark: 1 % of the diagonal", 1.96 * sigmas),
             ("distance to the object", scan.truth(mesh.points))]
    figure, axes = drawing.panels([title for title, _ in shown], size=6)
    for axis, (_, lengths) in zip(axes, shown):
        drawing.draw_surface(axis, mesh, drawing.View(), drawing.by_error(100 / scan.diagonal * lengths, 1))
    return figure
