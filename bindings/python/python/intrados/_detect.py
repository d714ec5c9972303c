"""Pores and cracks of a CT slice."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass

import numpy as np

from ._intrados import detect_array, detect_file
from ._reports import Estimate, Progress


@dataclass(frozen=True)
class Crack:
    """A crack as a slice shows it."""

    length_px: float
    length_mm: float
    width_mm: float
    """Opening, as if it held nothing but air."""
    at_mm: tuple[float, float]
    """Its middle, from the left and top edges."""
    box_mm: tuple[float, float]
    """Width and height of the box about it."""


@dataclass(frozen=True)
class Pore:
    """A pore as a slice shows it."""

    label: int
    """Its number in :attr:`Slice.labels`."""
    x_mm: float
    y_mm: float
    area_px: int
    area_mm2: float
    volume_mm3: float
    """Of the sphere whose great circle it would be."""
    diameter_mm: float
    circularity: float
    """1 for a disc."""
    depth_mm: float
    """Below the body's outer surface."""
    bar_mm: float | None
    """To the nearest bar that shows."""
    missing_mass: float
    """Pixels' worth of missing concrete."""


@dataclass(frozen=True)
class Slice:
    """What was found in a slice."""

    cracks: tuple[Crack, ...]
    pores: tuple[Pore, ...]
    porosity: Estimate
    """Pore area over body area, with the error of reading this slice."""
    sampling_error: float
    """Standard error of the porosity as a sample of the concrete around."""
    pixel_mm: float
    pixel_known: bool
    """Whether anybody has said how large a pixel is; if not, what is told in mm is pixels."""
    labels: np.ndarray
    """Numbers of the pores and of the dark parts of cracks by pixel; 0 is sound."""
    crack_mask: np.ndarray
    """Pixels of the cracks, the faint ones included."""


def detect(
    image: np.ndarray | str | os.PathLike[str],
    *,
    mm_per_pixel: float | None = None,
    layer: int | None = None,
    method: str = "auto",
    progress: Progress | None = None,
) -> Slice:
    """Finds the pores and cracks of a slice: rows of grey values proportional to attenuation, air 0; or a file (TIFF,
    PNG, MetaImage; ``layer`` is the number of one of several slices).

    ``method`` is ``auto``, ``network`` or ``classical``, as on the command line.
    """
    if isinstance(image, str | os.PathLike):
        told = detect_file(image, layer, mm_per_pixel, method, progress)
    else:
        grey = np.ascontiguousarray(image, dtype=np.float32)
        if grey.ndim != 2 or layer is not None:
            raise ValueError(f"an image has rows and columns, one grey value each; this has shape {np.shape(image)}")
        height, width = grey.shape
        told = detect_array(grey.tobytes(), width, height, mm_per_pixel, method, progress)
    return _slice(*told)


def _slice(text: str, labels: bytes, crack_mask: bytes) -> Slice:
    told = json.loads(text)
    shape = (told["height"], told["width"])
    pair = {"at_mm", "box_mm"}
    return Slice(
        cracks=tuple(Crack(**{k: tuple(v) if k in pair else v for k, v in crack.items()}) for crack in told["cracks"]),
        pores=tuple(Pore(**pore) for pore in told["pores"]),
        porosity=Estimate(told["porosity"], told["porosity_std_error"]),
        sampling_error=told["sampling_error"],
        pixel_mm=told["pixel_mm"],
        pixel_known=told["pixel_known"],
        labels=np.frombuffer(labels, dtype=np.uint32).reshape(shape),
        crack_mask=np.frombuffer(crack_mask, dtype=np.uint8).reshape(shape).astype(bool),
    )
