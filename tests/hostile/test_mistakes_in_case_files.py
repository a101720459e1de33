"""Mistakes that new users make in case files, as data: each gets its fault or its warning, none is silent.

A row: what it is, what of the sound case becomes what, the keys named ("," between several), words of the sentence.
"""

# ruff: noqa: E501 (a row is a line)

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.command import slipstick

SOUND = """\
format = 1
title = "a bar on a rubbing pad"
harmonics = "0..5"
units = { length = "m", force = "N", time = "s" }
[structure]
kind = "matrices"
dofs = ["x", "z"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.4, 0.0], [0.0, 0.8]]
stiffness = [[40.0, 0.0], [0.0, 120.0]]
[[load]]
dof = "x"
harmonic = 1
sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
normal = "z"
kt = 100.0
kn = 80.0
mu = 0.3
gap = -2.0
rubbing = { velocity = 3.0, cos = { "1" = 0.5 } }
[response]
from = 4.0
to = 12.0
"""
END = "to = 12.0\n"
MASS, STIFFNESS = "mass = [[1.0, 0.0], [0.0, 1.0]]", "stiffness = [[40.0, 0.0], [0.0, 120.0]]"
LOAD = '[[load]]\ndof = "x"\nharmonic = 1\nsin = 100.0\n'
RUB = 'rubbing = { velocity = 3.0, cos = { "1" = 0.5 } }'
RANGE = "from = 4.0\nto = 12.0\n"
CONTACT = SOUND[SOUND.index("[[contact]]") : SOUND.index("[response]")]
HEAT = "\nthermal = { background = 25.0, resistance = 8.0 }"
SHARED = "[thermal]\ninfluence = [[1.0]]\nbackground = 25.0\n[response]"
PRESSED = 'normal = "z"\nkt = 100.0\nkn = 80.0\nmu = 0.3\ngap = -2.0'
CONSTANT = "kt = 100.0\nmu = 0.3\nnormal_load = 160.0"
TRACK = '[track]\nparameter = "damper.mu"\nfrom = 0.1\nto = 0.5\n'
SWEPT = 'parameter = "damper.mu"\nomega = 6.0\n'


def also(text: str) -> tuple[str, str]:
    """Lines at the end of the case."""
    return END, END + text


Text = str | bytes | tuple[str, ...]
Row = tuple[str, Text, Text, str, tuple[str, ...]]
"""Name, what of the case (one text or several), what it becomes (all of it where the former is empty), keys, words."""

