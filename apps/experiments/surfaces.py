# SPDX-License-Identifier: BSD-3-Clause
"""Surfaces and clouds as arrays: files, samples, exact distances, shapes."""

from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, cKDTree
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_ID_TYPE, reference, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkGenericCell, vtkPolyData, vtkStaticCellLocator
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
    "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4",
    "float32": "<f4", "float64": "<f8"
}


class Surface:
    """Points, triangles (none: a cloud), normals (None: unknown), and further fields of the points by name."""

    def __init__(self, points, triangles=None, normals=None, fields=None):
        self.points = np.asarray(points, float).reshape(-1, 3)
        self.triangles = np.zeros((0, 3), int) if triangles is None else np.asarray(triangles, int).reshape(-1, 3)
        self.normals, self.fields = normals, fields or {}

    def corners(self):
        return self.points[self.triangles]

    def areas(self):
        a, b, c = np.moveaxis(self.corners(), 1, 0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    def vertex_areas(self):
        """The area around each vertex: a third of its triangles'."""
        return np.bincount(self.triangles.ravel(), np.repeat(self.areas() / 3, 3), len(self.points))

    def border(self):
        """The vertices of edges that only one triangle has."""
        edges = np.sort(np.stack([self.triangles, np.roll(self.triangles, -1, 1)], -1).reshape(-1, 2), axis=1)
        kinds, uses = np.unique(edges, axis=0, return_counts=True)
        return np.isin(np.arange(len(self.points)), kinds[uses == 1])

    @cached_property
    def _locator(self):
        """Finds the closest place of the triangles that have an area."""
        triangles = self.triangles[self.areas() > 0]
        points, cells, mesh, locator = vtkPoints(), vtkCellArray(), vtkPolyData(), vtkStaticCellLocator()
        points.SetData(numpy_to_vtk(self.points, deep=True))
        cells.SetData(3, numpy_to_vtk(triangles.ravel(), deep=True, array_type=VTK_ID_TYPE))
        mesh.SetPoints(points)
        mesh.SetPolys(cells)
        locator.SetDataSet(mesh)
        locator.BuildLocator()
        return locator

    def samples(self, count, seed):
        """Places spread evenly over the area."""
        random = np.random.default_rng(seed)
        ends = np.cumsum(self.areas())
        steps = (np.arange(count) + random.random(count)) / count * ends[-1]
        triangles = np.minimum(np.searchsorted(ends, steps, "right"), len(ends) - 1)
        root, v = np.sqrt(random.random(count)), random.random(count)
        weights = np.column_stack([1 - root, root * (1 - v), root * v])
        return np.einsum("nk,nkx->nx", weights, self.corners()[triangles])

    def merged(self, distance):
        """Merges vertices closer than this to each other, for files that give every triangle its own corners."""
        cells = np.round((self.points - self.points.min(0)) / distance).astype(np.int64)
        _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        triangles = place.ravel()[self.triangles]
        a, b, c = triangles.T
        return Surface(self.points[first], triangles[(a != b) & (b != c) & (c != a)])

    def write(self, path, kind="double"):
        """Writes a PLY file of points, normals and triangles."""
        columns, names = self.points, ["x", "y", "z"]
        if self.normals is not None:
            columns, names = np.hstack([columns, self.normals]), names + ["nx", "ny", "nz"]
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns)}"]
        head += [f"property {kind} {name}" for name in names]
        if len(self.triangles):
            head += [f"element face {len(self.triangles)}", "property list uchar int vertex_indices"]
        table = np.zeros(len(self.triangles), np.dtype([("size", "u1"), ("corners", "<i4", 3)]))
        table["size"], table["corners"] = 3, self.triangles
        with open(path, "wb") as file:
            file.write("\n".join(head + ["end_header", ""]).encode())
            file.write(columns.astype(PLY_TYPES[kind]).tobytes() + table.tobytes())


def read(path):
    """Reads a PLY, OBJ or OFF file. Polygons become fans of triangles."""
    if path.endswith(".ply"):
        return _read_ply(path)
    with open(path, encoding="ascii") as file:
        lines = [line.split() for line in file if line.strip() and not line.startswith("#")]
    if path.endswith(".off"):
        count = int(lines[1][0])
        points, faces = [line[:3] for line in lines[2:2 + count]], [line[1:] for line in lines[2 + count:]]
        return Surface(np.array(points, float), _fans([[int(word) for word in face] for face in faces]))
    points = [line[1:4] for line in lines if line[0] == "v"]
    faces = [[int(word.split("/")[0]) - 1 for word in line[1:]] for line in lines if line[0] == "f"]
    return Surface(np.array(points, float), _fans(faces))


def _fans(polygons):
    return [(face[0], face[i], face[i + 1]) for face in polygons for i in range(1, len(face) - 1)]


