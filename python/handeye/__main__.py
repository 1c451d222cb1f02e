"""The command ``handeye``, as the Rust program has it: ``handeye --help`` or ``python -m handeye --help``."""

import signal
import sys

from ._handeye import run_command


def main() -> int:
    """Runs the command with the arguments of the process, and returns its exit status."""
    # Ctrl-C ends the command at once, as it ends the Rust program.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["handeye", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
