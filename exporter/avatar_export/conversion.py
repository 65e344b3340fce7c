"""A trained avatar in, a bundle out: the whole of `avatar-export convert` as one function."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from avatar_export.bodies.inputs import found_driving
from avatar_export.clips.sources import read_clips
from avatar_export.convert_options import ConvertOptions, SourceOptions
from avatar_export.driving.drive import driving_notes
from avatar_export.driving.matrix import with_driving
from avatar_export.fit import gaps
from avatar_export.notes.converting import CAUSES
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.provenance import with_rights
from avatar_export.readers.table import find, read_with
from avatar_export.relight import captured, relightable
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.table import INFLUENCES
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks import arguments
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError

MOST_LISTED = 3  # files of one folder
VISIBLE_MM = 0.1  # errors of rig.glb below this are not mentioned
WRONG_MM = 2.0  # an error of too few joints above this is another face: it is the first note


@dataclass(frozen=True)
class Source:
    """A trained avatar that was read, and what its reader says of it, and of clips that were added."""

    avatar: Avatar
    notes: tuple[Note, ...]
    clip_notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Converted:
    """A bundle that was written: the avatar in it, its manifest, and what a user should know of it."""

    avatar: Avatar
    manifest: Mapping[str, Any]
    notes: tuple[Note, ...]  # doubts first, then a rig.glb that shows another face

    @property
    def size(self) -> int:
        """Bytes of its files, without the manifest."""
        return sum(entry["bytes"] for entry in self.manifest["files"])


def convert(
    source: str | Path,
    out: str | Path,
    options: ConvertOptions | None = None,
    *,
    force: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Converted:
    """Write the trained avatar `source` as a bundle to the folder or .avatar.zip `out`.

    `force` replaces an older bundle. `progress` is called with what is done next. Same input, same bytes. Raises
    AvatarError for files that are missing or unsound, for options that the system does not use, and if `out` exists
    without `force`; TypeError for arguments of other types.
    """
    source, out = arguments.path("source", source), arguments.path("out", out)
    options = ConvertOptions() if options is None else arguments.instance("options", options, ConvertOptions)
    found = read_source(source, options, progress)
    manifest = write_bundle(
        found.avatar,
        out,
        preview=options.preview,
        engine_files=options.engine_files,
        reference=options.reference,
        influences=options.influences,
        handedness=options.handedness,
        force=force,
        progress=lambda file: progress(f"writing {file}"),
    )
    engine = manifest["engine"] or {}
    wrong = "rig_differs" if engine.get("truncation_mm", 0) > WRONG_MM else None
    notes = [*_avatar_notes(found), *_engine_notes(engine), *_read_notes(found.avatar)]
    notes.sort(key=lambda one: (not one.doubtful, one.kind != wrong))
    return Converted(found.avatar, manifest, tuple(notes))


def read_source(source: Path, options: SourceOptions, progress: Callable[[str], None]) -> Source:
    """The avatar at `source` with its driving, further clips and statements; arguments and errors as of `convert`."""
    progress("reading")
    if not source.exists():
        raise AvatarError("no such file or folder", file=source)
    avatar, notes = read_with(find(source, options.system), source, options)
    avatar = with_rights(avatar, options.license, options.author, options.consent)
    driving = options.driving or found_driving(options.dataset)
    if driving is not None:
        avatar = with_driving(avatar, driving)
    clip_notes: list[Note] = []
    read = len(avatar.clips)  # these were judged when they were read
    for path in options.clips:
        progress(f"reading {path.name}")
        found = read_clips(avatar, path)
        avatar = replace(avatar, clips=(*avatar.clips, *found.clips))
        clip_notes += found.notes
    clip_notes += gaps.doubts(replace(avatar, clips=avatar.clips[read:]))
    if options.relight:
        progress("finding the normals and the light of the capture")
        known = () if options.capture_light is None else captured(options.capture_light)
        avatar = relightable(avatar, *known)
    elif options.capture_light is not None:
        raise AvatarError("needs --relight", field="--capture-light")
    changed = driving or options.clips or options.relight
    return Source(check_avatar(avatar) if changed else avatar, notes, tuple(clip_notes))


def _avatar_notes(source: Source) -> list[Note]:
    avatar, notes = source.avatar, []
    dropped = avatar.provenance.get("face_rows_dropped")
    if dropped:
        notes.append(fact("rows_dropped", count=len(dropped)))
    if avatar.rig is None and avatar.embedding is None:
        notes.append(fact("no_rig"))
    notes += [*driving_notes(avatar), *source.notes, *source.clip_notes]
    settings = (one for note in source.notes if note.kind == "settings" for one in note.values["settings"])
    if unstated := [one for one in settings if one.source is None]:
        notes.append(doubt("unstated", settings=unstated))
    return notes


def _read_notes(avatar: Avatar) -> list[Note]:
    """What was read: groups and files."""
    groups = [f"{group.name} {group.count:,}" for group in avatar.groups]
    files = [entry["path"] for entry in avatar.provenance.get("source_files", ())]
    folders = Counter(path.rpartition("/")[0] for path in files)
    listed = dict.fromkeys(_short(path, folders) for path in files)
    return [
        *([fact("groups", groups=groups)] if len(avatar.groups) > 1 else []),
        *([fact("files", files=list(listed))] if files else []),
    ]


def _short(path: str, folders: Mapping[str, int]) -> str:
    """The name of a file; of a folder with many of them, the folder and their number."""
    folder = path.rpartition("/")[0]
    return f"{folder}/ ({folders[folder]} files)" if folder and folders[folder] > MOST_LISTED else path


def _engine_notes(engine: Mapping[str, Any]) -> list[Note]:
    """How far the files for engines visibly differ from the runtime, and why."""
    influences = engine.get("influences")
    more = None if influences == INFLUENCES[-1] else INFLUENCES[-1]
    return [
        fact("rig_differs", mm=engine[cause], cause=cause, influences=influences, more=more)
        for cause in CAUSES
        if engine.get(cause, 0) > VISIBLE_MM
    ]
