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

from experiments import clouds, figures, main, methods, noise, patches, surfaces  # noqa: E402
from experiments.laboratory import Failure, Laboratory  # noqa: E402


def cube():
    """Of side 2 about the origin, in 12 triangles."""
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return surfaces.Surface(points, surfaces._fans(quads))


def euler_characteristic(surface):
    edges = np.sort(np.stack([surface.triangles, np.roll(surface.triangles, -1, 1)], -1).reshape(-1, 2), axis=1)
    kinds, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 2).all(), "not closed"
    return len(surface.points) - len(kinds) + len(surface.triangles)


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
        lab.section("name", "title", "text")
        return lab


class Surfaces(InFolder):
    def test_distances_are_those_of_the_shape(self):
        places = np.random.default_rng(1).uniform(-3, 3, (2000, 3))
        expected = np.abs(surfaces.box((1, 1, 1))(places))
        np.testing.assert_allclose(surfaces.distances(places, cube()), expected, atol=1e-12)

    def test_distances_of_triangles_of_all_sizes_are_exact(self):
        random = np.random.default_rng(2)
        corners = random.normal(size=(300, 1, 3)) + random.normal(size=(300, 3, 3)) * random.uniform(0, 1, (300, 1, 1))**4
        corners[:5, 1] = corners[:5, 0]  # without an area
        soup = surfaces.Surface(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))
        places = random.normal(size=(200, 3))
        squared = surfaces._squared_to_triangles(places[:, None], *np.moveaxis(corners[None], 2, 0))
        found, triangles = surfaces.distances(places, soup, with_triangles=True)
        np.testing.assert_allclose(found, np.sqrt(squared.min(1)), atol=1e-12)
        np.testing.assert_allclose(squared[np.arange(200), triangles], found**2, atol=1e-12)

    def test_samples_are_even_and_on_the_surface(self):
        places, triangles, weights = cube().samples(6000, 1)
        self.assertLess(surfaces.distances(places, cube()).max(), 1e-12)
        np.testing.assert_allclose(np.bincount(triangles), 500, atol=1)
        np.testing.assert_allclose(weights.sum(1), 1)

    def test_files(self):
        path = str(self.folder / "mesh.ply")
        surfaces.write_ply(path, cube().points, cube().points, cube().triangles)
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

    def test_normals_face_their_sensors(self):
        points = np.random.default_rng(1).normal(size=(2000, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        sensors = np.array([[0, 0, 0], [0, 0, 0.]])
        normals = surfaces.estimated_normals(points, np.zeros(2000, int), sensors)
        self.assertLess(np.einsum("nx,nx->n", normals, points).max(), -.98)


class Figures(unittest.TestCase):
    def test_summary(self):
        self.assertEqual(figures.summary([3, -4])["rms"], np.sqrt(12.5))
        self.assertEqual(figures.summary([1, 2, -9])["max"], 9)
        self.assertIsNone(figures.summary([]))
        self.assertEqual(figures.rounded(.123456), .123)
        self.assertEqual(figures.rounded("word"), "word")

    def test_points_belong_to_the_hole_they_are_deepest_in(self):
        holes = [{"center": [0, 0, 0], "radius": 1}, {"center": [1, 0, 0], "radius": .5}]
        owners = figures.hole_of_each(np.array([[.5, 0, 0], [.9, 0, 0], [0, 0, 1.], [3, 0, 0]]), holes)
        self.assertEqual(owners.tolist(), [0, 1, 0, -1])
        self.assertEqual(figures.rms_per_hole(np.array([3, 4, 9.]), np.array([0, 0, 1]), 2, 2), [np.sqrt(12.5), None])

    def test_ratios_have_an_interval_over_scans(self):
        found = figures.compare([(2, 1, scan) for scan in range(5)])
        self.assertEqual((found["ratio"], found["lower"], found["upper"], found["better"]), (2, 2, 2, 0))
        # Of two scans with ratios of 1 and 3, draws of one scan alone are a half.
        found = figures.compare([(1, 1, 0), (3, 1, 1)])
        self.assertEqual((found["ratio"], found["lower"], found["upper"]), (2, 1, 3))
        self.assertIsNone(figures.compare([]))

    def test_objects_count_the_same(self):
        found = figures.mean_over_objects([("a", 1), ("a", 1), ("a", 1), ("b", 3), ("c", None)])
        self.assertEqual((found["mean"], found["lower"], found["upper"], found["lowest"]), (2, 1, 3, 1))

    def test_coverage_of_a_normal_distribution(self):
        sigmas = np.random.default_rng(1).uniform(1, 3, 100000)
        errors = np.abs(np.random.default_rng(2).normal(0, sigmas))
        found = figures.coverage(errors, sigmas, np.ones(len(sigmas)))
        for level in (50, 80, 95):  # three deviations of a share of 100,000
            self.assertAlmostEqual(found[f"within{level}"], level / 100, delta=.005)
        self.assertAlmostEqual(found["halfWidth"], 2 * 1.96, delta=.03)
        self.assertIsNone(figures.coverage(errors, sigmas, np.zeros(len(sigmas))))

    def test_sparsification(self):
        errors, weights = np.arange(1, 1001.), np.ones(1000)
        self.assertEqual(figures.sparsification(errors, errors, weights), 0)
        # What is left of 1, 2, ... n by leaving out from the small end: the curve's mean is known in the limit.
        share = (np.arange(100000) + .5) / 100000
        limit = np.mean(np.sqrt((1 - (1 - share)**3) / (3 * share)) - share / np.sqrt(3)) * np.sqrt(3)
        self.assertAlmostEqual(figures.sparsification(errors, -errors, weights), limit, delta=.002)

    def test_the_corner_of_an_l(self):
        x = np.exp([0, 0, 0, 0, 1, 2, 3.])
        y = np.exp([3, 2, 1, 0, 0, 0, 0.])
        self.assertEqual(figures.corner(x, y), 3)

    def test_pairs_need_both(self):
        results = [{"holes": [1, None, 3]}, {"failed": "no surface"}]
        others = [{"holes": [2, 2, 2]}, {"holes": [1, 1, 1]}]
        self.assertEqual(patches.pairs_of(results, others), [(1, 2, 0), (3, 2, 0)])
        self.assertEqual(patches.patch_cells([{"failed": ""}]), [1, 1])


class Scans(unittest.TestCase):
    def test_withheld_points_are_apart(self):
        points = np.random.default_rng(3).random((20000, 3)) * (1, 1, 0)
        in_disc, is_random = clouds.withheld(points, 1)
        self.assertFalse((in_disc & is_random).any())
        self.assertAlmostEqual(is_random.sum() / (~in_disc).sum(), .1, delta=.01)
        self.assertTrue(.01 < in_disc.mean() < .2)

    def test_random_scans_repeat(self):
        self.assertEqual(clouds.random_scan(1, 5), clouds.random_scan(1, 5))
        self.assertNotEqual(clouds.random_scan(1, 5), clouds.random_scan(2, 5))
        self.assertEqual(len({clouds.random_scan(1, index)[0] for index in range(11)}), 11)

    def test_far_points_are_outliers(self):
        points = np.concatenate([np.random.default_rng(1).random((1000, 3)), [[9, 9, 9.]]])
        kept = noise.without_outliers(points)
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
        page = (self.folder / "results/index.html").read_text(encoding="utf-8")
        for part in ("The L-curve of beta", 'href="l-curve.csv"', 'src="l-curve.png"', "The corner is at beta = "):
            self.assertIn(part, page)
        before = (self.folder / "results/l-curve.csv").read_bytes()
        with mock.patch.object(Laboratory, "run", side_effect=AssertionError("it computes again")), \
                mock.patch("sys.argv", [str(word) for word in command]):
            self.assertEqual(main.main(BIN), 0)
        self.assertEqual((self.folder / "results/l-curve.csv").read_bytes(), before)

    def test_ours_are_measured_beside_a_peer(self):
        lab = self.lab()
        scan = lab.scan("torus:major=1,minor=.4", "--points", 4000, "--holes", 1, "--hole-radius", "5%")
        truth = surfaces.torus(1, .4)
        found = {method.name: methods.measure(lab, method.run(lab, scan), scan, lambda x: np.abs(truth(x)))
                 for method in [methods.ours("default", "")] + [
                     method for method in methods.peers(lab, (8,)) if method.name in ("poisson-8", "hoppe")]}
        self.assertEqual(list(found), ["default", "poisson-8", "hoppe"])
        for name, one in found.items():
            self.assertLess(one["accuracy"], .2, name)  # % of the diagonal; the points are .9 % apart
            self.assertLess(one["holes"][0], 1, name)
            self.assertGreater(one["seconds"], 0, name)
        self.assertEqual((found["default"]["components"], found["default"]["flaws"]), (1, 0))

    def test_a_field_is_read_as_it_was_written(self):
        lab = self.lab()
        scan = lab.scan("sphere", "--views", 0, "--points", 4000)
        path = lab.scratch("field.vti")
        lab.reconstruct(scan.path("scan.ply"), "--no-remesh", "--field", path)
        field = surfaces.Field(path)
        value, gradient = field.at(1.05 * scan.cloud.points)
        np.testing.assert_allclose(value, .05, atol=.02)
        self.assertGreater(np.einsum("nx,nx->n", gradient, scan.cloud.points).min(), .8)
        np.testing.assert_allclose(np.linalg.norm(field.crossings(), axis=1), 1, atol=.02)

    def test_what_is_missing_is_said(self):
        lab = self.lab()
        with mock.patch.dict(os.environ, {"PATH": str(self.folder)}):
            self.assertEqual(methods.peers(lab), [])
        for program in ("pcl_poisson_reconstruction", "PoissonRecon"):
            self.assertIn(program, lab.sections[0]["parts"][0])

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
