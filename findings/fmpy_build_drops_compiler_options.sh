#!/bin/sh
# fmpy builds the sources of an FMU without the compiler options that its buildDescription.xml asks for.
#
# Expected. FMI 3.0: a SourceFileSet of buildDescription.xml names the `compilerOptions` of its sources, and who builds them
#   uses these. fmpy's SourceFileSet has a field of this name.
# Observed. fmpy 0.3.32 passes preprocessor definitions, the language and the list of sources on to CMake. The field stays
#   None, and the options are dropped without a word. A source that needs one (-funsigned-char here; -ffp-contract=off
#   for the same bits on other processors) compiles and computes something else.
# Cost. The binary is another program than the one that its author tested.
# Needs a C compiler.
set -eu
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT INT TERM
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --no-compile --disable-pip-version-check fmpy==0.3.32 cmake==4.4.5
mkdir -p unit/sources build

cat > unit/modelDescription.xml <<'EOF'
<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="unit" instantiationToken="unit">
  <CoSimulation modelIdentifier="unit"/>
  <ModelVariables><Float64 name="time" valueReference="0" causality="independent"/></ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
EOF
cat > unit/sources/buildDescription.xml <<'EOF'
<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="unit">
    <SourceFileSet language="C99" compilerOptions="-funsigned-char">
      <SourceFile name="unit.c"/>
      <PreprocessorDefinition name="COUNT" value="200"/>
    </SourceFileSet>
  </BuildConfiguration>
</fmiBuildDescription>
EOF
echo 'int reading(void) { volatile char count = (char)COUNT; return count; }' > unit/sources/unit.c

PATH="$tmp/venv/bin:$PATH" venv/bin/python - <<'EOF'
import ctypes
import platform
import sys
from importlib.metadata import version
from pathlib import Path

from fmpy import read_model_description
from fmpy.build import build_platform_binary

options = read_model_description("unit").buildConfigurations[0].sourceFileSets[0].compilerOptions
build_platform_binary(Path("unit").resolve(), Path("build").resolve())
(library,) = Path("unit/binaries").rglob("unit.so")
found = ctypes.CDLL(str(library.resolve())).reading()
print(f"fmpy {version('fmpy')}, {platform.machine()}")
print("expected: options -funsigned-char, and 200: a char without a sign")
print(f"observed: options {options}, and {found}")
sys.exit(not (options is None and found == -56))
EOF
