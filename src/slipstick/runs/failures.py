"""What ended a computation, in one sentence for its user."""

from __future__ import annotations

import errno
import tempfile
import traceback

from slipstick.errors import InputError


def os_sentence(error: OSError) -> str:
    """A failure of the operating system with its remedy."""
    where = f"{error.filename}: " if error.filename else ""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"{where}the disk is full; free some space or choose another folder with -o"
    if isinstance(error, PermissionError):
        return f"{where}permission denied; check who owns it or choose another folder"
    return f"{where}{(error.strerror or str(error) or type(error).__name__).lower()}"


def fault_sentence(error: Exception) -> str:
    """Any failure: of input, as a place that cannot be written, of the operating system, or of the program itself."""
    if isinstance(error, InputError):
        return "; ".join(error.sentences)
    return os_sentence(error) if isinstance(error, OSError) else internal_sentence(error)


def internal_sentence(error: Exception) -> str:
    """A fault of the program itself, in one line; its traceback goes to a file for the report."""
    lines = traceback.format_exception(error)
    first = next((line for line in str(error).splitlines() if line.strip()), "")[:200]
    said = f"a fault of slipstick itself ({type(error).__name__}: {first})"
    try:
        with tempfile.NamedTemporaryFile("w", prefix="slipstick-", suffix=".log", delete=False) as log:
            log.writelines(lines)
    except OSError:
        return f"{said}; please report it with your case"
    return f"{said}; please report it with your case and {log.name}"
