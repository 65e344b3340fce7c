"""Lists of rows: what they say, and what is wrong with them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from fsspec.implementations.memory import MemoryFileSystem

from avatar_export.asm.files import save
from avatar_export.batch import outcomes
from avatar_export.batch.failures import StoreError
from avatar_export.batch.jobs import Job, read_list
from avatar_export.batch.result import Result
from avatar_export.batch.row import do
from avatar_export.batch.row_options import OPTIONS
from avatar_export.cli import app
from avatar_runtime.io.errors import AvatarError
from tests.asm_faces import small_face
from tests.commands import Run
from tests.exporter.readers import splatting_files
from tests.session.rights import as_anybody

HEAD = "name,source,output,steps,units,mesh_scaling,influences,clips,dataset,shape\n"
ROW = "one,model,,validate pack,4,no,8,a.glb; b/c.fbx,data,zero\n"
NOT_A_ROWS = {"source", "out", "pack", "force", "as_json", "help"}


def write(folder: Path, text: str, name: str = "list.csv") -> str:
    (folder / name).write_text(text, "utf-8")
    return str(folder / name)


def test_a_row_of_a_csv(tmp_path: Path) -> None:
    (job,) = read_list(write(tmp_path, "\ufeff" + HEAD + "\n" + ROW), str(tmp_path / "out"))
    at = str(tmp_path)
    assert job == Job(
        "one",
        f"{at}/model",
        f"{at}/out/one",
        {
            "units": 4.0,
            "mesh_scaling": False,
            "influences": 8,
            "clips": (f"{at}/a.glb", f"{at}/b/c.fbx"),
            "dataset": f"{at}/data",
            "shape": "zero",
        },
        ("pack", "validate"),
    )


def test_json_lines_say_the_same(tmp_path: Path) -> None:
    row = {
        "name": "one",
        "source": "model",
        "steps": ["pack", "validate"],
        "units": 4,
        "mesh_scaling": False,
        "influences": 8,
        "clips": ["a.glb", "b/c.fbx"],
        "dataset": "data",
        "shape": "zero",
        "output": None,
    }
    lines = read_list(write(tmp_path, json.dumps(row) + "\n\n", "list.jsonl"), str(tmp_path))
    assert lines == read_list(write(tmp_path, HEAD + ROW), str(tmp_path))


def test_every_option_of_the_command_is_an_option_of_a_row() -> None:
    command = typer.main.get_command(app).commands["convert"]
    names = {parameter.name for parameter in command.params} - NOT_A_ROWS
    assert names == set(OPTIONS)


def test_a_file_gives_its_folder_its_name_without_ending(tmp_path: Path) -> None:
    jobs = read_list(write(tmp_path, "source\na/head.zip\nb/old.avatar.zip\nc/v1.2\n"), str(tmp_path))
    assert [job.product for job in jobs] == ["head", "old", "v1.2"]


def test_a_list_in_a_store_names_files_beside_it() -> None:
    MemoryFileSystem().pipe("/lists/list.csv", b"source,dataset\nruns/a,\nruns/b,/data\n")
    first, second = read_list("memory://lists/list.csv", "memory://out")
    assert (first.source, first.output) == ("memory://lists/runs/a", "memory://out/a")
    assert (second.source, second.options) == ("memory://lists/runs/b", {"dataset": "/data"})


WRONG = {
    "an unknown column": ("source,units_\na,4\n", "line 1", "did you mean units?"),
    "no column source": ("name\na\n", "list.csv", "no column source"),
    "a column twice": ("source,units,units\na,1,2\n", "line 1", "twice"),
    "semicolons": ("source;units\na;4\n", "list.csv", "save it with commas"),
    "too many cells": ("source\na,b\n", "line 2", "has 2 cells"),
    "an open quote": ('source\n"a\n', "line 2", "is not CSV"),
    "no source": ("source,units\n,4\n", "line 2, source", "names no source"),
    "no rows": ("source\n\n", "list.csv", "holds no row"),
    "a wrong number": ("source,units\na,4\nb,many\n", "line 3, units", "'many' is not a number"),
    "no number": ("source,units\na,nan\n", "line 2, units", "finite"),
    "a scale of zero": ("source,body_scale\na,0\n", "line 2, body_scale", "1e-06 to 1e+06 is needed"),
    "a wrong truth": ("source,exact\na,maybe\n", "line 2, exact", "not true or false"),
    "a wrong word": ("source,handedness\na,both\n", "line 2, handedness", "right, left"),
    "a wrong system": ("source,system\na,nerf\n", "line 2, system", "not one of bundle"),
    "a wrong step": ("source,steps\na,packs\n", "line 2, steps", "did you mean pack?"),
    "a step without its files": (
        "source,steps,reference\na,conform,no\n",
        "line 2",
        "needs the option reference",
    ),
    "an unknown store": ("source\nhttp://x/y\n", "line 2, source", "no known store"),
    "a whole store": ("source\ns3://\n", "line 2, source", "whole store"),
    "out of the folder": ("source,output\na,../b\n", "line 2, output", "leads out"),
    "a zip as output": ("source,output\na,b.zip\n", "line 2", "leave .zip out"),
    "the folder of the batch": ("source,output\na,./\n", "line 2, output", "the folder of the whole batch"),
    "the name of a file in it": ("source,output\na,result.json\n", "line 2", "the name of a file in it"),
    "the report": ("source,output\na,report.html\n", "line 2, output", "the batch's own report"),
    "the report, too": ("source,output\na,./report.jsonl\n", "line 2, output", "the batch's own report"),
    "a long name": (f"source,output\na,{'ä' * 51}\n", "line 2", "more than 100 bytes"),
    "one name": ("source\nx/model\ny/model\n", "line 3: name", "line 2"),
    "one output": ("name,source,output\na,x,o\nb,y,./o/\n", "line 3: output", "line 2"),
    "another store": ("source,output\na,s3://b/o\n", "line 2, output", "out of the folder of --out"),
    "a URL of a disk": ("source,output\na,file:///x\n", "line 2, output", "out of the folder of --out"),
    "a whole path": ("source,output\na,/x\n", "line 2, output", "out of the folder of --out"),
    "a whole path as name": ("name,source\n/x,a\n", "line 2, name", "out of the folder of --out"),
    "a home folder": ("source,output\na,~/x\n", "line 2, output", "out of the folder of --out"),
    "somebody's home": ("name,source\n~nobody-here/x,a\n", "line 2, name", "out of the folder of --out"),
    "a drive": ("source,output\na,C:x\n", "line 2, output", "out of the folder of --out"),
    "a path of Windows": ("source,output\na,x\\..\\..\\y\n", "line 2, output", "out of the folder of --out"),
    "a share of Windows": ("name,source\n\\\\host\\x,a\n", "line 2, name", "out of the folder of --out"),
    "up and down": ("source,output\na,x/../../y\n", "line 2, output", "out of the folder of --out"),
    "an output in another": ("name,source,output\na,x,o\nb,y,o/c\n", "line 3: output", "lies in"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_list_is_one_line_with_file_line_and_field(case: str, tmp_path: Path) -> None:
    text, where, said = WRONG[case]
    with pytest.raises(AvatarError) as caught:
        read_list(write(tmp_path, text), str(tmp_path / "out"))
    line = str(caught.value)
    assert where in line and said in line and str(tmp_path) in line and "\n" not in line


@pytest.mark.parametrize("row", ["a,link/o", "a,way/elsewhere/o", "a,inner/../../o", "a,one"])
def test_an_output_that_a_link_leads_out_is_refused(row: str, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    out = tmp_path / "out"
    (out / "inner").mkdir(parents=True)
    (out / "link").symlink_to("../elsewhere")
    (out / "way").symlink_to(tmp_path)
    (out / "one").symlink_to(tmp_path / "not there")
    with pytest.raises(AvatarError, match="line 2, output: leads out of the folder of --out"):
        read_list(write(tmp_path, f"source,output\n{row}\n"), str(out))


def test_outputs_below_the_folder_by_any_spelling(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "out").symlink_to("real")
    rows = f"source,output\na,{tmp_path}/out/a\nb,{tmp_path}/out/x/b\nc,./c/\n"
    found = read_list(write(tmp_path, rows), str(tmp_path / "out"))
    assert [job.output for job in found] == [f"{tmp_path}/out/{name}" for name in ("a", "x/b", "c")]
    (stored,) = read_list(write(tmp_path, "source,output\na,s3a://b//out/a/\n"), "s3://b/out")
    assert stored.output == "s3://b/out/a"


def test_a_walk_writes_nothing_outside(tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "in" / "ben" / "run", splatting_files.arrays(degree=3))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "ben").symlink_to(tmp_path)
    with pytest.raises(AvatarError, match=r"ben/run: leads out of the folder of --out"):
        read_list(str(tmp_path / "in"), str(tmp_path / "out"))


def test_outputs_that_a_link_makes_one(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    with pytest.raises(AvatarError, match="line 3: output"):
        read_list(write(tmp_path, "source,output\na,real/o\nb,link/o\n"), str(tmp_path))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{\n", "line 1: is not JSON"),
        ("[1]\n", "line 1: is not a JSON object"),
        ('{"source": "a"}\n{"source": 1}\n', "line 2, source: 1 is not a text"),
        ('{"source": "a", "clips": 3}\n', "line 1, clips"),
        ('{"source": "a", "unit": 3}\n', "line 1: 'unit' is not a column; did you mean units?"),
    ],
)
def test_wrong_json_lines(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(AvatarError) as caught:
        read_list(write(tmp_path, text, "list.jsonl"))
    assert said in str(caught.value)


SECRET = "t0psecret"
SECRETIVE = (
    "s3://anna:{}@b/x",
    "s3://anna:a@{}@b/x",
    "s3://anna:a/{}@b/x",
    "s3://anna:a {}@b/x",
    "s3://{}@b/x",
    "s3://b#{}",
    "s3://b/x#{}",
    "s3://b/x?X-Amz-Signature={}",
    "memory://b/x?token={}",
    "file:///x?password={}",
    "s3://anna%3A{}%40b/x",
    "s3://anna%253A{}%2540b/x",
    "s3://b/x%3Ftoken={}",
    "s3%3A%2F%2Fanna%3A{}%40b/x",
    "s3:/anna:{}@b/x",
    "S3A://anna:{}@b/x",
    "https://anna:{}@host/x",
    "simplecache::s3://anna:{}@b/x",
    "zip://x.zip::simplecache::s3://anna:{}@b/x",
    "simplecache::s3://b/x?secret={}",
    " s3://anna:{}@b/x",
)


@pytest.mark.parametrize("form", SECRETIVE)
def test_a_password_in_a_url_is_refused_and_not_repeated(form: str, run: Run, tmp_path: Path) -> None:
    """As the source, the output, the name and the rig of a row, the list, the folder of the batch, and a job."""
    location, out = form.format(SECRET), tmp_path / "out"
    list_of = {
        column: write(tmp_path, f"{','.join(row)}\n{','.join(row.values())}\n", f"{column}.csv")
        for column in ("source", "output", "name", "rig")
        for row in [{"source": "a", column: location}]
    }
    calls = [("batch", path, "-o", out) for path in list_of.values()]
    named = write(tmp_path, f'source,output,name\na,o,"{location}"\n', "named.csv")
    calls += [("batch", named, "-o", out)]
    calls += [("batch", f"{location}/list.csv", "-o", out), ("batch", tmp_path, "-o", location)]
    calls += [(*calls[0], "--scheduler", f"tcp://host:1/?password={SECRET}")]
    for call in calls:
        code, printed, said = run(*call)
        assert code == 2 and said.count("\n") == 1, call
        assert SECRET not in printed + said and not out.exists(), call
    with pytest.raises(ValueError, match=r"URL|other machine") as caught:
        Job("one", location, str(out))
    assert SECRET not in str(caught.value)


def test_what_a_library_says_is_printed_without_passwords() -> None:
    for form in SECRETIVE:
        said = f"cannot reach {form.format(SECRET).strip().replace(' ', '')} (timeout)"
        assert SECRET not in Result("one", "failed", "store", said).message, form
        end = len("OSError: ") + said.index(SECRET) + len(SECRET)
        cut = OSError("x" * (1000 - end) + said)  # a message ends after 1,000 letters
        assert SECRET not in outcomes.broken("one", cut).message, form
        assert SECRET not in str(StoreError(said, kind="store")), form


@pytest.mark.parametrize(("name", "said"), [("none.csv", "no such file"), ("list.txt", "is not a list")])
def test_what_is_no_list(name: str, said: str, tmp_path: Path) -> None:
    write(tmp_path, "source\na\n", "list.txt")
    with pytest.raises(AvatarError, match=said):
        read_list(str(tmp_path / name))


def test_a_list_that_is_not_utf8(tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_bytes(b"source\n\xff\n")
    with pytest.raises(AvatarError, match="not UTF-8"):
        read_list(str(tmp_path / "list.csv"))


def test_a_walk_finds_what_the_readers_know(tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "people/anna/run", splatting_files.arrays(degree=3))
    (tmp_path / "people/ben").mkdir()
    save(small_face(), tmp_path / "people/ben/face.npz")
    (tmp_path / "notes.txt").write_text("nothing")
    (tmp_path / "out/earlier/earlier").mkdir(parents=True)
    (tmp_path / "out/earlier/earlier/avatar.json").write_text("{}")
    jobs = read_list(str(tmp_path), str(tmp_path / "out"))
    assert [(job.name, Path(job.output).relative_to(tmp_path).as_posix()) for job in jobs] == [
        ("people/anna/run", "out/people/anna/run"),
        ("people/ben/face.npz", "out/people/ben/face"),
    ]


def test_what_nobody_may_read_is_a_row_of_a_walk_that_fails(tmp_path: Path) -> None:
    for name in ("anna", "locked", "open/ben"):
        (tmp_path / "in" / name).mkdir(parents=True)
        save(small_face(), tmp_path / "in" / name / "face.npz")
    (tmp_path / "in/notes.txt").write_text("nothing")
    locked = [tmp_path / "in" / name for name in ("locked", "open/ben/face.npz", "notes.txt")]
    for path in locked:
        path.chmod(0)
    jobs = as_anybody(lambda: read_list(str(tmp_path / "in"), str(tmp_path / "out")))
    assert [job.name for job in jobs] == ["anna/face.npz", "locked", "open/ben/face.npz"]
    results = as_anybody(lambda: [do(job, "a") for job in jobs[1:]])
    for path in locked:
        path.chmod(0o755)
    said = "cannot be read (Permission denied)"
    assert [(r.kind, r.message) for r in results] == [("input", f"{path}: {said}") for path in locked[:2]]


@pytest.mark.parametrize(
    ("name", "said"), [("two\nlines", "cannot be the name of a row"), ("x" * 120, "more than 100 bytes")]
)
def test_a_path_that_no_row_can_have(name: str, said: str, tmp_path: Path) -> None:
    (tmp_path / name).mkdir()
    save(small_face(), tmp_path / name / ("face.npz" if "\n" in name else f"{'x' * 120}.npz"))
    with pytest.raises(AvatarError, match=said) as caught:
        read_list(str(tmp_path), str(tmp_path / "out"))
    assert "\n" not in str(caught.value) and "write a .csv" in str(caught.value)


def test_a_walk_knows_endings_in_any_case(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "face.npz")
    (tmp_path / "face.npz").rename(tmp_path / "FACE.NPZ")
    (job,) = read_list(str(tmp_path), str(tmp_path / "out"))
    assert job.output == f"{tmp_path}/out/FACE"


def test_results_do_not_lie_among_what_is_searched(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "face.npz")
    with pytest.raises(AvatarError, match="--out: is the folder that is searched"):
        read_list(str(tmp_path), f"{tmp_path}/./")


def test_an_output_within_an_input_is_refused(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    with pytest.raises(AvatarError, match="line 2: output: lies in the dataset"):
        read_list(write(tmp_path, "source,dataset\nmodel,data\n"), str(tmp_path / "data"))


@pytest.mark.parametrize("out", ["", "http://x/y", "s3://anna:pass@b/x"])
def test_a_wrong_folder_for_outputs_is_the_options(out: str, tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="--out: ") as caught:
        read_list(write(tmp_path, "source\na\n"), out)
    assert "pass" not in str(caught.value).replace("password", "")


def test_a_walk_without_an_avatar(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="holds no row"):
        read_list(str(tmp_path))


@pytest.mark.parametrize(
    ("options", "steps", "error"),
    [
        ({"unit": 4}, (), ValueError),
        ({"units": "4"}, (), TypeError),
        ({"clips": "a.glb"}, (), TypeError),
        ({"influences": 5}, (), ValueError),
        ({}, ("packs",), ValueError),
    ],
)
def test_a_callers_mistake(
    options: dict[str, object], steps: tuple[str, ...], error: type[Exception]
) -> None:
    with pytest.raises(error):
        Job("a", "b", "c", options, steps)
