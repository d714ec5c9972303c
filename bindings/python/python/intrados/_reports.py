"""What commands answer, typed. Each report keeps the program's own JSON, which has more in it than is typed here."""

from __future__ import annotations

import base64
import json
import pathlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree import ElementTree

import numpy as np

Progress = Callable[[float, str], object]
"""Is told the share that is done, 0 to 1, and what is done at the moment."""


class Report:
    """What a command answered."""

    def __init__(self, text: str) -> None:
        self._text = text

    def json(self) -> str:
        """What the command prints with ``--format json``, to the bit."""
        return self._text

    @cached_property
    def data(self) -> dict[str, Any]:
        """The same as dictionaries and lists."""
        return json.loads(self._text)

    @property
    def scene(self) -> str:
        return self.data["scene"]

    @property
    def scene_hash(self) -> str:
        return self.data["scene_hash"]

    @property
    def files(self) -> tuple[pathlib.Path, ...]:
        """What was written. Where no folder was named, they go when this report does."""
        return tuple(map(pathlib.Path, self.data["files"]))

    def _file(self, name: str) -> pathlib.Path:
        for file in self.files:
            if file.name == name:
                return file
        raise KeyError(f"there is no file {name}: there are {', '.join(f.name for f in self.files)}")


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error."""

    value: float
    std_error: float


@dataclass(frozen=True)
class Capacity:
    """What a member bears: ``predict(strength=True)``."""

    loads: tuple[str, ...]
    """Which were raised."""
    load_factor: Estimate
    """How many times these it bears with what is known of its damage; at least so many where it did not fail."""
    sound: float
    """How many times it would bear them if it were sound."""
    cost: Estimate
    """Share of its strength that its damage costs."""
    mode: str
    """How it fails: ``Yielding``, ``DiagonalTension`` …, ``None`` as a word where it did not."""
    because: str


@dataclass(frozen=True)
class Zone:
    """A tenth of a member's length. Of what nobody knows anything, damage and error are ``None``."""

    damage: float | None
    std_error: float | None
    basis: str
    """``measured``, ``forecast`` …"""


@dataclass(frozen=True)
class Evidence:
    """What one source says of a member."""

    source: str
    """``ct``, ``forecast``, ``gauges`` …"""
    damage: float
    std_error: float
    measured: bool
    basis: str
    """What it rests on, a sentence."""


@dataclass(frozen=True)
class MemberPrediction:
    """Damage of a member: the share of strength lost in its worst zone, or what that costs all of it (``by_strength``)."""

    id: str
    name: str
    kind: str
    damage: float | None
    """``None`` where nothing is known."""
    std_error: float | None
    state: str
    basis: str
    advice: str
    within_months: int | None
    """How soon that should be done."""
    states: Mapping[str, float]
    """By state, the share of its length that is to be expected in it; by strength, the probability of each."""
    by_strength: bool
    """Whether it is graded by what its damage costs of its strength, as the profile may want."""
    capacity: Capacity | None
    """What it bears; ``None`` where nobody asked or nothing can be raised."""
    zones: tuple[Zone, ...]
    evidence: tuple[Evidence, ...]
    conflicts: tuple[str, ...]
    """Sources that contradict each other."""


