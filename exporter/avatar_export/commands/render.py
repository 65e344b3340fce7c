"""`avatar-export render`: a bundle in, images out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages, output, tell
from avatar_export.commands.declared import command
from avatar_export.options import Options, option
from avatar_export.playing import frames as playing
from avatar_export.playing import sequences
from avatar_export.playing.lights import scene_light
from avatar_export.playing.tracked import seen_by, tracked
from avatar_export.readers.table import expect_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import BACKENDS
from avatar_runtime.bundle import load, warnings
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import at_level
from avatar_runtime.pose import Pose
from avatar_runtime.stages.raster import PROFILES


@dataclass(frozen=True)
class Motion(Options):
    """A sequence, and the frames of it that are drawn."""

    drive: Path | None = option(
        None,
        "Recording to play: Live Link Face CSV or UDP packets, or weights over time as JSON (also Audio2Face and LAM).",
    )
    clip: str | None = option(
        None,
        "Clip to play: the name of a clip of the bundle; BUNDLE:NAME, a clip of another avatar with the "
        "same expressions or ARKit's; or a .glb, .fbx, LAM zip or pose file.",
        metavar="NAME|BUNDLE:NAME|FILE",
    )
    clip_name: str | None = option(None, "Name of the clip in the FILE of --clip. Default: the first.")
    meshes: tuple[Path, ...] = option(
        (),
        "Posed meshes, for Gaussians bound to a surface: an .npz with vertices [frames, V, 3], a folder of "
        ".obj files in the order of their names, or one .obj each time the option is given.",
    )
    mesh_units: float | None = option(
        None, "Units of --meshes per metre. Default: the avatar's training units.", least=1e-6, most=1e6
    )
    idle: float | None = option(
        None,
        "Seconds in which the avatar only breathes, blinks and looks about. For avatars that ARKit drives.",
        least=0.04,
        most=3600,
    )
    seed: int = option(0, "Persons of different seeds blink and look at different times, for --idle.")
    every: int = option(1, "Take every N-th frame of the sequence, or of --frames.", least=1)
    frames: str | None = option(None, "Take the frames FIRST:END of the sequence, as it is stored.")
    fps: float = option(
        30.0, "Frames per second of --idle, --meshes and --orbit. Clips have their own.", least=0.1, most=240
    )

    @property
    def sources(self) -> dict[str, object]:
        """The options that say what moves, of which one may be given."""
        return {"--drive": self.drive, "--clip": self.clip, "--meshes": self.meshes, "--idle": self.idle}

    def of(self, avatar: Avatar, pose: Pose, turntable: bool) -> sequences.PoseSequence:
        """The whole sequence; of a single `pose` a turntable or one image. Raises AvatarError."""
        if self.drive is not None:
            return sequences.recorded(avatar, self.drive)
        if self.clip is not None:
            return sequences.clip(avatar, self.clip, self.clip_name)
        if self.idle is not None:
            return sequences.idle(avatar, self.idle, self.seed, self.fps)
        if self.meshes:
            return sequences.meshes(avatar, self.meshes, self.mesh_units, self.fps)
        return sequences.turntable(pose, self.fps) if turntable else sequences.PoseSequence([pose], self.fps)


@dataclass(frozen=True)
class Shot(Options):
    """Where the camera stands, what is behind the avatar, and what lights it."""

    camera: Path | None = option(
        None,
        "Tracked cameras: a capture's folder, or its capture.json, transforms.json, flame_params.json or "
        ".frame file. One for each pose, or one for all; a single pose is seen by each.",
    )
    camera_frames: str | None = option(None, "Take the cameras FIRST:END of --camera, counted from 0.")
    size: str | None = option(None, "Size in pixels, N or WxH. Default: 512; with --camera, as tracked.")
    yaw: float = option(0.0, "Camera yaw in degrees. Positive: from the subject's left.")
    pitch: float = option(0.0, "Camera pitch in degrees. Positive: from above.")
    zoom: float = option(1.0, "Camera zoom. 1 shows the whole avatar.", least=0.01)
    orbit: float = option(
        0.0, "Degrees that the camera orbits over the sequence. A single pose becomes a turntable."
    )
    background: str | None = option(
        None, "R,G,B from 0 to 1, or `transparent`. Default: the training background."
    )
    light: str | None = option(
        None,
        "Light of the scene, for an avatar made with --relight: studio, left or rim, a JSON file, or an environment "
        "map .hdr. Default: that of the capture.",
        metavar="NAME|FILE",
    )

    def view(self) -> playing.View:
        """The view, without tracked cameras. Raises a usage error; AvatarError for what is no light."""
        return playing.View(
            *arguments.size(self.size or "512"),
            self.yaw,
            self.pitch,
            self.zoom,
            self.orbit,
            arguments.background(self.background),
            self.background == "transparent",
            light=None if self.light is None else scene_light(self.light),
        )

    def tracked(
        self, shown: sequences.PoseSequence, view: playing.View, every: int
    ) -> tuple[sequences.PoseSequence, playing.View]:
        """`shown` and `view` as the cameras of --camera see it; as they are without. Raises AvatarError."""
        if self.camera is None:
            return shown, view
        asked = None if self.size is None else (view.width, view.height)
        cameras = tracked(self.camera, asked, arguments.frame_slice(self.camera_frames, "--camera-frames"))
        first = cameras[0]
        seen = replace(view, width=first.width, height=first.height, cameras=cameras[::every])
        return seen_by(shown, cameras, self.camera), seen


@command
def render(
    bundle: arguments.Bundle,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="FILE.png, FILE.webp (animated), or a folder for PNG files.")
    ],
    posed: arguments.Posed,
    motion: Motion,
    shot: Shot,
    profile: Annotated[
        str | None,
        typer.Option(help=f"Raster profile: {' or '.join(PROFILES)}. Default: the backend's first."),
    ] = None,
    backend: arguments.Backend = None,
    level: Annotated[int, typer.Option(help="Level of detail of a pack, 0 the finest.", min=0)] = 0,
    enhance: Annotated[
        bool, typer.Option("--enhance", help="Run the avatar's enhancer on each image.")
    ] = False,
    force: arguments.Force = False,
) -> None:
    """Draw a bundle or a pack: one pose, a recording, a clip, posed meshes, or the avatar when it is idle."""
    arguments.one_of("--profile", profile, PROFILES)
    arguments.one_of("--backend", backend, BACKENDS)
    _expect_one_meaning(posed, motion, shot)
    view = replace(shot.view(), profile=profile, backend=backend, enhance=enhance)
    with Steps() as step:
        step("loading")
        expect_bundle(bundle)
        avatar = at_level(load(bundle), level)
        sequence = motion.of(avatar, posed.pose(avatar), shot.orbit != 0 and out.suffix != ".png")
        part = sequence.part(arguments.frame_slice(motion.frames))
        shown, view = shot.tracked(part, view, motion.every)
        shown = shown.part(slice(None, None, motion.every))
        count = len(shown.poses)
        if not count:
            raise AvatarError(
                f"{motion.frames} holds no frame; the sequence has {len(sequence.poses)}", field="--frames"
            )
        images = playing.frames(avatar, shown, view)
        playing.save(out, images, count, shown.fps, force, lambda i: step(f"frame {i} of {count}"))
    for problem in warnings(bundle):
        messages.print(f"note: {problem}")
    tell([*posed.notes(avatar), *sequence.notes])
    output.print(f"{out}: {count} image{'s' * (count > 1)} of {view.width}x{view.height}")


def _expect_one_meaning(posed: arguments.Posed, motion: Motion, shot: Shot) -> None:
    """Raise a usage error for options that contradict each other, or lack the one that they belong to."""
    if motion.clip_name is not None and (motion.clip is None or not Path(motion.clip).exists()):
        raise typer.BadParameter("needs --clip FILE", param_hint="--clip-name")
    arguments.exclude({**motion.sources, "a pose (-e, -a, -j, --eyelid)": posed.given})
    placed = (shot.yaw, shot.pitch, shot.zoom, shot.orbit) != (0, 0, 1, 0)
    arguments.exclude({"--camera": shot.camera, "--yaw, --pitch, --zoom, --orbit": placed})
    if shot.camera is None and shot.camera_frames is not None:
        raise typer.BadParameter("needs --camera", param_hint="--camera-frames")
    if not any(motion.sources.values()) and shot.orbit == 0 and motion.frames is not None:
        raise typer.BadParameter(
            "goes with --drive, --clip, --idle, --meshes or --orbit; without them there is one image",
            param_hint="--frames",
        )
