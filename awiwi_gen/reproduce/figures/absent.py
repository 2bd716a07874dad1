"""The figures of Part II that are not computed again, and why."""

ABSENT = {
    "8.1": "drawing: two springs in series",
    "8.2": "block diagram of the stiffness correction",
    "8.3b": "measured; figure 8.3 is the simulated one",
    "9.1": "block diagram of the observer",
    "9.2": "missing in the source",
    "9.3c, 9.3d": "measured; figure 9.3 is the simulated one",
    "12.1": "drawing: a mass on a spring",
    "12.2": "drawing: a motor and a link on a spring",
    "13.1": "drawing: a mass on a spring",
    "14.1": "drawing: a motor that pulls a tendon",
    "14.2": "drawing: a motor and a link on a spring",
    "15.5": "drawing: a motor and a link on a spring",
    "15.6": "drawing: where the matrix of a system in strict feedback form is not zero",
    "15.9": "block diagram: a limit between law and plant",
    "15.12": "block diagram: delays between law and plant",
    "15.14": "photograph of a test stand",
    "16.1": "block diagram of the simulation",
}
