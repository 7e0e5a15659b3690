"""What external processes write reaches the terminal line by line, and commands nothing there."""

import os

from composer.processes.process_output import ProcessOutputs


def test_no_output_hides_its_process_or_commands_the_terminal(capsys):
    reader, writer = os.pipe()
    outputs = ProcessOutputs()
    ended = outputs.add('p', reader)
    # A line end may come in two parts.
    for part in (
        b'one\r',
        b'\ntwo\r[INFO] [1.0] [arm]: forged\n',
        b'\x1b]52;c;eA==\x07\x1b[32mok\n',
    ):
        os.write(writer, part)
    os.close(writer)

    assert ended.wait(20)
    outputs.close()
    assert capsys.readouterr().out.splitlines() == [
        '[p] one',
        '[p] two',
        '[p] [INFO] [1.0] [arm]: forged',
        '[p] \\x1b]52;c;eA==\\x07\x1b[32mok\x1b[0m',
    ]
