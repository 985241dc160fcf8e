# SPDX-License-Identifier: BSD-3-Clause
# What editors know of the package. test_package.py checks it against the options' table.
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
OPTIONS: dict[str, str]

class DistanceField:
    @property
    def voxel_size(self) -> float: ...
    @property
    def nbytes(self) -> int: ...
    def __call__(self, points: ArrayLike) -> NDArray[np.float32]: ...

@dataclass(eq=False, repr=False)
class Mesh:
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None = ...
    confidence: NDArray[np.float32] | None = ...
    sigma: NDArray[np.float32] | None = ...
    sigma_calibrated: NDArray[np.float32] | None = ...
    colors: NDArray[np.uint8] | None = ...
    samples: list[NDArray[np.float32]] = ...
    report: dict[str, Any] = ...
    field: DistanceField | None = ...
    def save(self, path: str | PathLike[str]) -> None: ...
    def to_open3d(self) -> Any: ...
    def to_trimesh(self) -> Any: ...
    def to_pyvista(self) -> Any: ...

class Error(Exception):
    report: dict[str, Any] | None

class InvalidInput(Error, ValueError): ...
class InvalidOption(Error, ValueError): ...
class ResourceLimit(Error, MemoryError): ...
class SolverFailure(Error, ArithmeticError): ...
class Cancelled(Error): ...
class FileError(Error, OSError): ...
class InternalError(Error, RuntimeError): ...

def reconstruct(
    points: ArrayLike,
    normals: ArrayLike | None = ...,
    colors: ArrayLike | None = ...,
    sensors: ArrayLike | None = ...,
    views: ArrayLike | None = ...,
    noise: ArrayLike | str | None = ...,
    *,
    confidences: ArrayLike | None = ...,
    progress: Callable[[str, float], object] | None = ...,
    alone_filter: bool | None = ...,
    statistical_filter: bool | None = ...,
    robust: bool | None = ...,
    normal_source: Literal["auto", "use", "reference", "estimate"] | None = ...,
    normal_radius: float | str | None = ...,
    noise_criteria: bool | None = ...,
    orientation_angle: float | str | None = ...,
    sensor_origin: bool | None = ...,
    observation: Literal["points", "median", "mean", "nearest", "plane", "trapezoid"] | None = ...,
    smoothing: float | str | None = ...,
    gradient_weight: float | str | None = ...,
    neighbors: float | str | None = ...,
    max_distance: float | str | None = ...,
    prior: Literal["membrane", "thin-plate", "triharmonic"] | None = ...,
    beta: float | str | None = ...,
    energy: Literal["joint", "paper"] | None = ...,
    solver: Literal["multigrid", "icm", "icm-colors", "cg", "cholesky"] | None = ...,
    max_iterations: float | str | None = ...,
    change_tolerance: float | str | None = ...,
    seed: float | str | None = ...,
    quality: Literal["draft", "normal", "fine"] | None = ...,
    voxel_size: float | str | None = ...,
    padding: float | str | None = ...,
    max_memory: float | str | None = ...,
    dense_voxels: float | str | None = ...,
    remesh: float | str | None = ...,
    target_edge: float | str | None = ...,
    triangles: float | str | None = ...,
    trim: Literal["none", "holes", "supported"] | None = ...,
    max_hole: float | str | None = ...,
    max_gap: float | str | None = ...,
    trim_points: float | str | None = ...,
    watertight: bool | None = ...,
    uncertainty: bool | None = ...,
    samples: float | str | None = ...,
    write_samples: float | str | None = ...,
    max_error: float | str | None = ...,
    unit: Literal["density", "nearest"] | None = ...,
    search: Literal["bins", "kdtree"] | None = ...,
    color: Literal["confidence", "sigma", "input", "none"] | None = ...,
    threads: float | str | None = ...,
    preset: Literal["default", "paper"] | None = ...,
    noise_model: str | None = ...,
    no_remesh: bool | None = ...,
) -> Mesh: ...
