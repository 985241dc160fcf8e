# SPDX-License-Identifier: BSD-3-Clause
"""What experiments are run in: programs, scans, results that are kept, tables and the page."""

import csv
import html
import json
import os
import shutil
import subprocess
import tempfile
import weakref
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from . import drawing, surfaces
from .figures import rounded

BUNNY = "/usr/share/glmark2/models/bunny.obj"
CGAL_DATA = "/usr/share/doc/libcgal-dev/data.tar.gz"


class Failure(Exception):
    """A program that did not do what it was asked for."""


def cells(measured, *names):
    """Of a case for a row: the figures of these names, or what failed."""
    return [measured["failed"]] if "failed" in measured else [measured.get(name) for name in names]


class Scan:
    """What pcl_mrf_scan left in a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.report = json.loads((folder / "scan.json").read_text())
        self.diagonal, self.spacing, self.holes = (self.report[name] for name in ("diagonal", "spacing", "holes"))

    def path(self, name):
        return str(self.folder / name)

    @cached_property
    def cloud(self):
        return surfaces.read(self.path("scan.ply"))

    @cached_property
    def clean(self):
        return surfaces.read(self.path("clean.ply"))

    @cached_property
    def held_out(self):
        return surfaces.read(self.path("held-out.ply")) if self.holes else surfaces.Surface([])

    @cached_property
    def sensors(self):
        return np.loadtxt(self.path("sensors.txt"), ndmin=2)

    @cached_property
    def views(self):
        return np.loadtxt(self.path("views.txt"), dtype=int)


class Result:
    """A mesh that a program made. Its file lasts as long as the object."""

    def __init__(self, path, seconds, megabytes, report=None, offset=None, merge=False):
        self.path, self.seconds, self.megabytes, self.report = path, seconds, megabytes, report or {}
        self._offset, self._merge = offset, merge
        weakref.finalize(self, Path(path).unlink, missing_ok=True)

    @cached_property
    def mesh(self):
        mesh = surfaces.read(self.path)
        if not len(mesh.triangles) or not mesh.areas().sum() > 0:
            raise Failure("there is no surface")
        if self._merge:  # the corners are equal but for rounding
            mesh = mesh.merged(1e-6 * np.linalg.norm(np.ptp(mesh.points, axis=0)))
        if self._offset is not None:
            mesh.points += self._offset
            surfaces.write_ply(self.path, mesh.points, triangles=mesh.triangles)
        return mesh


class Laboratory:
    """\\param tools a folder with our programs, before those of PATH"""

    def __init__(self, folder, tools=None, quick=False, seed=1, data=None, threads=0, sampling="even"):
        self.folder, self.tools = Path(folder), tools
        self.quick, self.seed, self.threads, self.sampling = quick, seed, threads, sampling
        self.data = Path(data) if data else None
        self.cases = self.folder / "cases" / f"{'quick' if quick else 'full'}-{seed}"
        self.sections = []
        self._temporary = tempfile.TemporaryDirectory(prefix="pcl_mrf_")
        self._count, self._makers = 0, {}
        self.cases.mkdir(parents=True, exist_ok=True)

    # Programs

    def find(self, program):
        """\\return None if it is not there"""
        folders = ([self.tools] if self.tools else []) + os.environ.get("PATH", "").split(os.pathsep)
        return shutil.which(program, path=os.pathsep.join(folders))

    def run(self, program, *arguments):
        """\\return CPU seconds of all threads and the largest memory in MB \\throw Failure"""
        path = self.find(program)
        if path is None:
            raise Failure(f"{program} is not on PATH")
        environment = dict(os.environ)
        if self.threads:
            environment["OMP_NUM_THREADS"] = str(self.threads)
        with tempfile.TemporaryFile() as said:
            child = subprocess.Popen([path, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=said, stderr=said,
                                     env=environment)
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            said.seek(0)
            words = said.read().decode("utf-8", "replace").strip().splitlines()
        if child.returncode:
            raise Failure(f"{program} ended with {child.returncode}: {words[-1] if words else ''}")
        return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024

    def scratch(self, name):
        """A path for a file that lasts as long as this run."""
        self._count += 1
        return str(Path(self._temporary.name) / f"{self._count}-{name}")

    def _threads(self):
        return ["--threads", self.threads] if self.threads else []

    @lru_cache(maxsize=4)
    def scan(self, subject, *arguments, seed=None):
        """Simulates a scan of a mesh file or a shape."""
        folder = Path(self.scratch("scan"))
        folder.mkdir()
        words = [str(word) for word in arguments]
        more = ["--write-clean", folder / "clean.ply", "--report", folder / "scan.json"]
        if "--hole" in words or "--holes" in words and words[words.index("--holes") + 1] != "0":
            more += ["--write-held-out", folder / "held-out.ply"]
        if not ("--views" in words and words[words.index("--views") + 1] == "0"):
            more += ["--write-views", folder / "views.txt", "--write-sensors", folder / "sensors.txt"]
        self.run("pcl_mrf_scan", self._made(subject), folder / "scan.ply", "-q", "--seed", self.seed if seed is None else seed,
                 *words, *more, *self._threads())
        return Scan(folder)

    def reconstruct(self, cloud, *options):
        mesh, report = self.scratch("mesh.ply"), self.scratch("report.json")
        threads = [] if "--threads" in options else self._threads()
        seconds, megabytes = self.run("pcl_mrf_reconstruction", cloud, mesh, "-q", "--report", report, *options, *threads)
        return Result(mesh, seconds, megabytes, json.loads(Path(report).read_text()))

    def evaluate(self, mesh, *options):
        """What pcl_mrf_evaluate tells in JSON."""
        path = self.scratch("evaluation.json")
        self.run("pcl_mrf_evaluate", mesh, "-q", "--json", path, *options, *self._threads())
        return json.loads(Path(path).read_text())

    # Objects

    def objects(self):
        """What is scanned: names and mesh files, of the bunny, CGAL's data, --data, and generated."""
        found = {"bunny": BUNNY} if os.path.exists(BUNNY) else {}
        if os.path.exists(CGAL_DATA):
            for name in ("armadillo", "bear"):
                found[name] = self._later(name + ".off", lambda path, name=name: self._unpack(name, path))
        for name in ("bunny", "igea", "nefertiti"):
            path = self.data / "reference" / f"{name}.ply" if self.data else None
            if path and path.exists() and name not in found:
                found[name] = str(path)
        for name, make in (("wavy torus", surfaces.wavy_torus), ("wavy box", surfaces.wavy_box)):
            found[name] = self._later(name.replace(" ", "-") + ".ply", lambda path, make=make: self._write(make(), path))
        return found

    def _later(self, name, make):
        """\\return the path of a file that is made when it is used"""
        path = str(self.folder / "objects" / name)
        self._makers[path] = make
        return path

    def _made(self, subject):
        if subject in self._makers and not os.path.exists(subject):
            Path(subject).parent.mkdir(exist_ok=True)
            self._makers[subject](subject)
        return subject

    @staticmethod
    def _write(surface, path):
        surfaces.write_ply(path, surface.points, triangles=surface.triangles)

    @staticmethod
    def _unpack(name, path):
        with open(path, "wb") as file:
            subprocess.run(["tar", "-xzOf", CGAL_DATA, f"data/meshes/{name}.off"], stdout=file, check=True)

    @lru_cache(maxsize=3)
    def truth(self, subject):
        """A function that gives the distances from places to a mesh file, or to the shape `primitives`."""
        if subject == "primitives":
            return lambda places: np.abs(surfaces.primitives(places))
        mesh = surfaces.read(self._made(subject))
        return lambda places: surfaces.distances(places, mesh)

    # Results

    def case(self, key, compute):
        """The result of one case, as an earlier run left it or computed and kept at once. What fails is kept, too, as
        {"failed": message}; delete its file to try again."""
        path = self.cases / (key + ".json")
        if path.exists():
            return json.loads(path.read_text())
        before = set(os.listdir(self._temporary.name))
        try:
            result = compute()
        except Failure as failure:
            result = {"failed": str(failure)}
        for name in set(os.listdir(self._temporary.name)) - before:  # scans stay, and meshes as long as their results
            if os.path.isfile(os.path.join(self._temporary.name, name)) and not name.endswith("-mesh.ply"):
                os.unlink(os.path.join(self._temporary.name, name))
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_text(json.dumps(result, indent=1, default=float))
        part.rename(path)
        return result

    def section(self, name, title, text):
        self.sections.append({"name": name, "title": title, "text": text, "parts": []})

    def say(self, text):
        self.sections[-1]["parts"].append(f"<p>{html.escape(text)}</p>")

    def table(self, name, title, columns, rows):
        """Writes NAME.csv. Rows may be short: what is missing is empty."""
        rows = [[rounded(cell) for cell in row] + [None] * (len(columns) - len(row)) for row in rows]
        with open(self.folder / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([columns] + rows)

        def line(cells, tag):
            texts = ("" if cell is None else html.escape(str(cell)) for cell in cells)
            return "<tr>" + "".join(f"<{tag}>{text}</{tag}>" for text in texts) + "</tr>"

        lines = [line(columns, "th")] + [line(row, "td") for row in rows]
        self.sections[-1]["parts"].append(
            f'<h3><a href="{name}.csv">{html.escape(title)}</a></h3><table>' + "\n".join(lines) + "</table>")

    def picture(self, name, draw):
        """Writes NAME.png unless it is there. \\param draw makes the figure; what it needs may fail"""
        path = self.folder / f"{name}.png"
        try:
            if not path.exists():
                drawing.save(draw(), path)
            self.sections[-1]["parts"].append(f'<p><img src="{name}.png" alt="{name}"></p>')
        except Failure as failure:
            self.say(f"{name}.png: {failure}")

    def write_page(self):
        parts = []
        for section in self.sections:
            text = "".join(f"<p>{html.escape(part)}</p>" for part in section["text"].split("\n\n"))
            parts += [f'<h2 id="{section["name"]}">{html.escape(section["title"])}</h2>', text, *section["parts"]]
        facts = f"{'quick' if self.quick else 'full'}, seed {self.seed}" + (", with --data" if self.data else "")
        page = self.folder / "index.html"
        page.write_text(
            "<!DOCTYPE html><meta charset=utf-8><title>Experiments</title><style>body{font-family:sans-serif;"
            "max-width:75em;margin:auto}td,th{padding:0 .6em;text-align:left}img{max-width:100%}</style>"
            f"<h1>Experiments</h1><p>{facts}</p>" + "\n".join(parts), encoding="utf-8")
        return page
