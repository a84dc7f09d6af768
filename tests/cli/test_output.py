"""What reaches a terminal: sentences of Calmotion, in characters that it has."""

import io
import logging
import sys
import warnings

import pytest
from calmotion.cli.output import own_messages
from calmotion.cli.signals import prepare_streams
from calmotion.cli.tables import console_on, print_table


@pytest.fixture
def no_filters():
    """Warnings as Python has them without options."""
    with warnings.catch_warnings():
        warnings.resetwarnings()
        yield


def test_warnings_of_libraries_are_not_printed(capsys, no_filters):
    with own_messages():
        warnings.warn("invalid value in divide", RuntimeWarning, stacklevel=1)
        logging.getLogger("matplotlib").warning("building the font cache")
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "")


def test_warnings_of_calmotion_are_sentences(capsys):
    with own_messages():
        logging.getLogger("calmotion").warning("The checkpoint %s is damaged; the search begins anew.", "x")
    assert capsys.readouterr().err == "warning: The checkpoint x is damaged; the search begins anew.\n"
    assert not logging.getLogger("calmotion").handlers


def test_warnings_are_errors_where_the_user_says_so(no_filters):
    warnings.simplefilter("error")
    with own_messages(), pytest.raises(RuntimeWarning):
        warnings.warn("invalid value in divide", RuntimeWarning, stacklevel=1)


def test_a_stream_of_ascii_replaces_what_it_does_not_have(monkeypatch):
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", stream)
    prepare_streams()
    print_table(console_on(sys.stdout), "9.81 m/s²", ["motor", "at"], [["/Robot/机", "90°"]])
    stream.flush()
    text = stream.buffer.getvalue().decode()
    assert "9.81 m/s?" in text and "/Robot/?" in text and "90?" in text
