"""`awiwi-gen diff`: what an edit of the hand file does to the physics.

`hands` reads two files or two revisions, `figures` computes what a finger can do with the derivative by every number,
`kernels` compares outputs and costs, `difference` puts all of it together, and `text` prints it.
"""
