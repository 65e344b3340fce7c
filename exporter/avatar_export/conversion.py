"""A trained avatar in, a bundle out: the whole of `avatar-export convert` as one function."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from avatar_export.bodies.inputs import found_driving
from avatar_export.clips.sources import clips_from
from avatar_export.driving.drive import driving_notes
from avatar_export.driving.matrix import with_driving
from avatar_export.options import ReadOptions
from avatar_export.provenance import DOUBT, UNSAID, with_rights
from avatar_export.readers.table import find, read
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.table import INFLUENCES
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks import arguments
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.handedness import HANDEDNESS

MOST_LISTED = 3  # files of one folder
VISIBLE_MM = 0.1  # errors of rig.glb below this are not mentioned
WRONG_MM = 2.0  # an error of too few joints above this is another face: it is the first note
RIG_DIFFERS = "rig.glb differs from the runtime's mesh"
FOUR_JOINTS = ("three.js", "both glTF importers of Unity")  # that ignore JOINTS_1: docs/engines


def convert(
    source: str | Path,
    out: str | Path,
    *,
    options: ReadOptions | None = None,
    system: str | None = None,
    driving: Path | None = None,
    clips: Sequence[Path] = (),
    licence: str | None = None,
    author: str | None = None,
    consent: str | None = None,
    preview: bool = True,
    engine_files: bool = True,
    reference: bool = True,
    influences: int = INFLUENCES[0],
    handedness: str = HANDEDNESS[0],
    force: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Path:
    """Write the trained avatar `source` as a bundle to the folder or .avatar.zip `out`, which is returned.

    - `options`: inputs that the checkpoint does not hold; `system` skips detection (see `READERS`).
    - `driving`: JSON matrix from the ARKit names; by default driving.json in `options.dataset`, if there is one.
    - `clips`: files whose animations the bundle carries (see `clips.sources`).
    - `licence`, `author`, `consent`: statements for the manifest; None keeps what the source says.
    - `preview`, `engine_files`, `reference`, `influences`, `handedness`, `force`: as for `writers.bundle.write_bundle`.
    - `progress` is called with what is done next.

    Same input, same bytes. Raises AvatarError for files that are missing or unsound, for options that the system does
    not use, and if `out` exists without `force`; TypeError and ValueError for arguments of other types, an unknown
    handedness or number of influences.
    """
    out = arguments.path("out", out)
    if isinstance(clips, str | PathLike):
        raise arguments.wrong_type("clips", clips, "a list of paths")
    for name, statement in (("licence", licence), ("author", author), ("consent", consent)):
        if statement is not None:
            arguments.instance(name, statement, str, "a text")
    arguments.text("handedness", handedness, HANDEDNESS)
    if arguments.whole("influences", influences) not in INFLUENCES:
        raise ValueError(f"influences is {influences}; {' or '.join(map(str, INFLUENCES))} is needed")
    avatar = read_source(
        arguments.path("source", source),
        ReadOptions() if options is None else options,
        system=system,
        driving=None if driving is None else arguments.path("driving", driving),
        clips=[arguments.path(f"clips[{index}]", clip) for index, clip in enumerate(clips)],
        licence=licence,
        author=author,
        consent=consent,
        progress=progress,
    )
    write_bundle(
        avatar,
        out,
        preview=preview,
        engine_files=engine_files,
        reference=reference,
        influences=influences,
        handedness=handedness,
        force=force,
        progress=lambda file: progress(f"writing {file}"),
    )
    return out


def read_source(
    source: Path,
    options: ReadOptions,
    *,
    system: str | None,
    driving: Path | None,
    clips: Sequence[Path],
    licence: str | None,
    author: str | None,
    consent: str | None,
    progress: Callable[[str], None],
) -> Avatar:
    """The avatar at `source` with its driving, further clips and statements; arguments and errors as of `convert`."""
    progress("reading")
    avatar = with_rights(read(source, options, system), licence, author, consent)
    driving = driving or found_driving(options.dataset)
    if driving is not None:
        avatar = check_avatar(with_driving(avatar, driving))
    for path in clips:
        progress(f"reading {path.name}")
        avatar = check_avatar(replace(avatar, clips=(*avatar.clips, *clips_from(avatar, path))))
    return avatar


def conversion_notes(avatar: Avatar, manifest: Mapping[str, Any]) -> list[str]:
    """What a user should know of a bundle that was just written.

    Doubts, which begin with DOUBT, come first, then a rig.glb that shows another face.
    """
    engine = manifest["engine"] or {}
    notes = [*_avatar_notes(avatar), *_engine_notes(engine)]
    if engine.get("truncation_mm", 0) > WRONG_MM:
        notes.sort(key=lambda text: not text.startswith(RIG_DIFFERS))
    return sorted(notes, key=lambda text: not text.startswith(DOUBT))


def _avatar_notes(avatar: Avatar) -> list[str]:
    notes = []
    dropped = avatar.provenance.get("face_rows_dropped")
    if dropped:
        notes.append(f"{len(dropped)} rows with a NaN or infinity were dropped; avatar.json lists them")
    if avatar.rig is None and avatar.embedding is None:
        notes.append("no rig: only expressions move; joints and teeth do not")
    notes.extend(driving_notes(avatar))
    stored = avatar.provenance.get("notes", ())
    notes.extend(stored)
    unsaid = [
        part.removesuffix(f" ({UNSAID})") for note in stored for part in note.split("; ") if UNSAID in part
    ]
    if unsaid:
        notes.append(
            f"{DOUBT}no file of the checkpoint and no option says {' and '.join(unsaid)}; wrong values change the size "
            "and the look: pass --units and --mesh-scaling or --no-mesh-scaling as in the training"
        )
    return notes


def unstored_notes(source: str | Path, options: ReadOptions, system: str | None = None) -> list[str]:
    """What the reader of `source` assumes and the bundle does not record. Raises AvatarError for an unknown source."""
    return find(Path(source), system).assumptions(Path(source), options)


def chosen_notes(
    avatar: Avatar, source: str | Path, options: ReadOptions, system: str | None = None
) -> list[str]:
    """What was chosen to make `avatar`: iteration and form, groups, files. Raises AvatarError for an unknown source."""
    groups = ", ".join(f"{group.name} {group.count:,}" for group in avatar.groups)
    files = [entry["path"] for entry in avatar.provenance.get("source_files", ())]
    folders = Counter(path.rpartition("/")[0] for path in files)
    listed = dict.fromkeys(_short(path, folders) for path in files)
    several = len(avatar.groups) > 1
    return [
        *find(Path(source), system).chosen(Path(source), options),
        *([f"Gaussians by group: {groups}"] if several else []),
        *([f"files read: {', '.join(listed)}"] if files else []),
    ]


def _short(path: str, folders: Mapping[str, int]) -> str:
    """The name of a file; of a folder with many of them, the folder and their number."""
    folder = path.rpartition("/")[0]
    return f"{folder}/ ({folders[folder]} files)" if folder and folders[folder] > MOST_LISTED else path


def _engine_notes(engine: Mapping[str, Any]) -> list[str]:
    """How far the files for engines visibly differ from the runtime, and why."""
    reasons = {
        "truncation_mm": f"{engine.get('influences')} joints a vertex are too few" + _more(engine),
        "late_morph_mm": "engines move the eyelids before the skeleton",
        "shear_mm": "nodes of glTF cannot shear",
    }
    return [
        f"{RIG_DIFFERS} by up to {engine[name]:.2g} mm, since {reason}"
        for name, reason in reasons.items()
        if engine.get(name, 0) > VISIBLE_MM
    ]


def _more(engine: Mapping[str, Any]) -> str:
    """What helps against too few joints, and where it does not."""
    if engine.get("influences") == INFLUENCES[-1]:
        return "; rig.usdc keeps all"
    ignored = " and ".join(FOUR_JOINTS)
    return f"; --influences {INFLUENCES[-1]} gives more, but {ignored} ignore the second four; rig.usdc keeps all"
