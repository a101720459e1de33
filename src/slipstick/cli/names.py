"""The names of the verbs, in the order and the groups of the help; nothing is imported."""

OF_TABLES = ("track", "optimal", "modes", "limit_cycles", "wear")
"""Verbs that compute what the table of that name asks for."""

VERBS = {
    "Begin": ("init", "check", "import_"),
    "Compute a case": ("run", *OF_TABLES, "run_up", "preload", "resume"),
    "Many cases, and measurements": ("study", "identify"),
    "Rotors and discs without contacts": ("campbell", "interference"),
    "Results": ("report", "table"),
    "This installation": ("info", "verify"),
}
"""Each is a function of that name in a file of that name; those of tables are in ``requests.py``."""


def command_name(name: str) -> str:
    """The command of a function or of a table, as it is typed.

    >>> command_name("limit_cycles"), command_name("import_")
    ('limit-cycles', 'import')
    """
    return name.rstrip("_").replace("_", "-")
