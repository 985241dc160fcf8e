# SPDX-License-Identifier: BSD-3-Clause
"""The Python package, as its users call it. Run by ctest, which says where package, tool and examples are."""

import ast
import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import types
import zipfile
from pathlib import Path

import numpy as np
import pytest

import pcl_mrf
from pcl_mrf import _core, checks

TOOL, EXAMPLES = os.environ["MRF_TOOL"], Path(os.environ["MRF_EXAMPLES"])


def ball(count=4000, seed=1):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


@pytest.fixture(scope="module")
def points():
    return ball()


@pytest.fixture(scope="module")
def mesh(points):
    return pcl_mrf.reconstruct(points, colors=(points + 1) / 2, uncertainty=True, write_samples=9)


def test_a_ball_is_a_ball(points, mesh):
    n = len(mesh.vertices)
    radii = np.linalg.norm(mesh.vertices, axis=1)
    assert abs(radii - 1).max() < .02  # a third of the distance of neighbors
    assert mesh.report["mesh"]["volume"] == pytest.approx(4 / 3 * np.pi, rel=.005)
    np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=.15)
    assert mesh.vertices.dtype == np.float64 and mesh.triangles.dtype == np.int32 and mesh.colors.dtype == np.uint8
    corners = mesh.vertices[mesh.triangles]
    assert np.all(np.linalg.det(corners) > 0)  # seen from outside, they turn to the left
    for values in (mesh.normals, mesh.confidence, mesh.sigma, mesh.sigma_calibrated, mesh.colors, *mesh.samples):
        assert len(values) == n
    assert len(mesh.samples) == 9 and mesh.report["status"] == "ok"
    assert abs(mesh.colors - 127.5 * (mesh.vertices + 1)).max() < 20  # colors are those of the nearest points


def test_survey_coordinates_keep_their_digits(points):
    offset = np.array([512345.678, 5412345.678, 321.5])
    here, there = (pcl_mrf.reconstruct(points + shift) for shift in (0, offset))
    assert len(here.vertices) == pytest.approx(len(there.vertices), rel=.02)
    assert abs(np.linalg.norm(there.vertices - offset, axis=1) - 1).max() < .02
    assert np.all(np.isfinite(there.field(points + offset)))


@pytest.mark.parametrize("shift", [0, 1e6])
def test_bytes_and_report_are_the_tools(points, shift, tmp_path):
    cloud = points + shift
    np.savetxt(tmp_path / "cloud.xyz", cloud, "%.17g")
    subprocess.run([TOOL, *"-q cloud.xyz tool.ply --report tool.json --uncertainty --max-hole auto".split()],
                   check=True, cwd=tmp_path)
    mesh = pcl_mrf.reconstruct(cloud, uncertainty=True, max_hole="auto", progress=None)
    mesh.save(tmp_path / "python.ply")
    assert (tmp_path / "tool.ply").read_bytes() == (tmp_path / "python.ply").read_bytes()
    tools = json.loads((tmp_path / "tool.json").read_text())
    assert list(tools) == list(tools | mesh.report) and tools.keys() - mesh.report.keys() == {"input", "output"}
    for part in ("schema", "version", "options", "points", "mesh", "uncertainty", "smoothing", "trimming", "warnings"):
        assert tools[part] == mesh.report[part]


def unaligned(points):
    records = np.zeros(len(points), dtype=np.dtype([("flag", "u1"), ("xyz", "f8", 3)]))
    records["xyz"] = points
    return records["xyz"]


def read_only(points):
    copy = points.copy()
    copy.flags.writeable = False
    return copy


@pytest.mark.parametrize("form", [
    list, np.ndarray.tolist, np.asfortranarray, read_only, unaligned, memoryview, lambda p: p.astype(">f8"),
    lambda p: np.repeat(p, 2, axis=0)[::2], lambda p: np.pad(p, ((0, 0), (1, 2)))[:, 1:4], lambda p: p[::-1][::-1],
    lambda p: np.vstack([p, [[np.nan, 0, 0], [np.inf, 1, 1]]])])
def test_arrays_of_all_kinds_give_the_same(points, form):
    expected = pcl_mrf.reconstruct(points, normals=points, quality="draft")
    given = form(points)
    mesh = pcl_mrf.reconstruct(given, normals=given, quality="draft")
    np.testing.assert_array_equal(mesh.vertices, expected.vertices)


