"""The input files of a conversion: given by option, or found by name in a dataset folder."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from avatar_export.bodies.subject_files import EYELID_FILES
from avatar_export.options import ReadOptions
from avatar_runtime.io.errors import AvatarError

# The usual file names of each input; the first pattern that matches wins.
PATTERNS: dict[str, tuple[str, ...]] = {
    "body_model": (
        "body_model.npz",
        "generic_model.pkl",
        "flame*model*.pkl",
        "FLAME20*.pkl",
        "flame20*.pkl",
        "FLAME_NEUTRAL*.pkl",
        "FLAME_*MALE*.pkl",
        "SMPL_*.pkl",
    ),
    "shape": ("shape.npy", "*.frame"),
    "eyelids": ("l_eyelid.npy",),
    "anchor_faces": ("back_of_head.txt",),
}
DEPTH = 3
ZERO = "zero"  # --shape zero: the mean shape, no file
FILES = {  # of options that name one file: what it is
    "body_model": "a FLAME or SMPL file, .npz or .pkl",
    "shape": f"a tracked .frame, .npy, .npz or .json, or write `{ZERO}` for the mean shape",
    "anchor_faces": "a text file such as back_of_head.txt",
    "rig": "a .glb, an .fbx or the .npz of an ASM face",
    "poses": "a flame_params.json, poses.npz or flame_param.npz",
}


@dataclass(frozen=True)
class Inputs:
    """Paths of input files; None for an input that was not given or found."""

    body_model: Path | None
    shape: Path | None
    eyelids: Path | None  # folder
    anchor_faces: Path | None

    def files(self) -> dict[str, Path]:
        """ "ROLE/FILE" -> path of every file; `--shape zero` is not a file."""
        found: dict[str, Path] = {}
        for field in fields(self):
            path: Path | None = getattr(self, field.name)
            if path is not None and path.is_file():
                found[f"{field.name}/{path.name}"] = path
            elif path is not None and path.is_dir():
                found |= {f"{field.name}/{name}": path / name for name in EYELID_FILES.values()}
        return found


def given_files(options: ReadOptions, *roles: str) -> dict[str, Path]:
    """ "ROLE/FILE" -> path of the files that the options `roles` name."""
    given = {role: getattr(options, role) for role in roles}
    return {
        f"{role}/{path.name}": path for role, path in given.items() if path is not None and path.is_file()
    }


def find_inputs(model_folder: Path, options: ReadOptions, owner: str) -> Inputs:
    """Each input from its option, else from `options.dataset`, else from the model folder.

    Raises AvatarError, for `owner`, if a given path is not there or of another kind (see `check_given`), and if several
    files match a pattern."""
    if options.dataset is not None and not options.dataset.is_dir():
        what = "is not a folder" if options.dataset.exists() else "no such folder"
        raise AvatarError(what, file=options.dataset, field="--dataset", owner=owner)
    roots = [root for root in (options.dataset, model_folder) if root is not None]
    found: dict[str, Path | None] = {}
    for name, patterns in PATTERNS.items():
        check_given(options, name, owner)
        given: Path | None = getattr(options, name)
        first = next(filter(None, (_first(root, patterns) for root in roots)), None)
        found[name] = given or (first.parent if first and name == "eyelids" else first)
    return Inputs(**found)


def check_given(options: ReadOptions, name: str, owner: str) -> None:
    """Raise AvatarError, for `owner`, if the option `name` has a path that is not there or of another kind.

    `eyelids` is a folder, every other option one file; `--shape zero` is not a file.
    """
    path: Path | None = getattr(options, name)
    if path is None or (name == "shape" and str(path) == ZERO):
        return
    wrong = _wrong_kind(path, name)
    if wrong is not None:
        raise AvatarError(wrong, file=path, field=f"--{name.replace('_', '-')}", owner=owner)


def _wrong_kind(path: Path, name: str) -> str | None:
    """Why `path` cannot be the input `name`; None if it can."""
    if name == "shape" and str(path).lower() == ZERO and not path.exists():
        return f"no such file; did you mean `{ZERO}`, the mean shape?"
    if name == "eyelids":
        pair = " and ".join(EYELID_FILES.values())
        if path.is_dir():
            missing = [file for file in EYELID_FILES.values() if not (path / file).exists()]
            return f"has no {' and no '.join(missing)}; pass the folder with both" if missing else None
        return f"{'is a file' if path.exists() else 'no such folder'}; pass the folder with {pair}"
    if path.is_dir():
        return f"is a folder; pass {FILES[name]}"
    if not path.is_file():
        return "is not a regular file" if path.exists() else "no such file"
    return None


def found_file(root: Path, name: str) -> Path | None:
    """The file in the folder `root` that would be taken for the input `name`, if there is one."""
    return _first(root, PATTERNS[name])


def passed_over(root: Path, name: str, taken: Path) -> list[Path]:
    """Other files in the folder `root` that fit the input `name`, sorted; `taken` is the one that is used."""
    return sorted(
        path
        for pattern in PATTERNS[name]
        for depth in range(DEPTH + 1)
        for path in root.glob("*/" * depth + pattern)
        if path.is_file() and path != taken
    )


def found_driving(dataset: Path | None) -> Path | None:
    """driving.json in a dataset folder, if there is one."""
    return None if dataset is None else _first(dataset, ("driving.json",))


def _first(root: Path, patterns: tuple[str, ...]) -> Path | None:
    for pattern in patterns:
        for depth in range(DEPTH + 1):
            matches = sorted(p for p in root.glob("*/" * depth + pattern) if p.is_file())
            if len(matches) > 1 and not pattern.endswith(".frame"):
                raise AvatarError(
                    f"holds several candidates, {', '.join(str(p.relative_to(root)) for p in matches[:4])}; "
                    "choose one by its option",
                    file=root,
                )
            if matches:
                return matches[0]  # any frame of a subject: they share the identity
    return None
