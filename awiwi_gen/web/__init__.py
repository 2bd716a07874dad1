"""The hand on a page: `live` puts together its kernels as WebAssembly (`module`), a `scene` of it, and the scripts."""

from awiwi_gen.web.live import Live, live_hand, script, style

__all__ = ["Live", "live_hand", "script", "style"]
