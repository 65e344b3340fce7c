"""Options, each declared once: the command line, Python and the rows of a batch are made of these dataclasses.

`declared` lists the options of one. `commands.declared` makes options of a command of them, `batch.row_options` columns
of a list.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import (
    Annotated,
    Any,
    Concatenate,
    ParamSpec,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rules import ROTATION_RULES, SH_DIRECTIONS, TRAINED_SIGNS

P = ParamSpec("P")
T = TypeVar("T")
LEAST_UNITS, MOST_UNITS = 1e-6, 1e6  # training units per metre
CHECKS: Mapping[type, Callable[[str, Any], Any]] = {
    Path: arguments.path,
    float: arguments.finite,
    int: arguments.whole,
    bool: lambda name, value: arguments.instance(name, value, bool, "True or False"),
    str: lambda name, value: arguments.instance(name, value, str, "a text"),
}


@dataclass(frozen=True)
class Option:
    """What there is to say of an option, besides its type and default."""

    help: str
    flags: tuple[str, ...] = ()  # on the command line; (): made of the name
    choices: tuple[object, ...] = ()
    least: float | None = None
    most: float | None = None
    metavar: str | None = None
    off: bool = False  # the flag turns off what is on by default
    text: Callable[[str], Any] | None = None  # value of a text of the command line; raises ValueError
    shown: str | None = None  # default, as such a text


def _field(make: Callable[P, Option]) -> Callable[Concatenate[T, P], T]:
    def made(default: T, /, *said: P.args, **more: P.kwargs) -> T:
        return field(default=default, metadata={"option": make(*said, **more)})

    return made


option = _field(Option)  # a field of a dataclass: its default, and what Option takes


@dataclass(frozen=True)
class Declared:
    """An option with its name, type and default."""

    name: str
    kind: type  # a key of CHECKS, or tuple for what `text` makes
    several: bool  # a tuple of them
    optional: bool  # may be None
    default: Any
    option: Option

    @property
    def flag(self) -> str:
        """What it is called on the command line, first name."""
        return self.option.flags[0] if self.option.flags else f"--{self.name.replace('_', '-')}"

    def checked(self, value: Any) -> Any:
        """The value in the option's type. Raises TypeError, and ValueError for one outside its range or choices."""
        if value is None and self.optional:
            return None
        if not self.several:
            return self._one(self.name, value)
        if not isinstance(value, list | tuple):
            raise arguments.wrong_type(self.name, value, "a list of paths" if self.kind is Path else "a list")
        return tuple(self._one(f"{self.name}[{index}]", one) for index, one in enumerate(value))

    def _one(self, name: str, value: Any) -> Any:
        found = CHECKS[self.kind](name, value)
        if self.option.choices and found not in self.option.choices:
            known = ", ".join(map(str, self.option.choices))
            raise ValueError(f"{name}: {str(found)[:40]!r} is not one of {known}")
        least, most = self.option.least, self.option.most
        if (least is not None and found < least) or (most is not None and found > most):
            wanted = f"at least {least:g}" if most is None else f"{least:g} to {most:g}"
            raise ValueError(f"{name} is {found:g}; {wanted} is needed")
        return found


@dataclass(frozen=True)
class Options:
    """Base of the dataclasses of options. Raises TypeError and ValueError for a value that an option does not take."""

    def __post_init__(self) -> None:
        """Brings every field to its type: paths may be texts."""
        for name, one in declared(type(self)).items():
            object.__setattr__(self, name, one.checked(getattr(self, name)))


def declared(kind: type[Options]) -> Mapping[str, Declared]:
    """The options of a dataclass, by name."""
    hints = get_type_hints(kind, include_extras=True)
    return {
        one.name: declared_as(one.name, hints[one.name], one.default, *one.metadata.values())
        for one in fields(kind)
    }


def declared_as(name: str, hint: Any, default: Any, option: Option | None = None) -> Declared:
    """An option of the type `hint`. If `option` is None, `hint` is Annotated[type, option]."""
    kind, option = (hint, option) if option is not None else get_args(hint)
    optional = get_origin(kind) in (Union, types.UnionType)
    if optional:
        (kind,) = (one for one in get_args(kind) if one is not type(None))
    several = get_origin(kind) is tuple
    return Declared(name, get_args(kind)[0] if several else kind, several, optional, default, option)


