"""Makes what several rooms' tests share importable: ``from helpers.cases import ...``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
