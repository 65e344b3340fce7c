"""Whether this tree writes the same bytes as an older commit.

    python -m tests.bench.bundle_bytes OUT --against REVISION

The samples of every system are made once, by the old commit. Both trees convert them, each with its own code and this
interpreter, and every file of every bundle is compared. Texts that name the version are compared as they stand, so
the version must be the same in both.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE_ROOTS = ("schema", "engine_shaders", "runtime", "exporter", "trainer", ".")
GAUSSIAN_AVATARS = """
import sys
from pathlib import Path
sys.path.insert(0, ".")
try:
    from tests.exporter.readers import splatting_files as files
except ImportError:
    from tests.exporter import splatting_files as files
out = Path(sys.argv[1])
files.write_gaussian_run(out / "subject", files.arrays(degree=3))
(out / "mesh.obj").write_text(files.obj_text(files.VERTICES * 2))
"""
SAMPLES: dict[str, tuple[str, ...]] = {  # folder: what follows `python` in the old tree, OUT appended
    "plain": ("-m", "samples.make", "--gaussians", "3000"),
    "full": ("-m", "samples.make", "--full", "--form", "both"),
    "gaussian_avatars": ("-c", GAUSSIAN_AVATARS),
}


def conversions(made: Path, trained: Path) -> dict[str, list[str]]:
    """Bundle name -> arguments of `convert`; {} stand for nothing, paths are absolute."""
    plain, full = made / "plain", made / "full"
    head, body = plain / "splatting_avatar" / "head", plain / "splatting_avatar" / "body"
    fitted = full / "splatting_avatar" / "head"
    both = full / "gaussian_blendshapes"
    return {
        "blendshapes": [f"{plain}/gaussian_blendshapes/model", "--dataset", f"{plain}/gaussian_blendshapes"],
        "blendshapes_full": [f"{both}/model", "--dataset", str(both), "--driving", f"{both}/driving.json"],
        "blendshapes_no_rig": [f"{both}/model", "--no-rig"],
        "lam": [f"{plain}/lam/head.zip" if (plain / "lam" / "head.zip").exists() else str(_only(plain / "lam"))],
        "splatting_head": [
            f"{head}/run", "--body-model", f"{head}/body/body_model.npz", "--poses", f"{head}/flame_params.json",
            "--driving", f"{head}/driving.json",
        ],
        "splatting_head_sh3": [
            f"{fitted}/run", "--body-model", f"{fitted}/body/body_model.npz",
            "--poses", f"{fitted}/flame_params.json",
        ],
        "splatting_body": [f"{body}/run", "--rig", f"{body}/CesiumMan.glb"],
        "splatting_body_left": [f"{body}/run", "--rig", f"{body}/CesiumMan.glb", "--handedness", "left"],
        "splatting_body_unrigged": [f"{body}/run"],
        "gaussian_avatars": [
            f"{made}/gaussian_avatars/subject", "--mesh", f"{made}/gaussian_avatars/mesh.obj",
        ],
        "asm": [f"{trained}/head_bones.npz"],
        **{
            f"trained_{name}": [f"{trained}/{name}"]
            for name in ("head_blendshapes", "head_splatting", "body_splatting", "head_points")
        },
    }  # fmt: skip


def _only(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


def run(tree: Path, *arguments: str) -> None:
    """Run this interpreter in a tree, with that tree's packages."""
    path = os.pathsep.join(str(tree / root) for root in SOURCE_ROOTS)
    environment = {**os.environ, "PYTHONPATH": path}
    subprocess.run(
        [sys.executable, *arguments], cwd=tree, env=environment, check=True, stdout=subprocess.DEVNULL
    )


def digests(folder: Path) -> dict[str, str]:
    """File below a folder -> sha256 of its bytes."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def main() -> int:
    """Make, convert twice, compare; 1 if any byte differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bundle_bytes", description=__doc__)
    parser.add_argument("out", type=Path, help="an empty folder to work in")
    parser.add_argument("--against", required=True, help="the older commit")
    args = parser.parse_args()
    out: Path = args.out.resolve()
    old, made = out / "old_tree", out / "samples"
    out.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        ["git", "-C", str(ROOT), "worktree", "add", "--detach", "-f", str(old), args.against], check=True
    )
    try:
        for name, command in SAMPLES.items():
            run(old, *command, str(made / name))
        different = 0
        for name, arguments in conversions(made, old / "samples" / "trained").items():
            found = []
            for tree, label in ((old, "old"), (ROOT, "new")):
                run(tree, "-m", "avatar_export", "convert", *arguments, "-o", str(out / label / name))
                found.append(digests(out / label / name))
            apart = [file for file in {**found[0], **found[1]} if found[0].get(file) != found[1].get(file)]
            different += len(apart)
            verdict = "DIFFERENT " + ", ".join(apart) if apart else "equal"
            print(f"{name}: {len(found[1])} files, {verdict}", flush=True)
    finally:
        subprocess.run(["git", "-C", str(ROOT), "worktree", "remove", "--force", str(old)], check=True)
    print(f"{different} files differ from {args.against}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