# Shared by commands that take a part of the options alone.
BodyModel = Annotated[Path | None, Option("FLAME or SMPL file, .npz or .pkl.")]
Shape = Annotated[
    Path | None,
    Option(
        "Identity coefficients: a tracked .frame, .npy, .npz, .json, or `zero` for the mean shape.",
        ("--shape", "--frame"),
    ),
]
Clips = Annotated[
    tuple[Path, ...],
    Option(
        "File whose clips are added: a face recording (played through the driving), .glb, .fbx or pose file; or "
        "BUNDLE:NAME, a clip of another avatar with the same expressions or ARKit's. May be repeated.",
        ("--clip",),
        metavar="FILE|BUNDLE:NAME",
    ),
]
License = Annotated[str | None, Option("Licence of the avatar, for the manifest.", ("--licence",))]
Author = Annotated[str | None, Option("Author of the avatar, for the manifest.")]
Consent = Annotated[str | None, Option("Consent of the person shown, for the manifest.")]


@dataclass(frozen=True)
class ReadOptions(Options):
    """Inputs that a checkpoint does not hold. A reader refuses a field that its system does not use."""

    body_model: BodyModel = None
    body_scale: float | None = option(
        None,
        "Gaussian Blendshapes only: how much the body model was enlarged for training, in training units per "
        "unit of its file (a metre). Left out: what rules.json says, else 1.",
        least=LEAST_UNITS,
        most=MOST_UNITS,
    )
    shape: Shape = None
    eyelids: Path | None = option(None, "Folder with l_eyelid.npy and r_eyelid.npy.")
    anchor_faces: Path | None = option(
        None, "Text file with the indices of the faces that carry the upper teeth."
    )
    dataset: Path | None = option(
        None, "Folder that is searched for every input that is not given, driving.json included."
    )
    rig: Path | None = option(
        None,
        "Rig of the mesh that the Gaussians are embedded in: a skinned .glb or .fbx, or an ASM face .npz.",
    )
    mesh: Path | None = option(
        None,
        "Mesh that the Gaussians are embedded in, if it is not in the checkpoint: .obj, or .npz with vertices "
        "and faces, in training units (see --units). For an ASM person: the face .npz with the template.",
    )
    poses: Path | None = option(
        None, "Tracked poses, for the identity and a clip: flame_params.json, poses.npz or flame_param.npz."
    )
    units: float | None = option(
        None, "Training units per metre (4 for SplattingAvatar heads).", least=LEAST_UNITS, most=MOST_UNITS
    )
    mesh_scaling: bool | None = option(
        None,
        "SplattingAvatar: whether triangles scale their Gaussians. Default: as config.yaml says.",
        ("--mesh-scaling/--no-mesh-scaling",),
    )
    sh_direction: str | None = option(
        None,
        f"View direction for SH: {' or '.join(SH_DIRECTIONS)}. Default: as the config says.",
        choices=SH_DIRECTIONS,
    )
    sh_degree: int | None = option(None, "Active SH degree. Default: as stored.", least=0, most=3)
    quaternion_sign: str | None = option(
        None,
        f"Sign of pytorch3d's quaternions at training: {' or '.join(TRAINED_SIGNS)} (before 0.7.6).",
        choices=TRAINED_SIGNS,
    )
    no_rig: bool = option(False, "Write no rig: no joints, no skinning, only expressions.")
    accept_misfit: bool = option(
        False,
        "Convert inputs that lie far apart (above a quarter of their size), with a warning in place of an error.",
    )
    rotation: str | None = option(
        None,
        f"Rotation rule, where the system leaves a choice: {', '.join(ROTATION_RULES)}.",
        choices=tuple(ROTATION_RULES),
    )
    exact: bool = option(False, "Keep every delta that is not zero, rounding noise included.")
    name: str | None = option(None, "Name of the avatar. Default: that of the source.")

    def refuse_beside_no_rig(self, unused: Collection[str], owner: str) -> None:
        """Raise AvatarError, for the reader `owner`, if `no_rig` is set and one of the options `unused` is given:
        they would have no effect."""
        given = [name for name in unused if getattr(self, name) is not None]
        if self.no_rig and given:
            flags = " and ".join(f"--{name.replace('_', '-')}" for name in given)
            raise AvatarError(
                f"{flags} would have no effect beside --no-rig; leave out {flags}, or --no-rig to get a rig",
                owner=owner,
            )

    def refuse_others(self, used: Collection[str], owner: str, why: str) -> None:
        """Raise AvatarError for an option that is given and that the reader `owner` does not use."""
        for option in fields(ReadOptions):
            if option.name not in used and getattr(self, option.name) != option.default:
                flag = f"--{option.name.replace('_', '-')}"
                raise AvatarError(f"{flag} cannot be used here: {why}", owner=owner)
