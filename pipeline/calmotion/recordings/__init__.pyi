"""Public names of `calmotion.recordings`: each is imported when it is first used."""

from calmotion.recordings.reading import RecordingReader as RecordingReader
from calmotion.recordings.reading import hash_of as hash_of
from calmotion.recordings.reading import measured_prims as measured_prims
from calmotion.recordings.reading import read_recordings as read_recordings
from calmotion.recordings.reading import refuse_unknown_channels as refuse_unknown_channels
from calmotion.recordings.reading import requested as requested
from calmotion.recordings.recording import ACCELEROMETER as ACCELEROMETER
from calmotion.recordings.recording import ANGLE as ANGLE
from calmotion.recordings.recording import COMPONENTS as COMPONENTS
from calmotion.recordings.recording import EFFORT as EFFORT
from calmotion.recordings.recording import MARKER as MARKER
from calmotion.recordings.recording import STRAIN as STRAIN
from calmotion.recordings.recording import UNITS as UNITS
from calmotion.recordings.recording import Channel as Channel
from calmotion.recordings.recording import LowPass as LowPass
from calmotion.recordings.recording import RecordingRequest as RecordingRequest
from calmotion.recordings.recording import SensorRecording as SensorRecording
from calmotion.recordings.recording import unit_of as unit_of
