#!/usr/bin/env python3
"""python_package.py PROJECT BUILD SCRATCH: makes the Debian package of the module, as `make bundle` does, and tests what is in it:
fields, files, and a world that is stepped by Debian's Python with nothing else in its path."""
import pathlib
import re
import shutil
import subprocess
import sys

SKIPPED = 77
PRESS = """
import pathlib, sys
import tactus
folder = pathlib.Path(tactus.__file__).parent
assert folder == pathlib.Path(sys.argv[1]), folder
world = tactus.World("cpu", tactus.Scene({"bodies": [{
    "name": "slab", "shape": {"kind": "box", "size_m": [0.08, 0.04, 0.08]}, "spacing_m": 0.02}]}))
world.step(1 / 60)
height_m = world.positions("slab")[:, 1].mean()
assert -0.005 < height_m < 0, height_m           # it falls by less than g t^2
import tactus.gym
print(world.state_hash(), (folder / "py.typed").exists())
"""


def fields(deb):
    text = subprocess.run(["dpkg-deb", "--field", deb], check=True, capture_output=True, text=True).stdout
    return dict(re.findall(r"^([\w-]+): (.*)$", text, re.MULTILINE))


def main():
    project, build, scratch = map(pathlib.Path, sys.argv[1:])
    if shutil.which("dpkg-deb") is None or not list(build.glob("python/tactus/_tactus.cpython-*.so")):
        print("skipped: no dpkg-deb here, or the module isn't built")
        return SKIPPED
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    subprocess.run([project / "tools/make_python_package.sh", build, scratch], check=True)
    deb, = scratch.glob("python3-tactus_*.deb")
    control = fields(deb)
    assert control["Package"] == "python3-tactus" and control["Section"] == "python", control
    depends = control["Depends"].split(", ")
    minor = sys.version_info.minor
    assert {f"python3 (>= 3.{minor})", f"python3 (<< 3.{minor + 1})", "python3-numpy", "libc6", "libstdc++6"} <= set(depends), depends
    root = scratch / "root"
    subprocess.run(["dpkg-deb", "-x", deb, root], check=True)
    package = root / "usr/lib/python3/dist-packages/tactus"
    source = {p.name for p in (project / "python/tactus").iterdir() if p.suffix in (".py", ".pyi", ".typed")}
    assert {p.name for p in package.iterdir()} == source | {p.name for p in build.glob("python/tactus/_tactus.cpython-*.so")}
    module, = package.glob("_tactus.*.so")
    sections = subprocess.run(["readelf", "-SW", module], check=True, capture_output=True, text=True).stdout
    dynamic = subprocess.run(
        ["readelf", "-d", module], check=True, capture_output=True, text=True).stdout
    assert ".symtab" not in sections and not re.search(r"RPATH|RUNPATH", dynamic), "stripped, and without paths of the build"
    documents = root / "usr/share/doc/python3-tactus"
    assert (documents / "copyright").exists() and (documents / "examples/stiffness.py").exists()
    python = "/usr/bin/python3" if pathlib.Path("/usr/bin/python3").exists() else sys.executable  # it has Debian's numpy
    ran = subprocess.run([python, "-I", "-c", f"import sys; sys.path.insert(0, {str(package.parent)!r})\n{PRESS}", package],
                         cwd=scratch, capture_output=True, text=True)
    assert ran.returncode == 0 and ran.stdout.endswith("True\n"), ran.stdout + ran.stderr
    print(f"{deb.name}: {deb.stat().st_size >> 10} KiB, {len(depends)} packages needed, state {ran.stdout.split()[0]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
