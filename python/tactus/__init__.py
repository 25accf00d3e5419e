"""Real objects touch virtual ones. SI units, +Y up; docs/python.md."""
from ._arrays import shared
from ._tactus import (
    Batch,
    Camera,
    Devices,
    Diagnosis,
    DoctorFinding,
    Error,
    Frame,
    FrameLoop,
    FrameSink,
    FrameSource,
    Mesh,
    Monitors,
    Notice,
    Observation,
    Parameter,
    Parameters,
    Perception,
    Reaction,
    Rig,
    RunFrame,
    Scene,
    Snapshot,
    StepReport,
    VisualHull,
    World,
    doctor,
    examine_rig,
    open_scene_source,
    run,
)

__all__ = [
    "Batch", "Camera", "Devices", "Diagnosis", "DoctorFinding", "Error", "Frame", "FrameLoop", "FrameSink",
    "FrameSource", "Mesh", "Monitors", "Notice", "Observation", "Parameter", "Parameters", "Perception", "Reaction",
    "Rig", "RunFrame", "Scene", "Snapshot", "StepReport", "VisualHull", "World", "doctor", "examine_rig",
    "open_scene_source", "run", "shared"]
