# SPDX-License-Identifier: BSD-3-Clause
"""The command line."""

import argparse
import inspect
import sys
from pathlib import Path

from .clouds import guide, real
from .devices import devices
from .grids import fig_9, section_3_4
from .laboratory import Failure, Laboratory
from .noise import fig_8, l_curve, uncertainty
from .patches import defaults, table_1
from .priors import fig_2, fig_3, fig_4, fig_5

#: All experiments, in the order of the paper.
EXPERIMENTS = {
    "fig-2": ("Fig. 2: triangles before and after remeshing", fig_2),
    "fig-3": ("Fig. 3: the priors on tubes and primitives", fig_3),
    "fig-4": ("Fig. 4: confidence on the surface", fig_4),
    "fig-5": ("Fig. 5: a large hole", fig_5),
    "table-1": ("Table 1: leaving patches out, beside other methods", table_1),
    "real": ("Real clouds: open, uneven, cluttered", real),
    "devices": ("Scenes as devices scan them, beside the truth", devices),
    "fig-8": ("Figs. 7 and 8: noise and outliers", fig_8),
    "l-curve": ("The L-curve of beta", l_curve),
    "uncertainty": ("Error bars: how often they hold, how wide they are, how they rank", uncertainty),
    "fig-9": ("Fig. 9: rotation", fig_9),
    "sec-3-4": ("Sec. 3.4: the solvers", section_3_4),
    "defaults": ("Deciding the defaults", defaults),
    "guide": ("What the options are for", guide),
}


def parse(arguments):
    parser = argparse.ArgumentParser(
        prog="pcl_mrf_experiments",
        description="Repeats the paper's experiments beside other methods, and writes a page, tables and pictures.",
        epilog="FOLDER receives index.md, a CSV file per table, a PNG file per picture, and cases/, a JSON file for each "
        "case. What is there is not measured or drawn again: an interrupted run goes on, and after another build the folder "
        "is to be deleted. Exit status: 0 done, 2 wrong usage, 3 an experiment failed.")
    parser.add_argument("-o", "--output", metavar="FOLDER", help="of the results; made if it is not there")
    parser.add_argument("--quick", action="store_true",
                        help="fewer scans and settings, coarser grids, Poisson at depth 8 only: minutes instead of hours")
    parser.add_argument("--only", metavar="NAME,...", help="some of the experiments, by the names that --list gives")
    parser.add_argument("--list", action="store_true", help="print the experiments' names and titles")
    parser.add_argument("--seed", type=int, default=1, help="of all scans; default 1")
    parser.add_argument("--sampling", choices=("even", "random", "scanner"), default="even",
                        help="of the scans of table-1 and defaults, as in pcl_mrf_scan; default even")
    parser.add_argument("--data", metavar="FOLDER",
                        help="with further objects to scan: reference/igea.ply, reference/nefertiti.ply; with clouds: "
                        "real/*/input.ply, with normals, and beside it heldout.ply, heldout_random.ply, sensors.txt")
    parser.add_argument("--threads", type=int, default=0,
                        help="results do not depend on it, times do; default one per hardware thread")
    parser.add_argument("-q", "--quiet", action="store_true", help="print errors only")
    options = parser.parse_args(arguments)
    options.only = options.only.split(",") if options.only else list(EXPERIMENTS)
    for name in options.only:
        if name not in EXPERIMENTS:
            parser.error(f"there is no experiment '{name}'; --list names them")
    if not options.list and not options.output:
        parser.error("--output is required")
    if options.data and not any((Path(options.data) / name).is_dir() for name in ("reference", "real")):
        parser.error(f"--data: '{options.data}' holds neither the folder reference nor real")
    return options


def main(tools):
    """\\param tools the folder of the other programs"""
    options = parse(sys.argv[1:])
    if options.list:
        for name, (title, _) in EXPERIMENTS.items():
            print(f"{name:12} {title}")
        return 0
    lab = Laboratory(options.output, tools, options.quick, options.seed, options.data, options.threads, options.sampling)
    failed = False
    for name, (title, run) in EXPERIMENTS.items():
        if name not in options.only:
            continue
        if not options.quiet:
            print(f"{name}: {title}", flush=True)
        lab.say(f"## {title}")
        lab.say(inspect.getdoc(run))
        try:
            run(lab)
        except Failure as failure:  # ends this section, not the other experiments
            lab.say(f"This experiment failed: {failure}")
            print(f"{name}: {failure}", file=sys.stderr)
            failed = True
        page = lab.write_page()
    if not options.quiet:
        print(f"wrote {page}")
    return 3 if failed else 0
