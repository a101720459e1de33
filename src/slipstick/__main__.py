"""``python -m slipstick`` is the ``slipstick`` command."""

from slipstick.app.cli import main

if __name__ == "__main__":
    main()
