"""Studies of the compiled hand: what the source shows in its figures, computed again."""
