# SPDX-License-Identifier: BSD-3-Clause
"""Meshes and curves as pictures. Triangles are painted from the farthest to the nearest, without a display."""

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

GRAY, BLUE = np.array([.82, .80, .76]), np.array([.25, .45, .85])
ERRORS = plt.get_cmap("inferno_r")


class View:
    """Where a picture is taken from, and the part of space that it shows (none: all of the surface)."""

    def __init__(self, direction=(.35, .3, 1), focus=None, extent=None, up=(0, 1, 0)):
        self.direction, self.focus, self.extent, self.up = np.array(direction, float), focus, extent, np.array(up, float)

    def axes(self):
        """Right, up and towards the viewer."""
        toward = self.direction / np.linalg.norm(self.direction)
        up = self.up if abs(toward @ self.up) < .95 * np.linalg.norm(self.up) else np.array([0, 0, 1.])
        right = np.cross(up, toward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(toward, right), toward])


def draw_surface(axis, surface, view, colors=None, edges=False):
    """\\param colors of the vertices, RGB 0 to 1; none: gray"""
    turned = surface.points @ view.axes().T
    corners = turned[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    light = np.abs(normals @ np.array([.3, .4, .866])) / np.where(lengths > 0, lengths, 1)
    paint = np.tile(GRAY, (len(corners), 1)) if colors is None else colors[surface.triangles].mean(1)
    shade = np.clip(paint * (.3 + .75 * light[:, None]), 0, 1)
    order = np.argsort(corners[:, :, 2].mean(1))
    axis.add_collection(PolyCollection(corners[order][:, :, :2], facecolors=shade[order],
                                       edgecolors="k" if edges else shade[order], linewidths=.3 if edges else .2))
    _frame(axis, turned, view)


def draw_points(axis, points, normals, view, size=1.5):
    """Those that face the viewer."""
    turned = points @ view.axes().T
    toward = normals @ view.axes()[2]
    axis.scatter(*turned[toward > 0][:, :2].T, s=size, c=.25 + .6 * toward[toward > 0], cmap="gray", vmin=0, vmax=1,
                 linewidths=0)
    _frame(axis, turned, view)


def _frame(axis, turned, view):
    low, high = turned[:, :2].min(0), turned[:, :2].max(0)
    middle = (low + high) / 2 if view.focus is None else (np.array(view.focus) @ view.axes().T)[:2]
    half = .52 * (view.extent or (high - low).max())
    axis.set_xlim(middle[0] - half, middle[0] + half)
    axis.set_ylim(middle[1] - half, middle[1] + half)
    axis.set_aspect("equal")
    axis.axis("off")


def by_confidence(surface):
    """Blue where there are no data."""
    share = np.clip(surface.fields["confidence"], 0, 1)[:, None]
    return BLUE + share * (GRAY - BLUE)


def by_error(errors, limit, is_known=None):
    """\\param is_known vertices that stay gray"""
    colors = ERRORS(np.clip(errors / limit, 0, 1) * .9)[:, :3]
    return colors if is_known is None else np.where(is_known[:, None], GRAY, colors)


def panels(titles, columns=None, size=4.):
    """\\return a figure and one axis for each title"""
    columns = min(columns or 4, len(titles))
    rows = -(-len(titles) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(size * columns, (size + .35) * rows), squeeze=False)
    for axis, title in zip(axes.flat, titles):
        axis.set_title(title, fontsize=10)
    for axis in axes.flat[len(titles):]:
        axis.axis("off")
    return figure, list(axes.flat[:len(titles)])


def draw_curves(axis, curves, labels, log="", marker="o"):
    """\\param curves by their names, (x, y) each; None and what a logarithm has no place for is left out
    \\param log the axes, "x", "y" or "xy" """
    for name, (x, y) in curves.items():
        kept = [(a, b) for a, b in zip(x, y) if b is not None and (b > 0 or "y" not in log)]
        if kept:
            axis.plot(*zip(*kept), marker=marker, markersize=3, linewidth=1, label=name)
    axis.set_xscale("log" if "x" in log else "linear")
    axis.set_yscale("log" if "y" in log else "linear")
    axis.set_xlabel(labels[0])
    axis.set_ylabel(labels[1])
    axis.legend(fontsize=7)
    axis.grid(alpha=.3)


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
