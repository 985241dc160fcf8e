# SPDX-License-Identifier: BSD-3-Clause
"""Draws meshes and curves. Triangles are painted from the farthest to the nearest, without a display."""

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

GRAY, BLUE = np.array([.82, .80, .76]), np.array([.25, .45, .85])


class View:
    """The viewpoint of a picture, and the part of space that it shows (none: the whole surface)."""

    def __init__(self, direction=(.35, .3, 1), focus=None, extent=None, up=(0, 1, 0)):
        self.focus, self.extent = focus, extent
        toward, up = np.array(direction) / np.linalg.norm(direction), np.array(up)
        right = np.cross(up if abs(toward @ up) < .95 else (0, 0, 1), toward)
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(toward, right), toward])  # the last one looks at the viewer

    def frame(self, axis, turned):
        low, high = turned[:, :2].min(0), turned[:, :2].max(0)
        x, y = (low + high) / 2 if self.focus is None else (self.axes @ self.focus)[:2]
        half = .52 * (self.extent or (high - low).max())
        axis.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
        axis.axis("off")


def draw_surface(axis, surface, view, colors=None):
    """\\param colors of the vertices, RGB 0 to 1; none: gray"""
    turned = surface.points @ view.axes.T
    corners = turned[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    light = np.abs(normals @ np.array([.3, .4, .866])) / np.where(lengths > 0, lengths, 1)
    paint = np.tile(GRAY, (len(corners), 1)) if colors is None else colors[surface.triangles].mean(1)
    shade = np.clip(paint * (.3 + .75 * light[:, None]), 0, 1)
    order = np.argsort(corners[:, :, 2].mean(1))
    axis.add_collection(PolyCollection(corners[order][:, :, :2], facecolors=shade[order], edgecolors=shade[order],
                                       linewidths=.2))
    view.frame(axis, turned)


def draw_points(axis, points, normals, view, size=1.5):
    """Draws the points that face the viewer."""
    turned, toward = points @ view.axes.T, normals @ view.axes[2]
    axis.scatter(*turned[toward > 0][:, :2].T, s=size, c=.25 + .6 * toward[toward > 0], cmap="gray", vmin=0, vmax=1,
                 linewidths=0)
    view.frame(axis, turned)


def by_confidence(surface):
    """Colors: blue where there are no data; gray for a surface without confidences."""
    if "confidence" not in surface.fields:
        return None
    return BLUE + np.clip(surface.fields["confidence"], 0, 1)[:, None] * (GRAY - BLUE)


def by_error(errors, limit, is_known=None):
    """Colors by error. \\param is_known vertices that stay gray"""
    colors = plt.get_cmap("inferno_r")(np.clip(errors / limit, 0, 1) * .9)[:, :3]
    return colors if is_known is None else np.where(is_known[:, None], GRAY, colors)


def panels(titles, columns=4, size=4.):
    """\\return a figure and one axis for each title"""
    columns = min(columns, len(titles))
    rows = -(-len(titles) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(size * columns, (size + .35) * rows), squeeze=False)
    for axis in axes.flat[len(titles):]:
        axis.axis("off")
    for axis, title in zip(axes.flat, titles):
        axis.set_title(title, fontsize=10)
    return figure, list(axes.flat[:len(titles)])


def gallery(shown, view, paint=by_confidence, points=None, size=1.5):
    """\\param shown titles and functions that give surfaces \\param paint gives the colors of a surface \\param points
    title, positions and normals for a first picture, drawn with \\p size"""
    figure, axes = panels(([points[0]] if points else []) + [title for title, _ in shown])
    if points:
        draw_points(axes[0], *points[1:], view, size)
    for axis, (_, make) in zip(axes[bool(points):], shown):
        mesh = make()
        draw_surface(axis, mesh, view, paint(mesh))
    return figure


def draw_curves(axis, curves, labels, log="", marker="o"):
    """\\param curves by their names, (x, y) each; None and values without a logarithm are left out \\param log the
    logarithmic axes, "x", "y" or "xy" """
    for name, (x, y) in curves.items():
        kept = [(a, b) for a, b in zip(x, y) if b is not None and (b > 0 or "y" not in log)]
        if kept:
            axis.plot(*zip(*kept), marker=marker, markersize=3, linewidth=1, label=name)
    axis.set(xscale="log" if "x" in log else "linear", yscale="log" if "y" in log else "linear", xlabel=labels[0],
             ylabel=labels[1])
    axis.tick_params(which="both", labelsize=7)
    axis.tick_params("x", which="minor", rotation=60)
    axis.legend(fontsize=7)
    axis.grid(alpha=.3)


def charts(shown, labels, log="", columns=4, size=4.):
    """\\param shown curves by the titles of their panels"""
    figure, axes = panels(list(shown), columns, size)
    for axis, curves in zip(axes, shown.values()):
        draw_curves(axis, curves, labels, log)
    return figure


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
