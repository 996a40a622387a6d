"""The controllers that are shipped: a file here registers what it holds, and needs no other."""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