def test_single_precision_and_whole_numbers(points):
    assert len(pcl_mrf.reconstruct(points.astype(np.float32)).vertices) > 1000
    assert abs(np.linalg.norm(pcl_mrf.reconstruct((points * 1000).astype(int)).vertices, axis=1) - 1000).max() < 20


def test_numpys_memory_is_read_where_it_is(points, mesh):
    for array in (points, points.astype(np.float32), points[::2], points[:, ::-1], read_only(points)):
        assert np.shares_memory(checks.coordinates("points", array), array)
    colors = np.zeros(points.shape, np.uint8)
    assert np.shares_memory(checks.bytes_of("colors", colors, len(points)), colors)
    assert not mesh.vertices.flags.owndata and mesh.vertices.flags.writeable  # the library's own memory, handed over


EMPTY = np.zeros((0, 3))
P = ball(100)


@pytest.mark.parametrize("error, words, given, options", [
    (ValueError, "points has the shape (0,)", [], {}),
    (ValueError, "points is masked in part", np.ma.masked_greater(P, .9), {}),
    (ValueError, "at least 4 points are needed; 0 of 0 are left", EMPTY, {}),
    (ValueError, "at least 4 points are needed; 3 of 3 are left", P[:3], {}),
    (ValueError, "100 not finite", P * np.nan, {}),
    (ValueError, "99 duplicates", np.ones((100, 3)), {}),
    (ValueError, "points.T", P.T, {}),
    (ValueError, "points[:, :3]", np.hstack([P, P]), {}),
    (ValueError, "points.reshape(-1, 3)", P[None], {}),
    (TypeError, "points is a path: load the file first", "scan.npy", {}),
    (TypeError, "normals is a path: load the file first", P, dict(normals=Path("normals.npy"))),
    (ValueError, "rows of different lengths", [[1, 2, 3], [1, 2]], {}),
    (TypeError, "points has elements of type <U", P.astype(str), {}),
    (TypeError, "points has elements of type complex128", P * 1j, {}),
    (TypeError, "points has elements of type object", None, {}),
    (TypeError, "np.stack([points['x'], points['y'], points['z']], axis=1)",
     np.zeros(9, dtype=[(axis, "f4") for axis in "xyz"]), {}),
    (ValueError, "normals has 99 rows for 100 points", P, dict(normals=P[:99])),
    (ValueError, "colors has values outside 0 to 1", P, dict(colors=P)),
    (ValueError, "colors has values outside 0 to 255", P, dict(colors=np.full(P.shape, 256))),
    (ValueError, "sensors has the shape (2,)", P, dict(sensors=[1, 2])),
    (ValueError, "sensor 0 (counted from 0) is not finite", P, dict(sensors=[np.nan, 0, 0])),
    (ValueError, "views are given without sensors", P, dict(views=[0] * 100)),
    (ValueError, "a view names sensor 1, counted from 0; there are 1", P, dict(views=[1] * 100, sensors=(0, 0, 9))),
    (ValueError, "a view names sensor -1", P, dict(views=[-2**40] * 100, sensors=(0, 0, 9))),
    (TypeError, "views has elements of type float64; it takes whole", P, dict(views=P[:, 0], sensors=(0, 0, 9))),
    (ValueError, "noise has values that are not above 0", P, dict(noise=P[:, 0])),
    (TypeError, "noise has elements of type |S3", EMPTY, dict(noise=np.array([], "S3"))),
    (ValueError, "noise has 9 rows for 100 points", P, dict(noise=np.ones(9))),
    (ValueError, "confidences has the shape (100, 3)", P, dict(confidences=P)),
    (TypeError, "progress is not callable", P, dict(progress=1)),
    (TypeError, "no option 'voxelsize'; did you mean 'voxel_size'?", P, dict(voxelsize=1)),
    (TypeError, "did you mean 'sensors'?", P, dict(sensor=1)),
    (TypeError, "did you mean 'noise_model'?", P, dict(noise_modell="none")),
    (TypeError, "no option 'depth'; quality and voxel_size say how fine voxels are", P, dict(depth=9)),
    (TypeError, "pcl_mrf.OPTIONS lists them", P, dict(xyzzy=1)),
    (TypeError, "voxel_size is of type list; it takes one value: length", P, dict(voxel_size=[1])),
    (pcl_mrf.InvalidOption, "quality: 'fin' is none of draft, normal, fine", P, dict(quality="fin")),
    (pcl_mrf.InvalidOption, "voxel_size: '-1' is outside its range >= 0", P, dict(voxel_size=-1)),
    (pcl_mrf.InvalidOption, "voxel_size: 'nan' is outside its range", P, dict(voxel_size=np.float32("nan"))),
    (pcl_mrf.InvalidOption, "remesh: '1.5' is not a whole number", P, dict(remesh=1.5)),
    (pcl_mrf.InvalidOption, "robust: '1' is none of on, off", P, dict(robust=1)),
    (pcl_mrf.InvalidOption, "preset: 'best' is none of default, paper", P, dict(preset="best")),
    (pcl_mrf.InvalidOption, "noise_model best is no such model", P, dict(noise_model="best")),
    (pcl_mrf.InvalidOption, "noise and smoothing exclude each other", P, dict(noise=1, smoothing=1)),
    (pcl_mrf.InvalidOption, "noise and noise_model exclude", P, dict(noise=np.ones(100), noise_model="none")),
    (pcl_mrf.InvalidOption, "max_hole has a meaning with trim holes only", P, dict(max_hole=1, trim="none")),
    (MemoryError, "a voxel size of", ball(), dict(max_memory=1)),
])
def test_what_is_wrong_is_named(error, words, given, options):
    with pytest.raises(error) as caught:
        pcl_mrf.reconstruct(given, **options)
    assert words in str(caught.value)
    assert "--" not in str(caught.value) and "RawCloud" not in str(caught.value)


