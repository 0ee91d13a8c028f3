# SPDX-License-Identifier: MIT
# Set-up shared by script/demo and script/test. Sourced from the project's root.

say() { printf '==> %s\n' "$*"; }

fail() {
  printf 'ehsid: %s\n' "$*" >&2
  exit 1
}

# Runs apt as root, through sudo where it asks for no password; says what it does. False where neither works.
apt_install() {
  command -v apt-get >/dev/null 2>&1 || return 1
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    sudo -n true 2>/dev/null || return 1
    as_root=(sudo -n)
  fi
  say "installing with apt: $*"
  "${as_root[@]}" apt-get update -qq >/dev/null 2>&1 || true
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" \
    >/dev/null 2>&1
}

# need COMMAND_OR_FILE PACKAGE...: installs the packages unless the command or file is there.
need() {
  local wanted=$1
  shift
  if command -v "$wanted" >/dev/null 2>&1 || [ -e "$wanted" ]; then
    return 0
  fi
  apt_install "$@" || fail "$wanted is missing and could not be installed; install by hand: $*"
}

# A Python of at least 3.11, the newest there is.
find_python() {
  local candidate
  for candidate in python3.14 python3.13 python3.12 python3.11 python3; do
    if command -v "$candidate" >/dev/null 2>&1 &&
      "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      command -v "$candidate"
      return 0
    fi
  done
  return 1
}

# set_up EXTRA: .venv with the project and its dependencies; EXTRA is '' or e.g. '[test,lint]'.
set_up() {
  local python
  need c++ g++
  python=$(find_python) || {
    apt_install python3 python3-venv python3-dev || true
    python=$(find_python) || fail "Python >= 3.11 is needed and was not found"
  }
  if [ ! -x .venv/bin/python ]; then
    say "making .venv"
    "$python" -m venv .venv >/dev/null 2>&1 || {
      apt_install python3-venv python3-dev || fail "python3-venv is missing; install it by hand"
      "$python" -m venv --clear .venv
    }
  fi
  .venv/bin/python -c 'import sysconfig, os, sys
sys.exit(not os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h")))' ||
    apt_install python3-dev || fail "Python's headers are missing; install python3-dev by hand"
  local stamp
  stamp="$1 $(cat pyproject.toml CMakeLists.txt | cksum) $(find cpp bindings cmake python -type f \
    ! -path '*__pycache__*' -print0 | sort -z | xargs -0 cat | cksum)"
  if [ "$(cat .venv/ehsid-stamp 2>/dev/null)" != "$stamp" ]; then
    say "installing ehsid and what it needs into .venv (compiles the estimator: 2 to 4 minutes the first time)"
    # The build's own needs go into .venv too: in a fresh folder each time, as pip would have them, every
    # path changes and everything is compiled again.
    local build_needs
    build_needs=$("$python" -c 'import tomllib
print("\n".join(tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"]))')
    printf '%s\n' "$build_needs" cmake ninja | .venv/bin/python -m pip install -q \
      --disable-pip-version-check -r /dev/stdin || fail "pip install failed"
    CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)} PATH="$PWD/.venv/bin:$PATH" \
      .venv/bin/python -m pip install -q --disable-pip-version-check --no-build-isolation ".$1" ||
      fail "pip install failed"
    printf '%s' "$stamp" >.venv/ehsid-stamp
  fi
}
