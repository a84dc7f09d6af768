"""Players of exported files that share nothing with Calmotion: they parse the files and interpolate on their own."""

import csv
import json
import re

import numpy as np
import yaml
from scipy.interpolate import BPoly

SETTLED = 0.01  # within which a motor reaches a held command [s]


def replay_trajectory(message, names, at):
    """A JointTrajectory as joint_trajectory_controller interpolates it."""
    order = [message["joint_names"].index(name) for name in names]
    points = message["points"]
    times = np.array([p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points])
    fields = [f for f in ("positions", "velocities", "accelerations") if f in points[0] and len(points[0][f])]
    values = np.array([[np.array(p[f])[order] for f in fields] for p in points])
    if len(fields) == 1:
        return lines(at, times, values[:, 0])
    return BPoly.from_derivatives(times, values)(np.clip(at, 0.0, times[-1]))


def replay_ros2(files, names, at):
    with open(files[0]) as stream:
        return replay_trajectory(yaml.safe_load(stream), names, at)


def replay_csv(files, names, at):
    with open(files[0], newline="") as stream:
        text = stream.read().splitlines()
    facts = dict(line[2:].split(": ", 1) for line in text if line.startswith("# ") and ": " in line)
    head, *rows = csv.reader(line for line in text if not line.startswith("#"))
    table = np.array(rows, float)
    times, values = table[:, 0], table[:, [head.index(f"/Arm/{name}") for name in names]]
    if facts["player"] == "hold":
        return held(at, times, values, np.array(facts["start"].split(", "), float))
    assert facts["player"] == "linear"
    return lines(at, times, values)


def replay_ticks(files, names, at):
    """From the header for C, which the export does not read."""
    with open(files[1]) as stream:
        text = stream.read()
    rate = float(re.search(r"_RATE_HZ ([\d.]+)", text)[1])
    start = np.array(re.search(r"_start\[\d+\] = \{(.*?)\}", text)[1].split(","), float)
    rows = re.findall(r"^    \{(.*?)\},", text, re.MULTILINE)
    ticks = np.array([row.split(",") for row in rows], float)
    to_angle = 2.0 * np.pi / 4096
    return held(at, np.arange(len(ticks)) / rate, (ticks - 2048) * to_angle, (start - 2048) * to_angle)


def replay_ur(files, names, at):
    """The law of the note, integrated by the semi-implicit Euler method with steps of 20 microseconds."""
    with open(files[0]) as stream:
        text = stream.read()
    number = r"([-\d.e]+)"
    q = np.array(re.search(r"movej\(\[(.*?)\]", text)[1].split(","), float)
    found = re.findall(rf"servoj\(\[(.*?)\], 0, 0, {number}, {number}, {number}\)", text)
    h, v, track = 2e-5, np.zeros(6), [q]
    for row, period, lookahead, gain in found:
        command = np.array(row.split(","), float)
        for _ in range(round(float(period) / h)):
            v = v + h * float(gain) * (command - q - float(lookahead) * v)
            q = q + h * v
            track.append(q)
    return lines(at, h * np.arange(len(track)), np.array(track))


def replay_bottango(files, names, at):
    with open(files[1]) as stream:
        motors = {entry["name"]: entry for entry in json.load(stream)["motors"]}
    with open(files[0]) as stream:
        rows = [line.strip().split(",") for line in stream]
    columns = []
    for name in names:
        column, motor = np.empty(len(at)), motors[name]
        for row in (row for row in rows if row[:2] == ["sC", motor["id"]]):
            start, duration, y0, x1, y1, y3, x2, y2 = map(int, row[2:])
            p = np.array([(0, y0), (x1, y0 + y1), (duration + x2, y3 + y2), (duration, y3)], float)
            inside = (1e3 * at >= start - 1e-6) & (1e3 * at <= start + duration + 1e-6)
            column[inside] = casteljau(p, 1e3 * at[inside] - start) / 8192
        columns.append(motor["minimum"] + (motor["maximum"] - motor["minimum"]) * column)
    return np.stack(columns, axis=1)


def lines(at, times, values):
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def held(at, times, values, start):
    """Each command is reached at constant speed."""
    reach = min(SETTLED, times[1] - times[0])
    n = np.clip(np.searchsorted(times, at + 1e-12, side="right") - 1, 0, len(times) - 1)
    before = np.where((n > 0)[:, None], values[np.maximum(n - 1, 0)], start)
    share = np.clip((at - times[n]) / reach, 0.0, 1.0)[:, None]
    return before + share * (values[n] - before)


def casteljau(p, x):
    """Value of a cubic Bezier curve where its first coordinate is x, by bisection."""

    def at(u, c):
        a = [c[k] + u * (c[k + 1] - c[k]) for k in range(3)]
        b = [a[k] + u * (a[k + 1] - a[k]) for k in range(2)]
        return b[0] + u * (b[1] - b[0])

    low, high = np.zeros_like(x), np.ones_like(x)
    for _ in range(45):
        u = 0.5 * (low + high)
        early = at(u, p[:, 0]) < x
        low, high = np.where(early, u, low), np.where(early, high, u)
    return at(0.5 * (low + high), p[:, 1])
