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
    Scene,
    Snapshot,
    StepReport,
    VisualHull,
    World,
    examine_rig,
    open_scene_source,
    run,
)

__all__ = [
    "Batch", "Camera", "Devices", "Diagnosis", "DoctorFinding", "Error", "Frame", "FrameSource", "Mesh", "Monitors", "Notice", "Observation", "Parameter", "Parameters", "Perception",
    "Reaction", "Rig", "Scene", "Snapshot", "StepReport", "VisualHull", "World", "examine_rig", "open_scene_source", "run", "shared"]
