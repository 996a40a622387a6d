"""Flinch: a partly sensorised robot arm that gives way with all of its body.

A tick walks once through the rooms: sense, place, clean, measure, decide, move.
Between rooms travel only frozen values (`app.messages`); whoever watches sees snapshots.
"""

__version__ = "0.1.0"
