"""The web player against the runtime: every stage against the vectors, every image against backend `gl`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_export.packing.reference import MINI
from avatar_export.packing.write import Prepared, pack, write
from avatar_export.version import GENERATOR
from avatar_export.writers.reference_cases import reference_cases
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.conformance import RUNTIME, encode, make_reference
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.subset import subset
from tests.exporter.packing.cases import COARSE
from tests.measured import Measure
from tests.players.web import BACKENDS, Answer, Job, ask, shot
from tests.runtime.backends import gl_cases

IMAGE_LIMIT = 1 / 255
CASES = ("posed", "close")


def address(name: str) -> str:
    return "/" + name.replace(" ", "_")


def image_of(avatar: Avatar) -> F32:
    """[H, W, 4] premultiplied colour over black and alpha, by backend `gl`."""
    player = Player(avatar, "gl", target="rgba32f")
    frame = player.frame(gl_cases.pose_of(avatar), gl_cases.camera(), (0.0, 0.0, 0.0))
    return np.dstack([frame.image.colour, 1 - frame.image.transmittance])


def vectors(avatar: Avatar) -> dict[str, bytes]:
    """The files of a reference that a player needs, of the cases that pose everything; no images, which take time."""
    cases = [replace(case, images=False) for case in reference_cases(avatar) if case.name in CASES]
    reference = make_reference(avatar, cases, generator=GENERATOR, maker=RUNTIME)
    part = subset(avatar, reference.rows, reference.vertices).avatar
    assert part.packed is not None
    return {**encode(reference), MINI: write(Prepared((part,), part.packed.program, False)).file}


def test_all_stages_and_images_of_all_avatars(tmp_path: Path, measured: Measure) -> None:
    """One test, because it takes one browser: stages within the kit's tolerances, images as backend `gl` draws them."""
    job, expected = Job(), {}
    for name, source in gl_cases.avatars().items():
        file = pack([source], COARSE).file
        avatar = decode_pack(file, name).avatar
        path = tmp_path / address(name)[1:]
        path.mkdir()
        for part, data in {"head.avatar": file, **vectors(avatar)}.items():
            (path / part).write_bytes(data)
            job.files[f"{address(name)}/{part}"] = str(path / part)
        job.references.append(address(name))
        posed = [(f"{address(name)}/head.avatar", avatar, gl_cases.pose_of(avatar))]
        job.shots.append(shot(address(name)[1:], posed, gl_cases.camera()))
        expected[name] = image_of(avatar)
    answer = ask(job, tmp_path)
    for backend in BACKENDS:
        assert not wrong_stages(answer, backend, measured)
        assert not wrong_images(answer, backend, expected, measured)


def wrong_stages(answer: Answer, backend: str, measured: Measure) -> list[str]:
    """Outputs beyond their tolerance."""
    wrong, used = [], 0.0
    for name in gl_cases.avatars():
        rows = answer.reports[backend, address(name)]["rows"]
        assert rows, name
        wrong += [f"{name}: {r['case']}/{r['stage']}/{r['output']}" for r in rows if not r["passed"]]
        used = max(used, *(r["used"] for r in rows))
    measured(f"web {backend}, stages, share of the tolerance", used, 1)
    return wrong


def wrong_images(
    answer: Answer, backend: str, expected: Mapping[str, F32], measured: Measure
) -> dict[str, float]:
    """Images too far from those of `gl`."""
    apart = {}
    for name, want in expected.items():
        image = answer.images[backend, address(name)[1:]]
        assert image[..., 3].max() > 0.5, name
        apart[name] = float(np.abs(image - want).max())
    measured(f"web {backend}, image", max(apart.values()), IMAGE_LIMIT)
    return {name: value for name, value in apart.items() if value > IMAGE_LIMIT}
