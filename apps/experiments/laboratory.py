# SPDX-License-Identifier: BSD-3-Clause
"""The environment of experiments: programs, scans, stored results, tables and the page."""

import csv
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
from .figures import text_of

BUNNY = "/usr/share/glmark2/models/bunny.obj"
CGAL_DATA = "/usr/share/doc/libcgal-dev/data.tar.gz"


class Failure(Exception):
    """A program failed."""


class Scan:
    """The files that pcl_mrf_scan wrote to a folder."""

    def __init__(self, lab, folder, subject, estimated):
        self.folder, self.subject, self.estimated, self._lab = folder, subject, estimated, lab
        self.report = json.loads((folder / "scan.json").read_text())
        self.diagonal, self.spacing, self.holes = (self.report[name] for name in ("diagonal", "spacing", "holes"))

    def path(self, name):
        return str(self.folder / name)

    @cached_property
    def cloud(self):
        return surfaces.read(self.path("scan.ply"))

    @cached_property
    def held_out(self):
        return surfaces.read(self.path("held-out.ply")) if self.holes else surfaces.Surface([])

    @property
    def sensor_options(self):
        """Options to estimate normals, if those of the scan are estimated, and to orient them by the sensors."""
        if not self.estimated:
            return []
        return ["--normals", "estimate", "--views", self.path("views.txt"), "--sensors", self.path("sensors.txt")]

    def truth(self, places):
        """Distances from places to the object."""
        return self._lab.truth(self.subject)(places)


class Result:
    """A mesh that a program made. Its file is removed with the object."""

    def __init__(self, lab, path, seconds, megabytes, report=None):
        self.path, self.seconds, self.megabytes, self.report, self._lab = path, seconds, megabytes, report or {}, lab
        weakref.finalize(self, Path(path).unlink, missing_ok=True)

    @cached_property
    def mesh(self):
        mesh = surfaces.read(self.path)
        if not mesh.areas().sum() > 0:
            raise Failure("there is no surface")
        return mesh

    def evaluate(self, *options):
        return self._lab.evaluate(self.path, *options)


