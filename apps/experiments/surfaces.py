# SPDX-License-Identifier: BSD-3-Clause
"""Surfaces and clouds as arrays: their files, samples of them, exact distances to them."""

import base64
import re
import zlib
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
    "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4",
    "float32": "<f4", "float64": "<f8"
}


class Surface:
    """Points with what is known at each of them, by the names of its file, and triangles (none: a cloud)."""

    def __init__(self, points, triangles=None, fields=None):
        self.points = np.asarray(points, float).reshape(-1, 3)
        self.triangles = np.zeros((0, 3), int) if triangles is None else np.asarray(triangles, int).reshape(-1, 3)
        self.fields = fields or {}

    @property
    def normals(self):
        """None if the file has none."""
        for names in (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")):
            if names[0] in self.fields:
                return np.column_stack([self.fields[name] for name in names]).astype(float)
        return None

    def moved(self, rotation):
        """Points turned by a matrix; fields stay as they are."""
        return Surface(self.points @ rotation.T, self.triangles, self.fields)

    def corners(self):
        return self.points[self.triangles]

    def areas(self):
        a, b, c = np.moveaxis(self.corners(), 1, 0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    @cached_property
    def _index(self):
        """The same surface in triangles whose middles tell where they are, the triangle that each is a part of, how far
        its corners are from its middle, and a tree of the middles."""
        corners, owners = self.corners(), np.arange(len(self.triangles))

        def radii():
            return np.linalg.norm(corners - corners.mean(1, keepdims=True), axis=2).max(1)

        limit = max(4 * np.median(radii()), np.linalg.norm(np.ptp(self.points, axis=0)) / 200)
        while (large := radii() > limit).any():
            a, b, c = np.moveaxis(corners[large], 1, 0)
            ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
            parts = [np.stack(part, 1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
            corners = np.concatenate([corners[~large]] + parts)
            owners = np.concatenate([owners[~large]] + 4 * [owners[large]])
        return corners, owners, radii(), cKDTree(corners.mean(1))

    def vertex_areas(self):
        """The area around each vertex: a third of its triangles'."""
        return np.bincount(self.triangles.ravel(), np.repeat(self.areas() / 3, 3), len(self.points))

    def samples(self, count, seed):
        """Places spread evenly over the area, the triangle of each, and its weights of that triangle's corners."""
        random = np.random.default_rng(seed)
        ends = np.cumsum(self.areas())
        steps = (np.arange(count) + random.random(count)) / count * ends[-1]
        triangles = np.minimum(np.searchsorted(ends, steps, "right"), len(ends) - 1)
        root, v = np.sqrt(random.random(count)), random.random(count)
        weights = np.column_stack([1 - root, root * (1 - v), root * v])
        return np.einsum("nk,nkx->nx", weights, self.corners()[triangles]), triangles, weights

    def merged(self, distance):
        """Vertices nearer than that to each other become one, for files that give every triangle its own corners."""
        cells = np.round((self.points - self.points.min(0)) / distance).astype(np.int64)
        _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        triangles = place.ravel()[self.triangles]
        a, b, c = triangles.T
        return Surface(self.points[first], triangles[(a != b) & (b != c) & (c != a)])


def read(path):
    """A PLY, OBJ or OFF file. Polygons become fans of triangles."""
    if path.endswith(".ply"):
        return _read_ply(path)
    with open(path, encoding="ascii") as file:
        lines = [line.split() for line in file if line.strip() and not line.startswith("#")]
    if path.endswith(".off"):
        vertices, faces = int(lines[1][0]), int(lines[1][1])
        polygons = [[int(word) for word in line[1:1 + int(line[0])]] for line in lines[2 + vertices:][:faces]]
        return Surface([[float(word) for word in line[:3]] for line in lines[2:2 + vertices]], _fans(polygons))
    points = [[float(word) for word in line[1:4]] for line in lines if line[0] == "v"]
    polygons = [[int(word.split("/")[0]) - 1 for word in line[1:]] for line in lines if line[0] == "f"]
    return Surface(points, _fans(polygons))


def _fans(polygons):
    return [(face[0], face[i], face[i + 1]) for face in polygons for i in range(1, len(face) - 1)]


def _read_ply(path):
    with open(path, "rb") as file:
        data = file.read()
    head, _, body = data.partition(b"end_header\n")
    elements, kind = [], None
    for words in (line.split() for line in head.decode("ascii", "replace").splitlines()):
        if words[:1] == ["format"]:
            kind = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    points, fields, triangles = np.zeros((0, 3)), {}, None
    rows = body.decode("ascii").split("\n") if kind == "ascii" else None
    for name, count, properties in elements:
        if name == "vertex" and rows is not None:
            table = np.array([row.split() for row in rows[:count]], float).reshape(count, len(properties))
            fields = {words[-1]: table[:, at] for at, words in enumerate(properties)}
        elif name == "vertex":
            table = np.frombuffer(body, np.dtype([(words[1], PLY_TYPES[words[0]]) for words in properties]), count)
            fields, body = {words[1]: table[words[1]] for words in properties}, body[table.nbytes:]
        elif name == "face" and rows is not None:
            triangles = _fans([[int(word) for word in row.split()][1:] for row in rows[:count]])
        elif name == "face":
            size, index = PLY_TYPES[properties[0][1]], PLY_TYPES[properties[0][2]]
            table = np.frombuffer(body, np.dtype([("size", size), ("corners", index, 3)]), count)
            if not np.all(table["size"] == 3):
                raise ValueError(f"'{path}' has polygons that are no triangles")
            triangles, body = table["corners"], body[table.nbytes:]
        rows = rows[count:] if rows is not None else None
    if fields:
        points = np.column_stack([fields.pop(axis) for axis in "xyz"])
    return Surface(points, triangles, fields)


def write_ply(path, points, normals=None, triangles=None):
    columns = np.asarray(points, "<f8")
    names = ["double x", "double y", "double z"]
    if normals is not None:
        columns, names = np.hstack([columns, normals]), names + ["double nx", "double ny", "double nz"]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns)}"]
    head += ["property " + name for name in names]
    if triangles is not None:
        head += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    with open(path, "wb") as file:
        file.write("\n".join(head + ["end_header", ""]).encode())
        file.write(np.ascontiguousarray(columns, "<f8").tobytes())
        if triangles is not None:
            table = np.zeros(len(triangles), np.dtype([("size", "u1"), ("corners", "<i4", 3)]))
            table["size"], table["corners"] = 3, triangles
            file.write(table.tobytes())


def write_pcd(path, points, normals):
    """What PCL's own programs read."""
    columns = np.hstack([points, normals]).astype("<f4")
    head = ("VERSION .7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F\n"
            f"COUNT 1 1 1 1 1 1\nWIDTH {len(columns)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
            f"POINTS {len(columns)}\nDATA binary\n")
    with open(path, "wb") as file:
        file.write(head.encode() + columns.tobytes())


class Field:
    """Values on a lattice, with axes z, y, x, as `--field` of pcl_mrf_reconstruction writes them."""

    def __init__(self, path):
        with open(path, "rb") as file:
            head, _, tail = file.read().partition(b"<AppendedData")
        text = head.decode("ascii")

        def attribute(name):
            return re.search(rf'\b{name}="([^"]*)"', text).group(1)

        ends = [int(word) for word in attribute("WholeExtent").split()]
        self.origin = np.array(attribute("Origin").split(), float)
        self.spacing = float(attribute("Spacing").split()[0])
        shape = tuple(ends[2 * axis + 1] - ends[2 * axis] + 1 for axis in (2, 1, 0))
        is_coded, data = b"base64" in tail[:40], tail[tail.index(b"_") + 1:]
        word = "<u8" if 'header_type="UInt64"' in text else "<u4"
        self.arrays = {}
        for array in re.findall(r"<DataArray[^>]*>", text):
            name, offset = re.search(r'Name="([^"]*)"', array).group(1), re.search(r'offset="(\d+)"', array).group(1)
            raw = _appended(data[int(offset):], is_coded, "compressor" in text, np.dtype(word))
            self.arrays[name] = np.frombuffer(raw, "<f4").reshape(shape).astype(float)
        self.distance = self.arrays["distance"]

    def at(self, points):
        """Distances between the voxels, and their gradients: trilinear."""
        place = (np.asarray(points) - self.origin) / self.spacing
        sizes = np.array(self.distance.shape[::-1])
        base = np.clip(np.floor(place).astype(int), 0, sizes - 2)
        share = place - base
        value, gradient = np.zeros(len(place)), np.zeros((len(place), 3))
        for corner in np.ndindex(2, 2, 2):
            x, y, z = (base + corner).T
            factors = np.where(corner, share, 1 - share)
            signs = np.where(corner, 1, -1)
            distance = self.distance[z, y, x]
            value += distance * factors.prod(1)
            for axis in range(3):
                gradient[:, axis] += distance * signs[axis] * np.delete(factors, axis, 1).prod(1)
        return value, gradient / self.spacing

    def crossings(self):
        """The places where lattice edges cross the zero level."""
        places = []
        for axis in range(3):  # of the array: z, y, x
            a = np.moveaxis(self.distance, axis, 0)[:-1]
            b = np.moveaxis(self.distance, axis, 0)[1:]
            found = np.argwhere((a < 0) != (b < 0))
            da, db = a[tuple(found.T)], b[tuple(found.T)]
            index = found.astype(float)
            index[:, 0] += da / (da - db)
            order = [axis] + [other for other in range(3) if other != axis]
            place = np.empty_like(index)
            place[:, order] = index
            places.append(place[:, ::-1])
        return self.origin + self.spacing * np.concatenate(places)


def _appended(data, is_coded, is_compressed, word):
    """One block of VTK's appended data: a head of lengths, and what may be compressed in pieces."""

    def take(at, size):
        """\\return bytes, and where the next ones are"""
        if not is_coded:
            return data[at:at + size], at + size
        coded = -(-size // 3) * 4
        return base64.b64decode(data[at:at + coded])[:size], at + coded

    if not is_compressed:
        size = int(np.frombuffer(take(0, word.itemsize)[0], word)[0])
        return take(0, word.itemsize + size)[0][word.itemsize:]
    blocks = int(np.frombuffer(take(0, word.itemsize)[0], word)[0])
    head, at = take(0, (3 + blocks) * word.itemsize)
    sizes = np.frombuffer(head, word)[3:].astype(int)
    packed, _ = take(at, int(sizes.sum()))
    starts = np.concatenate([[0], np.cumsum(sizes)])
    return b"".join(zlib.decompress(packed[starts[i]:starts[i + 1]]) for i in range(blocks))


def _squared_to_triangles(p, a, b, c):
    """Squared distances between places and triangles, row by row."""

    def to_edge(s, t):
        along = t - s
        length = np.einsum("...x,...x", along, along)
        share = np.clip(np.einsum("...x,...x", p - s, along) / np.where(length > 0, length, 1), 0, 1)
        rest = p - s - share[..., None] * along
        return np.einsum("...x,...x", rest, rest)

    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (np.einsum("...x,...x", s, t) for s, t in ((u, u), (u, v), (v, v)))
    uw, vw = np.einsum("...x,...x", u, w), np.einsum("...x,...x", v, w)
    determinant = uu * vv - uv * uv
    safe = np.where(determinant > 1e-14 * uu * vv, determinant, 1)
    s, t = (vv * uw - uv * vw) / safe, (uu * vw - uv * uw) / safe
    rest = w - s[..., None] * u - t[..., None] * v
    is_inside = (determinant > 1e-14 * uu * vv) & (s >= 0) & (t >= 0) & (s + t <= 1)
    edges = np.minimum(np.minimum(to_edge(a, b), to_edge(b, c)), to_edge(c, a))
    return np.where(is_inside, np.einsum("...x,...x", rest, rest), edges)


def distances(places, surface, with_triangles=False):
    """Exact distances from places to a surface. \\return also the closest triangles, if asked for"""
    places = np.asarray(places, float).reshape(-1, 3)
    corners, owners, radii, tree = surface._index
    best, triangles = np.full(len(places), np.inf), np.zeros(len(places), int)
    waiting, neighbors = np.arange(len(places)), 12
    while len(waiting):
        neighbors, left = min(neighbors, len(corners)), []
        step = max(1, 600000 // neighbors)
        for some in (waiting[i:i + step] for i in range(0, len(waiting), step)):
            to_middles, near = (table.reshape(len(some), -1) for table in tree.query(places[some], neighbors))
            # A middle is on its triangle, and no place of that is nearer than the middle but for its radius.
            rows, columns = np.nonzero(to_middles - radii[near] <= to_middles[:, :1])
            squared = _squared_to_triangles(places[some][rows], *np.moveaxis(corners[near[rows, columns]], 1, 0))
            order = np.lexsort((squared, rows))
            first = order[np.unique(rows[order], return_index=True)[1]]
            best[some], triangles[some] = np.sqrt(squared[first]), owners[near[np.arange(len(some)), columns[first]]]
            if neighbors < len(corners):
                left.append(some[to_middles[:, -1] - radii.max() < best[some]])
        waiting, neighbors = np.concatenate(left) if left else np.zeros(0, int), 6 * neighbors
    return (best, triangles) if with_triangles else best


def nearest(places, points):
    """Distances from places to the nearest of some points."""
    return cKDTree(points).query(places)[0]


def local_spacings(points):
    """.313 times the distance to the 8th neighbor, as pcl_mrf_evaluate has it."""
    return .313 * cKDTree(points).query(points, 9)[0][:, 8]


def estimated_normals(points, views, sensors, neighbors=12):
    """Of planes fitted to the nearest points, each facing the sensor that saw its point."""
    around = points[cKDTree(points).query(points, neighbors)[1]]
    around = around - around.mean(1, keepdims=True)
    normals = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))[1][:, :, 0]
    turned = np.einsum("nx,nx->n", normals, sensors[views] - points) < 0
    return np.where(turned[:, None], -normals, normals)


# Signed distances of shapes, as functions of places.


def sphere(radius, center=(0, 0, 0)):
    return lambda x: np.linalg.norm(x - np.array(center), axis=-1) - radius


def torus(major, minor, center=(0, 0, 0)):
    def distance(x):
        x = x - np.array(center)
        return np.hypot(np.hypot(x[..., 0], x[..., 1]) - major, x[..., 2]) - minor

    return distance


def box(half, rounding=0, center=(0, 0, 0)):
    def distance(x):
        q = np.abs(x - np.array(center)) - np.array(half) + rounding
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0) - rounding

    return distance


def upright_cylinder(radius, half, center):
    """Along y, with end walls."""

    def distance(x):
        x = x - np.array(center)
        q = np.stack([np.hypot(x[..., 0], x[..., 2]) - radius, np.abs(x[..., 1]) - half], -1)
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)

    return distance


