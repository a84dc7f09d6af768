"""What is fuzzed: each target reads bytes like a file of somebody else, and raises only errors that users see.

An input is either the file itself, or drives random edits of a valid one (`Bytes`), so that coverage guides both.
"""

import atexit
import io
import random
import shutil
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "helpers" / "usd"), str(HERE.parents[1] / "pipeline")]

FOLDER = Path(tempfile.mkdtemp(prefix="fuzz-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)


class Bytes(random.Random):
    """Random numbers that are the bytes of an input; zeros after its end."""

    def __init__(self, data: bytes) -> None:
        super().__init__()
        self._stream = io.BytesIO(data)

    def getrandbits(self, count: int) -> int:
        """The next bytes as a number."""
        size = (count + 7) // 8
        return int.from_bytes(self._stream.read(size).ljust(size, b"\0"), "little") & ((1 << count) - 1)

    def random(self) -> float:
        """The next two bytes as a fraction."""
        return self.getrandbits(16) / 65536.0


def _file(name: str, data: bytes) -> Path:
    path = FOLDER / name
    path.write_bytes(data)
    return path


SHOTS = ("drives", "flexible", "posed", "skeletal")


@cache
def shot_text(kind: str) -> str:
    """A valid shot as text, one of `SHOTS`."""
    import posed_shots
    import small_shots

    def flexible(stage: object) -> None:
        small_shots.make_flexible(stage)
        small_shots.make_target(stage)

    edits = {"drives": None, "flexible": flexible, "posed": posed_shots.posed, "skeletal": posed_shots.skeletal}
    return small_shots.write_arm(FOLDER / f"{kind}-base.usda", edits[kind]).read_text()


def is_read(path: Path) -> bool:
    """Whether a shot is read, then in numbers that make sense; False where it is refused."""
    import numpy as np
    from calmotion.errors import ShotError
    from calmotion.usd.reading import read_shot

    try:
        character, animation, _ = read_shot(str(path))
    except ShotError as error:
        assert error.problem
        return False
    except Exception as error:
        raise AssertionError(f"{error!r}\n{path.read_bytes()[:2000]!r}") from error
    numbers = [animation.frame_times, character.gravity, *(t.values for t in (*animation.tracks, *animation.current))]
    numbers += [t.times for t in animation.tracks] + [j.frame0.position for j in character.joints]
    numbers += [b.mass.inertia for b in character.bodies if b.mass] + [b.rest.position for b in character.bodies]
    assert all(np.all(np.isfinite(values)) for values in numbers)
    assert all(body.mass is None or body.mass.mass > 0.0 for body in character.bodies)
    assert len(character.motors) == len(animation.tracks) and len(animation.frame_times) >= 1
    assert all(np.all(np.diff(track.times) > 0.0) for track in animation.tracks)
    return True


def edited_shot(kind: str, rng: random.Random) -> Path:
    """A shot with random edits of its prims, attributes and relationships; its file, which the next one replaces."""
    import mutations
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(shot_text(kind))
    for _ in range(1 + rng.randrange(6)):
        try:
            rng.choice(mutations.MUTATIONS)(layer, rng)
        except Exception:  # USD refuses some edits by itself
            continue
    path = FOLDER / "shot.usda"
    layer.Export(str(path))
    return path


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Bytes with some changed, lost, doubled or new."""
    values = bytearray(data)
    for _ in range(rng.choice((1, 2, 5, 20))):
        at, size = rng.randrange(len(values) + 1), rng.choice((1, 1, 4, 16))
        what = rng.randrange(4)
        if what == 0:
            del values[at : at + size]
        elif what == 1:
            values[at:at] = values[at : at + size]
        elif what == 2:
            values[at : at + size] = rng.randbytes(size)
        else:
            values[at:at] = rng.choice((b"\0", b"-1", b"nan", b"1e999", b"9" * 20, b"\xff", b"\n", b"{", b'"'))
    return bytes(values)


def shot(data: bytes) -> None:
    """A shot that the bytes edit."""
    rng = Bytes(data)
    is_read(edited_shot(rng.choice(SHOTS), rng))


def splines(data: bytes) -> None:
    """A motor with a spline of any knots, loops and extrapolation."""
    import mutations
    import small_shots
    from pxr import Sdf, Ts, Usd

    rng = Bytes(data)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(shot_text("drives"))
    spline = Ts.Spline("float")
    try:
        for _ in range(rng.randrange(12)):
            time = rng.choice((rng.randrange(30), rng.randrange(2**16) / 2048.0, rng.choice(mutations.NUMBERS)))
            knot = Ts.Knot(
                typeName="float", time=time, value=rng.choice((rng.randrange(90), rng.choice(mutations.NUMBERS))),
                nextInterp=rng.choice((Ts.InterpHeld, Ts.InterpLinear, Ts.InterpCurve, Ts.InterpValueBlock)),
            )  # fmt: skip
            knot.SetPreTanWidth(rng.randrange(9) / 2.0)
            knot.SetPostTanWidth(rng.randrange(9) / 2.0)
            knot.SetPreTanSlope(rng.choice(mutations.NUMBERS))
            knot.SetPostTanSlope(rng.choice(mutations.NUMBERS))
            spline.SetKnot(knot)
        if rng.randrange(2):
            loop = Ts.LoopParams()
            loop.protoStart, loop.protoEnd = float(rng.randrange(20)), float(rng.randrange(30))
            loop.numPreLoops, loop.numPostLoops = rng.randrange(4), rng.choice((0, 1, 3, 10**6))
            spline.SetInnerLoopParams(loop)
        stage = Usd.Stage.Open(layer)
        stage.GetPrimAtPath(small_shots.ELBOW).GetAttribute(small_shots.TARGET_POSITION).SetSpline(spline)
    except Exception:  # USD refuses some by itself
        return
    layer.Export(str(FOLDER / "spline.usda"))
    is_read(FOLDER / "spline.usda")


def _plugin(name: str, module: str) -> ModuleType:
    """A module of a bundled plugin, whose folder is not a package on the path."""
    import importlib

    sys.path.insert(0, str(HERE.parents[1] / "plugins"))
    try:
        return importlib.import_module(f"{name}.{module}")
    finally:
        del sys.path[0]


def meshes(data: bytes) -> None:
    """A mesh file of a format that the first byte names."""
    import warnings

    from calmotion.errors import ShotError
    from calmotion.mesh.mesh_file import read_mesh_file

    suffixes = (".stl", ".obj", ".msh", ".vtk", ".vtu", ".ply", ".off", ".inp", ".bdf", ".mesh")
    path = _file(f"mesh{suffixes[data[0] % len(suffixes)] if data else '.obj'}", data[1:])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            read_mesh_file(str(path), 1.0, "/Arm/link")
        except ShotError as error:
            assert error.problem


def bvh(data: bytes) -> None:
    """A BVH file."""
    from calmotion.errors import ShotError

    try:
        _plugin("bvh_reader", "bvh").read_bvh(str(_file("motion.bvh", data)))
    except ShotError as error:
        assert error.problem


def recordings(data: bytes) -> None:
    """A recording of a format that the first byte names, and its map after a line of equals signs."""
    import warnings

    from calmotion.errors import ShotError
    from calmotion.recordings import RecordingRequest

    kind, (content, _, table) = data[0] % 2 if data else 0, data[1:].partition(b"\n====\n")
    path = _file(f"take{('.csv', '.mcap')[kind]}", content)
    beside = path.with_suffix(".toml")
    beside.unlink(missing_ok=True)
    if table:
        beside.write_bytes(table)
    request = RecordingRequest(str(path), "/Arm/hand" if kind else "")  # a table names its prims itself
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if kind == 0:
                found = _plugin("recording_readers", "tables").read_table(request, "")
            else:
                found = _plugin("recording_readers", "bags").read_bag(request, "")
        except ShotError as error:
            assert error.problem
            return
    for channel in found.channels:
        assert len(channel.times) == len(channel.values) > 0 and channel.path.startswith("/")
        assert all(later > earlier for earlier, later in zip(channel.times, channel.times[1:], strict=False))


def motions(data: bytes) -> None:
    """A motion as a table or an archive of arrays."""
    from calmotion.errors import ShotError

    try:
        tracks = (
            _plugin("motion_table", "tables")
            .read_motion(
                str(_file(f"motion{'.npz' if data[:1] == b'P' else '.csv'}", data)),
                angles="auto",
                times="auto",
                rate=60.0,
                names=(),
            )
            .tracks
        )
    except ShotError as error:
        assert error.problem
        return
    assert len(tracks.times) > 0 and all(len(values) == len(tracks.times) for values in tracks.values.values())


def manifests(data: bytes) -> None:
    """The manifest of a plugin."""
    from calmotion.host import PluginError
    from calmotion.host.manifest import check_requirements, read_manifest

    folder = FOLDER / "anvil"
    folder.mkdir(exist_ok=True)
    (folder / "plugin.toml").write_bytes(data)
    try:
        check_requirements(read_manifest(folder), "0.1.0")
    except PluginError as error:
        assert error.problem


def settings(data: bytes) -> None:
    """A settings file, and the same text as an assignment."""
    from calmotion.host import SettingError, parse_quantity
    from calmotion.host.settings import read_assignment, read_settings_file

    text = data.decode("utf-8", "replace")
    for read, given in (
        (read_settings_file, _file("settings.toml", data)), (read_assignment, text),
        (lambda given: parse_quantity(given, "m"), text),
    ):  # fmt: skip
        try:
            read(given)
        except SettingError as error:
            assert error.problem


TARGETS: dict[str, Callable[[bytes], None]] = {
    one.__name__: one for one in (shot, splines, meshes, bvh, recordings, motions, manifests, settings)
}


def _bag() -> bytes:
    """A bag with a state of a joint; no more than its first bytes without the library that writes it."""
    try:
        from mcap_ros2.writer import Writer
    except ImportError:
        return b"\x89MCAP0\r\n"
    stream = io.BytesIO()
    writer = Writer(stream)
    time = "int32 sec\nuint32 nanosec"
    header = f"builtin_interfaces/Time stamp\nstring frame_id\n{'=' * 80}\nMSG: builtin_interfaces/Time\n{time}"
    text = (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
        f"{'=' * 80}\nMSG: std_msgs/Header\n{header}\n"
    )
    schema = writer.register_msgdef("sensor_msgs/msg/JointState", text)
    for k in range(3):
        stamp = {"sec": k, "nanosec": 5}
        message = {
            "header": {"stamp": stamp, "frame_id": ""}, "name": ["elbow"], "position": [0.1 * k], "velocity": [],
            "effort": [1.0],
        }  # fmt: skip
        writer.write_message("/joint_states", schema, message, log_time=k * 10**9, publish_time=k * 10**9)
    writer.finish()
    return stream.getvalue()


_TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
_MANIFEST = (
    'id = "anvil"\nversion = "0.1.0"\nname = "Anvil"\ntagline = "Hits"\nmaintainer = "Smith"\nlicense = "MIT"\n'
    'tags = ["iron"]\ncalmotion = ">=0.1"\nrequires = ["numpy>=2", "scipy ; python_version < \'3\'"]\n'
)
SEEDS: dict[str, tuple[bytes, ...]] = {
    "shot": (b"\0" * 40, bytes(range(80))),
    "splines": (bytes(range(1, 120)), b"\5" * 90),
    "meshes": (
        b"\1" + _TETRAHEDRON.encode(),
        b"\0solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        b"endsolid\n",
        b"\2$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n"
        b"1\n1 4 2 0 1 1 2 3 4\n$EndElements\n",
        b"\7*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n",
    ),
    "bvh": (
        b"HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\nMOTION\nFrames: 2\n"
        b"Frame Time: 0.04\n1 2 3\n4 5 6\n",
    ),
    "recordings": (
        b"\0time_s,/Arm/hand.x,/Arm/hand.y,/Arm/hand.z,/Arm/joints/elbow.angle\n0,0,0,1,0\n0.01,0,0.1,1,2\n0.02,,,,3\n",
        b'\0t;a;b\n0;1;2\n1;3;4\n\n====\n[time]\ncolumn = "t"\nunit = "ms"\n[[channel]]\nprim = "/Arm/joints/elbow"\n'
        b'kind = "angle"\ncolumns = ["-a"]\nunit = "deg"\nnoise = 0.1\n',
        b"\1" + _bag() + b'\n====\n[joints]\nelbow = "/Arm/joints/elbow"\n',
    ),
    "motions": (
        b"time_s,/Arm/joints/elbow\n0,1\n0.1,2\n0.2,3\n",
        b"/Arm/joints/elbow;/Arm/joints/shoulder\n1;2\n3;4\n",
    ),
    "manifests": (_MANIFEST.encode(), _MANIFEST.encode("utf-16")),
    "settings": (b'[fe.mesh]\nelement_size = "5mm"\n', b"a.b=5mm", b"5mm"),
}
