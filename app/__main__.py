"""`python -m app` is the same as `flinch`."""

import sys

from app.start import main

sys.exit(main())