def primitives(x):
    """The shape of this name of pcl_mrf_scan: eight parts apart from each other."""
    parts = (sphere(.5, (-1.35, .7, 0)), sphere(.2, (1.75, .7, 0)), torus(.42, .15, (0, .7, 0)),
             sphere(.3, (1.05, .7, 0)), box((.4, .4, .4), 0, (-1.35, -.7, 0)), box((.35, .45, .25), .12,
                                                                                  (-.2, -.7, 0)),
             upright_cylinder(.25, .5, (.8, -.7, 0)), box((.1, .5, .3), 0, (1.65, -.7, 0)))
    return np.min([part(x) for part in parts], axis=0)


def _wavy(shape, length):
    """Waves of a height of .06. Phases are no simple fractions: no plane of symmetry of the shape is one of them."""

    def distance(x):
        turns = x / length + .17 * np.arange(1, 4)
        return shape(x) + .06 * np.sin(2 * np.pi * turns).prod(-1)

    return distance


def _onto(distance, points, triangles):
    """Vertices near a level set, moved onto it by Newton's method."""
    steps = 1e-5 * np.eye(3)
    for _ in range(30):
        value = distance(points)
        slope = np.stack([distance(points + step) - distance(points - step) for step in steps], -1) / 2e-5
        points = points - (value / (slope**2).sum(-1))[:, None] * slope
    return Surface(points, triangles)


