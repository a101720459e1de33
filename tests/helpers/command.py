"""The command, called in this process."""

from click.testing import Result
from typer.testing import CliRunner

from slipstick.cli.main import app


def slipstick(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])
