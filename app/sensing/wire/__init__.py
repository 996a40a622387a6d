"""What skins say over a wire: one format a file, each a pure function of bytes.

`detect` finds out which format speaks. Every decoder eats chunks of bytes of any size, gives
whole frames, counts by reason what it refused, never raises, and holds a bounded rest.
"""
