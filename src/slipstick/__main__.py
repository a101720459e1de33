"""``python -m slipstick`` is the ``slipstick`` command."""

from slipstick.cli.main import main

if __name__ == "__main__":
    main()
