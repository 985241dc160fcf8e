# SPDX-License-Identifier: BSD-3-Clause
"""Converts arguments to arrays that C++ reads in place, with messages that say how to correct wrong ones."""

import os

import numpy as np

from .errors import InvalidInput


def numbers(name, value, kinds="iuf"):
    """The value as an array of one of these kinds of elements, without a copy if it is one already."""
    if isinstance(value, (str, os.PathLike)):
        raise TypeError(f"{name} is a path: load the file first, as np.load and np.loadtxt do")
    if np.ma.is_masked(value):
        raise InvalidInput(f"{name} is masked in part; leave these out of all arrays: "
                           f"{name}[~np.ma.getmaskarray({name}){'.any(axis=1)' if np.ndim(value) > 1 else ''}].data")
    try:
        array = np.asarray(value)
    except ValueError:
        raise InvalidInput(f"{name} has rows of different lengths; give an array of numbers") from None
    if array.dtype.names:
        names = [("x", "y", "z"), ("normal_x", "normal_y", "normal_z"), ("nx", "ny", "nz")][name == "normals":]
        names = next((three for three in names if set(three) <= set(array.dtype.names)), array.dtype.names[:3])
        columns = ", ".join(f"{name}['{column}']" for column in names)
        raise TypeError(f"{name} is an array of records; give np.stack([{columns}], axis=1)")
    if array.dtype.kind not in (kinds if array.size else "iuf"):  # an empty list gives floats
        whole = "" if "f" in kinds else "whole "
        kind = int if whole else float
        raise TypeError(f"{name} has elements of type {array.dtype}; it takes {whole}numbers: "
                        f"np.asarray({name}).astype({kind.__name__})")
    return array


def rows(name, value, count=None, kinds="iuf"):
    """Rows of three numbers. count: the number of points, each of which must have a row"""
    array = numbers(name, value, kinds)
    if array.ndim != 2 or array.shape[1] != 3:
        remedy = "it takes rows of three"
        if array.ndim == 2 and array.shape[0] == 3:
            remedy += f": give {name}.T"
        elif array.ndim == 2 and array.shape[1] > 3:
            remedy += f": give {name}[:, :3]"
        elif array.ndim > 2 and array.shape[-1] == 3:
            remedy += f": give {name}.reshape(-1, 3)"
        raise InvalidInput(f"{name} has the shape {array.shape}; {remedy}, (n, 3)")
    return counted(name, array, count)


def column(name, value, count, kinds="iuf"):
    """One number for each point."""
    array = numbers(name, value, kinds)
    if array.shape == (count, 1):
        array = array[:, 0]
    if array.ndim != 1:
        raise InvalidInput(f"{name} has the shape {array.shape}; it takes one number for each point, (n,)")
    return counted(name, array, count)


def counted(name, array, count):
    if count is not None and len(array) != count:
        raise InvalidInput(f"{name} has {len(array)} rows for {count} points; there has to be one for each")
    return array


def coordinates(name, value, count=None):
    """Rows in single precision if they are given so, else in double."""
    array = rows(name, value, count)
    return np.require(array, np.float32 if array.dtype == np.float32 else np.float64, "A")


def bytes_of(name, value, count):
    """Colors as bytes: from whole numbers 0 to 255, or from fractions 0 to 1 as in matplotlib and Open3D."""
    array = rows(name, value, count)
    top = 1 if array.dtype.kind == "f" else 255
    if array.size and not (array.min() >= 0 and array.max() <= top):  # false for NaN, too
        raise InvalidInput(f"{name} has values outside 0 to {top}; it takes whole numbers 0 to 255 (uint8), or others "
                           "0 to 1")
    return np.rint(array * 255).astype(np.uint8) if top == 1 else np.require(array, np.uint8, "A")
