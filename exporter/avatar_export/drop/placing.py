"""Puts a player and files into a project of the user: a plan, which looks only, and its execution.

The list DROPPED at the top of the project names what was put there, with hashes. A listed file whose contents are on
the list is replaced; one that the user changed is kept. All is prepared in a folder beside the list, where no engine
looks. Then the player's folder, with the user's own files in it, and each other file is exchanged in one step.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from avatar_export.owned import FOREIGN, Listed, OwnList, found, meanwhile, sha256, stage
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import heal, put, sync, sync_folder

_NAME = r"(?!\.\.?(?:/|\Z))[^/\\:\x00-\x1f]{1,255}"
DROPPED = OwnList(
    mark="avatar-export-drop.json",
    path=re.compile(rf"{_NAME}(?:/{_NAME})*"),
    command="drop",
    done="dropped",
    does="drops",
    cure="delete it, and drop again with --force, which replaces every file of the player",
)
NEW, UPDATE, SAME, REMOVE, KEEP = "new", "update", "same", "remove", "keep"
META = ".meta"  # of Unity: GUID and import settings of the file or folder beside it, which Unity and the user change
CHANGES = (NEW, UPDATE, REMOVE)


@dataclass(frozen=True)
class Delivery:
    """What is put into a project; paths are below the project, but for those of the player."""

    folder: str  # of the player; "" for none
    player: Mapping[str, bytes]  # by paths below `folder`
    files: Mapping[str, bytes | None]  # None: contents that are not made yet, for a plan alone
    moved: str = ""  # folder within which the user may have moved `files`; "": nowhere


@dataclass(frozen=True)
class Plan:
    """What happens to the files of a project."""

    words: Mapping[str, str]  # path: NEW, UPDATE, SAME, REMOVE or KEEP
    at: Mapping[str, str]  # a path of `Delivery.files`: where the user has moved it, or the same
    # What is in the player's folder and goes along, files and empty folders, below that folder.
    carried: Sequence[str]
    kept: Sequence[str]  # changed by the user, and therefore not replaced; without META
    before: Listed
    meanwhile: Listed
    after: Listed

    def changes(self, below: str = "") -> bool:
        """Whether anything below a path changes."""
        return any(word in CHANGES for path, word in self.words.items() if path.startswith(below))


def mend(project: Path, delivery: Delivery) -> None:
    """Puts back or removes what a killed process has left."""
    _expect_plain(project, delivery)
    heal(project / DROPPED.mark)
    if delivery.folder:
        heal(project / delivery.folder)


def planned(project: Path, delivery: Delivery, force: bool) -> Plan:
    """What must be done in `project`, a folder without links in its path; `force` replaces what the user changed.

    Raises AvatarError for links, for what is no plain file in the place of one, for a player's folder that was not
    dropped, and for an unsound list.
    """
    _expect_plain(project, delivery)
    before = _listed(project)
    base = f"{delivery.folder}/"
    held = _entries(project / delivery.folder) if delivery.folder else []
    own = {base + path: sha256(data) for path, data in delivery.player.items()}
    words = {path: _word(project, path, hashed, before.get(path, ()), force) for path, hashed in own.items()}
    if held and KEEP in words.values() and not any(path.startswith(base) for path in before):
        raise AvatarError(
            "holds files that `drop` did not put there; move it away, or pass --force, which replaces the player's "
            "files and keeps others",
            file=project / delivery.folder,
        )
    if delivery.folder:
        listed = {path: hashes for path, hashes in before.items() if path.startswith(base)}
        words |= _stale(project, listed, own, [base + path for path in held], force)
    at = {path: _moved(project, path, before, delivery.moved) for path in delivery.files}
    for path, data in delivery.files.items():
        hashed = None if data is None else sha256(data)
        own[path] = hashed or ""
        words[at[path]] = _word(project, at[path], hashed, before.get(path, ()), force)
    said = {path: words[at.get(path, path)] for path in own}
    kept = {path for path, word in said.items() if word == KEEP}
    gone = {path for path, word in words.items() if word == REMOVE}
    return Plan(
        words,
        at,
        [path for path in held if words.get(base + path) not in CHANGES],
        [path for path, word in words.items() if word == KEEP and not path.endswith(META)],
        before,
        meanwhile(before, {path: hashed for path, hashed in own.items() if hashed}),
        {path: hashes for path, hashes in before.items() if path not in gone}
        | {path: [hashed] for path, hashed in own.items() if path not in kept},
    )


def place(project: Path, delivery: Delivery, plan: Plan) -> None:
    """Does what is planned. Raises AvatarError where it cannot be written; nothing has changed then, but for what was
    exchanged before."""
    if not plan.changes() and plan.before == plan.after:
        return
    folder = delivery.folder if delivery.folder and plan.changes(f"{delivery.folder}/") else ""
    files = {
        plan.at[path]: data
        for path, data in delivery.files.items()
        if data is not None and plan.words[plan.at[path]] in CHANGES
    }
    lists = [DROPPED.text(listed) for listed in (plan.before, plan.meanwhile, plan.after)]
    made: list[Path] = []
    try:
        with DROPPED.staging(project) as staging:
            staged = stage(staging, {**files, **{str(number): text for number, text in enumerate(lists)}})
            if folder:
                _build(staging / "player", project / folder, delivery, plan)
            for path in filter(None, (folder, *files)):
                _make_folders(project, path, made)
            _exchange(project, folder, staging / "player", {path: staged[path] for path in files}, staged)
    except OSError as error:
        close = "; close it in its engine, or make it writable" if isinstance(error, PermissionError) else ""
        raise AvatarError(f"cannot be written ({error.strerror or error}){close}", file=project) from None
    finally:
        for made_one in reversed(made):
            with suppress(OSError):
                made_one.rmdir()  # goes only if it is empty: nothing was put there


def _exchange(
    project: Path, folder: str, player: Path, files: Mapping[str, Path], lists: Mapping[str, Path]
) -> None:
    """Gives what is prepared its places. `lists` are the list "0" from before, "1" of meanwhile, "2" of the end."""
    mark, begun = project / DROPPED.mark, False
    listed = mark.exists()
    os.replace(lists["1"], mark)
    try:
        sync_folder(project)
        if folder:
            put(player, project / folder, force=True)
            begun = True
        for path, staged in files.items():
            os.replace(staged, project / path)
            begun = True
            sync_folder((project / path).parent)
    except OSError:
        if not begun and listed:
            os.replace(lists["0"], mark)
        elif not begun:
            mark.unlink()
        raise
    os.replace(lists["2"], mark)
    sync_folder(project)


def _listed(project: Path) -> Listed:
    mark = project / DROPPED.mark
    if not os.path.lexists(mark):
        return {}
    if mark.is_symlink() or not mark.is_file():
        raise AvatarError("is not a plain file; move it away", file=mark)
    return DROPPED.read(project)


def _word(project: Path, path: str, own: str | None, listed: Sequence[str], force: bool) -> str:
    """What happens to a file whose new contents have the hash `own`, which is None while nobody knows."""
    state = found(project, path)
    if state == FOREIGN:
        raise AvatarError("is a link or a folder where `drop` puts a file; move it away", file=project / path)
    if state is None:
        return NEW
    if state == own:
        return SAME
    return UPDATE if state in listed or (force and not path.endswith(META)) else KEEP


def _stale(
    project: Path, listed: Listed, own: Mapping[str, str], held: Sequence[str], force: bool
) -> dict[str, str]:
    """The words of listed files that the player no longer has. A META goes and stays with its file or folder."""
    old = [path for path in held if path in listed and path not in own]
    stale = {
        path: REMOVE if force or found(project, path) in listed[path] else KEEP
        for path in old
        if not path.endswith(META)
    }
    staying = [path for path in (*held, *own) if stale.get(path) != REMOVE and not path.endswith(META)]
    for path in set(old) - set(stale):
        file = path.removesuffix(META)
        stays = any(one == file or one.startswith(f"{file}/") for one in staying)
        stale[path] = KEEP if stays else REMOVE
    return stale


def _moved(project: Path, path: str, before: Listed, within: str) -> str:
    """Where a dropped file is that its user has moved: the one file of its suffix that has its contents."""
    if not within or path not in before or os.path.lexists(project / path):
        return path
    files = sorted((project / within).rglob(f"*{PurePosixPath(path).suffix}"))
    places = [file.relative_to(project).as_posix() for file in files]
    same = [place for place in places if found(project, place) in before[path]]
    return same[0] if len(same) == 1 else path


def _expect_plain(project: Path, delivery: Delivery) -> None:
    """Raise AvatarError if a folder that is written to is a link or no folder."""
    for path in (
        *([delivery.folder] if delivery.folder else []),
        *(str(PurePosixPath(p).parent) for p in delivery.files),
    ):
        for part in (PurePosixPath(path), *PurePosixPath(path).parents):
            at = project / part
            if os.path.lexists(at) and (at.is_symlink() or not at.is_dir()):
                raise AvatarError(
                    "is a link or no folder, and nothing outside of the project is touched; put a plain folder in its "
                    "place",
                    file=at,
                )


def _entries(folder: Path) -> list[str]:
    """Files and empty folders at any depth of a folder, by their paths below it. Raises AvatarError for a link and for
    what is no file: it could not be carried along."""
    entries = []
    for at, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(at, name)
            if path.is_symlink() or not (path.is_dir() or path.is_file()):
                raise AvatarError(
                    "is a link or no file, and the player's folder is exchanged as a whole; move it away",
                    file=path,
                )
        if at != str(folder) and not folders and not files:
            files = ["."]
        entries += [Path(at, name).relative_to(folder).as_posix() for name in files]
    return sorted(entries)


def _build(player: Path, old: Path, delivery: Delivery, plan: Plan) -> None:
    """Makes the folder that takes the place of `old`: what is carried, and what is new. All is on the disk then."""
    player.mkdir()
    for path in plan.carried:
        source, copy = old / path, player / path
        if source.is_dir():
            copy.mkdir(parents=True, exist_ok=True)
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.link(source, copy)  # an engine's build in the folder may be large
        except OSError:
            shutil.copy2(source, copy)
    for path, data in delivery.player.items():
        if plan.words[f"{delivery.folder}/{path}"] in CHANGES:
            (player / path).parent.mkdir(parents=True, exist_ok=True)
            (player / path).write_bytes(data)
            sync(player / path)
    for at, _, _ in os.walk(player):
        sync_folder(Path(at))


def _make_folders(project: Path, path: str, made: list[Path]) -> None:
    """Makes the folders above a path, and adds them to `made`."""
    for part in reversed(PurePosixPath(path).parents):
        folder = project / part
        if not folder.exists():
            folder.mkdir()
            made.append(folder)