class Prediction(Report):
    """Damage of every member: ``intrados.predict/2``."""

    @cached_property
    def members(self) -> tuple[MemberPrediction, ...]:
        return tuple(map(_predicted, self.data["members"]))

    def member(self, word: str) -> MemberPrediction:
        """The member of this id, or of this name."""
        return _named(self.members, word)

    @property
    def limits(self) -> tuple[str, ...]:
        """What this prediction cannot say."""
        return tuple(self.data["limits"])

    @property
    def unused(self) -> tuple[str, ...]:
        """Evidence that was not used, and why."""
        left = (item for item in self.data["items"] if not item["used"])
        return tuple(f"{item['member']}, {item['item']}: {item['why']}" for item in left)

    def damage(self) -> tuple[np.ndarray, np.ndarray]:
        """Damage and standard error of members (rows) by zones (columns); NaN where nothing is known."""
        shape = (len(self.members), -1)
        zones = [zone for member in self.members for zone in member.zones]
        value = np.array([zone.damage for zone in zones], dtype=float).reshape(shape)
        return value, np.array([zone.std_error for zone in zones], dtype=float).reshape(shape)

    def html(self) -> str:
        """The report as a page."""
        return self._file("report.html").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Reading:
    """What a camera or meter reads."""

    name: str
    unit: str
    mean: float
    std_error: float
    converged: bool
    """Whether the error bar can be trusted."""
    complaint: str
    """Why not."""
    primal: Estimate | None
    """From the sensor."""
    dual: Estimate | None
    """From the lamps."""
    duality_z: float | None
    """The gap between both in standard errors: N(0,1) if both are right."""


class Measurement(Report):
    """Readings: ``intrados.measure/1``."""

    @cached_property
    def readings(self) -> tuple[Reading, ...]:
        return tuple(map(_read, self.data["meters"]))

    def __getitem__(self, name: str) -> Reading:
        return _named(self.readings, name)

    @property
    def stop(self) -> str | None:
        """The rule that ended it: ``spp``, ``time-limit``, ``target-rel-error``."""
        return self.data["stop"]

    @property
    def target_reached(self) -> bool | None:
        return self.data["target_reached"]


@dataclass(frozen=True)
class CurvePoint:
    """An equilibrium while loads are raised."""

    displacement_m: float
    """Mean displacement of the loaded nodes along their loads."""
    load_factor: float
    """1 is what the scene writes."""
    load_n: float


@dataclass(frozen=True)
class Strength:
    """What a member bears: ``analyze(to_failure=True)``."""

    loads: tuple[str, ...]
    """Which were raised."""
    displacement_m: np.ndarray
    """The curve, equilibrium by equilibrium."""
    load_factor: np.ndarray
    load_n: np.ndarray
    peak: CurvePoint
    yielding: CurvePoint | None
    """Where a bar, no stirrup, yields first."""
    ultimate: CurvePoint | None
    """Where a fifth of the peak is lost, or before that steel along it breaks."""
    ductility: float | None
    mode: str
    """How it fails: ``Yielding``, ``DiagonalTension`` …, ``None`` as a word where it did not."""
    because: str
    ended: str
    """Why it was followed no further."""


@dataclass(frozen=True)
class MemberLife:
    """A member through its load history. Times in s, lengths in m, stresses in Pa."""

    id: str
    time_s: np.ndarray
    """Steps."""
    load_factor: np.ndarray
    max_displacement_m: np.ndarray
    converged: np.ndarray
    peak_tension_pa: float
    peak_compression_pa: float
    peak_bar_stress_pa: float
    max_damage: float
    max_crack_width_m: float
    complaint: str
    """Why the last step is not in equilibrium; empty if it is."""
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    """Which values were taken for what is not stated, and by which rule."""
    strength: Strength | None
    """What it bears, where loads were raised after its life."""


class Analysis(Report):
    """Members through their load history: ``intrados.analyze/1``."""

    @cached_property
    def members(self) -> tuple[MemberLife, ...]:
        return tuple(map(_lived, self.data["models"]))

    def member(self, word: str) -> MemberLife:
        """The member of this id."""
        return _named(self.members, word)

    def field(self, member: str, step: int = -1) -> dict[str, np.ndarray]:
        """The model of a member at a step: ``nodes`` (m), ``displacement_m``, and by elements ``stress_pa`` (xx, yy, zz,
        xy, yz, zx), ``damage``, ``crack_width_m`` …; ``connectivity`` and ``offsets`` as in VTK."""
        index = [life.id for life in self.members].index(self.member(member).id)
        frames = [f for f in self.files if f.suffix == ".pvd"]
        if index >= len(frames):
            raise KeyError(f"no files were written of {member}")
        sets = ElementTree.parse(frames[index]).getroot().iter("DataSet")
        vtu = frames[index].parent / [s.attrib["file"] for s in sets][step]
        arrays = ElementTree.parse(vtu).getroot().iter("DataArray")
        told = {array.attrib["Name"]: _numbers(array) for array in arrays}
        return {"nodes": told.pop("Points"), **told}


