"""Lists of rows: what they say, and what is wrong with them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

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
from tests.commands import Refused
from tests.exporter.readers import splatting_files
from tests.session.rights import as_anybody

HEAD = "name,source,output,steps,units,mesh_scaling,influences,clips,dataset,shape\n"
ROW = "one,model,,validate pack,4,no,8,a.glb; b/c.fbx,data,zero\n"
NOT_A_ROWS = {"source", "out", "pack", "force", "as_json", "help"}


def write(folder: Path, text: str, name: str = "list.csv") -> str:
    (folder / name).write_text(text, "utf-8")
    return str(folder / name)


def test_a_row_of_a_csv_and_the_same_in_json_lines(tmp_path: Path) -> None:
    at = str(tmp_path)
    clips = (f"{at}/a.glb", f"{at}/b/c.fbx")
    options = {"units": 4.0, "mesh_scaling": False, "influences": 8, "clips": clips}
    options |= {"dataset": f"{at}/data", "shape": "zero"}
    job = Job("one", f"{at}/model", f"{at}/out/one", options, ("pack", "validate"))
    assert read_list(write(tmp_path, "\ufeff" + HEAD + "\n" + ROW), f"{at}/out") == (job,)
    row = {"name": "one", "source": "model", "steps": ["pack", "validate"], "clips": ["a.glb", "b/c.fbx"]}
    row |= {"units": 4, "mesh_scaling": False, "influences": 8, "dataset": "data", "shape": "zero"}
    row |= {"output": None}
    assert read_list(write(tmp_path, json.dumps(row) + "\n\n", "list.jsonl"), f"{at}/out") == (job,)
    jobs = read_list(write(tmp_path, "source\na/head.zip\nb/old.avatar.zip\nc/v1.2\n"), at)
    assert [job.product for job in jobs] == ["head", "old", "v1.2"]


def test_every_option_of_the_command_is_an_option_of_a_row() -> None:
    command = typer.main.get_command(app).commands["convert"]
    names = {str(parameter.name) for parameter in command.params} - NOT_A_ROWS
    assert {name.replace("license", "licence") for name in names} == set(OPTIONS)


OUT = "out of the folder of --out"
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
    "a step without its files": ("source,steps,reference\na,conform,no\n", "line 2", "option reference"),
    "an unknown store": ("source\nhttp://x/y\n", "line 2, source", "no known store"),
    "a whole store": ("source\ns3://\n", "line 2, source", "whole store"),
    "out of the folder": ("source,output\na,../b\n", "line 2, output", "leads out"),
    "a zip as output": ("source,output\na,b.zip\n", "line 2", "leave .zip out"),
    "the folder of the batch": ("source,output\na,./\n", "line 2, output", "the folder of the whole batch"),
    "the name of a file in it": ("source,output\na,result.json\n", "line 2", "the name of a file in it"),
    "the report": ("source,output\na,report.html\n", "line 2, output", "report"),
    "the report, too": ("source,output\na,./report.jsonl\n", "line 2, output", "report"),
    "a long name": (f"source,output\na,{'ä' * 51}\n", "line 2", "more than 100 bytes"),
    "one name": ("source\nx/model\ny/model\n", "line 3: name", "line 2"),
    "one output": ("name,source,output\na,x,o\nb,y,./o/\n", "line 3: output", "line 2"),
    "another store": ("source,output\na,s3://b/o\n", "line 2, output", OUT),
    "a URL of a disk": ("source,output\na,file:///x\n", "line 2, output", OUT),
    "a whole path": ("source,output\na,/x\n", "line 2, output", OUT),
    "a whole path as name": ("name,source\n/x,a\n", "line 2, name", OUT),
    "a home folder": ("source,output\na,~/x\n", "line 2, output", OUT),
    "somebody's home": ("name,source\n~nobody-here/x,a\n", "line 2, name", OUT),
    "a drive": ("source,output\na,C:x\n", "line 2, output", OUT),
    "a path of Windows": ("source,output\na,x\\..\\..\\y\n", "line 2, output", OUT),
    "a share of Windows": ("name,source\n\\\\host\\x,a\n", "line 2, name", OUT),
    "up and down": ("source,output\na,x/../../y\n", "line 2, output", OUT),
    "an output in another": ("name,source,output\na,x,o\nb,y,o/c\n", "line 3: output", "lies in"),
}


WRONG_JSON = {
    "no JSON": ("{\n", "line 1", "is not JSON"),
    "no object": ("[1]\n", "line 1", "is not a JSON object"),
    "a number as source": ('{"source": "a"}\n{"source": 1}\n', "line 2, source", "1 is not a text"),
    "a number as list": ('{"source": "a", "clips": 3}\n', "line 1, clips", ""),
    "no column": ('{"source": "a", "unit": 3}\n', "line 1", "did you mean units?"),
    "no text": ("source\n\udcff\n", "list.jsonl", "not UTF-8"),
}


@pytest.mark.parametrize("case", WRONG | WRONG_JSON)
def test_a_wrong_list_is_one_line_with_file_line_and_field(case: str, tmp_path: Path) -> None:
    text, where, said = (WRONG | WRONG_JSON)[case]
    path = tmp_path / ("list.csv" if case in WRONG else "list.jsonl")
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(AvatarError) as caught:
        read_list(str(path), str(tmp_path / "out"))
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
    with pytest.raises(AvatarError, match="line 2, output: leads out"):
        read_list(write(tmp_path, f"source,output\n{row}\n"), str(out))


def into_the_list(at: Path) -> tuple[str, str]:
    return str(at), f"{at}/./"


def by_a_link(at: Path) -> tuple[str, str]:
    (at / "out").mkdir()
    (at / "out" / "ben").symlink_to(at)
    (at / "ben").mkdir()
    save(small_face(), at / "ben" / "face.npz")
    return str(at), str(at / "out")


def by_two_links(at: Path) -> tuple[str, str]:
    (at / "real").mkdir()
    (at / "link").symlink_to("real")
    return write(at, "source,output\na,real/o\nb,link/o\n"), str(at)


def into_an_input(at: Path) -> tuple[str, str]:
    (at / "data").mkdir()
    return write(at, "source,dataset\nmodel,data\n"), str(at / "data")


def named(name: str) -> Callable[[Path], tuple[str, str]]:
    def make(at: Path) -> tuple[str, str]:
        (at / "in" / name).mkdir(parents=True)
        save(small_face(), at / "in" / name / ("face.npz" if "\n" in name else f"{name}.npz"))
        return str(at / "in"), str(at / "out")

    return make


REFUSED = {
    "no such list": (lambda at: (str(at / "none.csv"), str(at)), "no such file"),
    "no list": (lambda at: (write(at, "source\na\n", "list.txt"), str(at)), "is not a list"),
    "a walk without an avatar": (lambda at: (str(at), str(at / "out")), "holds no row"),
    "a walk into what is searched": (into_the_list, "--out: is the folder that is searched"),
    "a walk that a link leads out": (by_a_link, "leads out of the folder of --out"),
    "outputs that a link makes one": (by_two_links, "line 3: output"),
    "an output within an input": (into_an_input, "line 2: output: lies in the dataset"),
    "a name of two lines": (named("two\nlines"), "cannot be the name of a row"),
    "a long name": (named("x" * 120), "more than 100 bytes"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused_is_one_line(case: str, tmp_path: Path) -> None:
    make, said = REFUSED[case]
    source, out = make(tmp_path)
    with pytest.raises(AvatarError, match=said) as caught:
        read_list(source, out)
    assert "\n" not in str(caught.value)


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
def test_a_password_in_a_url_is_refused_and_not_repeated(form: str, refused: Refused, tmp_path: Path) -> None:
    """As the source, the output, the name and the rig of a row, the list, the folder of the batch, and a job."""
    location, out = form.format(SECRET), tmp_path / "out"
    lists = [f"source,{column}\na,{location}\n" for column in ("output", "name", "rig")]
    lists += [f"source\n{location}\n", f'source,output,name\na,o,"{location}"\n']
    calls = [("batch", write(tmp_path, text, f"{at}.csv"), "-o", out) for at, text in enumerate(lists)]
    calls += [("batch", f"{location}/list.csv", "-o", out), ("batch", tmp_path, "-o", location)]
    calls += [(*calls[0], "--scheduler", f"tcp://host:1/?password={SECRET}")]
    for call in calls:
        assert SECRET not in refused(*call) and not out.exists(), call
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


def test_a_walk_finds_what_the_readers_know(tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "people/anna/run", splatting_files.arrays(degree=3))
    (tmp_path / "people/ben").mkdir()
    save(small_face(), tmp_path / "face.npz")
    (tmp_path / "face.npz").rename(tmp_path / "people/ben/FACE.NPZ")
    (tmp_path / "notes.txt").write_text("nothing")
    (tmp_path / "out/earlier/earlier").mkdir(parents=True)
    (tmp_path / "out/earlier/earlier/avatar.json").write_text("{}")
    found = {job.name: job.output for job in read_list(str(tmp_path), str(tmp_path / "out"))}
    assert found == {
        "people/anna/run": f"{tmp_path}/out/people/anna/run",
        "people/ben/FACE.NPZ": f"{tmp_path}/out/people/ben/FACE",
    }


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
    for result, path in zip(results, locked, strict=False):
        assert (
            result.kind == "input" and str(path) in result.message and "Permission denied" in result.message
        )
