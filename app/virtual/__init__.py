"""Devices that are not there, on the same wires as real ones: a skin and a UR.

For trying things out, for tests and for benches; what runs a real arm never imports them.
"""
