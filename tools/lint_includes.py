#!/usr/bin/env python3
"""Checks the direction of includes between the layers, and what kernels may use. Exits 1 and names each line."""
import pathlib
import re
import sys
import tempfile

# Module -> modules it may include (besides itself). Linking is the same graph: see src/tactus/*/CMakeLists.txt.
L0 = {"base"}
L1 = L0 | {"compute"}
GEOM = L1 | {"multi_device"}
L2 = GEOM | {"geom", "frame"}
SIM = L2 | {"rig", "tissue", "contact", "fluid"}
WORLD = SIM | {"sim", "perception"}
RUN = WORLD | {"reconstruct", "track", "world", "io", "view", "media"}
ALLOWED = {
    "base": set(), "compute": L0, "multi_device": L1, "geom": GEOM, "frame": GEOM,
    "media": L0, "rig": L2 | {"media"}, "reconstruct": L2, "tissue": L2, "contact": L2, "fluid": L2, "track": L2,
    "sim": SIM, "perception": SIM | {"sim", "reconstruct", "track"}, "world": WORLD | {"io"}, "io": SIM | {"sim"}, "view": L2 | {"media"},
    "run": RUN, "web": RUN | {"run"}, "window": RUN | {"run"}, "xr": RUN | {"run"},
    "cli": RUN | {"run", "web", "window", "xr", "bench"},
}
INCLUDE = re.compile(r'#include "tactus/(\w+)/')
PATH = re.compile(r'#include "([^"]+)"')
LIBM = re.compile(r"\b(std::(sin|cos|tan|exp|log|pow|sqrt|atan2?|fma)|(?<![\w:.])(sinf|cosf|expf|logf|powf|sqrtf))\s*\(")
# What kernels do is compiled where they are launched: only headers of kernels, .cu and .cpp files include headers of kernels.
KERNEL_INCLUDE = re.compile(r'#include "tactus/((?:\w+/)*(?:\w+_kernels|element_forces|cube_forces|material_laws)\.h)"')
# Headers that others launch kernels through, as templates do, or that kernels and classes still share. None is to be added.
MAY_INCLUDE_KERNELS = {
    "multi_device/halo.h", "frame/readback.h", "geom/search/cell_list.h", "geom/search/neighbour_lists.h", "geom/search/neighbour_search.h",
    "contact/body_points.h", "contact/contact.h", "contact/pairs/pair_weights.h", "contact/point_query.h", "contact/real/real_surface.h",
    "contact/real/sample_level.h", "contact/real/surface_report.h", "contact/surface_triangles.h", "contact/walls/active_walls.h",
    "contact/walls/near_surface.h", "fluid/film/film.h", "fluid/film/film_exchange.h", "fluid/liquid.h", "fluid/liquid_part.h",
    "fluid/wounds.h", "reconstruct/depth/depth_stage.h", "reconstruct/hull_check.h", "reconstruct/hull_plan.h",
    "reconstruct/silhouette_stage.h", "reconstruct/texture/surface_texture.h", "reconstruct/texture/view_scores.h",
}
# Python is a program as others are: it includes public headers, and these. None is to be added.
PYTHON_MAY_INCLUDE = {
    "base/byte_io.h", "base/free_memory.h", "base/read_file.h", "geom/camera/place_limits.h", "reconstruct/doctor/rig_doctor.h",
    "reconstruct/surface_pipeline.h", "rig/calibrate/calibrate_cameras.h", "rig/calibrate/coverage.h",
}
CUDA_WORD = re.compile(r"__CUDACC__|__CUDA_ARCH__|__device__|__global__")