def _read_ply(path):
    with open(path, "rb") as file:
        head, _, body = file.read().partition(b"end_header\n")
    elements, is_text = [], b"format ascii" in head
    for words in (line.split() for line in head.decode("ascii", "replace").splitlines()):
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    lines, fields, triangles = body.decode("ascii").splitlines() if is_text else [], {}, None
    for name, count, properties in elements:
        rows, lines = [line.split() for line in lines[:count]], lines[count:]
        if name == "vertex" and is_text:
            fields = dict(zip([words[-1] for words in properties], np.array(rows, float).T))
        elif name == "vertex":
            table = np.frombuffer(body, [(words[1], PLY_TYPES[words[0]]) for words in properties], count)
            fields, body = {words[1]: table[words[1]] for words in properties}, body[table.nbytes:]
        elif name == "face" and is_text:
            triangles = _fans([[int(word) for word in row[1:]] for row in rows])
        elif name == "face":
            size, index = PLY_TYPES[properties[0][1]], PLY_TYPES[properties[0][2]]
            table = np.frombuffer(body, [("size", size), ("corners", index, 3)], count)
            if not np.all(table["size"] == 3):
                raise ValueError(f"'{path}' has polygons that are no triangles")
            triangles, body = table["corners"], body[table.nbytes:]
    normals = [np.column_stack([fields[word + axis] for axis in "xyz"]).astype(float) for word in ("n", "normal_")
               if word + "x" in fields]
    return Surface(np.column_stack([fields[axis] for axis in "xyz"]), triangles, normals[0] if normals else None, fields)


def read_field(path):
    """\\return the distances on the lattice that `--field` of pcl_mrf_reconstruction writes, with axes z, y, x; and the
    side of a voxel"""
    reader = vtkXMLImageDataReader()
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    field = vtk_to_numpy(image.GetPointData().GetArray("distance"))
    return field.reshape(image.GetDimensions()[::-1]).astype(float), image.GetSpacing()[0]


def distances(places, surface):
    """Exact distances from places to a surface."""
    place, cell, index, part, squared = [0., 0., 0.], vtkGenericCell(), reference(0), reference(0), reference(0.)

    def distance(x):
        surface._locator.FindClosestPoint(x, place, cell, index, part, squared)
        return float(squared)**.5

    return np.array([distance(x) for x in np.asarray(places, float).reshape(-1, 3).tolist()])


def nearest(places, points, which=False):
    """Distances from places to the nearest of some points, or the indices of these points."""
    return cKDTree(points).query(places)[which]


# Signed distances from places to shapes about the origin.


def sphere(x, radius):
    return np.linalg.norm(x, axis=-1) - radius


def torus(x, major, minor):
    return np.hypot(np.hypot(x[..., 0], x[..., 1]) - major, x[..., 2]) - minor


def box(x, half, rounding=0):
    """A box in any number of dimensions."""
    q = np.abs(x) - half + rounding
    return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0) - rounding


def primitives(x):
    """pcl_mrf_scan's shape of this name: eight separate parts."""

    def around(*center):
        return x - np.array(center)

    upright = around(.8, -.7, 0)  # a cylinder is a box in the plane of its axis and its radius
    upright = np.stack([np.hypot(upright[..., 0], upright[..., 2]), upright[..., 1]], -1)
    return np.min([sphere(around(-1.35, .7, 0), .5), sphere(around(1.75, .7, 0), .2), torus(around(0, .7, 0), .42, .15),
                   sphere(around(1.05, .7, 0), .3), box(around(-1.35, -.7, 0), (.4, .4, .4)),
                   box(around(-.2, -.7, 0), (.35, .45, .25), .12), box(upright, (.25, .5)),
                   box(around(1.65, -.7, 0), (.1, .5, .3))], axis=0)


def _wavy(points, triangles, shape, length):
    """A mesh whose vertices are moved by Newton's method onto a shape with waves of height .06. The waves are about as
    long as holes are wide, so that the rim of a hole shows part of what is missing, but not all. Phases are no simple
    fractions, so that the waves do not share a plane of symmetry with the shape."""

    def distance(x):
        return shape(x) + .06 * np.sin(2 * np.pi * (x / length + .17 * np.arange(1, 4))).prod(-1)

    for _ in range(15):
        slope = np.stack([distance(points + step) - distance(points - step) for step in 1e-5 * np.eye(3)], -1) / 2e-5
        points = points - (distance(points) / (slope**2).sum(-1))[:, None] * slope
    return Surface(points, triangles)


def wavy_torus(around=420, across=160):
    """A wavy torus with radii of 1 and .42."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (around, across)), indexing="ij")
    points = np.stack([(1 + .42 * np.cos(v)) * np.cos(u), (1 + .42 * np.cos(v)) * np.sin(u), .42 * np.sin(v)], -1)
    index = np.arange(around * across).reshape(around, across)
    a, b, c, d = (np.roll(index, shift, (0, 1)).ravel() for shift in ((0, 0), (-1, 0), (-1, -1), (0, -1)))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return _wavy(points.reshape(-1, 3), triangles, lambda x: torus(x, 1, .42), 1)


def wavy_box(count=70000):
    """A wavy box 2 × 1.5 × 1 with edges rounded by .2."""
    steps = np.arange(count) + .5
    z, turn = 1 - 2 * steps / count, np.pi * (1 + np.sqrt(5)) * steps
    away = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])
    triangles = ConvexHull(away).simplices
    a, b, c = np.moveaxis(away[triangles], 1, 0)
    inwards = np.einsum("nx,nx->n", a, np.cross(b - a, c - a)) < 0
    triangles[inwards] = triangles[inwards, ::-1]
    half = np.array((1, .75, .5))
    points = half * away / (away**6).sum(1, keepdims=True)**(1 / 6)  # close enough to the box to fold no triangle
    return _wavy(points, triangles, lambda x: box(x, half, .2), .7)
