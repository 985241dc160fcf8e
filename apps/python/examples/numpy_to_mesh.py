# SPDX-License-Identifier: BSD-3-Clause
"""From a numpy file to a mesh.

numpy_to_mesh.py mesh.ply [points.npy]      (n, 3); without a file a torus is scanned"""

import sys

import numpy as np

import pcl_mrf


def torus(count, noise):
    """Points on a torus with radii of 1 and .4, with noise along all axes."""
    random = np.random.default_rng(1)
    u, v = random.uniform(0, 2 * np.pi, (2, count))
    ring = 1 + .4 * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), .4 * np.sin(v)], axis=1)
    return points + random.normal(scale=noise, size=points.shape)


if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
    sys.exit(__doc__)
points = np.load(sys.argv[2]) if len(sys.argv) > 2 else torus(20000, .01)
mesh = pcl_mrf.reconstruct(points, progress=lambda stage, done: print(f"\r{stage:20} {done:4.0%}", end=""))
print()

report = mesh.report
print(f"{report['points']['used']} of {report['points']['input']} points, {len(mesh.triangles)} triangles, "
      f"volume {report['mesh']['volume']:.4g}")
print(f"points are {np.nanmean(np.abs(mesh.field(points))):.2g} from the surface in the mean")
mesh.save(sys.argv[1])
