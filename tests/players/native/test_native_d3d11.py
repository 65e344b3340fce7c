"""The native player on Direct3D 11: Microsoft's compiler of shaders, and Wine's Direct3D. `make test` plays one avatar.

test_native_gles, test_native_samples and test_native_play ask d3d11 what they ask OpenGL.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from bench.pack_avatars import AVATARS as TRAINED

from avatar_export.measure.poses import poses
from avatar_export.measure.views import views
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from tests.conformance.avatars import AVATARS
from tests.conformance.faults import FAULTS, FaultyShaders
from tests.exporter.packing.cases import levels_of
from tests.measured import Measure
from tests.players.native import windows
from tests.players.native.gles import Job, desk_program, play_program, run_gl
from tests.players.native.test_native_gles import BYTE, IMAGE_LIMIT, off
from tests.players.native.test_native_play import recording
from tests.players.played_cases import HEAD, image_of, played_cases
from tests.players.test_web_samples import SAMPLES
from tests.runtime.backends import gl_cases

NO_COMPILER = "mscoree,mshtml=;d3dcompiler_47="
WINES_COMPILER = "mscoree,mshtml=;d3dcompiler_47=b"
MOST_CPU_S = 15


def begun(folder: Path) -> Job:
    job = Job(folder)
    job.say("begin", "d3d11")
    job.camera(gl_cases.camera())
    return job


def test_an_avatar_repeats_its_reference_and_looks_as_by_backend_gl(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, measured: Measure
) -> None:
    case = played_cases(tmp_path_factory)["full"]
    job, program = begun(tmp_path), desk_program("d3d11")
    job.add(case.folder / HEAD, case.avatar, gl_cases.pose_of(case.avatar))
    job.draw("seen")
    job.say("conform", case.folder, "cases")
    job.say("end")
    said = job.run(program)
    assert ["compiler", wine_path(program.with_name("d3dcompiler_47.dll"))] in said  # not Wine's
    assert ["passed", "1"] in said and ["left", "0"] in said
    apart = off(job.image("seen"), image_of(case.avatar), IMAGE_LIMIT)
    measured("native d3d11, image, share of the tolerance", apart, 1)
    measured("native d3d11, CPU seconds of Wine", windows.cpu_seconds[-1], MOST_CPU_S)
    assert apart <= 1 and windows.cpu_seconds[-1] < MOST_CPU_S


def wine_path(path: Path) -> str:
    return windows.wine.windows_path(path)


@pytest.mark.players
def test_every_stage_of_the_kit_passes_and_planted_faults_fail(kit: Path, tmp_path: Path) -> None:
    job = begun(tmp_path)
    for name in AVATARS:
        for cases in ("cases", "driving"):
            if (kit / name / f"{cases}.json").exists():
                job.say("conform", kit / name, cases)
    for fault in FAULTS:
        job.say("end")
        FaultyShaders(fault, tmp_path / fault.name)
        job.say("alter", tmp_path / fault.name)
        job.say("begin", "d3d11")
        job.say("conform", kit / fault.avatar, "cases")
    runs: list[list[list[str]]] = [[]]
    for line in job.run(desk_program("d3d11")):
        if line[0] == "compiler":
            runs.append([])
        if line[0] == "row":
            runs[-1].append(line)
    sound, *broken = runs[1:]
    stages = {"driving", "joints", "morph", "skin", "blend", "bind", "activate", "project", "sort", "raster"}
    stages |= {"shadow", "light"}
    assert stages <= {row[2] for row in sound} and not [row for row in sound if row[-1] != "1"]
    failed = [{row[2] for row in rows if row[-1] != "1"} for rows in broken]
    assert dict(zip([one.name for one in FAULTS], failed, strict=True)) == {
        one.name: {*one.stages} for one in FAULTS
    }


@pytest.mark.players
def test_other_compilers_are_refused(tmp_path: Path) -> None:
    """Wine's own, which has the same name, and none."""
    job, program = begun(tmp_path), desk_program("d3d11")
    alone = tmp_path / program.name
    shutil.copyfile(program, alone)
    (tmp_path / "job.txt").write_text("\n".join(job.lines))
    for overrides, words in ((WINES_COMPILER, "is not Microsoft's"), (NO_COMPILER, "there is no compiler")):
        done = windows.run_windows(alone, [str(tmp_path / "job.txt")], overrides)
        assert done.returncode == 3
        assert words in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr


@pytest.mark.players
def test_a_hundred_devices_and_a_thousand_loads(tmp_path: Path, kit: Path) -> None:
    full = gl_cases.avatars()["full"]
    file = tmp_path / HEAD
    file.write_bytes(pack([full], Fineness()).file)
    job = begun(tmp_path)
    job.add(file, full, gl_cases.pose_of(full))
    job.draw("before")
    job.say("lose", 100)
    job.draw("after")
    job.say("loads", 1000, file)
    job.say("end")
    said = job.run(desk_program("d3d11"))
    np.testing.assert_array_equal(job.image("after"), job.image("before"))
    (grown,) = (int(line[1]) for line in said if line[0] == "loads")
    assert grown < 250 and ["left", "0"] in said  # pages in 250 loads


