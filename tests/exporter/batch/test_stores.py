"""Rows that are read from object stores and written to them: a real S3 server, one that fails, and fsspec's memory."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fsspec import AbstractFileSystem
from fsspec.core import url_to_fs
from fsspec.implementations.memory import MemoryFileSystem
from s3fs import S3FileSystem

from avatar_export.asm.files import save
from avatar_export.batch import stores
from avatar_export.batch.failures import StoreError
from avatar_export.batch.job import Job
from avatar_export.batch.locations import cleaned
from avatar_export.batch.row import do, input_files, is_finished
from avatar_export.conversion import convert
from avatar_export.convert_options import ConvertOptions
from avatar_runtime.bundle import load
from avatar_runtime.io.errors import AvatarError
from tests.asm_faces import small_face
from tests.exporter.batch.s3_server import BUCKET, SECRET, Proxy, proxied, store_server
from tests.exporter.readers import splatting_files

QUICK: dict[str, Any] = {"preview": False, "engine_files": False, "reference": False}
Files = dict[str, bytes]


@pytest.fixture(scope="module")
def proxy() -> Iterator[Proxy]:
    with store_server() as port, pytest.MonkeyPatch.context() as patch, proxied(port, patch) as proxy:
        yield proxy


@pytest.fixture
def s3(proxy: Proxy) -> Iterator[Proxy]:
    """An empty bucket behind a proxy that passes everything on."""
    proxy.seen.clear()
    yield proxy
    proxy.answer = proxy.afterwards = lambda method, path: None
    store = S3FileSystem(use_listings_cache=False)
    left = store.find(BUCKET)
    if left:
        store.rm(left)


@pytest.fixture
def memory() -> Iterator[MemoryFileSystem]:
    store = MemoryFileSystem()
    yield store
    store.store.clear()
    store.pseudo_dirs[:] = [""]


@pytest.fixture(scope="module")
def face(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("face") / "face.npz"
    save(small_face(), path)
    return path


@pytest.fixture(scope="module")
def converted(face: Path, tmp_path_factory: pytest.TempPathFactory) -> Files:
    """The bundle that `convert` makes of it, by path."""
    out = tmp_path_factory.mktemp("converted") / "one"
    convert(face, out, ConvertOptions(**QUICK))
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}


def below(location: str) -> Files:
    """Bytes of all files below a location, by path."""
    store, path = url_to_fs(location, use_listings_cache=False)
    return {name.strip("/")[len(path.strip("/")) + 1 :]: store.cat_file(name) for name in store.find(path)}


def row_in(base: str, face: Path) -> Job:
    """A row from and to a store."""
    store: AbstractFileSystem
    store, path = url_to_fs(f"{base}/in/face.npz")
    store.pipe_file(path, face.read_bytes())
    return Job("one", f"{base}/in/face.npz", f"{base}/out/one", QUICK)


def test_a_row_from_and_to_s3(s3: Proxy, face: Path, converted: Files, tmp_path: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    result = do(job, "first")
    assert (result.state, result.output) == ("done", f"s3://{BUCKET}/out/one")
    files = below(job.output)
    record = json.loads(files.pop("result.json"))
    key = record["folder"]
    assert key.startswith("first-")
    assert files == {f"{key}/one/{name}": data for name, data in converted.items()}
    written = [path.rpartition("/")[2] for method, path in s3.seen if method == "PUT"]
    assert written[-2:] == ["avatar.json", "result.json"]
    assert do(job, "second").state == "kept"
    assert below(job.output).keys() == {*files, "result.json"}
    S3FileSystem().get(f"{BUCKET}/out/one/{key}/one", str(tmp_path / "copied"), recursive=True)
    assert load(tmp_path / "copied").gaussians.count > 0
    assert SECRET not in json.dumps([record, result.as_json()])


def test_a_file_that_was_stored_again_is_hashed(s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    assert do(job, "a").state == "done"
    S3FileSystem().pipe_file(f"{BUCKET}/in/face.npz", face.read_bytes(), Metadata={"by": "another"})
    assert do(job, "a").state == "kept"
    S3FileSystem().pipe_file(f"{BUCKET}/in/face.npz", face.read_bytes()[:-1] + b"x")
    assert is_finished(job) is None


def test_a_store_that_answers_500_now_and_then(
    s3: Proxy, face: Path, converted: Files, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "3")
    S3FileSystem.clear_instance_cache()
    s3.seen.clear()
    s3.answer = lambda method, path: 500 if len(s3.seen) % 7 == 0 else None
    result = do(job, "a")
    assert (result.state, len(s3.seen) > 7) == ("done", True), result.message
    s3.answer = lambda method, path: None
    bundle = {name.partition("/one/")[2]: data for name, data in below(job.output).items()}
    assert {name: data for name, data in bundle.items() if name} == converted
    S3FileSystem.clear_instance_cache()


@pytest.mark.parametrize("broken", ["face.npz", "gaussians.ply", "result.json"])
def test_a_store_that_answers_500(broken: str, s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    verb = "GET" if broken == "face.npz" else "PUT"
    s3.answer = lambda method, path: 500 if (method, path.endswith(broken)) == (verb, True) else None
    result = do(job, "a")
    assert (result.state, result.kind, result.retryable) == ("failed", "store", True)
    assert "\n" not in result.message and SECRET not in json.dumps(result.as_json())
    assert f"s3://{BUCKET}/" in result.message and "avatar-batch" not in result.message
    left = below(job.output)
    assert left == {} or (broken == "result.json" and "result.json" not in left)
    s3.answer = lambda method, path: None
    assert do(job, "a").state == "done"


def test_the_older_result_stays_when_the_store_fails(s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    assert do(job, "a").state == "done"
    before = below(job.output)
    s3.answer = lambda method, path: 500 if (method, path.endswith("result.json")) == ("PUT", True) else None
    assert do(replace(job, options={**QUICK, "exact": True}), "b").state == "failed"
    after = below(job.output)
    assert {name: after[name] for name in before} == before


def test_a_record_that_was_written_though_the_store_said_no(s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    s3.afterwards = lambda method, path: (
        500 if (method, path.endswith("result.json")) == ("PUT", True) else None
    )
    assert do(job, "a").state == "failed"
    s3.afterwards = lambda method, path: None
    assert do(job, "a").state == "kept"
    assert stores.bundle_of(job.output) is not None


def test_a_store_that_refuses(s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    s3.answer = lambda method, path: 403 if method == "PUT" else None
    result = do(job, "a")
    assert (result.state, result.kind, result.retryable) == ("failed", "access", False)


def test_a_bucket_that_is_not_there(s3: Proxy, face: Path) -> None:
    result = do(Job("one", str(face), "s3://elsewhere/one", QUICK), "a")
    assert (result.kind, result.message) == (
        "output",
        "s3://elsewhere/one: there is no such bucket; make it first",
    )


def test_two_attempts_of_one_name_share_no_key(
    memory: MemoryFileSystem, face: Path, converted: Files
) -> None:
    job = row_in("memory://bucket", face)
    assert do(job, "same").state == "done"
    first = below(job.output)
    assert do(replace(job, options={**QUICK, "name": "Another"}), "same").state == "done"
    second = below(job.output)
    keys = {name.partition("/")[0] for name in second} - {"result.json"}
    assert len(keys) == 2
    assert all(second[name] == data for name, data in first.items() if name != "result.json")


def test_an_output_of_a_batch_is_a_source_of_the_next(
    memory: MemoryFileSystem, face: Path, converted: Files, tmp_path: Path
) -> None:
    job = row_in("memory://bucket", face)
    assert do(job, "a").state == "done"
    again = Job("two", job.output, str(tmp_path / "two"), QUICK)
    assert do(again, "a").state == "done"
    want = converted["gaussians.ply"]
    assert (tmp_path / "two" / "two" / "gaussians.ply").read_bytes() == want


def test_what_is_no_result_is_never_replaced(memory: MemoryFileSystem, face: Path) -> None:
    job = row_in("memory://bucket", face)
    memory.pipe("/bucket/out/one/avatar.json", b"{}")
    result = do(job, "a")
    assert (result.state, result.kind) == ("failed", "output")
    assert below(job.output) == {"avatar.json": b"{}"}


def test_an_error_names_the_url_and_not_its_copy(memory: MemoryFileSystem, face: Path) -> None:
    job = row_in("memory://bucket", face)
    memory.pipe("/bucket/in/face.npz", face.read_bytes()[:2000])
    message = do(job, "a").message
    assert "memory://bucket/in/face.npz" in message and "/tmp" not in message


def test_files_that_options_name_are_fetched(memory: MemoryFileSystem, tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "run", splatting_files.arrays(degree=3))
    mesh = tmp_path / "mesh.obj"
    mesh.write_text(splatting_files.obj_text(splatting_files.VERTICES * 2))
    for file in (mesh, *(path for path in (tmp_path / "run").rglob("*") if path.is_file())):
        memory.pipe(f"/bucket/{file.relative_to(tmp_path).as_posix()}", file.read_bytes())
    local = Job("a", str(tmp_path / "run"), str(tmp_path / "a"), {**QUICK, "mesh": str(mesh)})
    there = {**QUICK, "mesh": "memory://bucket/mesh.obj"}
    stored = Job("a", "memory://bucket/run", "memory://bucket/a", there)
    results = [do(local, "a"), do(stored, "a")]
    assert [result.state for result in results] == ["done", "done"], results
    of_store = {name.partition("/")[2]: data for name, data in below(stored.output).items()}
    of_disk = below(local.output)
    assert {n: d for n, d in of_store.items() if n} == {
        n: d for n, d in of_disk.items() if n != "result.json"
    }


def test_images_of_a_dataset_are_not_fetched(memory: MemoryFileSystem, tmp_path: Path) -> None:
    for name in ("image/0001.PNG", "driving.json", "clip.mp4"):
        memory.pipe(f"/bucket/data/{name}", b"{}")
    job = Job("a", "memory://bucket/data", str(tmp_path), {"dataset": "memory://bucket/data"})
    files = input_files(job)
    assert sorted(files["dataset"]) == ["driving.json"]
    assert sorted(files["source"]) == ["clip.mp4", "driving.json", "image/0001.PNG"]


def test_a_file_of_a_checkpoint_alone_is_refused(memory: MemoryFileSystem, tmp_path: Path) -> None:
    memory.pipe("/bucket/run/point_cloud.ply", b"ply")
    result = do(Job("a", "memory://bucket/run/point_cloud.ply", str(tmp_path / "a")), "a")
    assert result.message == "memory://bucket/run/point_cloud.ply: is one file of several; name its folder"


@pytest.mark.parametrize("name", ["../face.npz", "a/../../face.npz", "/face.npz"])
def test_a_name_that_leads_out_is_refused(name: str, memory: MemoryFileSystem, tmp_path: Path) -> None:
    memory.pipe("/bucket/run/x", b"x")
    with pytest.raises(AvatarError, match="leads out of its folder"):
        stores.fetch("memory://bucket/run", {name: (1, "")}, tmp_path / "work")


def test_links_that_make_a_circle(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text("x")
        for other in ("a", "b", "c"):
            (tmp_path / name / other).symlink_to(tmp_path / other)
    assert len(stores.files_of(str(tmp_path))) == 3


def test_a_file_that_two_inputs_share_is_fetched_once(memory: MemoryFileSystem, tmp_path: Path) -> None:
    memory.pipe("/bucket/data/run/x", b"xyz")
    stores.fetch("memory://bucket/data/run", {"x": (3, "")}, tmp_path)
    memory.pipe("/bucket/data/run/x", b"abc")
    found = stores.fetch("memory://bucket/data", {"run/x": (3, "")}, tmp_path)
    assert (found / "run" / "x").read_bytes() == b"xyz"


def test_a_mark_of_a_folder_is_no_file(s3: Proxy) -> None:
    S3FileSystem().call_s3("put_object", Bucket=BUCKET, Key="run/")
    S3FileSystem().pipe_file(f"{BUCKET}/run/x", b"xyz")
    assert [*stores.files_of(f"s3://{BUCKET}/run")] == ["x"]


def test_a_file_that_changes_while_it_is_read(memory: MemoryFileSystem, tmp_path: Path) -> None:
    memory.pipe("/bucket/run/x", b"xyz")
    with pytest.raises(StoreError, match="changed while it was read"):
        stores.fetch("memory://bucket/run", {"x": (2, "")}, tmp_path)


def test_too_little_room_for_a_copy(memory: MemoryFileSystem, tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="which has") as caught:
        stores.fetch("memory://bucket/run", {"x": (1 << 60, "")}, tmp_path)
    assert caught.value.kind == "disk full"


def test_a_store_whose_library_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def without_gcsfs(location: str, **options: object) -> object:
        if location.startswith("gs:"):
            raise ImportError("Please install gcsfs to access Google Storage")
        return url_to_fs(location, **options)

    monkeypatch.setattr(stores, "url_to_fs", without_gcsfs)
    result = do(Job("a", "gs://bucket/a.zip", str(tmp_path / "a")), "a")
    assert (result.kind, result.message) == (
        "library",
        "gs://bucket/a.zip: Please install gcsfs to access Google Storage",
    )


@pytest.mark.parametrize(
    ("text", "clean"),
    [
        ("see https://anna:pass@host/x now", "see https://host/x now"),
        ("see https://anna:p@ss@host/x@y now", "see https://host/x@y now"),
        ("see 's3://b/x?X-Amz-Signature=pass&y=1' now", "see 's3://b/x?...' now"),
        ("a@b.c and s3://b/x stay", "a@b.c and s3://b/x stay"),
    ],
)
def test_passwords_and_tokens_are_taken_out(text: str, clean: str) -> None:
    assert cleaned(text) == clean
