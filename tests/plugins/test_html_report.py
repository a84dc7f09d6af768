"""The page of a result: its words, its numbers, and what a browser shows of them."""

import base64
import dataclasses
import gzip
import json
import re
from pathlib import Path

import calmotion as cm
import numpy as np
import pytest
import synthetic
from calmotion.errors import ShotError
from calmotion.model import HtmlPage, OutputPaths, PageContent, Section, TextTable
from calmotion.testing import host_with
from calmotion.views import sample_motion
from calmotion.workflow import sha256_of
from calmotion_plugins.html_report import charts, page, scene
from chromium import CHROMIUM, Chromium
from matplotlib.figure import Figure
from one_hinge import ONE_HINGE
from scipy.spatial.transform import Rotation

PLUGINS = Path(__file__).resolve().parents[2] / "plugins"
LARGEST = 8_000_000  # bytes of a page
WORDS = (
    Section("Result", ("The largest error falls from 30 mm to 2 mm (at /Robot/Tip/Target).",
                       TextTable("Errors", ("target", "max"), (("/Robot/<Tip>", "2 mm"),)))),
    Section("Simplifications", ("simplified: modes above 40 Hz & more",)),
)  # fmt: skip
ORIGIN = {"command": "calmotion optimize shot.usda", "versions": {"calmotion": "1.2"},
          "inputs": [{"role": "shot", "path": "shot.usda", "sha256": "ab" * 32}]}  # fmt: skip


def written(path, result, character=None):
    values = [character or synthetic.character(), synthetic.animation(), result]
    content = PageContent("optimize shot.usda", WORDS, ORIGIN)
    run = (
        host_with(PLUGINS / "figures", PLUGINS / "html_report")
        .run([*values, content, OutputPaths(html=str(path))], [HtmlPage])
        .finish()
    )
    assert run.get(HtmlPage) == HtmlPage(str(path)), [row.reason or row.error for row in run.results]
    return path


@pytest.fixture(scope="module")
def optimized(tmp_path_factory):
    return written(tmp_path_factory.mktemp("pages") / "optimized.html", synthetic.result())


def script(text, name):
    return re.search(rf'<script type="[^"]*" id="{name}">(.*?)</script>', text, re.DOTALL)[1]


def unpacked(text, name):
    """A function that reads an array by its entry: the inverse of `Packing`, written anew."""
    block = gzip.decompress(base64.b64decode(script(text, f"{name}-arrays")))

    def read(entry):
        size = int(np.prod(entry["shape"]))
        planes = np.frombuffer(block, np.uint8, 4 * size, entry["at"]).reshape(4, size)
        numbers = np.ascontiguousarray(planes.T).view("<i4" if "unit" in entry else "<f4").reshape(entry["shape"])
        for _ in range(entry.get("order", 0)):
            numbers = np.cumsum(numbers, axis=-1, dtype=np.int32)
        return numbers * entry.get("unit", 1.0)

    return read


def test_a_page_is_whole_small_and_asks_for_nothing(optimized):
    text = optimized.read_text(encoding="utf-8")
    assert optimized.stat().st_size < LARGEST
    assert "default-src 'none'" in text
    own = text.replace(page.three(), "")
    assert not re.search(r"https?://|//cdn|\bsrc=|@import|url\(", own.replace("url(#c", ""))
    assert "Three.js Authors" in text and "SPDX-License-Identifier: MIT" in text
    data = json.loads(script(text, "data"))
    assert [group["title"] for group in data["charts"]] == [
        "Errors over time", "Spectra of the errors", "Motors", "The search"
    ]  # fmt: skip
    for part in ("The largest error falls from 30 mm to 2 mm", "/Robot/&lt;Tip&gt;", "Modes above 40 Hz &amp; more.",
                 "calmotion optimize shot.usda", "ab" * 32, "prefers-color-scheme: dark"):  # fmt: skip
        assert part in text.replace("<wbr>", "")
    assert text.index("The largest error falls") < text.index('id="player"') < text.index("Modes above 40 Hz")


