"""What Composer adds to a message, as a subject; `overhead` measures it."""

from benchmarks.overhead import message_overhead


def measure(_side: str, _size: int, _seconds: float) -> dict[str, float]:
    """Return µs a message: `composed_us`, by hand `plain_us`, and the difference `added_us`."""
    return message_overhead()
