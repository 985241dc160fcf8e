# SPDX-License-Identifier: BSD-3-Clause
"""Writes what editors know of the package, with the options of the library's table.

stub.py TEMPLATE FOLDER      the folder has the module _core, and gets __init__.pyi"""

import sys
from pathlib import Path

template, folder = map(Path, sys.argv[1:])
sys.path.insert(0, str(folder))
import _core  # noqa: E402


def hint(takes):
    if takes == "on|off":
        return "bool"
    if "|" in takes:
        return "Literal[" + ", ".join(f'"{word}"' for word in takes.split("|")) + "]"
    return "str" if takes == "model" else "float | str"


lines = [f"    {name}: {hint(takes)} | None = ...,\n" for name, _, takes in _core.options() if name != "noise"]
(folder / "__init__.pyi").write_text(template.read_text().replace("    @OPTIONS@\n", "".join(lines)))
