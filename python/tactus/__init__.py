"""Real objects touch virtual ones. SI units, +Y up; docs/python.md."""
from ._tactus import (
    Camera,
    Devices,
    Error,
    Frame,
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
    run,
)

__all__ = [name for name in dir() if not name.startswith("_")]