def test_errors_are_of_the_package_and_tell_what_was_done():
    with pytest.raises(pcl_mrf.InvalidInput) as caught:
        pcl_mrf.reconstruct(P[:3])
    assert caught.value.report["status"] == "invalid input" and caught.value.report["points"]["input"] == 3
    for name in ("InvalidInput", "InvalidOption", "ResourceLimit", "SolverFailure", "Cancelled", "FileError"):
        assert issubclass(getattr(pcl_mrf, name), pcl_mrf.Error)


def test_options_reach_the_report(points):
    mesh = pcl_mrf.reconstruct(points, quality="draft", remesh=np.int64(2), robust=True, max_hole=None, watertight="on",
                               max_gap=np.float32(.5), normal_source="estimate", color="confidence")
    options = mesh.report["options"]
    assert options["multiscale"]["quality"] == "draft"
    assert options["remesher"]["rounds"] == 2 and options["trimming"]["watertight"] is True
    assert options["outliers"]["robust"] is True and options["trimming"]["maxGap"] == .5
    assert pcl_mrf.reconstruct(points, no_remesh=True).report["options"]["remesher"]["rounds"] == 0
    known = pcl_mrf.reconstruct(points, preset="default", noise=.01).report["options"]["observation"]
    assert known["noise"] == pytest.approx(.01)


def test_attributes_of_points_are_used(points):
    noise = np.where(points[:, 2] > 0, .001, .2)
    off = points * (1 + np.random.default_rng(2).normal(size=len(points)) * noise)[:, None]
    plain, weighted = (abs(np.linalg.norm(pcl_mrf.reconstruct(off, points, **known).vertices, axis=1) - 1)
                       for known in ({}, {"noise": noise}))
    assert np.mean(weighted) < np.mean(plain)
    sparse = pcl_mrf.reconstruct(points, points, confidences=(points[:, 0] > 0).astype(float))
    assert sparse.report["points"]["zeroConfidence"] == np.sum(points[:, 0] <= 0)
    with pytest.warns(RuntimeWarning, match="1 of 4000 confidences are above 1, up to 255, and count as 1"):
        pcl_mrf.reconstruct(points, points, confidences=np.where(np.arange(4000) == 7, 255, .5))
    seen = points[np.abs(points[:, 0]) > .5]
    views = (seen[:, 0] > 0).astype(int)
    mesh = pcl_mrf.reconstruct(seen, sensors=[[-3, 0, 0], [3, 0, 0]], views=views, trim="supported")
    assert mesh.report["vote"] == "sensor" and np.mean(np.sum(mesh.normals * mesh.vertices, axis=1) > 0) > .99


