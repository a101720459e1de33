"""Readers kept by others: loaded on use, or asked for by name."""

import os
import subprocess
import sys

import pytest

from slipstick.errors import InputError
from slipstick.fem import extras


def test_a_missing_extra_says_how_to_get_it():
    with pytest.raises(InputError, match=r"mapdl-archive, .* slipstick\[fe\]"):
        extras.require("no_such_module_at_all", "mapdl-archive")


def test_importing_the_readers_loads_none_of_the_extras():
    code = (
        "import sys, slipstick.importers.import_model\n"
        "import slipstick.importers.ansys.matrices, slipstick.importers.ansys.archive\n"
        "import slipstick.importers.nastran.matrices\n"
        "heavy = {'pyvista', 'vtk', 'meshio', 'mapdl_archive', 'ansys', 'h5py', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=dict(os.environ), timeout=600)
