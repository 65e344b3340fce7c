"""The light of a scene: what falls on an avatar, and the numbers that stages `shadow` and `light` take of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, Avatar, Relight
from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rules import RIGGED_ROTATIONS
from avatar_schema import constants

MOST_LIGHTS = 4
AMBIENT_TERMS = 9
LARGEST = 1e4  # of a colour: brighter than any light of a scene
FURTHEST = 1e9  # of any other number: further away than any
SHADOW_SIZE = int(constants()["shadow_size"])  # texels
# How far a Gaussian is moved along its normal, and along the light, before it is asked whether it lies in shadow:
# trained Gaussians lie in layers about the skin (bundle units), and a map has an edge of texels.
LAYERS, TEXELS = np.array((0.006, 0.004)), np.array((1.5, 1.0))
# Irradiance over pi of a light from one direction, by band (Ramamoorthi and Hanrahan 2001).
COSINE = np.repeat([1.0, 2 / 3, 1 / 4], [1, 3, 5])


@dataclass(frozen=True)
class DirectLight:
    """A light from one direction, or from one point."""

    # World space: towards the light, of any length; or where it is, bundle units.
    place: tuple[float, float, float]
    # Linear: what a white matt surface that faces it reflects; of a point, from 1 m.
    colour: tuple[float, float, float]
    point: bool = False


@dataclass(frozen=True)
class Light:
    """The light of a scene, in world space and linear colours. Only the first of `lights` casts a shadow."""

    ambient: F32  # [9, 3] what a white matt surface reflects, as SH of its normal: bases and signs are those of colours
    lights: tuple[DirectLight, ...] = ()
    shadow: bool = False

    def __post_init__(self) -> None:
        """Raises TypeError and ValueError for values of another type, shape or range."""
        _within("ambient", arguments.finite_array("ambient", self.ambient, (AMBIENT_TERMS, 3)))
        if len(self.lights) > MOST_LIGHTS:
            raise ValueError(f"{len(self.lights)} lights; {MOST_LIGHTS} are the most")
        for light in self.lights:
            arguments.instance("light", light, DirectLight)
            place = arguments.finite_array("place", light.place, (3,))
            _within("place", place)
            colour = arguments.finite_array("colour", light.colour, (3,))
            if colour.min() < 0 or colour.max() > LARGEST:
                raise ValueError(f"colour is {list(light.colour)}; 0 to {LARGEST:g} are taken")
            if not light.point and not has_length(place):
                raise ValueError("a direction needs a length")


def _within(name: str, numbers: F64) -> None:
    if np.abs(numbers).max() > FURTHEST:
        raise ValueError(f"{name} has a number beyond {FURTHEST:g}")


def has_length(direction: npt.ArrayLike) -> bool:
    """Whether a vector [3] can be made unit: its square is more than 0."""
    return bool(np.dot(direction, direction) > 0)


@dataclass(frozen=True)
class LightArrays:
    """A light as kernels take it, in the names of their constants."""

    ambient: F32  # [9, 4] rgb, 0
    place: F32  # [4, 4] xyz towards the light and 0, or its position and 1
    colour: F32  # [4, 4] rgb, 0; black where there is no light
    turn: F32  # [3, 4] frame that the captured light moves with from world, a rotation; 0
    shadow_row: F32  # [4, 4] column, row, distance and w of the shadow map, from world
    shadow_offset: F32  # [4] along the normal, along the light, 1 where there is a shadow map, 0

    @staticmethod
    def of(arrays: Mapping[str, npt.NDArray[Any]]) -> LightArrays:
        """The arrays that a stage takes, by the names of the frame's values; zeros for those that are not given."""
        shapes = {
            "ambient": (AMBIENT_TERMS, 4),
            "place": (MOST_LIGHTS, 4),
            "colour": (MOST_LIGHTS, 4),
            "turn": (3, 4),
        }
        given = {name: arrays.get(f"light_{name}", np.zeros(s, np.float32)) for name, s in shapes.items()}
        for name, shape in (("shadow_row", (4, 4)), ("shadow_offset", (4,))):
            given[name] = arrays.get(name, np.zeros(shape, np.float32))
        return LightArrays(**given)


