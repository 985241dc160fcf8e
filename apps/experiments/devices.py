# SPDX-License-Identifier: BSD-3-Clause
"""Clouds with the errors of devices, compared with the truth."""

from functools import cache

import numpy as np

from .methods import Method, compared, peers

INSIDE, STREET = ("--sensor", "0.6,1.5,1.5", "--front", "-.1,-.25,-1"), ("--axis", "0,0,1", "--front", "1,0,-.05")
#: Sensor options: for one view of a scene, and for views all around. The baseline is that of a depth camera, meters.
SCENES = {
    "room": ("room", INSIDE, (*INSIDE, "--sensor", "-1,1.4,1.6", "--sensor", "1.8,1.8,.8"), .075),
    "table": ("table", ("--placement", "front", "--views", 1, "--distance", .6, "--elevation", 20),
              ("--placement", "front", "--views", 5, "--distance", .6, "--elevation", 20), .075),
    "person": ("person", ("--placement", "ring", "--views", 4, "--distance", 1),
               ("--placement", "ring", "--views", 12, "--distance", 1), .075),
    "head": (None, ("--placement", "ring", "--views", 4), ("--views", 12), None),
    "street": ("street", (*STREET, "--sensor", "-12,0,1.8"), (*STREET, "--sensor", "-12,0,1.8", "--sensor", "10,1,1.8"), 1),
    "facade": ("facade", ("--placement", "front", "--views", 1, "--distance", .6),
               ("--placement", "front", "--views", 5, "--distance", .6), .4),
}
#: Options, and the maximum distance of surface, in mean spacings: four deviations of the noise, at least one.
DEVICES = {"depth-camera": ((), 1), "lidar": (("--aspect", 3), 1), "structured-light": ((), 2), "photogrammetry": ((), 4)}


def devices(lab):
    """Scenes as four kinds of devices scan them, with the errors that each makes: pcl_mrf_scan tells of them. All
    methods are given the same normals, estimated from 16 noisy points and turned to the sensors, ours the sensors as
    well. The head is igea of --data, else the first object.

    RMS: of the points where they truly are to the mesh, in % of the diagonal. The others are what the sensors see of
    the mesh beside the true surface, within four deviations of the noise: the median angle between the normals, the
    share turned over, area over true area (1: as smooth as the truth), and the shares of the view where the mesh is in
    front of the truth, and where it is not there."""
    known = Method("default", "this (default)", lambda lab, scan: lab.reconstruct(
        scan.path("scan.ply"), "--views", scan.path("views.txt"), "--sensors", scan.path("sensors.txt")))
    methods, head, rows = [known] + peers(lab, (9,), with_hoppe=False), _head(lab), []
    for device, (options, limit) in DEVICES.items():
        for scene, (subject, once, around, baseline) in SCENES.items():
            words, growth = (around if device == "photogrammetry" else once) + options, 0
            if device == "depth-camera":  # the limit: four deviations of the disparity, with its steps
                baseline = baseline or .075 / .35 * lab.scan(head, "--views", 0, "--points", 100).diagonal  # as if of 35 cm
                words, growth = words + ("--baseline", baseline), 4 * np.hypot(.08, .125 / np.sqrt(12)) / (580 * baseline)
            found, _ = compared(lab, f"devices/{device}/{scene}", methods, lambda: lab.scan(
                subject or head, "--device", device, "--points", lab.points(40000), "--normals", "estimated", *words),
                lambda made, scan: _measure(lab, made, scan, limit, growth))
            rows += [{"device": device, "scene": scene, **row} for row in found]
    lab.table("devices", "Devices and scenes, beside the truth", rows)


def _head(lab):
    found = lab.objects()
    return found.get("igea") or next(iter(found.values()))


@cache
def _truth(lab, subject):
    path = lab.scratch("truth.ply")
    lab.scan(subject, "--views", 0, "--points", 100, "--write-truth", path)
    return path


def _measure(lab, made, scan, limit, growth):
    options = ["--far", limit * scan.spacing] + (["--far-growth", growth] if growth else [])
    for sensor in np.loadtxt(scan.path("sensors.txt"), ndmin=2):
        options += ["--sensor", ",".join(f"{x:.17g}" for x in sensor)]
    found = made.evaluate("--clean", scan.path("clean.ply"), "--reference", _truth(lab, scan.subject), "--samples", 100000,
                          *options)
    seen = found["sensor"]
    return {"RMS %": 100 / scan.diagonal * found["distances"]["clean"]["rms"], "normals °": seen["medianNormalError"],
            "flipped %": 100 * seen["flippedShare"], "area": seen["areaRatio"], "in front %": 100 * seen["inFrontShare"],
            "missing %": 100 * seen["missingShare"], "triangles": found["mesh"]["triangles"], "CPU s": made.seconds}
