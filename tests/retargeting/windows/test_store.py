"""Windows that are done, on disk: known by their inputs, read only where they fit."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.multibody.model.system import State
from calmotion.retargeting.windows.continued import Beginning
from calmotion.retargeting.windows.plan import plan_windows
from calmotion.retargeting.windows.store import WindowStore, window_keys, windows_path
from long_moves import animation_of, long_moves

OPTIONS = RunSettings(tolerance=1e-3)


def keys_of(arm, animation, options=OPTIONS, h=1 / 240, offsets=None):
    windows = plan_windows(animation.frame_times, 3.0, 1.0)
    shape = len(animation.frame_times), 2
    return window_keys(arm, animation, options, h, windows, np.zeros(shape) if offsets is None else offsets)


def test_a_key_depends_on_what_lies_in_the_window_alone(arm):
    animation = long_moves(9.0)
    times, values = animation.frame_times, [track.values for track in animation.tracks]
    edited = [values[0] + 0.1 * np.exp(-(((times - 8.3) / 0.1) ** 2)) * (np.abs(times - 8.3) < 0.6), values[1]]
    same, other = keys_of(arm, animation), keys_of(arm, animation_of(times, edited))
    assert len(same) == 3 and [a == b for a, b in zip(same, other, strict=True)] == [True, True, False]
    assert keys_of(arm, animation) == same
    longer = keys_of(arm, long_moves(12.0))
    assert len(longer) == 4 and longer[0] == same[0]


@pytest.mark.parametrize("change", ["tolerance", "step", "character", "offsets"])
def test_a_key_depends_on_settings_character_and_where_the_search_begins(arm, change):
    animation = long_moves(6.0)
    other = {
        "tolerance": lambda: keys_of(arm, animation, RunSettings(tolerance=2e-3)),
        "step": lambda: keys_of(arm, animation, h=1 / 480),
        "character": lambda: keys_of(dataclasses.replace(arm, gravity=np.zeros(3)), animation),
        "offsets": lambda: keys_of(arm, animation, offsets=np.ones((145, 2))),
    }[change]()
    assert not set(other) & set(keys_of(arm, animation))


def beginning():
    return Beginning(State(*[np.arange(4.0 * k + 4).reshape(4, -1) for k in range(len(State._fields))]), np.ones(4))


@pytest.fixture
def path(tmp_path):
    return windows_path(str(tmp_path / "calm.usda"))


def test_what_was_kept_is_read_again_to_the_last_bit(path):
    store, offsets = WindowStore(path, ["a" * 64, "b" * 64, "c" * 64]), np.random.default_rng(0).normal(size=(9, 2))
    store.keep(0, offsets, beginning())
    assert path.name == ".calm.usda.windows.npz"
    again = WindowStore(path, store.keys)
    again.load((9, 2))
    assert again.done == [True, False, False] and again.after == 0
    np.testing.assert_array_equal(again.offsets, offsets)
    for one, two in zip(again.beginning.states, beginning().states, strict=True):
        np.testing.assert_array_equal(one, two)
    store.keep(2, offsets, None)
    again = WindowStore(path, store.keys)
    again.load((9, 2))
    assert again.done == [True, False, True] and again.beginning is None


def test_windows_of_other_inputs_are_not_used_and_shots_may_change_their_length(path):
    store = WindowStore(path, ["a" * 64, "b" * 64])
    store.keep(0, np.ones((9, 2)), beginning())
    other = WindowStore(path, ["x" * 64, "y" * 64])
    other.load((9, 2))
    assert other.done == [False, False] and other.offsets is None and other.beginning is None
    longer = WindowStore(path, ["a" * 64, "y" * 64, "z" * 64])
    longer.load((12, 2))
    assert longer.done == [True, False, False] and longer.offsets.shape == (12, 2) and not longer.offsets[9:].any()
    motors = WindowStore(path, store.keys)
    motors.load((9, 3))
    assert motors.done == [False, False]


@pytest.mark.parametrize("damage", ["cut", "text", "missing"])
def test_a_damaged_file_begins_anew(path, damage, caplog):
    store = WindowStore(path, ["a" * 64])
    store.keep(0, np.ones((9, 2)), beginning())
    data = path.read_bytes()
    path.unlink() if damage == "missing" else path.write_bytes(data[: len(data) // 2] if damage == "cut" else b"text")
    again = WindowStore(path, store.keys)
    again.load((9, 2))
    assert again.done == [False] and again.offsets is None
    assert bool(caplog.records) == (damage != "missing")
