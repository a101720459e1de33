"""The name under which models that come from other codes are known: see :mod:`slipstick.fem.model`."""

from slipstick.fem.model import ImportedModel as ImportedModel
