"""`python -m app` is the same as `flinch`."""

import sys

from app.cli import main

sys.exit(main())
