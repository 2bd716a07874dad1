"""Hook of the build: a wheel carries the Awiwi hand of `generated/` compiled, so that it runs without a compiler."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompiledHand(BuildHookInterface):
    """Compiles and adds the package that `awiwi_gen.load()` loads; `make wheel` and pip run it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the files and say for which platforms they are. An editable installation compiles what it calls."""
        if version == "editable":
            return
        sys.path.insert(0, self.root)
        from awiwi_gen.cache import Cache
        from awiwi_gen.errors import AwiwiError
        from awiwi_gen.shipped import DEFAULT
        from awiwi_gen.wheel import package_files, wheel_tag

        try:
            files = package_files(Path(self.root, "generated"), Cache())
        except AwiwiError as error:
            sys.exit(f"the wheel of awiwi_gen carries compiled C: {error}")
        self.folder = tempfile.mkdtemp()
        for name, data in files.items():
            path = Path(self.folder, name)
            path.write_bytes(data)
            os.chmod(path, 0o644)
            build_data["force_include"][str(path)] = f"{DEFAULT.replace('.', '/')}/{name}"
        build_data |= {"pure_python": False, "tag": wheel_tag(files)}

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was added: it is in the wheel now."""
        if version != "editable":
            shutil.rmtree(self.folder)