def _quads(index):
    """Triangles between neighbors in a table of vertices."""
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


def wavy_torus(around=420, across=160):
    """Radii of 1 and .42 with waves: closed and smooth. They are about as long as holes are wide, so that the rim of
    a hole tells something about what is missing, but not all."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (around, across)), indexing="ij")
    points = np.stack([(1 + .42 * np.cos(v)) * np.cos(u), (1 + .42 * np.cos(v)) * np.sin(u), .42 * np.sin(v)], -1)
    index = np.arange(around * across).reshape(around, across)
    index = np.pad(index, ((0, 1), (0, 1)), "wrap")
    return _onto(_wavy(torus(1, .42), 1), points.reshape(-1, 3), _quads(index))


def wavy_box(side=110):
    """2 × 1.5 × 1 with edges rounded by .2, and waves."""
    sides, steps = [], np.linspace(-1, 1, side)
    u, v = np.meshgrid(steps, steps, indexing="ij")
    for axis in range(3):
        for sign in (-1, 1):
            face = np.empty((side, side, 3))
            face[..., axis], face[..., (axis + 1) % 3], face[..., (axis + 2) % 3] = sign, u, v
            sides.append(face if sign > 0 else face.transpose(1, 0, 2))
    cube = Surface(np.concatenate([face.reshape(-1, 3) for face in sides]),
                   np.concatenate([_quads(np.arange(side * side).reshape(side, side) + n * side * side)
                                   for n in range(6)])).merged(.1 / side)
    # Corners go towards the middle, so that every vertex starts near the rounded box.
    away = cube.points / np.linalg.norm(cube.points, axis=1, keepdims=True) * np.abs(cube.points).max(1, keepdims=True)
    return _onto(_wavy(box((1, .75, .5), .2), .7), (.6 * cube.points + .4 * away) * (1, .75, .5), cube.triangles)
