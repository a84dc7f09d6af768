"""Hostile files and layers: names in all scripts, links, packages, layers that loop or are gone, instances, meshes."""

import os
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from commands import words
from hostile import DONE, EITHER, REFUSED, USAGE, Case, Edit, arm, layer, simulate
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdUtils, Vt
from shot_edits import flexible, mesh, mesh_file, tet_mesh
from small_shots import BASE, ELBOW, FORE, HAND, SHOULDER, UPPER, make_target

SKIN = f"{FORE}/skin"
OUTPUTS = ("out.usda", "out_root.usda")


def named(name: str, *told: str, statuses: tuple[int, ...] = DONE) -> Case:
    """The arm in a file of another name, with outputs beside it that take the name too."""
    words = ("simulate", name, "-o", f"out {name}", "--csv", f"{name}.csv", "--json")
    root = f"out {Path(name).stem}_root{Path(name).suffix.lower()}"
    return Case(arm(name=name), words, statuses, told, outputs=(f"out {name}", root, f"{name}.csv"))


def then(*steps: Callable[[Path], object]) -> Callable[[Path], None]:
    """The arm, then further steps in its folder."""

    def make(folder: Path) -> None:
        arm()(folder)
        for step in steps:
            step(folder)

    return make


def linked(folder: Path) -> None:
    arm(name="real.usda")(folder)
    (folder / "shot.usda").symlink_to("real.usda")


def packaged(folder: Path) -> None:
    arm(name="inner.usda")(folder)
    UsdUtils.CreateNewUsdzPackage(str(folder / "inner.usda"), str(folder / "shot.usdz"))
    (folder / "inner.usda").unlink()


def bomb(folder: Path) -> None:
    with zipfile.ZipFile(folder / "shot.usdz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.usda", b"#usda 1.0\n" + bytes(10**7))


def referenced(folder: Path) -> None:
    arm(name="asset.usda")(folder)
    (folder / "shot.usda").write_text(
        '#usda 1.0\n(\n    defaultPrim = "Arm"\n    metersPerUnit = 1\n    upAxis = "Z"\n    timeCodesPerSecond = 24\n'
        '    startTimeCode = 0\n    endTimeCode = 24\n)\ndef "Arm" (references = @./asset.usda@) {}\n'
    )


def in_centimetres(folder: Path) -> None:
    referenced(folder)
    text = (folder / "shot.usda").read_text()
    (folder / "shot.usda").write_text(text.replace("metersPerUnit = 1\n", "metersPerUnit = 0.01\n"))


def twice(folder: Path) -> None:
    referenced(folder)
    with (folder / "shot.usda").open("a") as file:
        file.write('def "Other" (references = @./asset.usda@</Arm>) {}\n')


def instanced(folder: Path) -> None:
    referenced(folder)
    text = (folder / "shot.usda").read_text()
    (folder / "shot.usda").write_text(text.replace("(references", "(instanceable = true references"))


def deep(count: int) -> Callable[[Path], None]:
    """Layers that each sublayer the next."""

    def make(folder: Path) -> None:
        arm(name=f"l{count}.usda")(folder)
        text = (folder / f"l{count}.usda").read_text()
        head = text[: text.index(")\n") + 2]
        for k in range(count):
            name = "shot.usda" if k == 0 else f"l{k}.usda"
            (folder / name).write_text(head.replace("(\n", f"(\n    subLayers = [@./l{k + 1}.usda@]\n", 1))

    return make


def inactive(path: str) -> Edit:
    return lambda stage: stage.GetPrimAtPath(path).SetActive(False)


def payload(own: Sdf.Layer) -> None:
    own.GetPrimAtPath(FORE).payloadList.Prepend(Sdf.Payload("./more.usda", "/More"))


def shifted(own: Sdf.Layer, offset: float, scale: float) -> None:
    """A sublayer in another time."""
    own.subLayerPaths.append("./more.usda")
    own.subLayerOffsets[0] = Sdf.LayerOffset(offset, scale)


def variants(stage: Usd.Stage) -> None:
    sets = stage.GetPrimAtPath(FORE).GetVariantSets().AddVariantSet("weight")
    for name in ("light", "heavy"):
        sets.AddVariant(name)
    sets.SetVariantSelection("gone")


def hidden(stage: Usd.Stage) -> None:
    UsdGeom.Imageable(stage.GetPrimAtPath("/Arm")).MakeInvisible()


