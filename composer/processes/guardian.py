"""Ends Composer where it cannot end itself, and what its behaviours started: a process of its own.

It runs as a script and imports nothing of Composer, to start fast and stay small. Neither a
behaviour that holds the interpreter nor an output that nobody reads can block it.

- Composer sends it a byte for each signal, from the handler that Python has in C, which runs
  whatever holds the interpreter, and a byte for what Composer does itself (`BEGUN` ...).
- If a stop takes longer than it may, or more signals come and nothing happens, the guardian has
  Composer print its stacks, and kills it.
- Composer sends it a byte about once a second, too. When none has come for some time, the guardian
  reports that, with the stacks. It also reports that a behaviour has closed the pipe.
- When Composer has ended, however that happened, it kills all processes that bear its mark:
  those that behaviours have started and left.

The mark is a limit of resources that Linux has not looked at since 2003, the number of file
locks. Each process has it from its parent, whatever session, environment and parent it has later.
Source: https://man7.org/linux/man-pages/man2/getrlimit.2.html
"""

import contextlib
import os
import select
import signal
import struct
import sys
import time

RLIMIT_LOCKS = 10
# Prints the stacks of Composer's threads.
STACKS_SIGNAL = signal.SIGRTMAX
# What Composer sends, beside the numbers of signals: a stop has begun or is over, or the process
# goes on without the guardian. `LIMIT` is followed by the seconds that a stop may take. `BEAT`
# comes about once a second; `PAUSE` comes instead when its absence would mean nothing.
BEGUN, OVER, LEAVE, LIMIT, BEAT, PAUSE = 101, 102, 103, 104, 105, 106
SECONDS = struct.Struct('=d')
# A second one means that the user does not want to wait.
_INTERRUPTS = {signal.SIGINT, signal.SIGTERM}

_HURRY_SEC = 1.0
# How often it is looked whether a beat has come, and after how many looks without it that is told.
_LOOK_SEC = 1.0
_SILENT_LOOKS = 5
# How long a process that ends may take from its last descriptor to its end.
_CLOSING_SEC = 0.5
# How long the threads of Composer get to print their stacks.
_STACKS_SEC = 0.3
_KILL_SEC = 5.0
_POLL_SEC = 0.01
_CHUNK = 4096
_LONGEST_COMMAND = 200
# Ends by itself, and removes what the others have shared.
_SPARED = b'from multiprocessing.resource_tracker import main'
_NEVER = float('inf')


class Guardian:
    """Watches Composer until it has ended.

    Args:
        composer: A descriptor of the process.
        reports: Where the bytes come from.
        stop_sec: How long a stop may take.
        exit_sec: How long Python may take to exit after it.
    """

    def __init__(self, composer: int, reports: int, stop_sec: float, exit_sec: float) -> None:
        self._ended = composer
        self._reports = reports
        self._stop_sec = stop_sec
        self._exit_sec = exit_sec
        self._deadline = _NEVER
        self._interrupts = 0
        # Whether Composer itself stops, and tells when that is over.
        self._is_stopping = False
        self._has_left = False
        self._unread = b''
        self._silent_looks: float = _NEVER
        self._told_silence = False

    def run(self) -> bool:
        """Return whether Composer has ended; it may have sent the guardian away before."""
        poll = select.poll()
        poll.register(self._ended, select.POLLIN)
        poll.register(self._reports, select.POLLIN)
        while not self._has_left:
            rest = self._deadline - time.monotonic()
            if rest <= 0:
                self._end_composer()
                return True
            ready = {each for each, _ in poll.poll(min(rest, _LOOK_SEC) * 1000 + 1)}
            if not ready:
                self._note_silence()
            if self._reports in ready:
                data = os.read(self._reports, _CHUNK)
                if not data:
                    poll.unregister(self._reports)
                if not data and not self._wait(_CLOSING_SEC):
                    # It has not ended.
                    tell(
                        '[ERROR] [composer]: the system ends, because a behaviour has closed '
                        'descriptors that are not its own'
                    )
                    self._take(signal.SIGHUP)
                    self._is_stopping = False
                    # Not counted if the system stops already.
                    self._signal(signal.SIGHUP)
                self._take_all(data)
            # It may have reported a signal right before its end.
            if self._ended in ready:
                self._tell_end()
                return True
        return False

    def _tell_end(self) -> None:
        if self._deadline == _NEVER:
            when = 'without a stop'
        # A user who interrupts twice has it end at once.
        elif self._is_stopping and self._interrupts <= 1:
            when = 'before its stop was over'
        else:
            return
        tell(
            f'[FATAL] [composer]: the process ended {when}: it crashed or was killed, or a '
            'behaviour called os._exit or closed all descriptors'
        )

    def _take_all(self, data: bytes) -> None:
        rest = self._unread + data
        while rest:
            size = 1 + SECONDS.size if rest[0] == LIMIT else 1
            if len(rest) < size:
                break
            if rest[0] == LIMIT:
                (self._stop_sec,) = SECONDS.unpack_from(rest, 1)
            else:
                self._take(rest[0])
            rest = rest[size:]
        self._unread = rest

    def _take(self, byte: int) -> None:
        now = time.monotonic()
        if byte in _INTERRUPTS:
            self._interrupts += 1
            if self._interrupts > 1:
                self._deadline = min(self._deadline, now + _HURRY_SEC)
        if byte in {*_INTERRUPTS, signal.SIGHUP, BEGUN}:
            self._deadline = min(self._deadline, now + self._stop_sec)
            self._is_stopping |= byte == BEGUN
        elif byte == OVER:
            self._is_stopping = False
            self._deadline = now + self._exit_sec
        elif byte == LEAVE:
            self._has_left = True
        elif byte in {BEAT, PAUSE}:
            self._silent_looks = 0 if byte == BEAT else _NEVER
            if self._told_silence:
                tell('[INFO] [composer]: the system answers again')
            self._told_silence = False

    def _note_silence(self) -> None:
        # Looks are counted, not seconds: this process is suspended with the computer, too.
        if self._deadline < _NEVER or self._is_stopped():
            return
        self._silent_looks += 1
        # An output that nobody reads blocks Composer, too, and would block the stacks.
        if self._silent_looks == _SILENT_LOOKS and tell(
            f'[ERROR] [composer]: the system has not answered for {_SILENT_LOOKS * _LOOK_SEC:g} s:'
            ' a behaviour keeps the interpreter from all others; its threads are at'
        ):
            self._told_silence = True
            self._signal(STACKS_SIGNAL)

    def _is_stopped(self) -> bool:
        """Return whether Composer was stopped by a signal, or by a debugger."""
        facts = _read(f'/proc/self/fdinfo/{self._ended}')
        pid = int(facts.partition(b'Pid:')[2].split()[0])
        try:
            return _read_state(pid) in {b'T', b't'}
        except OSError:
            return False  # It has ended.

    def _end_composer(self) -> None:
        tell(
            '[FATAL] [composer]: the system did not end in time, and is killed; its threads are at'
        )
        self._signal(STACKS_SIGNAL)
        self._wait(_STACKS_SEC)
        self._signal(signal.SIGKILL)

    def _signal(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._ended, number)

    def _wait(self, timeout_sec: float) -> bool:
        return bool(select.select([self._ended], [], [], timeout_sec)[0])


