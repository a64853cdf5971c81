"""io: in, files of other programs; out, measurements and structures; and back.

Not known here: physics, probability.
"""
