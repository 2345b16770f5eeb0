"""What `servoid export` accepts, says and refuses; nothing half-written is left behind."""

import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from exported_bodies import random_body

from conftest import Command, everything_in
from servoid.errors import ExportError, MissingExtraError, OutputError, ServoidError
from servoid.exchange.export import FORMATS, export_body, format_of, mjcf, sdf, splat, surface
from servoid.exchange.export.exporting import WATER_KG_M3
from servoid.exchange.export.solid import solid_of
from servoid.output import noted_writes, write_together
from servoid.pose import Pose
from servoid.shape import BodyFile, EllipsoidEntry, write_body_file

FILE = random_body(4, 3)


@pytest.fixture
def body(tmp_path: Path) -> Path:
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / "body.json"
    write_body_file(path, FILE)
    return path


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_written_by_its_name(
    servoid_command: Command, body: Path, tmp_path: Path, name: str
) -> None:
    out = tmp_path / f"b{FORMATS[name].suffixes[0]}"
    done = servoid_command("export", body, "--to", name, "--out", out, "--density", 500)
    cm3 = 1e6 * FILE.body().mass_properties()[0]
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith(f"Wrote {out}")
    match = re.search(r"\((\w+)\): 3 ellipsoids, ([\d.]+) cm³, ([\d.]+) kg\n$", done.out)
    assert match
    assert match[1] == name
    assert (float(match[2]), float(match[3])) == pytest.approx((cm3, 500e-6 * cm3), rel=1e-3)


@pytest.mark.parametrize(
    ("ending", "name"),
    [
        (".obj", "obj"),
        (".ply", "ply"),
        (".glb", "glb"),
        (".xml", "mjcf"),
        (".mjcf", "mjcf"),
        (".urdf", "urdf"),
        (".sdf", "sdf"),
    ],
)
def test_the_ending_tells_the_format(ending: str, name: str) -> None:
    assert format_of(Path(f"a/b{ending}")) == name


def test_the_help_names_every_format_and_the_defaults(servoid_command: Command) -> None:
    words = " ".join(servoid_command("export", "--help").out.replace("│", " ").split())
    assert all(name in words for name in FORMATS)
    assert f"water's, {WATER_KG_M3:g}" in words
    assert f"from 0 to {surface.MOST_DETAIL} (default {surface.DEFAULT_DETAIL})" in words


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--to", "stl", "--out", "b.stl"], "there is no format 'stl'; choose one of obj, ply"),
        (["--out", "b.stl"], "the ending of b.stl belongs to no format; end the name in .glb"),
        (["--out", "b"], "the ending of b belongs to no format"),
        (["--to", "mjcf", "--out", "b.obj"], "such a file ends in .xml or .mjcf"),
        (["--to", "splat", "--out", "b.xml"], "such a file ends in .ply"),
        (["--out", "no/b.xml"], "there is no folder"),
        (["--out", "in.xml"], "it is a folder"),
        (["--out", "b.xml", "--density", "0"], "the density is 0 kg/m³; give a number from 2"),
        (["--out", "b.xml", "--density", "nan"], "the density is nan kg/m³; give a number from 2"),
        (["--out", "b.xml", "--density", "inf"], "the density is inf kg/m³; give a number from 2"),
        (["--out", "b.xml", "--density", "1e300"], "is 1e+300 kg/m³; give a number from 2 to"),
        (["--out", "b.xml", "--density", "1e-9"], "give a number from 2 to 25000 in kg/m³\n"),
        (["--out", "b.xml", "--density", "0.9"], "; if g/cm³ was meant, write 900\n"),
        (["--out", "b.obj", "--detail", "7"], "the detail is 7; choose a whole number from 0 to 6"),
        (["--out", "b.xml", "--frame", "hand"], "there is no frame 'hand'; choose one of object,"),
        (["--out", "b.xml", "--name", "../up"], "a body cannot be named '../up'"),
        (["--out", "b.xml", "--name", "world"], "a body cannot be named 'world'"),
        (["--out", "b.obj", "--name", "a\nf 1 2 3"], "a body cannot be named"),
    ],
)
def test_what_cannot_be_written_is_refused(
    servoid_command: Command,
    body: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.xml").mkdir()
    before = everything_in(tmp_path)
    done = servoid_command("export", body, *arguments)
    of_the_disk = message in ("there is no folder", "it is a folder")
    assert done.code == (1 if of_the_disk else 2)
    assert done.err.startswith("error: ")
    assert message in done.err
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize(
    ("density", "words"),
    [
        ("2", "if g/cm³ was meant, write 2000"),
        ("7.8", "only light foams have a density of 7.8 kg/m³; if g/cm³ was meant, write 7800"),
        ("22.6", "if g/cm³ was meant, write 22600"),
        ("25", None),
        ("400", None),
    ],
)
def test_a_density_that_metals_have_in_other_units_is_noted(
    servoid_command: Command, body: Path, tmp_path: Path, density: str, words: str | None
) -> None:
    done = servoid_command("export", body, "--out", tmp_path / "b.xml", "--density", density)
    assert (done.code, done.err) == (0, "")
    assert (tmp_path / "b.xml").is_file()
    if words is None:
        assert "g/cm³" not in done.out
    else:
        assert words in " ".join(done.out.split())


def test_a_body_that_is_none_is_refused(servoid_command: Command, tmp_path: Path) -> None:
    (tmp_path / "body.json").write_text('{"version": 1')
    done = servoid_command("export", tmp_path / "body.json", "--out", tmp_path / "b.xml")
    assert done.code == 1
    assert "is not valid JSON" in done.err
    assert not (tmp_path / "b.xml").exists()


def sized(radius: float) -> BodyFile:
    entry = EllipsoidEntry(
        center=(0.0, 0.0, 0.0), radii=(radius, radius, radius), rotation=(1.0, 0.0, 0.0, 0.0)
    )
    return BodyFile(
        version=1, units="m", world_from_object=(0, 0, 0, 1, 0, 0, 0), ellipsoids=(entry,)
    )


def test_a_body_whose_mass_no_number_holds_is_refused() -> None:
    with pytest.raises(ExportError, match="are its lengths in metres"):
        solid_of(sized(1e-49), "b", 1e-100, Pose.identity())


@pytest.mark.parametrize(("radius", "fits"), [(1e-6, False), (3.5e-4, False), (3.7e-4, True)])
def test_a_body_is_refused_for_mujoco_where_mujoco_refuses_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, radius: float, fits: bool
) -> None:
    mujoco = pytest.importorskip("mujoco", reason="mujoco-core needs Python 3.11 or newer")
    path = tmp_path / "b.xml"
    if not fits:
        with pytest.raises(ExportError, match="give a higher density, or lengths in metres"):
            export_body(sized(radius), path, "mjcf")
        assert not path.exists()
        monkeypatch.setattr(mjcf, "LEAST_MASS_KG", 0.0)
        monkeypatch.setattr(mjcf, "LEAST_INERTIA", 0.0)
    export_body(sized(radius), path, "mjcf")
    if fits:
        assert mujoco.MjModel.from_xml_path(str(path)).ngeom == 1
    else:
        with pytest.raises(ValueError, match="inertia"):
            mujoco.MjModel.from_xml_path(str(path))


