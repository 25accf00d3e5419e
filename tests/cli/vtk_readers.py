#!/usr/bin/env python3
"""Reads the VTK and USD files of a run with readers that aren't ours: VTK's own and meshio's, where they are installed.

usage: vtk_readers.py TACTUS
"""
import pathlib
import re
import subprocess
import sys
import tempfile

SCENE = """
source: {kind: none, frames: 0-20, fps: 60}
bodies:
  - name: slab
    shape: {kind: box, size_m: [0.08, 0.04, 0.08]}
    placement: {position_m: [0, 0.02, 0]}
    spacing_m: 0.01
    cuttable: true
    material: {model: tled, young_modulus_pa: 20000}
    fixed: [{kind: half_space, frame: world, point_m: [0, 0.001, 0], normal: [0, 1, 0]}]
blades:
  - {name: b, from_m: [-0.02, 0.02, -0.05], to_m: [-0.02, 0.06, -0.05], path: [{time_s: 0.02}, {time_s: 0.3, displacement_m: [0, 0, 0.1]}]}
obstacles: [{name: table, kind: box, size_m: [0.3, 0.01, 0.3], placement: {position_m: [0, -0.01, 0]}}]
fluid: {spacing_m: 0.01, box: {min_m: [-0.1, 0, -0.1], max_m: [0.1, 0.2, 0.1]}, blocks: [{min_m: [-0.02, 0.1, -0.02], max_m: [0.02, 0.12, 0.02]}]}
output: {vtk_every: 20, usd_every: 20}
"""
SKIPPED = 77


def by_vtk(path):
    from vtk import vtkXMLUnstructuredGridReader
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    cells = {k: vtk_to_numpy(grid.GetCellData().GetArray(k)) for k in ("J", "cauchy_stress_Pa", "model")}
    return vtk_to_numpy(grid.GetPoints().GetData()), grid.GetNumberOfCells(), cells


def by_meshio(path):
    import meshio

    mesh = meshio.read(str(path))
    cells = {k: mesh.cell_data[k][0] for k in ("J", "cauchy_stress_Pa", "model")}
    return mesh.points.astype("float32"), len(mesh.cells[0].data), cells


def points_of_usd(text):
    """The points of the slab at the last time code."""
    mesh = text.split('def Mesh "body_slab"')[1].split("def ")[0]
    samples = mesh.split("points.timeSamples = {")[1].split("}")[0]
    last = [line for line in samples.splitlines() if ":" in line][-1]
    return [tuple(map(float, p.split(","))) for p in re.findall(r"\(([^)]*)\)", last)]


def main():
    readers = {}
    for name, read in (("vtk", by_vtk), ("meshio", by_meshio)):
        try:
            __import__(name)
            __import__("numpy")
            readers[name] = read
        except ImportError:
            print(f"{name}: not installed here")
    if not readers:
        return SKIPPED
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        (folder / "s.yaml").write_text(SCENE)
        subprocess.run([sys.argv[1], "run", folder / "s.yaml", "--view", "none", "--devices", "cpu", "--out", folder],
                       check=True, stdout=subprocess.DEVNULL)
        read = {name: f(folder / "s-slab-00020.vtu") for name, f in readers.items()}
        for name, (points, count, cells) in read.items():
            # 8 x 8 x 4 cubes of 1 cm, of which the upper half of a layer was cut and is there twice. Nodes below it
            # are one; each wall has the others to itself.
            assert count == 256 + 16, (name, count)
            assert len(points) == 9 * 9 * 5 + 2 * 9 * 2, (name, len(points))
            assert 0.8 < cells["J"].min() and cells["J"].max() < 1.2, name
            assert cells["cauchy_stress_Pa"].shape == (count, 9) and set(cells["model"]) == {1}, name
        if len(read) == 2:
            (a, _, of_a), (b, _, of_b) = read.values()
            assert (a == b).all() and all((of_a[k] == of_b[k]).all() for k in of_a), "the readers differ"
        pvd = (folder / "s.pvd").read_text()
        assert all((folder / f).exists() for f in re.findall(r'file="([^"]*)"', pvd)) and pvd.count("<DataSet") == 4
        assert 'def Mesh "obstacle_table"' in (folder / "s.usda").read_text()
        usd = points_of_usd((folder / "s.usda").read_text())
        assert len(usd) > 400 and all(abs(x) < 0.05 and -0.001 < y < 0.05 for x, y, _ in usd)
    print("read by " + ", ".join(readers))
    return 0


if __name__ == "__main__":
    sys.exit(main())
