"""One row from its inputs to its products, inside a worker: bad data, full disks and failing stores become a Result."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from avatar_export.batch import row_options, scratch, stores
from avatar_export.batch.failures import KINDS, StoreError, kind_of
from avatar_export.batch.job import Job
from avatar_export.batch.locations import is_url
from avatar_export.batch.meter import Meter
from avatar_export.batch.products import make
from avatar_export.batch.result import Result, from_json
from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError

IMAGES = (".png", ".jpg", ".jpeg", ".webp", ".exr", ".tif", ".tiff", ".mp4", ".avi", ".mov", ".mkv")
NOT_READ = {"dataset": IMAGES}  # role -> endings of files that nobody reads
Files = dict[str, dict[str, tuple[int, str]]]  # role -> path -> (bytes, mark)


def do(job: Job, attempt: str) -> Result:
    """Makes the products of a row, whole or not at all; `attempt` names this try in keys of an object store.

    A row that is finished is kept: see `is_finished`. Bad data, a full disk and a store that fails come back as a
    failed Result. Raises for bugs only.
    """
    meter = Meter()
    try:
        kept = is_finished(job)
        if kept is not None:
            return kept
        with scratch.folder() as work:
            return _made(job, attempt, work, meter)
    except (
        AvatarError,
        OSError,
        MemoryError,
        UnicodeError,
    ) as error:  # the last: names that a disk cannot hold
        kind = kind_of(error)
        return Result(
            job.name,
            "failed",
            kind,
            _shown(str(error) or "memory ran out", job),
            KINDS[kind].remedy,
            job.output,
            **meter.spent(),
            retryable=KINDS[kind].retryable,
        )


def _shown(message: str, job: Job) -> str:
    """A message on one line that names the row's own inputs and output in place of their copies."""
    message = scratch.originals(" ".join(message.split()))
    return re.sub(stores.partial_pattern(job.output), job.output, message)


def is_finished(job: Job) -> Result | None:
    """The result of a row whose products are there, made of the same input by the same options, steps and version.

    None if it must be made, or if its inputs are not there. Files whose time or tag changed are hashed again. Raises
    StoreError.
    """
    record = stores.read_record(job.output)
    if record is None or record.get("version") != GENERATOR or record.get("asked") != asked_of(job):
        return None
    try:
        made = from_json(record["result"], f"{job.output}/{stores.RECORD}")
        folder = stores.folder_of(job.output, record)
        there = {name: size for name, (size, _) in stores.files_of(folder).items()}
        if any(there.get(name) != size for name, size in record["files"].items()):
            return None
        same = _same_inputs(record["inputs"], input_files(job), _places(job))
    except StoreError:
        raise
    except (AvatarError, KeyError, TypeError, ValueError, AttributeError):  # not as this version writes it
        return None
    return (
        replace(made, state="kept", name=job.name, seconds=0.0, cpu_seconds=0.0, peak_bytes=0)
        if same
        else None
    )


def asked_of(job: Job) -> dict[str, Any]:
    """What a row asks for, as JSON data."""
    said: dict[str, Any] = json.loads(
        json.dumps({"source": job.source, "options": dict(job.options), "steps": job.steps})
    )
    return said


def input_files(job: Job) -> Files:
    """The files of each input. Raises AvatarError for one that is not there."""
    return {
        role: stores.files_of(location, NOT_READ.get(role, ())) for role, location in _places(job).items()
    }


def _places(job: Job) -> dict[str, str]:
    """Role -> where an input lies; of a source that is the output of a batch, its bundle."""
    return {**job.inputs, "source": stores.bundle_of(job.source) or job.source}


def _made(job: Job, attempt: str, work: Path, meter: Meter) -> Result:
    files = input_files(job)
    if is_url(job.source) and "" in files["source"] and not job.source.lower().endswith(stores.ALONE):
        raise AvatarError("is one file of several; name its folder", file=job.source)
    paths = {role: stores.fetch(place, files[role], work) for role, place in _places(job).items()}
    inputs = hashes(files, paths)
    with stores.attempted(job.output, attempt, work) as (folder, key), _reading(job):
        products = make(job, paths["source"], row_options.arguments(job.options, paths), folder)
        written = {name: size for name, (size, _) in stores.files_of(str(folder)).items()}
        result = Result(
            job.name,
            "done",
            message="; ".join(filter(None, (products.message, unread(files)))),
            output=job.output,
            **meter.spent(),
            sizes=products.sizes,
            psnr=products.psnr,
        )
        record = {
            "format": stores.FORMAT,
            "version": GENERATOR,
            "folder": key,
            "asked": asked_of(job),
            "inputs": inputs,
            "files": written,
            "result": result.as_json(),
            "preview": products.preview,
        }
        (folder / stores.RECORD).write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    return replace(result, **meter.spent())


@contextmanager
def _reading(job: Job) -> Iterator[None]:
    """Turns an error that names a file of an input, which is not there or not readable, into an AvatarError."""
    try:
        yield
    except (PermissionError, FileNotFoundError, NotADirectoryError, IsADirectoryError) as error:
        named = f"{error.filename}/"
        if not any(named.startswith(f"{place}/") for place in job.inputs.values()):
            raise
        raise AvatarError(f"cannot be read ({error.strerror})", file=error.filename) from error


def unread(files: Files) -> str:
    """Which of the `files` are missing, in words; "" where all are there."""
    others = sorted(
        {name for listed in files.values() for name, (_, mark) in listed.items() if mark == stores.OTHER}
    )
    more = f" and {len(others) - 1} more" if len(others) > 1 else ""
    return f"{others[0]}{more}: {stores.OTHER}; not read" if others else ""


def hashes(files: Files, paths: Mapping[str, Path]) -> dict[str, dict[str, list[Any]]]:
    """role -> path -> [bytes, mark, sha256] of the `files`, which lie at `paths`; "" for what is no file."""
    once = cache(stores.sha256)  # a dataset often holds the source, too
    return {
        role: {
            name: [size, mark, "" if mark == stores.OTHER else once((paths[role] / name).as_posix(), "")]
            for name, (size, mark) in listed.items()
        }
        for role, listed in files.items()
    }


def _same_inputs(recorded: Mapping[str, Any], files: Files, locations: Mapping[str, str]) -> bool:
    if recorded.keys() != files.keys():
        return False
    for role, listed in files.items():
        if recorded[role].keys() != listed.keys():
            return False
        for name, (size, mark) in listed.items():
            was_size, was_mark, was_hash = recorded[role][name]
            if size != was_size:
                return False
            if mark != was_mark and stores.sha256(locations[role], name) != was_hash:
                return False
    return True