def test_the_motions_in_a_page_are_those_of_the_result(optimized):
    text = optimized.read_text(encoding="utf-8")
    shown, read, result = json.loads(script(text, "data"))["scene"], unpacked(text, "scene"), synthetic.result()
    times = np.linspace(0.0, shown["end"], shown["count"])
    assert shown["end"] == synthetic.animation().frame_times[-1] and len(shown["runs"]) == 2
    reference = read(shown["reference"]["positions"]).T.reshape(-1, 3, 3)
    turned = read(shown["reference"]["rotations"]).T.reshape(-1, 3, 4)
    for number, simulation in enumerate((result.before, result.after)):
        motion, run = sample_motion(simulation.motion, times), shown["runs"][number]
        found = reference + read(run["positions"]).T.reshape(-1, 3, 3)
        np.testing.assert_allclose(found, motion.positions, atol=5e-6)
        vectors = read(run["rotations"]).T.reshape(-1, 3)
        own = Rotation.from_rotvec(vectors) * Rotation.from_quat(turned.reshape(-1, 4)[:, [1, 2, 3, 0]])
        other = Rotation.from_quat(motion.rotations.reshape(-1, 4)[:, [1, 2, 3, 0]])
        assert (own * other.inv()).magnitude().max() < 2e-5
        beam = next(surface for surface in shown["surfaces"] if "fields" in surface)
        field = read(beam["fields"]).reshape(3, -1)
        tips = np.abs(np.outer(read(run["shapes"]["1"])[0], field[1])).max(axis=1)
        np.testing.assert_allclose(tips, np.abs(motion.elastic[1][:, 0]), atol=1e-5)
    largest = max(result.before.position_errors[result.before.motion.judged].max(axis=0))
    assert shown["largest"] == pytest.approx(largest)


def test_a_simulation_shows_one_robot_and_a_long_one_at_a_lower_rate(tmp_path, monkeypatch):
    text = written(tmp_path / "one.html", synthetic.result(optimized=False)).read_text(encoding="utf-8")
    data = json.loads(script(text, "data"))
    assert len(data["scene"]["runs"]) == 1
    monkeypatch.setattr(scene, "LARGEST", 2600)
    detail = scene.Detail(1000, 240.0)
    small = scene.scene_of(synthetic.character(), synthetic.animation(), synthetic.result(), detail)
    assert len(small["arrays"]) <= 2600 and small["count"] < data["scene"]["count"]


def test_targets_have_their_own_names():
    character, result = synthetic.character(), synthetic.result()
    targets = tuple(dataclasses.replace(character.targets[0], path=path) for path in ("/Robot/Tip/B", "/Robot/A"))
    both = dataclasses.replace(character, targets=targets)
    assert scene.scene_of(both, synthetic.animation(), result, scene.Detail(9000, 60.0))["targets"] == ["B", "A"]


def test_a_robot_without_surfaces_and_a_report_without_a_motion_have_pages(tmp_path):
    bare = dataclasses.replace(
        synthetic.character(),
        bodies=tuple(dataclasses.replace(body, surfaces=()) for body in synthetic.character().bodies),
    )
    text = written(tmp_path / "bare.html", synthetic.result(), bare).read_text(encoding="utf-8")
    assert json.loads(script(text, "data"))["scene"] is None and "Three.js" not in text
    content = PageContent("diagnose take.csv", WORDS)
    host_with(PLUGINS / "html_report").run(
        [content, OutputPaths(html=str(tmp_path / "words.html"))], [HtmlPage]
    ).finish()
    assert "The largest error falls" in (tmp_path / "words.html").read_text(encoding="utf-8")


def test_a_page_that_cannot_be_written_says_so(tmp_path):
    with pytest.raises(ShotError, match="cannot be written"):
        page.write_page(str(tmp_path), PageContent("t", WORDS), (), None)


def sphere(count):
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, count), np.linspace(0.01, np.pi - 0.01, count))
    points = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1).reshape(-1, 3)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    quads = np.stack([corner, corner + 1, corner + count + 1, corner + count], axis=1)
    return points, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32)


@pytest.mark.parametrize("count", [500, 3000])
def test_a_fine_surface_gets_as_many_triangles_as_are_asked_for(count):
    points, triangles = sphere(80)
    kept, coarse = scene.thinned(points, triangles, count)
    assert 0.3 * count < len(coarse) <= count
    corners = points[kept][coarse]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(4.0 * np.pi, rel=0.12)
    same, whole = scene.thinned(points, triangles, len(triangles))
    np.testing.assert_array_equal(points[same][whole], points[triangles])


@pytest.mark.parametrize(
    ("sizes", "total", "most"),
    [([12, 12, 5000, 900], 2000, 1076), ([12, 40], 2000, 40), ([8, 8, 8], 12, 4), ([], 5, 0)],
)
def test_only_the_finest_surfaces_are_thinned(sizes, total, most):
    assert scene.evenly(sizes, total) == most
    assert sum(min(size, most) for size in sizes) <= total


