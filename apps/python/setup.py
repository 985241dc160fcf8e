# SPDX-License-Identifier: BSD-3-Clause
"""For pip: lets CMake build the module, with the library inside. Needs PCL, Eigen, zlib and nlohmann-json."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

SOURCE = Path(__file__).resolve().parents[2]


class ByCMake(build_ext):
    def build_extension(self, extension):
        options = dict(CMAKE_BUILD_TYPE="Release", CMAKE_UNITY_BUILD="ON", BUILD_SHARED_LIBS="OFF",
                       MRF_BUILD_PYTHON="ON", MRF_BUILD_APPS="OFF", MRF_BUILD_TESTS="OFF", MRF_BUILD_CHOLESKY="OFF",
                       MRF_BUILD_MPI="OFF", MRF_INSTALL="OFF",
                       CMAKE_CXX_FLAGS="-DPCL_ONLY_CORE_POINT_TYPES", Python3_EXECUTABLE=sys.executable)
        if importlib.util.find_spec("pybind11"):
            import pybind11
            options["pybind11_DIR"] = pybind11.get_cmake_dir()
        build = Path(self.build_temp).resolve()
        subprocess.run(["cmake", "-S", SOURCE, "-B", build, *(f"-D{name}={value}" for name, value in options.items())],
                       check=True)
        subprocess.run(["cmake", "--build", build, "--target", "mrf_python_stub", "--parallel", str(os.cpu_count())],
                       check=True)
        target = Path(self.get_ext_fullpath(extension.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        for module in (build / "python" / "pcl_mrf").glob("_core*.so"):
            shutil.copy(module, target)
        shutil.copy(build / "python" / "pcl_mrf" / "__init__.pyi", target.parent)


setup(version=re.search(r"VERSION ([\d.]+) LANGUAGES", (SOURCE / "CMakeLists.txt").read_text())[1],
      packages=["pcl_mrf"], package_data={"pcl_mrf": ["py.typed"]},
      ext_modules=[Extension("pcl_mrf._core", [])], cmdclass={"build_ext": ByCMake})