@pytest.mark.players
def test_avatar_play_takes_names_as_windows_has_them(tmp_path: Path) -> None:
    """Spaces, umlauts, paths beyond 260 letters, and a recording with CR LF; what is wrong is said in one line."""
    odd, far = tmp_path / "f\u00fcr J\u00f6rg & \u4eba", tmp_path / "/".join(["x" * 100] * 3)
    for folder in (odd, far):
        folder.mkdir(parents=True)
        (folder / HEAD).write_bytes(pack([gl_cases.avatars()["full"]], Fineness()).file)
    take = odd / "take 1.csv"
    take.write_bytes(recording().replace(b"\n", b"\r\n"))
    small = ["--size", "64x48", "-o"]
    for words, out in (
        ([str(odd / HEAD), "--recording", str(take), *small], odd / "\u00e9.png"),
        ([windows.wine.windows_path(far / HEAD), *small], far / "frame.png"),
    ):
        done = run_gl(play_program("d3d11"), [*words, str(out)])
        assert done.returncode == 0, done.stderr
        assert np.asarray(PIL.Image.open(out)).shape == (48, 64, 4)
    for words, said in (
        ([str(odd / "no.avatar")], f"{odd / 'no.avatar'}: cannot be read"),
        ([str(odd / HEAD), "--api", "es"], "--api es: this avatar_play was built without it"),
        ([str(odd / HEAD), "--window"], "--window: not together with --api d3d11"),
        ([str(odd / HEAD), "--size", "20000x1"], "20000x1 pixels; Direct3D 11 draws 1x1 to 16384x16384"),
        ([str(odd / HEAD), *small, str(odd / "no" / "frame.png")], "frame.png: cannot be written"),
    ):
        done = run_gl(play_program("d3d11"), words)
        assert done.returncode == 2 and done.stderr.splitlines()[0].endswith(said), (words, done.stderr)


@pytest.mark.players
def test_avatar_play_refuses_every_hostile_pack(unity_cases: Path, tmp_path: Path) -> None:
    """One process a file, one after the other in one start of Wine."""
    told = json.loads((unity_cases / "hostile" / "hostile.json").read_text())
    program = windows.wine.windows_path(play_program("d3d11"))
    lines = ["@echo off\r\n"]
    for one in told:
        file = windows.wine.windows_path(unity_cases / "hostile" / one["file"])
        lines.append(f'"{program}" "{file}" 2>&1\r\necho code %errorlevel%\r\n')
    batch = tmp_path / "all.bat"
    batch.write_text("".join(lines))
    done = run_gl(Path("cmd.exe"), ["/c", windows.wine.windows_path(batch)])
    said = done.stdout.split("code 2\n")
    assert len(said) == len(told) + 1 > 100 and said[-1] == "", done.stdout[-2000:]
    for one, line in zip(told, said, strict=False):
        assert line.count("\n") == 1 and one["file"] in line and "Direct3D" not in line, (one["what"], line)


@pytest.mark.players
@pytest.mark.parametrize("sample", SAMPLES)
def test_every_pixel_of_a_sample(sample: str, tmp_path: Path, measured: Measure) -> None:
    """20 poses, 3 cameras, levels 0 to 2."""
    source = with_active_sh(TRAINED[sample].load(tmp_path))
    levels = [source, levels_of(source)[1], levels_of(levels_of(source)[1])[1]]
    file = tmp_path / HEAD
    file.write_bytes(pack(levels, Fineness()).file)
    shown = poses(source)
    chosen = [shown[i * len(shown) // 20].pose for i in range(20)]
    cameras = [seen.camera for seen in views(source, 256, shown)][:3]
    avatar = decode_pack(file.read_bytes(), HEAD).avatar
    job = Job(tmp_path)
    job.say("begin", "d3d11")
    for level in range(3):
        job.add(file, avatar, chosen[0], level)
        for p, pose in enumerate(chosen):
            job.say("pose", 0, job.pose(avatar, pose))
            for c, camera in enumerate(cameras):
                job.camera(camera)
                job.draw(f"{level}_{p}_{c}")
        job.say("clear")
    job.say("end")
    job.run(desk_program("d3d11"))
    worst = 0.0
    for level in range(3):
        player = Player(avatar, "gl", level=level, target="rgba32f")
        for p, pose in enumerate(chosen):
            for c, camera in enumerate(cameras):
                image = player.frame(pose, camera, (0.0, 0.0, 0.0)).image
                want = np.dstack([image.colour, 1 - image.transmittance])
                worst = max(worst, float(np.abs(job.image(f"{level}_{p}_{c}") - want).max()))
    measured("native d3d11, image of a sample in every pose", worst, BYTE)
    assert worst <= BYTE