def test_the_whole_motion_is_in_the_picture_and_fills_it(chromium, optimized):
    chromium.open(optimized)
    for turn, lift, width, height in ((0.0, 0.3, 560, 460), (1.0, -0.4, 370, 310), (2.5, 1.2, 560, 460)):
        largest = chromium.value(
            f"(() => {{ player.turn = {turn}; player.lift = {lift}; player.aim({width}, {height}); "
            "player.camera.updateMatrixWorld(); return Math.max(...player.scene.outermost.map(p => { const q = "
            "new THREE.Vector3(...p).add(player.center).project(player.camera); "
            "return Math.max(Math.abs(q.x), Math.abs(q.y)); })); })()"
        )
        assert 0.8 < largest <= 1.0


def test_a_figure_keeps_its_lines_labels_limits_and_marks():
    figure = Figure()
    upper, lower = figure.subplots(2, 1, sharex=True)
    times = np.linspace(0.0, 10.0, 20001)
    peak = np.where(np.arange(20001) == 7777, 5.0, 0.1 * np.sin(times))
    upper.plot(times, peak, color="#d55e00", linestyle="--", label="before")
    upper.set_title("/Arm/Tip", loc="left")
    lower.semilogy(times, 1.0 + times, ".", color="#123456")
    lower.axvline(3.0, color="#7f7f7f", label="a mode")
    lower.axhline(2.0)
    lower.axvspan(4.0, 5.0)
    lower.text(4.5, 0.1, "the elbow", transform=lower.get_xaxis_transform())
    lower.set_xlabel("time [s]")
    rows = Figure()
    listed = rows.subplots()
    listed.plot([3.0, 1.0], [0, 1], "o", label="before")
    listed.set_yticks([0, 1], ["lamp", "bartender"])
    shown = charts.charts_of([("Errors", figure), ("Shots", rows)])
    first, second = shown["groups"][0]["panels"]
    assert shown["groups"][1]["panels"][0]["rows"] == [[0, "lamp"], [1, "bartender"]] and not first["rows"]
    read = unpacked(f'<script type="t" id="a-arrays">{shown["arrays"]}</script>', "a")
    assert first["title"] == "/Arm/Tip" and first["xlabel"] == second["xlabel"] == "time [s]"
    (curve,) = first["curves"]
    assert curve["color"] == "var(--before)" and curve["dashed"] and curve["label"] == "before"
    assert read(curve["y"]).max() == 5.0 and len(read(curve["x"])) < 2000
    assert second["ylog"] and second["curves"][0]["dots"]
    assert {"x": 3.0, "color": "var(--limit)", "label": "a mode"} in second["marks"]
    assert [mark["y"] for mark in second["marks"] if "y" in mark] == [2.0]
    ((low, high, label),) = second["spans"]
    assert (low, high) == pytest.approx((4.0, 5.0)) and label == "the elbow"


def test_the_command_writes_a_page_with_the_words_of_its_report(calmotion, tmp_path):
    shot, file = tmp_path / "shot.usda", tmp_path / "page.html"
    shot.write_text(ONE_HINGE)
    done = calmotion("simulate", shot, "--html", file)
    assert done.returncode == 0, done.stderr
    assert f"wrote {file}" in done.stdout
    text = file.read_text(encoding="utf-8")
    assert f"<p>{done.stdout.splitlines()[0]}</p>" in text
    assert "SHA-256" in text and "Simplifications" in text
    manifest = tmp_path / "manifest.json"
    report = json.loads(calmotion("simulate", shot, "--html", file, "--manifest", manifest, "--json").stdout)
    assert report["html"] == str(file)
    page_row = {"path": "page.html", "role": "page", "sha256": sha256_of(file)}
    assert page_row in json.loads(manifest.read_text())["outputs"]
    for named, error in ((shot, "never overwritten"), ("page.pdf", "Name a .html file.")):
        done = calmotion("simulate", shot, "--html", named)
        assert done.returncode == 2 and error in done.stderr


