# SPDX-License-Identifier: BSD-3-Clause
"""The mesh that a reconstruction returns."""

import dataclasses
import importlib
import os
import warnings

import numpy as np

from . import _core, checks
from .errors import FileError, InvalidInput

FORMATS = (".ply", ".obj", ".stl", ".vtk", ".glb", ".dae", ".3mf")


def _sample(self, points):
    return self._sample(checks.coordinates("points", points))


DistanceField = _core.DistanceField
DistanceField.__call__ = _sample


def _package(name):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"to_{name} needs the package {name}, which cannot be imported ({error}): "
                          f"pip install {name}", name=name) from error


@dataclasses.dataclass(eq=False, repr=False)
class Mesh:
    """A triangle mesh in the cloud's coordinates. What is None was not asked for, or the cloud has none of it.

    vertices, normals: (n, 3); triangles: (m, 3), counter-clockwise seen from outside
    confidence: (n,), from 0, invented, to 1, measured
    sigma: (n,), standard deviation along the normal in the cloud's unit; sigma_calibrated: 0 where it is extrapolated
    colors: (n, 3), 0 to 255
    samples: surfaces that sigma allows for, each as (n,) distances along the normals
    report: the same as the tool's --report
    field: DistanceField
    """

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray = None
    confidence: np.ndarray = None
    sigma: np.ndarray = None
    sigma_calibrated: np.ndarray = None
    colors: np.ndarray = None
    samples: list = dataclasses.field(default_factory=list)
    report: dict = dataclasses.field(default_factory=dict)
    field: DistanceField = None

    def __repr__(self):
        return f"<pcl_mrf.Mesh: {len(self.vertices)} vertices, {len(self.triangles)} triangles>"

    def __copy__(self):  # copy.copy would take __getstate__, without the field
        return dataclasses.replace(self)

    def __getstate__(self):
        return {**self.__dict__, "field": None}  # the field is not copied to other processes

    def _fields(self):
        """The fields of the vertices other than positions and normals, by name."""
        named = {"confidence": self.confidence, "sigma": self.sigma, "sigma_calibrated": self.sigma_calibrated}
        return {name: values for name, values in named.items() if values is not None}

    def save(self, path):
        """Writes a PLY, OBJ, STL, VTK, GLB, DAE or 3MF file with all fields that its format can hold.

        The file appears whole or not at all. Vertices that float does not hold are written in double; STL, GLB, DAE
        and 3MF have them relative to an offset, which a warning names. The last three need the package pcl-mrf-tools.
        Raises FileError.
        """
        path = os.path.abspath(os.fsdecode(path))
        if not path.lower().endswith(FORMATS):
            raise InvalidInput(f"path '{path}' does not end in {', '.join(FORMATS)}")
        n = len(self.vertices)
        arrays = dict(vertices=checks.coordinates("vertices", self.vertices, n),
                      triangles=checks.rows("triangles", self.triangles, kinds="iu"),
                      normals=self.normals if self.normals is None else checks.rows("normals", self.normals, n),
                      colors=self.colors if self.colors is None else checks.bytes_of("colors", self.colors, n))
        triangles = arrays["triangles"]
        if triangles.size and not 0 <= triangles.min() <= triangles.max() < n:
            raise InvalidInput(f"triangles name vertices that are not there: there are {n}, counted from 0")
        for name in ("confidence", "sigma", "sigma_calibrated"):
            values = getattr(self, name)
            arrays[name] = values if values is None else checks.column(name, values, n)
        try:
            warning = _core.save(arrays, path)
        except RuntimeError as error:
            raise FileError(str(error)) from None
        if warning:
            warnings.warn(warning, RuntimeWarning, stacklevel=2)

    def to_open3d(self):
        """An open3d.geometry.TriangleMesh with normals and colors; it has no place for other fields."""
        o3d = _package("open3d")
        mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(self.vertices),
                                         o3d.utility.Vector3iVector(self.triangles))
        if self.normals is not None:
            mesh.vertex_normals = o3d.utility.Vector3dVector(self.normals.astype(float))
        if self.colors is not None:
            mesh.vertex_colors = o3d.utility.Vector3dVector(self.colors / 255)
        return mesh

    def to_trimesh(self):
        """A trimesh.Trimesh of the same vertices, with the fields as vertex_attributes."""
        return _package("trimesh").Trimesh(self.vertices, self.triangles, vertex_normals=self.normals,
                                           vertex_colors=self.colors, vertex_attributes=self._fields(), process=False)

    def to_pyvista(self):
        """A pyvista.PolyData with the fields as point_data: confidence, sigma, sigma_calibrated, Normals, RGB."""
        faces = np.insert(self.triangles, 0, 3, axis=1)
        mesh = _package("pyvista").PolyData(self.vertices, faces.ravel())
        for name, values in {**self._fields(), "Normals": self.normals, "RGB": self.colors}.items():
            if values is not None:
                mesh.point_data[name] = values
        return mesh
