#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What src/ledger.md says of the constants that decide about points, normals, sides, volume, trimming and errors.

  ledger.py SOURCE                      exit 1, naming them, if a constant or a number of those folders is not in the
                                        ledger, or the ledger names one that is gone
  ledger.py SOURCE FILE:NAME=VALUE ...  what the clouds of ../shared/data, one-sided views and simulated devices lose
                                        or gain if those constants had these values: builds both in ./ledger, once

Grains of parallel work, which decide nothing, are not asked for."""

import json
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDERS = ("points", "orientation", "pilot", "trimming", "uncertainty")
PLAIN = {0, 1, 2, 3, .5, 100, 180}  # halves, medians, percent, degrees, axes, corners
NUMBER = re.compile(r"(?<![\w.])((?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)(?:[fFuUlL]*)\b(?!\w)")
DECLARED = re.compile(r"constexpr\s[^;]*;")
NAME = re.compile(r"\b([a-zA-Z]\w*)\s*(?:\[\])?\s*[={](?!=)")


def code_of(path):
    """The text of a file without comments, literals of text, and the preprocessor's lines."""
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', re.sub(r"//[^\n]*", "", path.read_text()))
    return "\n".join(line for line in text.split("\n") if not line.startswith("#"))


def named_in(source):
    """Of each file the constants that it declares, and the numbers that have no name."""
    found = {}
    for folder in FOLDERS:
        for path in sorted((source / "src" / folder).glob("*.[ch]*")):
            code = code_of(path)
            names = {name for declaration in DECLARED.findall(code) for name in NAME.findall(declaration)}
            plain = re.sub(r"static_assert[^;]*;", "", DECLARED.sub("", code))
            tokens = {name for name in names if not name.endswith(("_t", "rain")) and name not in ("pi", "infinity")}
            tokens |= {number for number in NUMBER.findall(plain) if float(number) not in PLAIN}
            if tokens:
                found[f"{folder}/{path.name}"] = tokens
    return found


def rows_of(source):
    """Of each file what the ledger names."""
    rows = {}
    for line in (source / "src" / "ledger.md").read_text().split("\n"):
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) > 3 and cells[1].startswith("`"):
            rows.setdefault(cells[1].strip("`"), set()).update(re.findall(r"`([^`]+)`", cells[2]))
    return rows


def check(source):
    found, rows = named_in(source), rows_of(source)
    faults = [f"{file}: {token} is not in src/ledger.md" for file in found for token in found[file] - rows.get(file, set())]
    faults += [f"src/ledger.md: {file} has no {token}" for file in rows for token in rows[file] - found.get(file, set())]
    print("\n".join(sorted(faults)) or f"{sum(map(len, found.values()))} constants and numbers")
    return 1 if faults else 0


def built(source, changes, place):
    """The directory of the tools of a tree with other constants."""
    if not (place / "bin/pcl_mrf_reconstruction").exists():
        tree = place / "tree"
        tree.mkdir(parents=True, exist_ok=True)
        subprocess.run(f"git -C {source} archive HEAD | tar x -C {tree}", shell=True, check=True)
        for change in changes:
            file, name, value = re.fullmatch(r"([^:]+):(\w+)=(.+)", change).groups()
            text = (tree / "src" / file).read_text()
            changed = re.sub(rf"\b{name}(\s*)= [^,;]+", rf"{name}\1= {value}", text, count=1)
            if changed == text:
                sys.exit(f"{file} has no {name} to change")
            (tree / "src" / file).write_text(changed)
        subprocess.run(["cmake", "-S", tree, "-B", place, "-DMRF_UNITY_BUILD=ON"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", place, "-j2", "-t", "pcl_mrf_reconstruction", "pcl_mrf_evaluate",
                        "pcl_mrf_scan"], check=True, stdout=subprocess.DEVNULL)
    return place / "bin"


