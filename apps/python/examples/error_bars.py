# SPDX-License-Identifier: BSD-3-Clause
"""How far a surface may be off, drawn by matplotlib.

error_bars.py picture.png [points.npy | rows.xyz]      without a file: the bunny of Debian's package glmark2-data, or a sphere"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import pcl_mrf

BUNNY = Path("/usr/share/glmark2/models/bunny.obj")


def scan():
    if BUNNY.exists():
        return np.array([line.split()[1:4] for line in BUNNY.open() if line.startswith("v ")], dtype=float)
    points = np.random.default_rng(1).normal(size=(20000, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
    sys.exit(__doc__)
read = np.load if sys.argv[-1].endswith(".npy") else lambda file: np.loadtxt(file, usecols=(0, 1, 2))
points = read(sys.argv[2]) if len(sys.argv) > 2 else scan()
points = points[points[:, 1] < np.quantile(points[:, 1], .9)]  # the gap is filled, with a large sigma
mesh = pcl_mrf.reconstruct(points, uncertainty=True, max_hole="auto")
half_width = 1.96 * mesh.sigma  # holds the surface in 95 of 100 cases
measured = mesh.confidence > 0

figure, (section, histogram) = plt.subplots(1, 2, figsize=(11, 5))
near = np.abs(mesh.vertices[:, 2] - np.median(mesh.vertices[:, 2])) < np.ptp(mesh.vertices[:, 2]) / 100
bars = half_width[near, None] * mesh.normals[near]
ends = np.stack([mesh.vertices[near] - bars, mesh.vertices[near] + bars])[:, :, :2]
section.plot(*ends.transpose(2, 0, 1), color="C1", linewidth=1)
section.plot(*mesh.vertices[near, :2].T, ".", color="C0", markersize=2)
section.set(aspect="equal", title="a section, with the interval of 95 %")

bins = np.geomspace(half_width.min(), half_width.max(), 40)
histogram.hist([half_width[measured], half_width[~measured]], bins, stacked=True, label=["measured", "filled"])
histogram.set(xscale="log", xlabel="half of the interval, in the cloud's unit", ylabel="vertices")
histogram.legend()
figure.savefig(sys.argv[1], dpi=150)

shape = mesh.report["uncertainty"]["shape"]
print(f"area between {shape['area']['lower']:.5g} and {shape['area']['upper']:.5g}")
