"""What Composer adds to a message, as a subject; `overhead` measures it."""

from benchmarks.overhead import message_overhead


def measure(_side: str, size: int, _seconds: float) -> dict[str, float]:
    """Return µs a message: `composed_us`, by hand `plain_us`, and the difference `added_us`.

    Args:
        size: Over so many rounds.
    """
    return message_overhead('std_msgs/msg/Int32', size)
