"""Results where they were computed. The protocols are the same on the CPU, where all but the last tests run; those skip
without a GPU. To run them there: pytest python/tests/test_device_arrays.py -rs, with torch and cupy installed."""
import ctypes
import gc
import os
import pathlib

import numpy as np
import pytest
import tactus

SOURCE = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve()
TOUCH = SOURCE / "scenes/touch.yaml"
HAND = {"source": {"kind": "synthetic", "figure": "hand"}}


def gpu():
    """Why there is none, or ''."""
    try:
        tactus.Devices("cuda:0")
    except tactus.Error as error:
        return f"no GPU: {error}"
    return ""


WHY_NO_GPU = gpu()
needs_gpu = pytest.mark.skipif(WHY_NO_GPU != "", reason=WHY_NO_GPU)
DEVICES = ["cpu", "cpu:3", pytest.param("cuda:0", marks=needs_gpu)]


def touched(devices, frames=3):
    world = tactus.World(devices, tactus.Scene(TOUCH))
    for _ in range(frames):
        world.step(1 / 60)
    return world


class Dlpack(ctypes.Structure):
    """DLTensor, as https://dmlc.github.io/dlpack has it."""
    _fields_ = [("data", ctypes.c_void_p), ("kind", ctypes.c_int32), ("ordinal", ctypes.c_int32),
                ("dimensions", ctypes.c_int32), ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8),
                ("lanes", ctypes.c_uint16), ("shape", ctypes.POINTER(ctypes.c_int64)),
                ("strides", ctypes.POINTER(ctypes.c_int64)), ("byte_offset", ctypes.c_uint64)]


class Versioned(ctypes.Structure):
    _fields_ = [("major", ctypes.c_uint32), ("minor", ctypes.c_uint32), ("context", ctypes.c_void_p),
                ("deleter", ctypes.c_void_p), ("flags", ctypes.c_uint64), ("tensor", Dlpack)]


def pointer(capsule, name, type_):
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return ctypes.cast(get(capsule, name), ctypes.POINTER(type_)).contents


@pytest.mark.parametrize("devices", DEVICES)
def test_they_hold_what_copies_hold(devices):
    world = touched(devices)
    mesh = world.snapshot().bodies[0]
    surface = world.device_surface("slab")
    for array, copy in ((world.device_positions("slab"), world.positions("slab")),
                        (world.device_velocities("slab"), world.velocities("slab")),
                        (surface.positions, mesh.positions), (surface.normals, mesh.normals),
                        (surface.triangles, mesh.triangles)):
        values = array.numpy()
        assert array.shape == copy.shape == values.shape and len(array) == len(copy)
        assert array.dtype == copy.dtype == values.dtype
        assert values.tobytes() == copy.tobytes(), repr(array)
    assert world.device_positions("slab").device == ("cuda:0" if devices == "cuda:0" else "cpu")
    assert "vertices" in repr(surface)


@pytest.mark.parametrize("devices", DEVICES)
def test_hulls_too(devices):
    source = tactus.open_scene_source(tactus.Scene(HAND))
    hull = tactus.VisualHull(devices, source.rig, resolution=40)
    mesh = hull.device_mesh()
    assert mesh.positions.shape == mesh.triangles.shape == (0, 3), "before the first"
    for _ in range(2):
        copy = hull.reconstruct(source.next_frame())
        assert mesh.positions.numpy().tobytes() == copy.positions.tobytes(), "it is that of the last frame"
        assert mesh.normals.numpy().tobytes() == copy.normals.tobytes()
        assert mesh.triangles.numpy().tobytes() == copy.triangles.tobytes()
    seen = tactus.Perception(devices, tactus.Scene(HAND), source.rig)
    world = tactus.World(seen.devices, tactus.Scene(HAND), seen)
    assert seen.device_surface().positions.shape == (0, 3)
    world.set_surface(seen.observe(source.next_frame(), 0))
    world.step(0)
    assert seen.device_surface().positions.numpy().tobytes() == seen.surface().positions.tobytes()
    assert seen.device_surface().triangles.shape == seen.surface().triangles.shape


def test_numpy_looks_at_the_worlds_own_memory():
    """The address is that of the buffer, in every frame; and it can't be written."""
    world = touched("cpu")
    array = world.device_positions("slab")
    view, by_dlpack = np.asarray(array), np.from_dlpack(array)
    assert view.ctypes.data == by_dlpack.ctypes.data == np.asarray(world.device_positions("slab")).ctypes.data
    assert not view.flags.writeable and np.asarray(array, dtype=np.float64).dtype == np.float64
    before = view.copy()
    world.step(1 / 60)
    assert (view != before).any() and (view == world.positions("slab")).all()


