# SPDX-License-Identifier: BSD-3-Clause
"""Surfaces from scanned points, with a confidence and error bars: see reconstruct."""

import difflib
import json
import numbers
import textwrap
import time
import warnings

import numpy as np

from . import _core, checks
from .errors import (BY_STATUS, Cancelled, Error, FileError, InternalError, InvalidInput, InvalidOption, ResourceLimit,
                     SolverFailure)
from .mesh import DistanceField, Mesh

__version__ = _core.version
__all__ = ["reconstruct", "Mesh", "DistanceField", "OPTIONS", "Error", "InvalidInput", "InvalidOption", "ResourceLimit",
           "SolverFailure", "Cancelled", "FileError", "InternalError"]

_TAKES = {name: takes for name, _, takes in _core.options()}
#: What each option of reconstruct does, with its range and default.
OPTIONS = {name: text for name, text, _ in _core.options()}
_EXCLUSIVE = [("noise", "smoothing"), ("noise_field", "noise_model"), ("quality", "voxel_size"),
              ("remesh", "no_remesh")]


def _rarely(progress):
    """Calls a callback ten times a second, at the beginning of each stage and at the end."""
    told, last = set(), 0

    def tell(stage, done):
        nonlocal last
        if stage in told and done < 1 and time.monotonic() < last + .1:
            return True
        told.add(stage)
        answer = progress(stage, done)
        last = time.monotonic()
        return bool(answer) if isinstance(answer, np.bool_) else answer
    return tell


def _text(name, value):
    """A value as text for the command line."""
    if isinstance(value, np.ndarray) and value.ndim == 0:  # as np.load returns numbers of an .npz
        value = value.item()
    if isinstance(value, (bool, np.bool_)):
        return "on" if value else "off"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if not isinstance(value, str):
        raise TypeError(f"{name} is of type {type(value).__name__}; it takes one value: {_TAKES[name]}")
    return value


def _require_known(options):
    known = [*OPTIONS, "normals", "colors", "sensors", "views", "confidences", "progress"]
    for name in options:
        if name not in OPTIONS:
            near = difflib.get_close_matches(name.lower(), known, 1)
            hint = f"; did you mean '{near[0]}'?" if near else "; pcl_mrf.OPTIONS lists them"
            if name in ("depth", "resolution"):  # names in other programs
                hint = "; quality and voxel_size say how fine voxels are"
            raise TypeError(f"reconstruct has no option '{name}'{hint}")


def _texts(options):
    texts = {name: _text(name, value) for name, value in options.items() if value is not None}
    for one, other in _EXCLUSIVE:
        if one in texts and other in texts:
            one = one.replace("noise_field", "noise")
            raise InvalidOption(f"{one} and {other} exclude each other; give one of them")
    if texts.pop("no_remesh", "off") == "on":
        texts["remesh"] = "0"
    return texts


def reconstruct(points, normals=None, colors=None, sensors=None, views=None, noise=None, *, confidences=None,
                progress=None, **options):
    """Reconstructs the surface of scanned points; returns a Mesh. Nothing but the points is needed.

    points: (n, 3), in any unit and frame; rows with NaN are dropped
    normals: (n, 3), of any length; the option normal_source says what becomes of them
    colors: (n, 3), uint8 or floats from 0 to 1, to be interpolated at the vertices
    sensors: (m, 3) or (3,), where scanners stood; views: (n,), the sensor, from 0, that saw each point
    noise: standard deviation of the points' errors, one number or (n,)
    confidences: (n,), of the points, 0 to 1
    progress: is called with the stage and the fraction that is done, about ten times a second; False cancels the run

    Ctrl-C ends a run within a second. Raises children of Error, and TypeError. What the run has to say of the
    cloud are RuntimeWarnings. The result does not depend on the number of threads.
    """
    _require_known(options)
    points = checks.coordinates("points", points)
    n = len(points)
    if noise is not None and np.ndim(noise) > 0:
        noise = checks.column("noise", noise, n)
        if np.isnan(noise).any():  # as of the pixels without a depth: what is no point needs no noise
            noise = np.where(np.isfinite(points).all(axis=1), noise, 1)
        if not np.all((noise > 0) & np.isfinite(noise)):
            raise InvalidInput("noise has values that are not above 0; leave points without one out of the cloud")
        options["noise_field"] = "given"  # the name of this option on the command line
    elif noise is not None:
        options["noise"], noise = noise, None
    if views is not None:
        if sensors is None:
            raise InvalidInput("views are given without sensors; give sensors, which they name from 0")
        views = np.clip(checks.column("views", views, n, "iu"), -1, 2**31 - 1)  # the library refuses others
    if sensors is not None and np.shape(sensors) == (3,):
        sensors = [sensors]
    if progress is not None and not callable(progress):
        raise TypeError("progress is not callable; it takes a function of the stage and the fraction that is done")
    arrays = dict(points=points,
                  normals=normals if normals is None else checks.coordinates("normals", normals, n),
                  colors=colors if colors is None else checks.bytes_of("colors", colors, n),
                  sensors=sensors if sensors is None else checks.coordinates("sensors", sensors),
                  views=views, noise=noise,
                  confidences=confidences if confidences is None else checks.column("confidences", confidences, n))
    status, message, report, mesh, field, samples = _core.reconstruct(arrays, _texts(options),
                                                                      progress and _rarely(progress))
    report = json.loads(report)
    for warning in report["warnings"]:
        warnings.warn(_core.with_keywords(warning), RuntimeWarning, stacklevel=2)
    if status != "ok":
        raise BY_STATUS.get(status, InternalError)(message, report)
    return Mesh(**mesh, report=report, field=field, samples=samples)


def _help():
    lines = ["Options, with True for on and None for the default:", ""]
    for name, text in OPTIONS.items():
        lines.append(textwrap.fill(f"{name} ({_TAKES[name]}): {text}", 112, subsequent_indent="    "))
    return textwrap.indent("\n".join(lines), "    ")


reconstruct.__doc__ += "\n" + _help() + "\n    "
