# SPDX-License-Identifier: BSD-3-Clause
"""The experiments: numbers against known ones, and one of them from end to end. Run by ctest, which says where the
tools are."""

import contextlib
import csv
import io
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

BIN = os.environ["MRF_BIN"]
sys.path.insert(0, os.environ["MRF_APPS"])

from experiments import figures, main, methods, noise, patches, surfaces  # noqa: E402
from experiments.laboratory import Failure, Laboratory  # noqa: E402


def cube():
    """Of side 2 about the origin, in 12 triangles."""
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return surfaces.Surface(points, surfaces._fans(quads))


def euler_characteristic(surface):
    edges = np.sort(np.stack([surface.triangles, np.roll(surface.triangles, -1, 1)], -1).reshape(-1, 2), axis=1)
    assert not surface.border().any(), "not closed"
    return len(surface.points) - len(np.unique(edges, axis=0)) + len(surface.triangles)


def volume(surface):
    a, b, c = np.moveaxis(surface.corners(), 1, 0)
    return np.einsum("nx,nx", a, np.cross(b, c)) / 6


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def lab(self, tools=BIN, **options):
        lab = Laboratory(self.folder / "results", tools, quick=True, **options)
        self.addCleanup(lab._temporary.cleanup)
        return lab


class Surfaces(InFolder):
    def test_distances_are_those_of_the_shape(self):
        places = np.random.default_rng(1).uniform(-3, 3, (2000, 3))
        expected = np.abs(surfaces.box(places, (1, 1, 1)))
        triangles = [*cube().triangles, (0, 7, 7)]  # the last one has no area
        found = surfaces.distances(places, surfaces.Surface(cube().points, triangles))
        np.testing.assert_allclose(found, expected, atol=1e-12)

    def test_samples_are_even_and_on_the_surface(self):
        places = cube().samples(6000, 1)
        self.assertLess(surfaces.distances(places, cube()).max(), 1e-12)
        for axis in range(3):  # a thousand on each side, and their mean in its middle
            for side in (-1, 1):
                on_side = places[np.abs(places[:, axis] - side) < 1e-9]
                self.assertAlmostEqual(len(on_side), 1000, delta=2)
                np.testing.assert_allclose(on_side.mean(0), side * np.eye(3)[axis], atol=.08)

    def test_the_border_is_that_of_what_is_missing(self):
        self.assertFalse(cube().border().any())
        open_cube = surfaces.Surface(cube().points, cube().triangles[2:])  # without the side at x = -1
        np.testing.assert_array_equal(open_cube.border(), cube().points[:, 0] == -1)
        self.assertAlmostEqual(open_cube.vertex_areas().sum(), 20)

    def test_primitives_are_those_of_the_scanner(self):
        scan = self.lab().scan("primitives", "--views", 0, "--points", 4000)
        self.assertLess(np.abs(surfaces.primitives(scan.cloud.points)).max(), 1e-6)

    def test_files(self):
        path = str(self.folder / "mesh.ply")
        surfaces.Surface(cube().points, cube().triangles, cube().points).write(path)
        mesh = surfaces.read(path)
        np.testing.assert_array_equal(mesh.corners(), cube().corners())
        np.testing.assert_array_equal(mesh.normals, cube().points)
        text = {"a.ply": "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                         "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                         "4 0 1 2 3\n",
                "a.off": "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n",
                "a.obj": "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1//1 2//1 3//1 4//1\n"}
        for name, words in text.items():
            (self.folder / name).write_text(words)
            mesh = surfaces.read(str(self.folder / name))
            self.assertEqual((len(mesh.points), len(mesh.triangles), mesh.areas().sum()), (4, 2, 1), name)

    def test_corners_that_are_equal_but_for_rounding_become_one(self):
        corners = cube().corners().reshape(-1, 3)
        soup = surfaces.Surface(corners + np.random.default_rng(1).normal(0, 1e-9, corners.shape),
                                np.arange(36).reshape(-1, 3))
        self.assertEqual(euler_characteristic(soup.merged(1e-3)), 2)

    def test_generated_objects_are_closed_and_smooth(self):
        for make, holes, size in ((surfaces.wavy_torus, 1, 3.48), (surfaces.wavy_box, 0, 2.87)):
            mesh = make()
            self.assertEqual(euler_characteristic(mesh), 2 - 2 * holes)
            self.assertAlmostEqual(volume(mesh), size, delta=.01)
            self.assertGreater(mesh.areas().min(), 1e-5)

