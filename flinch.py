"""In a checkout the package is called `app`; this makes it `flinch`, as it is once installed.

    from flinch import Guard

Public names are told in `app/__init__.py`, and how an installed package comes by its name in
`hatch_build.py`.
"""

import sys

import app

sys.modules[__name__] = app
