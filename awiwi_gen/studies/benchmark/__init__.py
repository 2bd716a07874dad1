"""One antagonistic joint of a hand, the same scenarios for every law: `awiwi-gen simulate`."""