class Figures(unittest.TestCase):
    def test_summary(self):
        self.assertEqual(figures.summary([3, -4])["RMS"], np.sqrt(12.5))
        self.assertEqual(figures.summary([1, 2, -9], "gap, ")["gap, largest"], 9)
        self.assertEqual(figures.summary([]), {})

    def test_cells(self):
        for value, text in ((.123456, "0.123"), (12345.6, "12300"), (12345, "12345"), ("word", "word"), (None, ""), (2., "2")):
            self.assertEqual(figures.text_of(value), text)

    def test_points_belong_to_the_hole_they_are_deepest_in(self):
        holes = [{"center": [0, 0, 0], "radius": 1}, {"center": [1, 0, 0], "radius": .5}]
        owners = figures.hole_of_each(np.array([[.5, 0, 0], [.9, 0, 0], [0, 0, 1.], [3, 0, 0]]), holes)
        self.assertEqual(owners.tolist(), [0, 1, 0, -1])
        self.assertEqual(figures.rms_per_hole(np.array([3, 4, 9.]), np.array([0, 0, 1]), 2, 2), [np.sqrt(12.5), None])

    def test_ratios_have_an_interval_over_scans(self):
        found = figures.compare([(2, 1, scan) for scan in range(5)])
        self.assertEqual((found["ratio"], found["95 % from"], found["to"], found["better %"]), (2, 2, 2, 0))
        # Of two scans with ratios of 1 and 3, draws of one scan alone are a half.
        found = figures.compare([(1, 1, 0), (3, 1, 1)])
        self.assertEqual((found["ratio"], found["95 % from"], found["to"]), (2, 1, 3))
        self.assertEqual(figures.compare([]), {})

    def test_objects_count_the_same(self):
        found = figures.mean_over_objects([("a", 1), ("a", 1), ("a", 1), ("b", 3), ("c", None)])
        self.assertEqual(list(found.values()), [2, 1, 3, 1, "a"])
        self.assertIsNone(figures.mean_over_objects([("c", None)]))

    def test_the_corner_of_an_l(self):
        x = np.exp([0, 0, 0, 0, 1, 2, 3.])
        y = np.exp([3, 2, 1, 0, 0, 0, 0.])
        self.assertEqual(figures.corner(x, y), 3)

    def test_pairs_need_both(self):
        results = [{"holes": [1, None, 3]}, {"failed": "no surface"}]
        others = [{"holes": [2, 2, 2]}, {"holes": [1, 1, 1]}]
        found = patches.hole_by_hole(results, others)
        self.assertEqual((found["pairs"], found["better %"], found["ratio"]), (2, 50, 1))
        self.assertEqual(patches.hole_by_hole(results[1:], others[1:]), {})
        self.assertEqual(patches.patch_row([{"failed": ""}]), {"scans": 1, "failed": 1})


class Scans(unittest.TestCase):
    def test_far_points_are_outliers(self):
        points = np.concatenate([np.random.default_rng(1).random((1000, 3)), [[9, 9, 9.]]])
        kept = methods.without_outliers(points)
        self.assertFalse(kept[-1])
        self.assertGreater(kept.mean(), .8)