def test_python_writes_the_page_of_the_command(calmotion, tmp_path):
    shot = tmp_path / "shot.usda"
    shot.write_text(ONE_HINGE)
    calmotion("simulate", shot, "--html", tmp_path / "command.html")
    assert cm.write_page(cm.simulate(shot), tmp_path / "python.html") == str(tmp_path / "python.html")
    pages = [(tmp_path / f"{name}.html").read_text(encoding="utf-8") for name in ("command", "python")]
    assert len({text.split('id="player"')[0] for text in pages}) == 1, "the same words"
    assert len({script(text, "scene-arrays") for text in pages}) == 1, "the same motion"


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    if CHROMIUM is None:
        pytest.skip("there is no Chromium")
    with Chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.parametrize("width, dark", [(1280, False), (390, True)])
def test_a_browser_shows_a_page_without_complaints_or_requests(chromium, optimized, width, dark):
    chromium.open(optimized, width, dark)
    assert chromium.complaints == []
    assert chromium.requests == [optimized.resolve().as_uri()]
    assert chromium.value("document.documentElement.scrollWidth") <= width
    panels = chromium.value("document.querySelectorAll('figure').length")
    curves = chromium.value("[...document.querySelectorAll('figure')].filter(f => f.querySelector('path')).length")
    assert panels == curves == 9
    chromium.value("player.frame(0)")
    views = "[...document.querySelectorAll('.view span')]"
    assert chromium.value(f"{views}.every(n => n.textContent)")
    assert chromium.value(f"Math.max(...{views}.map(n => n.getBoundingClientRect().right))") <= width
    small = "[...document.querySelectorAll('p, td, figcaption, button')]"
    assert chromium.value(f"Math.min(...{small}.map(n => parseFloat(getComputedStyle(n).fontSize)))") >= 11.5
    dark_page = chromium.value("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", dark_page))) < 200) == dark


def test_scrubbing_moves_both_robots_to_where_the_result_has_them(chromium, optimized):
    chromium.open(optimized)
    assert chromium.value("player.robots.length") == 3, "a ghost, before, after"
    result = synthetic.result()
    for time in (0.0, 0.3, 0.55):
        chromium.value(f"player.scrub.value = {time}; player.scrub.dispatchEvent(new Event('input'))")
        for robot, run in ((1, result.before), (2, result.after)):
            found = chromium.value(f"player.robots[{robot}].bodies.get(2).position.toArray()")
            at = float(chromium.value("player.time"))
            np.testing.assert_allclose(found, sample_motion(run.motion, np.array([at])).positions[0, 2], atol=1e-4)
    cursor = chromium.value("+document.querySelector('figure .cursor').getAttribute('x1')")
    assert cursor == pytest.approx(chromium.value("charts[0].X(player.time)"), abs=0.1)


def test_the_player_draws_both_robots_and_shows_errors_enlarged(chromium, optimized):
    chromium.open(optimized)
    chromium.value("player.seek(0.3)")
    count = (
        "(() => { player.frame(0); const gl = player.renderer.getContext(), w = gl.drawingBufferWidth, "
        "h = gl.drawingBufferHeight, p = new Uint8Array(4 * w * h); gl.readPixels(0, 0, w, h, gl.RGBA, "
        "gl.UNSIGNED_BYTE, p); const seen = [0, 0]; for (let k = 0; k < w * h; k++) if (Math.abs(p[4 * k] - p[0]) > 9) "
        "seen[2 * (k % w) < w ? 0 : 1]++; return seen; })()"
    )
    left, right = chromium.value(count)
    assert left > 300 and right > 300
    plain = np.array(chromium.value("player.robots[1].bodies.get(2).position.toArray()"))
    ghost = np.array(chromium.value("player.robots[0].bodies.get(2).position.toArray()"))
    chromium.value("player.factor = 10; player.seek(0.3)")
    enlarged = np.array(chromium.value("player.robots[1].bodies.get(2).position.toArray()"))
    np.testing.assert_allclose(enlarged - ghost, 10.0 * (plain - ghost), atol=1e-6)


def test_pointing_at_a_curve_shows_its_value(chromium, optimized):
    chromium.open(optimized)
    chromium.value(
        "charts[0].box.dispatchEvent(Object.assign(new PointerEvent('pointermove'), {})); "
        "charts[0].hover({offsetX: charts[0].X(0.3)})"
    )
    said = chromium.value("charts[0].tip.innerText")
    result = synthetic.result()
    error = 1e3 * np.interp(0.3, result.before.motion.times, result.before.position_errors[:, 0])
    assert not chromium.value("charts[0].tip.hidden")
    found = [float(value) for value in re.findall(r"before ([\d.]+)", said)]
    assert found == [pytest.approx(error, rel=0.1)]