def light_arrays(
    light: Light, relight: Relight, world_from_avatar: F64, head: F32 | None = None
) -> LightArrays:
    """The numbers of `light` for an avatar that stands at `world_from_avatar` [4, 4].

    head [4, 4]: the skin matrix of `head_joint`, if there is one.
    """
    ambient, place, colour = (np.zeros((n, 4), np.float32) for n in (AMBIENT_TERMS, MOST_LIGHTS, MOST_LIGHTS))
    ambient[:, :3] = light.ambient
    for row, one in enumerate(light.lights):
        at = np.asarray(one.place, np.float64)
        place[row] = (*(at if one.point else at / np.linalg.norm(at)), one.point)
        colour[row, :3] = one.colour
    rows, offset = np.zeros((4, 4), np.float32), np.zeros(4, np.float32)
    if light.shadow and light.lights:
        centre = world_from_avatar[:3, :3] @ relight.centre + world_from_avatar[:3, 3]
        found = shadow_rows(light.lights[0], centre, relight.radius)
        if found is not None:
            texel = 2 * relight.radius / SHADOW_SIZE
            rows, offset = found.astype(np.float32), np.array((*(LAYERS + texel * TEXELS), 1, 0), np.float32)
    turn = np.eye(3)
    if relight.frame == "head":
        turn = world_from_avatar[:3, :3] @ (turn if head is None else head[:3, :3].astype(np.float64))
    return LightArrays(
        ambient, place, colour, np.pad(turn.T, ((0, 0), (0, 1))).astype(np.float32), rows, offset
    )


def shadow_rows(light: DirectLight, centre: F64, radius: float) -> F64 | None:
    """[4, 4] column, row, distance and w of a shadow map from world; None if a point light is within what it lights.

    The map holds the sphere about `centre` [3].
    """
    towards = np.asarray(light.place, np.float64) - (centre if light.point else 0)
    distance = float(np.linalg.norm(towards))
    if light.point and distance <= 1.05 * radius:
        return None
    axis = towards / distance
    up = np.array((0.0, 1, 0) if abs(axis[1]) < 0.9 else (1.0, 0, 0))
    across = np.cross(up, axis)
    across /= np.linalg.norm(across)
    down = np.cross(across, axis)
    rows = np.zeros((4, 4))
    middle = SHADOW_SIZE / 2 - 0.5
    if light.point:
        eye = np.asarray(light.place, np.float64)
        rows[3] = (*-axis, axis @ eye)
        rows[2] = rows[3]
        scale = SHADOW_SIZE / 2 * np.sqrt(distance**2 - radius**2) / radius
        for row, along in enumerate((across, down)):
            rows[row] = scale * np.array((*along, -along @ eye)) + middle * rows[3]
        return rows
    rows[3, 3] = 1
    rows[2] = (*-axis, axis @ centre + radius)
    scale = SHADOW_SIZE / (2 * radius)
    for row, along in enumerate((across, down)):
        rows[row] = (*(scale * along), middle - scale * (along @ centre))
    return rows


def turned(avatar: Avatar) -> bool:
    """Whether normals turn with the triangles of the mesh: joints alone turn the Gaussians, and not expressions."""
    return avatar.embedding is not None and avatar.rules.rotation in RIGGED_ROTATIONS


def head_joint(avatar: Avatar) -> int | None:
    """The joint that the light of the capture follows; None: it follows the avatar as a whole, or the world."""
    relight, rig = avatar.relight, avatar.rig
    if relight is None or rig is None or relight.frame != "head" or relight.joint is None:
        return None
    return rig.joint_names.index(relight.joint)


def sh_bases(direction: F64) -> F64:
    """[..., 9] the SH bases of unit vectors [..., 3], as colours have them."""
    x, y, z = np.moveaxis(np.asarray(direction, np.float64), -1, 0)
    c0, c1, c2 = (constants()[name] for name in ("sh_c0", "sh_c1", "sh_c2"))
    terms = (
        c0[0] * np.ones_like(x),
        *(c * v for c, v in zip(c1, (y, z, x), strict=True)),
        *(
            c * v
            for c, v in zip(c2, (x * y, y * z, 2 * z * z - x * x - y * y, x * z, x * x - y * y), strict=True)
        ),
    )
    return np.stack(terms, axis=-1)