class Experiments(InFolder):
    def test_from_end_to_end_and_again_without_computing(self):
        command = [f"{BIN}/pcl_mrf_experiments", "-o", self.folder / "results", "--quick", "--only", "l-curve", "-q"]
        subprocess.run(command, check=True)
        with open(self.folder / "results/l-curve.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        # Trusting the data more brings the surface nearer to them and makes it rougher.
        data, prior = ([float(row[name]) for row in rows] for name in ("data term, RMS voxels", "prior term, RMS voxels"))
        self.assertGreater(data[0], 1.1 * data[-1])
        self.assertEqual(prior, sorted(prior))
        self.assertGreater((self.folder / "results/l-curve.png").stat().st_size, 10000)
        page = (self.folder / "results/index.md").read_text(encoding="utf-8")
        for part in ("## The L-curve of beta", "](l-curve.csv)", "](l-curve.png)", "The corner is at beta = "):
            self.assertIn(part, page)
        before = (self.folder / "results/l-curve.csv").read_bytes()
        with mock.patch.object(Laboratory, "run", side_effect=AssertionError("it computes again")), \
                mock.patch("sys.argv", [str(word) for word in command]):
            self.assertEqual(main.main(BIN), 0)
        self.assertEqual((self.folder / "results/l-curve.csv").read_bytes(), before)

    def test_ours_are_measured_beside_a_peer(self):
        lab = self.lab()
        scan = lab.scan("torus:major=1,minor=.4", "--points", 4000, "--holes", 1, "--hole-radius", "5%")
        scan.truth = lambda places: np.abs(surfaces.torus(places, 1, .4))
        tried = [methods.ours("default", "")] + [
            method for method in methods.peers(lab, (8,)) if method.name in ("poisson-8", "hoppe")]
        found = {method.name: measured
                 for method, _, measured in methods.tries(lab, "key", tried, lambda: scan, methods.measure)}
        self.assertEqual(list(found), ["default", "poisson-8", "hoppe"])
        for name, one in found.items():
            self.assertLess(one["accuracy RMS %"], .2, name)  # of the diagonal; the points are .9 % apart
            self.assertLess(one["holes"][0], 1, name)
            self.assertGreater(one["CPU s"], 0, name)
        self.assertEqual((found["default"]["components"], found["default"]["flaws"]), (1, 0))

    def test_a_field_is_read_as_it_was_written(self):
        lab = self.lab()
        scan = lab.scan("sphere", "--views", 0, "--points", 4000)
        path = lab.scratch("field.vti")
        lab.reconstruct(scan.path("scan.ply"), "--no-remesh", "--voxel-size", .1, "--padding", 4, "--field", path)
        field, side = surfaces.read_field(path)
        self.assertAlmostEqual(side, .1, places=6)  # options are floats
        size, middle = np.array(field.shape), field.shape[0] // 2
        self.assertTrue(((size >= 27) & (size <= 32)).all(), size)
        # Along the middle line the field is zero twice, a diameter apart, with a slope of one.
        line = field[middle, middle]
        at = np.flatnonzero((line[:-1] < 0) != (line[1:] < 0))
        self.assertEqual(len(at), 2)
        zero = at + line[at] / (line[at] - line[at + 1])
        self.assertAlmostEqual(side * np.diff(zero)[0], 2, delta=.05)
        np.testing.assert_allclose(np.abs(line[at + 1] - line[at]), side, rtol=.1)

    def test_error_bars_are_measured(self):
        lab = self.lab()
        scan = lab.scan(lab.objects()["wavy torus"], "--points", 6000, "--holes", 2)
        found = noise._bars(lab, scan)
        self.assertTrue(60 < found["measured"]["95 %"] <= 100, found)
        self.assertGreater(found["fillings"]["count"], 20)
        error = noise.HELD[3]
        self.assertLess(found["measured"][error], found["fillings"][error])
        self.assertGreater(found["confidence"], 0)

    def test_what_is_missing_is_said(self):
        lab = self.lab()
        with mock.patch.dict(os.environ, {"PATH": str(self.folder)}):
            self.assertEqual(methods.peers(lab), [])
        for program in ("pcl_poisson_reconstruction", "PoissonRecon"):
            self.assertIn(program, lab.parts[0])

    def test_failures_are_kept_and_told(self):
        lab = self.lab()
        result = lab.case("a/b", lambda: lab.reconstruct("nowhere.ply"))
        self.assertIn("nowhere.ply", result["failed"])
        self.assertEqual(lab.case("a/b", lambda: self.fail("computed again")), result)
        with self.assertRaisesRegex(Failure, "nosuchprogram is not on PATH"):
            lab.run("nosuchprogram")

    def test_wrong_usage(self):
        for arguments, message in ((["-o", "x", "--only", "fig-3,nosuch"], "there is no experiment 'nosuch'"),
                                   (["--only", "fig-3"], "--output is required"),
                                   (["-o", "x", "--data", str(self.folder)], "neither the folder reference nor real")):
            said = io.StringIO()
            with contextlib.redirect_stderr(said), self.assertRaises(SystemExit) as ended:
                main.parse(arguments)
            self.assertEqual(ended.exception.code, 2)
            self.assertIn(message, said.getvalue())
        listed = subprocess.run([f"{BIN}/pcl_mrf_experiments", "--list"], check=True, capture_output=True, text=True)
        self.assertEqual([line.split()[0] for line in listed.stdout.splitlines()], list(main.EXPERIMENTS))


if __name__ == "__main__":
    unittest.main()
