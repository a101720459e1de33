"""``python -m slipstick`` is the ``slipstick`` command."""

import sys


def main() -> None:
    """Entry point of the command: one that is interrupted before a verb begins says so, too."""
    try:
        from slipstick.cli.main import main as command

        command()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        raise SystemExit(130) from None  # that of ``guard``, which may not be there yet


if __name__ == "__main__":
    main()
