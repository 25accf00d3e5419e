"""Builds the module by CMake: pyproject.toml says the rest."""
import os
import pathlib
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext


class BuildByCMake(build_ext):
    def build_extension(self, ext):
        here = pathlib.Path(__file__).resolve().parent
        build = here / "build-pip"  # as deep as make's folder: a compiler cache knows its objects
        generator = ["-G", "Ninja"] if shutil.which("ninja") and not (build / "Makefile").exists() else []
        target = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        subprocess.run(["cmake", "-S", here, "-B", build, *generator, "-DTACTUS_TESTS=OFF", "-DTACTUS_PYTHON=ON",
                        f"-DPython3_EXECUTABLE={sys.executable}", *os.environ.get("CMAKE_ARGS", "").split()], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "tactus_python", "-j", str(os.cpu_count() or 1)], check=True)
        subprocess.run(["cmake", "--install", build, "--component", "python", "--prefix", target], check=True)


setup(ext_modules=[Extension("tactus._tactus", sources=[])], cmdclass={"build_ext": BuildByCMake})