def test_help_and_stub_have_every_option():
    text = pcl_mrf.reconstruct.__doc__
    assert "remesh (n): rounds of remeshing, [0, 1000]; default 6" in text and "--" not in text
    stub = ast.parse((Path(pcl_mrf.__file__).parent / "__init__.pyi").read_text())
    signature = next(node for node in stub.body if isinstance(node, ast.FunctionDef)).args
    hints = {a.arg: ast.unparse(a.annotation) for a in signature.kwonlyargs}
    takes = {name: takes for name, _, takes in _core.options()}
    assert list(hints) == ["confidences", "progress", *(name for name in pcl_mrf.OPTIONS if name != "noise")]
    for name, what in takes.items():
        assert f"\n    {name} ({what}):" in text
        if what != "on|off" and "|" in what:
            assert hints[name] == "Literal[" + ", ".join(map(repr, what.split("|"))) + "] | None"
    declared = {node.name for node in stub.body if hasattr(node, "name")} | {"OPTIONS"}
    assert declared == set(pcl_mrf.__all__)


def test_progress_is_told_and_may_cancel(points):
    told, start = [], time.perf_counter()
    pcl_mrf.reconstruct(points, progress=lambda stage, done: told.append((stage, done)))
    seconds, stages, fractions = time.perf_counter() - start, {stage for stage, _ in told}, [done for _, done in told]
    assert fractions == sorted(fractions) and fractions[-1] == 1 and len(stages) > 5
    assert len(told) <= len(stages) + 2 + 10 * seconds  # ten times a second
    for progress in (lambda stage, done: done < .5, lambda stage, done: np.bool_(False)):
        with pytest.raises(pcl_mrf.Cancelled):
            pcl_mrf.reconstruct(points, progress=progress)
    with pytest.raises(ZeroDivisionError):  # what the callable raises comes as it is
        pcl_mrf.reconstruct(points, progress=lambda stage, done: 1 / 0)


def test_what_is_no_point_needs_no_noise(points):
    missing, noise = points.copy(), np.full(len(points), .01)
    missing[5], noise[5] = np.nan, np.nan
    assert pcl_mrf.reconstruct(missing, noise=noise).report["points"]["notFinite"] == 1
    noise[6] = np.nan
    with pytest.raises(ValueError, match="noise has values that are not above 0"):
        pcl_mrf.reconstruct(missing, noise=noise)


def test_other_threads_run_meanwhile_and_ctrl_c_ends_it():
    ticks, sent = [], []

    def meanwhile():
        for _ in range(20):
            time.sleep(.01)
            ticks.append(time.perf_counter())
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=meanwhile)
    with pytest.raises(KeyboardInterrupt):
        cloud = ball(400000)
        thread.start()
        pcl_mrf.reconstruct(cloud)  # takes some seconds
    assert time.perf_counter() - sent[0] < 2  # a second, and one for a busy machine
    thread.join()
    assert np.median(np.diff(ticks)) < .1  # the lock is let go