def check(root: pathlib.Path) -> list[str]:
    problems = []
    for file in sorted(f for folder in ("include", "src") for f in (root / folder).rglob("*")):
        if file.suffix not in {".h", ".cpp", ".cu", ".cuh"}:
            continue
        module = file.relative_to(root).parts[2]
        name = "/".join(file.relative_to(root).parts[2:])
        is_public = file.is_relative_to(root / "include")
        is_kernels = file.name.endswith("_kernels.h")
        # Templates of kernels, too.
        includes_kernels = (file.suffix != ".h" or name in MAY_INCLUDE_KERNELS or KERNEL_INCLUDE.match(f'#include "tactus/{name}"'))
        for number, line in enumerate(file.read_text().splitlines(), 1):
            where = f"{file.relative_to(root)}:{number}"
            code = line.split("//")[0]
            if m := INCLUDE.search(line):
                target = m.group(1)
                if target != module and target not in ALLOWED[module]:
                    problems.append(f"{where}: {module} must not include {target}")
                if is_public and not (root / "include" / PATH.search(line).group(1)).is_file():
                    problems.append(f"{where}: a public header includes public ones alone: the others are not installed")
            if not includes_kernels and (m := KERNEL_INCLUDE.search(line)):
                problems.append(f"{where}: {m.group(1)} holds kernels: include it in the .cpp that launches them")
            if CUDA_WORD.search(code) and module not in {"base", "compute"}:
                problems.append(f"{where}: CUDA words belong in base/ and compute/")
            if is_kernels and LIBM.search(code):
                problems.append(f"{where}: kernels use the project's own maths, not libm")
            if is_kernels and "atomicAdd" in code:
                problems.append(f"{where}: no atomics in kernels: gather instead")
    return problems + check_python(root)


def check_python(root: pathlib.Path) -> list[str]:
    problems = []
    for file in sorted((root / "python").rglob("*")):
        if file.suffix not in {".h", ".cpp"}:
            continue
        for number, line in enumerate(file.read_text().splitlines(), 1):
            header = m.group(1) if (m := PATH.search(line)) else ""
            is_public = (root / "include" / header).is_file() or not header.startswith("tactus/")
            if not is_public and header.removeprefix("tactus/") not in PYTHON_MAY_INCLUDE:
                problems.append(f"{file.relative_to(root)}:{number}: Python includes public headers: {header} is none")
    return problems


# A file that breaks a rule, and what must be said of it; None: nothing.
FIXTURES = [
    ("rig/a.h", '#include "tactus/reconstruct/visual_hull.h"', "rig must not include reconstruct"),
    ("sim/a.cpp", '#include "tactus/io/json_file.h"', "sim must not include io"),
    ("world/a.h", '#include "tactus/reconstruct/visual_hull.h"', "world must not include reconstruct"),
    ("base/a.h", '#include "tactus/compute/view.h"', "base must not include compute"),
    ("include/tactus/world/a.h", '#include "tactus/sim/body/soft_body.h"', "public ones alone"),
    ("python/src/a.cpp", '#include "tactus/world/world_impl.h"', "Python includes public headers"),
    ("python/src/a.cpp", '#include "tactus/rig/calibrate/coverage.h"', None),
    ("python/src/a.cpp", '#include "arrays.h"', None),
    ("geom/a.h", '#include "tactus/base/vec.h"', None),
    ("tissue/a.h", '#include "tactus/tissue/tled/element_forces.h"', "holds kernels"),
    ("geom/a.h", '#include "tactus/geom/b_kernels.h"', "holds kernels"),
    ("geom/a_kernels.h", '#include "tactus/geom/b_kernels.h"', None),
    ("geom/a.cpp", '#include "tactus/geom/b_kernels.h"', None),
    ("geom/a_kernels.h", "y = std::sqrt(x);", "not libm"),
    ("geom/a_kernels.h", "y = expf(x);", "not libm"),
    ("geom/a_kernels.h", "y = tactus::sqrt(x);  // not std::sqrt(x)", None),
    ("geom/a.cpp", "y = std::sqrt(x);", None),
    ("tissue/a_kernels.h", "atomicAdd(&x, 1);", "no atomics"),
    ("view/a.cpp", "__device__ int x;", "CUDA words"),
    ("compute/cuda/a.cuh", "__device__ int x;", None),
]


def self_test() -> None:
    """Every rule is seen to fail on a file that breaks it."""
    for name, text, message in FIXTURES:
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / (name if name.startswith(("include/", "python/")) else f"src/tactus/{name}")
            file.parent.mkdir(parents=True)
            file.write_text(f"// line 1\n{text}\n")
            found = check(pathlib.Path(folder))
            if message is None:
                assert not found, f"{name}: '{text}' is allowed, but: {found}"
            else:
                assert len(found) == 1 and message in found[0] and f"{name}:2" in found[0], f"{name}: '{text}': {found}"


if __name__ == "__main__":
    self_test()
    found = check(pathlib.Path(__file__).resolve().parent.parent)
    print("\n".join(found) if found else "includes: in order")
    sys.exit(1 if found else 0)