def _numbers(array: ElementTree.Element) -> np.ndarray:
    """Numbers of a VTU's array: base64 of their count of bytes, 8 bytes long, and of the numbers."""
    columns = int(array.attrib.get("NumberOfComponents", 1))
    kind = np.dtype(array.attrib["type"].lower()).newbyteorder("<")
    numbers = np.frombuffer(base64.b64decode(array.text or "")[8:], dtype=kind)
    return numbers.reshape(-1, columns) if columns > 1 else numbers


def _named(things, word: str):
    for thing in things:
        if word in (getattr(thing, "id", None), getattr(thing, "name", None)):
            return thing
    names = ", ".join(getattr(thing, "id", None) or thing.name for thing in things)
    raise KeyError(f"there is no {word!r}: there are {names}")


_PLAIN = ("id", "name", "kind", "damage", "state", "basis", "advice", "within_months", "states", "by_strength")
"""What a prediction says of a member that is taken as it is."""


def _predicted(told: dict) -> MemberPrediction:
    zones = zip(told["zones"], told["zone_basis"], strict=True)
    evidence = told["evidence"].items()
    return MemberPrediction(
        **{key: told[key] for key in _PLAIN},
        std_error=told["damage_std_error"],
        capacity=_borne(told.get("capacity")),
        zones=tuple(Zone(z and z["value"], z and z["std_error"], basis) for z, basis in zones),
        evidence=tuple(
            Evidence(source, e["damage"], e["std_error"], e["measured"], e["basis"]) for source, e in evidence
        ),
        conflicts=tuple(told["conflicts"]),
    )


def _borne(told: dict | None) -> Capacity | None:
    if told is None:
        return None
    known = {key: Estimate(**told[key]) for key in ("load_factor", "cost")}
    return Capacity(loads=tuple(told["loads"]), **known, **{key: told[key] for key in ("sound", "mode", "because")})


def _read(told: dict) -> Reading:
    both = told["combined"]
    sides = {side: told.get(side) and Estimate(told[side]["mean"], told[side]["std_error"]) for side in ("primal", "dual")}
    return Reading(
        name=told["name"],
        unit=told["unit"],
        **{key: both[key] for key in ("mean", "std_error", "converged", "complaint")},
        **sides,
        duality_z=told.get("duality_z"),
    )


def _lived(told: dict) -> MemberLife:
    steps = told["steps"]
    columns = {key: np.array([step[key] for step in steps], dtype=float) for key in ("time_s", "load_factor", "max_displacement_m")}
    peaks = ("peak_tension_pa", "peak_compression_pa", "peak_bar_stress_pa", "max_damage", "max_crack_width_m")
    members = told["members"]
    # Compression is negative: the largest has the lowest number.
    worst = {key: (min if key == "peak_compression_pa" else max)((m[key] for m in members), default=0.0) for key in peaks}
    return MemberLife(
        id=told["id"],
        **columns,
        **worst,
        converged=np.array([step["converged"] for step in steps], dtype=bool),
        complaint=told["complaint"],
        warnings=tuple(told["warnings"]),
        notes=tuple(told["notes"]),
        strength=_raised(told.get("strength")),
    )


def _raised(told: dict | None) -> Strength | None:
    if told is None:
        return None
    columns = tuple(CurvePoint.__dataclass_fields__)

    def point(at: dict | None) -> CurvePoint | None:
        return at and CurvePoint(**{key: at[key] for key in columns})

    return Strength(
        loads=tuple(told["loads"]),
        **{key: np.array([at[key] for at in told["curve"]], dtype=float) for key in columns},
        **{key: point(told[key]) for key in ("peak", "yielding", "ultimate")},
        **{key: told[key] for key in ("ductility", "mode", "because", "ended")},
    )