@pytest.mark.parametrize("take", [np.asarray, np.from_dlpack], ids=["array", "dlpack"])
def test_they_keep_their_world(take):
    view = take(touched("cpu").device_positions("slab"))
    expected = touched("cpu").positions("slab")
    gc.collect()
    assert (view == expected).all()


def test_a_world_that_is_replaced_stays_for_them():
    """load_state() in a world that was cut makes another one."""
    world = tactus.World("cpu", tactus.Scene(SOURCE / "scenes/slice.yaml"))
    begin, name = world.save_state(), "block"
    array = world.device_positions(name)
    at_rest = array.numpy()
    for _ in range(60):
        world.step(1 / 30)
        if world.stroke_results():
            break
    assert world.stroke_results()
    view = np.asarray(array)
    cut = view.copy()
    world.load_state(begin)
    assert (view == cut).all() and len(cut) > len(at_rest), "a cut makes nodes"
    assert (cut[: len(at_rest)] != at_rest).any()
    assert (np.asarray(array) == at_rest).all(), "it shows the world as it is now"


def test_capsules_say_what_the_standard_asks():
    world = touched("cpu")
    array = world.device_positions("slab")
    assert array.__dlpack_device__() == (1, 0)
    legacy = array.__dlpack__(stream=None)
    tensor = pointer(legacy, b"dltensor", Dlpack)
    capsule = array.__dlpack__(max_version=(1, 2), dl_device=(1, 0), copy=False, stream=-1)
    versioned = pointer(capsule, b"dltensor_versioned", Versioned)
    assert (versioned.major, versioned.flags) == (1, 1), "read-only"
    for t in (tensor, versioned.tensor):
        assert (t.kind, t.ordinal, t.dimensions, t.code, t.bits, t.lanes, t.byte_offset) == (1, 0, 2, 2, 32, 1, 0)
        assert (t.shape[0], t.shape[1], t.strides[0], t.strides[1]) == (*array.shape, 3, 1)
        assert t.data == np.asarray(array).ctypes.data
    triangles = world.device_surface("slab").triangles.__dlpack__(max_version=(1, 0))
    assert pointer(triangles, b"dltensor_versioned", Versioned).tensor.code == 0, "int"
    with pytest.raises(AttributeError, match="on the CPU"):
        array.__cuda_array_interface__
    for wrong, message in (({"stream": 5}, "stream is 5, expected None"), ({"copy": True}, "copy is True, expected"),
                           ({"dl_device": (2, 0)}, r"dl_device is \(2, 0\), expected that of this array, \(1, 0\)")):
        with pytest.raises(BufferError, match=message):
            array.__dlpack__(**wrong)
    with pytest.raises(TypeError):
        array.__dlpack__("stream")


def test_unused_capsules_take_no_memory():
    """Nor do used ones: each keeps its world, so a world that goes shows that they are gone."""
    import resource
    for k in range(4000):
        if k == 200:
            world = touched("cpu", 1)
            array = world.device_positions("slab")
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        elif k > 200:
            array.__dlpack__(), array.__dlpack__(max_version=(1, 0)), np.from_dlpack(array), np.asarray(array)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1024, "kB"


def test_torch_takes_them():
    torch = pytest.importorskip("torch", reason="python3-torch isn't installed")
    world = touched("cpu")
    array = world.device_positions("slab")
    tensor = torch.from_dlpack(array)
    assert tensor.data_ptr() == np.asarray(array).ctypes.data
    world.step(1 / 60)
    assert (tensor.numpy() == world.positions("slab")).all()
    del world, array
    assert torch.isfinite(tensor).all()


def test_mistakes_are_named():
    world = touched("cpu", 1)
    with pytest.raises(tactus.Error, match="body 'slob' is not in the scene; did you mean 'slab'"):
        world.device_positions("slob")
    with pytest.raises(tactus.Error, match="stream is 7, but 'cpu' has no CUDA streams: expected none"):
        world.step(1 / 60, stream=7)
    with pytest.raises(tactus.Error, match="stream is -3, expected a CUDA stream"):
        world.step(1 / 60, stream=-3)
    before = world.state_hash()
    with pytest.raises(tactus.Error, match="stream is 1, but 'cpu'"):
        world.batch(2).step(1 / 60, stream=1)
    assert world.state_hash() == before
    world.step(1 / 60, stream=None)