# fmt: off
TOML: list[Row] = [
    ("an empty file", "", "", "format,harmonics,structure,contact,response", ("format is missing; give format = 1",)),
    ("a text without quotes", '"a bar on a rubbing pad"', "a bar", "", ("not valid TOML", "line 2", "title = a bar")),
    ("a bracket forgotten", "[structure]", "[structure", "", ("Expected ']'", "line 5")),
    ("a list not closed", MASS, MASS[:-1], "", ("Unclosed array",)),
    ("a decimal comma", "kt = 100.0", "kt = 100,0", "", ("line 19", "kt = 100,0")),
    ("a key twice", "kt = 100.0", "kt = 100.0\nkt = 90.0", "", ("Cannot overwrite a value", "line 20", "kt = 90.0")),
    ("a table twice", "[response]", "[structure]\n[response]", "", ("the table [structure] stands twice",)),
    ("a colon", "mu = 0.3", "mu: 0.3", "", ("Expected '='", "mu: 0.3")),
    ("a semicolon", "mu = 0.3", "mu = 0.3;", "", ("line 21", "mu = 0.3;")),
    ("a comment of another language", "mu = 0.3", "mu = 0.3 // dry", "", ("line 21", "// dry")),
    ("a formula", "[[40.0", "[[4*10", "", ("line 10",)),
    ("a path of Windows", "a bar on", "C:\\data", "", ("Unescaped", "line 2")),
    ("True of Python", 'kind = "matrices"', 'kind = "matrices"\nloss_factor = True', "", ("Invalid value", "line 7")),
    ("a table of several lines", RUB, 'rubbing = { velocity = 3.0,\n cos = {} }', "", ("line 23", "rubbing = { velocity")),
    ("[contact] in single brackets", "[[contact]]", "[contact]", "contact", ("begin with [[contact]] (double brackets)",)),
    ("[load] in single brackets", "[[load]]", "[load]", "load", ("begin with [[load]] (double brackets)",)),
    ("[[response]] in double brackets", "[response]", "[[response]]", "response", ("expected one table [response]",)),
    ("latin-1 bytes", b"a bar", b"a b\xe4r", "", ("not a text file", "UTF-8")),
    ("UTF-16", b"", SOUND.encode("utf-16"), "", ("not a text file", "UTF-8")),
    ("a date", "from = 4.0", "from = 2024-01-01", "response.from", ("found 2024-01-01; expected a number in rad/s",)),
    ("a date that does not exist", "from = 4.0", "from = 2024-13-45", "", ("line 25", "2024-13-45")),
    ("a number beyond 64 bits", "kt = 100.0", "kt = 99999999999999999999", "", ("contact.kt", "write it as 1e20")),
    ("1e400", "kt = 100.0", "kt = 1e400", "contact.damper.kt", ("found inf; expected a number >= 0",)),
    ("1e300", "kt = 100.0", "kt = 1e300", "contact.damper.kt", ("found 1e+300", "check the units")),
    ("nan", "mu = 0.3", "mu = nan", "contact.damper.mu", ("found nan; expected a number >= 0",)),
    ("inf", "gap = -2.0", "gap = -inf", "contact.damper.gap", ("found -inf; expected a finite number",)),
]
TOP: list[Row] = [
    ("another format", "format = 1", "format = 2", "format", ("found 2; expected format = 1",)),
    ("the format as text", "format = 1", 'format = "1"', "format", ('found "1"; expected format = 1',)),
    ("no format", "format = 1\n", "", "format", ("format is missing; give format = 1",)),
    ("a title that is none", '"a bar on a rubbing pad"', "3", "title", ("found 3; expected a text",)),
    ("harmonics misspelt", "harmonics", "harmonic", "harmonic", ("did you mean 'harmonics'?",)),
    ("harmonics without 0", '"0..5"', '"1..5"', "harmonics", ('found "1..5"', "starting at 0")),
    ("a list of harmonics without 0", '"0..5"', "[1, 3]", "harmonics", ("found [1, 3]", "starting at 0")),
    ("harmonics downwards", '"0..5"', '"5..0"', "harmonics", ('found "5..0"', "increasing")),
    ("harmonics with a dash", '"0..5"', '"0-5"', "harmonics", ('"0-5" is not a whole number', '"0..10"')),
    ("a number of harmonics", '"0..5"', "5", "harmonics", ("found 5", '"0..10"')),
    ("half a harmonic", '"0..5"', "[0, 1.5]", "harmonics", ("1.5 is not a whole number",)),
    ("a negative harmonic", '"0..5"', "[-1, 0, 1]", "harmonics", ("-1 is not a whole number >= 0",)),
    ("a harmonic twice", '"0..5"', "[0, 1, 1]", "harmonics", ("found [0, 1, 1]", "increasing")),
    ("too many harmonics", '"0..5"', '"0..900"', "harmonics", ("more than 500 harmonics; keep fewer",)),
    ("harmonics below a table", 'harmonics = "0..5"\n', "", "harmonics", ("harmonics is missing",)),
    ("a unit misspelt", "length =", "lenght =", "units.lenght", ("did you mean 'length'?",)),
    ("a system of units", '{ length = "m", force = "N", time = "s" }', '"SI"', "units", ('found "SI"; expected a table',)),
    ("a table misspelt", "[response]", "[respone]", "respone", ("did you mean 'response'?",)),
    ("a table of another program", *also("[solver]\ntolerance = 1e-6\n"), "solver", ("keys not used yet: author, remarks, period_ratio",)),
    ("no contact", CONTACT, "", "contact", ("[[contact]] is missing; give at least one",)),
    ("no response", "[response]\n" + RANGE, "", "response", ("[response] is missing; give it with the keys from and to",)),
    ("a ratio of periods with a colon", *also('period_ratio = "3:2"\n'), "response.period_ratio", ('found "3:2"', '"3/2"')),
]
STRUCTURE: list[Row] = [
    ("no kind", 'kind = "matrices"\n', "", "structure.kind", ('give one of "matrices"',)),
    ("kind misspelt", "kind =", "kinde =", "structure.kinde", ("did you mean 'kind'?",)),
    ("an unknown kind", '"matrices"', '"matrix"', "structure.kind", ("did you mean 'matrices'?",)),
    ("stiffness misspelt", "stiffness =", "stifness =", "structure.stifness", ("did you mean 'stiffness'?",)),
    ("stiffness in capitals", "stiffness =", "Stiffness =", "structure.Stiffness", ("did you mean 'stiffness'?",)),
    ("K for stiffness", "stiffness =", "K =", "structure.stiffness,structure.K", ("stiffness is missing", "keys not used yet:")),
    ("no mass", MASS + "\n", "", "structure.mass", ("mass is missing; give a square list of rows",)),
    ("a matrix of one row", MASS, "mass = [1.0, 1.0]", "structure.mass", ("found [1.0, 1.0]; expected a square list",)),
    ("a matrix that is a number", MASS, "mass = 1.0", "structure.mass", ("found 1.0; expected a square list",)),
    ("a matrix that is not square", MASS, "mass = [[1.0, 0.0]]", "structure.mass", ("row 1 has 2 entries but there are 1 rows",)),
    ("rows of different length", MASS, "mass = [[1.0, 0.0], [1.0]]", "structure.mass", ("row 2 has 1 entries",)),
    ("a matrix of another size", MASS, "mass = [[1.0]]", "structure.mass", ("found 1 x 1; expected 2 x 2",)),
    ("a text in a matrix", MASS, MASS.replace("[[1.0", '[["1.0"'), "structure.mass", ('row 1, column 1 is "1.0"',)),
    ("one triangle", "[[40.0, 0.0]", "[[40.0, 5.0]", "structure.stiffness", ("not symmetric", "not one triangle")),
    ("a free structure", (STIFFNESS, 'tangential = "x"\n' + PRESSED), ("stiffness = [[1.0, -1.0], [-1.0, 1.0]]", "tangential = { x = 1.0, z = -1.0 }\n" + CONSTANT), "structure.stiffness", ("singular", "ss.models.free_structure")),
    ("a static load that friction alone bears", (STIFFNESS, 'normal = "z"\n', "harmonic = 1\nsin", "kn = 80.0\n", "gap = -2.0"), ("stiffness = [[1.0, -1.0], [-1.0, 1.0]]", "", "harmonic = 0\ncos", "", "normal_load = 160.0"), "load", ("where friction alone holds it",)),
    ("a wrong sign", "[[40.0", "[[-40.0", "structure.stiffness", ("not positive definite", "wrong signs")),
    ("a dof without mass", "mass = [[1.0", "mass = [[0.0", "structure.mass", ("give every dof a mass",)),
    ("a dof twice", '["x", "z"]', '["x", "z", "z"]', "structure.dofs", ("found 3 names; expected 2",)),
    ("dofs as one text", '["x", "z"]', '"x z"', "structure.dofs", ('found "x z"; expected a list of names',)),
    ("dofs and their count", '["x", "z"]', '["x", "z"]\ncount = 2', "structure.count", ("given together with dofs; keep one",)),
    ("a negative loss factor", "[[load]]", "loss_factor = -0.1\n[[load]]", "structure.loss_factor", ("found -0.1; expected a number >= 0",)),
    ("a percentage", "[[load]]", 'loss_factor = "1 %"\n[[load]]', "structure.loss_factor", ('found "1 %"; expected a number',)),
    ("a file that is not there", MASS, 'mass = "M.mtx"', "structure.mass", ('found "M.mtx"; there is no such file',)),
    ("a file outside the folder", MASS, 'mass = "../M.mtx"', "structure.mass", ("leaves the folder", "copy the file beside the case")),
    ("an absolute path", MASS, 'mass = "/data/M.mtx"', "structure.mass", ("leaves the folder", "copy the file beside the case")),
    ("modes without a file", '"matrices"', '"modal"', "structure.file,structure.mass,structure.damping,structure.stiffness", ("file is missing",)),
]
LOADS: list[Row] = [
    ("an unknown dof", '[[load]]\ndof = "x"', '[[load]]\ndof = "y"', "load.0.dof", ("there is no dof 'y'", "x, z")),
    ("a load without a dof", '[[load]]\ndof = "x"\n', "[[load]]\n", "load.0", ("where it acts is missing; give dof",)),
    ("a list of dofs", '[[load]]\ndof = "x"', '[[load]]\ndof = ["x"]', "load.0.dof", ('found ["x"]; expected the name of a dof',)),
    ("a harmonic that is not kept", "harmonic = 1", "harmonic = 9", "load.0.harmonic", ("harmonic 9 is not among the harmonics kept", "keep it too")),
    ("a negative harmonic of a load", "harmonic = 1", "harmonic = -1", "load.0.harmonic", ("found -1; expected a whole number >= 0",)),
    ("a harmonic as text", "harmonic = 1", 'harmonic = "1"', "load.0.harmonic", ('found "1"; expected a whole number',)),
    ("a force said twice", "sin = 100.0", "sin = 100.0\namplitude = 100.0", "load.0.amplitude", ("keep one form of the force",)),
    ("a phase without amplitude", "sin = 100.0", "sin = 100.0\nphase = 1.0", "load.0.phase", ("given without amplitude",)),
    ("no force", "sin = 100.0\n", "", "load.0", ("no force is given; give cos, sin, or amplitude",)),
    ("a force with its unit", "sin = 100.0", 'sin = "100 N"', "load.0.sin", ('found "100 N"; expected a finite number',)),
    ("a frequency of the load", "sin = 100.0", "sin = 100.0\nfrequency = 5", "load.0.frequency", ("keys not used yet: shape",)),
    ("a static sine", "harmonic = 1", "harmonic = 0", "load.0.sin", ("a sine of harmonic 0 is zero; give a static load as cos",)),
    ("an unknown load shape", '[[load]]\ndof = "x"', '[[load]]\nshape = "gas"', "load.0.shape", ("there is no load shape 'gas'",)),
    ("degrees spelt out", "sin = 100.0", 'amplitude = 100.0\nphase = "90 degrees"', "load.0.phase", ('found "90 degrees"', '"90 deg"')),
    ("half of a moving support", '[[load]]\ndof = "x"', '[[load]]\nbase = "x"', "load.0.base", ("given without motion",)),
]
CONTACTS: list[Row] = [
    ("no name", 'name = "damper"\n', "", "contact.0.name", ('name is missing; give a name for the contact',)),
    ("a name that is a number", '"damper"', "1", "contact.0.name", ("found 1; expected a name",)),
    ("a name twice", "[response]", CONTACT + "[response]", "contact.0", ("'damper' is used 2 times",)),
    ("no direction", 'tangential = "x"\n', "", "contact.damper.tangential", ("tangential is missing; give the dof that slides",)),
    ("an empty direction", 'tangential = "x"', "tangential = {}", "contact.damper.tangential", ("expected the name of a dof",)),
    ("a direction without a size", 'tangential = "x"', "tangential = { x = 0.0 }", "contact.damper.tangential", ("found { x = 0.0 }; expected at least one cosine that is not 0",)),
    ("a vector for a direction", 'tangential = "x"', "tangential = [1.0, 0.0]", "contact.damper.tangential", ("found [1.0, 0.0]", "{ x = 1.0, x2 = -1.0 }")),
    ("a direction of an unknown dof", 'normal = "z"', 'normal = "n"', "contact.damper.normal", ("there is no dof 'n'", "x, z")),
    ("tangential misspelt", "tangential =", "tangental =", "contact.damper.tangental", ("did you mean 'tangential'?",)),
    ("a negative stiffness", "kt = 100.0", "kt = -100.0", "contact.damper.kt", ("found -100.0; expected a number >= 0",)),
    ("a stiffness as text", "kt = 100.0", 'kt = "100"', "contact.damper.kt", ('found "100"; expected a number >= 0',)),
    ("no stiffness", "kt = 100.0\n", "", "contact.damper.kt", ("kt is missing; give a number >= 0",)),
    ("a capital letter", "kt = 100.0", "Kt = 100.0", "contact.damper.Kt", ("did you mean 'kt'?",)),
    ("friction for mu", "mu = 0.3", "friction = 0.3", "contact.damper.mu,contact.damper.friction", ("mu is missing", "keys not used yet: mu, normal_load, thermal")),
    ("a negative friction coefficient", "mu = 0.3", "mu = -0.3", "contact.damper.mu", ("found -0.3; expected a number >= 0",)),
    ("a friction coefficient in percent", "mu = 0.3", 'mu = "30 %"', "contact.damper.mu", ('found "30 %"; expected a number >= 0',)),
    ("a negative normal stiffness", "kn = 80.0", "kn = -80.0", "contact.damper.kn", ("found -80.0; expected a number >= 0",)),
    ("normal without kn", "kn = 80.0\n", "", "contact.damper.kn", ("kn is missing; give the normal contact stiffness",)),
    ("a gap and a normal load", "gap = -2.0", "gap = -2.0\nnormal_load = 160.0", "contact.damper.gap", ("given together with normal_load; keep one",)),
    ("neither gap nor normal load", "gap = -2.0\n", "", "contact.damper", ("the normal load is missing; give normal_load",)),
    ("a negative normal load", "gap = -2.0", "normal_load = -160.0", "contact.damper.normal_load", ("found -160.0; expected a number >= 0",)),
    ("rubbing as a number", RUB, "rubbing = 3.0", "contact.damper.rubbing", ("found 3.0; expected a table such as { velocity",)),
    ("rubbing with its unit", RUB, 'rubbing = { velocity = "3 m/s" }', "contact.damper.rubbing.velocity", ('found "3 m/s"; expected a finite number',)),
    ("speed for velocity", RUB, "rubbing = { speed = 3.0 }", "contact.damper.rubbing.speed", ("keys not used yet: velocity",)),
    ("velocity outside rubbing", RUB, "velocity = 3.0", "contact.damper.velocity", ("it belongs into rubbing = { velocity = ... }",)),
    ("an amplitude without its harmonic", RUB, "rubbing = { cos = 0.5 }", "contact.damper.rubbing.cos", ("found 0.5", '{ "1" = 2.0 }')),
    ("a harmonic in words", RUB, "rubbing = { cos = { one = 0.5 } }", "contact.damper.rubbing.cos", ("found { one = 0.5 }", '{ "1" = 2.0 }')),
    ("rubbing in a harmonic that is not kept", RUB, 'rubbing = { cos = { "9" = 0.5 } }', "contact.damper.rubbing.cos", ("harmonic 9 is not among",)),
    ("contacts on no surface", 'tangential = "x"\nnormal = "z"', 'points = "all"\ndirection = [1, 0, 0]', "contact.damper.points", ("the structure has no contact surface",)),
    ("a table without a temperature", "mu = 0.3", "mu = { table = [[25, 0.5], [200, 0.4]] }", "contact.damper.mu", ("the temperature of the contact is not given",)),
    ("temperatures downwards", "mu = 0.3", "mu = { table = [[200, 0.5], [25, 0.4]] }" + HEAT, "contact.damper.mu", ("temperature 25 follows 200; expected increasing",)),
    ("a table of one row", "mu = 0.3", "mu = { table = [[25, 0.5]] }" + HEAT, "contact.damper.mu", ("at least two rows",)),
    ("a negative value in a table", "mu = 0.3", "mu = { table = [[25, 0.5], [200, -0.4]] }" + HEAT, "contact.damper.mu", ("holds -0.4, negative",)),
    ("heat without a background", RUB, RUB + "\nthermal = { resistance = 8.0 }", "contact.damper.thermal.background", ("give the temperature without friction",)),
    ("a background outside the table", "mu = 0.3", "mu = { table = [[30, 0.5], [200, 0.4]] }" + HEAT, "contact.damper.mu", ("temperature 25 lies outside its table",)),
    ("heat among too many contacts", "[response]", SHARED.replace("[[1.0]]", "[[1.0, 0.0], [0.0, 1.0]]"), "thermal.influence", ("found a matrix of shape (2, 2); expected (1, 1)",)),
    ("heat of an unknown contact", "[response]", SHARED.replace("back", 'contacts = ["pad"]\nback'), "thermal.contacts", ("there is no contact 'pad'; there are damper",)),
]
RESPONSE: list[Row] = [
    ("no end", END, "", "response.to", ("to is missing",)),
    ("an empty range", "to = 12.0", "to = 4.0", "response.to", ("is 4 rad/s, the same as from",)),
    ("a range from 0", "from = 4.0", "from = 0.0", "response.from", ("found 0.0; expected a frequency > 0",)),
    ("a number in quotes", "from = 4.0", 'from = "4"', "response.from", ('found "4"', '"0.32 Hz"')),
    ("an unknown unit of frequency", "from = 4.0", 'from = "4 herz"', "response.from", ('found "4 herz"', '"0.32 Hz"')),
    ("hertz with a unit of time of its own", ('time = "s"', "from = 4.0"), ('time = "h"', 'from = "1 Hz"'), "response.from", ('the unit of time is "h"; give a plain number',)),
    ("a range as a list", RANGE, "range = [4.0, 12.0]\n", "response.from,response.to,response.range", ("from is missing", "keys not used yet: max_points")),
    ("a point beyond the range", *also("at = [20.0]\n"), "response.at.0", ("20 rad/s lies outside the range 4 to 12 rad/s",)),
    ("a point that is no list", *also("at = 5.0\n"), "response.at", ("found 5.0; expected a list of values",)),
    ("no points", *also("max_points = 0\n"), "response.max_points", ("found 0; expected a whole number from 2",)),
    ("steps of zero", *also("max_step = 0\n"), "response.max_step", ("found 0; expected a number > 0",)),
    ("steps that exclude each other", *also("max_step = 0.1\nmin_step = 0.5\n"), "response.min_step", ("found 0.5; expected at most max_step, 0.1",)),
    ("a first step above the largest", *also("max_step = 0.1\nfirst_step = 0.5\n"), "response.first_step", ("found 0.5; expected at most max_step, 0.1",)),
    ("an accuracy above 1", *also("adapt_harmonics = 2\n"), "response.adapt_harmonics", ("found 2; expected a number between 0 and 1",)),
    ("another program's tolerance", *also("tolerance = 1e-6\n"), "response.tolerance", ("did you mean 'output_tolerance'?",)),
    ("a negative tolerance", *also("output_tolerance = -1e-6\n"), "response.output_tolerance", ("found -1e-06; expected a number > 0",)),
    ("yes for true", *also('stability = "yes"\n'), "response.stability", ('found "yes"; expected true, false or "full"',)),
    ("peaks of an unknown dof", *also('peaks_of = "y"\n'), "response.peaks_of", ("there is no dof 'y'", "x, z")),
    ("a parameter without its frequency", *also('parameter = "damper.mu"\n'), "response.omega", ("omega is missing; a parameter is followed at one frequency",)),
    ("a frequency without a parameter", *also("omega = 6.0\n"), "response.omega", ("given without parameter",)),
    ("an unknown parameter", *also(SWEPT.replace(".mu", ".nu")), "response.parameter", ("did you mean 'damper.mu'?",)),
    ("a parameter of another contact", *also(SWEPT.replace("damper.mu", "belt.speed")), "response.parameter", ("did you mean 'damper.velocity'?",)),
    ("the frequency as a parameter", *also(SWEPT.replace("damper.mu", "frequency")), "response.parameter", ("a response follows the frequency",)),
    ("a parameter with a unit", "from = 4.0\nto", 'from = "4 m/s"\n' + SWEPT + "to", "response.from", ('found "4 m/s"; expected a finite number',)),
    ("a parameter below what it can be", "from = 4.0\nto", "from = -0.1\n" + SWEPT + "to", "response.from", ("found -0.1, negative; expected a value >= 0",)),
    ("outputs as one text", *also('[output]\ndofs = "x"\n'), "output.dofs", ('found "x"; expected a list of dof names',)),
    ("no outputs", *also("[output]\ndofs = []\n"), "output.dofs", ("found []; expected a list of dof names",)),
    ("an output twice", *also('[output]\ndofs = ["x", "x"]\n'), "output.dofs", ("'x' is given 2 times",)),
    ("a folder for the output", *also('[output]\nfolder = "out"\ndofs = ["x"]\n'), "output.folder", ("leave it out",)),
]
VERBS: list[Row] = [
    ("a study of an unknown parameter", *also('[study]\n"damper.nu" = [0.1, 0.2]\n'), "study", ("did you mean 'damper.mu'?",)),
    ("a study of a text", *also('[study]\n"damper.mu" = "0.1..0.5"\n'), "study.damper.mu", ("expected a list of numbers such as [0, 1, 10]",)),
    ("a study of nothing", *also("[study]\n"), "study", ("no parameter is given",)),
    ("a study of no values", *also('[study]\n"damper.mu" = []\n'), "study.damper.mu", ("found an empty list",)),
    ("a study with a value twice", *also('[study]\n"damper.mu" = [0.1, 0.1]\n'), "study.damper.mu", ("found 0.1 twice",)),
    ("a study below what there is", *also('[study]\n"damper.mu" = [-0.1, 0.1]\n'), "study.damper.mu", ("-0.1 is not allowed",)),
    ("a range without a count", *also('[study]\n"damper.mu" = { from = 0.1, to = 0.5 }\n'), "study.damper.mu.count", ("count is missing",)),
    ("an unknown way of sampling", *also('[study]\nmethod = "chance"\n"damper.mu" = [0.1, 0.5]\n'), "study.method", ("grid, list, random, latin-hypercube, sobol, saltelli",)),
    ("samples of a grid", *also('[study]\nsamples = 9\n"damper.mu" = [0.1, 0.5]\n'), "study.samples", ("counts the values of its parameters",)),
    ("gap and normal load together", *also('[study]\n"damper.gap" = [-1, -2]\n"damper.normal_load" = [1, 2]\n'), "study", ("set the same thing; keep one",)),
    ("[tracks]", *also(TRACK.replace("[track]", "[tracks]")), "tracks", ("did you mean 'track'?",)),
    ("a peak of no parameter", *also(TRACK.replace('parameter = "damper.mu"\n', "")), "track.parameter", ("parameter is missing; give the name",)),
    ("a peak of an unknown dof", *also(TRACK + 'dof = "y"\n'), "track.dof", ("there is no output 'y'; there are x, z",)),
    ("a peak beyond its range", *also(TRACK + "at = [0.9]\n"), "track.at", ("0.9 lies outside of the range 0.1 to 0.5",)),
    ("one frequency for a peak", *also(TRACK + "omega = 6.0\n"), "track.omega", ("found 6.0; expected two frequencies",)),
    ("a peak beside a parameter curve", *also(SWEPT + TRACK), "track.omega", ("give the range of frequencies of the peak",)),
    ("an optimum with a range", *also('[optimal]\nparameter = "damper.mu"\nfrom = 0.1\n'), "optimal.from", ("keys not used yet: omega, dof, start",)),
    ("a mode of periodic rubbing", *also("[modes]\nfrom = 0.1\nto = 1.0\n"), "modes", ("cannot be computed of this case", "'damper': its opposing surface moves periodically")),
    ("a mode that is not there", ', cos = { "1" = 0.5 } }\n[response]\n' + RANGE, " }\n[response]\n" + RANGE + "[modes]\nfrom = 0.1\nto = 1.0\nmode = 9\n", "modes.mode", ("found 9; expected a mode of the structure, from 1 to 2",)),
    ("a negative amplitude of a mode", ', cos = { "1" = 0.5 } }\n[response]\n' + RANGE, " }\n[response]\n" + RANGE + "[modes]\nfrom = -0.1\nto = 1.0\n", "modes.from", ("found -0.1; expected a number > 0",)),
    ("self-excited vibration under a load", *also(TRACK.replace("track", "limit_cycles")), "limit_cycles", ("it excites at harmonic 1 (expected harmonic 0 alone)", "leave [limit_cycles] out")),
]
WARNED: list[Row] = [
    ("a load forgotten", LOAD + CONTACT, CONTACT.replace(', cos = { "1" = 0.5 }', ""), "", ("nothing varies in time", "was a load forgotten?")),
    ("a load of harmonic 0", "harmonic = 1\nsin = 100.0\n" + CONTACT, "harmonic = 0\ncos = 100.0\n" + CONTACT.replace(', cos = { "1" = 0.5 }', ""), "", ("nothing varies in time",)),
    ("neither load nor rubbing", LOAD + CONTACT, CONTACT.replace(RUB + "\n", ""), "", ("nothing moves the structure",)),
    ("a load given twice", LOAD, LOAD + LOAD, "", ("load on 'x', harmonic 1: given 2 times alike; their forces add up",)),
    ("a phase in degrees", "sin = 100.0", "amplitude = 100.0\nphase = 90", "", ("a phase of 90 rad is more than a turn; was it meant in degrees?",)),
    ("phases of a study in degrees", *also('[study]\n"load.x.phase" = [0, 90]\n'), "", ("a phase of 90 rad is more than a turn",)),
    ("a phase followed in degrees", RANGE, 'parameter = "load.x.phase"\nomega = 6.0\nfrom = 0.0\nto = 180.0\n', "", ("a phase of 180 rad is more than a turn",)),
    ("one direction for both", 'normal = "z"', 'normal = "x"', "", ("'damper': normal is the tangential direction",)),
    ("damping 1000 times too large", "[[0.4, 0.0]", "[[400.0, 0.0]", "", ("mode 1 at 6.3246 rad/s has a damping ratio of 31.6",)),
    ("a loss factor in percent", "[[load]]", "loss_factor = 2.0\n[[load]]", "", ("has a damping ratio of 1.04", "meant in percent")),
    ("damping of the wrong sign", "[[0.4, 0.0]", "[[-0.4, 0.0]", "", ("the structure's damping feeds energy in", "mode 1 at 6.3246 rad/s, damping ratio -0.0316")),
    ("no damping", "damping = [[0.4, 0.0], [0.0, 0.8]]\n", "", "", ("the structure has no damping",)),
    ("mu and the normal load of a study", (PRESSED, END), (CONSTANT, END + '[study]\n"damper.mu" = [0.1, 0.2]\n"damper.normal_load" = [1, 2]\n'), "", ("damper.mu and damper.normal_load act through the friction limit mu N alone",)),
    ("few harmonics", '"0..5"', '"0..1"', "", ("keep the even ones too", "keep at least 0..5")),
    ("odd harmonics alone", '"0..5"', "[0, 1, 3, 5]", "", ("keep the even ones too",)),
    ("a friction coefficient in percent that is a number", "mu = 0.3", "mu = 30", "", ("mu = 30 is more than dry surfaces reach",)),
    ("no friction", "mu = 0.3", "mu = 0.0", "", ("mu = 0, so there is no friction force",)),
    ("no tangential stiffness", "kt = 100.0", "kt = 0.0", "", ("kt = 0, so no sliding changes its friction force",)),
    ("stiffness in other units", "kt = 100.0", "kt = 1e11", "", ("kt = 1e+11 is 2.5e+09 times the static stiffness 40",)),
    ("a gap of the wrong sign", "gap = -2.0", "gap = 2.0", "", ("the gap 2 is open and no load moves the structure across it",)),
    ("a gap without normal", PRESSED, "kt = 100.0\nkn = 80.0\nmu = 0.3\ngap = 2.0", "", ("it never acts",)),
    ("hertz without their unit", RANGE, "from = 0.8\nto = 1.9\n", "", ("were they meant in Hz? Multiply them by 2 pi",)),
    ("heat without a table", RUB, RUB + HEAT, "", ("contact temperatures have no effect",)),
]
# fmt: on


