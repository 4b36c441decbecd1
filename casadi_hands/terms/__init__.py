"""The costs of the method, a family a file; each a pure function of symbols that returns a residual.

Lengths are in units of the characteristic length, forces in m·g, time in seconds.
"""