def guide(stage: Usd.Stage) -> None:
    UsdGeom.Imageable(stage.GetPrimAtPath(SKIN)).CreatePurposeAttr("guide")


def points(values: np.ndarray) -> Edit:
    return mesh("points", Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32)))


def box_points(x: float = 0.4, y: float = 0.02, z: float = 0.02) -> np.ndarray:
    return np.array([[a * x, (2 * b - 1) * y, (2 * c - 1) * z] for a in (0, 1) for b in (0, 1) for c in (0, 1)])


def faces(*faces: tuple[int, ...]) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        own = UsdGeom.Mesh(stage.GetPrimAtPath(SKIN))
        own.GetFaceVertexCountsAttr().Set([len(face) for face in faces])
        own.GetFaceVertexIndicesAttr().Set([i for face in faces for i in face])

    return flexible(edit)


def no_mesh(stage: Usd.Stage) -> None:
    stage.RemovePrim(SKIN)


def mesh_beside(text: str | bytes, name: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        arm(mesh_file(f"./{name}"))(folder)
        (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)

    return make


def unicode_target(stage: Usd.Stage) -> None:
    UsdGeom.Xform.Define(stage, f"{FORE}/手先").AddTranslateOp().Set(Gf.Vec3d(0.4, 0, 0))
    make_target(stage, f"{FORE}/手先")


GMSH = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 999999999999 1 999999999999\n"
TETS = [Gf.Vec3f(*p) for p in ((0, 0, 0), (0.4, 0, 0), (0, 0.1, 0), (0, 0, 0.1))]

CASES: dict[str, Case] = {
    # names
    "a name with spaces": named("my shot.usda"),
    "a name in Chinese": named("镜头.usda"),
    "a name of an emoji": named("🤖.usda"),
    "a name with quotes": named('it\'s a "shot".usda'),
    "a name with a newline": named("a\nb.usda", statuses=EITHER),
    "a name with percent signs": named("100%d %s.usda"),
    "a name with braces": named("{shot} [1].usda", statuses=EITHER),
    "a name with a semicolon": named("a;rm -rf b.usda", statuses=EITHER),
    "a name with a dollar sign": named("$HOME.usda", statuses=EITHER),
    "a name that begins with a dash": Case(arm(name="-shot.usda"), ("simulate", "-shot.usda", "--json"), USAGE),
    "the same after two dashes": Case(arm(name="-shot.usda"), ("simulate", "--json", "--", "-shot.usda"), DONE),
    "a name of 240 letters": named(f"{'a' * 230}.usda", statuses=(0, 1, 2)),
    "a name of 5000 letters": words(f"simulate {'a' * 5000}.usda --json"),
    "a name that ends in a blank": named("shot .usda"),
    "a hidden file": named(".shot.usda"),
    "a name in capitals": named("SHOT.USDA", statuses=EITHER),
    "a name with a colon": named("a:b.usda", statuses=EITHER),
    "a name with an at sign": named("a@b.usda", statuses=EITHER),
    "a name with a backslash": named("a\\b.usda", statuses=EITHER),
    "a name without a suffix": Case(arm(), ("simulate", "shot", "--json"), (1,), ("shot",)),
    "prims in other scripts": simulate(DONE, unicode_target, "手先"),
    # places
    "a shot through a link": simulate(DONE, make=linked),
    "a link to nothing": words(
        "simulate shot.usda --json", "shot.usda", make=lambda f: (f / "shot.usda").symlink_to("gone.usda")
    ),
    "a link to itself": words(
        "simulate shot.usda --json", "shot.usda", make=lambda f: (f / "shot.usda").symlink_to("shot.usda")
    ),
    "an output through a link": simulate((0, 1, 2), make=then(lambda f: (f / "out.usda").symlink_to("elsewhere.usda"))),
    "an output that links to the shot": simulate(
        (1, 2), "never overwritten", make=then(lambda f: (f / "out.usda").symlink_to("shot.usda"))
    ),
    "an output that links to a device": simulate(
        (0, 1, 2), make=then(lambda f: (f / "out.usda").symlink_to("/dev/full"))
    ),
    "an output that is a pipe": simulate((0, 1, 2), "out.usda", make=then(lambda f: os.mkfifo(f / "out.usda"))),
    "a folder in place of the output": simulate((1, 2), "out.usda", make=then(lambda f: (f / "out.usda").mkdir())),
    "a folder in place of the root layer": simulate(
        (1, 2), "out_root.usda", make=then(lambda f: (f / "out_root.usda").mkdir())
    ),
    "a root layer of somebody else": simulate(
        (1, 2), "out_root.usda", make=then(lambda f: (f / "out_root.usda").write_text("#usda 1.0\n"))
    ),
    "an output that is no USD file": simulate(
        (0, 1, 2), make=then(lambda f: (f / "out.usda").write_text("a shopping list"))
    ),
    "a checkpoint that is a folder": Case(
        then(lambda f: (f / ".out.usda.checkpoint.npz").mkdir()),
        ("optimize", "shot.usda", "-o", "out.usda", "--json"),
        (0, 1),
    ),
    "a checkpoint of noise": Case(
        then(lambda f: (f / ".out.usda.checkpoint.npz").write_bytes(os.urandom(5000))),
        ("optimize", "shot.usda", "-o", "out.usda", "--json"),
        (0,),
        outputs=(*OUTPUTS, ".out.usda.checkpoint.npz"),
    ),
    "an output in /proc": words("simulate shot.usda -o /proc/out.usda --json", "/proc"),
    "an output in /sys": words("simulate shot.usda --csv /sys/out.csv --json", "/sys"),
    # packages and layers
    "a shot in a package": words("simulate shot.usdz -o out.usda --json", make=packaged, statuses=DONE),
    "a package that is compressed": words("simulate shot.usdz --json", "shot.usdz", make=bomb),
    "a shot that is referenced": simulate(DONE, make=referenced),
    "a shot that is referenced in centimetres": simulate(EITHER, make=in_centimetres),
    "a robot that is there twice": simulate(EITHER, make=twice),
    "a robot that is an instance": simulate(EITHER, make=instanced),
    "fifty layers deep": simulate(DONE, make=deep(50)),
    "a payload": simulate(
        DONE, make=layer(payload, more='#usda 1.0\ndef "More"\n{\n    def Xform "x"\n    {\n    }\n}\n')
    ),
    "a payload of another type": simulate(
        EITHER, make=layer(payload, more='#usda 1.0\ndef Cube "More"\n{\n    double size = 3\n}\n')
    ),
    "a sublayer that is muted by its offset": simulate(
        DONE,
        make=layer(
            partial(shifted, offset=1000.0, scale=2.0), more='#usda 1.0\nover "Arm"\n{\n    float calm:x = 1\n}\n'
        ),
    ),
    "a sublayer on a scale of zero": simulate(
        EITHER, make=layer(partial(shifted, offset=0.0, scale=0.0), more="#usda 1.0\n")
    ),
    "a sublayer of the network": simulate(
        REFUSED, "example.com", make=then(lambda f: _sublayer(f, "https://example.com/a.usda"))
    ),
    "a sublayer that is a device": simulate(REFUSED, "/dev/zero", make=then(lambda f: _sublayer(f, "/dev/zero"))),
    "a body that is inactive": simulate(EITHER, inactive(FORE), "elbow|fore", target=False),
    "a joint that is inactive": simulate(EITHER, inactive(ELBOW)),
    "a target that is inactive": simulate(EITHER, inactive(HAND)),
    "everything is invisible": simulate(DONE, hidden),
    "a flexible mesh that is a guide": simulate(EITHER, flexible(guide)),
    "a root layer that says nothing of units": simulate(
        EITHER, "metersPerUnit", "upAxis", make=then(lambda f: _above(f))
    ),
    "a robot below a transform that turns it": simulate(
        DONE, lambda s: UsdGeom.Xformable(s.GetPrimAtPath("/Arm")).AddRotateXOp().Set(90), "do not meet"
    ),
    "a robot that is mirrored": simulate(
        EITHER, lambda s: UsdGeom.Xformable(s.GetPrimAtPath("/Arm")).AddScaleOp().Set(Gf.Vec3f(1, -1, 1)), "do not meet"
    ),
    "a collider of a type without a volume": simulate(
        DONE, lambda s: UsdPhysics.CollisionAPI.Apply(s.DefinePrim(f"{UPPER}/p", "Plane")), "gives no mass"
    ),
    "a joint that breaks": simulate(
        DONE, lambda s: UsdPhysics.Joint(s.GetPrimAtPath(ELBOW)).CreateBreakForceAttr(1.0), "breakForce"
    ),
    "a body that moves at the start": simulate(
        DONE,
        lambda s: UsdPhysics.RigidBodyAPI(s.GetPrimAtPath(FORE)).CreateAngularVelocityAttr((0, 500, 0)),
        "angularVelocity",
    ),
    "a variant that is not there": simulate(EITHER, variants),
    "joints of which two have one name": simulate(
        EITHER, make=layer(lambda own: Sdf.CopySpec(own, SHOULDER, own, f"{UPPER}/shoulder"))
    ),
    "an over in place of a body": simulate(
        EITHER, make=layer(lambda own: setattr(own.GetPrimAtPath(BASE), "specifier", Sdf.SpecifierOver))
    ),
    "a default prim that is not there": simulate(EITHER, make=layer(lambda own: setattr(own, "defaultPrim", "Gone"))),
    "ten thousand prims more": simulate(
        DONE, lambda s: [UsdGeom.Xform.Define(s, f"/Set/p{k}") for k in range(10_000)], seconds=60
    ),
    "a prim 400 levels deep": simulate(DONE, lambda s: UsdGeom.Xform.Define(s, "/Set" + "/x" * 400)),
    # meshes
    "a flexible body without a mesh": simulate(DONE, flexible(no_mesh), "a beam of"),
    "a mesh that is open": simulate(
        EITHER, faces((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4)), seconds=60
    ),
    "a mesh inside out": simulate(
        EITHER, faces((2, 3, 1, 0), (5, 7, 6, 4), (1, 5, 4, 0), (6, 7, 3, 2), (4, 6, 2, 0), (3, 7, 5, 1)), seconds=60
    ),
    "a mesh of every face twice": simulate(
        EITHER,
        faces(*2 * [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]),
        seconds=60,
    ),
    "a mesh that is flat": simulate(EITHER, points(box_points(z=0.0)), "skin|fore", seconds=60),
    "a mesh of a point": simulate(REFUSED, points(np.zeros((8, 3))), "skin|fore", seconds=60),
    "a mesh of micrometres": simulate(EITHER, points(1e-6 * box_points()), seconds=60),
    "a mesh of kilometres": simulate(EITHER, points(1e3 * box_points()), seconds=60),
    "a mesh that is a needle": simulate(EITHER, points(box_points(y=1e-5, z=1e-5)), seconds=120),
    "a mesh that is a sheet": simulate(EITHER, points(box_points(z=1e-5)), seconds=120),
    "a mesh far from its body": simulate(
        REFUSED, points(box_points() + [0.0, 0.0, 50.0]), FORE, "far from all of its joints", seconds=60
    ),
    "a mesh that cuts itself": simulate(
        EITHER, points(box_points() * np.where(np.arange(8) == 7, -1.0, 1.0)[:, None]), seconds=120
    ),
    "faces of two corners": simulate(DONE, faces(*[(0, 1)] * 6), "a beam of", seconds=60),
    "tetrahedra that are inside out": simulate(EITHER, tet_mesh(TETS, [(0, 1, 3, 2)]), seconds=60),
    "tetrahedra that share no face": simulate(
        EITHER,
        tet_mesh([*TETS, *(p + Gf.Vec3f(5, 0, 0) for p in TETS)], [(0, 1, 2, 3), (4, 5, 6, 7)]),
        "tets",
        seconds=60,
    ),
    "one tetrahedron": simulate(EITHER, tet_mesh(TETS, [(0, 1, 2, 3)]), seconds=60),
    "a mesh file of a trillion nodes": simulate(REFUSED, "a.msh", make=mesh_beside(GMSH, "a.msh")),
    "an STL that says it is huge": simulate(
        REFUSED, "a.stl", make=mesh_beside(bytes(80) + b"\xff\xff\xff\x7f", "a.stl")
    ),
}


def _sublayer(folder: Path, path: str) -> None:
    shot = folder / "shot.usda"
    shot.write_text(shot.read_text().replace("(\n", f"(\n    subLayers = [@{path}@]\n", 1))


def _above(folder: Path) -> None:
    """The arm as the sublayer of a root layer that says nothing."""
    (folder / "shot.usda").rename(folder / "robot.usda")
    (folder / "shot.usda").write_text("#usda 1.0\n(\n    subLayers = [@./robot.usda@]\n)\n")