def tell(line: str) -> bool:
    """Print a line, unless that would block; return whether it was printed."""
    with contextlib.suppress(OSError, ValueError):
        if select.select([], [2], [], 0)[1]:
            return os.write(2, line.encode(errors='backslashreplace') + b'\n') > 0
    return False


def find_marked(mark: int) -> dict[int, str]:
    """Return the command lines of all other processes that bear a mark, by their IDs."""
    found = {}
    for name in os.listdir('/proc'):  # noqa: PTH208 - fast
        # It may have ended, or belong to another user.
        with contextlib.suppress(OSError, ValueError):
            pid = int(name)
            if pid == os.getpid() or _read_mark(pid) != mark:
                continue
            command = _read(f'/proc/{pid}/cmdline')
            if _read_state(pid) not in {b'Z', b'X'} and _SPARED not in command:
                found[pid] = _describe(command)
    return found


def _describe(command: bytes) -> str:
    """Return a command line as it is shown: without control characters, and cut."""
    words = command.rstrip(b'\0').replace(b'\0', b' ').decode(errors='backslashreplace')
    text = ascii(words)[1:-1]
    return text if len(text) <= _LONGEST_COMMAND else f'{text[:_LONGEST_COMMAND]}...'


def _read_mark(pid: int) -> int:
    """Return the limit of file locks; raise `ValueError` if there is none."""
    _, _, rest = _read(f'/proc/{pid}/limits').partition(b'Max file locks')
    return int(rest.split()[0])


def _read_state(pid: int) -> bytes:
    return _read(f'/proc/{pid}/stat').rpartition(b')')[2].split()[0]


def _read(path: str) -> bytes:
    # To import `pathlib` takes half of the start of this process.
    with open(path, 'rb') as file:  # noqa: PTH123
        return file.read()


def kill_marked(mark: int, whose: str = 'the system') -> None:
    """Kill all processes that bear a mark until there are no more, and print which.

    Args:
        whose: What they have outlived.
    """
    told: set[int] = set()
    deadline = time.monotonic() + _KILL_SEC
    while (found := find_marked(mark)) and time.monotonic() < deadline:
        for pid, command in found.items():
            # One without a command is about to end.
            if pid not in told and command:
                told.add(pid)
                tell(f'[WARN] [composer]: process {pid} ({command}) outlived {whose}: killed')
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(_POLL_SEC)


def main() -> None:
    """Guard; the arguments: ID of Composer, those of `Guardian`, and the mark, 0 for none."""
    composer, reports = (int(each) for each in sys.argv[1:3])
    stop_sec, exit_sec, mark = float(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5])
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    try:
        ended = os.pidfd_open(composer)
    except ProcessLookupError:
        return  # A signal has ended it, and it had started nothing yet.
    # No child of Composer, or a behaviour that waits for all of its own would wait for ever.
    if os.fork():
        os._exit(0)
    if Guardian(ended, reports, stop_sec, exit_sec).run() and mark:
        kill_marked(mark)


if __name__ == '__main__':
    main()
