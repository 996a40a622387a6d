"""What is known of each controller, a file a family: what lies here registers itself.

Every `--help` reads these files, so what is heavy is imported when a controller is made.
"""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
