"""Scenes, and what can be asked of them."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ._intrados import Loaded, run
from ._intrados import load as _load
from ._reports import Analysis, Measurement, Prediction, Progress

Path = str | os.PathLike[str]


@dataclass(frozen=True)
class Member:
    """A member of a structure."""

    id: str
    name: str
    kind: str
    """``column``, ``beam``, ``lining`` …"""
    concrete: str
    """Its grade, such as ``C30/37``."""
    concrete_assumed: bool
    volume_m3: float
    """Of its outline; 0 where the mesh is open."""
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Corners of the box about it, m."""
    bars: int
    stirrups: int
    tendons: int
    slices: int
    """CT slices that there are of it."""

    @property
    def size(self) -> tuple[float, float, float]:
        """Of the box about it, m."""
        low, high = self.bounds
        return (high[0] - low[0], high[1] - low[1], high[2] - low[2])


class Scene:
    """A scene in memory. Made by :func:`load`; what happens to its file later does not matter to it, except files of
    evidence (slices, photographs), which are read when they are needed."""

    def __init__(self, loaded: Loaded, path: str) -> None:
        self._loaded = loaded
        self._path = path
        self._info = json.loads(run(["info", "--", path], loaded, None))["scenes"][0]
        self.members: tuple[Member, ...] = tuple(map(_member, self._info["members"]))

    def __repr__(self) -> str:
        return f"<intrados.Scene {self.name!r}: {len(self.members)} members>"

    @property
    def name(self) -> str:
        return self._info["scene"]

    @property
    def title(self) -> str:
        return self._info["title"]

    @property
    def hash(self) -> str:
        """BLAKE3 of the file and of all that it names: what results are tied to."""
        return self._info["scene_hash"]

    @property
    def size(self) -> tuple[float, float, float]:
        """Of the box about all of it, m."""
        return tuple(self._info["size"])

    @property
    def cameras(self) -> tuple[str, ...]:
        return tuple(camera["name"] for camera in self._info["cameras"])

    @property
    def meters(self) -> tuple[str, ...]:
        return tuple(self._info["meters"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was assumed, looks suspicious or was skipped."""
        return tuple(self._info["warnings"])

    def member(self, word: str) -> Member:
        """The member of this id, or of this name."""
        for member in self.members:
            if word in (member.id, member.name):
                return member
        raise KeyError(f"{self.name} has no member {word!r}: there are {', '.join(m.id for m in self.members)}")

    def predict(
        self,
        *,
        out: Path | None = None,
        profile: Path | None = None,
        method: str = "auto",
        ahead: float | None = None,
        element: float | None = None,
        forecast: bool = True,
        strength: bool = False,
        strict: bool = False,
        spp: int = 0,
        seed: int = 1,
        progress: Progress | None = None,
    ) -> Prediction:
        """Damage of every member from all evidence.

        ``strength``: also what each member bears (:class:`Capacity`), minutes a member.
        ``ahead`` years (20) the forecast reaches; ``element`` is the edge of its elements, m. ``spp`` samples a pixel
        are taken for the report's pictures; 0: no pictures. The report and its tables are written into ``out``, or where
        that is not given into a folder that goes when the prediction does.
        """
        options = {"profile": profile, "method": method, "ahead": ahead, "element": element, "spp": spp, "seed": seed}
        flags = {"no-forecast": not forecast, "strength": strength, "strict": strict}
        return self._with_files(Prediction, "predict", options, flags, out, progress)

    def measure(
        self,
        sensors: str | Sequence[str] = (),
        *,
        all: bool = False,
        out: Path | None = None,
        spp: int | None = None,
        seconds: float | None = None,
        target_rel_error: float | None = None,
        side: str | None = None,
        guide: str = "auto",
        seed: int = 1,
        progress: Progress | None = None,
    ) -> Measurement:
        """What cameras and meters read, from both sides, with error bars and the gap between the sides.

        Ends at the first rule that is met: ``spp`` walks a pixel, ``seconds``, or the error of every reading; 30 s or 1 %
        if none is given.
        """
        limit = None if seconds is None else f"{seconds}s"
        options = {"sensor": _list(sensors), "out": out, "spp": spp, "time-limit": limit}
        options |= {"target-rel-error": target_rel_error, "side": side, "guide": guide, "seed": seed}
        return Measurement(self._told("measure", options, {"all": all}, progress))

    def analyze(
        self,
        member: str | Sequence[str] = (),
        *,
        out: Path | None = None,
        element: float | None = None,
        tolerance: float | None = None,
        to_failure: bool | str = False,
        fine: tuple[float, float] | None = None,
        fine_element: float | None = None,
        progress: Progress | None = None,
    ) -> Analysis:
        """Stress, creep and damage of members (all if none is named) over their load history. Models of finite elements
        are written into ``out``, or where that is not given into a folder that goes when the analysis does.

        ``to_failure``: after that, loads are raised until members fail (:class:`Strength`): all that can be, or the one
        that is named. ``fine``: of one member, only what lies between two shares of its axis, in bricks of half the size
        or of ``fine_element`` m, driven at its cuts by the life of all of it. One of the two.
        """
        options = {"member": _list(member), "element": element, "tolerance": tolerance}
        options |= {"to-failure": to_failure if isinstance(to_failure, str) else None}
        options |= {"fine": None if fine is None else f"{fine[0]}..{fine[1]}", "fine-element": fine_element}
        return self._with_files(Analysis, "analyze", options, {"to-failure": to_failure is True}, out, progress)

    def _with_files(self, kind, command, options, flags, out, progress):
        folder = None if out is not None else tempfile.mkdtemp(prefix="intrados-")
        try:
            report = kind(self._told(command, options | {"out": folder or out}, flags, progress))
        except BaseException:
            if folder:
                shutil.rmtree(folder, ignore_errors=True)
            raise
        if folder:
            weakref.finalize(report, shutil.rmtree, folder, ignore_errors=True)
        return report

    def _told(self, command: str, options: dict, flags: dict[str, bool], progress: Progress | None) -> str:
        words = [command, *_words(options, flags), "--", self._path]
        return run(words, self._loaded, progress)


def load(path: Path, *, allow: Iterable[Path] = (), progress: Progress | None = None) -> Scene:
    """Loads a scene (.ron), a model (.glb, .gltf), a project's folder, or a bundled scene by its name.

    Files that it names may lie beside it, where ``INTRADOS_DATA`` says, and in folders that are ``allow``-ed.
    """
    return Scene(_load(path, list(allow), progress), os.fspath(path))


def _words(options: dict, flags: dict[str, bool]) -> list[str]:
    """Options as the command line has them: one word each, so that no value is taken for an option."""
    words = [f"--{name}" for name, given in flags.items() if given]
    for name, value in options.items():
        for one in value if isinstance(value, list) else [value]:
            if one is not None:
                words.append(f"--{name}={os.fspath(one) if isinstance(one, os.PathLike) else one}")
    return words


def _list(words: str | Sequence[str]) -> list[str]:
    return [words] if isinstance(words, str) else list(words)


def _member(told: dict) -> Member:
    fields = {name: told[name] for name in Member.__dataclass_fields__ if name != "bounds"}
    low, high = (tuple(corner) for corner in told["bounds"])
    return Member(bounds=(low, high), **fields)
