"""The run, live, for other viewers: what a recording shows them, on a socket of its own.

Their protocol is served here and not by its maker's package, whose server lets pages of any
origin in; what a viewer could do beyond looking is not part of ours.
"""
