"""The source's figures and printed numbers, computed again, and the page that shows them: `awiwi-gen report`."""

from awiwi_gen.reproduce.page import publish, summary, verdict

__all__ = ["publish", "summary", "verdict"]
