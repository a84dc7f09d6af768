"""Interrupts that are swallowed are raised again."""

import pytest
from calmotion.support import interrupts


@pytest.fixture(autouse=True)
def answered():
    interrupts.answer()
    yield
    interrupts.answer()


def test_a_request_interrupts_and_stands_until_it_is_answered():
    interrupts.check()
    with pytest.raises(KeyboardInterrupt):
        interrupts.request()
    with pytest.raises(KeyboardInterrupt):
        interrupts.check()
    interrupts.answer()
    interrupts.check()


def test_a_deferred_request_interrupts_at_the_end():
    reached = False
    with pytest.raises(KeyboardInterrupt), interrupts.deferred():
        with interrupts.deferred():
            interrupts.request()
        reached = True
    assert reached


def test_a_second_request_is_not_deferred():
    reached = False
    with pytest.raises(KeyboardInterrupt), interrupts.deferred():
        with pytest.raises(KeyboardInterrupt):
            interrupts.request()
            interrupts.request()
        reached = True
    assert reached
