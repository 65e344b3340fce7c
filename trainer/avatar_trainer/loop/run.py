"""What identifies a run: its system, settings and capture. Written to run.json; a checkpoint belongs to one run."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch

from avatar_export import GENERATOR
from avatar_runtime import AvatarError
from avatar_runtime.io import no_such, open_file
from avatar_trainer.captures.model import Capture
from avatar_trainer.raster.renderer import RASTERISERS
from avatar_trainer.settings import TrainSettings, chosen_rules, with_values
from avatar_trainer.systems.table import SYSTEMS, system_module

FILE = "run.json"
CHECKPOINTS = "checkpoints"
UPSTREAM = "upstream"  # the released code's layout
LOGS = "logs"
PREVIEW = "preview"
EVALUATION = "evaluation.json"
POSES = "poses.json"  # refined
LARGEST = 1 << 20  # bytes of run.json


def facts(system: str, capture: Capture, settings: TrainSettings, system_settings: Any) -> dict[str, Any]:
    """Everything that the result of a run depends on, as JSON data."""
    return {
        "system": system,
        "settings": _stated(settings, capture),
        "system_settings": json.loads(json.dumps(dataclasses.asdict(system_settings))),
        "capture": {"folder": str(capture.folder.resolve()), "fingerprint": fingerprint(capture)},
        "versions": {
            "avatar-export": GENERATOR.rpartition(" ")[2],
            "numpy": np.__version__,
            "python": platform.python_version(),
            "torch": str(torch.__version__),
        },
    }


def refines(settings: TrainSettings, capture: Capture) -> bool:
    """Whether poses and expressions are refined in a run."""
    return settings.refine == "on" or (settings.refine == "auto" and capture.poses == "estimated")


def _stated(settings: TrainSettings, capture: Capture) -> dict[str, Any]:
    """The settings; `refine` as it was decided, and only if it is not what older runs did."""
    stated = {**dataclasses.asdict(settings), "refine": "on" if refines(settings, capture) else "off"}
    if stated["refine"] == "off" and capture.poses == "exact":
        del stated["refine"]
    return stated


def fingerprint(capture: Capture) -> str:
    """SHA-256 over all tracked values, the rig, and names and sizes of the images; not over their pixels, and not
    over words of rights."""
    digest = hashlib.sha256()
    for field in dataclasses.fields(capture):
        if field.name not in ("folder", "export_inputs", "columns", "rights", "poses"):
            _hash(getattr(capture, field.name), digest)
    return digest.hexdigest()


def differences(before: Any, now: Mapping[str, Any], iteration: int, last: int) -> list[str]:
    """The reasons why the run `now` cannot continue from a checkpoint: one short text each.

    before: the checkpoint's unchecked statement about its run; iteration: the checkpoint's; last: that of the run.
    """
    try:
        json.dumps(before)
    except (TypeError, ValueError, RecursionError):  # a state can hold tensors, which do not compare
        before = None
    if not isinstance(before, Mapping):
        return ["the checkpoint does not say of which run it is"]
    found = []
    for part in ("settings", "system_settings"):
        old, new = _flat(before.get(part)), _flat(now[part])
        for name in sorted(old.keys() | new.keys()):
            if old.get(name) != new.get(name) and not (part == "settings" and name in TrainSettings.FREE):
                found.append(short(f"{name} was {short(old.get(name))}, is {short(new.get(name))}"))
    if before.get("system") != now["system"]:
        found.insert(0, f"system was {short(before.get('system'))}, is {now['system']}")
    if not found and fingerprint_of(before) != fingerprint_of(now):
        found.append("the capture's content is another")
    if not found and iteration > last:
        found.append(f"the checkpoint is of iteration {iteration}, the last is {last}")
    return list(dict.fromkeys(found))


def fingerprint_of(content: Mapping[str, Any]) -> Any:
    """The folder of the capture that run.json, or a checkpoint's copy of it, names; None if it names none."""
    return _flat(content.get("capture")).get("fingerprint")


def write(out: Path, content: Mapping[str, Any], name: str = FILE) -> None:
    """Write a JSON file of the run: whole or not at all."""
    out.mkdir(parents=True, exist_ok=True)
    partial = out / f".{name}.partial"
    partial.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", "utf-8")
    os.replace(partial, out / name)


def read(out: Path) -> dict[str, Any]:
    """run.json of a run. Raises AvatarError if it is missing or invalid."""
    path = out / FILE
    try:
        with open_file(path) as file:
            text = file.read(LARGEST + 1)
        if len(text) > LARGEST:
            raise AvatarError(f"is longer than {LARGEST} bytes", file=path)
        content = json.loads(text)
    except OSError as error:
        raise AvatarError(
            f"cannot be read ({error.strerror or error}); is this a run of avatar-train?", file=path
        ) from None
    except (ValueError, RecursionError):
        raise AvatarError("is not JSON", file=path) from None
    parts = ("settings", "system_settings", "capture")
    if not isinstance(content, dict) or not all(isinstance(content.get(part), dict) for part in parts):
        raise AvatarError("is not the run.json of avatar-train", file=path)
    if not isinstance(content.get("system"), str) or content["system"] not in SYSTEMS:
        raise AvatarError(
            f"system {short(content.get('system'))!r} is not one of {', '.join(SYSTEMS)}", file=path
        )
    return content


def settings_of(content: Mapping[str, Any], file: Path) -> tuple[TrainSettings, Any]:
    """(settings, system settings) of `content`, which `file` holds. Raises AvatarError for values out of
    range."""
    module = system_module(content["system"])
    own = dict(content["system_settings"])
    rules = own.pop("rules", {})
    pairs = [(str(name), str(value)) for name, value in rules.items()] if isinstance(rules, dict) else []
    try:
        settings = with_values(TrainSettings(), _texts(content["settings"]))
        system_settings = with_values(module.Settings(), _texts(own))
        system_settings = dataclasses.replace(system_settings, rules=chosen_rules(module.RULES, pairs))
    except AvatarError as error:
        raise AvatarError(error.message, file=file) from None
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"holds settings that cannot be taken ({error})", file=file) from None
    if settings.rasteriser not in RASTERISERS:
        raise no_such("rasteriser", settings.rasteriser, RASTERISERS, file=file)
    return settings, system_settings


def _texts(values: Any) -> list[tuple[str, str]]:
    return [
        (name, ",".join(map(str, value)) if isinstance(value, list) else str(value))
        for name, value in _flat(values).items()
    ]


def short(value: Any) -> str:
    """The text of an untrusted value, for a message."""
    text = str(value)
    return text if len(text) <= 120 else f"{text[:117]}..."


def _flat(values: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(values, Mapping):
        return {}
    found: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            found.update(_flat(value, f"{prefix}{name}."))
        else:
            found[f"{prefix}{name}"] = value
    return found


def _hash(value: Any, digest: hashlib._Hash) -> None:
    """Feed a value into a digest: arrays by type, shape and bytes, files by name and size, others by their text."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Path):
        digest.update(f"{value.name} {value.stat().st_size}".encode())
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if (inner := getattr(value, field.name)) is not None:  # so that older runs go on
                _hash(inner, digest)
    elif isinstance(value, list | tuple):
        digest.update(f"{len(value)}".encode())
        for inner in value:
            _hash(inner, digest)
    elif isinstance(value, Mapping):
        _hash([*value.items()], digest)
    else:
        digest.update(repr(value).encode() + b";")