def clouds_of(source, tools, place):
    """The clouds: name, arguments of the reconstruction, arguments of the evaluation. Simulated ones are made once."""
    data = source.parent / "shared/data"
    place.mkdir(exist_ok=True)
    for case in sorted(data.glob("*/input.ply")):
        yield case.parent.name, [case], ["--input", case, "--held-out", case.parent / "heldout.ply"]
    for case in sorted(data.glob("real/*/input.ply")):
        sensors = case.parent / "sensors.txt"
        yield case.parent.name, [case, *(["--sensors", sensors] if sensors.exists() else [])], [
            "--input", case, "--held-out", case.parent / "heldout_random.ply"]
    for case in sorted(data.glob("depth/*/input.ply")):
        yield case.parent.name, [case, "--sensor", "0,0,0"], ["--input", case]
    for case in sorted(p for p in data.glob("field/*/*") if p.suffix in (".ply", ".xyz")):
        yield f"{case.parent.name}-{case.stem}", [case], ["--input", case]

    def scan(name, subject, *words):
        cloud, clean, rest, truth, sensors = (place / (name + end) for end in (
            ".ply", "-clean.ply", "-rest.ply", "-truth.ply", ".txt"))
        if not cloud.exists():
            subprocess.run([tools / "pcl_mrf_scan", subject, cloud, "--write-truth", truth, "--write-sensors", sensors, "-q",
                            "--write-clean", clean,
                            *(["--write-held-out", rest] if "--holes" in words else []), *words], check=True)
        asked = ["--held-out", rest] if "--holes" in words else ["--clean", clean]
        return cloud, sensors, ["--reference", truth, "--samples", "5000", *asked]

    for reference in sorted(data.glob("reference/[bin]*.ply")):
        for view in range(12):
            cloud, _, asked = scan(f"{reference.stem}-{view}", reference, "--placement", "ring", "--views", "1", "--rotate",
                                   f"{30 * view},{50 * view},0", "--holes", "2", "--hole-radius", "4%", "--points", "12000")
            yield cloud.stem, [cloud], asked
        for noise in ("1.3", "2.6"):
            cloud, _, asked = scan(f"{reference.stem}-noise-{noise}", reference, "--noise", noise + "s", "--points", "20000",
                                   "--normals", "estimated")
            yield cloud.stem, [cloud], asked
    for device in ("depth-camera", "lidar", "structured-light", "photogrammetry"):
        for scene in ("table", "person", "street", "facade"):
            cloud, sensors, asked = scan(f"{device}-{scene}", scene, "--device", device, "--points", "20000", "--placement",
                                         "ring" if scene == "person" else "front", "--views", "3", "--normals", "estimated")
            yield cloud.stem, [cloud, "--sensors", sensors], asked


def figures(tools, place, cloud):
    name, arguments, asked = cloud
    mesh, report = place / (name + ".ply"), place / (name + ".json")
    if not report.exists():
        subprocess.run([tools / "pcl_mrf_reconstruction", arguments[0], mesh, *arguments[1:], "--no-remesh", "-q",
                        "--threads", "1"], stderr=subprocess.DEVNULL)
        subprocess.run([tools / "pcl_mrf_evaluate", mesh, *asked, "--json", report, "-q"], stderr=subprocess.DEVNULL)
    if not report.exists():
        return name, {}
    read = json.loads(report.read_text())
    distances = {key: value["rms"] for key, value in read["distances"].items() if isinstance(value, dict)}
    reference = {key: value for key, value in read.get("reference", {}).items() if key.endswith("Share")}
    mesh = {key: read["mesh"][key] for key in ("area", "components", "boundaryEdges")}
    return name, {**mesh, **distances, **reference}


def ablate(source, changes):
    root = Path("ledger").absolute()
    root.mkdir(exist_ok=True)
    trees = [built(source, [], root / "as-it-is"), built(source, changes, root / re.sub(r"[^\w.=-]", "_", "+".join(changes)))]
    clouds = list(clouds_of(source, trees[0], root / "clouds"))
    results = []
    for tools in trees:
        place = tools.parent / "meshes"
        place.mkdir(exist_ok=True)
        with ThreadPoolExecutor(2) as pool:
            results.append(dict(pool.map(lambda cloud: figures(tools, place, cloud), clouds)))
    for name, before in results[0].items():
        after = results[1][name]
        changed = [f"{key} {before[key]:.4g} -> {after.get(key, float('nan')):.4g}" for key in before
                   if not abs(after.get(key, float("nan")) - before[key]) <= .01 * abs(before[key])]
        if changed:
            print(f"{name}: " + ", ".join(changed))
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    tree = Path(sys.argv[1]).resolve()
    sys.exit(ablate(tree, sys.argv[2:]) if len(sys.argv) > 2 else check(tree))
