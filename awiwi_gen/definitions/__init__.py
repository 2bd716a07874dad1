"""Every system and every control law by its equations, in SymPy.

`witnesses/` derives the same quantities by another route, in the module of the same name. The two wings share nothing
but `structure.py` and the hand's numbers; neither imports the other.
"""