def consumers():
    """Pairs of a name, and a function that takes a DeviceArray to one of a library, without a copy."""
    found = []
    for name, take in (("torch", lambda lib: lib.from_dlpack), ("cupy", lambda lib: lib.from_dlpack),
                       ("cupy", lambda lib: lib.asarray)):
        try:
            found.append((name, take(__import__(name))))
        except ImportError:
            continue
    return found


@needs_gpu
@pytest.mark.parametrize("library", ["torch", "cupy"])
def test_libraries_see_the_memory_of_a_gpu(library):
    """Node positions, and the mesh of a hull: the same address, the same bits; they outlive their world."""
    takers = [take for name, take in consumers() if name == library]
    if not takers:
        pytest.skip(f"{library} isn't installed")
    to_host = (lambda a: a.cpu().numpy()) if library == "torch" else (lambda a: a.get())
    address = (lambda a: a.data_ptr()) if library == "torch" else (lambda a: a.data.ptr)
    source = tactus.open_scene_source(tactus.Scene(HAND))
    hull = tactus.VisualHull("cuda:0", source.rig, resolution=64)
    copy = hull.reconstruct(source.next_frame())
    for take in takers:
        world = touched("cuda:0")
        array = world.device_positions("slab")
        interface = array.__cuda_array_interface__
        assert interface["version"] == 3 and interface["shape"] == array.shape and interface["typestr"] == "<f4"
        assert array.__dlpack_device__() == (2, 0)
        with pytest.raises(TypeError, match="in the memory of cuda:0, expected numpy"):
            np.asarray(array)
        seen = take(array)
        assert address(seen) == interface["data"][0] and interface["data"][1] is True
        assert (to_host(seen) == world.positions("slab")).all()
        world.step(1 / 60)
        expected = world.positions("slab")
        assert (to_host(seen) == expected).all(), "it goes on with the world"
        del world, array
        gc.collect()
        assert (to_host(seen) == expected).all(), "and keeps it"
        mesh = hull.device_mesh()
        assert to_host(take(mesh.positions)).tobytes() == copy.positions.tobytes()
        assert to_host(take(mesh.triangles)).tobytes() == copy.triangles.tobytes()
    if library == "torch":  # which refuses read-only memory by that interface, and has DLPack
        import torch
        with pytest.raises(TypeError, match="read only"):
            torch.as_tensor(touched("cuda:0").device_positions("slab"), device="cuda")


@needs_gpu
def test_a_step_comes_after_a_stream_that_reads():
    """The reader is busy for long before it copies; the step that got its stream must not overtake it."""
    torch = pytest.importorskip("torch", reason="torch isn't installed")
    if not torch.cuda.is_available():
        pytest.skip("this torch has no CUDA")
    world = touched("cuda:0", 5)
    seen = torch.from_dlpack(world.device_positions("slab"))
    expected = world.positions("slab").copy()
    busy = torch.rand(4096, 4096, device="cuda")
    stream = torch.cuda.Stream()
    torch.cuda.synchronize()
    with torch.cuda.stream(stream):
        for _ in range(200):
            busy = busy @ busy
            busy = busy / busy.norm()
        copy = seen.clone()
    world.step(1 / 60, stream=stream.cuda_stream)
    torch.cuda.synchronize()
    assert (copy.cpu().numpy() == expected).all()
    assert (world.positions("slab") != expected).any()


@needs_gpu
def test_batches_on_a_gpu_have_the_bits_of_lone_worlds():
    batch = tactus.World("cuda:0", tactus.Scene(TOUCH)).batch(33)
    for k, world in enumerate(batch):
        world.parameters["bodies.slab.material.young_modulus_pa"] = 10000 + 500 * k
    for _ in range(8):
        batch.step(1 / 60)
    assert len({world.state_hash() for world in batch}) == 33
    for k in (0, 17, 32):
        for devices in ("cuda:0", "cpu"):
            lone = tactus.World(devices, tactus.Scene(TOUCH))
            lone.parameters["bodies.slab.material.young_modulus_pa"] = 10000 + 500 * k
            for _ in range(8):
                lone.step(1 / 60)
            assert lone.state_hash() == batch[k].state_hash()