def even(colour: tuple[float, float, float]) -> F32:
    """[9, 3] the ambient light that is `colour` from all sides."""
    rows = np.zeros((AMBIENT_TERMS, 3), np.float32)
    rows[0] = np.asarray(colour) / constants()["sh_c0"][0]
    return rows


def ambient_of(light: Light) -> F32:
    """[9, 3] the whole light as ambient light: those from one direction lose their edge, points are not taken.

    Raises ValueError for a point light.
    """
    rows = light.ambient.astype(np.float64)
    for one in light.lights:
        if one.point:
            raise ValueError("a point light is no light of a capture; give its direction")
        at = np.asarray(one.place, np.float64)
        rows += np.outer(np.pi * COSINE * sh_bases(at / np.linalg.norm(at)), one.colour)
    return rows.astype(np.float32)


def light_of(said: Any, file: str | None = None) -> Light:
    """The light that a JSON document says (SPEC.md, section 19). Raises AvatarError that names the field."""
    if not isinstance(said, Mapping):
        raise AvatarError("is no JSON object with a light", file=file)
    lights = said.get("lights", [])
    if not isinstance(lights, list) or len(lights) > MOST_LIGHTS:
        raise AvatarError(f"is no list of up to {MOST_LIGHTS} lights", file=file, field="lights")
    unknown = sorted(said.keys() - {"ambient", "lights", "shadow", "frame", "name"})
    if unknown:
        raise AvatarError(
            "is not known; a light has ambient, lights and shadow", file=file, field=str(unknown[0])[:80]
        )
    shadow = said.get("shadow", False)
    if not isinstance(shadow, bool):
        raise AvatarError("is neither true nor false", file=file, field="shadow")
    found = tuple(_direct(one, f"lights[{k}]", file) for k, one in enumerate(lights))
    return Light(_ambient(said.get("ambient", [0, 0, 0]), file), found, shadow)


def said_light(light: Light) -> dict[str, Any]:
    """What `light_of` reads."""
    lights = [
        {
            "position" if one.point else "direction": [float(v) for v in one.place],
            "colour": [float(v) for v in one.colour],
        }
        for one in light.lights
    ]
    return {"ambient": light.ambient.tolist(), "lights": lights, "shadow": light.shadow}


def _ambient(said: Any, file: str | None) -> F32:
    if isinstance(said, list) and len(said) == AMBIENT_TERMS:
        return np.array([_three(row, f"ambient[{k}]", file) for k, row in enumerate(said)], np.float32)
    if isinstance(said, list) and len(said) == 3:
        return even(_three(said, "ambient", file))
    raise AvatarError("is neither a colour nor nine rows of one", file=file, field="ambient")


def _direct(said: Any, field: str, file: str | None) -> DirectLight:
    keys = set(said) if isinstance(said, Mapping) else set()
    if keys not in ({"direction", "colour"}, {"position", "colour"}):
        raise AvatarError("needs a direction or a position, and a colour", file=file, field=field)
    point = "position" in keys
    name = "position" if point else "direction"
    place = _three(said[name], f"{field}.{name}", file)
    colour = _three(said["colour"], f"{field}.colour", file)
    if min(colour) < 0 or max(colour) > LARGEST:
        raise AvatarError(f"is not within 0 and {LARGEST:g}", file=file, field=f"{field}.colour")
    if not point and not has_length(place):
        raise AvatarError("has no length", file=file, field=f"{field}.{name}")
    return DirectLight(place, colour, point)


def _three(said: Any, field: str, file: str | None) -> tuple[float, float, float]:
    sound = isinstance(said, list) and len(said) == 3
    if not sound or not all(
        isinstance(v, int | float) and not isinstance(v, bool) and abs(v) <= FURTHEST for v in said
    ):
        raise AvatarError("is not three numbers of at most 1e9", file=file, field=field)
    return float(said[0]), float(said[1]), float(said[2])
