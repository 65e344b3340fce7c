"""An avatar into a project: the whole of `avatar-export drop` as one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from avatar_export.drop.contents import Source, asset_path, delivery, player_files
from avatar_export.drop.hosts import PAGE, Project, project_at
from avatar_export.drop.placing import KEEP, NEW, SAME, UPDATE, mend, place, planned
from avatar_export.drop.steps import Place
from avatar_export.notes.note import Note, fact
from avatar_export.serving import publish, site_folder
from avatar_export.serving.session import shown
from avatar_runtime.io.errors import AvatarError

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Dropped:
    """What was put into a project, or what would be."""

    project: Project
    support: str
    player: str  # its folder or file, below the project; "" for none
    asset: str  # pack or page, below the project
    words: Mapping[str, str]  # path below the project: what happened to it, as `placing` calls it
    kept: Sequence[str]  # what the user changed, and was not replaced
    notes: Sequence[Note]
    steps: Sequence[str]


def drop(
    source: Source,
    into: Path,
    *,
    levels: tuple[float, ...] | None = None,
    force: bool = False,
    dry_run: bool = False,
    progress: Progress = lambda _: None,
) -> Dropped:
    """Put the avatar `source` and the player for it into the project in the folder `into`.

    `levels` are those of the pack, by default what the engine wants. `force` replaces files of player and avatar that
    the user changed. `dry_run` changes nothing, and does not pack.
    Raises AvatarError for a folder that is no project, a version that the player does not support, an unsound source,
    and where a file cannot be written; each of player and avatar is whole then, old or new.
    """
    project = project_at(into)
    if levels is not None:
        choices = replace(project.host.choices, levels=levels)
        project = replace(project, host=replace(project.host, choices=choices))
    player = player_files(project)
    support = project.host.support(project.mark, player)
    if support.known is False:
        raise AvatarError(f"is a project of {project.text()}, but {support.text}", file=into)
    put = _page if project.host.asset == PAGE else _files
    if dry_run:
        source.read(progress)  # an unsound one is found
    asset, words, kept, notes = put(project, player, source, force, dry_run, progress)
    host = project.host
    place_of = (host.folder(player) if host.folder else None) or host.tarball or ""
    steps = host.steps(Place(project.folder, project.mark, asset))
    return Dropped(project, support.text, place_of, asset, words, kept, notes, steps)


Outcome = tuple[str, Mapping[str, str], Sequence[str], Sequence[Note]]  # asset, words, kept, notes


def _files(
    project: Project, player: dict[str, bytes], source: Source, force: bool, dry_run: bool, progress: Progress
) -> Outcome:
    """Player and file."""
    asset, top = asset_path(project, source), project.folder
    first = delivery(project, player, asset, None)
    if not dry_run:
        mend(top, first)
    plan = planned(top, first, force)  # what is refused is refused before an avatar is packed
    notes: list[Note] = []
    if not dry_run:
        data, notes = source.pack(project.host.choices, progress)
        progress("writing")
        whole = delivery(project, player, asset, data)
        plan = planned(top, whole, force)
        place(top, whole, plan)
    return plan.at[asset], plan.words, plan.kept, notes


def _page(
    project: Project,
    _player: dict[str, bytes],
    source: Source,
    force: bool,
    dry_run: bool,
    progress: Progress,
) -> Outcome:
    """A published folder, which holds page, player and pack, and has a list of its own."""
    out = project.folder / source.id
    page = f"{source.id}/{site_folder.PAGE}"
    if out.is_symlink():
        raise AvatarError("is a link, and nothing outside of the project is touched; move it away", file=out)
    site_folder.expect_replaceable(out, True)
    if dry_run:
        return page, {page: UPDATE if (project.folder / page).exists() else NEW}, [], []
    pack, notes = source.pack(project.host.choices, progress)
    avatar = shown(source.id, pack, str(source.path))
    if avatar.license is None:
        notes.append(fact("no_licence", avatar=avatar.name, option="--licence"))
    progress("writing")
    files = publish.site([avatar])
    words = {f"{source.id}/{path}": _word(out / path, data) for path, data in files.items()}
    kept = [f"{source.id}/{path}" for path in site_folder.write_site(out, files, True, overwrite=force)]
    return page, words | dict.fromkeys(kept, KEEP), kept, notes


def _word(at: Path, data: bytes) -> str:
    if not at.is_file():
        return NEW
    return SAME if at.read_bytes() == data else UPDATE