@pytest.mark.parametrize("name", ["obj", "ply", "glb", "urdf"])
def test_without_its_libraries_a_mesh_says_how_to_get_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def without(library: str) -> Any:
        return None if library == "manifold3d" else find_spec(library)

    monkeypatch.setattr(surface, "find_spec", without)
    with pytest.raises(MissingExtraError, match=r"pip install 'servoid\[exchange\]'"):
        export_body(FILE, tmp_path / f"b.{name}", name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["mjcf", "sdf", "splat"])
def test_what_has_ellipsoids_of_its_own_needs_no_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(surface, "find_spec", lambda _: None)
    assert export_body(FILE, tmp_path / f"b{FORMATS[name].suffixes[0]}", name).files


@pytest.mark.parametrize(
    ("stem", "name"),
    [("a b", "a_b"), ("world", "world_body"), ("7", "body_7"), ("..", "body"), ("ä<&>", "body")],
)
def test_a_name_from_a_file_is_one_that_programs_accept(
    tmp_path: Path, stem: str, name: str
) -> None:
    (written,) = export_body(FILE, tmp_path / f"{stem}.xml", "mjcf").files
    assert f'<body name="{name}"' in written.read_text()


def test_files_that_belong_together_are_written_together_or_not_at_all(tmp_path: Path) -> None:
    (tmp_path / "b_visual.mtl").mkdir()
    with pytest.raises(OutputError, match=r"b_visual\.mtl: it is a folder"):
        export_body(FILE, tmp_path / "b.urdf", "urdf")
    assert [path.name for path in tmp_path.iterdir()] == ["b_visual.mtl"]


def test_when_the_last_of_several_files_fails_the_others_are_as_before(tmp_path: Path) -> None:
    (tmp_path / "old").write_bytes(b"old")
    files = {tmp_path / "old": b"1", tmp_path / "new": b"2", tmp_path / "no" / "c": b"3"}
    with noted_writes() as written, pytest.raises(OutputError):
        write_together(files)
    assert everything_in(tmp_path) == {"old": b"old"}
    assert written == [], "what was restored was not written"


def test_the_page_on_exporting_states_the_numbers_of_the_code() -> None:
    page = (Path(__file__).parents[3] / "docs" / "howto" / "export.md").read_text("utf-8")
    stated = (
        f"up to {splat.SPLATS} flat Gaussians",
        f"a sigma of {splat.SIGMA} of the distance",
        f"an opacity of {splat.OPACITY}",
        f"in kg/m³; the default is {WATER_KG_M3:g}",
        f"`--detail N` ranges from 0 to {surface.MOST_DETAIL}. With the default, "
        f"{surface.DEFAULT_DETAIL},",
        f"SDFormat {sdf.VERSION}",
    )
    assert [words for words in stated if words not in page] == []
    rows = {row.split("`")[1]: row for row in page.splitlines() if row.startswith("| `")}
    assert set(rows) == set(FORMATS)
    for name, one in FORMATS.items():
        assert all(f"`{suffix}`" in rows[name] for suffix in one.suffixes)


def test_every_refusal_is_a_servoid_error() -> None:
    assert issubclass(ExportError, ServoidError)
    assert issubclass(ExportError, ValueError)
