"""Commands for a robot from a stream, tick by tick."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.host import SettingError, nearest
from calmotion.model import PRESCRIBED, RunSettings, tolerance_of
from calmotion.multibody import SimulationFailure, State, VelocityForces, pose_model
from calmotion.simulation import CompiledShot, coupling_of, leaders, prepare

from .regulation.efforts import EffortLimits
from .regulation.gains import Gains, Weighting, gains_at
from .regulation.guard import Guard
from .regulation.limits import EFFORT, MotorLimits
from .regulation.regulator import Regulator, Window
from .regulation.renewal import Renewal
from .regulation.robustness import EQUAL, affordable_others
from .settings import LiveSettings, notes_of, refuse_unfit
from .stream import Stream

Angles = TypeVar("Angles", Array, Mapping[str, float], None)


class Live:
    """A robot that follows a stream of joint angles `latency_s` later, without shaking.

    Args:
        shot: The robot; it begins at rest in the pose of the first frame.

    Attributes:
        joints: Paths of the motors' joints, the order of arrays.
        names: Number in `joints` of each path, and of each last part of one that no other path has (`Elbow`, `/Elbow`).
        start: The pose of the first frame [rad or m], shape [M].
        tick_s: Time between two commands [s].
        character, model, world: The robot, as the engine has it; moving roots stand as in the first frame.
        unknown: How often a sample had a joint that the robot does not have, by its path.
        notes: What is left out for this robot.

    Raises:
        ShotError: Feet that come and go, or a pose without equilibrium.
        SettingError: A rate or a look-ahead that does not fit, or that this machine cannot keep.
    """

    def __init__(self, shot: CompiledShot, settings: LiveSettings | None = None):
        self.settings = settings = settings or LiveSettings()
        character = shot.character
        refuse_unfit(shot, settings)
        self.joints = tuple(motor.path for motor in character.motors)
        last = [path.rpartition("/")[2] for path in self.joints]
        short = {name: k for k, name in enumerate(last) if last.count(name) == 1}
        self.names = short | {f"/{name}": k for name, k in short.items()} | {p: k for k, p in enumerate(self.joints)}
        self.tick_s = 1.0 / settings.rate
        self._window_ticks = 1 + round(settings.lookahead * settings.rate)
        self.character, self.model = character, shot.model
        self.world = prepare(shot, RunSettings(pre_roll=0.0)).world[0]
        self._follows = [(k, motor.follows) for k, motor in enumerate(character.motors) if motor.follows is not None]
        self._limits = MotorLimits.of(character, self.tick_s)
        self._deviating: IntArray = leaders(character)
        self._coupling = coupling_of(character, self._deviating)
        period = 1.0 / settings.sender_rate if settings.sender_rate else self.tick_s
        self._stream = Stream(self._limits, settings.lookahead, period)
        forces = VelocityForces(self.model, self.world)
        self._window = Window(self._window_ticks, self._limits, forces)
        self._efforts = EffortLimits(character.motors, self.tick_s, forces.known)
        self._weighting = self._weighting_of(shot)
        self._guard = Guard(self.tick_s)
        self._regulator = Regulator(self._coupling, self._deviating, self._limits, self._efforts, self._guard)
        self._renewal = Renewal(self._gains, settings.background)
        self._closed = len(self.model.system.rows) > len(self.model.system.parent)
        self._delay = max((motor.delay for motor in character.motors if motor.model != PRESCRIBED), default=0.0)
        self.notes = notes_of(shot, forces)
        curves = shot.animation.current
        ends = np.linspace(0.0, float(shot.animation.frame_times[-1]), LiveSettings.POSES)
        poses = np.stack([np.interp(ends, track.times, track.values) for track in curves], axis=1)
        self.start: Array = poses[0]
        self._count_others(poses)
        self.reset(self.start)
        self._refuse_slow()

    @property
    def latency_s(self) -> float:
        """How much later than its sample the robot does what was asked [s]."""
        return (self._window_ticks - 1) * self.tick_s + self._stream.delay + self._delay

    @property
    def limited(self) -> tuple[str, ...]:
        """Joints at whose limits the last commands were kept, or whose motors have less effort than they need."""
        return tuple(self.joints[k] for k in np.flatnonzero(self._acted >= 0))

    @property
    def ahead_s(self) -> float:
        """For how long there are samples that are not played yet [s]."""
        return self._stream.ahead_s

    @property
    def late(self) -> int:
        """Ticks without a sample in time, so far."""
        return self._stream.events["late"]

    def reset(self, pose: Array | Mapping[str, float]) -> None:
        """Rest at a pose, and forget the stream.

        Args:
            pose: Of all motors [rad or m], in the order of `joints` or by `names`.

        Raises:
            SettingError: A joint that does not exist, or a pose of another size.
            ShotError: The robot has no equilibrium there.
        """
        self._sample = self.start.copy()
        position = np.clip(self._values(pose), self._limits.lower, self._limits.upper)
        self._sample = position
        begin = time.thread_time()
        self._near: State | None = None
        try:
            gains = self._gains(position)
        except SimulationFailure as failure:
            raise ShotError(
                "the robot has no static equilibrium in the pose in which it begins",
                remedy="Begin in another pose, or see what calmotion inspect says of the shot.",
            ) from failure
        self._gains_s = time.thread_time() - begin
        self._renewal.begin(position, gains)
        self._stream.begin(position)
        self._window.begin(position)
        self._regulator.begin(position, gains)
        self._acted = np.full(len(self.joints), -1)
        self._counts: Counter[int] = Counter()
        self.unknown: Counter[str] = Counter()
        self._ticks, self._since, self._largest = 0, 0, 0.0
        self._needed = np.zeros(len(self.joints))
        self._spent: deque[float] = deque(maxlen=20_000)

    def step(self, time_s: float, angles: Angles) -> Angles | Array:
        """One tick: a sample, if one has arrived, and the commands.

        Args:
            time_s: Time of the sample by the sender's clock [s].
            angles: Of the motors [rad or m]: an array in the order of `joints`, or a mapping from `names`, in which
                joints that are left out stay; None where nothing has arrived.

        Returns:
            The commands in the form of the sample; an array where there was none.

        Raises:
            SettingError: A joint that does not exist, or an array of another size.
        """
        if angles is not None:
            self.give(time_s, angles)
        commands = self.advance()
        if isinstance(angles, Mapping):
            return dict(zip(self.joints, commands.tolist(), strict=True))  # type: ignore[return-value]
        return commands

    def give(self, time_s: float, angles: Array | Mapping[str, float]) -> None:
        """A sample has arrived; see `step`. Several may arrive before a tick."""
        values = self._values(angles)
        if self._stream.give(time_s, values):
            self._sample = values

    def end(self) -> None:
        """No sample will come any more; further ticks lead to rest."""
        self._stream.end()

    def advance(self) -> Array:
        """The commands of the next tick [rad or m], shape [M], in the order of `joints`."""
        begin = time.perf_counter()
        self._window.push(self._stream.advance())
        gains = self._renewal.poll()
        if gains is not None:
            self._regulator.use(gains)
        commands, self._acted = self._regulator.advance(self._window)
        self._needed = np.maximum(self._needed, self._efforts.needed)
        self._acted[self._efforts.needed > 1.0] = EFFORT
        self._counts.update(np.flatnonzero(self._acted >= 0).tolist())
        self._ticks += 1
        self._since += 1
        ahead = round(LiveSettings.RENEWAL_S * self.settings.rate)
        if self.settings.background or self._since >= ahead:
            self._since = 0
            self._renewal.ask(self._window.positions[min(1 + ahead // 2, self._window_ticks)])
        self._largest = max(self._largest, float(np.abs(self._regulator.deviation).max(initial=0.0)))
        self._spent.append(time.perf_counter() - begin)
        return commands

    @property
    def played(self) -> Array:
        """The intended motion of the moment, which is that of `latency_s` ago [rad or m], shape [M]."""
        return self._window.played

    def report(self) -> dict[str, Any]:
        """What happened since the last `reset`: ticks, events of the stream, limits that acted, times of ticks."""
        spent = np.array(self._spent) if self._spent else np.zeros(1)
        return {
            "ticks": self._ticks,
            "samples": self._stream.count,
            "sender_rate": self._stream.sender_rate,
            "latency_s": self.latency_s,
            "events": dict(self._stream.events),
            "unknown_joints": dict(self.unknown),
            "limited": {self.joints[k]: count for k, count in sorted(self._counts.items())},
            "too_weak": {self.joints[k]: float(self._needed[k]) for k in np.flatnonzero(self._needed > 1.0)},
            "largest_deviation": self._largest,
            "let_go": self._guard.count,
            "uncertainty": self._weighting.spread,
            "renewal_s": self._gains_s,
            "renewals": self._renewal.done,
            "renewals_failed": self._renewal.failed,
            "tick_s": {
                "median": float(np.median(spent)),
                "p99": float(np.quantile(spent, 0.99)),
                "largest": float(spent.max()),
            },
            "notes": list(self.notes),
        }

    def close(self) -> None:
        """End the thread."""
        self._renewal.close()

    def __enter__(self) -> Live:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _values(self, angles: Array | Mapping[str, float]) -> Array:
        values = self._sample.copy()
        if isinstance(angles, Mapping):
            for path, value in angles.items():
                if path not in self.names:
                    raise SettingError(
                        "the robot has no motor of this name",
                        path=path,
                        remedy=f"{nearest(path, self.joints)}Its motors are {', '.join(self.joints)}.",
                    )
                values[self.names[path]] = value
        else:
            given = np.asarray(angles, dtype=float)
            if given.shape != values.shape:
                raise SettingError(
                    "the sample has another number of values than the robot has motors",
                    found=given.shape,
                    remedy=f"Give {len(values)}, in this order: {', '.join(self.joints)}.",
                )
            values = given.copy()
        for k, follows in self._follows:
            values[k] = follows.offset + follows.ratio * values[follows.leader]
        return values

    def _weighting_of(self, shot: CompiledShot) -> Weighting:
        settings, targets = self.settings, shot.model.targets
        largest = np.array([shot.character.motors[k].max_acceleration for k in self._deviating])
        largest = np.where(np.isfinite(largest), largest, LiveSettings.ACCELERATION)
        weights = np.stack([targets.position_weight, targets.rotation_weight], axis=1)
        return Weighting(
            self.tick_s,
            self._window_ticks,
            np.sqrt(np.repeat(weights, 3, axis=1)),
            LiveSettings.PENALTY * tolerance_of(shot.character, settings.tolerance) / (largest * self.tick_s),
            0.0,
            limited=self._efforts.limited,
        )

    def _count_others(self, poses: Array) -> None:
        """Let robots of other frequencies count as they are asked for, or as much as that of the model allows in poses.

        Args:
            poses: Of the shot, shape [P, M]: what is spared in one of them may be lacking in another.
        """
        asked, alone, self._near = self.settings.uncertainty, self._weighting, None
        if asked is not None:
            self._weighting = alone.with_others(asked, EQUAL)
            return

        def gains(share: float, pose: Array) -> Gains:
            self._weighting = alone.with_others(LiveSettings.UNCERTAINTY, share)
            return self._gains(pose)

        share = EQUAL
        try:
            for pose in poses:
                share = affordable_others(partial(gains, pose=pose), self._coupling, self.tick_s, share)
        except SimulationFailure:
            share = 0.0
        self._weighting = alone.with_others(LiveSettings.UNCERTAINTY, share)

    def _gains(self, position: Array) -> Gains:
        # chains that close in several ways stay in theirs
        pose = pose_model(self.model, position, self.world, LiveSettings.HIGHEST * self.settings.rate, self._near)
        self._near = pose.state if self._closed else None
        weighting, tolerance = self._weighting, tolerance_of(self.character, self.settings.tolerance)
        moved = (weighting.targets[..., None] * pose.targets_by_input).reshape(-1, len(self.joints))
        lever = float(np.linalg.norm(moved, axis=0).max(initial=0.0))
        coarser = max(LiveSettings.FINEST * lever / tolerance, 1.0)
        closeness = self.settings.closeness(lever, tolerance, weighting.spread)
        weighting = replace(weighting, penalty=coarser * weighting.penalty, closeness=closeness)
        return gains_at(pose, self._coupling, weighting)

    def _refuse_slow(self) -> None:
        """Some ticks at rest, for the time they take.

        Raises:
            SettingError: More than there is.
        """
        for _ in range(30):
            self.advance()
        needed = float(np.median(np.array(self._spent)[10:]))
        self.reset(self.start)
        if self._gains_s > LiveSettings.SLOW_GAINS_S:
            note = f"gains for a new pose take {self._gains_s:.2g} s; moves that turn the robot faster leave more"
            self.notes = (*self.notes, note)
        if needed > self.tick_s:
            raise SettingError(
                "this machine cannot calm this robot at this rate",
                path="--rate",
                found=f"{self.settings.rate:g} Hz",
                remedy=f"Use at most {0.5 / needed:.0f} Hz; a shorter look-ahead or fewer flexible links are faster.",
            )
