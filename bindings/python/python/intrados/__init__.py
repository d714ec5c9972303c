"""Predicts damage in reinforced-concrete members.

>>> import intrados
>>> scene = intrados.load("room")
>>> scene.meters
('floor', 'under the ceiling')
"""

from ._detect import Crack, Pore, Slice, detect
from ._errors import Error, InputError, MissingError, UsageError, WriteError
from ._intrados import __version__
from ._reports import (
    Analysis,
    Capacity,
    CurvePoint,
    Estimate,
    Evidence,
    Measurement,
    MemberLife,
    MemberPrediction,
    Prediction,
    Reading,
    Report,
    Strength,
    Zone,
)
from ._scene import Member, Scene, load

__all__ = [
    "Analysis",
    "Capacity",
    "Crack",
    "CurvePoint",
    "Error",
    "Estimate",
    "Evidence",
    "InputError",
    "Measurement",
    "Member",
    "MemberLife",
    "MemberPrediction",
    "MissingError",
    "Pore",
    "Prediction",
    "Reading",
    "Report",
    "Scene",
    "Slice",
    "Strength",
    "UsageError",
    "WriteError",
    "Zone",
    "__version__",
    "detect",
    "load",
]
