"""Models of other programs: MJCF and URDF in and out, and tables of masses.

    file -> mjcf -> Model -> draft -> DraftHand -> toml -> hand file      (import)
    hand file -> Hand -> export_mjcf, export_urdf -> file                 (export)

`fingers` finds chains in the tree, `frames` chooses link frames, `mimics` counts the angles of joints that follow
others, `names` makes names that C can have. Both roads end with a report of what is lost.
"""
