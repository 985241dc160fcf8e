# SPDX-License-Identifier: BSD-3-Clause
"""A depth image to a mesh: a ball before a wall, as a Kinect sees them.

kinect_frame.py mesh.ply [depth.npy]        depth in meters, 0 or NaN where there is none"""

import sys

import numpy as np

import pcl_mrf

FOCAL = 290  # for 320 by 240 pixels; other images in proportion
BASELINE = .075  # meters


def ball_before_wall():
    """Depths with the steps of the device: disparities in eighths of a pixel of the sensor's 640 by 480."""
    y, x = np.mgrid[:240, :320]
    rays = np.stack([(x - 159.5) / FOCAL, (y - 119.5) / FOCAL, np.ones(x.shape)], axis=-1)
    center, radius = np.array([.1, 0, 1.2]), .25
    a, b = (rays**2).sum(-1), rays @ center
    inside = b**2 - a * (center @ center - radius**2)
    depth = np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / a, 2)
    disparity = 2 * FOCAL * BASELINE / depth + np.random.default_rng(1).normal(scale=.05, size=depth.shape)
    return 2 * FOCAL * BASELINE / (np.round(8 * disparity) / 8)


def points_of(depth):
    """The pixels of an image as points; the camera is at the origin and looks along z."""
    height, width = depth.shape
    y, x = np.mgrid[:height, :width]
    focal = FOCAL * width / 320
    depth = np.where(depth > 0, depth, np.nan)
    points = np.stack([(x - (width - 1) / 2) / focal, (y - (height - 1) / 2) / focal, np.ones(depth.shape)], axis=-1)
    return (points * depth[..., None]).reshape(-1, 3)


if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
    sys.exit(__doc__)
depth = np.load(sys.argv[2]) if len(sys.argv) > 2 else ball_before_wall()
mesh = pcl_mrf.reconstruct(points_of(depth), sensors=(0, 0, 0), color="confidence")

noise = mesh.report["noise"]
print(f"{len(mesh.triangles)} triangles, {np.mean(mesh.confidence > 0):.0%} of the vertices are measured")
for group in noise["groups"]:
    print(f"  {group['range']:.2f} m away the depth is off by {1000 * group['deviation']:.1f} mm")
mesh.save(sys.argv[1])
