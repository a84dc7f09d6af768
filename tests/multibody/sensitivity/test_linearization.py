"""The memory of a linearisation."""

from calmotion.multibody.sensitivity import linearization


def test_no_more_memory_is_taken_than_the_machine_can_spare(monkeypatch):
    monkeypatch.setattr(linearization, "available_memory", lambda: 1e9)
    assert linearization.spare_memory() == 5e8 and linearization.spare_memory(1e9) == 1e9
    monkeypatch.setattr(linearization, "available_memory", lambda: 1e15)
    assert linearization.spare_memory() == linearization.MEMORY
