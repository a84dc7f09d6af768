"""An independent model of a flexible strip that a motor turns: a beam of two modes with a load.

A strip is clamped to a hub at a distance from the axis and carries a rigid load at its end. With the end's deflection w
and rotation p relative to the hub as coordinates (a cubic beam element, Euler and Bernoulli), the modes k answer to the
angle of the hub t by

    q_k'' + 2 z w_k q_k' + w_k^2 q_k = -G_k t'',    strain at the root ~ 2 w / L - 2 p / 3

and the gauge's signal passes a filter of second order. Gain, offset and the free motion of both modes at the start are
linear, and are fitted with every modulus, damping, and corner and damping of the filter.

Source: Meirovitch, Fundamentals of Vibrations, 2001, section 8.10 (assumed modes of a beam with a tip mass).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from calmotion.arrays import Array
from scipy.optimize import least_squares
from scipy.signal import lsim


@dataclass(frozen=True)
class Strip:
    """What is known of the strip, its load and its gauge.

    Attributes:
        length, width, thickness: [m].
        root: Distance of the clamp from the axis [m].
        density, modulus: Of the strip [kg/m^3], [Pa].
        load: [kg], its centre at the end of the strip.
        inertia: Of the load about its centre [kg m^2].
        corner, filter_damping: Of the gauge's filter [Hz], [-].
    """

    length: float
    width: float
    thickness: float
    root: float
    density: float
    modulus: float
    load: float
    inertia: float
    corner: float
    filter_damping: float

    def modes(self) -> tuple[Array, Array, Array, Array]:
        """Circular frequencies [rad/s], answers to the hub's acceleration, strains, and deflections of the end of both
        modes, shape [2] each."""
        L = self.length
        stiffness = self.modulus * self.width * self.thickness**3 / 12.0
        K = stiffness / L**3 * np.array([[12.0, -6.0 * L], [-6.0 * L, 4.0 * L * L]])
        own = self.density * self.width * self.thickness * L
        M = np.diag([self.load, self.inertia])
        M = M + own / 420.0 * np.array([[156.0, -22.0 * L], [-22.0 * L, 4.0 * L * L]])
        s = np.linspace(0.0, 1.0, 401)
        shapes = np.stack([3.0 * s**2 - 2.0 * s**3, L * (s**3 - s**2)])
        turned = np.array([self.load * (self.root + L), self.inertia])
        turned = turned + own * np.trapezoid(shapes * (self.root + L * s), s, axis=1)
        half = np.linalg.inv(np.linalg.cholesky(M))
        squares, vectors = np.linalg.eigh(half @ K @ half.T)
        shape = half.T @ vectors
        return np.sqrt(squares), shape.T @ turned, np.array([2.0 / L, -2.0 / 3.0]) @ shape, shape[0]

    def end(self, times: Array, hub: Array, damping: float) -> Array:
        """Path of the end of the strip [m] while the hub turns from rest, shape [n].

        Args:
            times: Uniform [s], shape [n].
            hub: Angle [rad], shape [n].
            damping: Ratio of both modes.
        """
        path = (self.root + self.length) * hub
        for w, turned, _, deflection in zip(*self.modes(), strict=True):
            system = ([-turned, 0.0, 0.0], [1.0, 2.0 * damping * w, w * w])
            path = path + deflection * lsim(system, hub - hub[0], times - times[0])[1]
        return np.asarray(path)


@dataclass(frozen=True, eq=False)
class Reading:
    """A recording: angle of the hub [rad] and the gauge's signal at uniform times [s], shape [n] each."""

    times: Array
    hub: Array
    signal: Array

    @property
    def shake(self) -> float:
        """Root mean square of the signal about its mean."""
        return float(self.signal.std())


@dataclass(frozen=True)
class Fitted:
    """Modulus over that of `Strip`, damping ratio, gain of the gauge, frequencies [Hz] with them, and the share of the
    signals' shake that is left."""

    modulus: float
    damping: float
    gain: float
    frequencies: tuple[float, float]
    left: float
    strip: Strip = field(repr=False)

    def largest_error_mm(self, times: Array, hub: Array, aim: Array) -> float:
        """Largest distance of the strip's end from that of a rigid strip at the angles `aim` [mm].

        Args:
            times, hub, aim: Uniform [s], [rad], [rad], shape [n] each.
        """
        path = (self.strip.root + self.strip.length) * aim
        return float(1e3 * np.abs(self.strip.end(times, hub, self.damping) - path).max())


def _columns(strip: Strip, damping: float, reading: Reading) -> tuple[Array, Array]:
    """Answer to the hub's motion with a gain of 1, shape [n], and what is free: swings of the modes, and an offset."""
    times = reading.times - reading.times[0]
    w, turned, strains, _ = strip.modes()
    f, answer, free = 2.0 * np.pi * strip.corner, np.zeros(len(times)), []
    low_pass = [1.0, 2.0 * strip.filter_damping * f, f * f]
    for k in range(2):
        # -G s^2 of the mode and the filter together are proper: the hub's angle is not differentiated
        system = ([-turned[k] * f * f, 0.0, 0.0], np.polymul([1.0, 2.0 * damping * w[k], w[k] ** 2], low_pass))
        answer = answer + strains[k] * lsim(system, reading.hub - reading.hub[0], times)[1]
        swing = np.exp(w[k] * (1j * np.sqrt(1.0 - damping**2) - damping) * times)
        free += [swing.real, swing.imag]
    return answer, np.stack([*free, np.ones(len(times))], axis=1)


def predicted(found: Fitted, reading: Reading) -> float:
    """Share of the shake of another recording that is left by a fit; its free swing and offset alone are fitted."""
    answer, free = _columns(found.strip, found.damping, reading)
    off = reading.signal - found.gain * answer
    return float((off - free @ np.linalg.lstsq(free, off, rcond=None)[0]).std()) / reading.shake


def fitted(strip: Strip, readings: Sequence[Reading]) -> Fitted:
    """Modulus, damping and gain that explain recordings best."""

    def solved(x: Array) -> tuple[Strip, float, Array]:
        modulus, damping, corner, filter_damping = (float(v) for v in np.exp(x))
        own = replace(strip, modulus=modulus * strip.modulus, corner=corner * strip.corner,
                      filter_damping=filter_damping * strip.filter_damping)  # fmt: skip
        rows, values, first = [], [], 1
        total = 1 + 5 * len(readings)
        for reading in readings:
            answer, free = _columns(own, damping, reading)
            row = np.zeros((len(answer), total))
            row[:, 0], row[:, first : first + 5], first = answer, free, first + 5
            rows.append(row / reading.shake)
            values.append(reading.signal / reading.shake)
        A, b = np.concatenate(rows), np.concatenate(values)
        best = np.linalg.lstsq(A, b, rcond=None)[0]
        return own, float(best[0]), b - A @ best

    starts = [np.log([e, z, 1.0, 1.0]) for e in (0.5, 0.7, 1.0, 1.4) for z in (0.02, 0.1)]
    bounds = np.log([[0.1, 1e-3, 0.5, 0.3], [10.0, 0.7, 2.0, 3.0]])
    found = min((least_squares(lambda x: solved(x)[2], x, bounds=bounds) for x in starts), key=lambda item: item.cost)
    own, gain, off = solved(found.x)
    first, second = (float(w) / (2.0 * np.pi) for w in own.modes()[0])
    modulus, damping = (float(v) for v in np.exp(found.x[:2]))
    return Fitted(modulus, damping, gain, (first, second), float(np.sqrt(np.mean(off**2))), own)
