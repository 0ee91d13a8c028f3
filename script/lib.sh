# SPDX-License-Identifier: MIT
# Set-up that the scripts share. Sourced from the project's root.

say() { printf '==> %s\n' "$*"; }

fail() {
  printf 'ehsid: %s\n' "$*" >&2
  exit 1
}

# Runs apt as root, through sudo where it asks for no password; says what it does. False where neither works.
apt_install() {
  command -v apt-get >/dev/null 2>&1 || return 1
  local as_root=() log
  if [ "$(id -u)" -ne 0 ]; then
    sudo -n true 2>/dev/null || return 1
    as_root=(sudo -n)
  fi
  say "installing with apt: $*"
  log=$(mktemp)
  if [ "${apt_lists:-}" != read ]; then
    "${as_root[@]}" apt-get update -qq >"$log" 2>&1 || true # an old list may do
    apt_lists=read
  fi
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "$@" >>"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    return 1
  fi
  rm -f "$log"
}

# is_there COMMAND_OR_FILE: a file is named with its folder: `cmake` is the command, not our folder of that name.
is_there() { command -v "$1" >/dev/null 2>&1 || { [[ $1 == */* ]] && [ -e "$1" ]; }; }

# need COMMAND_OR_FILE PACKAGE...: installs the packages unless the command or file is there.
need() {
  local wanted=$1
  shift
  is_there "$wanted" && return
  apt_install "$@" || fail "$wanted is missing and could not be installed; install by hand: $*"
}

# need_clang: clang with its sanitizers and libFuzzer, which come in a package of the same version.
need_clang() {
  local runtime version
  need clang++ clang
  runtime=$(clang++ -print-file-name=libclang_rt.fuzzer-"$(uname -m)".a)
  if [ ! -e "$runtime" ] && [ ! -e "$(clang++ -print-runtime-dir)/libclang_rt.fuzzer.a" ]; then
    version=$(clang++ -dumpversion)
    apt_install "libclang-rt-${version%%.*}-dev" ||
      fail "clang has no sanitizers and no libFuzzer; install by hand: libclang-rt-${version%%.*}-dev"
  fi
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

# requirements GROUP...: what pyproject.toml asks for, one a line. GROUP is `build`, `run` or the name of an extra.
requirements() {
  .venv/bin/python - "$@" <<'PY'
import sys
import tomllib

with open("pyproject.toml", "rb") as file:
    project = tomllib.load(file)
groups = project["project"]["optional-dependencies"] | {
    # Without pip's isolation scikit-build-core does not add CMake and Ninja itself.
    "build": project["build-system"]["requires"] + ["cmake", "ninja"],
    "run": project["project"]["dependencies"],
}
print(*sorted({line for name in sys.argv[1:] for line in groups[name]}), sep="\n")
PY
}

# Checksum of all that the installed package is made of.
sources_stamp() {
  find pyproject.toml CMakeLists.txt README.md cpp bindings cmake python -type f ! -path '*__pycache__*' -print0 |
    LC_ALL=C sort -z | xargs -0 cksum | cksum
}

# ready_wheel STAMP: the wheel that script/wheel left in dist/, where its file made-of says that it was made of the sources
# with this stamp, and its digest and version of Python fit. False otherwise.
ready_wheel() {
  local python wheel
  [ "$(sed -n 1p dist/made-of 2>/dev/null)" = "$1" ] || return 1
  (cd dist && sed 1d made-of | sha256sum --check --status) || return 1
  wheel=$(sed -n '2s/^[0-9a-f]*  //p' dist/made-of)
  python=$(.venv/bin/python -c 'import sys; print("cp%d%d" % sys.version_info[:2])')
  [[ $wheel == *-$python-* ]] && printf 'dist/%s' "$wheel"
}

# make_venv: .venv with pip.
make_venv() {
  local python
  python=$(find_python) || {
    apt_install python3 python3-venv python3-dev || true
    python=$(find_python) || fail "Python >= 3.11 is needed and was not found"
  }
  if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    say "making .venv"
    "$python" -m venv --clear .venv >/dev/null 2>&1 || {
      apt_install python3-venv python3-dev || fail "python3-venv is missing; install it by hand"
      "$python" -m venv --clear .venv || fail "$python could not make .venv; its message stands above"
    }
  fi
}

# need_compiler: a compiler, and the headers of the Python of .venv.
need_compiler() {
  need c++ g++
  .venv/bin/python -c 'import sysconfig, os, sys
sys.exit(not os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h")))' ||
    apt_install python3-dev || fail "Python's headers are missing; install python3-dev by hand"
}

# install_packages GROUP...: the packages of others that the groups ask for, into .venv. Where one has no wheel, pip
# builds it in an environment of its own.
install_packages() {
  local wanted known=.venv/ehsid-requirements
  wanted=$(requirements "$@") || fail "pyproject.toml does not say what is needed; its message stands above"
  if [ -n "$(comm -23 <(sort <<<"$wanted") <(sort "$known" 2>/dev/null))" ]; then
    say "installing what ehsid needs into .venv: $(wc -l <<<"$wanted") packages and theirs"
    .venv/bin/python -m pip install -q --disable-pip-version-check -r /dev/stdin <<<"$wanted" ||
      fail "pip could not install the packages that ehsid needs; its message stands above"
    printf '%s\n' "$wanted" >>"$known"
  fi
}

# compile_wheel FOLDER [OPTION-OF-PIP]: ehsid as a wheel, with the build tools that are in .venv. In an environment of its
# own every path would be new each time, and everything would be compiled again.
compile_wheel() {
  CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)} PATH="$PWD/.venv/bin:$PATH" \
    .venv/bin/python -m pip wheel "${2:--q}" --disable-pip-version-check --no-build-isolation --no-deps -w "$1" .
}

# tell_compiled PROCESS LOG: now and then how many files are compiled, until the process ends.
tell_compiled() {
  local done
  while kill -0 "$1" 2>/dev/null; do
    done=$(grep -o '\[[0-9]*/[0-9]*\]' "$2" | tail -n 1 || true)
    [ $((SECONDS % 15)) -ne 0 ] || say "compiling ehsid ${done:+$done }..."
    sleep 1
  done
}

# set_up EXTRA...: .venv with the project, its dependencies and those of the extras named, e.g. `test lint`. ehsid is
# compiled while the packages of others are fetched, which keeps one core busy at most. Without extras nobody changes
# ehsid: then a ready wheel is taken where there is one.
set_up() {
  local stamp new=yes ready wheel=.venv/ehsid-wheel compiler=
  make_venv
  stamp=$(sources_stamp)
  [ "$(cat .venv/ehsid-stamp 2>/dev/null)" != "$stamp" ] || new=
  if [ -n "$new" ]; then
    rm -rf "$wheel"
    mkdir "$wheel"
  fi
  if [ $# -eq 0 ] && ready=$(ready_wheel "$stamp"); then
    [ -z "$new" ] || { say "taking $ready, which was made of these sources" && cp "$ready" "$wheel"; }
  else
    need_compiler
    install_packages build
    if [ -n "$new" ]; then
      say "compiling ehsid for .venv: some minutes the first time"
      compile_wheel "$wheel" -v >"$wheel/log" 2>&1 &
      compiler=$!
    fi
  fi
  (install_packages run "$@") || {
    [ -z "$compiler" ] || wait "$compiler" || true # it may not write into a folder that is tried again
    exit 1
  }
  if [ -n "$compiler" ]; then
    tell_compiled "$compiler" "$wheel/log"
    wait "$compiler" || {
      cat "$wheel/log" >&2
      fail "ehsid could not be compiled; the compiler's message stands above"
    }
  fi
  if [ -n "$new" ]; then
    .venv/bin/python -m pip install -q --disable-pip-version-check --force-reinstall --no-deps "$wheel"/*.whl ||
      fail "ehsid could not be installed into .venv; pip's message stands above"
    .venv/bin/python -m pip check --disable-pip-version-check >/dev/null ||
      .venv/bin/python -m pip check --disable-pip-version-check ||
      fail "the packages in .venv do not fit together; remove .venv and start again"
    rm -rf "$wheel"
    printf '%s' "$stamp" >.venv/ehsid-stamp
  fi
}

# from_nothing COMMAND...: runs the command in a new folder below TMPDIR, with an empty HOME and no cache of pip or of a
# compiler, so that nothing this machine remembers can hide a missing step. The folder holds the files that git knows
# or would add, with changes that are not committed. It is removed where the command succeeds, and kept where it fails.
from_nothing() {
  local top changes status=0
  need git git
  top=$(mktemp -d "${TMPDIR:-/tmp}/ehsid-fresh.XXXXXX")
  git clone -q . "$top/ehsid"
  changes=$(git status --porcelain | wc -l)
  if [ "$changes" -gt 0 ]; then
    say "$changes files differ from the last commit: they are tested as they are now"
    git diff --quiet HEAD || git diff --binary HEAD | git -C "$top/ehsid" apply --whitespace=nowarn
    git ls-files -z --others --exclude-standard | xargs -0 -r cp --parents -t "$top/ehsid"
  fi
  mkdir "$top/home"
  say "from nothing, in $top/ehsid"
  (
    cd "$top/ehsid" || exit
    unset VIRTUAL_ENV PYTHONPATH PYTHONHOME XDG_CACHE_HOME XDG_CONFIG_HOME XDG_DATA_HOME MPLCONFIGDIR NUMBA_CACHE_DIR
    HOME=$top/home PIP_NO_CACHE_DIR=1 CCACHE_DISABLE=1 "$@"
  ) || status=$?
  if [ "$status" -eq 0 ]; then
    rm -rf "$top"
  else
    say "kept to look at: $top/ehsid"
  fi
  return "$status"
}
