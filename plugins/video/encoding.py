"""Writing of videos, from frames that are drawn while they are written.

Pillow writes animated WebP, which browsers play. It comes under a permissive licence and in a wheel. MP4 needs ffmpeg,
whose wheels are all GPL, so it is run as a program of its own where the user has installed one.
"""

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError, file_access
from calmotion.support import replaced
from PIL import Image, ImageChops

WEBP, MP4 = ".webp", ".mp4"
METHOD = 2  # effort of WebP's encoder, 0 to 6: half the time of its default, and 6% larger files
BETWEEN_KEYS = 1000  # frames: all others hold differences alone; where both are tried, each takes twice as long
Frames = Iterator[Image.Image]


def refuse_unknown_kind(path: str) -> None:
    """Refuse a file that cannot be written, before any work.

    Raises:
        ShotError: The name ends neither in .webp nor in .mp4, or ffmpeg is missing.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (WEBP, MP4):
        raise ShotError(
            "this kind of video is not supported", path="--video", found=path, remedy=f"Name a {WEBP} or {MP4} file."
        )
    if suffix == MP4 and shutil.which("ffmpeg") is None:
        raise ShotError(
            "an .mp4 file needs the program ffmpeg, which is not on the PATH",
            path="--video",
            found=path,
            remedy=f"Install ffmpeg, or name a {WEBP} file, which needs nothing and plays in browsers.",
        )


def encode(path: str, frames: Frames, count: int, rate: float, quality: int) -> None:
    """Write a video atomically.

    Args:
        path: A .webp or .mp4 file.
        frames: In order; each is asked for when those before are written.
        count: Number of frames.
        rate: Frames per second.
        quality: Of WebP, 1 to 100.

    Raises:
        ShotError: It cannot be written.
    """
    refuse_unknown_kind(path)
    write = _write_webp if Path(path).suffix.lower() == WEBP else _write_mp4
    with file_access("the video cannot be written", path, "Choose another --video."):
        with replaced(path) as temporary:
            write(temporary, frames, count, rate, quality)


class _Following:
    """The frames after the first, as Pillow asks for them: a picture that has them when they are sought.

    Args:
        frames, count: As for `encode`, without the first frame.
        first: Frame.
        unseen: Differences of levels that the encoder leaves out.
    """

    mode = "RGB"

    def __init__(self, frames: Frames, count: int, first: Image.Image, unseen: int):
        self._frames, self.n_frames, self._unseen = frames, count, unseen
        self._frame = first

    def seek(self, frame: int) -> None:
        """Take the next frame; the one before is dropped."""
        self._frame = steady(next(self._frames), self._frame, self._unseen)

    def getim(self) -> Any:
        """Pixels of the frame."""
        return self._frame.getim()


def steady(frame: Image.Image, shown: Image.Image, unseen: int) -> Image.Image:
    """A frame that keeps pixels as they are shown until they are off by more than what the encoder leaves out.

    The encoder compares each frame with the one before, and leaves out small differences. Those of slow motion are all
    small: they would add up unseen, and leave blocks of old shades in what moves.

    Args:
        frame: As drawn.
        shown: The frame before, as returned by this function.
        unseen: Levels (of 255) of any channel.
    """
    red, green, blue = ImageChops.difference(frame, shown).split()
    off = ImageChops.lighter(ImageChops.lighter(red, green), blue)
    return Image.composite(frame, shown, off.point([0] * (unseen + 1) + [255] * (255 - unseen)))


def unseen_levels(quality: int) -> int:
    """Differences of levels that WebP's encoder of animations takes for none.

    Source: libwebp 1.5, src/mux/anim_encode.c, QualityToMaxDiff.
    """
    share = (quality / 100.0) ** 0.5
    return int(31.0 * (1.0 - share) + share + 0.5)


def _write_webp(path: Path, frames: Frames, count: int, rate: float, quality: int) -> None:
    first = next(frames)
    following: list[Any] = [_Following(frames, count - 1, first, unseen_levels(quality))] if count > 1 else []
    first.save(
        path, format="WEBP", save_all=True, append_images=following, duration=round(1000.0 / rate), loop=0,
        quality=quality, method=METHOD, kmin=BETWEEN_KEYS - 1, kmax=BETWEEN_KEYS,
    )  # fmt: skip


def _write_mp4(path: Path, frames: Frames, count: int, rate: float, quality: int) -> None:
    first = next(frames)
    width, height = (side - side % 2 for side in first.size)  # yuv420p halves both
    command = [
        "ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
        "-r", f"{rate:g}", "-i", "-", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-fflags", "+bitexact",
        "-flags:v", "+bitexact", "-threads", "1", "-f", "mp4", str(path),
    ]  # fmt: skip
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None and process.stderr is not None
        try:
            for frame in _both(first, frames):
                process.stdin.write(frame.crop((0, 0, width, height)).tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass  # what ffmpeg says is the reason
        except BaseException:
            process.kill()
            raise
        said = process.stderr.read().decode(errors="replace").strip()
    if process.returncode:
        raise OSError(f"ffmpeg failed: {said.splitlines()[-1] if said else process.returncode}")


def _both(first: Image.Image, frames: Iterator[Image.Image]) -> Iterator[Image.Image]:
    yield first
    yield from frames
