"""``slipstick.state.thermal`` by the name that it has in pickles written before: nothing here imports it."""

import sys

from slipstick.state.thermal import descent, equilibrium, friction_curve, model, search

for _module in (descent, equilibrium, friction_curve, model, search):
    sys.modules[f"{__name__}.{_module.__name__.rpartition('.')[2]}"] = _module