FAULTS = [*TOML, *TOP, *STRUCTURE, *LOADS, *CONTACTS, *RESPONSE, *VERBS]


def changed(old: Text, new: Text) -> bytes:
    """The sound case with a mistake."""
    if not old:
        return new if isinstance(new, bytes) else str(new).encode()
    content = SOUND.encode()
    for one, other in zip(*((text if isinstance(text, tuple) else (text,)) for text in (old, new)), strict=True):
        before, after = (text if isinstance(text, bytes) else text.encode() for text in (one, other))
        assert before in content
        content = content.replace(before, after, 1)
    return content


def rows(given: list[Row]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("row", given, ids=lambda row: row[0])


def told(folder: Path, row: Row) -> tuple[dict, str]:
    """The answer of ``check`` as data, and what it says to people."""
    path = folder / "case.toml"
    path.write_bytes(changed(row[1], row[2]))
    result = slipstick("check", path, "--json")
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert not any(word in result.output for word in ("Traceback", "fault of slipstick", "datetime", "pydantic"))
    answer = json.loads(result.stdout)
    assert answer["exit_code"] == result.exit_code
    return answer, " ".join(result.stderr.split())


def test_the_sound_case_is_silent(tmp_path: Path) -> None:
    answer, _ = told(tmp_path, ("", "mu = 0.3", "mu = 0.3", "", ()))
    assert answer["exit_code"] == 0
    assert answer["warnings"] == []


def test_there_are_enough_and_no_two_are_the_same() -> None:
    every = [*FAULTS, *WARNED]
    assert len(every) >= 150
    assert len({row[0] for row in every}) == len(every) == len({changed(row[1], row[2]) for row in every})


@rows(FAULTS)
def test_a_mistake_is_refused_at_its_key(tmp_path: Path, row: Row) -> None:
    """``check`` and ``run`` refuse it with the same sentences, and name nothing else besides."""
    _, _, _, keys, words = row
    answer, said = told(tmp_path, row)
    assert answer["exit_code"] == 2
    assert sorted(".".join(map(str, fault["where"])) for fault in answer["faults"]) == sorted(keys.split(","))
    assert [word for word in words if word not in said] == []
    run = slipstick("run", tmp_path / "case.toml", "-o", tmp_path / "out", "-q")
    assert run.exit_code == 2
    assert " ".join(run.stderr.split()) == said
    assert not (tmp_path / "out").exists()


@rows(WARNED)
def test_what_is_suspicious_is_warned_of(tmp_path: Path, row: Row) -> None:
    _, _, _, _, words = row
    answer, said = told(tmp_path, row)
    assert answer["exit_code"] == 0
    assert [word for word in words if word not in said] == []
    assert any(words[0] in sentence for sentence in answer["warnings"])


@pytest.mark.parametrize("content", [b"\xef\xbb\xbf" + SOUND.encode(), SOUND.replace("\n", "\r\n").encode()])
def test_marks_and_line_ends_of_other_systems_are_no_mistake(tmp_path: Path, content: bytes) -> None:
    answer, _ = told(tmp_path, ("", "", content, "", ()))
    assert (answer["exit_code"], answer["warnings"]) == (0, [])


@pytest.mark.parametrize(
    ("name", "words"), [("none.toml", "there is no such file"), (".", "found a folder"), ("", "case.toml")]
)
def test_a_file_that_is_none(tmp_path: Path, name: str, words: str) -> None:
    for verb in ("check", "run"):
        result = slipstick(verb, tmp_path / name if name else "")
        assert result.exit_code == 2
        assert words in " ".join(result.output.split())