def test_runs_in_threads_give_the_same(points, mesh):
    results = [None, None]

    def run(i):
        results[i] = pcl_mrf.reconstruct(points, threads=i + 1)

    threads = [threading.Thread(target=run, args=(i,)) for i in range(2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    for result in results:
        np.testing.assert_array_equal(result.vertices, mesh.vertices)


def test_field_is_sampled_in_the_clouds_frame(points):
    offset = np.array([1e6, 0, 0])
    field = pcl_mrf.reconstruct(np.vstack([points, points[:3000] * .3 + [99, 0, 0]]) + offset).field  # two pieces
    places = np.random.default_rng(3).uniform(-1.1, 1.1, (5000, 3))
    truth = np.linalg.norm(places, axis=1) - 1
    near = abs(truth) < .05
    for shape, scale in (([0, 0, 0], 1), ([99, 0, 0], .3)):
        values = field((places * scale + shape) + offset)
        assert values.shape == (5000,) and np.median(abs(values[near] - scale * truth[near])) < .01 * scale
        assert np.all(values[truth < -.1] < 0)
    outside = field(np.array([[5, 0, 0], [0, 0, 50], [np.nan, 0, 0]]) + offset)
    assert np.all(np.isnan(outside)) and field(EMPTY).shape == (0,) and 0 < field.voxel_size < .2
    with pytest.raises(ValueError, match="points has the shape"):
        field([1, 2, 3])


def test_warnings_are_warnings():
    flat = np.random.default_rng(1).uniform(-1, 1, (2000, 3)) * [1, 1, 0]
    with pytest.warns(RuntimeWarning) as caught:
        mesh = pcl_mrf.reconstruct(flat)
    assert len(caught) == len(mesh.report["warnings"]) and caught[0].filename == __file__


def test_files_hold_the_mesh_or_an_error_says_why(mesh, tmp_path):
    for ending in pcl_mrf.mesh.FORMATS:
        mesh.save(tmp_path / f"mesh{ending}")
        if ending != ".3mf":  # which is packed
            assert (tmp_path / f"mesh{ending}").stat().st_size > 24 * len(mesh.vertices)
    assert (tmp_path / "mesh.glb").read_bytes()[:4] == b"glTF" and zipfile.is_zipfile(tmp_path / "mesh.3mf")
    with pytest.raises(pcl_mrf.InvalidInput, match="does not end in .ply"):
        mesh.save("mesh.docx")
    with pytest.raises(OSError, match="nowhere"):
        mesh.save(tmp_path / "nowhere" / "mesh.ply")
    triangles = mesh.triangles + 1
    with pytest.raises(pcl_mrf.InvalidInput, match="triangles name vertices"):
        pcl_mrf.Mesh(mesh.vertices, triangles).save(tmp_path / "mesh.stl")
    for ending in ("glb", "stl"):
        with pytest.warns(RuntimeWarning, match="relative to"):
            pcl_mrf.Mesh(mesh.vertices + 1e7, mesh.triangles).save(tmp_path / f"mesh.{ending}")


def test_copies_have_all_but_pickled_ones_the_field(mesh):
    assert copy.copy(mesh).field is mesh.field is not None
    pickled = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(pickled.vertices, mesh.vertices)
    assert pickled.report == mesh.report and pickled.field is None


def test_other_packages_are_given_all_there_is(mesh, monkeypatch):
    made = types.SimpleNamespace(point_data={})

    def make(*arguments):
        made.a = arguments
        return made

    monkeypatch.setitem(sys.modules, "trimesh", types.SimpleNamespace(Trimesh=lambda *a, **k: (a, k)))
    (vertices, triangles), fields = mesh.to_trimesh()
    assert vertices is mesh.vertices and triangles is mesh.triangles and fields["process"] is False
    assert set(fields["vertex_attributes"]) == {"confidence", "sigma", "sigma_calibrated"}
    monkeypatch.setitem(sys.modules, "pyvista", types.SimpleNamespace(PolyData=make))
    assert mesh.to_pyvista() is made and set(made.point_data) >= {"confidence", "sigma", "Normals", "RGB"}
    np.testing.assert_array_equal(made.a[1].reshape(-1, 4)[:, 1:], mesh.triangles)
    vectors = types.SimpleNamespace(Vector3dVector=np.array, Vector3iVector=np.array)
    geometry = types.SimpleNamespace(TriangleMesh=lambda *a: types.SimpleNamespace(a=a))
    monkeypatch.setitem(sys.modules, "open3d", types.SimpleNamespace(utility=vectors, geometry=geometry))
    assert mesh.to_open3d().vertex_colors.max() <= 1
    for name in ("trimesh", "pyvista", "open3d"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ImportError, match=f"pip install {name}"):
            getattr(mesh, f"to_{name}")()


def test_the_readmes_program_runs(tmp_path, monkeypatch):
    program = (EXAMPLES.parents[2] / "README.md").read_text().split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    exec(program, {})
    assert (tmp_path / "mesh.ply").exists()


@pytest.mark.parametrize("example, output", [("numpy_to_mesh", "torus.ply"), ("kinect_frame", "frame.ply"),
                                             ("error_bars", "bars.png")])
def test_examples_run(example, output, tmp_path):
    run = subprocess.run([sys.executable, "-B", EXAMPLES / f"{example}.py", output], cwd=tmp_path, text=True,
                         env=os.environ | {"MPLBACKEND": "Agg"}, capture_output=True)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / output).stat().st_size > 10000 and "nan" not in run.stdout