class Laboratory:
    """\\param tools a folder with our programs, before those of PATH"""

    def __init__(self, folder, tools=None, quick=False, seed=1, data=None, threads=0, sampling="even"):
        self.folder, self.tools = Path(folder), tools
        self.quick, self.seed, self.sampling = quick, seed, sampling
        self.threads = ("--threads", threads) if threads else ()
        self.data = Path(data) if data else None
        self.cases = self.folder / "cases" / f"{'quick' if quick else 'full'}-{seed}"
        self.parts = []
        self._temporary, self._count = tempfile.TemporaryDirectory(prefix="pcl_mrf_"), 0
        self.cases.mkdir(parents=True, exist_ok=True)

    # Programs

    def find(self, program):
        """\\return None if the program is missing"""
        folders = ([self.tools] if self.tools else []) + os.environ.get("PATH", "").split(os.pathsep)
        return shutil.which(program, path=os.pathsep.join(folders))

    def run(self, program, *arguments):
        """\\return CPU seconds of all threads and the largest memory in MB \\throw Failure"""
        path = self.find(program)
        if path is None:
            raise Failure(f"{program} is not on PATH")
        environment = dict(os.environ, **({"OMP_NUM_THREADS": str(self.threads[1])} if self.threads else {}))
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

    def points(self, count):
        """The number of points of a scan; quick: a fifth."""
        return count // 5 if self.quick else count

    def scratch(self, name):
        """A path for a file that is removed at the end of the run."""
        self._count += 1
        return f"{self._temporary.name}/{self._count}-{name}"

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
        self.run("pcl_mrf_scan", subject, folder / "scan.ply", "-q", "--seed", self.seed if seed is None else seed, *words,
                 *more, *self.threads)
        return Scan(self, folder, subject, "estimated" in words)

    def reconstruct(self, cloud, *options):
        mesh, report = self.scratch("mesh.ply"), self.scratch("report.json")
        threads = () if "--threads" in options else self.threads
        seconds, megabytes = self.run("pcl_mrf_reconstruction", cloud, mesh, "-q", "--report", report, *options, *threads)
        return Result(self, mesh, seconds, megabytes, json.loads(Path(report).read_text()))

    def evaluate(self, mesh, *options):
        """The JSON report of pcl_mrf_evaluate."""
        path = self.scratch("evaluation.json")
        self.run("pcl_mrf_evaluate", mesh, "-q", "--json", path, *options, *self.threads)
        return json.loads(Path(path).read_text())

    # Objects

    @lru_cache(maxsize=1)
    def objects(self):
        """The objects to scan: names and mesh files, of the bunny, CGAL's data, --data, and generated."""
        folder = self.folder / "objects"
        folder.mkdir(exist_ok=True)
        found = {"bunny": BUNNY} if os.path.exists(BUNNY) else {}
        for name in ("armadillo", "bear") if os.path.exists(CGAL_DATA) else ():
            found[name] = str(folder / f"{name}.off")
            if not os.path.exists(found[name]):
                subprocess.run(["tar", "-xzf", CGAL_DATA, "-C", folder, "--strip-components=2", f"data/meshes/{name}.off"],
                               check=True)
        for name in ("bunny", "igea", "nefertiti") if self.data else ():
            path = self.data / "reference" / f"{name}.ply"
            if path.exists():
                found.setdefault(name, str(path))
        for name, make in (("wavy torus", surfaces.wavy_torus), ("wavy box", surfaces.wavy_box)):
            found[name] = str(folder / f"{name}.ply")
            if not os.path.exists(found[name]):
                make().write(found[name])
        return found

    @lru_cache(maxsize=3)
    def truth(self, subject):
        """A function that gives the distances from places to a mesh file, or to the shape `primitives`."""
        if subject == "primitives":
            return lambda places: np.abs(surfaces.primitives(places))
        mesh = surfaces.read(subject)
        return lambda places: surfaces.distances(places, mesh)

    # Results

    def case(self, key, compute):
        """The result of one case, stored by an earlier run or computed and stored now. A failure is stored, too, as
        {"failed": message}; delete its file to try again."""
        path = self.cases / (key + ".json")
        if path.exists():
            return json.loads(path.read_text())
        try:
            result = compute()
        except Failure as failure:
            result = {"failed": str(failure)}
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_text(json.dumps(result, indent=1, default=float))
        part.rename(path)
        return result

    def say(self, text):
        """Adds a paragraph to the page."""
        self.parts.append(text)

    def table(self, name, title, rows):
        """Writes NAME.csv of rows, whose keys are the columns. Lists and dictionaries are left out."""
        columns = list(dict.fromkeys(key for row in rows for key, cell in row.items() if not isinstance(cell, (list, dict))))
        texts = [columns] + [[text_of(row.get(column)) for column in columns] for row in rows]
        with open(self.folder / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(texts)
        self.say(f"### [{title}]({name}.csv)")
        self.say("\n".join(f"| {' | '.join(line)} |" for line in [columns, ["---"] * len(columns)] + texts[1:]))

    def picture(self, name, draw):
        """Writes NAME.png unless it exists. \\param draw makes the figure; the data that it needs may fail"""
        path = self.folder / f"{name}.png"
        try:
            if not path.exists():
                drawing.save(draw(), path)
            self.say(f"![{name}]({name}.png)")
        except Failure as failure:
            self.say(f"{name}.png: {failure}")

    def write_page(self):
        page = self.folder / "index.md"
        facts = f"{'Quick' if self.quick else 'Full'}, seed {self.seed}" + (", with --data." if self.data else ".")
        page.write_text("\n\n".join(["# Experiments", facts] + self.parts) + "\n", encoding="utf-8")
        return page
